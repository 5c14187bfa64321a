//! What two photographs that overlap say of each other.

use trueup_core::color::TransferCurve;
use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median, median_of};

use super::measured::PairExposure;
use super::samples::Shared;

/// Fewest samples two photographs must share to be compared.
const MIN_SHARED: usize = 20;

/// Uncertainty of a pair's measured ratio, from vignetting and misalignment, as a standard deviation of its natural
/// logarithm; the spread of the samples adds to it.
pub(super) const PAIR_DEVIATION: f64 = 0.02;

/// An overlap and its samples.
pub(super) struct Observed {
    pub(super) pair: PairExposure,
    /// Medians of the samples' logarithms, by channel.
    pub(super) channel_medians: [f32; 3],
    pub(super) samples: Vec<Shared>,
    /// How much each sample counts by its noise alone, 1 on average.
    pub(super) certainties: Vec<f64>,
}

impl Observed {
    fn new(pair: PairExposure, channel_medians: [f32; 3], samples: Vec<Shared>) -> Self {
        // The uncertainty that samples have beside their noise, and that.
        let variance =
            |sample: &Shared| PAIR_DEVIATION.powi(2) + sample.variances.iter().copied().map(f64::from).sum::<f64>();
        let mut certainties: Vec<f64> = samples.iter().map(|sample| variance(sample).recip()).collect();
        let mean = certainties.iter().sum::<f64>() / certainties.len().max(1) as f64;
        certainties.iter_mut().for_each(|certainty| *certainty /= mean);
        Self { pair, channel_medians, samples, certainties }
    }
}

/// Compares two photographs by what they share; `None` if that is too little.
pub(super) fn compare(samples: &[Shared], [first, second]: [usize; 2], curve: &TransferCurve) -> Option<Observed> {
    if samples.len() < MIN_SHARED {
        return None;
    }
    let channel_medians = std::array::from_fn(|channel| {
        median_of(samples.iter().map(|sample| sample.log_ratio()[channel])).unwrap_or_default()
    });
    let mut ratios: Vec<f32> = samples.iter().map(Shared::brightness).collect();
    let log_ratio = median(&mut ratios).unwrap_or_default();
    for ratio in &mut ratios {
        *ratio = (*ratio - log_ratio).abs();
    }
    let deviation = SD_PER_MEDIAN_MAGNITUDE * f64::from(median(&mut ratios).unwrap_or_default());
    let pair = PairExposure { first, second, log_ratio: f64::from(log_ratio), deviation, samples: samples.len() };
    // Neighboring samples say the same; a few hundred of an overlap settle seven unknowns.
    const KEPT: usize = 600;
    let step = samples.len().div_ceil(KEPT);
    // Those alone take memory, for thousands of overlaps.
    let kept = samples.iter().step_by(step).map(|sample| sample.with_variances(curve)).collect();
    Some(Observed::new(pair, channel_medians, kept))
}
