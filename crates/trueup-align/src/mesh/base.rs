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
use crate::similarity::SimilarityPrior;

/// The unrolled place of a latitude (radians): Mercator's projection of a share of it, stretched back to the whole, so
/// that the scale at the horizon is 1. A share of 4/5 is Miller's projection; its derivative is 1 / cos(share
/// latitude).
///
/// # Source
/// O. M. Miller, "Notes on cylindrical world map projections" (1942).
fn unrolled_latitude(latitude: f64, conformality: f64) -> f64 {
    /// Below this share the limit, the latitude itself, is as exact.
    const EQUIRECTANGULAR: f64 = 1e-4;
    if conformality < EQUIRECTANGULAR { latitude } else { (conformality * latitude).tan().asinh() / conformality }
}

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
    let tilt = tilt_from_level(cameras, &level_from_world);
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

/// The turn about the horizontal axis that brings a steep panorama's mean direction level; `None` if it is not steep.
fn tilt_from_level(cameras: &[Camera], level_from_world: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    /// Radians, 40 degrees.
    const STEEP: f64 = 0.7;
    /// Length of the mean direction below which the photographs look all round and have none.
    const ONE_WAY: f64 = 0.5;
    let forwards: Vec<Vector3<f64>> =
        cameras.iter().map(|camera| level_from_world * camera.rotation().row(2).transpose()).collect();
    let forward: Vector3<f64> = forwards.iter().sum();
    let pitch = forward.y.atan2(forward.z);
    let reaches_pole = forwards.iter().any(|&forward| !is_moderate(forward));
    let one_way = forward.norm() >= ONE_WAY * cameras.len() as f64;
    (reaches_pole && one_way && pitch.abs() > STEEP).then(|| rotation_about_x(pitch))
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
    /// Factor on the unrolled sphere, or on the photograph itself, as a complex number.
    factor: Vector2<f64>,
    sphere: Option<SphereView>,
}

/// A photograph on the level sphere.
#[derive(Debug, Clone)]
struct SphereView {
    /// 0 for the equirectangular projection, 1 for Mercator's.
    conformality: f64,
    camera: Camera,
    level_from_camera: Matrix3<f64>,
    forward: Vector3<f64>,
    /// Whether no vertex of the photograph's grid comes near a pole.
    moderate_all_over: bool,
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
        let plain = Self { factor: similarity, sphere: None };
        if options.base == BaseShape::Similarity {
            return plain;
        }
        let view = SphereView::new(options.conformality, camera, grid, level_from_world);
        if !is_moderate(view.forward) {
            return plain;
        }
        let at_center = derivative_at_center(options.conformality, &view.level_from_camera, camera.focal_px);
        let turn = conjugate_product(at_center, similarity).normalize();
        Self { factor: turn * wanted.units_per_radian, sphere: Some(view) }
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
        Self { factor: Vector2::new(scale * theta.cos(), scale * theta.sin()), sphere: None }
    }

    /// The place of a pixel.
    pub fn at(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        product(self.factor, self.sphere.as_ref().map_or(pixel, |view| view.unrolled(pixel)))
    }

    /// The places of all vertices of a grid, row-major.
    pub fn places(&self, grid: &GridMesh) -> Vec<Vector2<f64>> {
        (0..grid.len()).map(|vertex| self.at(grid.source(vertex))).collect()
    }

    /// How far the base at `pixel` is from its own bilinear interpolation over the grid's cell, whose `places` are
    /// given.
    pub fn sag(&self, grid: &GridMesh, places: &[Vector2<f64>], pixel: Vector2<f64>) -> Vector2<f64> {
        if self.sphere.is_none() {
            return Vector2::zeros();
        }
        let (corners, shares) = grid.bilinear(pixel);
        let straight = (0..4).fold(Vector2::zeros(), |sum, k| sum + places[corners[k]] * shares[k]);
        self.at(pixel) - straight
    }
}

impl SphereView {
    fn new(conformality: f64, camera: &Camera, grid: &GridMesh, level_from_world: &Matrix3<f64>) -> Self {
        let level_from_camera = level_from_world * camera.rotation().transpose();
        let forward = level_from_camera.column(2).into_owned();
        let mut view = Self { conformality, camera: *camera, level_from_camera, forward, moderate_all_over: false };
        view.moderate_all_over = (0..grid.len()).all(|vertex| is_moderate(view.ray(grid.source(vertex))));
        view
    }

    fn ray(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        self.level_from_camera * self.camera.bearing(pixel)
    }

    /// Longitude relative to the viewing direction and unrolled latitude of a pixel. Beyond the largest latitude the
    /// unrolled photograph goes on straight, along rays from its center.
    fn unrolled(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        let Some(share) = self.moderate_share(pixel) else { return self.projected(self.ray(pixel)) };
        let center = Vector2::from(self.camera.principal_point);
        let last = center + (pixel - center) * share;
        self.projected(self.ray(last)) + self.derivative(self.ray(last), pixel - last)
    }

