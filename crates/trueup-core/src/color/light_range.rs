//! Light of any brightness as samples of a picture.

use serde::{Deserialize, Serialize};

/// The light that samples from 0 to 1 stand for, where they keep what is brighter than white, in the unit of the files
/// it comes from.
///
/// Up to `white`, a picture made of the samples looks like one of sRGB, a little darker; from there on the samples rise
/// ever more slowly with the logarithm of the light, up to `peak`. So it can be looked at and measured like any
/// picture, and no light is lost: with 16 bits a sample is within a thousandth of its light from a thousandth of
/// `white` up to ten thousand times of it, and within two up to a million times.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LightRange {
    /// Light that is drawn as a photograph's brightest ordinary tones; above 0.
    pub white: f64,
    /// The brightest light that is kept; at least `white`.
    pub peak: f64,
}

/// Share of the samples, at most, that light above [`LightRange::white`] takes: what is left to ordinary tones keeps
/// their contrast well enough to be measured, and 16 bits hold a million times `white` in it.
const HIGHLIGHTS: f64 = 0.3;

/// Slope at white of sRGB's curve against the natural logarithm of the light, 1.055 / 2.4 (IEC 61966-2-1:1999, equation
/// 6).
const SLOPE_AT_WHITE: f64 = 1.055 / 2.4;

/// Largest [`LightRange::peak`] in units of [`LightRange::white`]: 60 stops, more than floating point numbers of 16
/// bits span.
const MOST_RATIO: f64 = (1_u64 << 60) as f64;

/// Halvings in which the bend of the highlights is found: as many as a number has bits.
const HALVINGS: usize = 60;

impl LightRange {
    /// Whether it can be one: both finite and above 0, the peak no less than the white and at most 60 stops above it.
    pub fn is_sound(&self) -> bool {
        let Self { white, peak } = *self;
        white.is_finite() && peak.is_finite() && white > 0.0 && peak >= white && peak <= white * MOST_RATIO
    }
}

/// The curve of a [`LightRange`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LightCurve {
    pub(super) range: LightRange,
    /// Sample that stands for white.
    knee: f64,
    /// How fast the slope falls above white; 0 where it does not.
    bend: f64,
}

impl LightCurve {
    /// `None` unless the range is sound.
    pub(super) fn new(range: LightRange) -> Option<Self> {
        if !range.is_sound() {
            return None;
        }
        let stretch = (range.peak / range.white).ln();
        // As much as highlights take if they rise on with the slope of white; none without any.
        let knee = (1.0 + SLOPE_AT_WHITE * stretch).recip().max(1.0 - HIGHLIGHTS);
        let room = 1.0 - knee;
        let rise = |bend: f64| risen(SLOPE_AT_WHITE * knee * stretch, bend);
        if rise(0.0) <= room {
            return Some(Self { range, knee, bend: 0.0 });
        }
        // The rise falls with the bend, to nothing: ln(1 + b x) / b < room from b = x / room^2 on, as ln(1 + y) <
        // sqrt(y).
        let (mut low, mut high) = (0.0, SLOPE_AT_WHITE * knee * stretch / (room * room));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if rise(middle) > room { low = middle } else { high = middle }
        }
        Some(Self { range, knee, bend: high })
    }

    /// The light of a sample from 0 to 1, as a share of the peak; `srgb` is sRGB's curve.
    pub(super) fn linear(&self, encoded: f64, srgb: impl Fn(f64) -> f64) -> f64 {
        let LightRange { white, peak } = self.range;
        if encoded >= 1.0 {
            return 1.0;
        }
        if encoded <= self.knee {
            return srgb(encoded / self.knee) * (white / peak);
        }
        let rise = encoded - self.knee;
        let straight = if self.bend > 0.0 { (self.bend * rise).exp_m1() / self.bend } else { rise };
        ((straight / (SLOPE_AT_WHITE * self.knee)).exp() * (white / peak)).min(1.0)
    }

    /// The sample of a light from 0 to 1 of the peak; `srgb` is sRGB's curve the other way.
    pub(super) fn encoded(&self, linear: f64, srgb: impl Fn(f64) -> f64) -> f64 {
        let LightRange { white, peak } = self.range;
        let of_white = linear * (peak / white);
        if of_white <= 1.0 {
            return self.knee * srgb(of_white);
        }
        (self.knee + risen(SLOPE_AT_WHITE * self.knee * of_white.ln(), self.bend)).min(1.0)
    }
}

/// What is left of a straight rise that bends.
fn risen(straight: f64, bend: f64) -> f64 {
    if bend > 0.0 { (bend * straight).ln_1p() / bend } else { straight }
}

#[cfg(test)]
mod tests {
    use super::super::TransferCurve;
    use super::*;

    fn curve(white: f64, peak: f64) -> TransferCurve {
        TransferCurve::light(LightRange { white, peak }).expect("a range")
    }

    #[test]
    fn ordinary_tones_are_those_of_srgb_and_the_slope_goes_on_at_white() {
        // Four times white: ln 4 = 1.386294, 1 / (1 + 0.439583 * 1.386294) = 0.621353, of which 0.7 is the least.
        let four = curve(2.0, 8.0);
        // sRGB's 0.5 is 0.214041 of white, which is a quarter of the peak.
        assert!((four.linear(0.35) - 0.214_041 / 4.0).abs() < 1e-6);
        assert!((four.linear(0.7) - 0.25).abs() < 1e-12 && (four.encoded(0.25) - 0.7).abs() < 1e-12);
        let slope =
            |curve: &TransferCurve, light: f64| (curve.encoded(light * 1e-4_f64.exp()) - curve.encoded(light)) / 1e-4;
        assert!((slope(&four, 0.25) / slope(&four, 0.2499) - 1.0).abs() < 2e-3);
        // 1.5 times white rises on with that slope: 1 / (1 + 0.439583 * 0.405465) = 0.848727 is white.
        assert!((curve(1.0, 1.5).encoded(1.0 / 1.5) - 0.848_727).abs() < 1e-6);
    }

    #[test]
    fn without_highlights_it_is_srgb() {
        for level in [0.0, 0.1, 0.5, 0.9, 1.0] {
            assert!((curve(3.0, 3.0).linear(level) - TransferCurve::SRGB.linear(level)).abs() < 1e-12);
        }
    }

    #[test]
    fn sixteen_bits_hold_light_finely() {
        for (peak, most) in [(1.0, 1e-3), (1.2, 1e-3), (3.0, 1e-3), (64.0, 1e-3), (1e4, 1e-3), (1e6, 2e-3)] {
            let curve = curve(1.0, peak);
            let mut light = 1e-3;
            while light <= peak {
                let sample = (curve.encoded(light / peak) * 65535.0).round() / 65535.0;
                let found = curve.linear(sample) * peak;
                assert!((found / light - 1.0).abs() < most, "{light} of {peak}: {found}");
                light *= 1.07;
            }
            assert_eq!((curve.encoded(0.0), curve.encoded(1.0), curve.linear(1.0)), (0.0, 1.0, 1.0));
        }
    }

    #[test]
    fn what_is_no_range_is_refused() {
        for (white, peak) in [(0.0, 1.0), (-1.0, 1.0), (2.0, 1.0), (1.0, f64::INFINITY), (f64::NAN, 1.0), (1e-30, 1.0)]
        {
            assert_eq!(TransferCurve::light(LightRange { white, peak }), None, "{white} {peak}");
        }
    }
}
