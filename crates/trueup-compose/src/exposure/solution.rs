//! What is known of the photographs' light.

use nalgebra::DVector;

use super::overlap::Observed;
use super::samples::Shared;
use crate::light::{RESPONSE_TERMS, Response};

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
    /// Nothing but zeros for so many photographs, `count`, of all `unknowns`.
    pub(super) fn new(unknowns: usize, count: usize, observed: &[Observed]) -> Self {
        let samples = observed.iter().map(|one| one.samples.len());
        Self {
            brightness: DVector::zeros(unknowns),
            casts: [(); 3].map(|()| DVector::zeros(count)),
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
