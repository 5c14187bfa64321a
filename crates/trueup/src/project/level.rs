//! The record of what leveled a panorama: the lines that guided it, or did not, and what else told of the vertical.

use serde::{Deserialize, Serialize};
use trueup_align::similarity::LevelSource;

/// How far the scene looked like a Manhattan world, and whether that guided the panorama.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ManhattanRecord {
    /// Vanishing point divergence (0 for perfect agreement); `None` if there were no vanishing points.
    pub divergence: Option<f64>,
    /// Largest divergence that is accepted.
    pub threshold: f64,
    /// How far the best directions stand out when the lines of all photographs are searched together, in standard
    /// deviations over all directions tried; `None` with too few lines.
    #[serde(default)]
    pub significance: Option<f64>,
    /// Standard deviation of the vertical by asking different photographs, degrees; `None` where lines were not asked.
    #[serde(default)]
    pub vertical_deviation_deg: Option<f64>,
    /// Whether vanishing points guided the panorama.
    pub accepted: bool,
    /// Whether the lines of all photographs together guided it, since the photographs' own vanishing points did not
    /// agree, or were outvoted.
    #[serde(default)]
    pub pooled: bool,
    /// By how much the scene's level lines lie along a slope, degrees: these do not count. `None` where they agree with
    /// the upright ones.
    #[serde(default)]
    pub slope_deg: Option<f64>,
    /// Why the photographs' own directions did not guide, in words; where all lines together were asked in their place
    /// and left the vertical open, why these did not.
    pub failed_clause: Option<String>,
    /// Dominant directions as columns, in the levelled world.
    pub dominant: Option<[[f64; 3]; 3]>,
    /// Paths of the photographs whose vanishing points agree with the dominant directions.
    pub inliers: Vec<String>,
    /// What told of the vertical, and of how much; empty for methods that ask nothing but the overlaps.
    #[serde(default)]
    pub level: Vec<LevelRecord>,
}

/// Which lines guided a panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineGuide {
    /// The vanishing points that photographs agree on.
    VanishingPoints,
    /// Those of all photographs together.
    AllLines,
    /// Upright ones alone: photographs' own directions were refused.
    UprightLines,
}

/// What one source said of the vertical, and what it came to count for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LevelRecord {
    /// Who says it: "lines", "gravity" that cameras recorded, the far "horizon", or "cameras", that are expected to be
    /// held level.
    pub source: LevelSource,
    /// How many photographs it rests on.
    pub photographs: usize,
    /// Angle between its own vertical and the panorama's, degrees.
    pub angle_deg: f64,
    /// Standard deviation of its vertical about the axis that it tells least of, degrees.
    pub deviation_deg: f64,
    /// Its share of what the vertical rests on, 0 to 1.
    pub share: f64,
}

impl LevelRecord {
    /// Smallest share that is worth a word.
    const WORTH_NAMING: f64 = 0.005;
    /// Deviation from which an angle is as good as not known, degrees.
    const UNKNOWN_DEG: f64 = 45.0;

    fn in_words(&self) -> String {
        let who = match self.source {
            LevelSource::Lines => format!("lines in {}", count_of_photographs(self.photographs)),
            LevelSource::Gravity => format!("gravity that {} recorded", count_of_photographs(self.photographs)),
            LevelSource::Horizon => format!("the far horizon in {}", count_of_photographs(self.photographs)),
            LevelSource::Cameras => "cameras held level".to_owned(),
        };
        // Up to the next tenth: what is sure to less is not told so surely.
        let deviation_deg = (10.0 * self.deviation_deg).ceil() / 10.0;
        let how_sure = match self.deviation_deg < Self::UNKNOWN_DEG {
            true => format!("to {deviation_deg:.1} degrees"),
            false => "one of its two angles".to_owned(),
        };
        format!("{who} {:.0} % ({how_sure})", 100.0 * self.share)
    }
}

fn count_of_photographs(count: usize) -> String {
    if count == 1 { "one photograph".to_owned() } else { format!("{count} photographs") }
}

impl ManhattanRecord {
    /// Which lines guided the panorama; `None` if none did.
    pub fn guide(&self) -> Option<LineGuide> {
        let guide = match &self.failed_clause {
            _ if self.pooled => LineGuide::AllLines,
            Some(_) => LineGuide::UprightLines,
            None => LineGuide::VanishingPoints,
        };
        self.accepted.then_some(guide)
    }

    /// Why the photographs' own vanishing points did not guide it, as ": " and the clause; empty where that is not
    /// known.
    pub fn refusal_in_words(&self) -> String {
        self.failed_clause.as_ref().map_or(String::new(), |clause| format!(": {clause}"))
    }

    /// What told of the vertical, and of how much, in words; `None` where nothing was asked.
    pub fn level_in_words(&self) -> Option<String> {
        let worth_naming = self.level.iter().filter(|one| one.share >= LevelRecord::WORTH_NAMING);
        let told: Vec<String> = worth_naming.map(LevelRecord::in_words).collect();
        (!told.is_empty()).then(|| told.join(", "))
    }
}
