//! The finished panorama.

use std::ops::Range;

use trueup_core::raster::RowSource;
use trueup_core::{Error, Result};

use crate::coverage::{Coverage, Rectangle};
use crate::store::{PixelStore, RootPixel, SumPixel};
use crate::transfer_curve::Encoding;
use crate::weights::{WHOLE, alpha};

/// The finished panorama: 8 or 16 bytes a pixel in memory or in a scratch file, encoded as its rows are asked for.
#[derive(Debug)]
pub struct Panorama {
    /// Of the canvas that its pixels hold, what is the panorama.
    kept: Rectangle,
    pub(super) pixels: PanoramaPixels,
    encoding: Encoding,
}

/// What a panorama holds.
#[derive(Debug)]
pub(super) enum PanoramaPixels {
    /// Sums over the photographs of weight * (red, green, blue) in linear light, and of the weights.
    Sums(PixelStore<SumPixel>),
    /// Square roots of linear light, or where what is brighter than white is kept fourth roots, and alpha; 65535 is 1.
    /// Fine enough for 16 bits of the usual curves, and for light of twenty stops to half a percent.
    Roots(PixelStore<RootPixel>),
}

impl Panorama {
    pub(super) fn from_sums(size: [usize; 2], sums: PixelStore<SumPixel>, encoding: Encoding) -> Self {
        Self { kept: Rectangle::whole(size), pixels: PanoramaPixels::Sums(sums), encoding }
    }

    pub(super) fn from_roots(size: [usize; 2], roots: PixelStore<RootPixel>, encoding: Encoding) -> Self {
        Self { kept: Rectangle::whole(size), pixels: PanoramaPixels::Roots(roots), encoding }
    }

    /// Leaves of the panorama the `part` that is to be kept. What lies around it stays in memory, but is not shown.
    ///
    /// # Errors
    /// [`Error::Input`] if the part is empty or not all of it is in the panorama.
    pub fn crop(&mut self, part: &Rectangle) -> Result<()> {
        let [width, height] = self.kept.size();
        if part.area() == 0 || part.columns.end > width || part.rows.end > height {
            let [wide, high] = part.size();
            let reason = format!("a part of {wide} x {high} px is not in the panorama of {width} x {height} px");
            return Err(Error::input("crop", reason, "Choose a part of the panorama."));
        }
        let moved = |range: &Range<usize>, start: usize| range.start + start..range.end + start;
        let columns = moved(&part.columns, self.kept.columns.start);
        let rows = moved(&part.rows, self.kept.rows.start);
        self.kept = Rectangle { columns, rows };
        Ok(())
    }

    /// What of a `coverage`, that of the layout it was made of, nothing shows through: photographs may be transparent
    /// in part.
    ///
    /// # Errors
    /// [`trueup_core::Error::Io`] if a scratch file cannot be read.
    pub fn opaque_part(&self, coverage: &Coverage) -> Result<Coverage> {
        let least = WHOLE * f32::from(u16::MAX);
        match &self.pixels {
            PanoramaPixels::Sums(sums) => {
                coverage.within(|y| Ok(stretches(&sums.row(y)?, |sum| alpha(sum[3]) >= WHOLE)))
            }
            PanoramaPixels::Roots(roots) => {
                coverage.within(|y| Ok(stretches(&roots.row(y)?, |root| f32::from(root[3]) >= least)))
            }
        }
    }

    /// Linear light (red, green, blue; 1 is white, more is possible) and alpha (0 to 1) of pixel (x, y); all 0 where no
    /// photograph is.
    ///
    /// # Errors
    /// [`trueup_core::Error::Io`] if a scratch file cannot be read.
    pub fn linear_pixel(&self, x: usize, y: usize) -> Result<[f32; 4]> {
        let (x, y) = (x + self.kept.columns.start, y + self.kept.rows.start);
        Ok(self.profile_light(match &self.pixels {
            PanoramaPixels::Sums(sums) => linear_of_sum(sums.pixel(x, y)?),
            PanoramaPixels::Roots(roots) => self.linear_of_root(roots.pixel(x, y)?),
        }))
    }

    /// The columns of the canvas that a row of the panorama has, and its own row there.
    fn on_canvas(&self, y: usize) -> (Range<usize>, usize) {
        (self.kept.columns.clone(), self.kept.rows.start + y)
    }

    /// What a pixel holds as light.
    fn linear_of_root(&self, root: RootPixel) -> [f32; 4] {
        let [r, g, b, opacity] = root.map(|value| f32::from(value) / 65535.0);
        let [r, g, b] = [r, g, b].map(|root| self.encoding.light_of_root(root));
        [r, g, b, opacity]
    }

