//! The base: how each photograph's grid would lie if only the prior were asked.
//!
//! The similarity energies compare every grid edge with the base, so the base decides which shape is free of cost.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::{roll_from_down, rotation_about_x};
use trueup_core::mesh::GridMesh;

use super::complex::{conjugate_product, product};
use super::options::{BaseShape, MeshOptions};
use super::sphere_view::{SphereView, derivative_at_center};
use crate::cameras::{FlatScene, PlaneCamera};
use crate::full_turn::is_moderate;
use crate::horizon::goes_round_horizon;
use crate::similarity::SimilarityPrior;

/// What the prior wants of one photograph.
#[derive(Debug, Clone, Copy)]
struct WantedSimilarity {
    /// Scale s_i.
    scale: f64,
    /// Clockwise rotation theta_i in radians.
    theta: f64,
    /// Panorama units per radian of the sphere, the same for all photographs: the mean of s_i f_i.
    units_per_radian: f64,
}

/// The bases of all photographs under a similarity prior.
///
/// `cameras` are those that the prior was made from; the bases follow them as the prior's lines correct them.
///
/// Where the photographs together look more than 40 degrees up or down and one looks at a pole, the sphere is tilted so
/// that their mean direction is level: verticals then converge as they do for the eye, and nothing is torn.
pub fn bases(cameras: &[Camera], grids: &[GridMesh], prior: &SimilarityPrior, options: &MeshOptions) -> Vec<BaseMap> {
    let cameras = &prior.corrected_cameras(cameras);
    let units_per_radian = units_per_radian(cameras, prior);
    let level_from_world = prior.level_from_world();
    let tilt = tilt_from_level(sized(cameras, grids), &level_from_world);
    let frame = tilt.unwrap_or_else(Matrix3::identity) * level_from_world;
    (0..grids.len())
        .map(|k| {
            // The prior's deviation from the cameras' own roll holds in the tilted frame too.
            let down = cameras[k].rotation() * frame.row(1).transpose();
            let theta = match tilt {
                Some(_) => roll_from_down(&down) + prior.theta[k] - prior.roll[k],
                None => prior.theta[k],
            };
            let wanted = WantedSimilarity { scale: prior.scale[k], theta, units_per_radian };
            BaseMap::new(options, &cameras[k], &grids[k], &frame, wanted)
        })
        .collect()
}

/// Panorama units per radian of the sphere that the prior means.
fn units_per_radian(cameras: &[Camera], prior: &SimilarityPrior) -> f64 {
    let scaled_focal: f64 = cameras.iter().zip(&prior.scale).map(|(camera, scale)| camera.focal_px * scale).sum();
    scaled_focal / cameras.len().max(1) as f64
}

/// Length of a full turn on the unrolled sphere of [`bases`], in panorama units.
pub fn turn_length(cameras: &[Camera], prior: &SimilarityPrior) -> f64 {
    TAU * units_per_radian(&prior.corrected_cameras(cameras), prior)
}

/// Whether the panorama of [`bases`] is tilted, so that its rows are not those of the level world.
pub fn tilts(cameras: &[Camera], grids: &[GridMesh], prior: &SimilarityPrior) -> bool {
    tilt_from_level(sized(&prior.corrected_cameras(cameras), grids), &prior.level_from_world()).is_some()
}

/// Cameras with the sizes of their photographs.
fn sized<'a>(cameras: &'a [Camera], grids: &'a [GridMesh]) -> impl Iterator<Item = (&'a Camera, [f64; 2])> + Clone {
    cameras.iter().zip(grids.iter().map(|grid| [grid.width, grid.height]))
}

/// Pitch of what is looked at steeply, radians, 40 degrees.
const STEEP: f64 = 0.7;

/// The turn about the horizontal axis that brings a steep panorama's mean direction level; `None` if it is not steep,
/// or shows the horizon all round as well, as a drone's does beside photographs that look down. Photographs are cameras
/// with their sizes.
pub(crate) fn tilt_from_level<'a>(
    photographs: impl Iterator<Item = (&'a Camera, [f64; 2])> + Clone,
    level_from_world: &Matrix3<f64>,
) -> Option<Matrix3<f64>> {
    /// Length of the mean direction below which the photographs look all round and have none.
    const ONE_WAY: f64 = 0.5;
    let forwards: Vec<Vector3<f64>> =
        photographs.clone().map(|(camera, _)| level_from_world * camera.forward()).collect();
    let forward: Vector3<f64> = forwards.iter().sum();
    let pitch = forward.y.atan2(forward.z);
    let reaches_pole = forwards.iter().any(|&forward| !is_moderate(forward));
    let one_way = forward.norm() >= ONE_WAY * forwards.len() as f64;
    let is_steep = reaches_pole && one_way && pitch.abs() > STEEP;
    (is_steep && !goes_round_horizon(photographs, level_from_world)).then(|| rotation_about_x(pitch))
}

