//! What is done to the light of one photograph before it is laid beside others.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use trueup_core::color::TransferCurve;
use trueup_core::{Error, Result};

use super::response::Response;
use crate::layout::{CanvasLayout, Placed};
use crate::transfer_curve::Linearize;

/// Even powers of the radius in the model of vignetting: r^2, r^4, r^6.
pub const VIGNETTING_TERMS: usize = 3;

/// Factors on the linear light of one photograph: a gain for each channel, and a correction of vignetting that is 1 in
/// the photograph's middle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    /// Factors on red, green and blue in the photograph's middle, above 0.
    pub gain: [f64; 3],
    /// Coefficients of r^2, r^4 and r^6 in the natural logarithm of a further factor on all channels; r is the distance
    /// from the photograph's middle, 1 in its corners.
    pub vignetting: [f64; VIGNETTING_TERMS],
}

impl Default for Correction {
    /// Leaves the photograph as it is.
    fn default() -> Self {
        Self::uniform(1.0)
    }
}

impl Correction {
    /// One factor on all channels everywhere.
    pub fn uniform(gain: f64) -> Self {
        Self { gain: [gain; 3], vignetting: [0.0; VIGNETTING_TERMS] }
    }

    /// The geometric mean of the channels' gains: the factor on brightness in the photograph's middle.
    pub fn brightness(&self) -> f64 {
        self.gain.iter().product::<f64>().cbrt()
    }

    /// The factor that lifts vignetting at the squared radius `r2` (1 in the corners).
    pub fn at_radius(&self, r2: f64) -> f64 {
        self.log_at_radius(r2).exp()
    }

    /// Natural logarithm of [`Self::at_radius`].
    pub fn log_at_radius(&self, r2: f64) -> f64 {
        self.vignetting.iter().rev().fold(0.0, |sum, coefficient| (sum + coefficient) * r2)
    }

    /// Refuses factors that are not above zero, or that cannot be computed.
    ///
    /// # Errors
    /// [`Error::Input`].
    pub fn check(&self) -> Result<()> {
        let usable = |factor: f64| factor.is_finite() && factor > 0.0;
        // Beyond the corner by a rim's width; exp overflows long after any lens.
        if self.gain.into_iter().all(usable) && usable(self.at_radius(1.0)) {
            return Ok(());
        }
        Err(Error::input(
            "gains",
            format!("{self:?} is not a positive factor on light"),
            "Give finite gains above zero for each photograph.",
        ))
    }
}

/// What evens out the light of all photographs of a panorama.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Corrections {
    /// The cameras' response, by which samples are read and the panorama is written: what is shown as it was taken keeps
    /// its samples. All factors act on the light by this response.
    pub response: Response,
    /// One for each photograph.
    pub photographs: Vec<Correction>,
}

impl Corrections {
    /// Leaves `count` photographs as they are.
    pub fn plain(count: usize) -> Self {
        vec![Correction::default(); count].into()
    }

    /// Those of what is placed in `layout`, if `index_of` tells a photograph's place in these. A photograph may be placed
    /// several times, or not at all; its light is the same everywhere.
    pub fn of_placed(&self, layout: &CanvasLayout, index_of: impl Fn(usize) -> Option<usize>) -> Self {
        let of = |placed: &Placed| self.photographs.get(index_of(placed.photograph)?).copied();
        Self { response: self.response, photographs: layout.placed.iter().filter_map(of).collect() }
    }
}

impl From<Vec<Correction>> for Corrections {
    /// Factors on the light by the color profile's own curve.
    fn from(photographs: Vec<Correction>) -> Self {
        Self { response: Response::default(), photographs }
    }
}

/// Smallest factor whose levelling off is undone: highlights are lifted by its inverse at most, since what lies between the
/// levels next to white is mostly noise.
const LEAST_LEVELLED: f32 = 0.6;

/// Linear light times a factor f, `f x / (1 + (f^4 - 1) x^4)^(1/4)`.
///
/// Factors above 1 level off towards white: it rises from 0 to 1, so that what the camera did not clip is not clipped here,
/// and is within 1 % of `f x` up to x = 0.22 for f = 2. Factors below 1 undo that: as cameras level highlights off when they
/// expose longer, darkening spreads them. What is clipped stays white, or nearly so, instead of turning gray; and a sky of which
/// only the blue is clipped stays blue instead of turning green.
#[inline(always)]
pub(crate) fn exposed(linear: f32, factor: f32) -> f32 {
    let square = |value: f32| value * value;
    let levelled = 1.0 + (square(square(factor.max(LEAST_LEVELLED))) - 1.0) * square(square(linear));
    factor * linear / levelled.sqrt().sqrt()
}

