//! Photographs whose samples are read by the response of their cameras.

use std::borrow::Cow;

use trueup_core::Result;
use trueup_core::color::TransferCurve;
use trueup_core::mask::Masks;
use trueup_core::raster::Photograph;
use trueup_core::source::PhotographSource;

use super::correction::{Correction, Corrections};
use super::local_exposure::LocalExposure;
use crate::layout::CanvasLayout;
use crate::look::local_exposure;
use crate::render_options::Look;
use crate::transfer_curve::Encoding;

/// The same photographs with the corrected curve in place of their color profile's: all that reads samples or writes
/// the panorama takes it from here, so that what is shown as it was taken keeps its samples.
pub(crate) struct ByResponse<'a> {
    photographs: &'a dyn PhotographSource,
    curve: TransferCurve,
    corrections: Cow<'a, [Correction]>,
    /// The largest factor on light, by which the corrections were divided; 1 where light ends at white.
    most: f64,
}

impl<'a> ByResponse<'a> {
    /// # Errors
    /// Those of [`Response::curve`](super::Response::curve).
    pub(crate) fn new(photographs: &'a dyn PhotographSource, corrections: &'a Corrections) -> Result<Self> {
        let own = Cow::Borrowed(corrections.photographs.as_slice());
        let profile = photographs.transfer_curve();
        if profile.light_range().is_none() {
            let curve = corrections.response.curve(&profile)?;
            return Ok(Self { photographs, curve, corrections: own, most: 1.0 });
        }
        // Light is known as it is. Nothing is brightened beyond what the canvas holds.
        let most = own.iter().map(Correction::most).fold(0.0, f64::max);
        if !(most.is_finite() && most > 0.0) {
            return Ok(Self { photographs, curve: profile, corrections: own, most: 1.0 });
        }
        let divided = own.iter().map(|one| Correction { gain: one.gain.map(|gain| gain / most), ..*one }).collect();
        Ok(Self { photographs, curve: profile, corrections: Cow::Owned(divided), most })
    }

    /// What is done to the light of each photograph on its way to the canvas.
    pub(crate) fn corrections(&self) -> &[Correction] {
        &self.corrections
    }

    /// The factors that a look lays over the canvas: none on light that is kept as it is.
    pub(crate) fn local_exposure(&self, layout: &CanvasLayout, look: Look) -> Option<LocalExposure> {
        match self.curve.light_range() {
            Some(_) => None,
            None => local_exposure(layout, &self.corrections, look),
        }
    }

    /// How what is composed of them is written.
    pub(crate) fn encoding(&self) -> Encoding {
        Encoding::new(self.curve.clone(), self.most).of_profile(&self.photographs.transfer_curve())
    }
}

impl PhotographSource for ByResponse<'_> {
    fn photograph(&self, index: usize) -> Result<Photograph> {
        self.photographs.photograph(index)
    }

    fn masks(&self, index: usize) -> Masks {
        self.photographs.masks(index)
    }

    fn bytes(&self, index: usize) -> Option<usize> {
        self.photographs.bytes(index)
    }

    fn transfer_curve(&self) -> TransferCurve {
        self.curve.clone()
    }
}
