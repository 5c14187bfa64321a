//! SSIM: structural similarity of two photographs.

use trueup_core::raster::Raster;

use super::overlap_pixels::{OverlapPixels, WHITE, eroded};

/// Radius of the window: 11 x 11 pixels.
const RADIUS: usize = 5;
/// Standard deviation of the window's Gaussian weights, pixels.
const SIGMA_PX: f64 = 1.5;
/// The constants that keep the quotients finite, as published: (K1 L)^2 and (K2 L)^2.
const C1: f64 = (0.01 * WHITE) * (0.01 * WHITE);
const C2: f64 = (0.03 * WHITE) * (0.03 * WHITE);

/// Mean structural similarity over the windows that lie wholly in the overlap, the gray values multiplied by `gains`;
/// `None` without such a window.
pub(super) fn mean(overlap: &OverlapPixels, gains: [f64; 2]) -> Option<f64> {
    let (width, height) = (overlap.covered.width(), overlap.covered.height());
    let inside = eroded(overlap.covered, RADIUS);
    if !inside.data().contains(&true) {
        return None;
    }
    let scaled = |gray: &Raster<f32>, gain: f64| gray.data().iter().map(|&gray| gain * f64::from(gray)).collect();
    let (a, b): (Vec<f64>, Vec<f64>) = (scaled(overlap.a, gains[0]), scaled(overlap.b, gains[1]));
    let product = |one: &[f64], two: &[f64]| -> Vec<f64> { one.iter().zip(two).map(|(one, two)| one * two).collect() };
    let blurred = |values: &[f64]| blurred(values, width, height);
    let (mean_a, mean_b) = (blurred(&a), blurred(&b));
    let (square_a, square_b, cross) = (blurred(&product(&a, &a)), blurred(&product(&b, &b)), blurred(&product(&a, &b)));
    let (mut sum, mut count) = (0.0, 0_usize);
    for index in (0..inside.data().len()).filter(|&index| inside.data()[index]) {
        let (a, b) = (mean_a[index], mean_b[index]);
        let (variance_a, variance_b) = (square_a[index] - a * a, square_b[index] - b * b);
        let covariance = cross[index] - a * b;
        sum += (2.0 * a * b + C1) * (2.0 * covariance + C2) / ((a * a + b * b + C1) * (variance_a + variance_b + C2));
        count += 1;
    }
    Some(sum / count as f64)
}

/// Gaussian means over the window; 0 where it is cut by the raster's border.
fn blurred(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    let weights = weights();
    let mut along_rows = vec![0.0; values.len()];
    for y in 0..height {
        for x in RADIUS..width.saturating_sub(RADIUS) {
            let first = y * width + x - RADIUS;
            along_rows[y * width + x] =
                weights.iter().zip(&values[first..]).map(|(weight, value)| weight * value).sum();
        }
    }
    let mut blurred = vec![0.0; values.len()];
    for y in RADIUS..height.saturating_sub(RADIUS) {
        for (row, weight) in weights.iter().enumerate() {
            let from = &along_rows[(y + row - RADIUS) * width..][..width];
            for (sum, value) in blurred[y * width..][..width].iter_mut().zip(from) {
                *sum += weight * value;
            }
        }
    }
    blurred
}

fn weights() -> [f64; 2 * RADIUS + 1] {
    let gaussian: [f64; 2 * RADIUS + 1] =
        std::array::from_fn(|k| (-0.5 * ((k as f64 - RADIUS as f64) / SIGMA_PX).powi(2)).exp());
    let sum: f64 = gaussian.iter().sum();
    gaussian.map(|weight| weight / sum)
}
