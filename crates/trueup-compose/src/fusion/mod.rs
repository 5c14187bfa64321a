//! One photograph of several exposures of one view.
//!
//! Every place shows most of the exposure that shows it best, and fades over in pyramids, so that no border is seen. An
//! exposure is heeded only where the reference lets expect what it shows: where something moved, or the exposure does
//! not reach, it is taken for what the reference is in its tones (`ghosts`). It then has the same place in the pyramids
//! as if the thing had stood still, and nothing of it stands out in brightness from its surroundings, as where it is
//! left out altogether.
//!
//! # Source
//! Mertens, Kautz and Van Reeth, "Exposure fusion", Pacific Graphics 2007: weights by contrast, saturation and good
//! exposure, blended in Laplacian pyramids. For the exchange of what moved by the reference in the exposure's tones:
//! Li, Rahardja, Yao, Xie and Wu, "Movement detection for the synthesis of high dynamic range images", ICIP 2010.
//!
//! # Departures
//! Contrast and saturation count from a floor on, so that the noise of a gray wall does not decide. A gray photograph
//! has no saturation to be judged by. Fine levels are fused tile by tile, which takes no memory for pyramids of whole
//! photographs.

mod exposure;
mod ghosts;
mod radiance;
#[cfg(test)]
mod tests;
mod weights;

use std::ops::Range;

use rayon::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::geometry::Homography;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::{AlignedPhotograph, StackFusion};
use trueup_core::{Error, Result};

use crate::pyramid::{
    LEAST_WEIGHT, PyramidPlane, Texel, add_base, add_detail, collapse, first_level, level_shares, mask_margin,
};
use crate::window::widened;
use exposure::Exposure;
pub use radiance::merge;
use weights::normalized_weights;

/// Exposure fusion by Mertens, Kautz and Van Reeth, and merging to light, both without ghosts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ExposureFusion;

impl StackFusion for ExposureFusion {
    fn fuse(&self, reference: &Photograph, others: &[AlignedPhotograph]) -> Result<Photograph> {
        fuse(reference, others)
    }

    fn merge(
        &self,
        reference: &Photograph,
        others: &[AlignedPhotograph],
        samples: &TransferCurve,
        light: &TransferCurve,
    ) -> Result<Photograph> {
        merge(reference, others, samples, light)
    }

    fn bytes_per_pixel(&self, photographs: usize) -> usize {
        // Of the level that is fused as a whole: colors and weight of each, their sum, and what it is interpolated to.
        let coarse = photographs * (size_of::<[f32; 4]>() + size_of::<f32>()) + 3 * size_of::<[f32; 4]>();
        let finest = 1 << (2 * first_level([1, 1]));
        coarse.div_ceil(finest)
    }
}

/// Side of a tile in pixels, a multiple of 2^first_level: of 256 pixels, a fifth and a half again are sampled for the
/// margins, and what a thread holds of three exposures is some 10 MB.
const fn tile_side(first_level: u32) -> usize {
    32 << first_level
}

/// Columns and rows of a part of the picture.
type Part = (Range<usize>, Range<usize>);

/// The picture of all exposures, in the frame, depth and channels of the reference; what the reference has of
/// transparency stays.
///
/// # Errors
/// [`Error::Input`] if a member has another size or a homography that is none.
pub fn fuse(reference: &Photograph, others: &[AlignedPhotograph]) -> Result<Photograph> {
    let size = [reference.width(), reference.height()];
    let exposures = aligned_exposures(reference, others)?;
    let first_level = first_level(size);
    let coarse = Coarse::of(&exposures, size, first_level).fused();
    Ok(match reference {
        Photograph::Eight(raster) => {
            Photograph::Eight(finished(raster, &exposures, &coarse, first_level, |value| (value + 0.5) as u8))
        }
        Photograph::Sixteen(raster) => {
            /// Levels of 16 bits for each one of 8.
            const SIXTEEN_BITS: f32 = 257.0;
            let sample = |value: f32| (SIXTEEN_BITS * value + 0.5) as u16;
            Photograph::Sixteen(finished(raster, &exposures, &coarse, first_level, sample))
        }
    })
}

