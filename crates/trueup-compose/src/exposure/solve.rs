//! The robust least-squares problem over all overlaps.
//!
//! Brightness and vignetting first: unknowns x_k (ln gain of photograph k) and a_c (coefficients of camera c), one equation
//! per sample, `x_i - x_j + a (p(r_i) - p(r_j)) = -ln(I_i / I_j)`, repeated with weights from the residuals. The colour cast
//! follows with the same weights: the same equations for what each channel differs from the mean.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use trueup_core::{Result, StageContext};

use super::correction::{Correction, VIGNETTING_TERMS};
use super::samples::Shared;
use super::{ExposureModel, ExposureOptions, GainAnchor, NORMAL, PairExposure};

/// An overlap and its samples.
pub(super) struct Observed {
    pub(super) pair: PairExposure,
    /// Medians of the samples' logarithms, by channel.
    pub(super) channel_medians: [f32; 3],
    pub(super) samples: Vec<Shared>,
}

/// Repetitions of the weighted solution; the weights of real overlaps stand still after six.
const REPETITIONS: usize = 8;

/// Residual, in standard deviations of the overlap, at which a sample counts half. Tuning constant of the Cauchy
/// estimator for 95 % efficiency (Holland, Welsch, "Robust regression using iteratively reweighted least-squares", 1977).
const CAUCHY: f64 = 2.385;

/// Smallest standard deviation of a sample's logarithm: half a level of 8 bits at middle gray.
const LEAST_DEVIATION: f64 = 0.01;

/// Neighbouring samples see the same things; an overlap is worth about this share of its samples.
const INDEPENDENT: f64 = 0.01;

/// The corrections of as many photographs as `cameras` has entries.
pub(super) fn solve(
    cameras: &[usize],
    observed: &[Observed],
    reference: usize,
    options: &ExposureOptions,
    context: &StageContext,
) -> Result<Vec<Correction>> {
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
    let mut brightness = DVector::zeros(problem.unknowns);
    let mut casts = [(); 3].map(|()| DVector::zeros(count));
    for repetition in 0..REPETITIONS {
        context.check_cancelled()?;
        if repetition > 0 {
            problem.weigh(&brightness, &casts, &mut weights);
        } else {
            problem.weigh_by_medians(&mut weights);
        }
        let Some((solver, right)) = problem.brightness_equations(&weights) else {
            return Ok(vec![Correction::default(); count]);
        };
        brightness = solver.solve(&right);
        if options.model == ExposureModel::Full {
            casts = problem.casts(&weights);
        }
    }
    Ok(problem.corrections(&brightness, &casts, reference))
}

