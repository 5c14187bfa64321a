//! What came of one entry of a comparison.

use std::collections::BTreeMap;

use serde::Serialize;
use trueup::{Evaluation, Measures, PixelEvaluation};
use trueup_core::diagnostics::Diagnostic;

use super::entry::ComparisonEntry;

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
    /// What could be measured, by [`super::ComparisonFigure::key`].
    pub figures: BTreeMap<&'static str, f64>,
    /// The figures in which no other entry is better, by [`super::ComparisonFigure::key`].
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