/// The reference, and the others as they lie on it.
///
/// # Errors
/// Those of [`fuse`].
fn aligned_exposures<'a>(reference: &'a Photograph, others: &'a [AlignedPhotograph]) -> Result<Vec<Exposure<'a>>> {
    let size = [reference.width(), reference.height()];
    let mut exposures = vec![Exposure::reference(reference)];
    for other in others {
        let from_member = Homography::from_rows(&other.reference_from_member);
        let member_from_reference = from_member.inverse().filter(|map| map.0.iter().all(|entry| entry.is_finite()));
        let same_size = [other.photograph.width(), other.photograph.height()] == size;
        let (Some(map), true) = (member_from_reference, same_size) else {
            let reason = format!(
                "a member of {} x {} px does not lie on it",
                other.photograph.width(),
                other.photograph.height()
            );
            return Err(Error::input("stack", reason, "Stitch the photographs again."));
        };
        exposures.push(Exposure::other(&exposures[0], &other.photograph, map));
    }
    Ok(exposures)
}

/// The level that is fused as a whole, of every exposure.
struct Coarse {
    colors: Vec<PyramidPlane<[f32; 4]>>,
    weights: Vec<PyramidPlane<f32>>,
}

impl Coarse {
    fn of(exposures: &[Exposure], size: [usize; 2], first_level: u32) -> Self {
        let samples = |length: usize| 0..length.div_ceil(1 << first_level);
        let (columns, rows) = (samples(size[0]), samples(size[1]));
        let mut colors: Vec<_> = exposures.iter().map(|_| PyramidPlane::new(columns.clone(), rows.clone())).collect();
        let mut weights: Vec<_> = exposures.iter().map(|_| PyramidPlane::new(columns.clone(), rows.clone())).collect();
        let tiles = tiles(size, tile_side(first_level));
        let reduced = |(columns, rows): &Part| -> Vec<(PyramidPlane<[f32; 4]>, PyramidPlane<f32>)> {
            let window = grown(columns, rows, mask_margin(first_level), size);
            let planes = window_planes(exposures, &window);
            planes
                .into_iter()
                .map(|(mut color, mut weight)| {
                    for _ in 0..first_level {
                        color = color.reduced();
                        weight = weight.reduced();
                    }
                    let own = |range: &Range<usize>| range.start >> first_level..range.end.div_ceil(1 << first_level);
                    (color.part(&own(columns), &own(rows)), weight.part(&own(columns), &own(rows)))
                })
                .collect()
        };
        let parts: Vec<_> = tiles.par_iter().map(reduced).collect();
        for part in parts {
            for (number, (color, weight)) in part.into_iter().enumerate() {
                put(&mut colors[number], &color);
                put(&mut weights[number], &weight);
            }
        }
        Self { colors, weights }
    }

    /// The fused level, with even shares.
    fn fused(self) -> PyramidPlane<[f32; 4]> {
        let Self { mut colors, mut weights } = self;
        let mut sums: Vec<PyramidPlane<[f32; 4]>> = Vec::new();
        // Down to the size at which one color is all that is left to blend.
        while let Some(finest) = colors.first()
            && finest.columns.len().min(finest.rows.len()) > 1
        {
            let mut sum = PyramidPlane::new(finest.columns.clone(), finest.rows.clone());
            for (color, weight) in colors.iter_mut().zip(&mut weights) {
                let mut coarser = color.reduced();
                let next = coarser.clone();
                level_shares(&mut coarser);
                add_detail(&mut sum, color, &coarser, weight, LEAST_WEIGHT);
                *color = next;
                *weight = weight.reduced();
            }
            sums.push(sum);
        }
        let mut fused = PyramidPlane::default();
        if let Some(last) = colors.first() {
            fused = PyramidPlane::new(last.columns.clone(), last.rows.clone());
        }
        for (color, weight) in colors.iter().zip(&weights) {
            add_base(&mut fused, color, weight);
        }
        collapse(&mut fused, None);
        while let Some(mut sum) = sums.pop() {
            collapse(&mut sum, Some(&fused));
            fused = sum;
        }
        fused
    }
}

