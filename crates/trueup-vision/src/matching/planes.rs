//! Further planes of a pair that one homography does not explain.

use rand::Rng;
use trueup_core::geometry::Homography;

use super::MatchingOptions;
use super::ransac::{Consensus, MatchedPoints, Search, find_homography};

/// Planes sought at most; each needs `min_plane_inliers` matches of its own.
const MAX_PLANES: usize = 16;

/// The planes of a pair by sequential RANSAC on all matches: the best is found, its matches are removed, and so on
/// until the best has fewer than `min_plane_inliers`.
///
/// A plane counts only where it agrees roughly with the global homography: matches farther than `max_displacement_px`
/// from where that predicts them are no inliers of it.
///
/// # Source
/// The multi-structure matching of the implementation of natural image stitching with the global similarity prior.
///
/// # Departures
/// The guard against planes far from the global homography, and the plausibility of each, are ours.
pub fn find_planes(
    points: &MatchedPoints,
    global: &Homography,
    max_displacement_px: f64,
    options: &MatchingOptions,
    is_plausible: impl Fn(&Homography) -> bool,
    generator: &mut impl Rng,
) -> Vec<Consensus> {
    let mut search = Search {
        inlier_px: options.plane_inlier_px,
        confidence: options.confidence,
        max_samples: options.max_plane_samples,
        useful_inliers: options.min_plane_inliers,
        start: Some(*global),
    };
    let mut left = points.agreeing(global, max_displacement_px);
    let mut planes = Vec::new();
    while left.len() >= options.min_plane_inliers && planes.len() < MAX_PLANES {
        let Ok(found) = find_homography(&points.select(&left), &search, &is_plausible, generator) else { break };
        if found.inliers.len() < options.min_plane_inliers {
            break;
        }
        let inliers: Vec<usize> = found.inliers.iter().map(|&k| left[k]).collect();
        left.retain(|index| inliers.binary_search(index).is_err());
        planes.push(Consensus { b_from_a: found.b_from_a, inliers });
        search.start = None;
    }
    planes
}
