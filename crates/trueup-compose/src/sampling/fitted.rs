//! Making a photograph smaller by any factor before it is sampled.

use std::marker::PhantomData;

use rayon::prelude::*;
use trueup_core::raster::{Photograph, Raster};

use super::{MAX_TAPS, Sample, widened_taps};
use crate::kernel::Bicubic;
use crate::simd::{VectorLoop, with_vector_instructions};

/// The photograph with `factor` times fewer pixels along each side, 1 to 15, the last column and row reaching beyond
/// its border where they do not come out even; by a cubic kernel as much wider. With alpha it stays as it is: colors
/// would have to be weighed by it.
pub(crate) fn reduce_by(photograph: &Photograph, factor: f64) -> Option<Photograph> {
    match photograph {
        Photograph::Eight(raster) => reduced(raster, factor).map(Photograph::Eight),
        Photograph::Sixteen(raster) => reduced(raster, factor).map(Photograph::Sixteen),
    }
}

fn reduced<T: Sample>(raster: &Raster<T>, factor: f64) -> Option<Raster<T>> {
    match raster.channels() {
        1 => Some(reduced_channels::<T, 1>(raster, factor)),
        3 => Some(reduced_channels::<T, 3>(raster, factor)),
        _ => None,
    }
}

/// The samples along one axis that a reduced one is the mean of: their weights, the first of them.
struct Taps {
    first: i64,
    weights: Vec<f32>,
}

/// Those of every one of so many reduced samples.
fn taps(count: usize, factor: f64) -> Vec<Taps> {
    let mut workspace = [0.0; MAX_TAPS];
    let one = |index: usize| {
        let (first, weights) = widened_taps::<Bicubic>((index as f64 + 0.5) * factor - 0.5, factor, &mut workspace);
        Taps { first, weights: weights.to_vec() }
    };
    (0..count).map(one).collect()
}

fn reduced_channels<T: Sample, const C: usize>(raster: &Raster<T>, factor: f64) -> Raster<T> {
    let [width, height] = [raster.width(), raster.height()].map(|side| (side as f64 / factor).ceil() as usize);
    let (across, down) = (taps(width, factor), taps(height, factor));
    let mut reduced = Raster::new(width, height, C);
    reduced.data_mut().par_chunks_mut((width * C).max(1)).zip(&down).for_each_init(Vec::new, |sums, (row, down)| {
        with_vector_instructions(OneRow::<T, C> { raster, across: &across, down, sums, row, kernel: PhantomData });
    });
    reduced
}

/// Values of a column of sums that are read together, one at least for each channel.
const LANES: usize = 4;

/// One reduced row: rows are summed first, as they lie in memory, then columns.
struct OneRow<'a, T, const C: usize> {
    raster: &'a Raster<T>,
    across: &'a [Taps],
    down: &'a Taps,
    /// Room for the sums of a row.
    sums: &'a mut Vec<f32>,
    row: &'a mut [T],
    kernel: PhantomData<[(); C]>,
}

impl<T: Sample, const C: usize> VectorLoop for OneRow<'_, T, C> {
    #[inline(always)]
    fn run(self) {
        let Self { raster, across, down, sums, row, .. } = self;
        let clamped = |at: i64, size: usize| at.clamp(0, size as i64 - 1) as usize;
        sums.clear();
        // Columns are read four values at a time, as many as vector instructions take, whatever follows the last
        // channel.
        sums.resize(raster.width() * C + LANES - C, 0.0);
        for (tap, &weight) in down.weights.iter().enumerate() {
            let samples = raster.row(clamped(down.first + tap as i64, raster.height()));
            for (sum, sample) in sums.iter_mut().zip(samples) {
                *sum += weight * sample.level();
            }
        }
        for (out, taps) in row.as_chunks_mut::<C>().0.iter_mut().zip(across) {
            let mut mean = [0.0_f32; LANES];
            let last = taps.first + taps.weights.len() as i64;
            if taps.first >= 0 && last <= raster.width() as i64 {
                let within = &sums[taps.first as usize * C..(last as usize - 1) * C + LANES];
                for (column, &weight) in within.windows(LANES).step_by(C).zip(&taps.weights) {
                    for lane in 0..LANES {
                        mean[lane] += weight * column[lane];
                    }
                }
            } else {
                for (tap, &weight) in taps.weights.iter().enumerate() {
                    let column = &sums[clamped(taps.first + tap as i64, raster.width()) * C..][..LANES];
                    for lane in 0..LANES {
                        mean[lane] += weight * column[lane];
                    }
                }
            }
            for (out, &mean) in out.iter_mut().zip(&mean) {
                *out = T::of_level(mean);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp stays the same ramp: pixel centers lie at halves in both.
    #[test]
    fn coordinates_are_divided_by_the_factor() {
        let (width, height, factor) = (90, 61, 1.7);
        let ramp = |x: f64, y: f64| 20.0 + 1.5 * x + 0.7 * y;
        let data: Vec<u16> = (0..width * height)
            .flat_map(|at| {
                let level = ramp((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
                [level, level + 30.0, level / 2.0].map(|level| (level * 257.0).round() as u16)
            })
            .collect();
        let raster = Raster::from_data(width, height, 3, data).expect("as many samples");
        let Some(Photograph::Sixteen(reduced)) = reduce_by(&Photograph::Sixteen(raster), factor) else {
            panic!("the same depth")
        };
        assert_eq!((reduced.width(), reduced.height()), (53, 36));
        // Where the kernel does not reach over the border.
        for (x, y) in [(3, 3), (20, 17), (47, 30)] {
            let level = ramp((x as f64 + 0.5) * factor, (y as f64 + 0.5) * factor);
            for (found, expected) in reduced.pixel(x, y).iter().zip([level, level + 30.0, level / 2.0]) {
                assert!((f64::from(*found) / 257.0 - expected).abs() < 0.05, "{found} at {x}, {y}");
            }
        }
    }

    /// Bounds of eight bits hold where the kernel overshoots, and a single color stays what it is to the border.
    #[test]
    fn levels_stay_within_their_depth() {
        let flat = Raster::from_data(9, 7, 1, vec![255_u8; 63]).expect("as many samples");
        let Some(Photograph::Eight(reduced)) = reduce_by(&Photograph::Eight(flat), 1.3) else { panic!("same depth") };
        assert!(reduced.data().iter().all(|&level| level == 255));
        let step = Raster::from_data(8, 1, 1, vec![0_u8, 0, 0, 0, 255, 255, 255, 255]).expect("as many samples");
        let Some(Photograph::Eight(reduced)) = reduce_by(&Photograph::Eight(step), 1.6) else { panic!("same depth") };
        assert_eq!((reduced.data()[0], reduced.data()[4]), (0, 255));
    }

    #[test]
    fn colors_with_alpha_are_left_as_they_are() {
        assert!(reduce_by(&Photograph::Eight(Raster::new(4, 4, 4)), 1.5).is_none());
    }
}
