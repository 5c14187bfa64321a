//! Halving a photograph before it is sampled at a much coarser spacing.

use rayon::prelude::*;
use trueup_core::raster::{Photograph, Raster};

use crate::simd::{VectorLoop, with_vector_instructions};

/// The photograph at half the size: every sample the mean of 2 x 2. Coordinates are exactly halved; the last column or
/// row of an odd size averages the samples it has. Colors are weighted by alpha where there is one.
pub(crate) fn reduce_by_two(photograph: &Photograph) -> Photograph {
    match photograph {
        Photograph::Eight(raster) => Photograph::Eight(halve(raster, u32::from, |mean| mean as u8)),
        Photograph::Sixteen(raster) => Photograph::Sixteen(halve(raster, u32::from, |mean| mean as u16)),
    }
}

fn halve<T: Copy + Default + Send + Sync>(
    raster: &Raster<T>,
    value: impl Fn(T) -> u32 + Sync,
    sample: impl Fn(u32) -> T + Sync,
) -> Raster<T> {
    match raster.channels() {
        1 => halve_opaque::<T, 1>(raster, &value, &sample),
        3 => halve_opaque::<T, 3>(raster, &value, &sample),
        _ => halve_rows::<T, 4>(raster, |quad| mean_by_alpha(quad, &value, &sample)),
    }
}

/// The picture of the means of every 2 x 2 pixels of `C` channels: upper left, upper right, lower left, lower right.
fn halve_rows<T: Copy + Default + Send + Sync, const C: usize>(
    raster: &Raster<T>,
    mean: impl Fn([&[T; C]; 4]) -> [T; C] + Sync,
) -> Raster<T> {
    let (width, height) = (raster.width().div_ceil(2), raster.height().div_ceil(2));
    let mut reduced = Raster::new(width, height, C);
    reduced.data_mut().par_chunks_mut((width * C).max(1)).enumerate().for_each(|(y, row)| {
        let [upper, lower] =
            [2 * y, (2 * y + 1).min(raster.height() - 1)].map(|row| raster.row(row).as_chunks::<C>().0);
        let pairs = upper.chunks(2).zip(lower.chunks(2));
        for (out, (upper, lower)) in row.as_chunks_mut::<C>().0.iter_mut().zip(pairs) {
            // Of an odd width the last column stands for two.
            let last = upper.len() - 1;
            *out = mean([&upper[0], &upper[last], &lower[0], &lower[last]]);
        }
    });
    reduced
}

/// [`halve_rows`] where every pixel counts the same: rows are added up first, side by side.
fn halve_opaque<T: Copy + Default + Send + Sync, const C: usize>(
    raster: &Raster<T>,
    value: &(impl Fn(T) -> u32 + Sync),
    sample: &(impl Fn(u32) -> T + Sync),
) -> Raster<T> {
    let (width, height) = (raster.width().div_ceil(2), raster.height().div_ceil(2));
    let mut reduced = Raster::new(width, height, C);
    let rows = reduced.data_mut().par_chunks_mut((width * C).max(1)).enumerate();
    rows.for_each_init(Vec::new, |sums, (y, row)| {
        let [upper, lower] = [2 * y, (2 * y + 1).min(raster.height() - 1)].map(|row| raster.row(row));
        with_vector_instructions(HalvedRow::<T, _, _, C> { upper, lower, value, sample, sums, row });
    });
    reduced
}

/// A row of means of 2 x 2 pixels of `C` channels.
struct HalvedRow<'a, T, V, S, const C: usize> {
    upper: &'a [T],
    lower: &'a [T],
    value: &'a V,
    sample: &'a S,
    /// Room for the sums of both rows.
    sums: &'a mut Vec<u32>,
    row: &'a mut [T],
}

impl<T: Copy, V: Fn(T) -> u32, S: Fn(u32) -> T, const C: usize> VectorLoop for HalvedRow<'_, T, V, S, C> {
    #[inline(always)]
    fn run(self) {
        let Self { upper, lower, value, sample, sums, row } = self;
        sums.clear();
        sums.resize(upper.len(), 0);
        for ((sum, &upper), &lower) in sums.iter_mut().zip(upper).zip(lower) {
            *sum = value(upper) + value(lower);
        }
        let columns = sums.as_chunks::<C>().0;
        let (pairs, odd) = columns.as_chunks::<2>();
        let row = row.as_chunks_mut::<C>().0;
        for (out, [left, right]) in row.iter_mut().zip(pairs) {
            for channel in 0..C {
                out[channel] = sample((left[channel] + right[channel] + 2) / 4);
            }
        }
        // Of an odd width the last column stands for two.
        if let ([last], Some(out)) = (odd, row.last_mut()) {
            for channel in 0..C {
                out[channel] = sample((2 * last[channel] + 2) / 4);
            }
        }
    }
}

fn mean_by_alpha<T: Copy + Default, const C: usize>(
    quad: [&[T; C]; 4],
    value: impl Fn(T) -> u32,
    sample: impl Fn(u32) -> T,
) -> [T; C] {
    let weights = quad.map(|pixel| u64::from(value(pixel[C - 1])));
    let total: u64 = weights.iter().sum();
    std::array::from_fn(|channel| {
        let levels = quad.map(|pixel| u64::from(value(pixel[channel])));
        let (sum, count): (u64, u64) = if channel == C - 1 || total == 0 {
            (levels.iter().sum(), 4)
        } else {
            (levels.iter().zip(weights).map(|(level, weight)| level * weight).sum(), total)
        };
        // The cast is of a mean of samples.
        sample(((sum + count / 2) / count) as u32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_averages_and_keeps_odd_borders() {
        let raster = Raster::from_data(3, 1, 1, vec![10_u8, 20, 33]).expect("three samples");
        let Photograph::Eight(reduced) = reduce_by_two(&Photograph::Eight(raster)) else { panic!("same depth") };
        assert_eq!((reduced.width(), reduced.height(), reduced.data()), (2, 1, &[15_u8, 33][..]));
    }

    #[test]
    fn colors_under_a_mask_do_not_bleed() {
        let raster = Raster::from_data(2, 1, 4, vec![200_u16, 0, 0, 65535, 9, 9, 9, 0]).expect("two pixels");
        let Photograph::Sixteen(reduced) = reduce_by_two(&Photograph::Sixteen(raster)) else { panic!("same depth") };
        assert_eq!(reduced.data(), [200, 0, 0, 32768]);
    }
}
