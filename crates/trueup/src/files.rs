//! From photographs to files: the whole job with its outputs.

use std::path::{Path, PathBuf};
use std::time::Instant;

use trueup_compose::render::Blend;
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode;

use crate::by_hand::no_seams;
use crate::cache::Cache;
use crate::inputs::Inputs;
use crate::options::StitchOptions;
use crate::project::{ImageRecord, Project};
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
        let cache = self.cache.as_ref().map(|folder| Cache::open(folder, &options.cache)).transpose()?;
        thread_pool(self.threads)?.install(|| self.stitch(options, cache.as_ref(), context))
    }

    fn stitch(&self, options: &StitchOptions, cache: Option<&Cache>, context: &StageContext) -> Result<Vec<Written>> {
        let stitcher = Stitcher::new(options, context).with_cache(cache);
        let aligned = stitcher.align(&self.inputs)?;
        let several = aligned.alignments.len() > 1;
        let mut written = Vec::new();
        for (index, alignment) in aligned.alignments.into_iter().enumerate() {
            let number = several.then_some(index + 1);
            written.push(render_and_write(&stitcher, alignment, self.outputs().numbered(number))?);
        }
        Ok(written)
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

/// The files that one panorama is written to; all but the first if wanted.
#[derive(Debug, Clone)]
pub(crate) struct Outputs {
    pub panorama: PathBuf,
    pub project: Option<PathBuf>,
    pub hugin_project: Option<PathBuf>,
    pub layers: Option<PathBuf>,
    pub seams: Option<PathBuf>,
}

impl Outputs {
    /// Refuses before work starts what could not be written when it is done.
    pub fn check(&self, options: &StitchOptions) -> Result<()> {
        encode::check_writable(&self.panorama, &options.output)?;
        if let Some(layers) = &self.layers {
            encode::check_layers_place(layers)?;
        }
        if let Some(seams) = &self.seams {
            encode::check_labels_place(seams)?;
            if !matches!(options.render.blend, Blend::MultiBand | Blend::None) {
                return Err(no_seams());
            }
        }
        [&self.project, &self.hugin_project].into_iter().flatten().try_for_each(|side| encode::check_place(side))
    }

    fn numbered(self, number: Option<usize>) -> Self {
        let side = |path: Option<PathBuf>| path.map(|path| numbered(&path, number));
        Self {
            panorama: numbered(&self.panorama, number),
            project: side(self.project),
            hugin_project: side(self.hugin_project),
            layers: side(self.layers),
            seams: side(self.seams),
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
    let Outputs { panorama: output, project: project_file, hugin_project: pto, layers, seams } = outputs;
    for path in [Some(&output), layers.as_ref(), seams.as_ref()].into_iter().flatten() {
        spare_photographs(path, &alignment.project)?;
    }
    let (options, context) = (stitcher.options(), stitcher.context());
    let start = Instant::now();
    let panorama = Stitcher::new(options, context).writing_to(&output).compose(&alignment)?;
    alignment.record_seconds("render", start.elapsed());
    let start = Instant::now();
    let output_options = stitcher.output_options(&alignment, &output)?;
    let bytes = encode::write(&output, &panorama, &stitcher.metadata(&alignment), &output_options, context)?;
    if let Some(path) = &seams {
        stitcher.write_seams(&alignment, &panorama, path)?;
    }
    drop(panorama);
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

/// `pano.jpg` becomes `pano-2.jpg`.
fn numbered(path: &Path, number: Option<usize>) -> PathBuf {
    let Some(number) = number else { return path.to_owned() };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(extension) => format!("{stem}-{number}.{}", extension.to_string_lossy()),
        None => format!("{stem}-{number}"),
    };
    path.with_file_name(name)
}

/// Refuses to write a panorama over one of the photographs, which may be the only copy. An older panorama in the folder
/// of the photographs is met here, too.
fn spare_photographs(output: &Path, project: &Project) -> Result<()> {
    let Ok(existing) = output.canonicalize() else { return Ok(()) };
    let is_output = |image: &&ImageRecord| Path::new(&image.path).canonicalize().is_ok_and(|path| path == existing);
    match project.images.iter().find(is_output) {
        None => Ok(()),
        Some(_) => Err(Error::input(
            output.display(),
            "this file is one of the photographs to be stitched",
            "Give the panorama another name or folder, or move an older panorama away from the photographs.",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_panoramas_are_numbered_before_the_extension() {
        assert_eq!(numbered(Path::new("out/pano.jpg"), Some(2)), Path::new("out/pano-2.jpg"));
        assert_eq!(numbered(Path::new("pano"), Some(1)), Path::new("pano-1"));
        assert_eq!(numbered(Path::new("pano.jpg"), None), Path::new("pano.jpg"));
    }
}
