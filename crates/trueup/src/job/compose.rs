//! From a project to a file: a recorded panorama is composed again.

use std::path::PathBuf;

use trueup_core::{Result, StageContext};

use super::outputs::{Outputs, ReadFile};
use super::reopen::RecordedPanorama;
use super::threads::thread_pool;
use super::write::Written;
use crate::inputs::{Inputs, MaskFile};
use crate::options::StitchOptions;
use crate::pipeline::Stitcher;
use crate::project::paths::place_of;
use crate::project::read::Recorded;
use crate::project::record::Project;

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
    /// The folder that the project's file lies in: recorded paths are looked up there first, then from the current
    /// folder.
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
    /// [`trueup_core::Error::Options`]; [`trueup_core::Error::Unsupported`] if an option of the geometry differs from
    /// the recorded one; [`trueup_core::Error::Input`] if the project was damaged, photographs are missing or have
    /// other sizes, or an output is one of the files that are read or recorded; those of composing and writing;
    /// [`trueup_core::Error::Cancelled`].
    pub fn run(&self, options: &StitchOptions, context: &StageContext) -> Result<Written> {
        options.validate()?;
        options.refuse_other_geometry(&self.project.options)?;
        // Before files are looked for: a project that was edited to nonsense names itself.
        Recorded::new(&self.project)?;
        self.outputs.check(options)?;
        self.refuse_over_read()?;
        thread_pool(self.threads)?.install(|| {
            let stitcher = Stitcher::new(options, context);
            let recorded = RecordedPanorama {
                project: &self.project,
                project_folder: &self.project_folder,
                photographs: self.photographs.as_deref(),
                masks: &self.masks,
            };
            self.outputs.write(&stitcher, stitcher.reopen(&recorded)?)
        })
    }

    /// Refuses outputs that are among what is read, or among what the panorama was stitched of, though others may be
    /// shown instead.
    fn refuse_over_read(&self) -> Result<()> {
        let masks = self.masks.iter().map(|mask| (mask.file.as_path(), ReadFile::Mask));
        let others = self.photographs.iter().map(|folder| folder.display().to_string());
        let others = Inputs::new(others).files();
        let others = others.iter().map(|path| (path.as_path(), ReadFile::Photograph));
        self.outputs.refuse_over(masks.chain(others))?;
        self.outputs.refuse_over_recorded(&self.project, |path| place_of(path, &self.project_folder))
    }
}
