//! What the cameras' real response adds to the color profile's transfer curve.

use serde::{Deserialize, Serialize};
use trueup_core::color::TransferCurve;
use trueup_core::{Error, Result};

/// Functions that the correction of the response is made of.
pub const RESPONSE_TERMS: usize = 4;

/// The response of the photographs' cameras, one for all, as a correction of the color profile's curve: a sample that
/// is encoded as e and stands for the light l by the profile came from the light `l exp(c . f(e))`, but for a factor
/// that is the same for all levels.
///
/// White stays white, since all f vanish there. Cameras do not write the light itself: they lift the middle and press
/// the highlights together, so that the same factor of exposure moves middle and highlights differently.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Response {
    /// The factors c of the functions, [`Response::terms`].
    pub coefficients: [f64; RESPONSE_TERMS],
}

/// Least slope of the logarithm of the light against that of the profile's light: no response is taken to press more
/// than this many stops into one.
const LEAST_SLOPE: f64 = 0.25;

/// Encoded value, seven 8-bit levels, below which the function beside a power goes straight down to black.
const FOOT: f64 = 0.03;

/// Places between 0 and 1 where the slope is looked at: four for every 8-bit level.
const CHECKED: usize = 1020;

/// Steps of the curve's table: every 16-bit level has an entry of its own.
const STEPS: usize = 65_535;

impl Response {
    /// The functions f at the encoded value `e`: ln((e + d) / (1 + d)) / ln((1 + d) / d) with d = 0.03, near to a power
    /// of the light, and 4 e (1 - e) times the Chebyshev polynomials T_0 to T_2 of 1 - 2 e. All are 0 at white and from
    /// -1 to 1.
    pub fn terms(e: f64) -> [f64; RESPONSE_TERMS] {
        let (bump, u) = (4.0 * e * (1.0 - e), 1.0 - 2.0 * e);
        let power = ((e + FOOT) / (1.0 + FOOT)).ln() / ((1.0 + FOOT) / FOOT).ln();
        [power, bump, bump * u, bump * (2.0 * u * u - 1.0)]
    }

    /// Whether it leaves the profile's curve as it is.
    pub fn is_plain(&self) -> bool {
        self.coefficients.iter().all(|&coefficient| coefficient == 0.0)
    }

    /// Natural logarithm of the factor on the profile's light at the encoded value `e`.
    pub fn log_factor(&self, e: f64) -> f64 {
        self.coefficients.iter().zip(Self::terms(e)).map(|(coefficient, term)| coefficient * term).sum()
    }

    /// The light that an encoded value stands for, 0 to 1.
    pub fn light(&self, profile: &TransferCurve, e: f64) -> f64 {
        profile.linear(e) * self.log_factor(e).exp()
    }

    /// The nearest response in its direction that rises: weakened until a stop of the profile's light is at least a
    /// quarter of a stop everywhere.
    pub(crate) fn rising(self, profile: &TransferCurve) -> Self {
        let mut share = 1.0_f64;
        let place = |step: usize| step as f64 / CHECKED as f64;
        let mut below = (profile.linear(place(1)), self.log_factor(place(1)));
        for step in 2..=CHECKED {
            let here = (profile.linear(place(step)), self.log_factor(place(step)));
            let (rise, change) = ((here.0 / below.0).ln(), here.1 - below.1);
            // A curve may stand still or begin level; there any response does.
            if rise.is_finite() && rise > 0.0 && change < 0.0 {
                share = share.min((1.0 - LEAST_SLOPE) * rise / -change);
            }
            below = here;
        }
        Self { coefficients: self.coefficients.map(|coefficient| share * coefficient) }
    }

    /// The curve from encoded values to the light that came: the profile's, corrected.
    ///
    /// # Errors
    /// [`Error::Input`] if that is no curve that rises from 0 to 1.
    pub fn curve(&self, profile: &TransferCurve) -> Result<TransferCurve> {
        self.curve_of(profile, STEPS)
    }

    /// The same from a table of so many steps.
    ///
    /// # Errors
    /// As [`Self::curve`].
    pub(crate) fn curve_of(&self, profile: &TransferCurve, steps: usize) -> Result<TransferCurve> {
        if self.is_plain() {
            return Ok(profile.clone());
        }
        let light = (0..=steps).map(|step| self.light(profile, step as f64 / steps as f64)).collect();
        TransferCurve::table(light).ok_or_else(|| {
            Error::input(
                "response",
                format!("{:?} makes no curve that rises from black to white", self.coefficients),
                "Stitch the photographs again, or compose them with --set exposure.response=false.",
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_factor_follows_the_formula() {
        // At e = 1/4: 4 e (1 - e) = 3/4, u = 1/2, 2 u^2 - 1 = -1/2; ln(0.28 / 1.03) / ln(1.03 / 0.03) = -1.302525 /
        // 3.536117.
        let [power, others @ ..] = Response::terms(0.25);
        assert_eq!(others, [0.75, 0.375, -0.375]);
        assert!((power + 0.368_349).abs() < 1e-6, "{power}");
        assert_eq!(Response::terms(1.0), [0.0; RESPONSE_TERMS]);
        // At e = 1/2 the last three functions are 1, 0, -1; exp(0.5 - 0.3) = 1.221403, sRGB's light there is 0.214041.
        let response = Response { coefficients: [0.0, 0.5, 0.7, 0.3] };
        let light = response.curve(&TransferCurve::SRGB).expect("a curve").linear(0.5);
        assert!((light - 0.214_041 * 1.221_403).abs() < 1e-5, "{light}");
        assert_eq!(Response::default().curve(&TransferCurve::SRGB).expect("a curve"), TransferCurve::SRGB);
    }

    #[test]
    fn a_response_that_falls_is_refused() {
        for coefficients in [[0.0, 9.0, 0.0, 0.0], [f64::NAN; RESPONSE_TERMS], [1e300; RESPONSE_TERMS]] {
            let refused = Response { coefficients }.curve(&TransferCurve::SRGB);
            assert!(matches!(refused, Err(Error::Input { .. })), "{coefficients:?}");
        }
    }

    #[test]
    fn what_rises_enough_is_left_alone() {
        let weak = Response { coefficients: [0.1, -0.3, 0.2, 0.1] };
        assert_eq!(weak.rising(&TransferCurve::SRGB), weak);
    }

    proptest! {
        #[test]
        fn a_weakened_response_always_rises(coefficients in prop::array::uniform4(-20.0..20.0_f64)) {
            let gamma = TransferCurve::gamma(1.8).expect("a curve");
            for profile in [TransferCurve::SRGB, gamma] {
                let rising = Response { coefficients }.rising(&profile);
                let curve = rising.curve(&profile);
                prop_assert!(curve.is_ok(), "{:?}", rising);
                let curve = curve.expect("checked");
                for step in 2..=CHECKED {
                    let [low, high] = [step - 1, step].map(|step| step as f64 / CHECKED as f64);
                    let stops = (curve.linear(high) / curve.linear(low)).log2();
                    let least = LEAST_SLOPE * (profile.linear(high) / profile.linear(low)).log2();
                    prop_assert!(stops > least - 1e-6, "{:?} at {}: {} stops", rising, high, stops);
                }
            }
        }
    }
}