    /// Linear light by the color profile.
    fn profile_light(&self, [r, g, b, opacity]: [f32; 4]) -> [f32; 4] {
        let [r, g, b] = [r, g, b].map(|light| self.encoding.profile_light(light));
        [r, g, b, opacity]
    }
}

/// The stretches of a row whose pixels are such, in ascending order.
fn stretches<P>(row: &[P], is_such: impl Fn(&P) -> bool) -> Vec<Range<usize>> {
    let mut end = 0;
    let same = row.chunk_by(|one, next| is_such(one) == is_such(next));
    let ranges = same.map(|chunk| {
        end += chunk.len();
        (end - chunk.len()..end, is_such(&chunk[0]))
    });
    ranges.filter(|(_, is_such)| *is_such).map(|(range, _)| range).collect()
}

pub(super) fn linear_of_sum([r, g, b, sum]: SumPixel) -> [f32; 4] {
    if sum > 0.0 { [r / sum, g / sum, b / sum, alpha(sum)] } else { [0.0; 4] }
}

impl RowSource for Panorama {
    fn width(&self) -> usize {
        self.kept.columns.len()
    }

    fn height(&self) -> usize {
        self.kept.rows.len()
    }

    fn is_opaque(&self) -> bool {
        match &self.pixels {
            PanoramaPixels::Sums(sums) => sums.is_opaque(&self.kept),
            PanoramaPixels::Roots(roots) => roots.is_opaque(&self.kept),
        }
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        let (columns, y) = self.on_canvas(y);
        match &self.pixels {
            PanoramaPixels::Sums(sums) => {
                let encode = &self.encoding.linear;
                for (pixel, &[r, g, b, sum]) in row.chunks_exact_mut(4).zip(sums.row(y)?[columns].iter()) {
                    let opacity = (alpha(sum) * 255.0 + 0.5) as u8;
                    let scale = if opacity > 0 { 1.0 / sum } else { 0.0 };
                    let levels = [encode.level(r * scale), encode.level(g * scale), encode.level(b * scale), opacity];
                    pixel.copy_from_slice(&levels);
                }
            }
            PanoramaPixels::Roots(roots) => {
                let encode = &self.encoding.roots;
                for (pixel, &[r, g, b, opacity]) in row.chunks_exact_mut(4).zip(roots.row(y)?[columns].iter()) {
                    let opacity = match opacity {
                        u16::MAX => u8::MAX,
                        _ => ((u32::from(opacity) * 255 + 32767) / 65535) as u8,
                    };
                    let levels = match opacity {
                        0 => [0; 4],
                        _ => [encode.level(r), encode.level(g), encode.level(b), opacity],
                    };
                    pixel.copy_from_slice(&levels);
                }
            }
        }
        Ok(())
    }

    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        let (columns, y) = self.on_canvas(y);
        match &self.pixels {
            PanoramaPixels::Sums(sums) => {
                let encode = self.encoding.linear16();
                for (pixel, &[r, g, b, sum]) in row.chunks_exact_mut(4).zip(sums.row(y)?[columns].iter()) {
                    let opacity = (alpha(sum) * 65535.0 + 0.5) as u16;
                    let scale = if opacity > 0 { 1.0 / sum } else { 0.0 };
                    let levels = [encode.level(r * scale), encode.level(g * scale), encode.level(b * scale), opacity];
                    pixel.copy_from_slice(&levels);
                }
            }
            PanoramaPixels::Roots(roots) => {
                let encode = self.encoding.roots16();
                for (pixel, &[r, g, b, opacity]) in row.chunks_exact_mut(4).zip(roots.row(y)?[columns].iter()) {
                    let level = |root: u16| if opacity > 0 { encode.level(root) } else { 0 };
                    pixel.copy_from_slice(&[level(r), level(g), level(b), opacity]);
                }
            }
        }
        Ok(())
    }

    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        let (columns, y) = self.on_canvas(y);
        let out = row.chunks_exact_mut(4);
        match &self.pixels {
            PanoramaPixels::Sums(sums) => {
                out.zip(sums.row(y)?[columns].iter())
                    .for_each(|(out, &sum)| out.copy_from_slice(&self.profile_light(linear_of_sum(sum))));
            }
            PanoramaPixels::Roots(roots) => {
                out.zip(roots.row(y)?[columns].iter())
                    .for_each(|(out, &root)| out.copy_from_slice(&self.profile_light(self.linear_of_root(root))));
            }
        }
        Ok(())
    }
}
