//! The light that several exposures of one view record together.
//!
//! An exposure's samples tell the light times its exposure, more surely the steeper its curve is there, and not at all
//! where it is white. At every place the light is the mean of what the exposures tell of it, each weighted by how sure
//! it is. How the exposures stand to each other is measured where they show the same thing, which files need not say
//! and often round. What moved, or is not reached, is told by the others; the reference is always believed, but for
//! what is white in it and as bright in another exposure.
//!
//! # Source
//! Debevec and Malik, "Recovering high dynamic range radiance maps from photographs", SIGGRAPH 1997, equation 6;
//! weights by the variance of each estimate: Mitsunaga and Nayar, "Radiometric self calibration", CVPR 1999, section 5,
//! and Robertson, Borman and Stevenson, "Estimation-theoretic approach to dynamic range enhancement using multiple
//! exposures", Journal of Electronic Imaging 12(2), 2003.
//!
//! # Departures
//! Means are of light, not of its logarithm, whose noise in the dark is lopsided. Weights end smoothly before white,
//! where compression moves samples, for all channels of a pixel together, so that no color is seen of it.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::AlignedPhotograph;
use trueup_core::{Error, Result};

use super::aligned_exposures;
use super::exposure::Exposure;
use crate::transfer_curve::Linearize;

/// Levels, of 255, between which an exposure ends to count towards white.
const FADING: [f32; 2] = [215.0, 248.0];

/// Levels, of 255, from and up to which samples tell how exposures stand to each other: darker ones are mostly noise
/// and rounding, and among brighter ones are those that are clipped in part, by interpolation and compression, and
/// darker than they should be.
const COMPARED: std::ops::RangeInclusive<f32> = 20.0..=180.0;

/// Fewest samples by which two exposures are compared.
const LEAST_COMPARED: usize = 200;

/// Weight of an exposure that tells nothing surely beside one that does: where none does, the darkest of them stands.
const LEAST_WEIGHT: f32 = 1e-6;

/// The light of all exposures; see [`StackFusion::merge`](trueup_core::source::StackFusion::merge).
///
/// # Errors
/// [`Error::Input`] if a member has another size or a homography that is none.
pub fn merge(
    reference: &Photograph,
    others: &[AlignedPhotograph],
    samples: &TransferCurve,
    light: &TransferCurve,
) -> Result<Photograph> {
    let exposures = aligned_exposures(reference, others)?;
    let table = SampleLight::new(samples);
    let factors = relative_exposures(&exposures, &table);
    let members: Vec<Member> = exposures
        .iter()
        .zip(factors)
        .filter_map(|(exposure, factor)| Some(Member { exposure, factor: factor? as f32 }))
        .collect();
    let Some(full) = light.light_range() else {
        let hint = "Merge to a curve of light.";
        return Err(Error::input("stack", "its light is to be kept in samples that end at white", hint));
    };
    let unit = samples.light_range().map_or(1.0, |range| range.peak) / full.peak;
    let encode = |value: f32| (light.encoded(f64::from(value) * unit) * f64::from(u16::MAX)).round() as u16;
    let (width, channels) = (reference.width(), reference.channels());
    let mut merged = opaque_copy(reference);
    merged.data_mut().par_chunks_mut((width * channels).max(1)).enumerate().for_each(|(y, samples)| {
        let row = merged_row(&members, &table, 0..width, y);
        for (pixel, light) in samples.chunks_exact_mut(channels).zip(row) {
            // Colors, and of a gray picture its one channel: alpha stays.
            for (sample, value) in pixel.iter_mut().take(channels.min(3)).zip(light) {
                *sample = encode(value);
            }
        }
    });
    Ok(Photograph::Sixteen(merged))
}

/// A picture of 16 bits with the transparency of a photograph.
fn opaque_copy(photograph: &Photograph) -> Raster<u16> {
    /// Levels of 16 bits for each one of 8.
    const SIXTEEN_BITS: u16 = 257;
    let mut copy = Raster::new(photograph.width(), photograph.height(), photograph.channels());
    if photograph.channels() < 4 {
        return copy;
    }
    let samples = copy.data_mut().iter_mut().skip(3).step_by(4);
    match photograph {
        Photograph::Eight(raster) => {
            let alphas = raster.data().iter().skip(3).step_by(4);
            samples.zip(alphas).for_each(|(sample, &alpha)| *sample = u16::from(alpha) * SIXTEEN_BITS);
        }
        Photograph::Sixteen(raster) => {
            let alphas = raster.data().iter().skip(3).step_by(4);
            samples.zip(alphas).for_each(|(sample, &alpha)| *sample = alpha);
        }
    }
    copy
}

