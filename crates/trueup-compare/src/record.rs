//! The record of a comparison: what `compare.json` holds.

use serde::Serialize;
use trueup::StitchOptions;

use super::compared::Compared;
use super::figures::ComparisonFigure;
use super::ranking::Ranking;

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