/// The base of one photograph: a smooth map from its pixels to panorama units, up to translation.
///
/// # Departures
/// The published prior is one similarity per photograph. Photographs that look up cannot follow it: their overlaps meet
/// along meridians that converge, and the compromise tilts every photograph's own verticals. The sphere's own shape
/// satisfies the overlaps and the prior at once; where the view is narrow or level it differs little from the
/// similarity.
#[derive(Debug, Clone)]
pub struct BaseMap {
    /// Factor on the plane, the unrolled sphere, or the photograph itself, as a complex number.
    factor: Vector2<f64>,
    view: BaseView,
}

/// What of a photograph is scaled and turned.
#[derive(Debug, Clone)]
enum BaseView {
    /// The photograph itself.
    Photograph,
    /// What it shows of the level sphere, unrolled.
    Sphere(Box<SphereView>),
    /// What it shows of a flat scene.
    Plane(PlaneCamera),
    /// The photograph as the cameras draw it.
    Drawn(Box<GridMesh>),
}

/// The bases of photographs of a flat scene: as they lie on its plane, at their median scale.
///
/// # Departures
/// The published prior is one similarity per photograph, which only photographs taken straight on have on a plane.
pub fn bases_on_plane(scene: &FlatScene) -> Vec<BaseMap> {
    let factor = Vector2::new(scene.pixels_per_unit(), 0.0);
    scene.cameras.iter().map(|&camera| BaseMap { factor, view: BaseView::Plane(camera) }).collect()
}

/// The bases of photographs that the cameras draw: as they are drawn in `meshes`, less `origin`.
pub fn bases_on_drawing(meshes: &[GridMesh], origin: Vector2<f64>) -> Vec<BaseMap> {
    let base = |mesh: &GridMesh| BaseMap {
        factor: Vector2::new(1.0, 0.0),
        view: BaseView::Drawn(Box::new(mesh.moved_by(-origin))),
    };
    meshes.iter().map(base).collect()
}

impl BaseMap {
    /// The base of a photograph: on the level sphere, turned so that its rotation at the photograph's center is the
    /// wanted one. A photograph whose center is within 20 degrees of a pole cannot be unrolled; it gets the plain
    /// similarity.
    fn new(
        options: &MeshOptions,
        camera: &Camera,
        grid: &GridMesh,
        level_from_world: &Matrix3<f64>,
        wanted: WantedSimilarity,
    ) -> Self {
        let similarity = Vector2::new(wanted.theta.cos(), wanted.theta.sin()) * wanted.scale;
        let plain = Self { factor: similarity, view: BaseView::Photograph };
        if options.base == BaseShape::Similarity {
            return plain;
        }
        let view = SphereView::new(options.conformality, camera, grid, level_from_world);
        if !is_moderate(view.forward) {
            return plain;
        }
        let at_center = derivative_at_center(options.conformality, &view.level_from_camera, camera.focal_px);
        let turn = conjugate_product(at_center, similarity).normalize();
        Self { factor: turn * wanted.units_per_radian, view: BaseView::Sphere(Box::new(view)) }
    }

    /// The photograph of a camera on the level sphere, upright.
    #[cfg(test)]
    pub(super) fn on_level_sphere(
        camera: &Camera,
        grid: &GridMesh,
        units_per_radian: f64,
        options: &MeshOptions,
    ) -> Self {
        let wanted = WantedSimilarity { scale: 1.0, theta: 0.0, units_per_radian };
        Self::new(options, camera, grid, &Matrix3::identity(), wanted)
    }

    /// The plain similarity of a photograph.
    pub fn similarity(scale: f64, theta: f64) -> Self {
        Self { factor: Vector2::new(scale * theta.cos(), scale * theta.sin()), view: BaseView::Photograph }
    }

    /// The place of a pixel. Not a number where a photograph of a flat scene looks past its plane, which no vertex of
    /// those whose cameras were found does.
    pub fn at(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        let seen = match &self.view {
            BaseView::Photograph => pixel,
            BaseView::Sphere(view) => view.unrolled(pixel),
            BaseView::Drawn(mesh) => mesh.warp(pixel),
            BaseView::Plane(camera) => camera.place(pixel).unwrap_or(Vector2::repeat(f64::NAN)),
        };
        product(self.factor, seen)
    }

