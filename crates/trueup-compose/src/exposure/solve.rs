//! The robust least-squares problem over all overlaps.
//!
//! Brightness, vignetting and response first: unknowns x_k (ln gain of photograph k), a_c (coefficients of camera c) and b
//! (of the response), one equation per sample, `x_i - x_j + a (p(r_i) - p(r_j)) + b (f(e_i) - f(e_j)) = -ln(I_i / I_j)`,
//! repeated with weights from the residuals. The colour cast follows with the same weights: the same equations for what
//! each channel differs from the mean.

use nalgebra::{DMatrix, DVector};
use trueup_core::colour::TransferCurve;
use trueup_core::{Result, StageContext};

use super::correction::{Correction, Corrections, VIGNETTING_TERMS};
use super::response::{RESPONSE_TERMS, Response};
use super::robust::{LEAST_DEVIATION, magnitude, mean, weights_of};
use super::samples::Shared;
use super::{ExposureModel, ExposureOptions, GainAnchor, PairExposure};

/// An overlap and its samples.
pub(super) struct Observed {
    pub(super) pair: PairExposure,
    /// Medians of the samples' logarithms, by channel.
    pub(super) channel_medians: [f32; 3],
    pub(super) samples: Vec<Shared>,
    /// How much each sample counts by its noise alone, 1 on average.
    certainties: Vec<f64>,
}

impl Observed {
    /// `deviation` is the uncertainty that samples have beside their noise.
    pub(super) fn new(pair: PairExposure, channel_medians: [f32; 3], samples: Vec<Shared>, deviation: f64) -> Self {
        let variance =
            |sample: &Shared| deviation.powi(2) + sample.variances.iter().copied().map(f64::from).sum::<f64>();
        let mut certainties: Vec<f64> = samples.iter().map(|sample| variance(sample).recip()).collect();
        let mean = certainties.iter().sum::<f64>() / certainties.len().max(1) as f64;
        certainties.iter_mut().for_each(|certainty| *certainty /= mean);
        Self { pair, channel_medians, samples, certainties }
    }
}

/// Repetitions of the weighted solution; the weights of real overlaps stand still after six.
const REPETITIONS: usize = 8;

/// Neighbouring samples see the same things; an overlap is worth about this share of its samples.
const INDEPENDENT: f64 = 0.01;

/// By how much the mean slope of the response may differ from the profile's, both on logarithms: none, but for rounding.
const POWER_DEVIATION: f64 = 1e-3;

/// The corrections of as many photographs as `cameras` has entries; with a response beside the curve `profile`, if given.
pub(super) fn solve(
    cameras: &[usize],
    observed: &[Observed],
    (reference, profile): (usize, Option<&TransferCurve>),
    options: &ExposureOptions,
    context: &StageContext,
) -> Result<Corrections> {
    let count = cameras.len();
    let terms = match options.model {
        ExposureModel::Gain => 0,
        ExposureModel::Full => VIGNETTING_TERMS,
    };
    let mut lenses: Vec<usize> = cameras.to_vec();
    lenses.sort_unstable();
    lenses.dedup();
    let lens_of: Vec<usize> = cameras.iter().map(|camera| lenses.binary_search(camera).unwrap_or_default()).collect();
    let problem = Problem { count, terms, unknowns: count + terms * lenses.len(), lens_of, observed, options };
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

pub(super) struct Problem<'a> {
    pub(super) count: usize,
    /// Coefficients per lens.
    terms: usize,
    /// Photographs, then coefficients lens by lens.
    unknowns: usize,
    lens_of: Vec<usize>,
    pub(super) observed: &'a [Observed],
    options: &'a ExposureOptions,
}

/// The powers r^2, r^4, r^6 of a squared radius.
fn powers(r2: f32) -> [f64; VIGNETTING_TERMS] {
    let r2 = f64::from(r2);
    [r2, r2 * r2, r2 * r2 * r2]
}

