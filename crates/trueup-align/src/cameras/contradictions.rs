//! Pairs that contradict the others.

use trueup_core::camera::Camera;
use trueup_core::matches::PairMatches;

use crate::stitch_graph::{GraphEdge, StitchGraph};
use crate::{full_turn, straightening};

/// Residual up to which a pair that closes a full turn is kept, in units of that of other pairs.
const KEPT_WHERE_CLOSING: f64 = 2.0;

/// Pairs (ascending positions) whose residual is above `max_rms_px`, worst first as long as the rest stays connected.
///
/// Where that would open a full turn, pairs that close it are kept unless they are far too bad: what they contradict by
/// is then mostly what the turn tells of the focal length, which no other pair tells as well.
pub(super) fn contradicting_pairs(
    cameras: &[Camera],
    pairs: &[PairMatches],
    pair_rms_px: &[f64],
    max_rms_px: f64,
) -> Vec<usize> {
    let mut dropped = not_needed(cameras.len(), pairs, &suspects(pair_rms_px, max_rms_px));
    let level = straightening::level_by_cameras(cameras);
    let goes_round =
        |left_out: &dyn Fn(usize) -> bool| full_turn::goes_round(cameras, &edges_without(pairs, left_out), &level);
    let mut is_dropped = vec![false; pairs.len()];
    dropped.iter().for_each(|&pair| is_dropped[pair] = true);
    if goes_round(&|_| false) && !goes_round(&|position| is_dropped[position]) {
        let closes = |pair: usize| goes_round(&|position| position != pair && is_dropped[position]);
        dropped.retain(|&pair| pair_rms_px[pair] > KEPT_WHERE_CLOSING * max_rms_px || !closes(pair));
    }
    dropped.sort_unstable();
    dropped
}

/// Pairs (ascending positions) whose residual is above `max_rms_px`, worst first as long as the rest stays connected.
pub(super) fn not_needed_above(
    photographs: usize,
    pairs: &[PairMatches],
    rms_px: &[f64],
    max_rms_px: f64,
) -> Vec<usize> {
    let mut dropped = not_needed(photographs, pairs, &suspects(rms_px, max_rms_px));
    dropped.sort_unstable();
    dropped
}

/// Positions of the pairs whose residual is too large, the worst first.
fn suspects(pair_rms_px: &[f64], max_rms_px: f64) -> Vec<usize> {
    let mut suspects: Vec<usize> =
        (0..pair_rms_px.len()).filter(|&position| pair_rms_px[position] > max_rms_px).collect();
    suspects.sort_by(|&first, &second| pair_rms_px[second].total_cmp(&pair_rms_px[first]).then(first.cmp(&second)));
    suspects
}

/// Those of `suspects` without which, one after the other, the photographs stay connected.
fn not_needed(photographs: usize, pairs: &[PairMatches], suspects: &[usize]) -> Vec<usize> {
    let mut dropped: Vec<usize> = Vec::new();
    let mut is_dropped = vec![false; pairs.len()];
    for &suspect in suspects {
        let rest = edges_without(pairs, &|position| position == suspect || is_dropped[position]);
        if StitchGraph::from_edges(photographs, rest).components.len() == 1 {
            dropped.push(suspect);
            is_dropped[suspect] = true;
        }
    }
    dropped
}

fn edges_without(pairs: &[PairMatches], left_out: &dyn Fn(usize) -> bool) -> Vec<GraphEdge> {
    (0..pairs.len()).filter(|&position| !left_out(position)).map(|position| GraphEdge::of(&pairs[position])).collect()
}
