//! One gain per photograph, so that overlapping photographs are equally bright.
//!
//! Gains act on linear light. For every pair that overlaps, the logarithm of the brightness ratio is measured as a median
//! over the overlap, so that moving things and ghosts do not count; saturated samples do not take part. The gains then
//! solve a weighted least-squares problem over the pairs, which spreads what the pairs disagree about.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::options::StageOptions;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result, StageContext};

use crate::deformed_grid::{DeformedGrid, Run};
use crate::layout::{CanvasLayout, Placed, check_mesh};
use crate::simd::{Positions, invert_row};
use crate::transfer_curve::Linearise;

const STAGE: &str = ExposureOptions::STAGE;

trueup_core::choice! {
    /// Which photograph's brightness the panorama keeps.
    pub enum GainAnchor {
        /// The geometric mean of all gains is 1.
        Mean = "mean",
        /// The reference's gain is 1.
        Reference = "reference",
    }
}

trueup_core::options! {
    /// How the brightness of the photographs is evened out.
    pub struct ExposureOptions("exposure") {
        /// Whether gains are estimated at all; without, every gain is 1.
        enabled: bool = true, Allowed::Any, "";
        /// Which photograph's brightness the panorama keeps.
        anchor: GainAnchor = GainAnchor::Mean, Allowed::Any, "";
        /// Samples taken across a photograph, about, when the overlaps are compared.
        samples: f64 = 10_000.0, between(100.0, 1e6), "";
        /// Fewest samples two photographs must share to be compared.
        min_shared: usize = 20, between(1.0, 1e6), "samples";
        /// Darkest 8-bit level that still tells brightness.
        darkest: u8 = 4, Allowed::Any, "level";
        /// Brightest 8-bit level that still tells brightness.
        brightest: u8 = 251, Allowed::Any, "level";
        /// Uncertainty of a pair's measured ratio, from vignetting and misalignment, as a standard deviation of its natural
        /// logarithm; the spread of the samples adds to it.
        pair_deviation: f64 = 0.02, between(1e-4, 1.0), "";
        /// How far gains are expected to lie from 1, as a standard deviation of their natural logarithm. Lower keeps long
        /// rows of photographs from drifting in brightness, higher follows the measured ratios.
        gain_deviation: f64 = 2.0, between(1e-3, 100.0), "";
        /// Largest gain; the smallest is its inverse.
        max_gain: f64 = 8.0, between(1.0, 1000.0), "";
    }
}

/// A photograph reduced to its working size, as the comparison of brightness reads it.
#[derive(Debug, Clone, Copy)]
pub struct Thumbnail<'a> {
    /// 8-bit sRGB, three channels.
    pub raster: &'a Raster<u8>,
    /// How its pixels relate to the full-resolution photograph.
    pub frame: WorkingFrame,
}

/// What two overlapping photographs say about each other's brightness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairExposure {
    /// Position of the first photograph in [`CanvasLayout::placed`].
    pub first: usize,
    /// Position of the second, greater than `first`.
    pub second: usize,
    /// Median of ln(first / second) over the shared samples, linear light.
    pub log_ratio: f64,
    /// Robust standard deviation of the same (1.4826 times the median absolute deviation).
    pub deviation: f64,
    /// Number of shared samples.
    pub samples: usize,
}

/// The gains and the measurements behind them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Factor on linear light for each photograph of [`CanvasLayout::placed`]; 1 where it overlaps no other.
    pub gains: Vec<f64>,
    /// The pairs that were compared, by (first, second).
    pub pairs: Vec<PairExposure>,
}

