//! Pixels that lie on each other in the panorama.

use nalgebra::Vector2;

use super::pyramid::Gray;

/// A pixel of the first photograph and what lies on it in the panorama.
pub(super) struct PixelSample {
    /// The cell of each photograph's solved grid, by its first vertex.
    pub cells: [u32; 2],
    /// Where in it, 0 to 1 along both axes.
    pub within: [Vector2<f64>; 2],
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

    /// The shares of the corners of the first photograph's cell (top left, top right, bottom right, bottom left), and
    /// of the second's less than nothing: what the distance of the two places is made of.
    pub(super) fn shares(&self) -> [f64; 8] {
        let [[a, b, c, d], [e, f, g, h]] = self.within.map(|within| {
            let (u, v) = (within.x, within.y);
            [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v]
        });
        [a, b, c, d, -e, -f, -g, -h]
    }
}
