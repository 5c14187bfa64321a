//! Floating point samples: linear light.

use rayon::prelude::*;
use trueup_core::color::{LightRange, TransferCurve};

/// Pixels converted at a time: enough to keep a thread busy.
const CHUNK_PIXELS: usize = 1 << 16;

/// White as a 16-bit sample.
const FULL: f64 = u16::MAX as f64;

/// Linear light, 1 for white, as a 16-bit sample of sRGB.
pub(crate) fn level(light: f64) -> u16 {
    (TransferCurve::SRGB.encoded(light) * FULL).round() as u16
}

/// Linear light as 16-bit samples: of a range, or without one of sRGB, with 1 for white. What is brighter than either's end is as bright as
/// that, NaN is black. Alpha, the second of two channels or the fourth of four, is a share, not light.
pub(crate) fn encoded(samples: &[f32], channels: usize, range: Option<LightRange>) -> Vec<u16> {
    let curve = range.and_then(TransferCurve::light);
    let level = |light: f64| match (&curve, range) {
        (Some(curve), Some(range)) => (curve.encoded(light / range.peak) * FULL).round() as u16,
        _ => level(light),
    };
    let alpha = |share: f32| (f64::from(share).clamp(0.0, 1.0) * FULL).round() as u16;
    let alpha_place = if matches!(channels, 2 | 4) { channels - 1 } else { channels };
    let mut levels = vec![0; samples.len()];
    let at_a_time = CHUNK_PIXELS * channels.max(1);
    levels.par_chunks_mut(at_a_time).zip(samples.par_chunks(at_a_time)).for_each(|(levels, samples)| {
        for (place, (target, sample)) in levels.iter_mut().zip(samples).enumerate() {
            *target = if place % channels == alpha_place { alpha(*sample) } else { level(f64::from(*sample)) };
        }
    });
    levels
}
