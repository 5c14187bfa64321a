//! The light of the photographs where they overlap, on a common grid of samples.

use std::ops::{Range, RangeInclusive};

use trueup_core::color::TransferCurve;
use trueup_core::raster::Raster;

use super::measured::Thumbnail;
use crate::deformed_grid::{CellRun, DeformedGrid};
use crate::layout::{Placed, TURNS};
use crate::simd::{Positions, invert_row};
use crate::transfer_curve::Linearize;
use crate::window::common;

/// Natural logarithms of the light of one photograph on the grid of samples; NaN where it says nothing.
pub(super) struct Patch {
    rows: Range<usize>,
    columns: Range<usize>,
    /// Logarithms of red, green and blue, and the squared radius (1 in the photograph's corners).
    samples: Vec<[f32; 4]>,
}

/// What two photographs show of the same place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shared {
    /// Logarithms of the light of red, green and blue in the first and in the second photograph.
    pub(super) log_light: [[f32; 3]; 2],
    /// Squared radius in the first and in the second photograph.
    pub(super) radius: [f32; 2],
    /// Variances of the logarithms by the noise of either photograph; above 0 once they are known.
    pub(super) variances: [f32; 2],
}

/// Standard deviation of a sample's encoded value by noise, rounding and compression: 1.5 of 255 levels.
const NOISE: f64 = 1.5 / 255.0;

/// 8-bit levels that still tell brightness: darker ones are mostly noise, brighter ones may be clipped.
const TELLING: RangeInclusive<u8> = 4..=251;

/// Least variance, where a curve stands still: noise of a hundredth of a percent.
const LEAST_VARIANCE: f32 = 1e-8;

impl Shared {
    /// The same with the photographs' parts exchanged.
    fn swapped(self) -> Self {
        let Self { log_light: [first, second], radius: [here, there], variances: [own, others] } = self;
        Self { log_light: [second, first], radius: [there, here], variances: [others, own] }
    }

    /// With the variances of samples encoded by `curve`: the same noise hides more of the light the darker it is.
    pub(super) fn with_variances(&self, curve: &TransferCurve) -> Self {
        let variance = |channels: [f32; 3]| {
            let light = f64::from(channels.iter().sum::<f32>() / 3.0).exp();
            let encoded = curve.encoded(light);
            let [low, high] = [encoded - 0.5 * NOISE, encoded + 0.5 * NOISE].map(|e| curve.linear(e));
            ((high - low) / light).powi(2) as f32
        };
        Self { variances: self.log_light.map(variance).map(|one| one.max(LEAST_VARIANCE)), ..*self }
    }

    /// ln(first / second) of red, green and blue.
    pub(super) fn log_ratio(&self) -> [f32; 3] {
        std::array::from_fn(|channel| self.log_light[0][channel] - self.log_light[1][channel])
    }

    /// The mean over the channels: the ratio of brightness.
    pub(super) fn brightness(&self) -> f32 {
        self.log_ratio().iter().sum::<f32>() / 3.0
    }
}

impl Patch {
    pub(super) fn new(
        placed: &Placed,
        thumbnail: &Thumbnail<'_>,
        scale: f64,
        [width, height]: [usize; 2],
        period: Option<usize>,
    ) -> Self {
        let placed = placed.in_first_turn(period);
        let width = width * if period.is_some() { TURNS } else { 1 };
        let grid = DeformedGrid::new(&placed.mesh, scale, false, width, height);
        let mut footprints: Vec<f64> = grid.cells.iter().map(|cell| cell.footprint[0].min(cell.footprint[1])).collect();
        footprints.sort_by(f64::total_cmp);
        let footprint = footprints.get(footprints.len() / 2).copied().unwrap_or(1.0);
        let block = (footprint * thumbnail.frame.working_from_full).round().max(1.0) as usize;
        let linearize = Linearize::of(thumbnail.curve);
        let light = block_means(thumbnail.raster, &linearize, block, TELLING);
        let from_full = thumbnail.frame.working_from_full / block as f64;
        let half = grid.size.map(|length| 0.5 * length);
        let corner = half[0] * half[0] + half[1] * half[1];

        let mut samples = vec![[f32::NAN; 4]; grid.rows.len() * grid.columns.len()];
        let all: Vec<u32> = (0..grid.cells.len() as u32).collect();
        let (mut owner, mut runs, mut positions) = (Vec::new(), Vec::<CellRun>::new(), Positions::default());
        for y in grid.rows.clone() {
            grid.runs(y, &all, &mut owner, &mut runs);
            let row = &mut samples[(y - grid.rows.start) * grid.columns.len()..][..grid.columns.len()];
            for run in &runs {
                positions.resize(run.columns.len());
                invert_row(&grid.cells[run.cell].inverse_along_row(y), run.columns.start, &mut positions);
                for (index, column) in run.columns.clone().enumerate() {
                    let [x, y] = positions.place(index);
                    let radius = ((x - half[0]).powi(2) + (y - half[1]).powi(2)) / corner;
                    let (x, y) = ((x * from_full).max(0.0) as usize, (y * from_full).max(0.0) as usize);
                    let light = light.pixel(x.min(light.width() - 1), y.min(light.height() - 1));
                    row[column - grid.columns.start] = [light[0], light[1], light[2], radius as f32];
                }
            }
        }
        Self { rows: grid.rows, columns: grid.columns, samples }
    }

