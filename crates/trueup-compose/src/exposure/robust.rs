//! Weights by residuals.

use super::overlap::NORMAL;

/// Residual, in standard deviations of the overlap, at which a sample counts half. Tuning constant of the Cauchy
/// estimator for 95 % efficiency (Holland, Welsch, "Robust regression using iteratively reweighted least-squares", 1977).
const CAUCHY: f64 = 2.385;

/// Smallest standard deviation of a sample's logarithm: half a level of 8 bits at middle gray.
pub(super) const LEAST_DEVIATION: f64 = 0.01;

/// The mean of the three channels.
pub(super) fn mean(channels: [f64; 3]) -> f64 {
    channels.iter().sum::<f64>() / 3.0
}

/// Root mean square of the residuals of the three channels.
pub(super) fn magnitude(residuals: [f64; 3]) -> f64 {
    mean(residuals.map(|residual| residual * residual)).sqrt()
}

/// Turns the residuals of an overlap's samples into weights, at most their certainties, by their own spread.
pub(super) fn weights_of(residuals: &mut [f64], certainties: &[f64]) {
    for (residual, certainty) in residuals.iter_mut().zip(certainties) {
        *residual *= certainty.sqrt();
    }
    let mut sorted = residuals.to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() {
        return;
    }
    let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let scale = CAUCHY * (NORMAL * median).max(LEAST_DEVIATION);
    for (residual, certainty) in residuals.iter_mut().zip(certainties) {
        *residual = certainty / (1.0 + (*residual / scale).powi(2));
    }
}
