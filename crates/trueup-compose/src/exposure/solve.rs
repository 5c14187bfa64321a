//! The robust least-squares problem over all overlaps: its repetitions, and what comes of them.

use nalgebra::DVector;
use trueup_core::color::TransferCurve;
use trueup_core::{Result, StageContext};

use super::correction::{Correction, Corrections};
use super::equations::Problem;
use super::overlap::Observed;
use super::response::{RESPONSE_TERMS, Response};
use super::robust::LEAST_DEVIATION;
use super::samples::Shared;
use super::{ExposureModel, ExposureOptions, GainAnchor};

/// Repetitions of the weighted solution; the weights of real overlaps stand still after six.
const REPETITIONS: usize = 8;

/// The corrections of as many photographs as `cameras` has entries; with a response beside the curve `profile`, if given.
pub(super) fn solve(
    cameras: &[usize],
    observed: &[Observed],
    (reference, profile): (usize, Option<&TransferCurve>),
    options: &ExposureOptions,
    context: &StageContext,
) -> Result<Corrections> {
    let count = cameras.len();
    let problem = Problem::new(cameras, observed, options);
    let mut weights: Vec<Vec<f64>> = observed.iter().map(|one| vec![1.0; one.samples.len()]).collect();
    problem.weigh_by_medians(&mut weights);
    let mut solution = Solution::new(&problem);
    for repetition in 0..REPETITIONS {
        context.check_cancelled()?;
        if repetition > 0 {
            if let Some(profile) = profile {
                problem.predict(&mut solution, profile)?;
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
    if !corrections.response.is_plain() && corrections.photographs.iter().any(at_limit) {
        return solve(cameras, observed, (reference, None), options, context);
    }
    Ok(corrections)
}

/// What is known of all unknowns.
pub(super) struct Solution {
    /// Logarithms of gains, then coefficients lens by lens.
    pub(super) brightness: DVector<f64>,
    /// What red, green and blue differ from the brightness, as logarithms of gains.
    pub(super) casts: [DVector<f64>; 3],
    pub(super) response: Response,
    /// For each overlap and sample, by how much the functions of the response differ; none are 0.
    pub(super) answers: Vec<Vec<Differences>>,
    /// Slopes of the response's functions against the logarithm of light, over all samples.
    pub(super) slopes: [f64; RESPONSE_TERMS],
}

/// f(first) - f(second) of the response's functions f, by channel.
pub(super) type Differences = [[f32; RESPONSE_TERMS]; 3];

impl Solution {
    fn new(problem: &Problem<'_>) -> Self {
        let samples = problem.observed.iter().map(|one| one.samples.len());
        Self {
            brightness: DVector::zeros(problem.unknowns),
            casts: [(); 3].map(|()| DVector::zeros(problem.count)),
            response: Response::default(),
            answers: samples.map(|count| vec![[[0.0; RESPONSE_TERMS]; 3]; count]).collect(),
            slopes: [0.0; RESPONSE_TERMS],
        }
    }

    /// The samples of an overlap with what the response adds to ln(first / second) of each channel.
    pub(super) fn ratios<'a>(
        &'a self,
        index: usize,
        one: &'a Observed,
    ) -> impl Iterator<Item = (&'a Shared, [f64; 3])> {
        one.samples.iter().zip(&self.answers[index]).map(|(sample, answers)| {
            let ratio = sample.log_ratio();
            let added = |channel: usize| -> f64 {
                let terms = self.response.coefficients.iter().zip(answers[channel]);
                terms.map(|(coefficient, differs)| coefficient * f64::from(differs)).sum()
            };
            (sample, std::array::from_fn(|channel| f64::from(ratio[channel]) + added(channel)))
        })
    }
}

impl Problem<'_> {
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
