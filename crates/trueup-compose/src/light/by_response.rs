//! Photographs whose samples are read by the response of their cameras.

use trueup_core::Result;
use trueup_core::color::TransferCurve;
use trueup_core::mask::Masks;
use trueup_core::raster::Photograph;
use trueup_core::source::PhotographSource;

use super::response::Response;
use crate::transfer_curve::Encoding;

/// The same photographs with the corrected curve in place of their color profile's: all that reads samples or writes the
/// panorama takes it from here, so that what is shown as it was taken keeps its samples.
pub(crate) struct ByResponse<'a> {
    photographs: &'a dyn PhotographSource,
    curve: TransferCurve,
}

impl<'a> ByResponse<'a> {
    /// # Errors
    /// Those of [`Response::curve`].
    pub(crate) fn new(photographs: &'a dyn PhotographSource, response: &Response) -> Result<Self> {
        let curve = response.curve(&photographs.transfer_curve())?;
        Ok(Self { photographs, curve })
    }

    /// How what is composed of them is written.
    pub(crate) fn encoding(&self) -> Encoding {
        Encoding::new(self.curve.clone()).of_profile(&self.photographs.transfer_curve())
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
