//! The photographs as their cameras see them, on a plane of directions.

use std::f64::consts::TAU;

use trueup_core::camera::Camera;
use trueup_core::geometry::wrap_angle;
use trueup_core::mesh::GridMesh;

use super::super::camera_plane::CameraPlane;
use super::super::options::MeshOptions;
use super::super::subdivision::divided;
use super::corrections::CameraCorrections;
use super::input::ByCamerasInput;
use crate::projection::{PosedPhotograph, Projection, ProjectionOptions, ProjectionView};

/// The photographs on the plane.
pub(super) struct Drawing {
    pub meshes: Vec<GridMesh>,
    /// Length of a full turn, where the photographs go all the way round.
    pub period: Option<f64>,
    pub plane: CameraPlane,
}

impl Drawing {
    /// Every photograph as its camera sees it, corrected; divided as the mesh would have been.
    pub(super) fn new(input: &ByCamerasInput, corrections: &CameraCorrections, options: &MeshOptions) -> Self {
        let posed = |(camera, grid): (&Camera, &GridMesh)| PosedPhotograph { camera: *camera, mesh: grid.clone() };
        let posed: Vec<PosedPhotograph> = input.cameras.iter().zip(input.grids).map(posed).collect();
        let whole = ProjectionOptions { kind: Projection::Equirectangular, ..ProjectionOptions::default() };
        let view = ProjectionView::choose(&posed, input.dominant, &whole);
        let plane = CameraPlane { yaw: view.yaw, units_per_radian: input.units_per_radian, origin: [0.0; 2] };
        let drawn = |(k, photograph): (usize, &PosedPhotograph)| {
            let PosedPhotograph { camera, mesh } = photograph;
            let ahead = camera.forward();
            let middle = wrap_angle(ahead.x.atan2(ahead.z) - plane.yaw);
            let mut fine = divided(mesh, options.subdivision);
            for vertex in 0..fine.len() {
                let pixel = fine.source(vertex);
                let direction = camera.world_direction(pixel + corrections.aside(k, pixel));
                fine.target[vertex] = plane.place(direction, middle).into();
            }
            fine
        };
        let meshes = posed.iter().enumerate().map(drawn).collect();
        Self { meshes, period: view.closed.then_some(TAU * plane.units_per_radian), plane }
    }
}
