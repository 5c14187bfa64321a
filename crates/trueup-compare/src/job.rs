//! From photographs to a folder of panoramas side by side.

use std::path::{Path, PathBuf};
use std::time::Instant;

use rand::Rng;
use trueup::{ImageRecord, Inputs, PhotographCache, Project, StitchOptions, Stitcher, read_truth, thread_pool};
use trueup_core::options::{InvalidOption, OptionValue};
use trueup_core::truth::Truth;
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode::{self, PendingFolder};
use trueup_io::source;

use super::compared::Compared;
use super::drawing::Drawing;
use super::entry::ComparisonEntry;
use super::format::PanoramaFormat;
use super::making::{Common, all_refused};
use super::place::{RECORD, check_replaceable, file_stems, refuse_photographs};
use super::record::{COMPARISON_FORMAT, COMPARISON_VERSION, ComparedPhotograph, Comparison};
use super::{figures, making, overlaps, ranking};

/// Without a scale, the photographs are reduced so that they have about this many pixels together. Their overlaps make
/// the panorama smaller than that.
const PAGE_PIXELS: f64 = 6e6;
/// Largest panorama in pixels: a method that stretches the borders without end is reduced to it, and says so.
const MAX_PIXELS: f64 = 24e6;
/// What the panoramas' size may be, relative to the reference photograph's own pixels: as `canvas.scale`.
const SCALES: std::ops::RangeInclusive<f64> = 0.001..=16.0;

/// What to compare, and where to put it.
///
/// ```
/// use trueup::{Inputs, StageContext, StitchOptions};
/// use trueup_compare::{CompareJob, ComparisonEntry, PanoramaFormat};
/// # let room = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");
/// # let desk = tempfile::tempdir()?;
/// let job = CompareJob {
///     inputs: Inputs::new([room]),
///     entries: vec![ComparisonEntry::method("vpg")?, ComparisonEntry::method("autostitch")?],
///     truth: None,
///     ranked: None,
///     scale: Some(0.1),
///     format: PanoramaFormat::Jpeg,
///     output: desk.path().join("compared"),
///     cache: None,
///     threads: 0,
/// };
/// let compared = job.run(&StitchOptions::default(), &StageContext::default(), &|_, _| Ok(Vec::new()))?;
/// assert!(compared.entries.iter().all(|entry| entry.panorama.is_some()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CompareJob {
    /// The photographs. Of several groups that do not overlap, the largest is compared, whatever [`Inputs::all`] says.
    pub inputs: Inputs,
    /// What is compared, at least one; names differ.
    pub entries: Vec<ComparisonEntry>,
    /// A file of what is exactly known of the photographs.
    pub truth: Option<PathBuf>,
    /// Names of the entries to be ranked blindly; `None` leaves the choice to the program.
    pub ranked: Option<Vec<String>>,
    /// Size of the panoramas relative to the reference photograph's own pixels, in place of `canvas.scale`; `None`
    /// chooses one for all that suits a page.
    pub scale: Option<f64>,
    /// The panoramas' format.
    pub format: PanoramaFormat,
    /// The folder to write.
    pub output: PathBuf,
    /// A folder for results that later runs can use, see [`PhotographCache`]; made if it is not there.
    pub cache: Option<PathBuf>,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
}

/// A page that a front adds to the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ComparisonPage {
    /// The file's name.
    pub name: String,
    /// Its content.
    pub text: String,
}

/// Makes a front's pages of a comparison and the drawings of its entries, one each, empty where there is no panorama.
type MakePages<'a> = dyn Fn(&Comparison, &[Drawing]) -> Result<Vec<ComparisonPage>> + Sync + 'a;