/// Copies a part to its place.
fn put<T: Copy + Default + Texel>(whole: &mut PyramidPlane<T>, part: &PyramidPlane<T>) {
    for y in part.rows.clone() {
        whole.row_mut(y)[part.columns.clone()].copy_from_slice(part.row(y));
    }
}

/// The picture cut into tiles of this side, row by row.
fn tiles([width, height]: [usize; 2], side: usize) -> Vec<Part> {
    let cut = |length: usize| (0..length).step_by(side).map(move |start| start..(start + side).min(length));
    cut(height).flat_map(|rows| cut(width).map(move |columns| (columns, rows.clone()))).collect()
}

/// A part with so many pixels more on all sides, as far as the picture goes.
fn grown(columns: &Range<usize>, rows: &Range<usize>, margin: usize, [width, height]: [usize; 2]) -> Part {
    (widened(columns, margin, width), widened(rows, margin, height))
}

/// Colors and weights of all exposures within a window.
fn window_planes(exposures: &[Exposure], (columns, rows): &Part) -> Vec<(PyramidPlane<[f32; 4]>, PyramidPlane<f32>)> {
    let reference = exposures[0].window(columns, rows, None);
    let others = exposures[1..].iter().map(|exposure| exposure.window(columns, rows, Some(&reference)));
    let colors: Vec<PyramidPlane<[f32; 4]>> = others.collect();
    let has_color = exposures[0].has_color();
    let all: Vec<PyramidPlane<[f32; 4]>> = std::iter::once(reference).chain(colors).collect();
    let weights = normalized_weights(&all, has_color);
    all.into_iter().zip(weights).collect()
}

/// The fused pixels of one tile, row by row, 0 to 255.
fn tile(
    exposures: &[Exposure],
    coarse: &PyramidPlane<[f32; 4]>,
    part: &Part,
    size: [usize; 2],
    first_level: u32,
) -> PyramidPlane<[f32; 4]> {
    let window = grown(&part.0, &part.1, mask_margin(first_level), size);
    let mut sums: Vec<PyramidPlane<[f32; 4]>> = Vec::new();
    for (mut color, mut weight) in window_planes(exposures, &window) {
        for level in 0..first_level as usize {
            let next = color.reduced();
            let mut coarser = next.clone();
            level_shares(&mut coarser);
            if sums.len() <= level {
                sums.push(PyramidPlane::new(color.columns.clone(), color.rows.clone()));
            }
            add_detail(&mut sums[level], &color, &coarser, &weight, LEAST_WEIGHT);
            color = next;
            weight = weight.reduced();
        }
    }
    let own = |range: &Range<usize>| range.start >> first_level..range.end.div_ceil(1 << first_level);
    let mut fused = coarse.part(&own(&window.0), &own(&window.1));
    while let Some(mut sum) = sums.pop() {
        collapse(&mut sum, Some(&fused));
        fused = sum;
    }
    fused.part(&part.0, &part.1)
}

/// The fused picture, with the channels of `reference`.
fn finished<T: Copy + Default + Send + Sync>(
    reference: &Raster<T>,
    exposures: &[Exposure],
    coarse: &PyramidPlane<[f32; 4]>,
    first_level: u32,
    sample: impl Fn(f32) -> T + Sync,
) -> Raster<T> {
    let mut fused = reference.clone();
    let (size, channels) = ([reference.width(), reference.height()], reference.channels());
    let side = tile_side(first_level);
    fused.data_mut().par_chunks_mut(side * size[0] * channels).enumerate().for_each(|(band, samples)| {
        let rows = band * side..((band + 1) * side).min(size[1]);
        for columns in (0..size[0]).step_by(side).map(|start| start..(start + side).min(size[0])) {
            let tile = tile(exposures, coarse, &(columns.clone(), rows.clone()), size, first_level);
            for y in rows.clone() {
                let start = (y - rows.start) * size[0];
                for (x, texel) in columns.clone().zip(tile.row(y)) {
                    // Colors, and of a gray picture its one channel: alpha stays.
                    let pixel = &mut samples[(start + x) * channels..][..channels.min(3)];
                    for (channel, value) in pixel.iter_mut().zip(texel) {
                        *channel = sample(value.clamp(0.0, 255.0));
                    }
                }
            }
        }
    });
    fused
}