/// What samples on the scale of 0 to 255 tell of light.
struct SampleLight {
    linearize: Arc<Linearize>,
    /// Light by which a sample of each level, or half-way to the next, is off when it is off by one level.
    steps: Vec<f32>,
}

/// Entries of [`SampleLight::steps`] for each level.
const STEPS_PER_LEVEL: usize = 2;

impl SampleLight {
    fn new(curve: &TransferCurve) -> Self {
        let light = |level: f64| curve.linear((level / 255.0).clamp(0.0, 1.0));
        let step = |index: usize| {
            let level = index as f64 / STEPS_PER_LEVEL as f64;
            let (low, high) = ((level - 1.0).max(0.0), (level + 1.0).min(255.0));
            // Where a curve stands still, as little as the next number that is told apart.
            (((light(high) - light(low)) / (high - low)) as f32).max(f32::MIN_POSITIVE)
        };
        Self { linearize: Linearize::of(curve), steps: (0..=255 * STEPS_PER_LEVEL).map(step).collect() }
    }

    fn light(&self, level: f32) -> f32 {
        self.linearize.linear(level)
    }

    fn step(&self, level: f32) -> f32 {
        // The cast saturates.
        let index = (level * STEPS_PER_LEVEL as f32 + 0.5) as usize;
        self.steps[index.min(self.steps.len() - 1)]
    }

    /// How sure it is, 0 to 1, that a pixel of an exposure that takes `factor` times the light of the reference tells
    /// what is white there, and not of something else: in all channels that are next to white in the reference it then
    /// is as bright. What the reference's other channels say there is little, as white moves them in compressed files.
    fn continues(&self, reference: &[f32; 4], own: &[f32; 4], factor: f32) -> f32 {
        /// Parts of the light that white is in the reference, from which on it may be that light, and is.
        const AS_BRIGHT: [f32; 2] = [0.5, 0.8];
        let white_channels = (0..3).filter(|&channel| reference[channel] > FADING[0]);
        let part = |channel: usize| self.light(own[channel]) / factor / self.light(reference[channel]);
        let least = white_channels.map(part).fold(f32::INFINITY, f32::min);
        let [from, to] = AS_BRIGHT;
        let is_as_bright = ((least - from) / (to - from)).clamp(0.0, 1.0);
        (1.0 - sureness(reference)) * is_as_bright
    }

    /// The part of its light by which a sample is off when it is off by one level.
    fn uncertainty(&self, level: f32) -> f64 {
        f64::from(self.step(level)) / f64::from(self.light(level)).max(f64::MIN_POSITIVE)
    }
}

/// How sure it is that a pixel is not white in any channel, 0 to 1.
fn sureness(&[r, g, b, _]: &[f32; 4]) -> f32 {
    let [from, to] = FADING;
    ((to - r.max(g).max(b)) / (to - from)).clamp(0.0, 1.0)
}

/// An exposure, and how much light it takes beside the reference.
struct Member<'a> {
    exposure: &'a Exposure<'a>,
    factor: f32,
}

/// The light at a row of the reference, in its samples' unit.
fn merged_row(members: &[Member], table: &SampleLight, columns: Range<usize>, y: usize) -> Vec<[f32; 3]> {
    let mut sums = vec![[[0.0_f32; 2]; 3]; columns.len()];
    let darkest = members.iter().map(|member| member.factor).fold(f32::INFINITY, f32::min);
    let reference = members[0].exposure.trusted_row(columns.clone(), y);
    for (number, Member { exposure, factor }) in members.iter().enumerate() {
        // In doubt, far more the darker of two exposures.
        let doubtful = LEAST_WEIGHT * (darkest / factor).powi(4);
        let own = match number {
            0 => Cow::Borrowed(&reference),
            _ => Cow::Owned(exposure.trusted_row(columns.clone(), y)),
        };
        for ((sum, (reference, _)), &(sample, trust)) in sums.iter_mut().zip(&reference).zip(own.iter()) {
            let Some(own @ [r, g, b, _]) = sample else { continue };
            let trust = match reference {
                Some(reference) => trust + (1.0 - trust) * table.continues(reference, &own, *factor),
                None => trust,
            };
            if trust <= 0.0 {
                continue;
            }
            let sure = sureness(&own);
            for ([light, weights], level) in sum.iter_mut().zip([r, g, b]) {
                // One over the variance of the light that is told, in the unit of the reference's.
                let certainty = (factor / table.step(level)).powi(2);
                let weight = trust * (sure * certainty + doubtful);
                *light += weight * table.light(level) / factor;
                *weights += weight;
            }
        }
    }
    // The reference reaches everywhere and is trusted.
    sums.into_iter().map(|sum| sum.map(|[light, weights]| light / weights.max(f32::MIN_POSITIVE))).collect()
}

