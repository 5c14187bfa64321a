//! From samples of a photograph to corrected linear light.

use std::ops::Range;

use super::positions::Positions;
use crate::light::{LightTable, shown};
use crate::weights::{Feather, Weighting, weight};

/// What one photograph brings to [`accumulate`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contribution<'a> {
    pub(crate) feather: &'a Feather,
    /// Factors on linear light.
    pub(crate) light: &'a LightTable,
    /// A further factor for each sample; `None` for 1.
    pub(crate) local: Option<&'a [f32]>,
    /// Size of a canvas pixel in photograph pixels where the photograph's border may cut canvas pixels.
    pub(crate) border_footprint: Option<[f32; 2]>,
    pub(crate) weighting: Weighting,
}

/// Linearizes `samples` (red, green, blue, alpha from 0 to 255), weighs them and joins them to the canvas pixels
/// `sums`.
pub(crate) fn accumulate(
    contribution: Contribution<'_>,
    positions: &Positions,
    samples: &[[f32; 4]],
    sums: &mut [[f32; 4]],
) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::accumulate(contribution, positions, samples, sums) };
    }
    accumulate_portable(contribution, positions, samples, sums);
}

#[inline(always)]
fn accumulate_portable(
    contribution: Contribution<'_>,
    positions: &Positions,
    samples: &[[f32; 4]],
    sums: &mut [[f32; 4]],
) {
    let Contribution { feather, light, local, border_footprint, weighting } = contribution;
    let length = sums.len();
    let samples = &samples[..length];
    for start in (0..length).step_by(BLOCK) {
        let block = start..(start + BLOCK).min(length);
        let lifts = lifts(light, local, positions, &block);
        let linear = corrected(light, &samples[block.clone()], &lifts);
        for (at, index) in block.enumerate() {
            let (column, row) = (positions.column[index], positions.row[index]);
            let (fraction_x, fraction_y) = (positions.fraction_x[index], positions.fraction_y[index]);
            let share = share(samples[index][3], feather, border_footprint, positions, index);
            let inside = match weighting {
                Weighting::Equal => 1.0,
                Weighting::Feathered => feather.at(column, row, fraction_x, fraction_y),
            };
            let weight = weight(share, inside);
            let [r, g, b] = linear.map(|channel| channel[at]);
            let sum = &mut sums[index];
            *sum = [sum[0] + r * weight, sum[1] + g * weight, sum[2] + b * weight, sum[3] + weight];
        }
    }
}

/// What one photograph brings to [`develop`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Development<'a> {
    pub(crate) feather: &'a Feather,
    /// Factors on linear light.
    pub(crate) light: &'a LightTable,
    /// A further factor for each sample; `None` for 1.
    pub(crate) local: Option<&'a [f32]>,
    /// Size of a canvas pixel in photograph pixels where the photograph's border may cut canvas pixels.
    pub(crate) border_footprint: Option<[f32; 2]>,
}

/// Turns `samples` (red, green, blue, alpha from 0 to 255) in place into square roots of corrected linear light, or
/// fourth roots where what is brighter than white is kept, and the share of the canvas pixel that is covered, 0 to 1.
pub(crate) fn develop(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::develop(development, positions, samples) };
    }
    develop_portable(development, positions, samples);
}

fn develop_portable(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
    develop_from(0, development, positions, samples);
}

/// [`develop`] of samples of which the first is number `first`.
#[inline(always)]
fn develop_from(first: usize, development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
    let Development { feather, light, local, border_footprint } = development;
    for (number, samples) in samples.chunks_mut(BLOCK).enumerate() {
        let block = first + number * BLOCK..first + number * BLOCK + samples.len();
        let lifts = lifts(light, local, positions, &block);
        let mut roots = corrected(light, samples, &lifts);
        roots.iter_mut().flatten().for_each(|value| *value = value.sqrt());
        if light.keeps_light {
            roots.iter_mut().flatten().for_each(|value| *value = value.sqrt());
        }
        for (at, (index, sample)) in block.zip(samples).enumerate() {
            let share = share(sample[3], feather, border_footprint, positions, index);
            *sample = [roots[0][at], roots[1][at], roots[2][at], share];
        }
    }
}

/// Samples that are corrected together: their channels lie side by side, as vector instructions want them.
const BLOCK: usize = 16;

