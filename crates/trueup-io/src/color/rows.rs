//! A finished picture in sRGB, row by row.

use std::fmt;
use std::sync::Arc;

use moxcms::{Layout, Transform16BitExecutor};
use trueup_core::color::TransferCurve;
use trueup_core::raster::RowSource;
use trueup_core::{Error, Result};

use super::convert::transform;
use super::icc::{RgbSpace, Understood, understand};

/// A picture of another color space, converted to sRGB as its rows are asked for; colors that sRGB has not are clipped.
pub(crate) struct InSrgb<'a> {
    picture: &'a dyn RowSource,
    transform: Arc<Transform16BitExecutor>,
}

impl fmt::Debug for InSrgb<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("InSrgb").finish_non_exhaustive()
    }
}

impl<'a> InSrgb<'a> {
    /// Of a picture whose samples are in the space of the profile `icc`.
    ///
    /// # Errors
    /// [`Error::Input`] if that is no profile of RGB samples.
    pub(crate) fn new(picture: &'a dyn RowSource, icc: &[u8]) -> Result<Self> {
        let unusable = |reason: String| {
            Error::input("ICC profile", format!("the panorama cannot be converted from it ({reason})"), "Keep it.")
        };
        let profile = match understand(icc) {
            Understood::Space(space) => space.profile,
            Understood::Tables(profile) => profile,
            Understood::Damaged(reason) => return Err(unusable(reason)),
            other => return Err(unusable(format!("{other:?}"))),
        };
        let transform = transform(&profile, &RgbSpace::srgb().profile, Layout::Rgba).map_err(unusable)?;
        Ok(Self { picture, transform })
    }
}

impl RowSource for InSrgb<'_> {
    fn width(&self) -> usize {
        self.picture.width()
    }

    fn height(&self) -> usize {
        self.picture.height()
    }

    fn is_opaque(&self) -> bool {
        self.picture.is_opaque()
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        let mut sixteen = vec![0; row.len()];
        self.rgba16_row(y, &mut sixteen)?;
        for (target, samples) in row.as_chunks_mut::<4>().0.iter_mut().zip(sixteen.as_chunks::<4>().0) {
            *target = samples.map(|sample| ((u32::from(sample) + 128) / 257) as u8);
            // What is too little for 8 bits of alpha has no color, as in the picture itself.
            if target[3] == 0 {
                *target = [0; 4];
            }
        }
        Ok(())
    }

    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        let mut own = vec![0; row.len()];
        self.picture.rgba16_row(y, &mut own)?;
        self.transform
            .transform(&own, row)
            .map_err(|error| Error::input("color conversion", error, "Report this as a defect."))
    }

    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        let mut sixteen = vec![0; row.len()];
        self.rgba16_row(y, &mut sixteen)?;
        for (index, (target, sample)) in row.iter_mut().zip(sixteen).enumerate() {
            let value = f64::from(sample) / 65535.0;
            *target = if index % 4 == 3 { value } else { TransferCurve::SRGB.linear(value) } as f32;
        }
        Ok(())
    }
}
