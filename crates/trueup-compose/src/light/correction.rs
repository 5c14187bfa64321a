//! What is done to the light of one photograph before it is laid beside others.

use serde::{Deserialize, Serialize};
use trueup_core::{Error, Result};

use super::response::Response;
use crate::layout::{CanvasLayout, Placed};

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
    /// How far the camera levels highlights off towards white, beside the response: 0 where it clips hard, 1 where
    /// darkening undoes all that brightening does.
    #[serde(default = "whole_shoulder")]
    pub shoulder: f64,
}

/// Of what nothing is known, such as files of programs that knew no other: most cameras have a shoulder.
fn whole_shoulder() -> f64 {
    1.0
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
        Self { gain: [gain; 3], vignetting: [0.0; VIGNETTING_TERMS], shoulder: whole_shoulder() }
    }

    /// The geometric mean of the channels' gains: the factor on brightness in the photograph's middle.
    pub fn brightness(&self) -> f64 {
        self.gain.iter().product::<f64>().cbrt()
    }

    /// The factor that lifts vignetting at the squared radius `r2` (1 in the corners).
    pub fn at_radius(&self, r2: f64) -> f64 {
        self.log_at_radius(r2).exp()
    }

    /// The largest factor on any channel anywhere in the photograph.
    pub(crate) fn most(&self) -> f64 {
        /// Rings between the middle and the corners that are looked at: vignetting is smooth.
        const RINGS: u32 = 16;
        let lifts = (0..=RINGS).map(|ring| self.at_radius(f64::from(ring) / f64::from(RINGS)));
        lifts.fold(0.0, f64::max) * self.gain.into_iter().fold(0.0, f64::max)
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
        let is_share = (0.0..=1.0).contains(&self.shoulder);
        if self.gain.into_iter().all(usable) && usable(self.at_radius(1.0)) && is_share {
            return Ok(());
        }
        Err(Error::input(
            "gains",
            format!("{self:?} is not a positive factor on light"),
            "Give finite gains above zero, and a shoulder from 0 to 1, for each photograph.",
        ))
    }
}

/// What evens out the light of all photographs of a panorama.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Corrections {
    /// The cameras' response, by which samples are read and the panorama is written: what is shown as it was taken
    /// keeps its samples. All factors act on the light by this response.
    pub response: Response,
    /// One for each photograph.
    pub photographs: Vec<Correction>,
}

impl Corrections {
    /// Leaves `count` photographs as they are.
    pub fn plain(count: usize) -> Self {
        vec![Correction::default(); count].into()
    }

    /// With highlights that the cameras of all level off by this share.
    pub(crate) fn with_shoulder(mut self, shoulder: f64) -> Self {
        self.photographs.iter_mut().for_each(|one| one.shoulder = shoulder);
        self
    }

    /// Those of what is placed in `layout`, if `index_of` tells a photograph's place in these. A photograph may be
    /// placed several times, or not at all; its light is the same everywhere.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_of_zero_or_infinity_are_refused() {
        assert!(Correction::uniform(0.0).check().is_err());
        assert!(Correction::uniform(f64::NAN).check().is_err());
        assert!(Correction { vignetting: [1e6, 0.0, 0.0], ..Correction::default() }.check().is_err());
        assert!(Correction { shoulder: 1.1, ..Correction::default() }.check().is_err());
        assert!(Correction { shoulder: f64::NAN, ..Correction::default() }.check().is_err());
        assert!(Correction::default().check().is_ok());
    }
}
