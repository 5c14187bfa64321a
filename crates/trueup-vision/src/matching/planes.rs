//! Further planes of a pair that one homography does not explain.

use rand::Rng;
use trueup_core::geometry::Homography;

use super::matched_points::MatchedPoints;
use super::ransac::{Consensus, HomographySearch, find_homography};

/// How far a match may lie from where a further plane's homography predicts it, in working pixels.
const PLANE_INLIER_PX: f64 = 3.0;

/// Fewest matches of a further plane.
const MIN_PLANE_INLIERS: usize = 40;

/// Largest number of samples drawn for every further plane.
const MAX_PLANE_SAMPLES: usize = 3308;

/// How far a further plane's matches may lie from where the global homography predicts them, in diagonals of b.
const MAX_PLANE_DISPLACEMENT: f64 = 0.25;

/// Planes sought at most; each needs [`MIN_PLANE_INLIERS`] matches of its own.
const MAX_PLANES: usize = 16;

/// The planes of a pair by sequential RANSAC on all matches: the best is found, its matches are removed, and so on
/// until the best has fewer than [`MIN_PLANE_INLIERS`].
///
/// A plane counts only where it agrees roughly with the global homography: matches farther than
/// [`MAX_PLANE_DISPLACEMENT`] from where that predicts them are no inliers of it. `diagonal_px` is that of b.
///
/// # Source
/// The multi-structure matching of the implementation of natural image stitching with the global similarity prior.
///
/// # Departures
/// The guard against planes far from the global homography, and the plausibility of each, are ours.
pub(super) fn find_planes(
    points: &MatchedPoints,
    global: &Homography,
    diagonal_px: f64,
    is_plausible: impl Fn(&Homography) -> bool,
    generator: &mut impl Rng,
) -> Vec<Consensus> {
    let mut search = HomographySearch {
        inlier_px: PLANE_INLIER_PX,
        max_samples: MAX_PLANE_SAMPLES,
        useful_inliers: MIN_PLANE_INLIERS,
        start: Some(*global),
    };
    let mut left = points.agreeing(global, MAX_PLANE_DISPLACEMENT * diagonal_px);
    let mut planes = Vec::new();
    while left.len() >= MIN_PLANE_INLIERS && planes.len() < MAX_PLANES {
        let Ok(found) = find_homography(&points.select(&left), &search, &is_plausible, generator) else { break };
        if found.inliers.len() < MIN_PLANE_INLIERS {
            break;
        }
        let inliers: Vec<usize> = found.inliers.iter().map(|&k| left[k]).collect();
        left.retain(|index| inliers.binary_search(index).is_err());
        planes.push(Consensus { b_from_a: found.b_from_a, inliers });
        search.start = None;
    }
    planes
}
