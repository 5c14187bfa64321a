//! The record of a comparison: what `compare.json` holds.

use std::collections::BTreeMap;

use serde::Serialize;
use trueup_core::diagnostics::Diagnostic;

use super::entry::ComparisonEntry;
use super::figures::ComparisonFigure;
use super::ranking::Ranking;
use trueup::{Evaluation, PixelEvaluation};
use trueup::Measures;
use trueup::StitchOptions;

/// The `format` field of every comparison file.
pub const COMPARISON_FORMAT: &str = "trueup-comparison";
/// The `version` field: raised when a field changes its meaning.
pub const COMPARISON_VERSION: u32 = 1;

/// Several panoramas of the same photographs.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// [`COMPARISON_FORMAT`].
    pub format: String,
    /// [`COMPARISON_VERSION`].
    pub version: u32,
    /// Stands for photographs, entries and seed; results of rankings name it.
    pub id: String,
    /// Every photograph given that could be found.
    pub photographs: Vec<ComparedPhotograph>,
    /// Path of the reference photograph.
    pub reference: String,
    /// Path of the truth, if one was given.
    pub truth: Option<String>,
    /// The options that all entries have in common.
    pub options: StitchOptions,
    /// What is measured, in the order to be shown.
    pub figures: Vec<ComparisonFigure>,
    /// The panoramas, in the order asked for.
    pub entries: Vec<Compared>,
    /// The panoramas to be ranked blindly; `None` if fewer than two succeeded.
    pub ranking: Option<Ranking>,
    /// Every file of the folder.
    pub files: Vec<String>,
    /// Wall seconds of the whole comparison, but for its pages.
    pub seconds: f64,
}

/// A photograph of a comparison.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ComparedPhotograph {
    /// The file as it was given.
    pub path: String,
    /// Width after orientation; 0 if the file could not be read.
    pub width: usize,
    /// Height after orientation; 0 if the file could not be read.
    pub height: usize,
    /// Why it is in no panorama; empty if it is.
    pub reason: String,
}

/// One entry and what came of it: a panorama or a refusal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// [`super::ComparisonEntry::name`].
    pub name: String,
    /// [`super::ComparisonEntry::meaning`].
    pub meaning: String,
    /// [`super::ComparisonEntry::overrides`].
    pub overrides: Vec<String>,
    /// Where the panorama is; `None` if there is none.
    pub panorama: Option<PanoramaRecord>,
    /// Why there is no panorama.
    pub refusal: Option<Refusal>,
    /// What could be measured, by [`ComparisonFigure::key`].
    pub figures: BTreeMap<&'static str, f64>,
    /// The figures in which no other entry is better, by [`ComparisonFigure::key`].
    pub best: Vec<&'static str>,
    /// What was found on the way.
    pub diagnostics: Vec<Diagnostic>,
    /// The measures that need no truth.
    pub measures: Option<Measures>,
    /// The measures against the truth.
    pub evaluation: Option<Evaluation>,
    /// How alike the photographs look where they overlap.
    pub pixels: Option<PixelEvaluation>,
    /// Why the pixels could not be compared.
    pub pixels_skipped: Option<String>,
    /// Wall seconds per stage, as if the method had run alone.
    pub seconds: BTreeMap<String, f64>,
}

impl Compared {
    /// Of `entry`, nothing of which is known yet.
    pub(super) fn of(entry: &ComparisonEntry) -> Self {
        Self {
            name: entry.name.clone(),
            meaning: entry.meaning.clone(),
            overrides: entry.overrides.clone(),
            panorama: None,
            refusal: None,
            figures: BTreeMap::new(),
            best: Vec::new(),
            diagnostics: Vec::new(),
            measures: None,
            evaluation: None,
            pixels: None,
            pixels_skipped: None,
            seconds: BTreeMap::new(),
        }
    }
}

/// A panorama in the folder of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PanoramaRecord {
    /// The picture's file.
    pub file: String,
    /// The project's file.
    pub project: String,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// The file's size.
    pub bytes: u64,
    /// Pixels per pixel of the reference photograph. The same for all panoramas, unless one had to be reduced.
    pub scale: f64,
    /// Where the middle of the reference photograph lies, in pixels: where panoramas are laid on each other.
    pub anchor: [f64; 2],
    /// Photographs in it.
    pub used: usize,
}

/// Why an entry has no panorama.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Refusal {
    /// Whether the method cannot place these photographs, rather than that something failed.
    pub not_applicable: bool,
    /// What it concerns; empty where that is the entry itself.
    pub subject: String,
    /// The reason.
    pub reason: String,
    /// What can be done about it; may be empty.
    pub hint: String,
}
