//! The grain of what is filled: as much as the picture beside it has, and enough that no bands are seen in it.

use crate::pyramid::PyramidPlane;

/// Pixels between the samples that are compared: those of photographs that were drawn larger, or compressed, are alike
/// beside each other.
const STEP: usize = 2;

/// Levels of 8 bits; a step of a root is one of encoded levels, within a third.
const LEVELS: f32 = 255.0;

/// Least deviation, square roots of light: that of numbers that are anywhere within one step of 8 bits. Less, and a
/// slope is seen in bands.
const LEAST: f32 = 0.288_675_1 / LEVELS;

/// Most deviation, square roots of light: that of a sky at a high sensitivity. What differs by more is no grain.
const MOST: f32 = 3.0 / LEVELS;

/// The grain of a picture, of which `known` is known: the absolute deviations of its samples from those around them,
/// times the share.
///
/// # Source
/// Immerkaer, "Fast noise variance estimation", Computer Vision and Image Understanding 64(2), 1996: neither slopes nor
/// even bends of a picture count.
///
/// # Departures
/// Samples are [`STEP`] apart. What is not known wholly around a sample counts as little as the least known of it.
pub(super) fn of(known: &PyramidPlane<[f32; 4]>) -> PyramidPlane<[f32; 4]> {
    /// The operator's weights along one axis; that of a sample is their product, and its deviation [`NORM`] times that
    /// of the samples.
    const WEIGHTS: [f32; 3] = [1.0, -2.0, 1.0];
    const NORM: f32 = 6.0;
    /// Mean absolute deviation of a normal distribution: the square root of 2 / pi.
    const MEAN_ABSOLUTE: f32 = 0.797_884_6;
    let mut grain = PyramidPlane::new(known.columns.clone(), known.rows.clone());
    let width = known.columns.len();
    for y in known.rows.clone().skip(STEP).take(known.rows.len().saturating_sub(2 * STEP)) {
        let rows = [known.row(y - STEP), known.row(y), known.row(y + STEP)];
        let out = grain.row_mut(y);
        for x in STEP..width.saturating_sub(STEP) {
            if rows[1][x][3] <= 0.0 {
                continue;
            }
            let (mut sum, mut least) = ([0.0_f32; 3], f32::INFINITY);
            for (row, down) in rows.iter().zip(WEIGHTS) {
                for (texel, across) in [row[x - STEP], row[x], row[x + STEP]].iter().zip(WEIGHTS) {
                    let weight = down * across / texel[3].max(f32::MIN_POSITIVE);
                    least = least.min(texel[3]);
                    sum.iter_mut().zip(texel).for_each(|(sum, value)| *sum += weight * value);
                }
            }
            if least > 0.0 {
                let [r, g, b] = sum.map(|sum| sum.abs() * least / (NORM * MEAN_ABSOLUTE));
                out[x] = [r, g, b, least];
            }
        }
    }
    grain
}

/// The deviation that is given to what is filled beside a picture of so much grain.
pub(super) fn deviation(beside: [f32; 3]) -> [f32; 3] {
    beside.map(|deviation| deviation.clamp(LEAST, MOST))
}

/// A number of deviation 1 and mean 0 for a place of the canvas, the same whenever it is asked for: `columns` are that
/// of the place and the one after it. As in photographs, whose samples lie between those of the camera, it is like
/// those beside it.
pub(super) fn noise(columns: [usize; 2], row: usize) -> f32 {
    /// Deviation of the mean of four even numbers from -1/2 to 1/2, its inverse: the square root of 48.
    const NORM: f32 = 6.928_203;
    let four = columns.map(|column| [row, row + 1].map(|row| even(column, row)));
    0.25 * NORM * four.as_flattened().iter().sum::<f32>()
}

/// A number from -1/2 to 1/2 for a place, all equally likely.
///
/// # Source
/// The mixing function of splitmix64: Steele, Lea, Flood, "Fast splittable pseudorandom number generators",
/// OOPSLA 2014.
fn even(column: usize, row: usize) -> f32 {
    /// Any odd number: the generator's own.
    const SEED: u64 = 0x9E37_79B9_7F4A_7C15;
    let mixed = |state: u64| {
        let state = (state ^ state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let state = (state ^ state >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        state ^ state >> 31
    };
    let bits = mixed(mixed(SEED.wrapping_mul(row as u64)).wrapping_add(SEED.wrapping_mul(column as u64)));
    // As many bits as a number has.
    (bits >> 40) as f32 / (1_u32 << 24) as f32 - 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_the_deviation_it_says() {
        const SIDE: usize = 400;
        let all: Vec<f32> = (0..SIDE * SIDE).map(|at| noise([at % SIDE, at % SIDE + 1], at / SIDE)).collect();
        let count = all.len() as f32;
        let mean = all.iter().sum::<f32>() / count;
        let variance = all.iter().map(|one| (one - mean).powi(2)).sum::<f32>() / count;
        assert!(mean.abs() < 0.02 && (variance.sqrt() - 1.0).abs() < 0.02, "{mean} {variance}");
        // No two rows are alike, and beside each other numbers are half alike.
        let product = |apart: usize| all.windows(apart + 1).map(|pair| pair[0] * pair[apart]).sum::<f32>() / count;
        assert!((product(1) - 0.5).abs() < 0.03, "{}", product(1));
        assert!(product(2).abs() < 0.03 && product(2 * SIDE).abs() < 0.03);
    }

    /// The grain of a slope with noise is that of the noise; of a slope alone it is none.
    #[test]
    fn grain_is_what_no_slope_tells() {
        let grain = |deviation: f32| {
            let mut known = PyramidPlane::new(0..90, 0..80);
            for y in 0..80 {
                for (x, texel) in known.row_mut(y).iter_mut().enumerate() {
                    let level = 0.3 + 0.002 * x as f32 + 0.003 * y as f32;
                    let level = level + deviation * noise([x, x + 1], y);
                    *texel = [level, level, 0.5 * level, 1.0].map(|value| 0.8 * value);
                }
            }
            let grain = of(&known);
            let [sum, weights] = [0, 3].map(|channel| grain.texels.iter().map(|texel| texel[channel]).sum::<f32>());
            sum / weights
        };
        assert!(grain(0.0) < 1e-5, "{}", grain(0.0));
        assert!((grain(0.01) / 0.01 - 1.0).abs() < 0.05, "{}", grain(0.01));
    }
}
