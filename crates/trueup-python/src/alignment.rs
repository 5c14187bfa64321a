//! The geometry of a panorama, to be composed once or often.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use trueup::{Error, Inputs, PhotographCache, RecordedPanorama, StageContext, StitchOptions, Stitcher};

use crate::errors::exception;
use crate::keywords::Wishes;
use crate::panorama::Panorama;
use crate::photographs::{GivenPhotograph, collected};
use crate::work::{Surroundings, run};
use crate::workers::Handing;

/// The geometry of one panorama, ready to be composed.
#[pyclass(frozen, module = "trueup._trueup")]
#[derive(Debug)]
pub(crate) struct Alignment {
    alignment: trueup::Alignment,
    options: StitchOptions,
    threads: usize,
}

/// Finds, measures, matches and aligns photographs: one alignment for the largest group of photographs that overlap, or
/// with `all` one for each, the largest first. `progress` is called with a stage's name, the steps done, and how many
/// there are; `workers` with what tasks have in common and with these, and gives their numbers and results.
#[pyfunction]
pub(crate) fn align<'py>(
    py: Python<'py>,
    photographs: Vec<GivenPhotograph<'py>>,
    keywords: &Bound<'py, PyDict>,
    all: bool,
    progress: Option<Bound<'py, PyAny>>,
    workers: Option<Bound<'py, PyAny>>,
) -> PyResult<Vec<Alignment>> {
    let wishes = Wishes::of(keywords, "stitch", StitchOptions::default())?;
    let (photographs, mut in_memory) = collected(photographs)?;
    let Wishes { options, reference, graph, lens_from, require_all, masks, mask_pictures, cache, threads } = wishes;
    for (name, picture) in mask_pictures {
        in_memory.insert(name, picture);
    }
    let inputs =
        Inputs { photographs, in_memory, reference, graph, lens_from, all, masks, require_all, ..Inputs::default() };
    let handing = Handing::new(workers);
    let aligned = run(py, Surroundings { progress, threads }, |context| {
        let max_bytes = options.run.resources.cache_bytes;
        let cache = cache.map(|folder| PhotographCache::open(&folder, max_bytes)).transpose()?;
        let stitcher = Stitcher::new(&options, context).with_cache(cache.as_ref());
        stitcher.with_workers(Handing::workers(handing.as_ref())).align(&inputs)
    });
    let aligned = Handing::outcome(handing, aligned)?;
    let one = |alignment| Alignment { alignment, options: options.clone(), threads };
    Ok(aligned.alignments.into_iter().map(one).collect())
}

/// The geometry of the panorama that the project file at `path` records, over its photographs, or those of the same
/// names in the folder `photographs`. With `relight`, the light of these is evened out anew.
#[pyfunction]
pub(crate) fn open_project<'py>(
    py: Python<'py>,
    path: PathBuf,
    photographs: Option<PathBuf>,
    relight: bool,
    keywords: &Bound<'py, PyDict>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Alignment> {
    let mut project = trueup::read_project(&path, &StageContext::default()).map_err(|error| exception(py, error))?;
    if relight {
        project.forget_light();
    }
    let Wishes { options, threads, .. } = Wishes::of(keywords, "compose", project.options.clone())?;
    let project_folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let alignment = run(py, Surroundings { progress, threads }, |context| {
        let recorded = RecordedPanorama {
            project: &project,
            project_folder: &project_folder,
            photographs: photographs.as_deref(),
            masks: &[],
        };
        Stitcher::new(&options, context).reopen(&recorded)
    })?;
    Ok(Alignment { alignment, options, threads })
}

#[pymethods]
impl Alignment {
    /// The panorama of the photographs that were aligned, or of others in their places.
    fn compose<'py>(
        &self,
        py: Python<'py>,
        photographs: Option<Vec<GivenPhotograph<'py>>>,
        keywords: &Bound<'py, PyDict>,
        progress: Option<Bound<'py, PyAny>>,
        workers: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Panorama> {
        let Wishes { options, threads, .. } = Wishes::of(keywords, "compose", self.options.clone())?;
        let threads = if threads == 0 { self.threads } else { threads };
        let shown = photographs.map(collected).transpose()?;
        let shown = shown.map(|(photographs, in_memory)| Inputs { photographs, in_memory, ..Inputs::default() });
        let handing = Handing::new(workers);
        let composed = run(py, Surroundings { progress, threads }, |context| {
            let stitcher = Stitcher::new(&options, context).with_workers(Handing::workers(handing.as_ref()));
            let mut alignment = match &shown {
                None if options == self.options => self.alignment.clone(),
                shown => stitcher.rearrange(&self.alignment, shown.as_ref())?,
            };
            let rendered = stitcher.compose(&mut alignment)?;
            // Asked for now: the files may be gone when the pixels are.
            let depth = Panorama::depth_of(&options, &alignment)?;
            Ok((alignment, rendered, depth))
        });
        let (alignment, rendered, depth) = Handing::outcome(handing, composed)?;
        Ok(Panorama { alignment, rendered, options, depth, threads })
    }

    /// The record so far, as JSON.
    fn project_json(&self, py: Python<'_>) -> PyResult<String> {
        self.alignment.project.to_json().map_err(|error: Error| exception(py, error))
    }

    /// What messages call the photographs, in the order of the record.
    fn photograph_names(&self) -> Vec<String> {
        self.alignment.project.photograph_names()
    }

    /// What was made of which photographs, in words.
    fn summary(&self, verbose: bool) -> String {
        trueup_cli::summary_text(&self.alignment.project, verbose)
    }
}