impl Problem<'_> {
    /// The row of one sample: unknowns and their factors.
    fn row(&self, pair: &PairExposure, sample: &Shared, row: &mut Vec<(usize, f64)>) {
        row.clear();
        row.push((pair.first, 1.0));
        row.push((pair.second, -1.0));
        let (first, second) = (self.lens_of[pair.first], self.lens_of[pair.second]);
        let (a, b) = (powers(sample.radius[0]), powers(sample.radius[1]));
        for term in 0..self.terms {
            let at = |lens: usize| self.count + lens * self.terms + term;
            if first == second {
                row.push((at(first), a[term] - b[term]));
            } else {
                row.push((at(first), a[term]));
                row.push((at(second), -b[term]));
            }
        }
    }

    /// ln of the factor on a channel of `photograph` at the squared radius `r2`.
    pub(super) fn log_factor(&self, solution: &Solution, photograph: usize, channel: usize, r2: f32) -> f64 {
        let lens = self.count + self.lens_of[photograph] * self.terms;
        let vignetting = powers(r2).into_iter().take(self.terms).zip(lens..);
        let lift: f64 = vignetting.map(|(power, at)| power * solution.brightness[at]).sum();
        solution.brightness[photograph] + solution.casts[channel][photograph] + lift
    }

    /// Weight of one sample of an overlap before residuals are known.
    pub(super) fn share(&self, one: &Observed) -> f64 {
        let from_samples = one.pair.deviation.powi(2) / (INDEPENDENT * one.pair.samples as f64);
        1.0 / (self.options.pair_deviation.powi(2) + from_samples) / one.samples.len() as f64
    }

    fn weigh_by_medians(&self, weights: &mut [Vec<f64>]) {
        for (one, weights) in self.observed.iter().zip(weights) {
            for (sample, weight) in one.samples.iter().zip(weights.iter_mut()) {
                let ratio = sample.log_ratio();
                *weight =
                    magnitude(std::array::from_fn(|channel| f64::from(ratio[channel] - one.channel_medians[channel])));
            }
            weights_of(weights, &one.certainties);
        }
    }

    fn weigh(&self, solution: &Solution, weights: &mut [Vec<f64>]) {
        let mut row = Vec::new();
        for (index, (one, weights)) in self.observed.iter().zip(weights).enumerate() {
            for ((sample, ratio), weight) in solution.ratios(index, one).zip(weights.iter_mut()) {
                self.row(&one.pair, sample, &mut row);
                let model = row.iter().fold(0.0, |sum, &(at, factor)| sum + factor * solution.brightness[at]);
                // Without casts, what the channels differ from their mean is not looked at.
                let residuals = std::array::from_fn(|channel| match self.options.model {
                    ExposureModel::Gain => mean(ratio) + model,
                    ExposureModel::Full => {
                        let casts = &solution.casts[channel];
                        ratio[channel] + model + casts[one.pair.first] - casts[one.pair.second]
                    }
                });
                *weight = magnitude(residuals);
            }
            weights_of(weights, &one.certainties);
        }
    }

    /// Solves for gains and vignetting, the response being what it is; `None` if that cannot be.
    fn brightness(&self, weights: &[Vec<f64>], solution: &mut Solution) -> Option<()> {
        let found = self.least_squares(weights, solution, 0)?;
        solution.brightness = found;
        Some(())
    }

    /// Solves for the response, too, as far as it rises.
    fn with_response(&self, weights: &[Vec<f64>], solution: &mut Solution, profile: &TransferCurve) -> Option<()> {
        solution.response = Response::default();
        let found = self.least_squares(weights, solution, RESPONSE_TERMS)?;
        let coefficients = std::array::from_fn(|term| found[self.unknowns + term]);
        solution.response = Response { coefficients }.rising(profile);
        if solution.response.coefficients == coefficients {
            solution.brightness = found.rows(0, self.unknowns).into_owned();
            return Some(());
        }
        self.brightness(weights, solution)
    }

    /// The unknowns, with so many functions of the response beside what the solution has of it.
    fn least_squares(&self, weights: &[Vec<f64>], solution: &Solution, response_terms: usize) -> Option<DVector<f64>> {
        let unknowns = self.unknowns + response_terms;
        let mut normal = DMatrix::<f64>::zeros(unknowns, unknowns);
        let mut right = DVector::<f64>::zeros(unknowns);
        let mut row = Vec::new();
        for (index, (one, weights)) in self.observed.iter().zip(weights).enumerate() {
            let share = self.share(one);
            let answers = &solution.answers[index];
            for (((sample, ratio), weight), answers) in solution.ratios(index, one).zip(weights).zip(answers) {
                self.row(&one.pair, sample, &mut row);
                let differs = |term: usize| mean(std::array::from_fn(|channel| f64::from(answers[channel][term])));
                row.extend((0..response_terms).map(|term| (self.unknowns + term, differs(term))));
                let weight = weight * share;
                for &(i, a) in &row {
                    right[i] -= weight * a * mean(ratio);
                    for &(j, b) in &row {
                        normal[(i, j)] += weight * a * b;
                    }
                }
            }
        }
        for index in 0..unknowns {
            let deviation = match index {
                _ if index < self.count => self.options.gain_deviation,
                _ if index < self.unknowns => self.options.vignetting_deviation,
                _ => self.options.response_deviation,
            };
            normal[(index, index)] += deviation.powi(-2);
        }
        // A power of the light cannot be told from other exposures: none is taken.
        for (i, a) in solution.slopes.iter().take(response_terms).enumerate() {
            for (j, b) in solution.slopes.iter().take(response_terms).enumerate() {
                normal[(self.unknowns + i, self.unknowns + j)] += a * b * POWER_DEVIATION.powi(-2);
            }
        }
        Some(normal.cholesky()?.solve(&right))
    }

    /// What red, green and blue differ from the brightness, as logarithms of gains.
    fn casts(&self, weights: &[Vec<f64>], solution: &Solution) -> [DVector<f64>; 3] {
        let mut normal = DMatrix::<f64>::zeros(self.count, self.count);
        let mut right = [(); 3].map(|()| DVector::<f64>::zeros(self.count));
        for (index, (one, weights)) in self.observed.iter().zip(weights).enumerate() {
            let (i, j) = (one.pair.first, one.pair.second);
            let share = self.share(one);
            for ((_, ratio), weight) in solution.ratios(index, one).zip(weights) {
                let weight = weight * share;
                for (row, column, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
                    normal[(row, column)] += sign * weight;
                }
                for (right, channel) in right.iter_mut().zip(ratio) {
                    let differs = channel - mean(ratio);
                    right[i] -= weight * differs;
                    right[j] += weight * differs;
                }
            }
        }
        for index in 0..self.count {
            normal[(index, index)] += self.options.cast_deviation.powi(-2);
        }
        match normal.cholesky() {
            Some(solver) => right.map(|right| solver.solve(&right)),
            None => [(); 3].map(|()| DVector::zeros(self.count)),
        }
    }

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
