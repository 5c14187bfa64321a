//! The photographs as their cameras see them, on a plane of directions.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector2};
use trueup_core::camera::Camera;
use trueup_core::geometry::wrap_angle;
use trueup_core::mesh::GridMesh;

use super::super::camera_plane::CameraPlane;
use super::super::options::MeshOptions;
use super::super::subdivision::divided;
use super::corrections::CameraCorrections;
use super::input::ByCamerasInput;
use crate::projection::{PosedPhotograph, Projection, ProjectionOptions, ProjectionView};

/// What is drawn.
pub(super) struct Seen<'a> {
    /// In the level world.
    pub cameras: &'a [Camera],
    /// Over the photographs, in the cameras' pixels.
    pub grids: &'a [GridMesh],
    /// The scene's dominant directions in the level world (columns), if they are known.
    pub dominant: Option<&'a Matrix3<f64>>,
    /// Parts that each cell of the grids is divided into along each side.
    pub subdivision: usize,
}

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
        let ByCamerasInput { cameras, grids, dominant, .. } = *input;
        let seen = Seen { cameras, grids, dominant, subdivision: options.subdivision };
        Self::of(&seen, input.units_per_radian, |k, pixel| pixel + corrections.aside(k, pixel))
    }

    /// Every photograph as its camera sees it, each pixel where `corrected` puts it.
    pub(super) fn of(
        seen: &Seen,
        units_per_radian: f64,
        corrected: impl Fn(usize, Vector2<f64>) -> Vector2<f64>,
    ) -> Self {
        let posed = |(camera, grid): (&Camera, &GridMesh)| PosedPhotograph { camera: *camera, mesh: grid.clone() };
        let posed: Vec<PosedPhotograph> = seen.cameras.iter().zip(seen.grids).map(posed).collect();
        let whole = ProjectionOptions { kind: Projection::Equirectangular, ..ProjectionOptions::default() };
        let view = ProjectionView::choose(&posed, seen.dominant, &whole);
        let plane = CameraPlane { yaw: view.yaw, units_per_radian, origin: [0.0; 2] };
        let drawn = |(k, photograph): (usize, &PosedPhotograph)| {
            let PosedPhotograph { camera, mesh } = photograph;
            let ahead = camera.forward();
            let middle = wrap_angle(ahead.x.atan2(ahead.z) - plane.yaw);
            let mut drawn = divided(mesh, seen.subdivision);
            for vertex in 0..drawn.len() {
                let direction = camera.world_direction(corrected(k, drawn.source(vertex)));
                drawn.target[vertex] = plane.place(direction, middle).into();
            }
            drawn
        };
        let meshes = posed.iter().enumerate().map(drawn).collect();
        Self { meshes, period: view.closed.then_some(TAU * plane.units_per_radian), plane }
    }
}
