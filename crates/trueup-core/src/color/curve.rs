//! From encoded samples to linear light and back.

use std::sync::Arc;

use super::light_range::{LightCurve, LightRange};

/// The transfer curve of a color space: what share of full light an encoded sample stands for.
///
/// Encoded values and light run from 0 to 1; values outside are clamped. Every curve starts at 0, ends at 1 and never
/// falls, so that it can be undone.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TransferCurve(Kind);

#[derive(Debug, Clone, PartialEq, Default)]
enum Kind {
    /// The curve of sRGB and Display P3.
    #[default]
    Srgb,
    /// linear = encoded^gamma.
    Gamma(f64),
    /// The ICC's parametric curve of type 4, coefficients g, a, b, c, d, e, f.
    Parametric([f64; 7]),
    /// Light at evenly spaced encoded values, straight between them.
    Table(Arc<[f64]>),
    /// Light that may be brighter than white.
    Light(LightCurve),
}

/// Most that two curves may differ, in encoded values, and be the same for pictures: half an 8-bit level.
const SAME: f64 = 0.5 / 255.0;

/// Places between 0 and 1 where curves are compared and checked.
const CHECKED: usize = 1024;

/// How far a profile's curve may miss 0 and 1 at its ends: numbers in profiles have 16 bits behind the point, and some
/// were rounded before.
const END_TOLERANCE: f64 = 5e-3;

impl TransferCurve {
    /// The curve of sRGB, which Display P3 has as well.
    ///
    /// # Source
    /// IEC 61966-2-1:1999, equations 5 to 7.
    pub const SRGB: Self = Self(Kind::Srgb);

    /// Light as the power `gamma` of the encoded value; `None` unless `gamma` is a finite number above 0.
    pub fn gamma(gamma: f64) -> Option<Self> {
        (gamma.is_finite() && gamma > 0.0).then_some(Self(Kind::Gamma(gamma)))
    }

    /// The parametric curve with the coefficients g, a, b, c, d, e, f:
    /// `(a x + b)^g + e` from `x = d` on, `c x + f` below. `None` if it is no curve from 0 to 1 that never falls.
    ///
    /// # Source
    /// ICC.1:2022, section 10.18, function type 4, of which the other types are special cases.
    pub fn parametric(coefficients: [f64; 7]) -> Option<Self> {
        let [_, a, ..] = coefficients;
        let finite = coefficients.iter().all(|value| value.is_finite()) && a != 0.0;
        finite.then_some(Self(Kind::Parametric(coefficients)))?.if_usable()
    }

    /// A curve through evenly spaced samples, the first at 0 and the last at 1. `None` for fewer than two, or if it is
    /// no curve from 0 to 1 that never falls.
    pub fn table(samples: Vec<f64>) -> Option<Self> {
        let rising = samples.windows(2).all(|pair| pair[0] <= pair[1]);
        (samples.len() >= 2 && rising).then(|| Self(Kind::Table(samples.into())))?.if_usable()
    }

    /// Linear light (0 to 1) of an encoded value; NaN gives 0.
    pub fn linear(&self, encoded: f64) -> f64 {
        let x = unit(encoded);
        match &self.0 {
            Kind::Srgb if x <= 0.040_45 => x / 12.92,
            Kind::Srgb => ((x + 0.055) / 1.055).powf(2.4),
            Kind::Gamma(gamma) => x.powf(*gamma),
            Kind::Parametric([g, a, b, c, d, e, f]) if x >= *d => {
                unit((a * x + b).max(0.0).powf(*g) + e).max(c * d + f)
            }
            Kind::Parametric([_, _, _, c, _, _, f]) => unit(c * x + f),
            Kind::Light(curve) => curve.linear(x, |encoded| Self::SRGB.linear(encoded)),
            Kind::Table(samples) => {
                let position = x * (samples.len() - 1) as f64;
                let below = (position as usize).min(samples.len() - 2);
                let share = position - below as f64;
                samples[below] * (1.0 - share) + samples[below + 1] * share
            }
        }
    }

