//! From a recorded panorama to its page.

use std::collections::BTreeMap;
use std::path::PathBuf;

use trueup::{
    Alignment, Error, Project, RecordedPanorama, Result, RowSource, RunOptions, StageContext, StitchOptions, Stitcher,
    thread_pool,
};
use trueup_core::raster::OpaqueRgb;

use crate::drawings::seams_size;
use crate::page::{Page, Pictures};
use crate::pictures::{EmbeddedPicture, embedded};

/// Longer side of the panorama on the page, pixels: sharp on a wide screen.
const PANORAMA_PX: f64 = 1800.0;
/// Pixels of each photograph on the page.
const PHOTOGRAPH_PIXELS: f64 = 200_000.0;
/// Smallest size of a panorama relative to its photographs, as the option `canvas.scale` has it.
const LEAST_SCALE: f64 = 1e-4;

/// Which panorama to report of.
///
/// ```
/// use trueup::{Inputs, Outputs, RunOptions, StageContext, StitchJob, StitchOptions};
/// use trueup_report::ReportJob;
/// # let room = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");
/// # let desk = tempfile::tempdir()?;
/// # let context = StageContext::default();
/// # let mut options = StitchOptions::default();
/// # options.set("canvas.scale=0.1")?;
/// # let outputs = Outputs::new(desk.path().join("room.jpg"));
/// # let job = StitchJob { inputs: Inputs::new([room]), outputs, cache: None, threads: 0 };
/// let project = job.run(&options, &context)?.remove(0).project;
/// let folder = desk.path().to_owned();
/// let job = ReportJob {
///     name: "room".to_owned(),
///     project,
///     project_folder: folder,
///     photographs: None,
///     run: RunOptions::default(),
///     threads: 0,
/// };
/// let page = job.run(&context)?;
/// assert!(page.starts_with("<!DOCTYPE html>") && !page.contains("<script"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ReportJob {
    /// What the panorama is called.
    pub name: String,
    /// The record of a stitch.
    pub project: Project,
    /// The folder that the project's file lies in: recorded paths are looked up there first, then from the current
    /// folder.
    pub project_folder: PathBuf,
    /// A folder that holds the photographs, if they moved.
    pub photographs: Option<PathBuf>,
    /// What the work may take of this machine. Those that the project records are of the machine that stitched.
    pub run: RunOptions,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
}

impl ReportJob {
    /// The page, one HTML file that loads nothing. The panorama is composed again, small; nothing is measured again.
    ///
    /// # Errors
    /// Those of [`Stitcher::reopen`] and of composing; [`Error::Input`] if a photograph's grid is missing;
    /// [`Error::Cancelled`].
    pub fn run(&self, context: &StageContext) -> Result<String> {
        thread_pool(self.threads)?.install(|| self.page(context))
    }

    fn page(&self, context: &StageContext) -> Result<String> {
        let options = StitchOptions { run: self.run.clone(), ..small(&self.project) };
        let stitcher = Stitcher::new(&options, context);
        let recorded = RecordedPanorama {
            project: &self.project,
            project_folder: &self.project_folder,
            photographs: self.photographs.as_deref(),
            masks: &[],
        };
        let mut alignment = stitcher.reopen(&recorded)?;
        let rendered = stitcher.compose(&mut alignment)?;
        let icc = stitcher.metadata(&alignment).icc;
        let panorama = embedded(&rendered.panorama, icc.clone(), context)?;
        let shown = alignment.shown(&rendered, seams_size(alignment.project.canvas));
        drop(rendered);
        let pictures = Pictures { panorama, photographs: photographs(&alignment, icc.as_ref(), context)? };
        let brightness = stitcher.brightness_steps(&alignment)?;
        // The figures are those that were measured of the whole panorama.
        let drawn = Project { measures: self.project.measures.clone(), ..alignment.project };
        let names = self.project.photograph_names();
        Page {
            name: &self.name,
            project: &self.project,
            drawn: &drawn,
            pictures: &pictures,
            shown: shown.as_ref(),
            brightness: &brightness,
            names: &names,
        }
        .text()
    }
}

/// The options that were recorded, for a canvas that suits a page.
fn small(project: &Project) -> StitchOptions {
    let mut options = project.options.clone();
    let longer = project.canvas.width.max(project.canvas.height) as f64;
    let smaller = (PANORAMA_PX / longer).min(1.0);
    options.arrange.canvas.scale = (options.arrange.canvas.scale * smaller).max(LEAST_SCALE);
    options
}

/// The photographs in use, by their positions in the project.
fn photographs(
    alignment: &Alignment,
    icc: Option<&Vec<u8>>,
    context: &StageContext,
) -> Result<BTreeMap<usize, EmbeddedPicture>> {
    let mut pictures = BTreeMap::new();
    for position in alignment.project.used_positions() {
        context.check_cancelled()?;
        if let Some(reduced) = alignment.reduced(position, PHOTOGRAPH_PIXELS)? {
            let rows = OpaqueRgb(reduced);
            if rows.width().min(rows.height()) == 0 {
                return Err(Error::input(&alignment.project.images[position].path, "it is empty", "Leave it out."));
            }
            pictures.insert(position, embedded(&rows, icc.cloned(), context)?);
        }
    }
    Ok(pictures)
}
