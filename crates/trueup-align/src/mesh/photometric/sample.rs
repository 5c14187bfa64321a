//! Pixels that lie on each other in the panorama.

use nalgebra::Vector2;

use super::pyramid::Gray;

/// A pixel of the first photograph and what lies on it in the panorama.
pub(super) struct PixelSample {
    pub corners: [[u32; 4]; 2],
    pub shares: [[f64; 4]; 2],
    /// Gray values; their slopes are per panorama unit.
    pub gray: [Gray; 2],
    /// Bilinear place by the solved vertices in the first photograph minus that in the second: what the bases' sags
    /// differ by.
    pub gap: Vector2<f64>,
}

impl PixelSample {
    /// Mean of both photographs' slopes, the second's as the first would show it with a gain.
    pub(super) fn mean_slope(&self, gain: f64) -> Vector2<f64> {
        0.5 * (gain * self.gray[1].slope + self.gray[0].slope)
    }
}
