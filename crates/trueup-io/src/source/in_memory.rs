//! Photographs that are no files: a program holds their pixels.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;

use super::rejection::Rejection;

/// Photographs whose pixels a program holds, by the names that it gives them.
///
/// Among the inputs, such a name stands for these pixels. They are taken as they are: upright, and in sRGB. Of camera,
/// focal length and orientation nothing is known.
#[derive(Clone, PartialEq, Eq, Default)]
pub struct InMemory(BTreeMap<String, Arc<Photograph>>);

impl fmt::Debug for InMemory {
    /// The names alone: pixels are many.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_set().entries(self.0.keys()).finish()
    }
}

impl InMemory {
    /// Adds a photograph of this name, in place of an earlier one of the same name.
    pub fn insert(&mut self, name: impl Into<String>, photograph: Photograph) {
        self.0.insert(name.into(), Arc::new(photograph));
    }

    /// The photograph of this name.
    pub fn get(&self, name: &str) -> Option<&Arc<Photograph>> {
        self.0.get(name)
    }

    /// The photograph that a source stands for, if it is no file.
    pub fn of(&self, source: &SourceImage) -> Option<&Arc<Photograph>> {
        self.get(source.path.to_str()?)
    }
}

/// What is known of a photograph in memory that goes by `path`.
pub(super) fn in_memory_source(path: PathBuf, name: &str, photograph: &Photograph) -> Result<SourceImage, Rejection> {
    refuse_name_of_a_file(&path)?;
    Ok(SourceImage::unknown(path, name, [photograph.width(), photograph.height()]))
}

/// A photograph goes by its name wherever its file is asked for what it says of itself: that of another would answer.
fn refuse_name_of_a_file(path: &Path) -> Result<(), Rejection> {
    match path.exists() {
        true => Err(Rejection::new(
            "name-of-a-file",
            "it is in memory, and there is a file of its name",
            "Give what is in memory another name.",
        )),
        false => Ok(()),
    }
}
