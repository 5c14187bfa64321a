//! Where light comes in: windows and lamps.

use nalgebra::Vector3;

use crate::color::Rgb;

/// A rectangle that gives light: a window's opening or a lamp.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portal {
    pub(crate) corner: Vector3<f64>,
    pub(crate) side_s: Vector3<f64>,
    pub(crate) side_t: Vector3<f64>,
    /// Unit vector into the scene.
    pub(crate) normal: Vector3<f64>,
    /// Radiance of a lamp; `None` for an opening to the sky.
    pub(crate) radiance: Option<Rgb>,
}
