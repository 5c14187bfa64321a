//! From photographs to files: the whole job with its outputs.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Result, StageContext};
use trueup_io::encode;

use super::developed::with_developed;
use super::made::{WithMade, settle};
use super::outputs::{Outputs, ReadFile};
use super::threads::thread_pool;
use super::video::with_frames;
use super::write::Written;
use crate::inputs::Inputs;
use crate::memo::PhotographCache;
use crate::options::StitchOptions;
use crate::pipeline::Stitcher;

/// What to stitch and where to put it.
///
/// ```
/// use trueup::{Inputs, Outputs, SideOutput, StageContext, StitchJob, StitchOptions};
/// # let room = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");
/// # let desk = tempfile::tempdir()?;
/// let mut options = StitchOptions::default();
/// options.set("canvas.scale=0.1")?;
/// let outputs = Outputs::new(desk.path().join("room.jpg")).with(SideOutput::Project, desk.path().join("room.json"));
/// let job = StitchJob { inputs: Inputs::new([room]), outputs, cache: None, threads: 0 };
/// let written = job.run(&options, &StageContext::default())?;
/// assert_eq!(written[0].project.used(), 5);
/// assert!(desk.path().join("room.jpg").is_file() && desk.path().join("room.json").is_file());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StitchJob {
    /// The photographs.
    pub inputs: Inputs,
    /// The files to be written. With [`Inputs::all`] and several panoramas, they are numbered.
    pub outputs: Outputs,
    /// A folder for results that later runs can use, see [`PhotographCache`]; made if it is not there.
    pub cache: Option<PathBuf>,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
}

impl StitchJob {
    /// Runs the job. Outputs are checked before work starts, written beside their place and renamed. Of videos that
    /// [`Inputs::photographs`] names, the frames that are needed are taken out into a folder beside the panorama;
    /// camera raw is developed into another, where a program that does so is installed. These folders take their places
    /// when a panorama is written.
    ///
    /// # Errors
    /// Those of [`Stitcher::align`] and [`Stitcher::compose`], and those of writing; [`trueup_core::Error::Input`] if
    /// the output is one of the photographs, or a folder that is made beside it would replace other files. Panoramas
    /// already written stay.
    pub fn run(&self, options: &StitchOptions, context: &StageContext) -> Result<Vec<Written>> {
        options.validate()?;
        self.check(&self.outputs, options)?;
        let max_bytes = options.run.resources.cache_bytes;
        let cache = self.cache.as_ref().map(|folder| PhotographCache::open(folder, max_bytes)).transpose()?;
        thread_pool(self.threads)?.install(|| self.stitch(options, cache.as_ref(), context))
    }

    fn stitch(
        &self,
        options: &StitchOptions,
        cache: Option<&PhotographCache>,
        context: &StageContext,
    ) -> Result<Vec<Written>> {
        let mut inputs = Cow::Borrowed(&self.inputs);
        let (mut told, mut folders) = (Vec::new(), Vec::new());
        for replaced in [with_frames, with_developed] {
            if let Some(WithMade { inputs: new, told: said, made }) = replaced(&inputs, &self.outputs, context)? {
                inputs = Cow::Owned(new);
                told.extend(said);
                folders.extend(made);
            }
        }
        let stitcher = Stitcher::new(options, context).with_cache(cache);
        let stitcher = stitcher.writing_to(&self.outputs.panorama);
        let mut aligned = stitcher.align(&inputs)?;
        let count = aligned.alignments.len();
        let outputs: Vec<Outputs> =
            (1..=count).map(|number| self.outputs.numbered((count > 1).then_some(number))).collect();
        // Not before now is it known how many there are: the last panorama is not to fail when the others are made.
        self.outputs.refuse_several(count)?;
        for outputs in outputs.iter().filter(|_| count > 1) {
            self.check(outputs, options)?;
        }
        // What one of several panoramas cannot have is refused before any is made.
        for (alignment, outputs) in aligned.alignments.iter().zip(&outputs) {
            outputs.check_records(&alignment.project)?;
        }
        let stale = if self.inputs.all { self.outputs.stale(count) } else { Vec::new() };
        if let Some(first) = aligned.alignments.first_mut() {
            first.project.diagnostics.extend(told);
            first.project.diagnostics.extend(stale.iter().map(|path| stale_panorama(path, count)));
        }
        let all = aligned.alignments.into_iter().zip(&outputs);
        if folders.is_empty() {
            return all.map(|(alignment, outputs)| outputs.write(&stitcher, alignment)).collect();
        }
        // What was made is read where it is now until the last panorama is written, and recorded where it will be:
        // records come last.
        let mut written = Vec::new();
        let whole = all.into_iter().try_for_each(|(alignment, outputs)| {
            written.push(outputs.write_pictures(&stitcher, alignment)?);
            Ok(())
        });
        let recorded = settle(folders, &mut written).and_then(|()| written.iter().try_for_each(Written::write_records));
        whole.and(recorded).map(|()| written)
    }

    /// Refuses outputs that cannot be written, or are among the inputs, before the inputs are looked into.
    fn check(&self, outputs: &Outputs, options: &StitchOptions) -> Result<()> {
        outputs.check(options)?;
        let photographs = self.inputs.files();
        if self.inputs.all {
            // No more panoramas than photographs: the longest names that may come.
            outputs.numbered(Some(photographs.len())).files().try_for_each(encode::check_name)?;
        }
        let photographs = photographs.iter().map(|path| (path.as_path(), ReadFile::Photograph));
        let masks = self.inputs.masks.iter().map(|mask| (mask.file.as_path(), ReadFile::Mask));
        let graph = self.inputs.graph.iter().map(|path| (path.as_path(), ReadFile::Graph));
        let lens = self.inputs.lens_from.iter().map(|path| (path.as_path(), ReadFile::Lens));
        outputs.refuse_over(photographs.chain(masks).chain(graph).chain(lens))
    }
}

/// Says that a file is no panorama of this run though it is numbered like one; nobody's file is deleted.
fn stale_panorama(path: &Path, count: usize) -> Diagnostic {
    let made = if count == 1 { "1 panorama".to_owned() } else { format!("{count} panoramas") };
    Diagnostic::warning(
        "stale-panorama",
        Subject::file(path.display()),
        format!("it is a panorama of an earlier run; this one made {made}"),
        "Remove it if it is not wanted.",
    )
}
