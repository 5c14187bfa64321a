//! Blurred and reduced copies of a photograph, in which photometric alignment looks first coarsely, then finely.

use nalgebra::Vector2;
use trueup_core::raster::Raster;

/// Sizes at which photographs are aligned one after the other, the smallest first.
pub(in crate::mesh) const LEVELS: usize = 3;

/// A photograph's gray values at several sizes, the finest first, each half as large as the one before and blurred by a
/// binomial of standard deviation one of its own pixels.
///
/// Eight bits a pixel: rounding adds 0.3 gray levels, well below any photograph's noise, and 72 photographs of the
/// usual working size take 46 MB.
#[derive(Debug, Clone, PartialEq)]
pub struct GrayPyramid {
    levels: Vec<Raster<u8>>,
}

/// Gray value and its change per working pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gray {
    pub value: f64,
    pub slope: Vector2<f64>,
}

impl GrayPyramid {
    /// Of gray values 0 to 255, one channel; one to three levels, none smaller than needed for a gradient.
    pub fn new(gray: &Raster<u8>) -> Self {
        /// Smallest side of a level, pixels.
        const SMALLEST: usize = 16;
        let mut pyramid = vec![blurred(gray)];
        while pyramid.len() < LEVELS {
            let finer = &pyramid[pyramid.len() - 1];
            if finer.width().min(finer.height()) < 2 * SMALLEST {
                break;
            }
            pyramid.push(blurred(&halved(finer)));
        }
        Self { levels: pyramid }
    }

    /// The gray value at a place in working pixels, in a level (0 the finest; the coarsest there is if there are
    /// fewer); `None` within two of the level's pixels of the border.
    pub(super) fn at(&self, level: usize, point: Vector2<f64>) -> Option<Gray> {
        let level = level.min(self.levels.len() - 1);
        let gray = &self.levels[level];
        let pixel_per_working = 0.5_f64.powi(level as i32);
        let (x, y) = (point.x * pixel_per_working - 0.5, point.y * pixel_per_working - 0.5);
        let inside = x >= 1.0 && y >= 1.0 && x < gray.width() as f64 - 2.0 && y < gray.height() as f64 - 2.0;
        if !inside {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        let (u, v) = (x - column as f64, y - row as f64);
        // Rows of four pixels around: what bilinear interpolation of the value and of central differences needs.
        let rows: [[f64; 4]; 4] = std::array::from_fn(|k| {
            let from = &gray.row(row + k - 1)[column - 1..column + 3];
            std::array::from_fn(|c| f64::from(from[c]))
        });
        let between = |values: [f64; 4]| {
            (values[0] * (1.0 - u) + values[1] * u) * (1.0 - v) + (values[2] * (1.0 - u) + values[3] * u) * v
        };
        let corner = |of: &dyn Fn(usize, usize) -> f64| between([of(1, 1), of(1, 2), of(2, 1), of(2, 2)]);
        let half = 0.5 * pixel_per_working;
        Some(Gray {
            value: corner(&|r, c| rows[r][c]),
            slope: Vector2::new(
                half * corner(&|r, c| rows[r][c + 1] - rows[r][c - 1]),
                half * corner(&|r, c| rows[r + 1][c] - rows[r - 1][c]),
            ),
        })
    }
}

/// Means of 2 x 2 pixels; an odd last row or column is left out.
fn halved(gray: &Raster<u8>) -> Raster<u8> {
    let mut half = Raster::new(gray.width() / 2, gray.height() / 2, 1);
    for y in 0..half.height() {
        let (upper, lower) = (gray.row(2 * y), gray.row(2 * y + 1));
        for (x, mean) in half.row_mut(y).iter_mut().enumerate() {
            let sum: u16 = [upper[2 * x], upper[2 * x + 1], lower[2 * x], lower[2 * x + 1]].map(u16::from).iter().sum();
            *mean = ((sum + 2) / 4) as u8;
        }
    }
    half
}

/// Weights of the binomial of standard deviation 1, in sixteenths.
const BINOMIAL: [u32; 5] = [1, 4, 6, 4, 1];

/// Blurred along rows and columns; the border pixels are repeated outside.
fn blurred(gray: &Raster<u8>) -> Raster<u8> {
    let (width, height) = (gray.width(), gray.height());
    let mut along_rows = Raster::<u16>::new(width, height, 1);
    for y in 0..height {
        let from = gray.row(y);
        for (x, sum) in along_rows.row_mut(y).iter_mut().enumerate() {
            let tap = |k: usize| u32::from(from[(x + k).saturating_sub(2).min(width - 1)]);
            *sum = (0..5).map(|k| BINOMIAL[k] * tap(k)).sum::<u32>() as u16;
        }
    }
    let mut blurred = Raster::new(width, height, 1);
    for y in 0..height {
        let rows: [&[u16]; 5] = std::array::from_fn(|k| along_rows.row((y + k).saturating_sub(2).min(height - 1)));
        for (x, value) in blurred.row_mut(y).iter_mut().enumerate() {
            let sum: u32 = (0..5).map(|k| BINOMIAL[k] * u32::from(rows[k][x])).sum();
            *value = ((sum + 128) / 256) as u8;
        }
    }
    blurred
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp is blurred into itself; all levels agree on its values and slope in working pixels.
    #[test]
    fn all_levels_see_the_same_ramp() {
        let mut gray = Raster::<u8>::new(120, 90, 1);
        for y in 0..90 {
            for (x, value) in gray.row_mut(y).iter_mut().enumerate() {
                *value = (x + y) as u8;
            }
        }
        let pyramid = GrayPyramid::new(&gray);
        assert_eq!(pyramid.levels.len(), 3);
        for level in 0..3 {
            let gray = pyramid.at(level, Vector2::new(50.25, 40.5)).expect("inside");
            // The pixel center (c + 0.5) holds c: the ramp is x + y - 1.
            assert!((gray.value - 89.75).abs() < 0.6, "level {level}: {}", gray.value);
            assert!((gray.slope - Vector2::new(1.0, 1.0)).norm() < 0.2, "level {level}: {}", gray.slope);
        }
        assert_eq!(pyramid.at(0, Vector2::new(0.5, 40.0)), None);
        assert_eq!(pyramid.at(2, Vector2::new(117.0, 40.0)), None);
        assert_eq!(pyramid.at(0, Vector2::new(f64::NAN, 40.0)), None);
    }
}
