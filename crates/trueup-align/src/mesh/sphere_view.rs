//! A photograph on the level sphere, unrolled.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;

use crate::full_turn::is_moderate;

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

/// A photograph on the level sphere.
#[derive(Debug, Clone)]
pub(super) struct SphereView {
    /// 0 for the equirectangular projection, 1 for Mercator's.
    conformality: f64,
    camera: Camera,
    pub level_from_camera: Matrix3<f64>,
    pub forward: Vector3<f64>,
    /// Whether no vertex of the photograph's grid comes near a pole.
    moderate_all_over: bool,
}

impl SphereView {
    pub(super) fn new(conformality: f64, camera: &Camera, grid: &GridMesh, level_from_world: &Matrix3<f64>) -> Self {
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
    pub(super) fn unrolled(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        let Some(share) = self.moderate_share(pixel) else { return self.projected(self.ray(pixel)) };
        let center = Vector2::from(self.camera.principal_point);
        let last = center + (pixel - center) * share;
        self.projected(self.ray(last)) + self.derivative(last, pixel - last)
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

    /// How far [`Self::projected`] moves, to first order, as `pixel` moves by `step`.
    fn derivative(&self, pixel: Vector2<f64>, step: Vector2<f64>) -> Vector2<f64> {
        let ray = self.ray(pixel);
        let change = self.level_from_camera * self.camera.bearing_change(pixel, step);
        let horizontal = ray.x.hypot(ray.z);
        let longitude = (ray.z * change.x - ray.x * change.z) / horizontal.powi(2);
        let outward = (ray.x * change.x + ray.z * change.z) / horizontal;
        let latitude = (horizontal * change.y - ray.y * outward) / ray.norm_squared();
        Vector2::new(longitude, latitude / (self.conformality * ray.y.atan2(horizontal)).cos())
    }
}

/// The similarity closest to the projection's derivative at the photograph's center, per pixel.
pub(super) fn derivative_at_center(conformality: f64, level_from_camera: &Matrix3<f64>, focal_px: f64) -> Vector2<f64> {
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
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    fn camera(yaw: f64, pitch: f64, roll: f64) -> Camera {
        let world_from_camera = rotation_about_y(yaw) * rotation_about_x(pitch) * rotation_about_z(roll);
        Camera::new(700.0, 800.0, 600.0, &world_from_camera.transpose())
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
}
