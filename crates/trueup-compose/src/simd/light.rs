//! From samples of a photograph to corrected linear light.

use std::ops::Range;

use super::positions::Positions;
use crate::light::{LightTable, exposed};
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

/// Linearizes `samples` (red, green, blue, alpha from 0 to 255), weighs them and joins them to the canvas pixels `sums`.
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

/// Turns `samples` (red, green, blue, alpha from 0 to 255) in place into square roots of corrected linear light, or fourth roots where what
/// is brighter than white is kept, and the share of the canvas pixel that is covered, 0 to 1.
pub(crate) fn develop(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::develop(development, positions, samples) };
    }
    develop_portable(development, positions, samples);
}

#[inline(always)]
fn develop_portable(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
    let Development { feather, light, local, border_footprint } = development;
    let length = samples.len();
    for start in (0..length).step_by(BLOCK) {
        let block = start..(start + BLOCK).min(length);
        let lifts = lifts(light, local, positions, &block);
        let samples = &mut samples[block.clone()];
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
    for (channel, gain) in levels.iter_mut().zip(light.gain) {
        *channel = light.linearize.linear_all(*channel);
        if light.keeps_light {
            for (value, lift) in channel.iter_mut().zip(lifts) {
                *value *= gain * lift;
            }
            continue;
        }
        for (value, lift) in channel.iter_mut().zip(lifts) {
            *value = exposed(*value, gain * lift);
        }
    }
    levels
}

/// The share of a canvas pixel that a sample covers: what is transparent of it covers nothing, and neither does what lies
/// beyond the photograph's border.
#[inline(always)]
fn share(
    opacity: f32,
    feather: &Feather,
    border_footprint: Option<[f32; 2]>,
    positions: &Positions,
    index: usize,
) -> f32 {
    const PER_LEVEL: f32 = 1.0 / 255.0;
    let share = (opacity * PER_LEVEL).clamp(0.0, 1.0);
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
    use super::{Contribution, Development, Positions};

    #[target_feature(enable = "avx2")]
    pub(super) fn accumulate(
        contribution: Contribution<'_>,
        positions: &Positions,
        samples: &[[f32; 4]],
        sums: &mut [[f32; 4]],
    ) {
        super::accumulate_portable(contribution, positions, samples, sums);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn develop(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
        super::develop_portable(development, positions, samples);
    }
}
