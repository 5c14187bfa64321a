//! How far the cameras level highlights off, beside their response.

use rayon::prelude::*;
use trueup_core::color::TransferCurve;

use super::equations::LightEquations;
use super::overlap::Observed;
use super::solution::Solution;
use crate::light::LEAST_WHITE;

/// What is believed of a whole shoulder before anything is seen, in the units of [`Agreement`]: as if two hundred
/// channels of samples that a shoulder would move by 0.03 had shown one, or eight that it would move by 0.16.
/// Logarithms of bright samples err by 0.05, a twentieth of them is independent, and without them a share of 1 is known
/// to 0.5.
const BELIEF_IN_A_WHOLE: f64 = 0.2;

/// By how much a shoulder would move the logarithms of bright samples, and by how much they are moved.
#[derive(Clone, Copy, Default)]
struct Agreement {
    /// Sum of the squares of what a whole shoulder would do.
    would: f64,
    /// Sum of the products with what is there.
    is: f64,
}

impl LightEquations<'_> {
    /// The share of a shoulder that the overlaps show: what the photograph that was exposed longer shows of bright
    /// things is darker than its factor says if its camera levels them off, and just as bright if it clips hard. 1
    /// where nothing bright is shown by two exposures.
    pub(super) fn shoulder(&self, weights: &[Vec<f64>], solution: &Solution, profile: &TransferCurve) -> f64 {
        let overlaps = self.observed.par_iter().zip(weights);
        let agreements: Vec<Agreement> =
            overlaps.map(|(one, weights)| self.agreement(one, weights, solution, profile)).collect();
        let sum = agreements
            .iter()
            .fold(Agreement::default(), |sum, one| Agreement { would: sum.would + one.would, is: sum.is + one.is });
        let share = (sum.is + BELIEF_IN_A_WHOLE) / (sum.would + BELIEF_IN_A_WHOLE);
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 1.0 }
    }

    fn agreement(&self, one: &Observed, weights: &[f64], solution: &Solution, profile: &TransferCurve) -> Agreement {
        let mut samples = Vec::with_capacity(3 * one.samples.len());
        for (sample, &weight) in one.samples.iter().zip(weights) {
            for channel in 0..3 {
                let side = |side: usize, photograph: usize| {
                    let light = f64::from(sample.log_light[side][channel]);
                    let light = light + solution.response.log_factor(profile.encoded(light.exp()));
                    (light, self.log_factor(solution, photograph, channel, sample.radius[side]))
                };
                let (first, second) = (side(0, one.pair.first), side(1, one.pair.second));
                let (longer, shorter) = if first.1 < second.1 { (first, second) } else { (second, first) };
                let darkening = (longer.1 - shorter.1).exp().max(f64::from(LEAST_WHITE));
                let spread = 1.0 + (darkening.powi(4) - 1.0) * (4.0 * longer.0).exp().min(1.0);
                samples.push((weight, -0.25 * spread.ln(), shorter.0 + shorter.1 - longer.0 - longer.1));
            }
        }
        // What is the same all over an overlap is a matter of gains.
        let total: f64 = samples.iter().map(|(weight, ..)| weight).sum();
        let mean = |of: fn(&(f64, f64, f64)) -> f64| samples.iter().map(|one| one.0 * of(one)).sum::<f64>() / total;
        let [would, is] = [mean(|one| one.1), mean(|one| one.2)];
        samples.iter().fold(Agreement::default(), |sum, one| Agreement {
            would: sum.would + one.0 * (one.1 - would).powi(2),
            is: sum.is + one.0 * (one.1 - would) * (one.2 - is),
        })
    }
}