    /// The encoded value (0 to 1) that stands for linear light; where several do, the middle one, but 0 for no light
    /// and 1 for all. NaN gives 0.
    pub fn encoded(&self, linear: f64) -> f64 {
        let y = unit(linear);
        match &self.0 {
            _ if y == 0.0 || y == 1.0 => y,
            Kind::Srgb if y <= 0.003_130_8 => 12.92 * y,
            Kind::Srgb => 1.055 * y.powf(1.0 / 2.4) - 0.055,
            Kind::Gamma(gamma) => y.powf(1.0 / gamma),
            Kind::Parametric([g, a, b, c, d, e, f]) => {
                let curved = unit((y - e).max(0.0).powf(1.0 / g) / a - b / a);
                let straight = if *c > 0.0 { (y - f) / c } else { *d };
                if straight < *d { unit(straight) } else { curved.max(*d) }
            }
            Kind::Light(curve) => curve.encoded(y, |linear| Self::SRGB.encoded(linear)),
            Kind::Table(samples) => {
                // The stretch that may be level: from the last sample below to the first above.
                let low = samples.partition_point(|&sample| sample < y);
                let high = samples.partition_point(|&sample| sample <= y);
                let steps = (samples.len() - 1) as f64;
                if high > low {
                    return 0.5 * (low + high - 1) as f64 / steps;
                }
                let Some(below) = low.checked_sub(1) else { return 0.0 };
                let Some(&above) = samples.get(low) else { return 1.0 };
                (below as f64 + (y - samples[below]) / (above - samples[below])) / steps
            }
        }
    }

    /// Whether pictures encoded by the one or the other look the same: encoded values differ by half an 8-bit level at
    /// most.
    pub fn is_same(&self, other: &Self) -> bool {
        self == other
            || (0..=CHECKED).all(|step| {
                let encoded = step as f64 / CHECKED as f64;
                (other.encoded(self.linear(encoded)) - encoded).abs() <= SAME
                    && (self.encoded(other.linear(encoded)) - encoded).abs() <= SAME
            })
    }

    /// sRGB's own form where it is that curve but for rounding, as the tables of most sRGB profiles are.
    pub fn simplified(self) -> Self {
        if self.is_same(&Self::SRGB) { Self::SRGB } else { self }
    }

    /// The curve of samples that keep what is brighter than white: full light is [`LightRange::peak`]. `None` if the
    /// range is not [sound](LightRange::is_sound).
    pub fn light(range: LightRange) -> Option<Self> {
        LightCurve::new(range).map(|curve| Self(Kind::Light(curve)))
    }

    /// What full light is, where samples keep what is brighter than white; `None` where it is white.
    pub fn light_range(&self) -> Option<LightRange> {
        match &self.0 {
            Kind::Light(curve) => Some(curve.range),
            _ => None,
        }
    }

    fn if_usable(self) -> Option<Self> {
        let values: Vec<f64> = (0..=CHECKED).map(|step| self.linear(step as f64 / CHECKED as f64)).collect();
        let rises = values.windows(2).all(|pair| pair[0] <= pair[1]);
        let ends = values[0].abs() <= END_TOLERANCE && (values[CHECKED] - 1.0).abs() <= END_TOLERANCE;
        (rises && ends).then_some(self)
    }
}

