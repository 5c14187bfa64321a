//! The robust least-squares problem over all overlaps: its repetitions, and what comes of them.

use trueup_core::color::TransferCurve;
use trueup_core::{Result, StageContext};

use super::equations::LightEquations;
use super::options::{ExposureModel, ExposureOptions, GainAnchor};
use super::overlap::Observed;
use super::robust::LEAST_DEVIATION;
use super::solution::Solution;
use crate::light::{Correction, Corrections, Response};

/// Repetitions of the weighted solution; the weights of real overlaps stand still after six.
const REPETITIONS: usize = 8;

/// What the overlaps say, and of whom.
#[derive(Clone, Copy)]
pub(super) struct SolveInput<'a> {
    /// The camera of each photograph.
    pub(super) cameras: &'a [usize],
    pub(super) observed: &'a [Observed],
    /// Position of the reference.
    pub(super) reference: usize,
    /// The curve beside which a response is estimated; `None` for none.
    pub(super) profile: Option<&'a TransferCurve>,
}

/// The corrections of all photographs.
pub(super) fn solve(input: &SolveInput<'_>, options: &ExposureOptions, context: &StageContext) -> Result<Corrections> {
    let &SolveInput { cameras, observed, reference, profile } = input;
    let count = cameras.len();
    let problem = LightEquations::new(cameras, observed, options);
    let mut weights: Vec<Vec<f64>> = observed.iter().map(|one| vec![1.0; one.samples.len()]).collect();
    problem.weigh_by_medians(&mut weights);
    let mut solution = Solution::new(problem.unknowns, count, observed);
    for repetition in 0..REPETITIONS {
        context.check_cancelled()?;
        if repetition > 0 {
            if let Some(profile) = profile
                && problem.predict(&mut solution, profile).is_err()
            {
                return without_response(input, options, context);
            }
            problem.weigh(&solution, &mut weights);
        }
        let found = match profile {
            // Where the exposures differ is only known from the first solution.
            Some(profile) if repetition > 0 => problem.with_response(&weights, &mut solution, profile),
            _ => problem.brightness(&weights, &mut solution),
        };
        if found.is_none() {
            return Ok(Corrections::plain(count));
        }
        if options.model == ExposureModel::Full {
            solution.casts = problem.casts(&weights, &solution);
        }
    }
    if !solution.response.is_plain() && problem.effect(&weights, &solution) < LEAST_DEVIATION {
        solution.response = Response::default();
        if problem.brightness(&weights, &mut solution).is_none() {
            return Ok(Corrections::plain(count));
        }
        solution.casts = problem.casts(&weights, &solution);
    }
    let corrections = problem.corrections(&solution, reference);
    // Gains grow with a response that stretches the light. At their limit photographs do not fit any longer, which is worse
    // than what a response is good for.
    let limits = [options.max_gain, options.max_gain.recip()];
    let at_limit = |correction: &Correction| correction.gain.iter().any(|gain| limits.contains(gain));
    let makes_curve = profile.is_none_or(|profile| corrections.response.curve(profile).is_ok());
    if !makes_curve || (!corrections.response.is_plain() && corrections.photographs.iter().any(at_limit)) {
        return without_response(input, options, context);
    }
    Ok(corrections)
}

/// The same with the profile's curve as it is: what falls back on where a response that was found is of no use.
fn without_response(
    input: &SolveInput<'_>,
    options: &ExposureOptions,
    context: &StageContext<'_>,
) -> Result<Corrections> {
    solve(&SolveInput { profile: None, ..*input }, options, context)
}

impl LightEquations<'_> {
    /// Gains relative to the anchor, within the limits, the vignetting of each photograph's lens, and the response.
    fn corrections(&self, solution: &Solution, reference: usize) -> Corrections {
        let mut compared = vec![false; self.count];
        for one in self.observed {
            compared[one.pair.first] = true;
            compared[one.pair.second] = true;
        }
        let log_gain = |index: usize, channel: usize| solution.brightness[index] + solution.casts[channel][index];
        let taking_part = compared.iter().filter(|&&compared| compared).count().max(1);
        let anchor: [f64; 3] = std::array::from_fn(|channel| match self.options.anchor {
            GainAnchor::Reference => log_gain(reference, channel),
            GainAnchor::Mean => {
                let all = (0..self.count).filter(|&index| compared[index]);
                all.map(|index| log_gain(index, channel)).sum::<f64>() / taking_part as f64
            }
        });
        let largest = self.options.max_gain;
        let correction = |index: usize| {
            let lens = self.count + self.lens_of[index] * self.terms;
            let mut correction = Correction::default();
            for term in 0..self.terms {
                correction.vignetting[term] = solution.brightness[lens + term];
            }
            if compared[index] {
                correction.gain = std::array::from_fn(|channel| {
                    (log_gain(index, channel) - anchor[channel]).exp().clamp(largest.recip(), largest)
                });
            }
            correction
        };
        Corrections { response: solution.response, photographs: (0..self.count).map(correction).collect() }
    }
}
