//! What the refinements of the mesh are given: the working pictures' pixels.

use std::borrow::Cow;

use rayon::prelude::*;
use trueup_align::mesh::{PhotometricInput, Pyramid, Refinements};
use trueup_core::raster::Raster;
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;

use crate::align::Component;
use crate::options::StitchOptions;

/// Whether the mesh is refined by the photographs' pixels, so that they are worth keeping.
pub(crate) fn needs_pixels(options: &StitchOptions) -> bool {
    options.stitch.align.uses_lines() || options.stitch.align.uses_pixels()
}

/// Grey values rounded to eight bits.
pub(crate) fn eight_bit(gray: &Raster<f32>) -> Raster<u8> {
    let mut rounded = Raster::new(gray.width(), gray.height(), 1);
    for (rounded, &value) in rounded.data_mut().iter_mut().zip(gray.data()) {
        // The cast saturates.
        *rounded = (value + 0.5) as u8;
    }
    rounded
}

/// The pixels of a component's pictures, as far as the options ask for them.
#[derive(Debug, Default)]
pub(crate) struct Pixels {
    pyramids: Vec<Pyramid>,
}

impl Pixels {
    /// From what was kept; photographs that were measured without keeping their pixels are decoded again.
    ///
    /// # Errors
    /// Those of decoding; [`trueup_core::Error::Cancelled`].
    pub fn new(
        component: &Component,
        photographs: &FilePhotographs,
        options: &StitchOptions,
        context: &StageContext,
    ) -> Result<Self> {
        if !needs_pixels(options) {
            return Ok(Self::default());
        }
        let pyramids = (0..component.members.len())
            .into_par_iter()
            .map(|k| {
                context.check_cancelled()?;
                let gray: Cow<Raster<u8>> = match component.grays[k] {
                    Some(kept) => Cow::Borrowed(kept),
                    None => {
                        let (frame, thumbnail) = (&component.frames[k], options.stitch.thumbnail_pixels);
                        let picture = photographs.working(component.members[k], frame, thumbnail)?;
                        Cow::Owned(eight_bit(&picture.gray))
                    }
                };
                Ok(Pyramid::new(&gray, options.photometric.levels))
            })
            .collect::<Result<_>>()?;
        Ok(Self { pyramids })
    }

    /// The refinements that the options ask for.
    pub fn refinements<'a>(&'a self, options: &'a StitchOptions) -> Refinements<'a> {
        let photometric = options
            .stitch
            .align
            .uses_pixels()
            .then_some(PhotometricInput { pyramids: &self.pyramids, options: &options.photometric });
        Refinements { photometric, outline_weight: options.mesh.outline_weight }
    }
}