/// Clamped to 0 to 1; NaN gives 0.
fn unit(value: f64) -> f64 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// sRGB as a profile has it, numbers rounded to 16 bits behind the point.
    const SRGB_PARAMETRIC: [f64; 7] = [2.4, 0.947_86, 0.052_14, 0.077_39, 0.040_45, 0.0, 0.0];

    #[test]
    fn srgb_has_the_values_of_the_standard() {
        // Linear light of a few 8-bit levels, computed by hand from equation 6 and 7 of the standard.
        for (level, linear) in
            [(0.0, 0.0), (10.0, 0.003_035_27), (55.0, 0.038_204_4), (188.0, 0.502_886_5), (255.0, 1.0)]
        {
            assert!((TransferCurve::SRGB.linear(level / 255.0) - linear).abs() < 1e-7, "{level}");
        }
        assert_eq!(TransferCurve::default(), TransferCurve::SRGB);
    }

    #[test]
    fn adobe_rgb_has_its_gamma() {
        let adobe = TransferCurve::gamma(2.199_218_75).expect("a curve");
        // 0.5^2.19921875 = 2^-2.19921875 = exp(-1.524382...) = 0.217755.
        assert!((adobe.linear(0.5) - 0.217_755).abs() < 1e-6, "{}", adobe.linear(0.5));
        assert!((adobe.encoded(0.217_755) - 0.5).abs() < 1e-6);
        assert!(!adobe.is_same(&TransferCurve::SRGB));
    }

    #[test]
    fn profiles_of_srgb_are_srgb() {
        let parametric = TransferCurve::parametric(SRGB_PARAMETRIC).expect("a curve");
        assert_eq!(parametric.simplified(), TransferCurve::SRGB);
        let rounded = |step: i32| (TransferCurve::SRGB.linear(f64::from(step) / 1023.0) * 65535.0).round() / 65535.0;
        let table = TransferCurve::table((0..1024).map(rounded).collect()).expect("a curve");
        assert_eq!(table.simplified(), TransferCurve::SRGB);
    }

    #[test]
    fn what_cannot_be_undone_is_refused() {
        for gamma in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(TransferCurve::gamma(gamma), None);
        }
        assert_eq!(TransferCurve::table(vec![0.0]), None);
        assert_eq!(TransferCurve::table(vec![0.0, 0.7, 0.3, 1.0]), None);
        assert_eq!(TransferCurve::table(vec![0.0, 0.5]), None);
        assert_eq!(TransferCurve::table(vec![0.0, f64::NAN, 1.0]), None);
        assert_eq!(TransferCurve::parametric([2.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), None);
        assert_eq!(TransferCurve::parametric([f64::NAN; 7]), None);
    }

    #[test]
    fn a_level_stretch_is_undone_to_its_middle() {
        let table = TransferCurve::table(vec![0.0, 0.5, 0.5, 0.5, 1.0]).expect("a curve");
        assert_eq!(table.encoded(0.5), 0.5);
        assert_eq!(table.encoded(0.75), 0.875);
        let dark = TransferCurve::table(vec![0.0, 0.0, 1.0, 1.0]).expect("a curve");
        assert_eq!((dark.encoded(0.0), dark.encoded(0.5), dark.encoded(1.0)), (0.0, 0.5, 1.0));
        assert_eq!((table.encoded(-3.0), table.encoded(7.0), table.encoded(f64::NAN)), (0.0, 1.0, 0.0));
    }

    fn curves() -> Vec<TransferCurve> {
        // ProPhoto RGB: gamma 1.8 with a straight start of slope 1/16 up to 16 * 16^(1/(0.8)) ... = 0.03125.
        let pro_photo = TransferCurve::parametric([1.8, 1.0, 0.0, 0.0625, 0.031_25, 0.0, 0.0]);
        let table = TransferCurve::table((0..=64).map(|step| (f64::from(step) / 64.0).powf(1.7)).collect());
        let gamma = TransferCurve::gamma(2.2);
        let parametric = TransferCurve::parametric(SRGB_PARAMETRIC);
        [Some(TransferCurve::SRGB), pro_photo, table, gamma, parametric].map(|one| one.expect("a curve")).into()
    }

    proptest! {
        #[test]
        fn encoding_undoes_linearizing(encoded in 0.0..=1.0_f64) {
            for curve in curves() {
                let back = curve.encoded(curve.linear(encoded));
                prop_assert!((back - encoded).abs() < 2e-5, "{:?}: {} for {}", curve, back, encoded);
            }
        }

        #[test]
        fn more_is_never_less(low in -0.5..1.5_f64, high in -0.5..1.5_f64) {
            let (low, high) = (low.min(high), low.max(high));
            for curve in curves() {
                prop_assert!(curve.linear(low) <= curve.linear(high));
                prop_assert!(curve.encoded(low) <= curve.encoded(high));
            }
        }
    }
}
