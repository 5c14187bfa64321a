//! One entry of a comparison: its panorama with its measures, or why there is none.

use std::path::Path;

use trueup::{
    Alignment, Inputs, MatchedPhotographs, Measures, Outputs, Project, SideOutput, StitchOptions, Stitcher, evaluate,
};
use trueup_compose::layout::median_cell_scale;
use trueup_core::options::OptionValue;
use trueup_core::truth::Truth;
use trueup_core::{Error, Result, StageContext};

use super::compared::{Compared, PanoramaRecord, Refusal};
use super::drawing::{self, Drawing};
use super::entry::ComparisonEntry;
use super::format::PanoramaFormat;
use super::overlaps;

/// Progress over the entries is reported as this.
pub(super) const STAGE: &str = "panoramas";

/// What is the same for all entries.
pub(super) struct Common<'a> {
    pub options: &'a StitchOptions,
    pub set: &'a MatchedPhotographs,
    pub truth: Option<&'a Truth>,
    pub overlap_scale: f64,
    pub format: PanoramaFormat,
    pub folder: &'a Path,
    pub context: &'a StageContext<'a>,
}

/// One entry and what came of it.
pub(super) struct Made {
    pub compared: Compared,
    pub drawing: Drawing,
    pub project: Option<Project>,
    /// The error behind a refusal.
    pub error: Option<Error>,
}

impl Common<'_> {
    /// Makes one entry's panorama, or finds out why it cannot be made.
    pub(crate) fn make(&self, entry: &ComparisonEntry, stem: &str, inputs: &Inputs) -> Result<Made> {
        let options = entry.options(self.options)?;
        let mut made = Made { compared: Compared::of(entry), drawing: Drawing::default(), project: None, error: None };
        let stitcher = Stitcher::new(&options, self.context);
        let aligned = stitcher.align_matched(self.set, inputs).and_then(|aligned| {
            let alignment = aligned.alignments.into_iter().next();
            alignment.ok_or_else(|| Error::unsolvable(STAGE, &entry.name, "nothing was aligned", ""))
        });
        let outcome = match aligned {
            Err(error) => Err(error),
            Ok(alignment) => {
                // A truth that does not fit one entry fits none.
                made.compared.evaluation = self.truth.map(|truth| evaluate(&alignment.project, truth)).transpose()?;
                self.finish(alignment, stem, &stitcher, &mut made)
            }
        };
        if let Err(error) = outcome {
            let Some(refusal) = refusal(&error) else { return Err(error) };
            made.compared.refusal = Some(refusal);
            made.error = Some(error);
        }
        Ok(made)
    }

    /// Measures, composes and writes an aligned panorama.
    fn finish(&self, alignment: Alignment, stem: &str, stitcher: &Stitcher, made: &mut Made) -> Result<()> {
        let compared = &mut made.compared;
        let (_, scale) = reference_place(&alignment.project)?;
        let pixels = overlaps::compare(self.set, &alignment.project, scale, self.overlap_scale, self.context)?;
        (compared.pixels, compared.pixels_skipped) = match pixels {
            Ok(pixels) => (Some(pixels), None),
            Err(why) => (None, Some(why)),
        };
        let (file, project_file) = (format!("{stem}.{}", self.format.display()), format!("{stem}.json"));
        let outputs = Outputs::new(self.folder.join(&file)).with(SideOutput::Project, self.folder.join(&project_file));
        let written = outputs.write(stitcher, alignment)?;
        // Where it was cropped, only now.
        let project = written.project;
        let (anchor, _) = reference_place(&project)?;
        made.drawing = drawing::draw(self.set, &project)?;
        compared.diagnostics.clone_from(&project.diagnostics);
        compared.measures = project.measures.as_ref().map(Measures::without_places);
        compared.seconds.clone_from(&project.seconds);
        compared.panorama = Some(PanoramaRecord {
            file,
            project: project_file,
            width: project.canvas.width,
            height: project.canvas.height,
            bytes: written.bytes,
            scale,
            anchor,
            used: project.used(),
        });
        made.project = Some(project);
        Ok(())
    }
}

/// Where the middle of the reference photograph lies in the panorama, and the panorama's pixels per pixel of it.
fn reference_place(project: &Project) -> Result<([f64; 2], f64)> {
    let reference = project.used_images().find(|image| image.path == project.reference);
    let reference = reference.ok_or_else(|| Error::input("reference", "it is not in the panorama", ""))?;
    let mesh = reference.grid()?;
    Ok((mesh.warp([mesh.width / 2.0, mesh.height / 2.0].into()).into(), median_cell_scale(&mesh)))
}

/// What concerns one entry alone; `None` for what ends the whole comparison.
fn refusal(error: &Error) -> Option<Refusal> {
    let (subject, reason, hint) = match error {
        Error::NotApplicable { reason, hint, .. } => (String::new(), reason.clone(), hint),
        Error::Input { subject, reason, hint } => (subject.clone(), reason.clone(), hint),
        Error::Unsolvable { stage, subject, why, hint } => (format!("{stage}: {subject}"), why.clone(), hint),
        Error::Unsupported { what, hint } => (String::new(), format!("{what} is not supported"), hint),
        Error::Limits { subject, needed, allowed, hint } => {
            (subject.clone(), format!("{needed} needed, {allowed} allowed"), hint)
        }
        _ => return None,
    };
    let not_applicable = matches!(error, Error::NotApplicable { .. });
    Some(Refusal { not_applicable, subject, reason, hint: hint.clone() })
}

/// The error when there is not one panorama: the first entry's, which is most often that of all.
pub(super) fn all_refused(made: Vec<Made>) -> Error {
    let none = || Error::input("entries", "none of them made a panorama", "Look at each of them with `trueup stitch`.");
    made.into_iter().find_map(|one| one.error).unwrap_or_else(none)
}
