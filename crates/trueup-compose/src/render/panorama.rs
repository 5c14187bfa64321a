//! The finished panorama.

use rayon::prelude::*;
use trueup_core::Result;
use trueup_core::colour::TransferCurve;
use trueup_core::raster::RowSource;

use crate::seam::Seams;
use crate::transfer_curve::Encoding;
use crate::weights::alpha;

/// The finished panorama: 8 or 16 bytes a pixel, encoded as its rows are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Panorama {
    width: usize,
    height: usize,
    pub(super) pixels: Pixels,
    seams: Option<Seams>,
    encoding: Encoding,
}

/// What a panorama holds, row-major.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Pixels {
    /// Sums over the photographs of weight * (red, green, blue) in linear light, and of the weights.
    Sums(Vec<[f32; 4]>),
    /// Square roots of linear light and alpha; 65535 is 1. Fine enough for 16 bits of the usual curves.
    Roots(Vec<[u16; 4]>),
}

impl Panorama {
    pub(super) fn from_sums([width, height]: [usize; 2], sums: Vec<[f32; 4]>, curve: TransferCurve) -> Self {
        Self { width, height, pixels: Pixels::Sums(sums), seams: None, encoding: Encoding::new(curve) }
    }

    pub(super) fn from_roots(
        [width, height]: [usize; 2],
        roots: Vec<[u16; 4]>,
        seams: Seams,
        curve: TransferCurve,
    ) -> Self {
        Self { width, height, pixels: Pixels::Roots(roots), seams: Some(seams), encoding: Encoding::new(curve) }
    }

    /// Bytes that rendering a canvas of `width` x `height` pixels takes beside the decoded photographs and what is made
    /// from them at a reduced size; blending without seams takes the most.
    pub fn required_bytes(width: usize, height: usize) -> usize {
        width.saturating_mul(height).saturating_mul(size_of::<[f32; 4]>())
    }

    /// The seams it was made with; `None` where photographs were averaged.
    pub fn seams(&self) -> Option<&Seams> {
        self.seams.as_ref()
    }

    /// Linear light (red, green, blue; 1 is white, more is possible) and alpha (0 to 1) of pixel (x, y); all 0 where no
    /// photograph is.
    pub fn linear_pixel(&self, x: usize, y: usize) -> [f32; 4] {
        let at = y * self.width + x;
        match &self.pixels {
            Pixels::Sums(sums) => {
                let [r, g, b, sum] = sums[at];
                if sum > 0.0 { [r / sum, g / sum, b / sum, alpha(sum)] } else { [0.0; 4] }
            }
            Pixels::Roots(roots) => {
                let [r, g, b, opacity] = roots[at].map(|value| f32::from(value) / 65535.0);
                [r * r, g * g, b * b, opacity]
            }
        }
    }
}

impl RowSource for Panorama {
    fn width(&self) -> usize {
        self.width
    }

    fn height(&self) -> usize {
        self.height
    }

    fn is_opaque(&self) -> bool {
        match &self.pixels {
            Pixels::Sums(sums) => sums.par_iter().all(|&[.., sum]| alpha(sum) >= 1.0),
            Pixels::Roots(roots) => roots.par_iter().all(|&[.., opacity]| opacity == u16::MAX),
        }
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        let range = y * self.width..(y + 1) * self.width;
        match &self.pixels {
            Pixels::Sums(sums) => {
                let encode = &self.encoding.linear;
                for (pixel, &[r, g, b, sum]) in row.chunks_exact_mut(4).zip(&sums[range]) {
                    let opacity = (alpha(sum) * 255.0 + 0.5) as u8;
                    let scale = if opacity > 0 { 1.0 / sum } else { 0.0 };
                    let levels = [encode.level(r * scale), encode.level(g * scale), encode.level(b * scale), opacity];
                    pixel.copy_from_slice(&levels);
                }
            }
            Pixels::Roots(roots) => {
                let encode = &self.encoding.roots;
                for (pixel, &[r, g, b, opacity]) in row.chunks_exact_mut(4).zip(&roots[range]) {
                    let opacity = ((u32::from(opacity) * 255 + 32767) / 65535) as u8;
                    let shown = opacity > 0;
                    let level = |root: u16| if shown { encode.level(root) } else { 0 };
                    pixel.copy_from_slice(&[level(r), level(g), level(b), opacity]);
                }
            }
        }
        Ok(())
    }

    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        let range = y * self.width..(y + 1) * self.width;
        match &self.pixels {
            Pixels::Sums(sums) => {
                let encode = self.encoding.linear16();
                for (pixel, &[r, g, b, sum]) in row.chunks_exact_mut(4).zip(&sums[range]) {
                    let opacity = (alpha(sum) * 65535.0 + 0.5) as u16;
                    let scale = if opacity > 0 { 1.0 / sum } else { 0.0 };
                    let levels = [encode.level(r * scale), encode.level(g * scale), encode.level(b * scale), opacity];
                    pixel.copy_from_slice(&levels);
                }
            }
            Pixels::Roots(roots) => {
                let encode = self.encoding.roots16();
                for (pixel, &[r, g, b, opacity]) in row.chunks_exact_mut(4).zip(&roots[range]) {
                    let level = |root: u16| if opacity > 0 { encode.level(root) } else { 0 };
                    pixel.copy_from_slice(&[level(r), level(g), level(b), opacity]);
                }
            }
        }
        Ok(())
    }

    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        for (x, pixel) in row.chunks_exact_mut(4).take(self.width).enumerate() {
            pixel.copy_from_slice(&self.linear_pixel(x, y));
        }
        Ok(())
    }
}
