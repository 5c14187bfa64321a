//! From photographs to a folder of panoramas side by side.

use std::path::{Path, PathBuf};
use std::time::Instant;

use rand::Rng;
use trueup_compose::layout::median_cell_scale;
use trueup_core::options::OptionValue;
use trueup_core::truth::Truth;
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode::{self, PendingFolder};

use super::drawing::{self, Drawing};
use super::place::{RECORD, check_replaceable, file_stems, spare_photographs};
use super::record::{
    COMPARISON_FORMAT, COMPARISON_VERSION, Compared, ComparedPhotograph, Comparison, PanoramaRecord, Refusal,
};
use super::{Entry, figures, overlaps, ranking};
use crate::cache::Cache;
use crate::evaluation::{evaluate, read_truth};
use crate::inputs::Inputs;
use crate::options::StitchOptions;
use crate::project::{ImageRecord, Project};
use crate::recorded::grid;
use crate::stitcher::{Alignment, MatchedPhotographs, Stitcher};

/// Progress over the entries is reported as this.
const STAGE: &str = "panoramas";

/// What to compare, and where to put it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompareJob {
    /// The photographs. Of several groups that do not overlap, the largest is compared, whatever [`Inputs::all`] says.
    pub inputs: Inputs,
    /// What is compared, at least one; names differ.
    pub entries: Vec<Entry>,
    /// A file of what is exactly known of the photographs.
    pub truth: Option<PathBuf>,
    /// Names of the entries to be ranked blindly; `None` leaves the choice to the program.
    pub ranked: Option<Vec<String>>,
    /// The folder to write.
    pub output: PathBuf,
    /// A folder for results that later runs can use, see [`Cache`]; made if it is not there.
    pub cache: Option<PathBuf>,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
}

/// A page that a front adds to the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// The file's name.
    pub name: String,
    /// Its content.
    pub text: String,
}

/// Makes a front's pages of a comparison and the drawings of its entries, one each, empty where there is no panorama.
type MakePages<'a> = dyn Fn(&Comparison, &[Drawing]) -> Result<Vec<Page>> + Sync + 'a;

/// What is the same for all entries.
struct Common<'a> {
    options: &'a StitchOptions,
    set: &'a MatchedPhotographs,
    truth: Option<&'a Truth>,
    overlap_scale: f64,
    folder: &'a Path,
    context: &'a StageContext<'a>,
}

/// One entry and what came of it.
struct Made {
    compared: Compared,
    drawing: Drawing,
    project: Option<Project>,
    /// The error behind a refusal.
    error: Option<Error>,
}

impl CompareJob {
    /// Runs the job. Photographs are measured and matched once; every entry that can be made is made, the others are
    /// refused with their reason. `pages` adds the front's pages. The folder appears when it is complete; an older
    /// comparison of the same name is replaced then, any other folder is refused before work starts.
    ///
    /// # Errors
    /// Those of [`Stitcher::match_photographs`] and of writing; [`Error::Input`] for entries, rankings, a truth or a folder
    /// that cannot be; the first entry's error if all are refused.
    pub fn run(&self, options: &StitchOptions, context: &StageContext, pages: &MakePages) -> Result<Comparison> {
        options.validate()?;
        self.check_entries(options)?;
        let truth = self.truth.as_deref().map(read_truth).transpose()?;
        check_replaceable(&self.output)?;
        let folder = PendingFolder::create(&self.output)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build()
            .map_err(|error| Error::input("threads", error, "Ask for fewer threads."))?;
        let comparison = pool.install(|| self.compare(options, truth.as_ref(), folder.path(), context, pages))?;
        context.check_cancelled()?;
        // Work took its time: the folder may have been filled since.
        check_replaceable(&self.output)?;
        folder.commit()?;
        Ok(comparison)
    }

    fn check_entries(&self, options: &StitchOptions) -> Result<()> {
        if self.entries.is_empty() {
            return Err(Error::input("entries", "there is nothing to compare", "Name at least one method."));
        }
        for (index, entry) in self.entries.iter().enumerate() {
            if self.entries[..index].iter().any(|other| other.name == entry.name) {
                return Err(Error::input(&entry.name, "two entries have this name", "Give each a name of its own."));
            }
            entry.options(options)?;
        }
        self.ranked.as_ref().map_or(Ok(()), |wanted| ranking::check_wanted(wanted, &self.entries))
    }

