//! What two photographs that overlap say of each other.

use trueup_core::color::TransferCurve;
use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median, median_of};

use super::measured::PairExposure;
use super::samples::Shared;

/// Fewest samples two photographs must share to be compared.
const MIN_SHARED: usize = 20;

/// Samples that are kept of an overlap, at most. Neighboring samples say the same; a few hundred of an overlap settle
/// seven unknowns.
const KEPT: usize = 600;

/// Samples that are kept of all overlaps, about: 110 MB while the light is evened out, of up to 2000 overlaps as many
/// as of one. Where there are more, every photograph has several, and in all of them together still more samples than
/// one of a pair.
const KEPT_OF_ALL: usize = 1_200_000;

/// Samples that are kept of each of so many overlaps.
pub(super) fn kept_of_each(overlaps: usize) -> usize {
    (KEPT_OF_ALL / overlaps.max(1)).clamp(MIN_SHARED, KEPT)
}

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

/// Compares two photographs by what they share, and keeps so many samples of it; `None` if they share too little.
pub(super) fn compare(
    samples: &[Shared],
    [first, second]: [usize; 2],
    curve: &TransferCurve,
    kept_samples: usize,
) -> Option<Observed> {
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
    let step = samples.len().div_ceil(kept_samples);
    // They alone take memory, for thousands of overlaps.
    let kept = samples.iter().step_by(step).map(|sample| sample.with_variances(curve)).collect();
    Some(Observed::new(pair, channel_medians, kept))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 1,200,000 are 600 of each of 2000 overlaps, 240 of 5000; of none and of millions the bounds.
    #[test]
    fn very_many_overlaps_keep_fewer_samples_each() {
        assert_eq!([0, 1, 2000, 5000, 10_000_000].map(kept_of_each), [600, 600, 600, 240, MIN_SHARED]);
    }
}