    /// The places of all vertices of a grid, row-major.
    pub fn places(&self, grid: &GridMesh) -> Vec<Vector2<f64>> {
        (0..grid.len()).map(|vertex| self.at(grid.source(vertex))).collect()
    }

    /// How far the base at `pixel` is from its own bilinear interpolation over the grid's cell, whose `places` are
    /// given.
    pub fn sag(&self, grid: &GridMesh, places: &[Vector2<f64>], pixel: Vector2<f64>) -> Vector2<f64> {
        if matches!(self.view, BaseView::Photograph) {
            return Vector2::zeros();
        }
        let (corners, shares) = grid.bilinear(pixel);
        let straight = (0..4).fold(Vector2::zeros(), |sum, k| sum + places[corners[k]] * shares[k]);
        self.at(pixel) - straight
    }
}

/// The grids as their bases place them.
pub(super) fn placed(grids: &[GridMesh], places: &[Vec<Vector2<f64>>]) -> Vec<GridMesh> {
    let one = |(grid, places): (&GridMesh, &Vec<Vector2<f64>>)| GridMesh {
        target: places.iter().map(|&place| place.into()).collect(),
        ..grid.clone()
    };
    grids.iter().zip(places).map(one).collect()
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_y, rotation_about_z};

    use super::*;

    fn camera(yaw: f64, pitch: f64, roll: f64) -> Camera {
        let world_from_camera = rotation_about_y(yaw) * rotation_about_x(pitch) * rotation_about_z(roll);
        Camera::new(700.0, 800.0, 600.0, &world_from_camera.transpose())
    }

    /// The base's direction at the center, from finite differences over one small grid, must be upright.
    #[test]
    fn a_photograph_turned_by_its_roll_stands_upright_at_the_center() {
        let grid = GridMesh::regular(800.0, 600.0, 2.0);
        for conformality in [0.0, 0.8, 1.0] {
            let options = MeshOptions { conformality, ..MeshOptions::default() };
            let camera = camera(0.7, -0.4, 0.2);
            let wanted = WantedSimilarity { scale: 1.0, theta: 0.2, units_per_radian: 700.0 };
            let base = BaseMap::new(&options, &camera, &grid, &Matrix3::identity(), wanted).places(&grid);
            // Down in the photograph is (sin roll, cos roll) where the camera's roll is 0.2.
            let center = grid.columns * (grid.rows / 2) + grid.columns / 2;
            let down = Vector2::new(0.2_f64.sin(), 0.2_f64.cos());
            let by_x = (base[center + 1] - base[center - 1]) / (2.0 * grid.cell_width());
            let by_y = (base[center + grid.columns] - base[center - grid.columns]) / (2.0 * grid.cell_height());
            let moved = by_x * down.x + by_y * down.y;
            assert!((moved.x / moved.y).abs() < 1e-4, "{conformality}: {moved}");
        }
    }

    /// A full turn that looks up a little has its mean direction near the pole without looking there.
    #[test]
    fn only_photographs_that_look_one_way_are_tilted_level() {
        let tilt = |cameras: &[Camera]| {
            let sized = cameras.iter().map(|camera| (camera, [800.0, 600.0]));
            tilt_from_level(sized, &Matrix3::identity())
        };
        let turn: Vec<Camera> = (0..12).map(|k| camera(f64::from(k) * TAU / 12.0, 1.25, 0.0)).collect();
        assert!(tilt(&turn[..1]).is_some());
        let lower: Vec<Camera> = (0..12).map(|k| camera(f64::from(k) * TAU / 12.0, -0.5, 0.0)).collect();
        assert!(tilt(&[turn.clone(), lower].concat()).is_none());
        // Most look steeply, as a drone's do; eight look round, 20 degrees aside of level.
        let round: Vec<Camera> = (0..8).map(|k| camera(f64::from(k) * TAU / 8.0, 0.35, 0.0)).collect();
        assert!(tilt(&[turn.clone(), round.clone()].concat()).is_none());
        assert!(tilt(&[turn, round[..4].to_vec()].concat()).is_some());
    }

    #[test]
    fn photographs_near_a_pole_get_the_plain_similarity() {
        let grid = GridMesh::regular(800.0, 600.0, 40.0);
        let wanted = WantedSimilarity { scale: 1.0, theta: 0.0, units_per_radian: 700.0 };
        let base = BaseMap::new(&MeshOptions::default(), &camera(0.0, -1.3, 0.0), &grid, &Matrix3::identity(), wanted)
            .places(&grid);
        assert!((base[grid.len() - 1] - grid.source(grid.len() - 1)).norm() < 1e-9);
    }
}
