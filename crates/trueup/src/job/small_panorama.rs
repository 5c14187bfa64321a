//! A small copy of a panorama.

use std::path::Path;

use trueup_compose::render::Rendered;
use trueup_core::raster::RowSource;
use trueup_core::{Error, Result};
use trueup_io::encode::{self, Metadata, OutputOptions};

use crate::pipeline::{Alignment, Stitcher};

/// Longer side of a thumbnail at most, pixels.
const LONGEST_PX: usize = 480;

/// Writes a small copy of what was `rendered`.
pub(super) fn write(stitcher: &Stitcher, alignment: &Alignment, rendered: &Rendered, path: &Path) -> Result<()> {
    let whole = &rendered.panorama;
    let factor = whole.width().max(whole.height()).div_ceil(LONGEST_PX).max(1);
    // What places a panorama on its sphere does not hold for a smaller one.
    let metadata = Metadata { xmp: None, ..stitcher.metadata(alignment) };
    let reduced = Reduced { whole, factor };
    encode::write(path, &reduced, &metadata, &OutputOptions::default(), stitcher.context()).map(drop)
}

/// Refuses a place that takes no thumbnail. How the panorama is encoded, as in 16 bits, is nothing to its small copy.
pub(super) fn check(path: &Path) -> Result<()> {
    encode::check_writable(path, &OutputOptions::default())
}

/// A picture of which every `factor` x `factor` pixels are one; what is left over at the right and below is cut off.
struct Reduced<'a> {
    whole: &'a dyn RowSource,
    factor: usize,
}

impl Reduced<'_> {
    /// The mean of each block of row `y`: colors weighted by alpha, and alpha.
    fn means(&self, y: usize) -> Result<Vec<[f64; 4]>> {
        let mut row = vec![0_u8; 4 * self.whole.width()];
        let mut sums = vec![[0.0; 4]; self.width()];
        for v in y * self.factor..((y + 1) * self.factor).min(self.whole.height()) {
            self.whole.rgba8_row(v, &mut row)?;
            for (sum, block) in sums.iter_mut().zip(row.chunks(4 * self.factor)) {
                for pixel in block.chunks_exact(4) {
                    let alpha = f64::from(pixel[3]);
                    (0..3).for_each(|channel| sum[channel] += alpha * f64::from(pixel[channel]));
                    sum[3] += alpha;
                }
            }
        }
        let pixels = (self.factor.min(self.whole.width()) * self.factor.min(self.whole.height())) as f64;
        let mean = |[r, g, b, alpha]: [f64; 4]| match alpha > 0.0 {
            true => [r / alpha, g / alpha, b / alpha, alpha / pixels],
            false => [0.0; 4],
        };
        Ok(sums.into_iter().map(mean).collect())
    }
}

impl RowSource for Reduced<'_> {
    fn width(&self) -> usize {
        (self.whole.width() / self.factor).max(1)
    }

    fn height(&self) -> usize {
        (self.whole.height() / self.factor).max(1)
    }

    fn is_opaque(&self) -> bool {
        self.whole.is_opaque()
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        for (pixel, mean) in row.chunks_exact_mut(4).zip(self.means(y)?) {
            (0..4).for_each(|channel| pixel[channel] = (mean[channel] + 0.5) as u8);
        }
        Ok(())
    }

    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        for (pixel, mean) in row.chunks_exact_mut(4).zip(self.means(y)?) {
            (0..4).for_each(|channel| pixel[channel] = (mean[channel] * 257.0 + 0.5) as u16);
        }
        Ok(())
    }

    fn linear_row(&self, _: usize, _: &mut [f32]) -> Result<()> {
        let hint = "Ask for 8 or 16 bits.".to_owned();
        Err(Error::Unsupported { what: "a thumbnail in floating point".to_owned(), hint })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five columns of levels 0, 10, 20, 30, 40 and two rows, the second transparent.
    struct Ramp;

    impl RowSource for Ramp {
        fn width(&self) -> usize {
            5
        }

        fn height(&self) -> usize {
            2
        }

        fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
            for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
                let level = 10 * x as u8;
                pixel.copy_from_slice(&[level, level, level, if y == 0 { 255 } else { 0 }]);
            }
            Ok(())
        }

        fn rgba16_row(&self, _: usize, _: &mut [u16]) -> Result<()> {
            unreachable!("nobody asks for it")
        }

        fn linear_row(&self, _: usize, _: &mut [f32]) -> Result<()> {
            unreachable!("nobody asks for it")
        }
    }

    #[test]
    fn blocks_are_means_of_what_shows_and_half_transparent_where_half_is() {
        let reduced = Reduced { whole: &Ramp, factor: 2 };
        assert_eq!((reduced.width(), reduced.height()), (2, 1));
        let mut row = [0; 8];
        reduced.rgba8_row(0, &mut row).expect("a row");
        assert_eq!(row, [5, 5, 5, 128, 25, 25, 25, 128]);
    }
}