impl CompareJob {
    /// Runs the job. Photographs are measured and matched once; every entry that can be made is made, the others are
    /// refused with their reason. `pages` adds the front's pages. The folder appears when it is complete; an older
    /// comparison of the same name is replaced then, any other folder is refused before work starts.
    ///
    /// # Errors
    /// Those of [`Stitcher::match_photographs`] and of writing; [`Error::Input`] for a single photograph, and for
    /// entries, rankings, a truth or a folder that cannot be; the first entry's error if all are refused.
    pub fn run(&self, options: &StitchOptions, context: &StageContext, pages: &MakePages) -> Result<Comparison> {
        options.validate()?;
        if let Some(scale) = self.scale.filter(|scale| !SCALES.contains(scale)) {
            return Err(Error::Options(vec![InvalidOption {
                name: "scale".to_owned(),
                value: scale.to_string(),
                allowed: format!("{} to {}", SCALES.start(), SCALES.end()),
            }]));
        }
        self.check_entries(options)?;
        self.check_formats(options)?;
        let truth = self.truth.as_deref().map(read_truth).transpose()?;
        check_replaceable(&self.output)?;
        let photographs = source::files(&self.inputs.photographs, &self.inputs.in_memory);
        refuse_photographs(&self.output, photographs.iter().map(PathBuf::as_path))?;
        let folder = PendingFolder::create(&self.output)?;
        let pool = thread_pool(self.threads)?;
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
            let file = format!("{}.{}", entry.name, self.format.display());
            encode::check_format(Path::new(&file), &options.compose.output)?;
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
        let cache = self
            .cache
            .as_ref()
            .map(|folder| PhotographCache::open(folder, options.run.resources.cache_bytes))
            .transpose()?;
        let stitcher = Stitcher::new(options, context).with_cache(cache.as_ref());
        let set = stitcher.match_photographs(&inputs)?.remembering();
        if let [only] = set.images() {
            let reason =
                "there is only one photograph to use, and methods differ in how they fit several to each other";
            let hint = "Name at least two overlapping photographs, or a folder that holds them.";
            return Err(Error::input(&only.name, reason, hint));
        }
        let pixels: f64 = set.images().iter().map(|image| (image.width * image.height) as f64).sum();
        let options = &self.at_page_size(options, pixels);
        let overlap_scale = overlaps::common_scale(pixels, options.run.measures.canvas_pixels);
        let common = Common { options, set: &set, truth, overlap_scale, format: self.format, folder, context };

        let names: Vec<&str> = self.entries.iter().map(|entry| entry.name.as_str()).collect();
        let mut made = Vec::new();
        context.progress().begin(making::STAGE, self.entries.len() as u64);
        for (entry, stem) in self.entries.iter().zip(file_stems(&names)) {
            context.check_cancelled()?;
            made.push(common.make(entry, &stem, &inputs)?);
            context.progress().advance(making::STAGE, 1);
        }
        context.progress().finish(making::STAGE);
        let project = match made.iter_mut().find_map(|one| one.project.take()) {
            Some(project) => project,
            None => return Err(all_refused(made)),
        };
        let drawings: Vec<Drawing> = made.iter_mut().map(|one| std::mem::take(&mut one.drawing)).collect();
        let entries = made.into_iter().map(|one| one.compared).collect();
        let random = context.seeded(options.matching.random.seed);
        let mut comparison = self.record(options, truth.is_some(), entries, &project, &random);
        comparison.ranking = ranking::choose(self.ranked.as_deref(), &comparison.entries, self.format, &random);
        copy_ranked(&comparison, folder)?;
        comparison.seconds = start.elapsed().as_secs_f64();
        write_pages(&mut comparison, &drawings, folder, pages)?;
        Ok(comparison)
    }

    /// The options with the canvas of a page: `pixels` are those of all photographs.
    fn at_page_size(&self, options: &StitchOptions, pixels: f64) -> StitchOptions {
        let mut options = options.clone();
        let canvas = &mut options.arrange.canvas;
        canvas.scale = self.scale.unwrap_or_else(|| (PAGE_PIXELS / pixels).sqrt().min(1.0));
        canvas.max_pixels = canvas.max_pixels.min(MAX_PIXELS);
        options
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