/// The factors on the light of a block of samples that are the same for all channels.
#[inline(always)]
fn lifts(light: &LightTable, local: Option<&[f32]>, positions: &Positions, block: &Range<usize>) -> [f32; BLOCK] {
    let mut lifts = [1.0; BLOCK];
    if light.varies() {
        let (mut x, mut y) = ([0.0; BLOCK], [0.0; BLOCK]);
        for ((x, y), index) in x.iter_mut().zip(&mut y).zip(block.clone()) {
            [*x, *y] = center(positions, index);
        }
        lifts = light.at(x, y);
    }
    if let Some(factors) = local {
        for (lift, factor) in lifts.iter_mut().zip(&factors[block.clone()]) {
            *lift *= factor;
        }
    }
    lifts
}

/// Corrected linear light of a block of samples, channel by channel.
#[inline(always)]
fn corrected(light: &LightTable, samples: &[[f32; 4]], lifts: &[f32; BLOCK]) -> [[f32; BLOCK]; 3] {
    let mut levels = [[0.0; BLOCK]; 3];
    for (at, &[r, g, b, _]) in samples.iter().enumerate().take(BLOCK) {
        (levels[0][at], levels[1][at], levels[2][at]) = (r, g, b);
    }
    for channel in &mut levels {
        *channel = light.linearize.linear_all(*channel);
    }
    if light.keeps_light {
        for (channel, gain) in levels.iter_mut().zip(light.gain) {
            for (value, lift) in channel.iter_mut().zip(lifts) {
                *value *= gain * lift;
            }
        }
        return levels;
    }
    let [gain_r, gain_g, gain_b] = light.gain;
    for (at, lift) in lifts.iter().enumerate() {
        let linear = [levels[0][at], levels[1][at], levels[2][at]];
        [levels[0][at], levels[1][at], levels[2][at]] =
            shown(linear, [gain_r * lift, gain_g * lift, gain_b * lift], light.shoulder);
    }
    levels
}

/// The share that is covered of a sample, for each level of its opacity.
const SHARE_PER_LEVEL: f32 = 1.0 / 255.0;

/// The share of a canvas pixel that a sample covers: what is transparent of it covers nothing, and neither does what
/// lies beyond the photograph's border.
#[inline(always)]
fn share(
    opacity: f32,
    feather: &Feather,
    border_footprint: Option<[f32; 2]>,
    positions: &Positions,
    index: usize,
) -> f32 {
    let share = (opacity * SHARE_PER_LEVEL).clamp(0.0, 1.0);
    match border_footprint {
        Some(footprint) => share * feather.coverage(center(positions, index), footprint),
        None => share,
    }
}

