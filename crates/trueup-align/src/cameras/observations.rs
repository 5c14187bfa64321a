//! The matches that cameras are estimated from: a bounded number per pair, spread evenly over the overlap.

use nalgebra::Vector2;
use trueup_core::matches::{PairMatches, PointMatch};

use super::prior::CameraPrior;
use super::transfer::CameraTransfer;

/// Matches used per pair in bundle adjustment: more hardly sharpen a pair's few unknowns.
pub(super) const MATCHES_PER_PAIR: usize = 200;
/// Matches used per pair for the terms of a lens, all that there are of most: these terms act in the corners of the
/// photographs, of which few matches tell. With 200, corners of 95 degrees are 3 to 5 pixels off.
pub(super) const MATCHES_PER_PAIR_FOR_LENSES: usize = 1000;
/// Matches used in all, so that time stays bounded; pairs share them evenly when there are many.
const MATCHES_IN_ALL: usize = 16_000;
/// Matches that every pair may use, however many pairs there are.
const FEWEST_MATCHES: usize = 24;
/// Cells along each side of the grid that matches are spread over.
const CELLS: usize = 16;

/// The matches of one pair.
pub(super) struct PairObservations {
    pub a: usize,
    pub b: usize,
    pub matches: Vec<PointMatch>,
}

/// The matches of all pairs used, in the pairs' order.
pub(super) struct Observations {
    pub pairs: Vec<PairObservations>,
}

impl Observations {
    /// Chooses at most `per_pair` matches of each of `pairs`, in their order.
    pub(super) fn choose(priors: &[CameraPrior], pairs: &[&PairMatches], per_pair: usize) -> Self {
        let share = MATCHES_IN_ALL / pairs.len().max(1);
        let limit = per_pair.min(share.max(FEWEST_MATCHES));
        let pairs = pairs
            .iter()
            .map(|pair| PairObservations {
                a: pair.a,
                b: pair.b,
                matches: spread_evenly(&pair.inliers, &priors[pair.a], limit),
            })
            .collect();
        Self { pairs }
    }
}

/// Entries of lists of these lengths, as (list, place in it): the first of each list, then the second of each, and so
/// on.
pub(super) fn in_turns(lengths: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    let longest = lengths.iter().copied().max().unwrap_or(0);
    (0..longest).flat_map(move |turn| {
        (0..lengths.len()).filter(move |&list| lengths[list] > turn).map(move |list| (list, turn))
    })
}

/// In which of so many cells along a side of this `length` a coordinate lies.
pub(super) fn cell_of(coordinate: f64, length: f64, cells: usize) -> usize {
    // The cast saturates.
    ((coordinate / length * cells as f64) as usize).min(cells - 1)
}

/// At most `limit` matches, taken in turns from the cells of a grid over photograph a, in their given order.
fn spread_evenly(matches: &[PointMatch], prior: &CameraPrior, limit: usize) -> Vec<PointMatch> {
    if matches.len() <= limit {
        return matches.to_vec();
    }
    let mut cells: Vec<Vec<PointMatch>> = vec![Vec::new(); CELLS * CELLS];
    for one in matches {
        let x = cell_of(one.in_a[0], prior.frame.width, CELLS);
        let y = cell_of(one.in_a[1], prior.frame.height, CELLS);
        cells[y * CELLS + x].push(*one);
    }
    let lengths: Vec<usize> = cells.iter().map(Vec::len).collect();
    in_turns(&lengths).take(limit).map(|(cell, turn)| cells[cell][turn]).collect()
}

/// Root mean square distance, over both directions, between a pair's matches and where the cameras put them; matches
/// behind a camera count as infinitely far. `transfer` carries from the one photograph to the other.
pub(super) fn pair_rms<'c>(transfer: impl Fn(usize, usize) -> CameraTransfer<'c>, pair: &PairMatches) -> f64 {
    let (there, back) = (transfer(pair.a, pair.b), transfer(pair.b, pair.a));
    let distance = |transfer: &CameraTransfer, source: [f64; 2], target: [f64; 2]| {
        transfer.at(Vector2::from(source)).map_or(f64::INFINITY, |q| (q - Vector2::from(target)).norm_squared())
    };
    let sum: f64 =
        pair.inliers.iter().map(|m| distance(&there, m.in_a, m.in_b) + distance(&back, m.in_b, m.in_a)).sum();
    (sum / (2 * pair.inliers.len()).max(1) as f64).sqrt()
}