    fn row(&self, y: usize, columns: &Range<usize>) -> &[[f32; 4]] {
        let start = (y - self.rows.start) * self.columns.len();
        &self.samples[start + columns.start - self.columns.start..start + columns.end - self.columns.start]
    }
}

/// Whether two photographs have a sample in common; on a cylinder of `turn` columns, turns apart, too.
pub(super) fn meet(first: &Patch, second: &Patch, turn: Option<usize>) -> bool {
    let turns = if turn.is_some() { TURNS } else { 0 };
    let turn = turn.unwrap_or(0);
    (0..=turns).any(|turns| window_ahead(first, second, turns * turn).is_some())
        || (1..=turns).any(|turns| window_ahead(second, first, turns * turn).is_some())
}

/// The places where both photographs tell their light; on a cylinder of `turn` columns, turns apart, too.
pub(super) fn shared(first: &Patch, second: &Patch, turn: Option<usize>) -> Vec<Shared> {
    let Some(turn) = turn else { return shared_ahead(first, second, 0) };
    // Each begins in the first turn or soon after and may reach some turns on.
    let ahead = (0..=TURNS).flat_map(|turns| shared_ahead(first, second, turns * turn));
    let behind =
        (1..=TURNS).flat_map(|turns| shared_ahead(second, first, turns * turn).into_iter().map(Shared::swapped));
    ahead.chain(behind).collect()
}

/// The rows and columns of both photographs if the second is moved to the right by some columns; `None` if there are
/// none.
fn window_ahead(first: &Patch, second: &Patch, by: usize) -> Option<(Range<usize>, Range<usize>)> {
    let rows = common(&first.rows, &second.rows);
    let columns = common(&first.columns, &(second.columns.start + by..second.columns.end + by));
    (!rows.is_empty() && !columns.is_empty()).then_some((rows, columns))
}

/// The places where both photographs tell their light if the second is moved to the right by some columns.
fn shared_ahead(first: &Patch, second: &Patch, by: usize) -> Vec<Shared> {
    let Some((rows, columns)) = window_ahead(first, second, by) else { return Vec::new() };
    let own = columns.start - by..columns.end - by;
    rows.flat_map(|y| first.row(y, &columns).iter().zip(second.row(y, &own)))
        .map(|(a, b)| Shared {
            log_light: [[a[0], a[1], a[2]], [b[0], b[1], b[2]]],
            radius: [a[3], b[3]],
            variances: [0.0; 2],
        })
        .filter(|shared| shared.log_ratio().iter().all(|ratio| ratio.is_finite()))
        .collect()
}

/// Natural logarithm of the mean linear light of blocks of `block` x `block` pixels, by channel; NaN where a sample
/// lies outside `telling`.
fn block_means(raster: &Raster<u8>, linearize: &Linearize, block: usize, telling: RangeInclusive<u8>) -> Raster<f32> {
    let (width, height) = (raster.width().div_ceil(block), raster.height().div_ceil(block));
    let mut means = Raster::new(width, height, 3);
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut count, mut tells) = ([0.0_f32; 3], 0, true);
            for row in y * block..((y + 1) * block).min(raster.height()) {
                let end = ((x + 1) * block).min(raster.width());
                for pixel in raster.row(row)[3 * x * block..3 * end].as_chunks::<3>().0 {
                    for (sum, &level) in sum.iter_mut().zip(pixel) {
                        *sum += linearize.linear(f32::from(level));
                        tells &= telling.contains(&level);
                    }
                    count += 1;
                }
            }
            let mean = |sum: f32| if tells { (sum / count as f32).ln() } else { f32::NAN };
            means.pixel_mut(x, y).copy_from_slice(&sum.map(mean));
        }
    }
    means
}
