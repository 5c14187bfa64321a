//! The pinhole camera of one photograph.

use nalgebra::{Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::geometry::{matrix_from_rows, rows_of};

/// A rotating pinhole camera: square pixels, no skew, no lens distortion, principal point at the photograph's center.
///
/// Bearings `(u - c_x, v - c_y, f)` are in the camera frame (x right, y down, z forward).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Focal length in pixels of the frame the camera belongs to (working pixels inside the pipeline).
    pub focal_px: f64,
    /// Principal point in the same pixels.
    pub principal_point: [f64; 2],
    /// Rows of the rotation from world to camera, the paper's R_i.
    pub camera_from_world: [[f64; 3]; 3],
}

impl Camera {
    /// A camera of focal length `focal_px` looking at the center of a `width` x `height` photograph.
    pub fn new(focal_px: f64, width: f64, height: f64, camera_from_world: &Matrix3<f64>) -> Self {
        Self { focal_px, principal_point: [width / 2.0, height / 2.0], camera_from_world: rows_of(camera_from_world) }
    }

    /// The rotation from world to camera.
    pub fn rotation(&self) -> Matrix3<f64> {
        matrix_from_rows(&self.camera_from_world)
    }

    /// Replaces the rotation from world to camera.
    pub fn set_rotation(&mut self, camera_from_world: &Matrix3<f64>) {
        self.camera_from_world = rows_of(camera_from_world);
    }

    /// The bearing of a pixel in the camera frame, z = 1 (not normalized).
    pub fn bearing(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        Vector3::new(
            (pixel.x - self.principal_point[0]) / self.focal_px,
            (pixel.y - self.principal_point[1]) / self.focal_px,
            1.0,
        )
    }

    /// The pixel of a bearing in the camera frame; `None` behind the camera or within 1e-6 of its plane.
    pub fn project(&self, bearing: Vector3<f64>) -> Option<Vector2<f64>> {
        const MIN_DEPTH: f64 = 1e-6;
        (bearing.z > MIN_DEPTH * bearing.norm()).then(|| {
            Vector2::new(
                self.focal_px * bearing.x / bearing.z + self.principal_point[0],
                self.focal_px * bearing.y / bearing.z + self.principal_point[1],
            )
        })
    }

    /// The direction in the world of a pixel, unit length.
    pub fn world_direction(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        (self.rotation().transpose() * self.bearing(pixel)).normalize()
    }

    /// Where the pixel of this camera appears in `other`, both at one place: `K_j R_j R_i^T K_i^-1`.
    pub fn transfer(&self, other: &Self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        other.project(other.rotation() * (self.rotation().transpose() * self.bearing(pixel)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation_about_y;

    #[test]
    fn a_pan_moves_the_center_by_focal_times_tangent() {
        let first = Camera::new(500.0, 640.0, 480.0, &Matrix3::identity());
        // Turning the camera to the right (camera_from_world = pan^T) moves the old center to the left.
        let pan = rotation_about_y(0.2);
        let second = Camera::new(500.0, 640.0, 480.0, &pan.transpose());
        let moved = first.transfer(&second, Vector2::new(320.0, 240.0)).expect("in front");
        assert!((moved.x - (320.0 - 500.0 * 0.2_f64.tan())).abs() < 1e-9);
        assert!((moved.y - 240.0).abs() < 1e-9);
    }

    #[test]
    fn points_behind_do_not_project() {
        let camera = Camera::new(500.0, 640.0, 480.0, &Matrix3::identity());
        assert!(camera.project(Vector3::new(0.0, 0.0, -1.0)).is_none());
        assert!(camera.project(Vector3::new(1.0, 0.0, 0.0)).is_none());
    }
}