struct Problem<'a> {
    count: usize,
    /// Coefficients per lens.
    terms: usize,
    /// Photographs, then coefficients lens by lens.
    unknowns: usize,
    lens_of: Vec<usize>,
    observed: &'a [Observed],
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

    /// Weight of one sample of an overlap before residuals are known.
    fn share(&self, one: &Observed) -> f64 {
        let from_samples = one.pair.deviation.powi(2) / (INDEPENDENT * one.pair.samples as f64);
        1.0 / (self.options.pair_deviation.powi(2) + from_samples) / one.samples.len() as f64
    }

    fn weigh_by_medians(&self, weights: &mut [Vec<f64>]) {
        for (one, weights) in self.observed.iter().zip(weights) {
            for (sample, weight) in one.samples.iter().zip(weights.iter_mut()) {
                *weight = magnitude(std::array::from_fn(|channel| {
                    f64::from(sample.log_ratio[channel] - one.channel_medians[channel])
                }));
            }
            weights_of(weights);
        }
    }

    fn weigh(&self, solution: &DVector<f64>, casts: &[DVector<f64>; 3], weights: &mut [Vec<f64>]) {
        let mut row = Vec::new();
        for (one, weights) in self.observed.iter().zip(weights) {
            for (sample, weight) in one.samples.iter().zip(weights.iter_mut()) {
                self.row(&one.pair, sample, &mut row);
                let model = row.iter().fold(0.0, |sum, &(at, factor)| sum + factor * solution[at]);
                // Without casts, what the channels differ from their mean is not looked at.
                let residuals = std::array::from_fn(|channel| match self.options.model {
                    ExposureModel::Gain => f64::from(sample.brightness()) + model,
                    ExposureModel::Full => {
                        let cast = casts[channel][one.pair.first] - casts[channel][one.pair.second];
                        f64::from(sample.log_ratio[channel]) + model + cast
                    }
                });
                *weight = magnitude(residuals);
            }
            weights_of(weights);
        }
    }

    fn brightness_equations(&self, weights: &[Vec<f64>]) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
        let mut normal = DMatrix::<f64>::zeros(self.unknowns, self.unknowns);
        let mut right = DVector::<f64>::zeros(self.unknowns);
        let mut row = Vec::new();
        for (one, weights) in self.observed.iter().zip(weights) {
            let share = self.share(one);
            for (sample, weight) in one.samples.iter().zip(weights) {
                self.row(&one.pair, sample, &mut row);
                let weight = weight * share;
                for &(i, a) in &row {
                    right[i] -= weight * a * f64::from(sample.brightness());
                    for &(j, b) in &row {
                        normal[(i, j)] += weight * a * b;
                    }
                }
            }
        }
        for index in 0..self.unknowns {
            let deviation = match index < self.count {
                true => self.options.gain_deviation,
                false => self.options.vignetting_deviation,
            };
            normal[(index, index)] += deviation.powi(-2);
        }
        Some((normal.cholesky()?, right))
    }

    /// What red, green and blue differ from the brightness, as logarithms of gains.
    fn casts(&self, weights: &[Vec<f64>]) -> [DVector<f64>; 3] {
        let mut normal = DMatrix::<f64>::zeros(self.count, self.count);
        let mut right = [(); 3].map(|()| DVector::<f64>::zeros(self.count));
        for (one, weights) in self.observed.iter().zip(weights) {
            let (i, j) = (one.pair.first, one.pair.second);
            let share = self.share(one);
            for (sample, weight) in one.samples.iter().zip(weights) {
                let weight = weight * share;
                for (row, column, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
                    normal[(row, column)] += sign * weight;
                }
                for (right, ratio) in right.iter_mut().zip(sample.log_ratio) {
                    let differs = f64::from(ratio - sample.brightness());
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

    /// Gains relative to the anchor, within the limits, and the vignetting of each photograph's lens.
    fn corrections(&self, brightness: &DVector<f64>, casts: &[DVector<f64>; 3], reference: usize) -> Vec<Correction> {
        let mut compared = vec![false; self.count];
        for one in self.observed {
            compared[one.pair.first] = true;
            compared[one.pair.second] = true;
        }
        let log_gain = |index: usize, channel: usize| brightness[index] + casts[channel][index];
        let taking_part = compared.iter().filter(|&&compared| compared).count().max(1);
        let anchor: [f64; 3] = std::array::from_fn(|channel| match self.options.anchor {
            GainAnchor::Reference => log_gain(reference, channel),
            GainAnchor::Mean => {
                let all = (0..self.count).filter(|&index| compared[index]);
                all.map(|index| log_gain(index, channel)).sum::<f64>() / taking_part as f64
            }
        });
        let largest = self.options.max_gain;
        (0..self.count)
            .map(|index| {
                let lens = self.count + self.lens_of[index] * self.terms;
                let mut correction = Correction::default();
                for term in 0..self.terms {
                    correction.vignetting[term] = brightness[lens + term];
                }
                if compared[index] {
                    correction.gain = std::array::from_fn(|channel| {
                        (log_gain(index, channel) - anchor[channel]).exp().clamp(largest.recip(), largest)
                    });
                }
                correction
            })
            .collect()
    }
}

/// Root mean square of the residuals of the three channels.
fn magnitude(residuals: [f64; 3]) -> f64 {
    (residuals.iter().map(|residual| residual * residual).sum::<f64>() / 3.0).sqrt()
}

/// Turns the residuals of an overlap's samples into weights from 0 to 1, by their own spread.
fn weights_of(residuals: &mut [f64]) {
    let mut sorted = residuals.to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() {
        return;
    }
    let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let scale = CAUCHY * (NORMAL * median).max(LEAST_DEVIATION);
    for residual in residuals {
        *residual = 1.0 / (1.0 + (*residual / scale).powi(2));
    }
}