/// Position `index` in the photograph's pixels.
#[inline(always)]
fn center(positions: &Positions, index: usize) -> [f32; 2] {
    [
        positions.column[index] as f32 + 0.5 + positions.fraction_x[index],
        positions.row[index] as f32 + 0.5 + positions.fraction_y[index],
    ]
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        __m256, _CMP_LT_OQ, _mm_loadu_ps, _mm_storeu_ps, _mm256_add_ps, _mm256_castps_si256, _mm256_castps128_ps256,
        _mm256_castps256_ps128, _mm256_cmp_ps, _mm256_cvtepi32_ps, _mm256_div_ps, _mm256_extractf128_ps,
        _mm256_insertf128_ps, _mm256_loadu_ps, _mm256_loadu_si256, _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps,
        _mm256_mul_ps, _mm256_set1_ps, _mm256_setzero_ps, _mm256_shuffle_ps, _mm256_sqrt_ps, _mm256_storeu_si256,
        _mm256_sub_ps, _mm256_unpackhi_ps, _mm256_unpacklo_ps,
    };
    use std::ops::Range;

    use super::{Contribution, Development, Positions};
    use crate::light::{LEAST_DIVISOR, LEAST_WHITE, LightTable, NEAR_WHITE, WARMEST, WHITENED};
    use crate::linear_table::{LinearTable, ROUNDING};

    #[target_feature(enable = "avx2")]
    pub(super) fn accumulate(
        contribution: Contribution<'_>,
        positions: &Positions,
        samples: &[[f32; 4]],
        sums: &mut [[f32; 4]],
    ) {
        super::accumulate_portable(contribution, positions, samples, sums);
    }

    /// Eight pixels at a time; what is left, and where a border cuts pixels, as the portable form does it.
    #[target_feature(enable = "avx2")]
    pub(super) fn develop(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
        let Development { light, local, border_footprint, .. } = development;
        let whole = if border_footprint.is_some() { 0 } else { samples.len() / LANES * LANES };
        let (eights, rest) = samples.split_at_mut(whole);
        let varies = light.varies();
        for (at, eight) in eights.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let block = at * LANES..(at + 1) * LANES;
            let mut lifts = _mm256_set1_ps(1.0);
            if varies {
                lifts = falloff(light, positions, &block);
            }
            if let Some(factors) = local {
                let factors: &[f32] = &factors[block];
                // SAFETY: there are eight factors.
                lifts = _mm256_mul_ps(lifts, unsafe { _mm256_loadu_ps(factors.as_ptr()) });
            }
            let [r, g, b, opacity] = by_channel(eight);
            let linear = [r, g, b].map(|level| linear(light, level));
            let factors = light.gain.map(|gain| _mm256_mul_ps(_mm256_set1_ps(gain), lifts));
            let roots = if light.keeps_light {
                let root = |at: usize| _mm256_sqrt_ps(_mm256_sqrt_ps(_mm256_mul_ps(linear[at], factors[at])));
                [root(0), root(1), root(2)]
            } else {
                shown_all(linear, factors, light.shoulder).map(|light| _mm256_sqrt_ps(light))
            };
            let share = _mm256_mul_ps(opacity, _mm256_set1_ps(super::SHARE_PER_LEVEL));
            let share = _mm256_min_ps(_mm256_max_ps(share, _mm256_setzero_ps()), _mm256_set1_ps(1.0));
            by_pixel([roots[0], roots[1], roots[2], share], eight);
        }
        if !rest.is_empty() {
            super::develop_from(whole, development, positions, rest);
        }
    }

    /// Pixels that are developed side by side.
    const LANES: usize = 8;

    /// [`exposed`](crate::light::exposed), the same operations in the same order.
    #[target_feature(enable = "avx2")]
    fn exposed_all(linear: __m256, factor: __m256) -> __m256 {
        let square = |value| _mm256_mul_ps(value, value);
        let one = _mm256_set1_ps(1.0);
        let strength = _mm256_sub_ps(square(square(_mm256_max_ps(factor, one))), one);
        let levelled = _mm256_add_ps(one, _mm256_mul_ps(strength, square(square(linear))));
        _mm256_div_ps(_mm256_mul_ps(factor, linear), _mm256_sqrt_ps(_mm256_sqrt_ps(levelled)))
    }

    /// [`shown`](crate::light::shown), the same operations in the same order.
    #[target_feature(enable = "avx2")]
    fn shown_all([red, green, blue]: [__m256; 3], factors: [__m256; 3], shoulder: f32) -> [__m256; 3] {
        let all = |value: f32| _mm256_set1_ps(value);
        let square = |value| _mm256_mul_ps(value, value);
        let (zero, one) = (_mm256_setzero_ps(), all(1.0));
        let least = factors.into_iter().fold(one, |least, factor| _mm256_min_ps(least, factor));
        if _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(least, one)) == 0 {
            // Nothing is darkened: all else changes nothing.
            return [exposed_all(red, factors[0]), exposed_all(green, factors[1]), exposed_all(blue, factors[2])];
        }
        let smooth = |share| {
            let share = _mm256_min_ps(_mm256_max_ps(share, zero), one);
            let steep = _mm256_sub_ps(all(3.0), _mm256_mul_ps(all(2.0), share));
            _mm256_mul_ps(_mm256_mul_ps(share, share), steep)
        };
        let [from, to] = WHITENED;
        let mean = _mm256_mul_ps(_mm256_add_ps(_mm256_add_ps(red, green), blue), all(1.0 / 3.0));
        let beyond = _mm256_mul_ps(_mm256_sub_ps(mean, all(from)), all(1.0 / (to - from)));
        let white = smooth(beyond);
        let ratio = |third| _mm256_div_ps(green, _mm256_max_ps(third, all(LEAST_DIVISOR)));
        let root = |ratio| _mm256_sqrt_ps(_mm256_max_ps(ratio, one));
        let blue_of = _mm256_mul_ps(green, root(ratio(red)));
        let red_of = _mm256_mul_ps(green, root(_mm256_min_ps(ratio(blue), all(WARMEST))));
        let near =
            |linear| smooth(_mm256_mul_ps(_mm256_sub_ps(linear, all(NEAR_WHITE)), all(1.0 / (1.0 - NEAR_WHITE))));
        let developed = |linear, continued, factor| {
            let darkening = _mm256_min_ps(_mm256_max_ps(factor, all(LEAST_WHITE)), one);
            let most = _mm256_div_ps(linear, darkening);
            let missing = _mm256_max_ps(_mm256_sub_ps(_mm256_min_ps(continued, most), linear), zero);
            let strength = _mm256_sub_ps(square(square(darkening)), one);
            let spread = _mm256_add_ps(one, _mm256_mul_ps(strength, square(square(linear))));
            let spread = _mm256_div_ps(one, _mm256_sqrt_ps(_mm256_sqrt_ps(spread)));
            let to_white = _mm256_sub_ps(_mm256_div_ps(one, darkening), one);
            let together = _mm256_add_ps(one, _mm256_mul_ps(white, to_white));
            let lift = _mm256_add_ps(together, _mm256_mul_ps(all(shoulder), _mm256_sub_ps(spread, together)));
            let light = exposed_all(_mm256_add_ps(linear, _mm256_mul_ps(near(linear), missing)), factor);
            _mm256_min_ps(_mm256_mul_ps(light, lift), _mm256_div_ps(factor, darkening))
        };
        let shown_red = developed(red, red_of, factors[0]);
        let shown_green = developed(green, zero, factors[1]);
        let shown_blue = developed(blue, blue_of, factors[2]);
        let between = _mm256_sqrt_ps(_mm256_mul_ps(shown_red, _mm256_max_ps(shown_red, shown_blue)));
        let bounded = _mm256_min_ps(shown_green, _mm256_max_ps(between, _mm256_mul_ps(factors[1], green)));
        let change = _mm256_mul_ps(near(green), _mm256_sub_ps(bounded, shown_green));
        [shown_red, _mm256_add_ps(shown_green, change), shown_blue]
    }

    /// Linear light of samples on the scale of 0 to 255.
    #[target_feature(enable = "avx2")]
    fn linear(light: &LightTable, level: __m256) -> __m256 {
        // The first operand is the one that is not kept where one is no number.
        let level = _mm256_max_ps(level, _mm256_setzero_ps());
        let level = _mm256_min_ps(level, _mm256_set1_ps(255.0));
        let (values, per_level) = light.linearize.table();
        at_all(values, _mm256_mul_ps(level, _mm256_set1_ps(per_level)))
    }

    /// The factors against vignetting of a block of eight positions.
    #[target_feature(enable = "avx2")]
    fn falloff(light: &LightTable, positions: &Positions, block: &Range<usize>) -> __m256 {
        let Some((table, center, steps_per_px2, last)) = light.falloff() else { return _mm256_set1_ps(1.0) };
        let from_center = |whole: &[i32], fraction: &[f32], center: f32| {
            let (whole, fraction): (&[i32], &[f32]) = (&whole[block.clone()], &fraction[block.clone()]);
            // SAFETY: there are eight of both.
            let (whole, fraction) =
                unsafe { (_mm256_loadu_si256(whole.as_ptr().cast()), _mm256_loadu_ps(fraction.as_ptr())) };
            let place = _mm256_add_ps(_mm256_add_ps(_mm256_cvtepi32_ps(whole), _mm256_set1_ps(0.5)), fraction);
            _mm256_sub_ps(place, _mm256_set1_ps(center))
        };
        let dx = from_center(&positions.column, &positions.fraction_x, center[0]);
        let dy = from_center(&positions.row, &positions.fraction_y, center[1]);
        let squared = _mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy));
        let steps = _mm256_mul_ps(squared, _mm256_set1_ps(steps_per_px2));
        at_all(table, _mm256_min_ps(steps, _mm256_set1_ps(last)))
    }

    /// [`LinearTable::at_all`] of eight positions.
    #[target_feature(enable = "avx2")]
    fn at_all<const ENTRIES: usize>(table: &LinearTable<ENTRIES>, positions: __m256) -> __m256 {
        let rounding = _mm256_set1_ps(ROUNDING);
        let rounded = _mm256_add_ps(_mm256_sub_ps(positions, _mm256_set1_ps(0.5)), rounding);
        let beyond = _mm256_sub_ps(positions, _mm256_sub_ps(rounded, rounding));
        let mut at = [0_i32; LANES];
        // SAFETY: there is room for eight.
        unsafe { _mm256_storeu_si256(at.as_mut_ptr().cast(), _mm256_castps_si256(rounded)) };
        // In the order in which the halves of both vectors are taken apart below. Read one by one: a gather is no
        // faster, and not every emulator reads the same. Their low bits are the whole numbers.
        let entries = [0, 1, 4, 5, 2, 3, 6, 7].map(|lane: usize| table.entries()[at[lane] as usize % ENTRIES]);
        // SAFETY: eight entries are sixteen floats.
        let (first, second) = unsafe {
            let floats: *const f32 = entries.as_ptr().cast();
            (_mm256_loadu_ps(floats), _mm256_loadu_ps(floats.add(LANES)))
        };
        let values = _mm256_shuffle_ps::<0b10_00_10_00>(first, second);
        let steps = _mm256_shuffle_ps::<0b11_01_11_01>(first, second);
        _mm256_add_ps(values, _mm256_mul_ps(beyond, steps))
    }

    /// Eight pixels, channel by channel.
    #[target_feature(enable = "avx2")]
    fn by_channel(pixels: &[[f32; 4]; LANES]) -> [__m256; 4] {
        // Pixels 0 and 4, 1 and 5, 2 and 6, 3 and 7.
        let pair = |at: usize| {
            // SAFETY: a pixel is four floats.
            let (low, high) = unsafe { (_mm_loadu_ps(pixels[at].as_ptr()), _mm_loadu_ps(pixels[at + 4].as_ptr())) };
            _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(low), high)
        };
        transposed([pair(0), pair(1), pair(2), pair(3)])
    }

    /// Puts channels back into eight pixels.
    #[target_feature(enable = "avx2")]
    fn by_pixel(channels: [__m256; 4], pixels: &mut [[f32; 4]; LANES]) {
        for (at, pair) in transposed(channels).into_iter().enumerate() {
            // SAFETY: a pixel is four floats.
            unsafe {
                _mm_storeu_ps(pixels[at].as_mut_ptr(), _mm256_castps256_ps128(pair));
                _mm_storeu_ps(pixels[at + 4].as_mut_ptr(), _mm256_extractf128_ps::<1>(pair));
            }
        }
    }

    /// Rows as columns of the 4 x 4 in each half.
    #[target_feature(enable = "avx2")]
    fn transposed([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
        let (ab_low, ab_high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        let (cd_low, cd_high) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_low, cd_low),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_low, cd_low),
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::color::TransferCurve;

    use super::*;
    use crate::light::{Correction, PhotographLight};

    /// With vector instructions and without, to the last bit: dark, bright and clipped colors, darkened and brightened,
    /// with a shoulder, half of one and none.
    #[test]
    fn every_processor_shows_the_same_light() {
        let levels = [0.0, 90.5, 214.0, 236.25, 243.0, 250.0, 254.6, 255.0];
        let level = |at: usize| levels[at % levels.len()];
        let samples: Vec<[f32; 4]> = (0..512).map(|at| [level(at), level(at / 8), level(at / 64), 255.0]).collect();
        let mut positions = Positions::default();
        positions.resize(samples.len());
        (0..samples.len()).for_each(|at| positions.column[at] = at as i32 % 400);
        let feather = Feather::new([400.0, 300.0], 1.0);
        for shoulder in [0.0, 0.5, 1.0] {
            for gain in [[0.3, 0.31, 0.29], [0.7, 0.75, 0.72], [0.98, 1.0, 1.03], [1.4, 1.5, 1.6]] {
                let correction = Correction { gain, vignetting: [0.2, 0.0, 0.1], shoulder };
                let light = PhotographLight { curve: &TransferCurve::SRGB, correction: &correction, local: None };
                let light = LightTable::new(light, [400.0, 300.0]);
                let development = Development { feather: &feather, light: &light, local: None, border_footprint: None };
                let (mut here, mut portable) = (samples.clone(), samples.clone());
                develop(development, &positions, &mut here);
                develop_portable(development, &positions, &mut portable);
                let bits = |samples: &[[f32; 4]]| {
                    samples.as_flattened().iter().map(|value| value.to_bits()).collect::<Vec<_>>()
                };
                assert_eq!(bits(&here), bits(&portable), "{correction:?}");
            }
        }
    }
}
