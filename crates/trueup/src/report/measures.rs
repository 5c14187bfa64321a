//! How upright, straight and well aligned a panorama is, by its own lines and matches: what is recorded of every one.

use serde::{Deserialize, Serialize};
use trueup_align::metrics::Straightness;

/// The paper prints LD in hundredths.
pub(crate) const HUNDREDTHS: f64 = 100.0;

/// Photographs whose lean is certain that a panorama needs for an uprightness of its own: fewer have none in common.
pub const FEWEST_CERTAIN: usize = 2;

/// Which way something leans that leans clockwise by `lean_deg` degrees, as words to follow "leans": " to the left" or
/// " to the right". Empty where the size is zero as it is shown, with so many `decimals`.
pub fn lean_side(lean_deg: f64, decimals: usize) -> &'static str {
    let shown = format!("{:.decimals$}", lean_deg.abs());
    match shown.parse() == Ok(0.0) {
        true => "",
        false if lean_deg < 0.0 => " to the left",
        false => " to the right",
    }
}

/// Measures of a panorama that need no truth. Angles in degrees, positive clockwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// How upright it is by all its lines; `None` if fewer than [`FEWEST_CERTAIN`] photographs are certain.
    pub upright: Option<UprightMeasures>,
    /// Estimate of the paper's GDIC, with each photograph's roll by the lines of all of them in place of its true
    /// angle. Over the photographs that are certain; `None` with fewer than two.
    pub estimated_gdic_deg: Option<f64>,
    /// How far apart matched points land; `None` without matches.
    pub reprojection: Option<ReprojectionMeasures>,
    /// How straight long lines are; `None` without long lines.
    pub long_lines: Option<LongLines>,
    /// The paper's local distortion LD, times 100: the largest over the photographs.
    pub ld: f64,
    /// Mean over the photographs of the same.
    pub ld_mean: f64,
    /// Cells that are folded, in all photographs.
    pub folds: usize,
    /// Each photograph's own figures, in the order of the photographs used.
    #[serde(rename = "pictures")]
    pub photographs: Vec<PhotographMeasures>,
    /// Where matched points land how far apart, of every pair whose overlap was to coincide. Empty in projects of
    /// earlier versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<PairMeasures>,
}

impl Measures {
    /// The figures alone, without the places that they were measured at: what is told in short.
    #[must_use]
    pub fn without_places(&self) -> Self {
        let figures = |one: &PhotographMeasures| PhotographMeasures { lines: Vec::new(), ..one.clone() };
        Self { pairs: Vec::new(), photographs: self.photographs.iter().map(figures).collect(), ..self.clone() }
    }
}

/// How far apart the matched points of one pair land, in the photographs' own pixels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairMeasures {
    /// Position of the first photograph in [`crate::Project::images`].
    pub a: usize,
    /// Position of the second photograph.
    pub b: usize,
    /// Matches measured.
    pub matches: usize,
    /// Mean distance.
    pub mean_px: f64,
    /// 95 of 100 are not farther apart.
    pub percentile_95_px: f64,
    /// The same by places: squares of a sixteenth of the longer side of the first photograph, as far as there are
    /// matches in them, row after row.
    pub places: Vec<PlaceMeasures>,
}

/// How far apart the matched points around a place land.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlaceMeasures {
    /// Their mean place in the first photograph, in its pixels.
    pub at: [f64; 2],
    /// How many there are.
    pub matches: usize,
    /// Mean distance in the photographs' own pixels.
    pub mean_px: f64,
}

/// A long straight line of a photograph, and what became of it in the panorama.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeasuredLine {
    /// One end in the photograph, in its pixels.
    pub start: [f64; 2],
    /// The other end.
    pub end: [f64; 2],
    /// Which of the photograph's vanishing directions it points to, by its position in
    /// [`crate::ImageRecord::vanishing_points`]; `None` if to none of them, or if there are none.
    pub direction: Option<usize>,
    /// Its length in panorama pixels.
    pub length_px: f64,
    /// Root mean square distance of its points from straight, in panorama pixels.
    pub rms_px: f64,
    /// Largest such distance.
    pub off_px: f64,
}

