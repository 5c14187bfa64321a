//! Per photograph: three mutually orthogonal vanishing directions from its line segments and its camera.
//!
//! A segment and the camera's center span the *interpretation plane* of the segment; its unit normal n is orthogonal to
//! the segment's direction in space. A vanishing direction v is a bearing in the camera frame that many normals are
//! orthogonal to: n . v = 0. No vanishing point in pixels is ever formed, so that one at infinity is no special case.
//!
//! # Departures
//! The paper detects vanishing points without intrinsics ([`Intrinsics::Unknown`]); by default the focal length of the
//! bundle adjustment is used, which makes the three directions orthogonal by construction. A focal length wrong by 10 %
//! moves the roll by about 0.1 degree.

pub(crate) mod frame_search;
mod interpretation;
pub(crate) mod jackknife;
pub(crate) mod joint;
mod options;
mod refine;
mod search;
pub(crate) mod supporters;
mod triad;
mod uncalibrated;

#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, Vector3};
use rand::Rng;
use trueup_core::camera::Camera;
use trueup_core::geometry::rows_of;
use trueup_core::lines::LineSegment;
use trueup_core::source::WorkingFrame;

pub use options::{Intrinsics, VanishingOptions};
pub use triad::{MissingTriad, Triad, TriadOutcome};

pub(crate) use interpretation::{FULL_WEIGHT_LENGTH_PX, InterpretationPlanes};
pub(crate) use refine::RefinedTriad;

/// Largest angle between the vertical and a segment's interpretation plane for the segment to be a vertical line,
/// degrees.
pub(crate) const VERTICAL_LINE_DEG: f64 = 1.5;
/// Clusters that must be populated: a single direction does not fix an orientation.
const NEEDED_CLUSTERS: usize = 2;
/// Segments that make a cluster count as populated.
const MIN_CLUSTER_LINES: usize = 3;
/// Standard deviation in degrees of the orientation about any axis above which a triad is dropped.
const MAX_ROTATION_SD_DEG: f64 = 5.0;

/// Finds the three vanishing directions of one photograph.
///
/// `lines` and `camera` are in the working pixels of `frame`; segments that are too short, not finite or artifacts
/// of the frame are ignored. `generator` drives the choice of hypotheses: the same generator gives the same triad.
/// Cost: about `draws * 45 * 200` evaluations of a segment, 1 to 2 ms with the defaults. Without intrinsics (see
/// `uncalibrated`) the directions are those in the frame of a camera of the focal length that they tell themselves, and
/// that of `camera` is not heeded.
///
/// # Source
/// Two-line exhaustive search on the Gaussian sphere (Lu, Yao, Liu, Li: 2-Line Exhaustive Searching for Real-Time
/// Vanishing Point Estimation in Manhattan World, WACV 2017) for the idea.
///
/// # Departures
/// Hypotheses are scored directly on the segments instead of on a one-degree polar grid, lines are drawn with
/// probability proportional to weight, and the best hypotheses are refined over SO(3) by iteratively reweighted least
/// squares.
pub fn detect_triad(
    lines: &[LineSegment],
    camera: &Camera,
    frame: &WorkingFrame,
    options: &VanishingOptions,
    generator: &mut impl Rng,
) -> TriadOutcome {
    let planes = InterpretationPlanes::new(lines, camera, frame);
    if planes.len() < options.min_lines {
        let missing = MissingTriad::TooFewLines { found: planes.len(), needed: options.min_lines };
        return TriadOutcome::Missing(missing);
    }
    if options.intrinsics == Intrinsics::Unknown {
        let found = uncalibrated::search(&planes, frame.width.max(frame.height), options, generator);
        let missing = MissingTriad::LowQuality { quality: 0.0, needed: options.min_quality };
        return found.map_or(TriadOutcome::Missing(missing), |found| {
            let planes = InterpretationPlanes::new(lines, &Camera { focal_px: found.focal_px, ..*camera }, frame);
            judge(&RefinedTriad::refine(&found.triad, &planes, options), &planes, lines.len(), options)
        });
    }
    let mut best: Option<RefinedTriad> = None;
    for hypothesis in search::best_hypotheses(&planes, options, generator) {
        let refined = RefinedTriad::refine(&hypothesis, &planes, options);
        if best.as_ref().is_none_or(|best| refined.score > best.score) {
            best = Some(refined);
        }
    }
    match best {
        Some(best) => judge(&best, &planes, lines.len(), options),
        None => TriadOutcome::Missing(MissingTriad::LowQuality { quality: 0.0, needed: options.min_quality }),
    }
}

/// Accepts a refined triad or says why not.
fn judge(
    refined: &RefinedTriad,
    planes: &InterpretationPlanes,
    line_count: usize,
    options: &VanishingOptions,
) -> TriadOutcome {
    let quality = refined.score / planes.total_weight;
    if quality.is_nan() || quality < options.min_quality {
        return TriadOutcome::Missing(MissingTriad::LowQuality { quality, needed: options.min_quality });
    }
    let (clusters, line_counts) = refined.clusters(planes, line_count);
    let populated = line_counts.iter().filter(|&&count| count >= MIN_CLUSTER_LINES).count();
    if populated < NEEDED_CLUSTERS {
        return TriadOutcome::Missing(MissingTriad::TooFewClusters { populated, needed: NEEDED_CLUSTERS });
    }
    let covariance = refined.covariance();
    let sd = covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
    let allowed = MAX_ROTATION_SD_DEG.to_radians();
    if sd.is_nan() || sd > allowed {
        return TriadOutcome::Missing(MissingTriad::Uncertain { sd, allowed });
    }
    let roll_sd = nearest_to_vertical(&refined.triad).map(|column| roll_sd(&refined.triad, column, &covariance));
    TriadOutcome::Found(Triad {
        camera_from_triad: rows_of(&refined.triad),
        quality,
        line_counts,
        clusters,
        covariance: rows_of(&covariance),
        roll_sd,
    })
}

/// The column whose photograph-plane direction is within 45 degrees of the vertical and that is closest to the y axis.
fn nearest_to_vertical(triad: &Matrix3<f64>) -> Option<usize> {
    (0..3)
        .filter(|&column| triad[(1, column)].abs() > triad[(0, column)].abs())
        .max_by(|&a, &b| triad[(1, a)].abs().total_cmp(&triad[(1, b)].abs()))
}

/// Standard deviation in radians of atan2(g_x, g_y), g the given column, for a covariance of V exp([d]x).
fn roll_sd(triad: &Matrix3<f64>, column: usize, covariance: &Matrix3<f64>) -> f64 {
    let g = triad.column(column);
    // d g = V (d x e_k) = -V [e_k]x d.
    let derivative = -triad * trueup_core::geometry::cross_matrix(&Vector3::ith(column, 1.0));
    let squared = g.x * g.x + g.y * g.y;
    let gradient = (derivative.row(0) * g.y - derivative.row(1) * g.x) / squared;
    (gradient * covariance * gradient.transpose())[(0, 0)].max(0.0).sqrt()
}
