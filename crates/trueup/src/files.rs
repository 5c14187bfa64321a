//! From photographs to files: the whole job with its outputs.

use std::path::{Path, PathBuf};
use std::time::Instant;

use trueup_core::{Error, Result, StageContext};
use trueup_io::{encode, source};

use crate::cache::Cache;
use crate::inputs::Inputs;
use crate::options::StitchOptions;
use crate::outputs::Outputs;
use crate::project::Project;
use crate::pto::hugin_project;
use crate::stitcher::{Alignment, Stitcher};

/// What to stitch and where to put it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StitchJob {
    /// The photographs.
    pub inputs: Inputs,
    /// The panorama's file; its extension chooses the format. With [`Inputs::all`] and several panoramas, they are
    /// numbered: `pano-1.jpg`, `pano-2.jpg`.
    pub output: PathBuf,
    /// The project's file, if wanted; numbered like the panoramas.
    pub project: Option<PathBuf>,
    /// A folder for results that later runs can use, see [`Cache`]; made if it is not there.
    pub cache: Option<PathBuf>,
    /// A file for the cameras as a Hugin project, if wanted; numbered like the panoramas.
    pub hugin_project: Option<PathBuf>,
    /// A TIFF for the photographs as layers, if wanted; numbered like the panoramas.
    pub layers: Option<PathBuf>,
    /// A PNG for what photograph is shown where, if wanted; numbered like the panoramas.
    pub seams: Option<PathBuf>,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
}

/// A panorama that was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// The panorama's file.
    pub output: PathBuf,
    /// Its size in bytes.
    pub bytes: u64,
    /// The project's file, if one was wanted.
    pub project_file: Option<PathBuf>,
    /// The record.
    pub project: Project,
}

impl StitchJob {
    /// Runs the job. Outputs are checked before work starts, written beside their place and renamed.
    ///
    /// # Errors
    /// Those of [`Stitcher::align`] and [`Stitcher::compose`], and those of writing; [`Error::Input`] if the output is one
    /// of the photographs. Panoramas already written stay.
    pub fn run(&self, options: &StitchOptions, context: &StageContext) -> Result<Vec<Written>> {
        options.validate()?;
        self.outputs().check(options)?;
        self.spare_inputs(&self.outputs())?;
        let cache = self.cache.as_ref().map(|folder| Cache::open(folder, &options.cache)).transpose()?;
        thread_pool(self.threads)?.install(|| self.stitch(options, cache.as_ref(), context))
    }

    fn stitch(&self, options: &StitchOptions, cache: Option<&Cache>, context: &StageContext) -> Result<Vec<Written>> {
        let stitcher = Stitcher::new(options, context).with_cache(cache);
        let aligned = stitcher.align(&self.inputs)?;
        let count = aligned.alignments.len();
        let outputs: Vec<Outputs> =
            (1..=count).map(|number| self.outputs().numbered((count > 1).then_some(number))).collect();
        // Not before now is it known how many there are: the last panorama is not to fail when the others are made.
        for outputs in outputs.iter().filter(|_| count > 1) {
            outputs.check(options)?;
            self.spare_inputs(outputs)?;
        }
        let all = aligned.alignments.into_iter().zip(outputs);
        all.map(|(alignment, outputs)| render_and_write(&stitcher, alignment, outputs)).collect()
    }

    /// Refuses outputs that are among the inputs, before the inputs are looked into.
    fn spare_inputs(&self, outputs: &Outputs) -> Result<()> {
        let photographs = source::files(&self.inputs.photographs);
        outputs
            .spare(photographs.iter().map(PathBuf::as_path), self.inputs.masks.iter().map(|mask| mask.file.as_path()))
    }

    fn outputs(&self) -> Outputs {
        Outputs {
            panorama: self.output.clone(),
            project: self.project.clone(),
            hugin_project: self.hugin_project.clone(),
            layers: self.layers.clone(),
            seams: self.seams.clone(),
        }
    }
}

/// A pool of `threads` threads; 0 for one per core.
pub(crate) fn thread_pool(threads: usize) -> Result<rayon::ThreadPool> {
    let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    built.map_err(|error| Error::input("threads", error, "Ask for fewer threads."))
}

/// Composes an aligned panorama and writes it and what is wanted beside it.
pub(crate) fn render_and_write(stitcher: &Stitcher<'_>, mut alignment: Alignment, outputs: Outputs) -> Result<Written> {
    outputs.spare(alignment.project.images.iter().map(|image| Path::new(&image.path)), [])?;
    let Outputs { panorama: output, project: project_file, hugin_project: pto, layers, seams } = outputs;
    let (options, context) = (stitcher.options(), stitcher.context());
    let start = Instant::now();
    let rendered = Stitcher::new(options, context).writing_to(&output).compose(&alignment)?;
    alignment.record_seconds("render", start.elapsed());
    let start = Instant::now();
    let output_options = stitcher.output_options(&alignment, &output)?;
    let bytes = encode::write(&output, &rendered.panorama, &stitcher.metadata(&alignment), &output_options, context)?;
    if let Some(path) = &seams {
        stitcher.write_seams(&alignment, &rendered, path)?;
    }
    drop(rendered);
    if let Some(path) = &layers {
        stitcher.write_layers(&alignment, path)?;
    }
    alignment.record_seconds("output", start.elapsed());
    alignment.record_findings(context.take_diagnostics());
    let project = alignment.project;
    if let Some(path) = &project_file {
        encode::write_atomically(path, project.to_json()?.as_bytes())?;
    }
    if let Some(path) = &pto {
        encode::write_atomically(path, hugin_project(&project)?.as_bytes())?;
    }
    Ok(Written { output, bytes, project_file, project })
}
