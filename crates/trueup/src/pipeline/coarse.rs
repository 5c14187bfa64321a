//! What is coarse in photographs, for those that are looked at again: found when it is asked for, from what is kept of
//! them.

use std::borrow::Cow;
use std::fmt;
use std::sync::OnceLock;

use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_vision::features::{FeatureOptions, FeatureSource, Features, detect_coarse, no_photograph};

use super::outside::features_outside;
use super::shelf::{FeaturesOnShelf, Shelf, ShelvedFeatures};

/// The coarse features of photographs.
pub(crate) struct CoarseFeatures<'a> {
    fine: &'a FeaturesOnShelf<'a>,
    frames: &'a [WorkingFrame],
    /// The photographs, of which parts are not looked at.
    files: &'a FilePhotographs,
    /// Where those that were found go.
    shelf: &'a Shelf<'a>,
    options: &'a FeatureOptions,
    context: &'a StageContext<'a>,
    found: Vec<OnceLock<ShelvedFeatures>>,
}

/// What coarse features are found from.
pub(crate) struct CoarseInput<'a> {
    pub fine: &'a FeaturesOnShelf<'a>,
    pub frames: &'a [WorkingFrame],
    pub files: &'a FilePhotographs,
    pub shelf: &'a Shelf<'a>,
    pub options: &'a FeatureOptions,
}

impl<'a> CoarseFeatures<'a> {
    /// Of photographs none of which was asked for yet.
    pub(crate) fn new(input: CoarseInput<'a>, context: &'a StageContext<'a>) -> Self {
        let CoarseInput { fine, frames, files, shelf, options } = input;
        let found = (0..fine.photographs()).map(|_| OnceLock::new()).collect();
        Self { fine, frames, files, shelf, options, context, found }
    }

    /// Those of one photograph outside of what is not looked at.
    fn find(&self, photograph: usize) -> Result<ShelvedFeatures> {
        self.context.check_cancelled()?;
        let fine = self.fine.features(photograph)?;
        let frame = self.frames.get(photograph).ok_or_else(|| no_photograph(photograph))?;
        let mut coarse = detect_coarse(&fine, self.options, self.context)?;
        if let Some(ignored) = self.files.not_looked_at(photograph) {
            coarse = features_outside(&coarse, &ignored, frame);
        }
        Ok(self.shelf.put(coarse))
    }
}

impl fmt::Debug for CoarseFeatures<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("CoarseFeatures").field("found", &self.found).finish_non_exhaustive()
    }
}

impl FeatureSource for CoarseFeatures<'_> {
    fn photographs(&self) -> usize {
        self.found.len()
    }

    fn features(&self, photograph: usize) -> Result<Cow<'_, Features>> {
        let place = self.found.get(photograph).ok_or_else(|| no_photograph(photograph))?;
        let found = match place.get() {
            Some(found) => found,
            None => {
                // Not while the place is locked: what a waiting thread takes on meanwhile may ask for the same.
                let found = self.find(photograph)?;
                place.get_or_init(|| found)
            }
        };
        found.get()
    }

    fn has_features(&self, photograph: usize) -> bool {
        self.features(photograph).is_ok_and(|features| !features.descriptors.is_empty())
    }
}
