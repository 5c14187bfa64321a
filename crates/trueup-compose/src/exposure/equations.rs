//! The equations that the overlaps are.
//!
//! Brightness, vignetting and response first: unknowns x_k (ln gain of photograph k), a_c (coefficients of camera c)
//! and b (of the response), one equation per sample,
//! `x_i - x_j + a (p(r_i) - p(r_j)) + b (f(e_i) - f(e_j)) = -ln(I_i / I_j)`, with weights from the residuals. The color
//! cast follows with the same weights: the same equations for what each channel differs from the mean.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use trueup_core::color::TransferCurve;

use super::measured::PairExposure;
use super::options::{ExposureModel, ExposureOptions};
use super::overlap::{Observed, PAIR_DEVIATION};
use super::robust::{magnitude, mean, weights_of};
use super::samples::Shared;
use super::solution::Solution;
use crate::light::{RESPONSE_TERMS, Response, VIGNETTING_TERMS};

/// How far gains are expected to lie from 1, as a standard deviation of their natural logarithm. Lower keeps long rows
/// of photographs from drifting in brightness, higher follows the measured ratios.
const GAIN_DEVIATION: f64 = 2.0;

/// How far a channel's gain is expected to lie from the mean of the channels, as a standard deviation of natural
/// logarithms. Lower keeps long rows of photographs from drifting in color.
const CAST_DEVIATION: f64 = 0.2;

/// How strong vignetting is expected to be, as a standard deviation of every coefficient of its natural logarithm.
/// Lower trusts that the lenses are good, higher follows the overlaps.
const VIGNETTING_DEVIATION: f64 = 0.6;

/// How far the response is expected to lie from the color profile's curve, as a standard deviation of every coefficient
/// of its natural logarithm.
const RESPONSE_DEVIATION: f64 = 0.5;

/// Neighboring samples see the same things; an overlap is worth about this share of its samples.
const INDEPENDENT: f64 = 0.01;

/// By how much the mean slope of the response may differ from the profile's, both on logarithms: none, but for
/// rounding.
const POWER_DEVIATION: f64 = 1e-3;

/// All overlaps, and what is unknown.
pub(super) struct LightEquations<'a> {
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

impl<'a> LightEquations<'a> {
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

/// Most unknowns of a sample: two gains, the lenses of two cameras, the response.
const MOST: usize = 2 + 2 * VIGNETTING_TERMS + RESPONSE_TERMS;

/// What one overlap adds to the normal equations.
struct Share {
    /// Which unknowns its samples have.
    unknowns: Vec<usize>,
    normal: [[f64; MOST]; MOST],
    right: [f64; MOST],
}

impl LightEquations<'_> {
    /// Which unknowns the samples of an overlap have; [`Self::row`] tells their factors.
    fn unknowns_of(&self, pair: &PairExposure) -> Vec<usize> {
        let mut lenses = vec![self.lens_of[pair.first], self.lens_of[pair.second]];
        lenses.dedup();
        let coefficients = lenses.iter().flat_map(|lens| (0..self.terms).map(move |term| (lens, term)));
        let coefficients = coefficients.map(|(lens, term)| self.count + lens * self.terms + term);
        [pair.first, pair.second].into_iter().chain(coefficients).collect()
    }

    /// The factors of one sample's unknowns; the rest are 0.
    fn row(&self, pair: &PairExposure, sample: &Shared) -> [f64; MOST] {
        let mut row = [0.0; MOST];
        (row[0], row[1]) = (1.0, -1.0);
        let [own, others] = sample.radius.map(powers);
        let second = if self.lens_of[pair.first] == self.lens_of[pair.second] { 2 } else { 2 + self.terms };
        for (term, (own, others)) in own.into_iter().zip(others).take(self.terms).enumerate() {
            row[2 + term] += own;
            row[second + term] -= others;
        }
        row
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
        1.0 / (PAIR_DEVIATION.powi(2) + from_samples) / one.samples.len() as f64
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
        self.observed.par_iter().zip(weights).enumerate().for_each(|(index, (one, weights))| {
            let unknowns = self.unknowns_of(&one.pair);
            for ((sample, ratio), weight) in solution.ratios(index, one).zip(weights.iter_mut()) {
                let row = self.row(&one.pair, sample);
                let model =
                    unknowns.iter().zip(row).fold(0.0, |sum, (&at, factor)| sum + factor * solution.brightness[at]);
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
        });
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
        let shares = (0..self.observed.len()).into_par_iter();
        let shares: Vec<Share> =
            shares.map(|index| self.share_of(index, &weights[index], solution, response_terms)).collect();
        // One after the other, so that the sums are the same for any number of threads.
        for share in shares {
            for (&i, (right_of, row)) in share.unknowns.iter().zip(share.right.iter().zip(&share.normal)) {
                right[i] += right_of;
                for (&j, value) in share.unknowns.iter().zip(row) {
                    normal[(i, j)] += value;
                }
            }
        }
        for index in 0..unknowns {
            let deviation = match index {
                _ if index < self.count => GAIN_DEVIATION,
                _ if index < self.unknowns => VIGNETTING_DEVIATION,
                _ => RESPONSE_DEVIATION,
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

    /// What an overlap adds to the normal equations.
    fn share_of(&self, index: usize, weights: &[f64], solution: &Solution, response_terms: usize) -> Share {
        let one = &self.observed[index];
        let mut unknowns = self.unknowns_of(&one.pair);
        let own = unknowns.len();
        unknowns.extend((0..response_terms).map(|term| self.unknowns + term));
        let mut share = Share { unknowns, normal: [[0.0; MOST]; MOST], right: [0.0; MOST] };
        let trust = self.share(one);
        let samples = solution.ratios(index, one).zip(weights).zip(&solution.answers[index]);
        for (((sample, ratio), weight), answers) in samples {
            let mut row = self.row(&one.pair, sample);
            for (term, factor) in row[own..].iter_mut().take(response_terms).enumerate() {
                *factor = mean(std::array::from_fn(|channel| f64::from(answers[channel][term])));
            }
            let (weight, ratio) = (weight * trust, mean(ratio));
            for (a, (right, sums)) in row.into_iter().zip(share.right.iter_mut().zip(&mut share.normal)) {
                *right -= weight * a * ratio;
                for (sum, b) in sums.iter_mut().zip(row) {
                    *sum += weight * a * b;
                }
            }
        }
        share
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
            normal[(index, index)] += CAST_DEVIATION.powi(-2);
        }
        match normal.cholesky() {
            Some(solver) => right.map(|right| solver.solve(&right)),
            None => [(); 3].map(|()| DVector::zeros(self.count)),
        }
    }
}
