//! Weights by residuals.

use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median};

/// Residual, in standard deviations of the overlap, at which a sample counts half. Tuning constant of the Cauchy
/// estimator for 95 % efficiency (Holland, Welsch, "Robust regression using iteratively reweighted least-squares",
/// 1977).
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
    let Some(median) = median(&mut residuals.to_vec()) else { return };
    let scale = CAUCHY * (SD_PER_MEDIAN_MAGNITUDE * median).max(LEAST_DEVIATION);
    for (residual, certainty) in residuals.iter_mut().zip(certainties) {
        *residual = certainty / (1.0 + (*residual / scale).powi(2));
    }
}
