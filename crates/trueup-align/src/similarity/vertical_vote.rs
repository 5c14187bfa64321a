//! A vertical from the segments of all photographs alone, where the horizontal directions do not agree.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::vanishing::frame_search::{SEARCH_DEG, cone};
use crate::vanishing::joint::{LineVote, Support};

/// Largest angle between a segment and the vertical for the segment to support it, degrees.
const TOLERANCE_DEG: f64 = 2.0;
/// Largest score of a rival direction, relative to the vertical's, that leaves no doubt about it.
const MAX_RIVALRY: f64 = 0.5;
/// Least share of the segments' weight that supports a vertical without doubt.
const MIN_SHARE: f64 = 0.15;
/// Least share of the photographs that support a vertical without doubt, each by three segments or more.
const MIN_PHOTOGRAPHS: f64 = 0.6;
/// Rivals nearer to the peak than this many tolerances belong to the peak.
const PEAK_RADIUS: f64 = 3.0;

/// The direction that most segments point to, near an expected vertical.
#[derive(Debug, Clone, Copy)]
pub(super) struct VerticalPeak {
    /// Down, in the common frame.
    pub down: Vector3<f64>,
    /// Its support.
    pub support: Support,
    /// Score of the best direction outside the peak over the peak's own: near 0 for a clear vertical, near 1 for none.
    pub rivalry: f64,
}

impl VerticalPeak {
    /// Its share of `total_weight`, the weight of all segments.
    pub(super) fn share(&self, total_weight: f64) -> f64 {
        self.support.score / total_weight
    }

    /// Whether the segments, of this weight and on so many photographs, leave no doubt about it.
    pub(super) fn is_clear(&self, total_weight: f64, photographs: usize) -> bool {
        let needed = MIN_PHOTOGRAPHS * photographs as f64;
        self.rivalry <= MAX_RIVALRY
            && self.share(total_weight) >= MIN_SHARE
            && self.support.photographs as f64 >= needed.max(2.0)
    }
}

/// Searches the directions within [`SEARCH_DEG`] of `expected` and refines the best.
///
/// `None` without any supporting segment.
pub(super) fn vertical_peak(vote: &LineVote, expected: &Vector3<f64>) -> Option<VerticalPeak> {
    let tolerance = TOLERANCE_DEG.to_radians();
    let candidates = cone(expected, SEARCH_DEG.to_radians(), tolerance * 0.7);
    let scored: Vec<(f64, Vector3<f64>)> =
        candidates.into_par_iter().map(|direction| (vote.support(&direction, tolerance).score, direction)).collect();
    // The first of equals, so that the order of the candidates decides.
    let mut best = scored.first().copied()?;
    for &candidate in &scored {
        if candidate.0 > best.0 {
            best = candidate;
        }
    }
    let down = vote.refine_direction(&best.1);
    // A few segments can carry the refinement away from where the search found them.
    if down.dot(&best.1) < (PEAK_RADIUS * tolerance).cos() {
        return None;
    }
    let support = vote.support(&down, tolerance);
    let radius = (PEAK_RADIUS * tolerance).cos();
    let outside = scored.iter().filter(|(_, direction)| direction.dot(&down) < radius);
    let rival = outside.map(|(score, _)| *score).fold(0.0, f64::max);
    (support.score > 0.0).then(|| VerticalPeak { down, support, rivalry: rival / support.score })
}