    fn compare(
        &self,
        options: &StitchOptions,
        truth: Option<&Truth>,
        folder: &Path,
        context: &StageContext,
        pages: &MakePages,
    ) -> Result<Comparison> {
        let start = Instant::now();
        let inputs = Inputs { all: false, ..self.inputs.clone() };
        let cache = self.cache.as_ref().map(|folder| Cache::open(folder, &options.cache)).transpose()?;
        let stitcher = Stitcher::new(options, context).with_cache(cache.as_ref());
        let set = stitcher.match_photographs(&inputs)?.remembering();
        spare_photographs(&self.output, set.photographs().images().iter().map(|image| image.path.as_path()))?;
        let pixels: f64 = set.photographs().images().iter().map(|image| (image.width * image.height) as f64).sum();
        let options = &at_page_size(options, pixels);
        let overlap_scale = overlaps::common_scale(pixels, options.measures.canvas_pixels);
        let common = Common { options, set: &set, truth, overlap_scale, folder, context };

        let names: Vec<&str> = self.entries.iter().map(|entry| entry.name.as_str()).collect();
        let mut made = Vec::new();
        context.progress().begin(STAGE, self.entries.len() as u64);
        for (entry, stem) in self.entries.iter().zip(file_stems(&names)) {
            context.check_cancelled()?;
            made.push(common.make(entry, &stem, &inputs)?);
            context.progress().advance(STAGE, 1);
        }
        context.progress().finish(STAGE);
        let project = match made.iter_mut().find_map(|one| one.project.take()) {
            Some(project) => project,
            None => return Err(all_refused(made)),
        };
        let drawings: Vec<Drawing> = made.iter_mut().map(|one| std::mem::take(&mut one.drawing)).collect();
        let entries = made.into_iter().map(|one| one.compared).collect();
        let mut comparison = self.record(options, truth.is_some(), entries, &project, context);
        comparison.ranking = ranking::choose(self.ranked.as_deref(), &comparison.entries, &options.compare, context);
        copy_ranked(&comparison, folder)?;
        comparison.seconds = start.elapsed().as_secs_f64();
        write_pages(&mut comparison, &drawings, folder, pages)?;
        Ok(comparison)
    }

    fn record(
        &self,
        options: &StitchOptions,
        with_truth: bool,
        mut entries: Vec<Compared>,
        project: &Project,
        context: &StageContext,
    ) -> Comparison {
        let figures = figures::shown(with_truth);
        figures::fill(&mut entries, &figures);
        let photographs: Vec<ComparedPhotograph> = project.images.iter().map(photograph).collect();
        let made_of: Vec<&str> = photographs.iter().map(|one| one.path.as_str()).collect();
        let made_as: Vec<String> =
            self.entries.iter().map(|entry| format!("{}: {}", entry.name, entry.overrides.join(", "))).collect();
        let id = context.generator(&format!("{made_of:?} {made_as:?} {options:?}"), 0).next_u64();
        Comparison {
            format: COMPARISON_FORMAT.to_owned(),
            version: COMPARISON_VERSION,
            id: format!("{id:016x}"),
            photographs,
            reference: project.reference.clone(),
            truth: self.truth.as_ref().map(|path| path.display().to_string()),
            options: options.clone(),
            figures,
            entries,
            ranking: None,
            files: Vec::new(),
            seconds: 0.0,
        }
    }
}

