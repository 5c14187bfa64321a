//! The equations that the overlaps are.
//!
//! Brightness, vignetting and response first: unknowns x_k (ln gain of photograph k), a_c (coefficients of camera c) and b
//! (of the response), one equation per sample, `x_i - x_j + a (p(r_i) - p(r_j)) + b (f(e_i) - f(e_j)) = -ln(I_i / I_j)`,
//! with weights from the residuals. The colour cast follows with the same weights: the same equations for what each channel
//! differs from the mean.

use nalgebra::{DMatrix, DVector};
use trueup_core::colour::TransferCurve;

use super::correction::VIGNETTING_TERMS;
use super::overlap::Observed;
use super::response::{RESPONSE_TERMS, Response};
use super::robust::{magnitude, mean, weights_of};
use super::samples::Shared;
use super::solve::Solution;
use super::{ExposureModel, ExposureOptions, PairExposure};

/// Neighbouring samples see the same things; an overlap is worth about this share of its samples.
const INDEPENDENT: f64 = 0.01;

/// By how much the mean slope of the response may differ from the profile's, both on logarithms: none, but for rounding.
const POWER_DEVIATION: f64 = 1e-3;

/// All overlaps, and what is unknown.
pub(super) struct Problem<'a> {
    pub(super) count: usize,
    /// Coefficients per lens.
    pub(super) terms: usize,
    /// Photographs, then coefficients lens by lens.
    pub(super) unknowns: usize,
    pub(super) lens_of: Vec<usize>,
    pub(super) observed: &'a [Observed],
    pub(super) options: &'a ExposureOptions,
}

/// The powers r^2, r^4, r^6 of a squared radius.
fn powers(r2: f32) -> [f64; VIGNETTING_TERMS] {
    let r2 = f64::from(r2);
    [r2, r2 * r2, r2 * r2 * r2]
}

impl<'a> Problem<'a> {
    /// For as many photographs as `cameras` has entries.
    pub(super) fn new(cameras: &[usize], observed: &'a [Observed], options: &'a ExposureOptions) -> Self {
        let count = cameras.len();
        let terms = match options.model {
            ExposureModel::Gain => 0,
            ExposureModel::Full => VIGNETTING_TERMS,
        };
        let mut lenses: Vec<usize> = cameras.to_vec();
        lenses.sort_unstable();
        lenses.dedup();
        let lens_of: Vec<usize> =
            cameras.iter().map(|camera| lenses.binary_search(camera).unwrap_or_default()).collect();
        Self { count, terms, unknowns: count + terms * lenses.len(), lens_of, observed, options }
    }
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

    pub(super) fn weigh_by_medians(&self, weights: &mut [Vec<f64>]) {
        for (one, weights) in self.observed.iter().zip(weights) {
            for (sample, weight) in one.samples.iter().zip(weights.iter_mut()) {
                let ratio = sample.log_ratio();
                *weight =
                    magnitude(std::array::from_fn(|channel| f64::from(ratio[channel] - one.channel_medians[channel])));
            }
            weights_of(weights, &one.certainties);
        }
    }

    pub(super) fn weigh(&self, solution: &Solution, weights: &mut [Vec<f64>]) {
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
    pub(super) fn brightness(&self, weights: &[Vec<f64>], solution: &mut Solution) -> Option<()> {
        let found = self.least_squares(weights, solution, 0)?;
        solution.brightness = found;
        Some(())
    }

    /// Solves for the response, too, as far as it rises.
    pub(super) fn with_response(
        &self,
        weights: &[Vec<f64>],
        solution: &mut Solution,
        profile: &TransferCurve,
    ) -> Option<()> {
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
    pub(super) fn casts(&self, weights: &[Vec<f64>], solution: &Solution) -> [DVector<f64>; 3] {
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
}
