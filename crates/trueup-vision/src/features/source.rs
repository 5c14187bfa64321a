//! Where matching gets photographs' features from.

use std::borrow::Cow;
use std::fmt::Debug;

use trueup_core::{Error, Result};

use super::feature::Features;

/// The features of photographs that are numbered from 0, wherever they are kept: in memory, or where there is more
/// room.
pub trait FeatureSource: Debug + Sync {
    /// How many photographs there are.
    fn photographs(&self) -> usize;

    /// The features of one.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no such photograph; [`Error::Io`] if they cannot be read.
    fn features(&self, photograph: usize) -> Result<Cow<'_, Features>>;

    /// Whether a photograph has descriptors.
    fn has_features(&self, photograph: usize) -> bool;
}

impl<T: AsRef<[Features]> + Debug + Sync> FeatureSource for T {
    fn photographs(&self) -> usize {
        self.as_ref().len()
    }

    fn features(&self, photograph: usize) -> Result<Cow<'_, Features>> {
        self.as_ref().get(photograph).map(Cow::Borrowed).ok_or_else(|| no_photograph(photograph))
    }

    fn has_features(&self, photograph: usize) -> bool {
        self.as_ref().get(photograph).is_some_and(|features| !features.descriptors.is_empty())
    }
}

/// What a [`FeatureSource`] says of a number that no photograph has.
pub fn no_photograph(photograph: usize) -> Error {
    Error::input(
        format!("photograph {photograph}"),
        "a pair names it but it is not there",
        "Pairs may only name the photographs given.",
    )
}