impl Common<'_> {
    /// Makes one entry's panorama, or finds out why it cannot be made.
    fn make(&self, entry: &Entry, stem: &str, inputs: &Inputs) -> Result<Made> {
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
            made.compared.diagnostics = self.context.take_diagnostics();
            let Some(refusal) = refusal(&error) else { return Err(error) };
            made.compared.refusal = Some(refusal);
            made.error = Some(error);
        }
        Ok(made)
    }

    /// Measures, composes and writes an aligned panorama.
    fn finish(&self, mut alignment: Alignment, stem: &str, stitcher: &Stitcher, made: &mut Made) -> Result<()> {
        let compared = &mut made.compared;
        let (anchor, scale) = reference_place(&alignment.project)?;
        let pixels = overlaps::compare(self.set, &alignment.project, scale, self.overlap_scale, self.context)?;
        (compared.pixels, compared.pixels_skipped) = match pixels {
            Ok(pixels) => (Some(pixels), None),
            Err(why) => (None, Some(why)),
        };
        made.drawing = drawing::draw(self.set, &alignment.project, &self.options.compare)?;

        let file = format!("{stem}.{}", self.options.compare.format.display());
        let start = Instant::now();
        let panorama = stitcher.compose(&alignment)?;
        alignment.record_seconds("render", start.elapsed());
        let start = Instant::now();
        let options = &alignment.project.options.output;
        let bytes =
            encode::write(&self.folder.join(&file), &panorama, &stitcher.metadata(&alignment), options, self.context)?;
        drop(panorama);
        alignment.record_seconds("output", start.elapsed());
        alignment.record_findings(self.context.take_diagnostics());
        let project = alignment.project;
        let project_file = format!("{stem}.json");
        encode::write_atomically(&self.folder.join(&project_file), project.to_json()?.as_bytes())?;
        compared.diagnostics.clone_from(&project.diagnostics);
        compared.measures.clone_from(&project.measures);
        compared.seconds.clone_from(&project.seconds);
        compared.panorama = Some(PanoramaRecord {
            file,
            project: project_file,
            width: project.canvas.width,
            height: project.canvas.height,
            bytes,
            scale,
            anchor,
            used: project.used(),
        });
        made.project = Some(project);
        Ok(())
    }
}

/// The options with the canvas of a page: `pixels` are those of all photographs.
fn at_page_size(options: &StitchOptions, pixels: f64) -> StitchOptions {
    let mut options = options.clone();
    let compare = &options.compare;
    options.canvas.scale = match compare.scale > 0.0 {
        true => compare.scale,
        false => (compare.page_pixels / pixels).sqrt().min(1.0),
    };
    options.canvas.max_pixels = options.canvas.max_pixels.min(compare.max_pixels);
    options
}

/// Where the middle of the reference photograph lies in the panorama, and the panorama's pixels per pixel of it.
fn reference_place(project: &Project) -> Result<([f64; 2], f64)> {
    let reference = project.used_images().find(|image| image.path == project.reference);
    let reference = reference.ok_or_else(|| Error::input("reference", "it is not in the panorama", ""))?;
    let mesh = grid(reference)?;
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
fn all_refused(made: Vec<Made>) -> Error {
    let none = || Error::input("entries", "none of them made a panorama", "Look at each of them with `trueup stitch`.");
    made.into_iter().find_map(|one| one.error).unwrap_or_else(none)
}

fn photograph(image: &ImageRecord) -> ComparedPhotograph {
    ComparedPhotograph {
        path: image.path.clone(),
        width: image.width,
        height: image.height,
        reason: image.reason.clone(),
    }
}

/// Copies the ranked panoramas to files that do not tell their names.
fn copy_ranked(comparison: &Comparison, folder: &Path) -> Result<()> {
    for ranked in comparison.ranking.iter().flat_map(|ranking| &ranking.panoramas) {
        let entry = comparison.entries.iter().find(|entry| entry.name == ranked.entry);
        let Some(panorama) = entry.and_then(|entry| entry.panorama.as_ref()) else { continue };
        let target = folder.join(&ranked.file);
        std::fs::copy(folder.join(&panorama.file), &target).map_err(|error| Error::io("writing", &target, error))?;
    }
    Ok(())
}

/// Writes the front's pages and the record, which names every file.
fn write_pages(comparison: &mut Comparison, drawings: &[Drawing], folder: &Path, pages: &MakePages) -> Result<()> {
    let pages = pages(comparison, drawings)?;
    for page in &pages {
        encode::write_atomically(&folder.join(&page.name), page.text.as_bytes())?;
    }
    let panoramas = comparison.entries.iter().filter_map(|entry| entry.panorama.as_ref());
    let mut files: Vec<String> =
        panoramas.flat_map(|panorama| [panorama.file.clone(), panorama.project.clone()]).collect();
    files.extend(comparison.ranking.iter().flat_map(|one| one.panoramas.iter().map(|ranked| ranked.file.clone())));
    files.extend(pages.into_iter().map(|page| page.name));
    files.push(RECORD.to_owned());
    files.sort();
    comparison.files = files;
    let record = serde_json::to_string_pretty(comparison)
        .map_err(|error| Error::input("comparison", error, "Report this as a defect."))?;
    encode::write_atomically(&folder.join(RECORD), record.as_bytes())
}
