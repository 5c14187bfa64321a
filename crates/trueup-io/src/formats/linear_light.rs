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

/// Linear light as 16-bit samples: of a range, or without one of sRGB, with 1 for white. What is brighter than either's
/// end is as bright as that. What is no finite number is missing: infinite light (a pixel that a division left without
/// a weight, the sun of a rendering) is as bright as the brightest finite sample of `samples`, so that it sets no range
/// of light; NaN is black. Alpha, the second of two channels or the fourth of four, is a share, not light.
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
    let brightest = samples
        .par_chunks(at_a_time)
        .map(|samples| {
            let lights = samples.iter().enumerate().filter(|(place, _)| place % channels != alpha_place);
            lights.map(|(_, &light)| light).filter(|light| light.is_finite()).fold(0.0, f32::max)
        })
        .reduce(|| 0.0, f32::max);
    let finite = |light: f32| f64::from(if light == f32::INFINITY { brightest } else { light });
    levels.par_chunks_mut(at_a_time).zip(samples.par_chunks(at_a_time)).for_each(|(levels, samples)| {
        for (place, (target, sample)) in levels.iter_mut().zip(samples).enumerate() {
            *target = if place % channels == alpha_place { alpha(*sample) } else { level(finite(*sample)) };
        }
    });
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Alpha is a share: it neither sets what is brightest nor is it light.
    #[test]
    fn infinite_light_is_as_bright_as_the_brightest_that_is_finite() {
        let range = Some(LightRange { white: 1.0, peak: 64.0 });
        let samples = [0.5, f32::INFINITY, f32::NAN, 100.0, 4.0, f32::NEG_INFINITY, 2.0, f32::INFINITY];
        let found = encoded(&samples, 4, range);
        let expected = encoded(&[0.5, 4.0, 0.0, 1.0, 4.0, 0.0, 2.0, 1.0], 4, range);
        assert_eq!(found, expected);
        assert!(found[1] < u16::MAX, "the range's end is brighter: {}", found[1]);
        assert_eq!(encoded(&[f32::INFINITY; 3], 3, range), [0; 3], "nothing is known of it");
    }
}