/// How much light each exposure takes beside the first one; `None` for those of which the pixels do not tell.
fn relative_exposures(exposures: &[Exposure], table: &SampleLight) -> Vec<Option<f64>> {
    let count = exposures.len();
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
    let ratios: Vec<([usize; 2], Ratio)> = pairs
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter_map(|[a, b]| Some(([a, b], Ratio::between(&exposures[a], &exposures[b], table)?)))
        .collect();
    // What is joined to the first by ratios.
    let mut is_joined = vec![false; count];
    is_joined[0] = true;
    for _ in 1..count {
        for ([a, b], _) in &ratios {
            let joined = is_joined[*a] || is_joined[*b];
            (is_joined[*a], is_joined[*b]) = (joined, joined);
        }
    }
    // Least squares over logarithms; those that are not joined are held where they are.
    let (mut matrix, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
    for (number, joined) in is_joined.iter().enumerate() {
        matrix[(number, number)] = if number == 0 || !joined { 1.0 } else { 0.0 };
    }
    for ([a, b], Ratio { logarithm, certainty }) in &ratios {
        for (own, other, sign) in [(*a, *b, -1.0), (*b, *a, 1.0)] {
            if own > 0 && is_joined[own] {
                matrix[(own, own)] += certainty;
                if other > 0 {
                    matrix[(own, other)] -= certainty;
                }
                right[own] += sign * certainty * logarithm;
            }
        }
    }
    let Some(solution) = matrix.lu().solve(&right) else {
        return (0..count).map(|number| (number == 0).then_some(1.0)).collect();
    };
    let factor = |(number, joined): (usize, bool)| {
        let factor = solution[number].exp();
        (joined && factor.is_finite() && factor > 0.0).then_some(factor)
    };
    is_joined.into_iter().enumerate().map(factor).collect()
}

/// How much more light one exposure takes than another.
struct Ratio {
    /// Natural logarithm.
    logarithm: f64,
    /// One over its variance, as far as noise tells.
    certainty: f64,
}

impl Ratio {
    /// The second over the first: the weighted median over all that both show. Which places are dark enough to be left
    /// out is judged by the brighter exposure, whose noise there is little: judged by its own, those where the darker
    /// one is brighter by noise would stay.
    fn between(first: &Exposure, second: &Exposure, table: &SampleLight) -> Option<Self> {
        let both: Vec<[f32; 2]> = first
            .compared()
            .zip(second.compared())
            .filter_map(|(own, other)| Some((own?, other?)))
            .flat_map(|(own, other)| (0..3).map(move |channel| [own[channel], other[channel]]))
            .filter(|pair| pair.iter().all(|level| *level > 0.0 && level <= COMPARED.end()))
            .collect();
        let of_own = Self::of_samples(both.iter().filter(|pair| pair.iter().all(|one| COMPARED.contains(one))), table)?;
        let brighter = usize::from(of_own.logarithm > 0.0);
        let least = table.light(*COMPARED.start()) * of_own.logarithm.abs().exp() as f32;
        Self::of_samples(both.iter().filter(|pair| table.light(pair[brighter]) >= least), table)
    }

    /// The weighted median of samples of both exposures.
    fn of_samples<'s>(samples: impl Iterator<Item = &'s [f32; 2]>, table: &SampleLight) -> Option<Self> {
        let ratio = |&[own, other]: &[f32; 2]| {
            let variance = table.uncertainty(own).powi(2) + table.uncertainty(other).powi(2);
            ((f64::from(table.light(other)) / f64::from(table.light(own))).ln(), variance.recip())
        };
        let mut ratios: Vec<(f64, f64)> = samples.map(ratio).filter(|(ratio, _)| ratio.is_finite()).collect();
        if ratios.len() < LEAST_COMPARED {
            return None;
        }
        ratios.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1)));
        let certainty: f64 = ratios.iter().map(|(_, weight)| weight).sum();
        let mut below = 0.0;
        let middle = ratios.iter().find(|(_, weight)| {
            below += weight;
            below >= 0.5 * certainty
        });
        middle.map(|&(logarithm, _)| Self { logarithm, certainty })
    }
}
