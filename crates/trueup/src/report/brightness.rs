//! How alike neighboring photographs are in brightness, before their light is evened out and after.

use std::collections::BTreeMap;

use trueup_compose::exposure::Corrections;
use trueup_compose::render::{self, Layer, RenderInput};
use trueup_core::Result;

use crate::pipeline::{Alignment, Stitcher};

/// By how much the one photograph of a pair is brighter than the other where both show the same, in levels of 255.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrightnessStep {
    /// Position of the first photograph in [`crate::Project::images`].
    pub a: usize,
    /// Position of the second photograph, larger than `a`.
    pub b: usize,
    /// Canvas pixels that both cover.
    pub pixels: usize,
    /// Mean luma of the first less that of the second as they were taken.
    pub before: f64,
    /// The same as the panorama shows them.
    pub after: f64,
}

/// Sums over the pixels that two photographs cover.
#[derive(Debug, Clone, Copy, Default)]
struct Overlap {
    pixels: usize,
    difference: f64,
}

impl Stitcher<'_> {
    /// The brightness of photographs that were joined, where both lie on the canvas of `alignment`. Every photograph is
    /// rendered alone there, twice, which takes five bytes for each of its pixels: meant for small canvases. Pairs
    /// without a common pixel are left out.
    ///
    /// # Errors
    /// Those of reading the photographs; [`trueup_core::Error::Cancelled`].
    pub fn brightness_steps(&self, alignment: &Alignment) -> Result<Vec<BrightnessStep>> {
        let input = alignment.render_input();
        let plain = Corrections {
            response: input.corrections.response,
            ..Corrections::plain(input.corrections.photographs.len())
        };
        let before = self.overlaps(alignment, &RenderInput { corrections: &plain, ..input })?;
        let after = self.overlaps(alignment, &input)?;
        let step = |(&[a, b], before): (&[usize; 2], &Overlap)| {
            let after = after.get(&[a, b])?;
            let mean = |of: &Overlap| of.difference / of.pixels as f64;
            Some(BrightnessStep { a, b, pixels: before.pixels, before: mean(before), after: mean(after) })
        };
        Ok(before.iter().filter_map(step).collect())
    }

    fn overlaps(&self, alignment: &Alignment, input: &RenderInput) -> Result<BTreeMap<[usize; 2], Overlap>> {
        let layers = (0..input.layout.placed.len())
            .map(|position| {
                self.context().check_cancelled()?;
                let layer = render::layer(input, position, &self.options().compose.render)?;
                Ok((alignment.position_of(input.layout.placed[position].photograph), layer))
            })
            .collect::<Result<Vec<(usize, Layer)>>>()?;
        let joined = |a: usize, b: usize| {
            alignment.project.pairs.iter().any(|pair| (pair.a, pair.b) == (a, b) && pair.verdict.is_joined())
        };
        let turn = input.layout.period.map(|_| input.layout.width);
        let mut overlaps: BTreeMap<[usize; 2], Overlap> = BTreeMap::new();
        for (a, one) in &layers {
            for (b, other) in layers.iter().filter(|(b, _)| a < b && joined(*a, *b)) {
                let found = overlap(one, other, turn);
                let sum = overlaps.entry([*a, *b]).or_default();
                sum.pixels += found.pixels;
                sum.difference += found.difference;
            }
        }
        overlaps.retain(|_, overlap| overlap.pixels > 0);
        Ok(overlaps)
    }
}

/// What two layers have in common, on a cylinder of `turn` columns modulo these.
fn overlap(one: &Layer, other: &Layer, turn: Option<usize>) -> Overlap {
    let mut sum = Overlap::default();
    for y in 0..one.gray.height() {
        let Some(v) = (one.top + y).checked_sub(other.top).filter(|&v| v < other.gray.height()) else { continue };
        for x in 0..one.gray.width() {
            let column = one.left + x;
            let u = match turn {
                Some(turn) => Some((column % turn + turn - other.left % turn) % turn),
                None => column.checked_sub(other.left),
            };
            let Some(u) = u.filter(|&u| u < other.gray.width()) else { continue };
            if one.covered.pixel(x, y)[0] && other.covered.pixel(u, v)[0] {
                sum.pixels += 1;
                sum.difference += f64::from(one.gray.pixel(x, y)[0]) - f64::from(other.gray.pixel(u, v)[0]);
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use trueup_core::raster::Raster;

    use super::*;

    fn layer(left: usize, level: f32) -> Layer {
        let gray = Raster::from_data(4, 2, 1, vec![level; 8]).expect("eight samples");
        Layer { left, top: 0, gray, covered: Raster::from_data(4, 2, 1, vec![true; 8]).expect("eight samples") }
    }

    /// Columns 0 to 3 and 2 to 5 share two columns of two rows; on a turn of 6 columns, 4 to 7 share 0 and 1 with the
    /// first.
    #[test]
    fn the_difference_is_taken_where_both_are() {
        let flat = overlap(&layer(0, 100.0), &layer(2, 90.0), None);
        assert_eq!((flat.pixels, flat.difference), (4, 40.0));
        assert_eq!(overlap(&layer(0, 100.0), &layer(4, 90.0), None).pixels, 0);
        let around = overlap(&layer(0, 100.0), &layer(4, 90.0), Some(6));
        assert_eq!((around.pixels, around.difference), (4, 40.0));
        let around = overlap(&layer(4, 90.0), &layer(0, 100.0), Some(6));
        assert_eq!((around.pixels, around.difference), (4, -40.0));
    }
}
