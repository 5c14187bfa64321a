//! Halving a photograph before it is sampled at a much coarser spacing.

use rayon::prelude::*;
use trueup_core::raster::{Photograph, Raster};

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
    sample: impl Fn(u64) -> T + Sync,
) -> Raster<T> {
    let channels = raster.channels();
    let (width, height) = (raster.width().div_ceil(2), raster.height().div_ceil(2));
    let mut reduced = Raster::new(width, height, channels);
    let row_length = (width * channels).max(1);
    reduced.data_mut().par_chunks_mut(row_length).enumerate().for_each(|(y, row)| {
        let rows = [raster.row(2 * y), raster.row((2 * y + 1).min(raster.height() - 1))];
        for (x, pixel) in row.chunks_exact_mut(channels).enumerate() {
            let columns = [2 * x, (2 * x + 1).min(raster.width() - 1)];
            if channels != 4 {
                let [left, right] = columns.map(|column| column * channels);
                for (channel, out) in pixel.iter_mut().enumerate() {
                    let at = |row: usize, column: usize| value(rows[row][column + channel]);
                    *out = sample(u64::from((at(0, left) + at(0, right) + at(1, left) + at(1, right) + 2) / 4));
                }
                continue;
            }
            let quad = [0, 1, 2, 3].map(|i| &rows[i / 2][columns[i % 2] * channels..][..channels]);
            let weights = quad.map(|source| u64::from(value(source[3])));
            let total: u64 = weights.iter().sum();
            for (channel, out) in pixel.iter_mut().enumerate() {
                let levels = quad.map(|source| u64::from(value(source[channel])));
                let (sum, count): (u64, u64) = if channel == 3 || total == 0 {
                    (levels.iter().sum(), 4)
                } else {
                    (levels.iter().zip(weights).map(|(level, weight)| level * weight).sum(), total)
                };
                *out = sample((sum + count / 2) / count);
            }
        }
    });
    reduced
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
