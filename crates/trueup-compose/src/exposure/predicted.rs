//! What the photographs of an overlap should show, and what that means for the response.
//!
//! The functions of the response are not read off the samples themselves. Noise and misalignment move a sample's light
//! and its functions together, so that the response which presses all contrast together would seem to fit best. They
//! are read off what both photographs together say of the light, through each one's own factors: two photographs of the
//! same exposure then say nothing about the response, as is right.

use trueup_core::Result;
use trueup_core::color::TransferCurve;

use crate::light::{RESPONSE_TERMS, Response};

/// Steps between the darkest light and white; the functions change by less than a hundredth between two of them.
const STEPS: usize = 1024;

/// Steps of the curve that the response makes of the profile, sixteen for every 8-bit level: between two of them its
/// chord is off by less than a millionth of full scale in encoded values, and the functions by a few millionths.
const CURVE_STEPS: usize = 4080;

/// Natural logarithm of the darkest light told apart, below half an 8-bit level of the usual curves.
const DARKEST: f64 = -12.0;

/// Functions of the logarithm of light, one value per step.
type Table<const N: usize> = Vec<[f64; N]>;

/// The response's functions by the light that came, for one state of the response.
pub(super) struct Predicted {
    /// What the response adds to the logarithm of the profile's light.
    added: Table<1>,
    /// The response's functions by the logarithm of the corrected light.
    terms: Table<RESPONSE_TERMS>,
}

impl Predicted {
    pub(super) fn new(profile: &TransferCurve, response: &Response) -> Result<Self> {
        let curve = response.curve_of(profile, CURVE_STEPS)?;
        let light = |step: usize| (DARKEST * (1.0 - step as f64 / STEPS as f64)).exp();
        Ok(Self {
            added: (0..=STEPS).map(|step| [response.log_factor(profile.encoded(light(step)))]).collect(),
            terms: (0..=STEPS).map(|step| Response::terms(curve.encoded(light(step)))).collect(),
        })
    }

    /// The response's functions for two photographs that show a place in `light` by the profile, if `factors` make
    /// their corrected light the same; both are natural logarithms. `variances` say how sure each photograph's light
    /// is.
    pub(super) fn terms(&self, light: [f64; 2], factors: [f64; 2], variances: [f32; 2]) -> [[f64; RESPONSE_TERMS]; 2] {
        let corrected = [0, 1].map(|side| light[side] + at(&self.added, light[side])[0] + factors[side]);
        // The mean by the variances is independent of the difference: the surer photograph says what there is.
        let [own, others] = variances.map(f64::from);
        let mean = (others * corrected[0] + own * corrected[1]) / (own + others);
        factors.map(|factor| at(&self.terms, mean - factor))
    }
}

/// The values of a table at a natural logarithm of light.
fn at<const N: usize>(table: &Table<N>, log_light: f64) -> [f64; N] {
    let position = ((1.0 - log_light / DARKEST) * STEPS as f64).clamp(0.0, STEPS as f64);
    let below = (position as usize).min(STEPS - 1);
    let share = position - below as f64;
    std::array::from_fn(|n| table[below][n] + share * (table[below + 1][n] - table[below][n]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The short table of the curve tells the functions as the long one does, from the darkest light to white.
    #[test]
    fn the_short_curve_tells_what_the_long_one_does() {
        for coefficients in [[0.4, -0.5, 0.4, 0.1], [1.5, -0.5, 0.5, 0.2], [-0.3, 0.2, 0.1, 0.0]] {
            let response = Response { coefficients };
            let long = response.curve(&TransferCurve::SRGB).expect("a curve");
            let predicted = Predicted::new(&TransferCurve::SRGB, &response).expect("a curve");
            for (step, found) in predicted.terms.iter().enumerate() {
                let light = (DARKEST * (1.0 - step as f64 / STEPS as f64)).exp();
                for (found, expected) in found.iter().zip(Response::terms(long.encoded(light))) {
                    assert!((found - expected).abs() < 4e-6, "{coefficients:?} at {light}: {found} for {expected}");
                }
            }
        }
    }
}