    /// The share of the way from the photograph's center to `pixel` after which it is too near a pole; `None` if it is
    /// moderate to the end.
    fn moderate_share(&self, pixel: Vector2<f64>) -> Option<f64> {
        /// Steps in which the first steep place is sought: the way may pass a pole and come back.
        const STEPS: usize = 16;
        /// Halvings of that step: to a millionth of the way.
        const HALVINGS: usize = 16;
        if self.moderate_all_over {
            return None;
        }
        let center = Vector2::from(self.camera.principal_point);
        let steep = |share: f64| !is_moderate(self.ray(center + (pixel - center) * share));
        let first = (1..=STEPS).find(|&step| steep(step as f64 / STEPS as f64))?;
        let (mut inside, mut outside) = ((first - 1) as f64 / STEPS as f64, first as f64 / STEPS as f64);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if steep(middle) { outside = middle } else { inside = middle }
        }
        Some(inside)
    }

    fn projected(&self, ray: Vector3<f64>) -> Vector2<f64> {
        let forward = &self.forward;
        let horizontal = ray.x.hypot(ray.z);
        let longitude = (ray.x * forward.z - ray.z * forward.x).atan2(ray.x * forward.x + ray.z * forward.z);
        Vector2::new(longitude, unrolled_latitude(ray.y.atan2(horizontal), self.conformality))
    }

    /// How far [`Self::projected`] moves, to first order, as the pixel of `ray` (of depth 1) moves by `step`.
    fn derivative(&self, ray: Vector3<f64>, step: Vector2<f64>) -> Vector2<f64> {
        let change = self.level_from_camera * (step / self.camera.focal_px).push(0.0);
        let horizontal = ray.x.hypot(ray.z);
        let longitude = (ray.z * change.x - ray.x * change.z) / horizontal.powi(2);
        let outward = (ray.x * change.x + ray.z * change.z) / horizontal;
        let latitude = (horizontal * change.y - ray.y * outward) / ray.norm_squared();
        Vector2::new(longitude, latitude / (self.conformality * ray.y.atan2(horizontal)).cos())
    }
}

/// Whether a direction in the level world is far enough from the poles to be unrolled.
pub(crate) fn is_moderate(ray: Vector3<f64>) -> bool {
    /// Sine of the largest latitude that is unrolled, 70 degrees.
    const STEEPEST: f64 = 0.94;
    (ray.y / ray.norm()).abs() <= STEEPEST
}

/// The similarity closest to the projection's derivative at the photograph's center, per pixel.
fn derivative_at_center(conformality: f64, level_from_camera: &Matrix3<f64>, focal_px: f64) -> Vector2<f64> {
    let forward: Vector3<f64> = level_from_camera.column(2).into_owned();
    let horizontal = forward.x.hypot(forward.z);
    let east = Vector3::new(forward.z, 0.0, -forward.x) / horizontal;
    let south = forward.cross(&east);
    let latitude = forward.y.atan2(horizontal);
    let (east_scale, south_scale) = (1.0 / horizontal, 1.0 / (conformality * latitude).cos());
    let derivative = |axis: usize| {
        let step = level_from_camera.column(axis) / focal_px;
        Vector2::new(step.dot(&east) * east_scale, step.dot(&south) * south_scale)
    };
    let (dx, dy) = (derivative(0), derivative(1));
    Vector2::new(0.5 * (dx.x + dy.y), 0.5 * (dx.y - dy.x))
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
        let tilt = |cameras: &[Camera]| tilt_from_level(cameras, &Matrix3::identity());
        let turn: Vec<Camera> = (0..12).map(|k| camera(f64::from(k) * TAU / 12.0, 1.25, 0.0)).collect();
        assert!(tilt(&turn[..1]).is_some());
        let lower: Vec<Camera> = (0..12).map(|k| camera(f64::from(k) * TAU / 12.0, -0.5, 0.0)).collect();
        assert!(tilt(&[turn, lower].concat()).is_none());
    }

    /// The corners of a photograph that looks 57 degrees up are beyond the largest latitude: value and slope go on
    /// across it.
    #[test]
    fn steep_corners_go_on_straight() {
        for conformality in [0.0, 0.8, 1.0] {
            let grid = GridMesh::regular(800.0, 600.0, 40.0);
            let view = SphereView::new(conformality, &camera(0.3, 1.0, 0.1), &grid, &Matrix3::identity());
            let (center, corner) = (Vector2::new(400.0, 300.0), Vector2::new(500.0, 0.0));
            let share = view.moderate_share(corner).expect("a steep corner");
            assert!(share > 0.1 && share < 0.99 && view.moderate_share(center).is_none(), "{share}");
            let at = |along: f64| view.unrolled(center + (corner - center) * along);
            let step = 1e-4;
            assert!((at(share + 1e-7) - at(share - 1e-7)).norm() < 1e-5);
            let before = (at(share - step) - at(share - 2.0 * step)) / step;
            let after = (at(1.0) - at(1.0 - step)) / step;
            assert!((before - after).norm() < 2e-3 * before.norm(), "{conformality}: {before} and {after}");
        }
    }

    /// Latitude 60 degrees: ln(2 + sqrt(3)) in Mercator's projection; in Miller's 5/4 ln(tan(45 + 24 degrees)).
    #[test]
    fn conformality_leads_from_the_equirectangular_to_the_mercator_projection() {
        let at = |conformality: f64| unrolled_latitude(60_f64.to_radians(), conformality);
        assert!((at(0.0) - 60_f64.to_radians()).abs() < 1e-12);
        assert!((at(1.0) - (2.0 + 3_f64.sqrt()).ln()).abs() < 1e-12);
        assert!((at(0.8) - 1.25 * 69_f64.to_radians().tan().ln()).abs() < 1e-12);
        assert!((at(2e-4) - at(0.0)).abs() < 1e-6);
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
