//! The pixels of two photographs where both lie on the panorama.

use trueup_core::raster::Raster;

/// Highest gray value.
pub(super) const WHITE: f64 = 255.0;

/// Two photographs on one grid of pixels.
#[derive(Debug, Clone, Copy)]
pub struct OverlapPixels<'a> {
    /// Gray values of the first, 0 to 255, one channel.
    pub a: &'a Raster<f32>,
    /// Gray values of the second, of the same size.
    pub b: &'a Raster<f32>,
    /// Whether a pixel is covered by both, of the same size.
    pub covered: &'a Raster<bool>,
}

/// The pixels whose square neighborhood up to `radius` pixels away is covered; none at the raster's border.
pub(super) fn eroded(covered: &Raster<bool>, radius: usize) -> Raster<bool> {
    let (width, height) = (covered.width(), covered.height());
    let along_rows = all_within(width, height, radius, |x, y| covered.pixel(x, y)[0]);
    let along_columns = all_within(height, width, radius, |y, x| along_rows[y * width + x]);
    let mut eroded = Raster::new(width, height, 1);
    for y in 0..height {
        for (x, inside) in eroded.row_mut(y).iter_mut().enumerate() {
            *inside = along_columns[x * height + y];
        }
    }
    eroded
}

/// For each of `lines` lines of `length` values, whether all within `radius` of it along the line hold; line after
/// line.
fn all_within(length: usize, lines: usize, radius: usize, holds: impl Fn(usize, usize) -> bool) -> Vec<bool> {
    let mut all = vec![false; length * lines];
    for line in 0..lines {
        let mut run = 0;
        for end in 0..length {
            run = if holds(end, line) { run + 1 } else { 0 };
            if run > 2 * radius {
                all[line * length + end - radius] = true;
            }
        }
    }
    all
}