impl MeasuredLine {
    /// How straight it is in the panorama.
    pub fn straightness(&self) -> Straightness {
        Straightness { length_px: self.length_px, rms_px: self.rms_px, largest_px: self.off_px }
    }
}

/// How upright the panorama is by the lines of all its photographs, over those whose lean is certain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UprightMeasures {
    /// Mean over the photographs of |lean|: its expected value, uncertainty and all.
    pub mean_deg: f64,
    /// The largest |lean|, as estimated.
    pub max_deg: f64,
    /// Every single lean is smaller with a probability of 95 %: the largest of |lean| and half its interval together.
    /// `None` in projects of earlier versions.
    #[serde(default)]
    pub within_deg: Option<f64>,
    /// Photographs that are certain.
    pub measured: usize,
}

/// Distances of matched points in the panorama, in the photographs' own pixels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReprojectionMeasures {
    /// Matches measured.
    pub matches: usize,
    /// Mean distance.
    pub mean_px: f64,
    /// Root mean square distance.
    pub rms_px: f64,
    /// 95 of 100 are not farther apart.
    pub percentile_95_px: f64,
    /// Where they are farthest apart. `None` in projects of earlier versions.
    #[serde(default)]
    pub worst_pair: Option<WorstPair>,
}

/// The two photographs whose matched points land farthest apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorstPair {
    /// Path of the first photograph.
    pub a: String,
    /// Path of the second photograph.
    pub b: String,
    /// 95 of 100 of their matches are not farther apart.
    pub percentile_95_px: f64,
}

/// How straight the long lines of the photographs are in the panorama.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LongLines {
    /// Lines measured.
    pub lines: usize,
    /// Mean over the lines of their root mean square distance from straight, as a share of their length.
    pub mean_bend: f64,
    /// Lines that stray from straight by more than 0.003 of their length.
    pub bent: usize,
    /// The longest of those.
    pub longest_bent: Option<BentLine>,
}

/// A line that is not straight in the panorama.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BentLine {
    /// Path of the photograph.
    pub path: String,
    /// Its length in panorama pixels.
    pub length_px: f64,
    /// Its largest distance from straight in panorama pixels.
    pub off_px: f64,
}

/// How a photograph stands by the lines of all of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhotographMeasures {
    /// Path of the photograph.
    pub path: String,
    /// Its vertical lines: those that carry the vertical that the lines of all photographs tell; where these tell none,
    /// those of its own.
    pub vertical_lines: usize,
    /// By how much what is vertical leans clockwise in the panorama where its vertical lines are, in the mean of these;
    /// `None` if the lines of all photographs do not tell, straight up or down, and where fewer than three of its own,
    /// or no more than chance shows, carry the vertical.
    pub lean_deg: Option<f64>,
    /// Standard error of the lean.
    pub standard_error_deg: Option<f64>,
    /// Half the interval around `lean_deg` that holds the true lean with a probability of 95 %. `None` also in projects
    /// of earlier versions.
    #[serde(default)]
    pub within_deg: Option<f64>,
    /// Angle in the photograph from its down to the vertical.
    pub gamma_deg: Option<f64>,
    /// Whether the lean is sure to a degree.
    pub certain: bool,
    /// Its long lines. Empty in projects of earlier versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<MeasuredLine>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rounds_to_zero_leans_to_no_side() {
        for (degrees, decimals, side) in
            [(-0.02, 2, " to the left"), (0.02, 2, " to the right"), (-0.02, 1, ""), (-0.0, 2, ""), (0.004, 2, "")]
        {
            assert_eq!(lean_side(degrees, decimals), side, "{degrees} with {decimals} decimals");
        }
    }
}
