//! From photographs to a folder of panoramas side by side.

use std::path::{Path, PathBuf};
use std::time::Instant;

use rand::Rng;
use trueup_core::options::OptionValue;
use trueup_core::truth::Truth;
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode::{self, PendingFolder};
use trueup_io::source;

use super::drawing::Drawing;
use super::making::{Common, all_refused};
use super::place::{RECORD, check_replaceable, file_stems, spare_photographs};
use super::record::{COMPARISON_FORMAT, COMPARISON_VERSION, Compared, ComparedPhotograph, Comparison};
use super::{Entry, figures, overlaps, ranking};
use crate::cache::Cache;
use crate::evaluation::read_truth;
use crate::inputs::Inputs;
use crate::options::StitchOptions;
use crate::project::{ImageRecord, Project};
use crate::stitcher::Stitcher;

/// Progress over the entries is reported as this.
pub(super) const STAGE: &str = "panoramas";

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
        self.check_formats(options)?;
        let truth = self.truth.as_deref().map(read_truth).transpose()?;
        check_replaceable(&self.output)?;
        let photographs = source::files(&self.inputs.photographs);
        spare_photographs(&self.output, photographs.iter().map(PathBuf::as_path))?;
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

    /// Refuses options that the panoramas' format cannot meet.
    fn check_formats(&self, options: &StitchOptions) -> Result<()> {
        for entry in &self.entries {
            let options = entry.options(options)?;
            let file = format!("{}.{}", entry.name, options.compare.format.display());
            encode::check_format(Path::new(&file), &options.output)?;
        }
        Ok(())
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
