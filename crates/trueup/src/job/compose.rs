//! From a project to a file: a recorded panorama is composed again.

use std::path::{Path, PathBuf};

use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};

use super::masks::{AllMasks, MaskFile, MaskRecord};
use super::outputs::{Outputs, ReadFile};
use super::threads::thread_pool;
use super::write::Written;
use crate::options::StitchOptions;
use crate::pipeline::{Alignment, Stitcher};
use crate::pipeline::photographs::FoundPhotographs;
use crate::project::read::Recorded;
use crate::project::record::{ImageRecord, Project};
use crate::project::replace::{other_photographs, recorded_photographs};

/// Which recorded panorama to compose, of which photographs, and where to put it.
///
/// ```
/// use trueup::{ComposeJob, Inputs, Outputs, StageContext, StitchJob, StitchOptions};
/// # let room = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");
/// # let desk = tempfile::tempdir()?;
/// # let context = StageContext::default();
/// # let mut options = StitchOptions::default();
/// # options.set("canvas.scale=0.1")?;
/// # let outputs = Outputs::new(desk.path().join("room.jpg"));
/// # let job = StitchJob { inputs: Inputs::new([room]), outputs, cache: None, threads: 0 };
/// let project = job.run(&options, &context)?.remove(0).project;
/// // The same geometry on another projection: nothing is measured, matched or aligned again.
/// let mut options = project.options.clone();
/// options.set("projection.kind=equirectangular")?;
/// let job = ComposeJob {
///     project,
///     project_folder: desk.path().to_owned(),
///     photographs: None,
///     masks: Vec::new(),
///     outputs: Outputs::new(desk.path().join("round.png")),
///     threads: 0,
/// };
/// assert!(job.run(&options, &context)?.project.projection.is_some());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ComposeJob {
    /// The record of a stitch.
    pub project: Project,
    /// The folder that the project's file lies in: recorded paths are looked up there first, then from the current folder.
    pub project_folder: PathBuf,
    /// A folder with other photographs of the same names (whatever their extensions) and sizes, to be shown instead.
    pub photographs: Option<PathBuf>,
    /// Pictures that mark what is to be ignored or kept, in place of the recorded ones of the photographs they name.
    pub masks: Vec<MaskFile>,
    /// The files to be written; of the side outputs, the project is the new panorama's own record.
    pub outputs: Outputs,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
}

impl ComposeJob {
    /// Runs the job: nothing is measured or matched, the geometry is the recorded one. With the recorded options and
    /// photographs, the panorama is the very one that was stitched.
    ///
    /// # Errors
    /// [`trueup_core::Error::Options`]; [`trueup_core::Error::Unsupported`] if an option of the geometry differs from the recorded one;
    /// [`trueup_core::Error::Input`] if the project was damaged, or photographs are missing or have other sizes; those of composing and
    /// writing; [`trueup_core::Error::Cancelled`].
    pub fn run(&self, options: &StitchOptions, context: &StageContext) -> Result<Written> {
        options.validate()?;
        options.refuse_other_geometry(&self.project.options)?;
        // Before files are looked for: a project that was edited to nonsense names itself.
        Recorded::new(&self.project)?;
        self.outputs.check(options)?;
        self.outputs.refuse_over(self.masks.iter().map(|mask| (mask.file.as_path(), ReadFile::Mask)))?;
        thread_pool(self.threads)?.install(|| {
            let stitcher = Stitcher::new(options, context);
            let images = self.find_photographs(options, context)?;
            let alignment = stitcher.recorded(&self.project, &self.project_folder, images, &self.masks)?;
            self.outputs.write(&stitcher, alignment)
        })
    }

    fn find_photographs(&self, options: &StitchOptions, context: &StageContext) -> Result<Vec<SourceImage>> {
        let records: Vec<&ImageRecord> = self.project.used_images().collect();
        match &self.photographs {
            Some(folder) => other_photographs(&records, folder, &options.measure.source, context),
            None => recorded_photographs(&records, &self.project_folder, &options.measure.source, context),
        }
    }
}

impl Stitcher<'_> {
    /// The geometry that `project` records, over its own photographs and masks, ready to be composed or rearranged. Their
    /// recorded paths are looked up in `project_folder` first, then from the current folder.
    ///
    /// # Errors
    /// [`trueup_core::Error::Options`]; [`trueup_core::Error::Unsupported`] if an option of the geometry differs from the
    /// recorded one; [`trueup_core::Error::Input`] if the project was damaged, or photographs or masks are missing or have
    /// other sizes; those of the layout; [`trueup_core::Error::Cancelled`].
    pub fn reopen(&self, project: &Project, project_folder: &Path) -> Result<Alignment> {
        self.options().validate()?;
        self.options().refuse_other_geometry(&project.options)?;
        Recorded::new(project)?;
        let records: Vec<&ImageRecord> = project.used_images().collect();
        let accepted = &self.options().measure.source;
        let images = recorded_photographs(&records, project_folder, accepted, self.context())?;
        self.recorded(project, project_folder, images, &[])
    }

    /// The recorded geometry over `images`, with these masks in place of the recorded ones of the photographs they name.
    fn recorded(
        &self,
        project: &Project,
        project_folder: &Path,
        images: Vec<SourceImage>,
        masks: &[MaskFile],
    ) -> Result<Alignment> {
        let accepted = &self.options().measure.source;
        let mut masks = AllMasks::read(masks, &images, accepted, self.context())?;
        let recorded: Vec<&[MaskRecord]> = project.used_images().map(|one| one.masks.as_slice()).collect();
        masks.recall(&recorded, &images, project_folder, accepted, self.context())?;
        self.recall(project, FoundPhotographs { images, masks, ..FoundPhotographs::default() })
    }
}
