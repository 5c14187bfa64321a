//! The photographs that a job names: found, checked, with their masks, in one color space, within the memory.

use std::sync::Arc;

use rayon::prelude::*;
use trueup_core::mask::Masks;
use trueup_core::source::{PhotographSource, SourceImage};
use trueup_core::{Error, Result, StageContext};
use trueup_io::color::PhotographColors;
use trueup_io::decode::FilePhotographs;
use trueup_io::source::{self, RejectedSource, Sources};

use super::budget::Budget;
use crate::job::inputs::{Inputs, Reference};
use crate::job::masks::{AllMasks, MaskRecord};
use crate::job::names::reference_named;
use crate::memo::KeyMaker;
use crate::options::StitchOptions;
use crate::report::left_out::{none_usable, reason_of_rejected};

/// The photographs to be stitched. They are numbered by their place in `images`.
#[derive(Debug)]
pub(crate) struct PhotographSet {
    /// Those that can be read.
    pub images: Vec<SourceImage>,
    /// Inputs that cannot.
    pub rejected: Vec<RejectedSource>,
    /// The masks of each photograph, as they are recorded.
    pub masks: Vec<Vec<MaskRecord>>,
    /// Their pixels.
    pub files: Arc<FilePhotographs>,
    /// How many of them may be measured at once.
    pub at_once: usize,
}

impl PhotographSet {
    /// Finds what `inputs` name.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no photograph, or the reference or a mask fits none; [`Error::Limits`];
    /// [`Error::Cancelled`].
    pub(crate) fn find(inputs: &Inputs, options: &StitchOptions, context: &StageContext) -> Result<Self> {
        let accepted = &options.measure.source;
        let Sources { photographs: images, rejected } =
            context.time("source", || source::scan(&inputs.photographs, accepted, context))?;
        if images.is_empty() {
            return Err(nothing_found(inputs, &rejected));
        }
        if let Reference::Named(name) = &inputs.reference {
            reference_named(&images, name)?;
        }
        let masks = AllMasks::read(&inputs.masks, &images, accepted, context)?;
        Self::open(images, rejected, masks, options, context)
    }

    /// Photographs that are found already, with their masks.
    ///
    /// # Errors
    /// [`Error::Limits`] if one is too large for the memory.
    pub(crate) fn open(
        images: Vec<SourceImage>,
        rejected: Vec<RejectedSource>,
        masks: AllMasks,
        options: &StitchOptions,
        context: &StageContext,
    ) -> Result<Self> {
        let AllMasks { masks, records } = masks;
        let measuring = Budget::new(&options.run.resources).measuring(&images, options.measure.working.pixels)?;
        let colors = PhotographColors::survey(&images, context);
        let files = FilePhotographs::new(images.clone(), measuring.kept_bytes).in_colors(colors).with_masks(masks);
        Ok(Self { images, rejected, masks: records, files: Arc::new(files), at_once: measuring.at_once })
    }

    /// The names by which people know the photographs.
    pub(crate) fn names(&self) -> Vec<String> {
        self.images.iter().map(|image| image.name.clone()).collect()
    }

    /// What decides each photograph's pixels: its bytes, how it is turned and masked, the color space that it is brought to.
    /// `None` for files that cannot be read.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn keys(&self, context: &StageContext) -> Result<Vec<Option<KeyMaker>>> {
        let color_space = self.files.colors().map(|colors| (colors.name(), colors.icc().map(<[u8]>::to_vec)));
        let key = |index: usize| -> Result<Option<KeyMaker>> {
            context.check_cancelled()?;
            let image = &self.images[index];
            let mut maker = KeyMaker::new().part(&color_space).part(&(image.width, image.height, image.orientation));
            if let Masks { ignored: Some(ignored), .. } = self.files.masks(index) {
                maker = maker.part(&ignored.words());
            }
            Ok(std::fs::File::open(&image.path).and_then(|file| maker.file(file)).ok())
        };
        (0..self.images.len()).into_par_iter().map(key).collect()
    }
}

/// The error when no input is a photograph.
fn nothing_found(inputs: &Inputs, rejected: &[RejectedSource]) -> Error {
    if !rejected.is_empty() {
        return none_usable(rejected.iter().cloned().map(reason_of_rejected).collect());
    }
    Error::input(
        if inputs.photographs.is_empty() { "photographs".to_owned() } else { inputs.photographs.join(", ") },
        "no photographs were given",
        "Name at least two overlapping photographs, or a folder that holds them.",
    )
}
