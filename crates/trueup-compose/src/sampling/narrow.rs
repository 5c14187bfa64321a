//! Means over kernels that are a little wider than the interpolating one.

use trueup_core::raster::Raster;

use super::{MAX_STRETCH, OPAQUE, Sample};
use crate::kernel::InterpolationKernel;

/// Samples per axis that a narrow kernel is read from, whatever weighs nothing among them: as many as vector
/// instructions take at once.
pub(super) const NARROW_TAPS: usize = 8;

/// Levels of as many pixels of three channels.
const LEVELS: usize = 3 * NARROW_TAPS;

/// Positions whose weights are found side by side.
pub(super) const BLOCK: usize = 8;

/// Whether a kernel that is `stretch` times as wide weighs no more than [`NARROW_TAPS`] samples, wherever it lies.
pub(super) fn is_narrow<K: InterpolationKernel>(stretch: f64) -> bool {
    2.0 * K::RADIUS * stretch.clamp(1.0, MAX_STRETCH) < NARROW_TAPS as f64
}

/// Normalized weights of a narrow kernel around each of some positions, along one axis: bit by bit those of
/// [`widened_taps`](super::widened_taps).
pub(super) struct NarrowTaps {
    /// The first sample.
    first: [f64; BLOCK],
    /// The last sample, counted from the first.
    last: [f32; BLOCK],
    /// Of each tap those of all positions; 0 beyond the last.
    weights: [[f32; BLOCK]; NARROW_TAPS],
}

impl NarrowTaps {
    /// Around at most [`BLOCK`] positions, given as whole samples and fractions.
    #[inline(always)]
    pub(super) fn of<K: InterpolationKernel>(whole: &[i32], fractions: &[f32], stretch: f64) -> Self {
        let stretch = stretch.clamp(1.0, MAX_STRETCH);
        let radius = K::RADIUS * stretch;
        let step = stretch.recip() as f32;
        let mut positions = [0.0; BLOCK];
        for ((position, &whole), &fraction) in positions.iter_mut().zip(whole).zip(fractions) {
            *position = f64::from(whole) + f64::from(fraction);
        }
        let (mut first, mut last, mut start) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        // Loops instead of closures, which are functions of their own to the compiler, without the caller's vector
        // instructions.
        for at in 0..BLOCK {
            first[at] = (positions[at] - radius).ceil();
            last[at] = ((positions[at] + radius).floor() - first[at]) as f32;
            start[at] = ((first[at] - positions[at]) / stretch) as f32;
        }
        let mut weights = [[0.0; BLOCK]; NARROW_TAPS];
        let mut sums = [0.0; BLOCK];
        for (tap, weights) in weights.iter_mut().enumerate() {
            let tap = tap as f32;
            for at in 0..BLOCK {
                let weight = K::at(start[at] + tap * step);
                weights[at] = if tap <= last[at] { weight } else { 0.0 };
                sums[at] += weights[at];
            }
        }
        for sum in &mut sums {
            *sum = 1.0 / *sum;
        }
        for weights in &mut weights {
            for at in 0..BLOCK {
                weights[at] *= sums[at];
            }
        }
        Self { first, last, weights }
    }
}

/// A mean of opaque pixels by the weights of position `at` across and down, the same as that of
/// [`average_inside`](super::average_inside); `None` where fewer than [`NARROW_TAPS`] columns are there to be read.
#[inline(always)]
pub(super) fn average_narrow<T: Sample>(
    raster: &Raster<T>,
    across: &NarrowTaps,
    down: &NarrowTaps,
    at: usize,
) -> Option<[f32; 4]> {
    // The casts saturate.
    let (first_column, first_row) = (across.first[at] as i64, down.first[at] as i64);
    if first_column < 0 || first_column as usize + NARROW_TAPS > raster.width() {
        return None;
    }
    let start = 3 * first_column as usize;
    let mut columns = [0.0_f32; LEVELS];
    for tap in 0..(down.last[at] as usize + 1).min(NARROW_TAPS) {
        let weight = down.weights[tap][at];
        let row = (first_row + tap as i64).clamp(0, raster.height() as i64 - 1);
        let samples: &[T; LEVELS] = raster.row(row as usize).get(start..)?.first_chunk()?;
        for (column, sample) in columns.iter_mut().zip(samples) {
            *column += weight * sample.level();
        }
    }
    let mut sum = [0.0, 0.0, 0.0, OPAQUE];
    for (tap, column) in columns.as_chunks::<3>().0.iter().enumerate() {
        // What weighs nothing changes nothing.
        let weight = across.weights[tap][at];
        for channel in 0..3 {
            sum[channel] += weight * column[channel];
        }
    }
    Some(sum)
}
