//! Pixels from one photograph to another, by whatever cameras there are.

use nalgebra::Vector2;
use trueup_core::camera::Camera;

use super::plane_camera::PlaneCamera;

/// How pixels of one photograph are carried into another.
#[derive(Debug, Clone, Copy)]
pub enum CameraTransfer<'a> {
    /// As by rays of cameras at one place.
    Rotating(&'a Camera, &'a Camera),
    /// By way of a plane that both see.
    Plane(&'a PlaneCamera, &'a PlaneCamera),
}

impl CameraTransfer<'_> {
    /// Where a pixel is in the other photograph; `None` if it is not seen there.
    pub fn at(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        match self {
            Self::Rotating(from, to) => from.transfer(to, pixel),
            Self::Plane(from, to) => from.transfer(to, pixel),
        }
    }

    /// The camera that pixels are carried to.
    pub fn to(&self) -> &Camera {
        match self {
            Self::Rotating(_, to) => to,
            Self::Plane(_, to) => &to.camera,
        }
    }
}
