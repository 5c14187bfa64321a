//! From samples of a photograph to corrected linear light.

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
    const PER_LEVEL: f32 = 1.0 / 255.0;
    let Contribution { feather, light, local, border_footprint, weighting } = contribution;
    let (gain, varies) = (light.gain, light.varies());
    let linearize = light.linearize.as_ref();
    let length = sums.len();
    let (columns, rows) = (&positions.column[..length], &positions.row[..length]);
    let (fractions_x, fractions_y) = (&positions.fraction_x[..length], &positions.fraction_y[..length]);
    let (samples, local) = (&samples[..length], local.map(|factors| &factors[..length]));
    for index in 0..length {
        let (column, row) = (columns[index], rows[index]);
        let (fraction_x, fraction_y) = (fractions_x[index], fractions_y[index]);
        let [r, g, b, opacity] = samples[index];
        let mut share = (opacity * PER_LEVEL).clamp(0.0, 1.0);
        if let Some(footprint) = border_footprint {
            let position = [column as f32 + 0.5 + fraction_x, row as f32 + 0.5 + fraction_y];
            share *= feather.coverage(position, footprint);
        }
        let inside = match weighting {
            Weighting::Equal => 1.0,
            Weighting::Feathered => feather.at(column, row, fraction_x, fraction_y),
        };
        let weight = weight(share, inside);
        let lift = if varies { light.at(column as f32 + 0.5 + fraction_x, row as f32 + 0.5 + fraction_y) } else { 1.0 };
        let lift = lift * local.map_or(1.0, |factors| factors[index]);
        let light = |level: f32, gain: f32| exposed(linearize.linear(level), gain * lift);
        let (r, g, b) = (light(r, gain[0]), light(g, gain[1]), light(b, gain[2]));
        let sum = &mut sums[index];
        *sum = [sum[0] + r * weight, sum[1] + g * weight, sum[2] + b * weight, sum[3] + weight];
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

/// Turns `samples` (red, green, blue, alpha from 0 to 255) in place into square roots of corrected linear light and the
/// share of the canvas pixel that is covered, 0 to 1.
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
    const PER_LEVEL: f32 = 1.0 / 255.0;
    let Development { feather, light, local, border_footprint } = development;
    let (gain, varies) = (light.gain, light.varies());
    let linearize = light.linearize.as_ref();
    let length = samples.len();
    let (columns, rows) = (&positions.column[..length], &positions.row[..length]);
    let (fractions_x, fractions_y) = (&positions.fraction_x[..length], &positions.fraction_y[..length]);
    let local = local.map(|factors| &factors[..length]);
    for (index, sample) in samples.iter_mut().enumerate() {
        let position =
            [columns[index] as f32 + 0.5 + fractions_x[index], rows[index] as f32 + 0.5 + fractions_y[index]];
        let [r, g, b, opacity] = *sample;
        let mut share = (opacity * PER_LEVEL).clamp(0.0, 1.0);
        if let Some(footprint) = border_footprint {
            share *= feather.coverage(position, footprint);
        }
        let lift = if varies { light.at(position[0], position[1]) } else { 1.0 };
        let lift = lift * local.map_or(1.0, |factors| factors[index]);
        let root = |level: f32, gain: f32| exposed(linearize.linear(level), gain * lift).sqrt();
        *sample = [root(r, gain[0]), root(g, gain[1]), root(b, gain[2]), share];
    }
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