/// Estimates the gains of the photographs of `layout` from `thumbnails`, one for each in the same order; `reference` is
/// the position of the photograph that [`GainAnchor::Reference`] keeps.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if thumbnails and layout do not fit together; [`Error::Unsolvable`] if a vertex is
/// not finite; [`Error::Cancelled`].
///
/// # Source
/// Brown, Lowe, "Automatic panoramic image stitching using invariant features", IJCV 74(1), 2007, section 6.
///
/// # Departures
/// The error is on logarithms, `sum (x_i - x_j + m_ij)^2 / s_ij^2 + sum x_i^2 / s_g^2` with x = ln gain and m_ij the
/// median log ratio: the published error on intensities draws all gains towards zero and is led by bright outliers.
pub fn run(
    layout: &CanvasLayout,
    thumbnails: &[Thumbnail<'_>],
    reference: usize,
    options: &ExposureOptions,
    context: &StageContext,
) -> Result<Exposure> {
    check(layout, thumbnails, reference, options)?;
    let count = layout.placed.len();
    if !options.enabled || count < 2 {
        return Ok(Exposure { gains: vec![1.0; count], pairs: Vec::new() });
    }
    let scale = sampling_scale(layout, options.samples);
    let width = (layout.width as f64 * scale).ceil() as usize;
    let height = (layout.height as f64 * scale).ceil() as usize;
    let patches: Vec<Patch> = layout
        .placed
        .par_iter()
        .zip(thumbnails)
        .map(|(placed, thumbnail)| {
            context.check_cancelled()?;
            Ok(Patch::new(placed, thumbnail, scale, width, height, options))
        })
        .collect::<Result<_>>()?;
    let pairs: Vec<PairExposure> = (0..count)
        .into_par_iter()
        .map(|first| {
            context.check_cancelled()?;
            Ok((first + 1..count)
                .filter_map(|second| compare(&patches, first, second, options.min_shared))
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    Ok(Exposure { gains: solve(count, &pairs, reference, options), pairs })
}

fn check(
    layout: &CanvasLayout,
    thumbnails: &[Thumbnail<'_>],
    reference: usize,
    options: &ExposureOptions,
) -> Result<()> {
    options.check()?;
    layout.placed.iter().try_for_each(check_mesh)?;
    let usable = |thumbnail: &Thumbnail| {
        thumbnail.raster.channels() == 3
            && !thumbnail.raster.data().is_empty()
            && thumbnail.frame.working_from_full > 0.0
    };
    if thumbnails.len() != layout.placed.len() || !thumbnails.iter().all(usable) {
        return Err(Error::input(
            STAGE,
            format!("{} thumbnails for {} photographs, or one not RGB", thumbnails.len(), layout.placed.len()),
            "Give one three-channel thumbnail for each photograph.",
        ));
    }
    if reference >= layout.placed.len() && options.anchor == GainAnchor::Reference {
        return Err(Error::input(
            STAGE,
            "the reference is not in the panorama",
            "Choose one of the photographs in use.",
        ));
    }
    Ok(())
}

/// Factor from the canvas to the grid of samples, at most 1: the median photograph gets `samples` of them.
fn sampling_scale(layout: &CanvasLayout, samples: f64) -> f64 {
    let mut areas: Vec<f64> = layout
        .placed
        .iter()
        .map(|placed| {
            let (low, high) = placed.mesh.bounds();
            let extent = high - low;
            extent.x * extent.y
        })
        .collect();
    areas.sort_by(f64::total_cmp);
    let median = areas.get(areas.len() / 2).copied().unwrap_or(1.0).max(1.0);
    // Coordinates beyond this are no sampling grid any more.
    const MAX_SIDE: f64 = 16_384.0;
    (samples / median).sqrt().min(1.0).min(MAX_SIDE / layout.width.max(layout.height) as f64)
}

/// Logarithm of the brightness of one photograph on the grid of samples; NaN where it says nothing.
struct Patch {
    rows: Range<usize>,
    columns: Range<usize>,
    log_light: Vec<f32>,
}

impl Patch {
    fn new(
        placed: &Placed,
        thumbnail: &Thumbnail<'_>,
        scale: f64,
        width: usize,
        height: usize,
        options: &ExposureOptions,
    ) -> Self {
        let grid = DeformedGrid::new(&placed.mesh, scale, false, width, height);
        let mut footprints: Vec<f64> = grid.cells.iter().map(|cell| cell.footprint[0].min(cell.footprint[1])).collect();
        footprints.sort_by(f64::total_cmp);
        let footprint = footprints.get(footprints.len() / 2).copied().unwrap_or(1.0);
        let block = (footprint * thumbnail.frame.working_from_full).round().max(1.0) as usize;
        let light = block_means(thumbnail.raster, block, options.darkest..=options.brightest);
        let from_full = thumbnail.frame.working_from_full / block as f64;

        let mut log_light = vec![f32::NAN; grid.rows.len() * grid.columns.len()];
        let all: Vec<u32> = (0..grid.cells.len() as u32).collect();
        let (mut owner, mut runs, mut positions) = (Vec::new(), Vec::<Run>::new(), Positions::default());
        for y in grid.rows.clone() {
            grid.runs(y, &all, &mut owner, &mut runs);
            let row = &mut log_light[(y - grid.rows.start) * grid.columns.len()..][..grid.columns.len()];
            for run in &runs {
                positions.resize(run.columns.len());
                invert_row(&grid.cells[run.cell].inverse_along_row(y), run.columns.start, &mut positions);
                for (index, column) in run.columns.clone().enumerate() {
                    let x = (f64::from(positions.column[index]) + 1.0) * from_full;
                    let y = (f64::from(positions.row[index]) + 1.0) * from_full;
                    let (x, y) =
                        ((x.max(0.0) as usize).min(light.width() - 1), (y.max(0.0) as usize).min(light.height() - 1));
                    row[column - grid.columns.start] = light.pixel(x, y)[0];
                }
            }
        }
        Self { rows: grid.rows, columns: grid.columns, log_light }
    }

    fn row(&self, y: usize, columns: &Range<usize>) -> &[f32] {
        let start = (y - self.rows.start) * self.columns.len();
        &self.log_light[start + columns.start - self.columns.start..start + columns.end - self.columns.start]
    }
}

/// Natural logarithm of the mean linear light (mean of the three channels) of blocks of `block` x `block` pixels; NaN where
/// a sample lies outside `telling`.
fn block_means(raster: &Raster<u8>, block: usize, telling: std::ops::RangeInclusive<u8>) -> Raster<f32> {
    let linearise = Linearise::table();
    let (width, height) = (raster.width().div_ceil(block), raster.height().div_ceil(block));
    let mut means = Raster::new(width, height, 1);
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut count, mut tells) = (0.0, 0, true);
            for row in y * block..((y + 1) * block).min(raster.height()) {
                let end = ((x + 1) * block).min(raster.width());
                for &level in &raster.row(row)[3 * x * block..3 * end] {
                    sum += linearise.linear(f32::from(level));
                    count += 1;
                    tells &= telling.contains(&level);
                }
            }
            means.pixel_mut(x, y)[0] = if tells { (sum / count as f32).ln() } else { f32::NAN };
        }
    }
    means
}

fn intersect(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    a.start.max(b.start)..a.end.min(b.end)
}

/// Compares two photographs where both tell their brightness; `None` if they share too little.
fn compare(patches: &[Patch], first: usize, second: usize, min_shared: usize) -> Option<PairExposure> {
    let (a, b) = (&patches[first], &patches[second]);
    let (rows, columns) = (intersect(&a.rows, &b.rows), intersect(&a.columns, &b.columns));
    if rows.is_empty() || columns.is_empty() {
        return None;
    }
    let mut ratios: Vec<f32> = rows
        .flat_map(|y| a.row(y, &columns).iter().zip(b.row(y, &columns)).map(|(a, b)| a - b))
        .filter(|ratio| ratio.is_finite())
        .collect();
    if ratios.len() < min_shared.max(1) {
        return None;
    }
    let log_ratio = median(&mut ratios);
    let samples = ratios.len();
    for ratio in &mut ratios {
        *ratio = (*ratio - log_ratio).abs();
    }
    // Ratio of the standard deviation to the median absolute deviation of a normal distribution.
    const NORMAL: f64 = 1.4826;
    let deviation = NORMAL * f64::from(median(&mut ratios));
    Some(PairExposure { first, second, log_ratio: f64::from(log_ratio), deviation, samples })
}

/// The median of at least one number (the upper one of an even count).
fn median(values: &mut [f32]) -> f32 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Least squares over the pairs; see [`run`].
fn solve(count: usize, pairs: &[PairExposure], reference: usize, options: &ExposureOptions) -> Vec<f64> {
    // Neighbouring samples see the same things; an overlap is worth about this share of its samples.
    const INDEPENDENT: f64 = 0.01;
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    for pair in pairs {
        let from_samples = pair.deviation.powi(2) / (INDEPENDENT * pair.samples as f64);
        let weight = 1.0 / (options.pair_deviation.powi(2) + from_samples);
        let (i, j) = (pair.first, pair.second);
        normal[(i, i)] += weight;
        normal[(j, j)] += weight;
        normal[(i, j)] -= weight;
        normal[(j, i)] -= weight;
        // Equal brightness: x_i + ln(light_i) = x_j + ln(light_j).
        right[i] -= weight * pair.log_ratio;
        right[j] += weight * pair.log_ratio;
    }
    let compared: Vec<bool> = (0..count).map(|i| normal[(i, i)] > 0.0).collect();
    for i in 0..count {
        normal[(i, i)] += options.gain_deviation.powi(-2);
    }
    let Some(solver) = normal.cholesky() else { return vec![1.0; count] };
    let logs = solver.solve(&right);
    let taking_part = compared.iter().filter(|&&compared| compared).count().max(1);
    let anchor = match options.anchor {
        GainAnchor::Reference => logs[reference],
        GainAnchor::Mean => {
            logs.iter().zip(&compared).filter(|(_, compared)| **compared).map(|(log, _)| log).sum::<f64>()
                / taking_part as f64
        }
    };
    let gain = |(log, &compared): (&f64, &bool)| if compared { (log - anchor).exp() } else { 1.0 };
    logs.iter().zip(&compared).map(gain).map(|gain| gain.clamp(options.max_gain.recip(), options.max_gain)).collect()
}

#[cfg(test)]
mod tests;
