//! Masks by the photographer: from names and files to marks on photographs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use trueup_core::mask::{Mask, Masks};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result, StageContext};
use trueup_io::decode;
use trueup_io::source::{InMemory, SourceOptions};

use super::names::photograph_named;
use crate::project::paths::place_of;
use crate::project::record::{MaskKind, MaskRecord};

/// A picture that marks parts of a photograph.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MaskFile {
    /// The photograph's name, or path as given.
    pub photograph: String,
    /// The picture, in the size of the photograph as it is shown: a file, or the name of one in memory
    /// ([`Inputs::in_memory`](crate::Inputs::in_memory)).
    pub file: PathBuf,
    /// What it means.
    pub kind: MaskKind,
}

/// The masks of every photograph.
#[derive(Debug, Clone, Default)]
pub(crate) struct AllMasks {
    /// By photograph.
    pub masks: Vec<Masks>,
    /// What is recorded of them, by photograph.
    pub records: Vec<Vec<MaskRecord>>,
}

impl AllMasks {
    /// Reads the masks that `files` name, of any of `images`; names of pictures in memory come before files. Several of
    /// one kind on one photograph count together.
    ///
    /// # Errors
    /// [`Error::Input`] if a photograph is not there or a mask cannot be read or has another size;
    /// [`Error::Cancelled`].
    pub(crate) fn read(
        files: &[MaskFile],
        in_memory: &InMemory,
        images: &[SourceImage],
        options: &SourceOptions,
        context: &StageContext,
    ) -> Result<Self> {
        let mut all = Self { masks: vec![Masks::default(); images.len()], records: vec![Vec::new(); images.len()] };
        for one in files {
            let position = photograph_named(images, &one.photograph, "so nothing of it can be masked")?;
            let path = one.file.display().to_string();
            let white = match in_memory.get(&path) {
                Some(picture) => decode::mask_in_memory(picture, &path, &images[position])?,
                None => decode::mask(&one.file, &images[position], options, context)?,
            };
            all.add(position, white, MaskRecord { path, kind: one.kind });
        }
        Ok(all)
    }

    /// Reads the masks that a project recorded of the photographs `images`, in their order; they are looked up as
    /// photographs are: beside the project file as recorded, as recorded from the current folder, or beside the project
    /// file by their names alone.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub(crate) fn recall(
        &mut self,
        recorded: &[&[MaskRecord]],
        images: &[SourceImage],
        project_folder: &Path,
        options: &SourceOptions,
        context: &StageContext,
    ) -> Result<()> {
        for (position, (records, image)) in recorded.iter().zip(images).enumerate() {
            // Masks given anew stand in place of the recorded ones of that photograph.
            if !self.records[position].is_empty() {
                continue;
            }
            for record in *records {
                let file = place_of(&record.path, project_folder).ok_or_else(|| {
                    Error::input(
                        &record.path,
                        format!("this mask of {} is not there", image.name),
                        "Put it back, or give another mask of this photograph with --mask or --keep.",
                    )
                })?;
                let white = decode::mask(&file, image, options, context)?;
                self.add(position, white, MaskRecord { path: file.display().to_string(), kind: record.kind });
            }
        }
        Ok(())
    }

    fn add(&mut self, position: usize, white: Mask, record: MaskRecord) {
        let masks = &mut self.masks[position];
        match record.kind {
            MaskKind::Use => merge(&mut masks.ignored, white.inverted()),
            MaskKind::Keep => merge(&mut masks.kept, white),
        }
        self.records[position].push(record);
    }
}

fn merge(known: &mut Option<Arc<Mask>>, more: Mask) {
    *known = Some(Arc::new(match known.take() {
        Some(known) => more.or(&known),
        None => more,
    }));
}