/// From a photograph's samples to corrected light, as the inner loops read it: its transfer curve and its [`Correction`].
#[derive(Debug, Clone)]
pub(crate) struct LightTable {
    pub(crate) linearize: Arc<Linearize>,
    pub(crate) gain: [f32; 3],
    /// Factor at r^2 = index / (length - 2), one entry beyond the corner; empty without vignetting.
    falloff: Vec<f32>,
    center: [f32; 2],
    /// Table steps per squared pixel.
    steps_per_px2: f32,
}

/// Entries up to the corner. Between two of them the factor of a strong lens (two stops) changes by 1 %, and its chord
/// is off by a thousandth of that.
const STEPS: usize = 256;

impl LightTable {
    /// For a photograph of `size` pixels, encoded by `curve`.
    pub(crate) fn new(curve: &TransferCurve, correction: &Correction, size: [f64; 2]) -> Self {
        let plain = correction.vignetting.iter().all(|&coefficient| coefficient == 0.0);
        let last = if plain { 0 } else { STEPS + 2 };
        let factor = |index: usize| correction.at_radius((index as f64 / STEPS as f64).min(1.0)) as f32;
        let corner = 0.25 * (size[0] * size[0] + size[1] * size[1]);
        Self {
            linearize: Linearize::of(curve),
            gain: correction.gain.map(|gain| gain as f32),
            falloff: (0..last).map(factor).collect(),
            center: size.map(|length| 0.5 * length as f32),
            steps_per_px2: (STEPS as f64 / corner) as f32,
        }
    }

    /// Whether the factor depends on the place.
    pub(crate) fn varies(&self) -> bool {
        !self.falloff.is_empty()
    }

    /// The factor against vignetting at a position in the photograph, pixels; only where [`Self::varies`].
    #[inline(always)]
    pub(crate) fn at(&self, x: f32, y: f32) -> f32 {
        let (dx, dy) = (x - self.center[0], y - self.center[1]);
        let step = ((dx * dx + dy * dy) * self.steps_per_px2).min(STEPS as f32);
        let index = step as usize;
        match self.falloff.get(index..index + 2) {
            Some(pair) => pair[0] + (step - index as f32) * (pair[1] - pair[0]),
            None => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_follows_the_formula() {
        let correction = Correction { gain: [1.0, 2.0, 0.5], vignetting: [0.3, -0.2, 0.4] };
        let table = LightTable::new(&TransferCurve::SRGB, &correction, [400.0, 300.0]);
        assert!(table.varies());
        for (x, y) in [(200.0, 150.0), (0.0, 0.0), (37.5, 281.0), (400.0, 300.0), (390.0, 12.0)] {
            let r2 = ((x - 200.0) * (x - 200.0) + (y - 150.0) * (y - 150.0)) / (200.0 * 200.0 + 150.0 * 150.0);
            let expected = f64::exp(0.3 * r2 - 0.2 * r2 * r2 + 0.4 * r2 * r2 * r2);
            assert!((f64::from(table.at(x as f32, y as f32)) - expected).abs() < 1e-4, "({x}, {y})");
        }
        assert!(!LightTable::new(&TransferCurve::SRGB, &Correction::uniform(3.0), [400.0, 300.0]).varies());
        assert!((correction.brightness() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn brightening_clips_nothing_and_darkening_undoes_it() {
        assert!((exposed(1.0, 3.0) - 1.0).abs() < 1e-6);
        // 0.25 / (1 - (1 - 0.6^4) / 16)^(1/4)
        assert!((exposed(0.5, 0.5) - 0.253_521).abs() < 1e-5);
        assert!((exposed(0.1, 0.5) - 0.05).abs() < 1e-5);
        // Clipped light stays white, but is lifted by no more than 1 / 0.6.
        assert!((exposed(1.0, 0.8) - 1.0).abs() < 1e-6 && (exposed(1.0, 0.3) - 0.5).abs() < 1e-6);
        for (level, factor) in [(0.3, 0.7), (0.9, 0.6), (0.99, 0.8), (0.7, 1.4)] {
            assert!((exposed(exposed(level, factor), factor.recip()) - level).abs() < 1e-5, "{level} {factor}");
        }
        // 0.4 / (1 + 15 * 0.0016)^(1/4)
        assert!((exposed(0.2, 2.0) - 0.397_636).abs() < 1e-5);
        let levels: Vec<f32> = (0..=100).map(|step| exposed(step as f32 / 100.0, 8.0)).collect();
        assert!(levels.windows(2).all(|pair| pair[0] < pair[1]) && levels[100] < 1.000_001);
    }

    #[test]
    fn factors_of_zero_or_infinity_are_refused() {
        assert!(Correction::uniform(0.0).check().is_err());
        assert!(Correction::uniform(f64::NAN).check().is_err());
        assert!(Correction { vignetting: [1e6, 0.0, 0.0], ..Correction::default() }.check().is_err());
        assert!(Correction::default().check().is_ok());
    }
}
