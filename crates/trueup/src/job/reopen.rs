//! A recorded panorama over its photographs, ready to be composed or looked at.

use std::path::Path;

use trueup_core::Result;
use trueup_core::source::SourceImage;
use trueup_io::source::InMemory;

use crate::inputs::{AllMasks, MaskFile};
use crate::pipeline::light::WantedLight;
use crate::pipeline::photographs::FoundPhotographs;
use crate::pipeline::{Alignment, Stitcher};
use crate::project::record::{ImageRecord, MaskRecord, Project};
use crate::project::replace::{other_photographs, recorded_photographs};

/// A recorded panorama, and where its photographs are.
#[derive(Debug, Clone, Copy)]
pub struct RecordedPanorama<'a> {
    /// The record of a stitch.
    pub project: &'a Project,
    /// The folder that the project's file lies in: recorded paths are looked up there first, then from the current
    /// folder.
    pub project_folder: &'a Path,
    /// A folder with other photographs of the same names (whatever their extensions) and sizes, to be shown instead.
    pub photographs: Option<&'a Path>,
    /// Pictures that mark what is to be ignored or kept, in place of the recorded ones of the photographs they name.
    pub masks: &'a [MaskFile],
}

impl Stitcher<'_> {
    /// The geometry of a recorded panorama over its photographs, arranged by this stitcher's options. Nothing is
    /// measured or matched.
    ///
    /// # Errors
    /// [`trueup_core::Error::Options`]; [`trueup_core::Error::Unsupported`] if an option of the geometry differs from
    /// the recorded one; [`trueup_core::Error::Input`] if the project was damaged, or photographs are missing or have
    /// other sizes; those of the layout; [`trueup_core::Error::Cancelled`].
    pub fn reopen(&self, recorded: &RecordedPanorama) -> Result<Alignment> {
        let (options, context) = (self.options(), self.context());
        let project = recorded.project;
        options.refuse_other_geometry(&project.options)?;
        let images = find_photographs(recorded, self)?;
        let mut masks =
            AllMasks::read(recorded.masks, &InMemory::default(), &images, &options.measure.source, context)?;
        let known: Vec<&[MaskRecord]> = project.used_images().map(|one| one.masks.as_slice()).collect();
        masks.recall(&known, &images, recorded.project_folder, &options.measure.source, context)?;
        // Other photographs may be of other light.
        let light = match (project.light, recorded.photographs) {
            (None, Some(_)) => WantedLight::Surveyed,
            (light, _) => WantedLight::Known(light),
        };
        self.recall(project, FoundPhotographs { images, masks, light, ..FoundPhotographs::default() }, None)
    }
}

fn find_photographs(recorded: &RecordedPanorama, stitcher: &Stitcher) -> Result<Vec<SourceImage>> {
    let records: Vec<&ImageRecord> = recorded.project.used_images().collect();
    let (accepted, context) = (&stitcher.options().measure.source, stitcher.context());
    match recorded.photographs {
        Some(folder) => other_photographs(&records, folder, accepted, context),
        None => recorded_photographs(&records, recorded.project_folder, accepted, context),
    }
}
