//! Per picture: three mutually orthogonal vanishing directions from its line segments and its focal length.
//!
//! A segment and the camera's center span the *interpretation plane* of the segment; its unit normal n is orthogonal to
//! the segment's direction in space. A vanishing direction v is a bearing in the camera frame that many normals are
//! orthogonal to: n . v = 0. No vanishing point in pixels is ever formed, so that one at infinity is no special case.
//!
//! # Departures
//! The paper detects vanishing points without intrinsics; here the focal length of the bundle adjustment is used, which
//! makes the three directions orthogonal by construction. A focal length wrong by 10 % moves the roll by about 0.1
//! degree.

mod interpretation;
mod refine;
mod search;
#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, Vector3};
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};
use trueup_core::geometry::{matrix_from_rows, rows_of};
use trueup_core::lines::LineSegment;
use trueup_core::source::WorkingFrame;

pub(crate) use interpretation::InterpretationPlanes;
pub(crate) use refine::RefinedTriad;
pub(crate) use search::orthonormal_complement;

trueup_core::options! {
    /// How vanishing directions are found in one picture.
    pub struct VanishingOptions("vanishing") {
        /// Shortest segment used.
        min_length_px: f64 = 20.0, between(0.0, 1e4), "working px";
        /// Shortest segment used, as a fraction of the picture's diagonal; the larger of both holds.
        min_length_diagonal: f64 = 0.025, between(0.0, 1.0), "diagonals";
        /// Most segments used; the longest are kept.
        max_lines: usize = 400, between(10.0, 1e5), "segments";
        /// A segment this close to the picture's border, and parallel to it, is an artifact of the frame.
        border_margin_px: f64 = 5.0, between(0.0, 1e3), "working px";
        /// Length at which a segment's weight stops growing.
        weight_cap_px: f64 = 120.0, between(1.0, 1e4), "working px";
        /// Pairs of segments drawn as hypotheses of a first direction: 106 find a triad with probability 0.9999 if half
        /// of the segments belong to it.
        draws: usize = 106, between(1.0, 1e5), "";
        /// Step of the second direction about the first.
        step_deg: f64 = 2.0, between(0.1, 45.0), "degrees";
        /// Segments, longest first, that hypotheses are scored on before the best are refined on all.
        search_lines: usize = 200, between(10.0, 1e5), "segments";
        /// Hypotheses that are refined.
        refined: usize = 5, between(1.0, 1e3), "";
        /// Largest angle between a direction and a segment's interpretation plane for the segment to support it.
        tolerance_deg: f64 = 3.0, between(0.1, 30.0), "degrees";
        /// Scale of the robust (Geman-McClure) loss of the refinement.
        refine_scale_deg: f64 = 1.5, between(0.05, 30.0), "degrees";
        /// Largest such angle for a segment to be counted in a direction's cluster.
        cluster_deg: f64 = 6.0, between(0.1, 30.0), "degrees";
        /// Fewer segments yield no triad.
        min_lines: usize = 10, between(3.0, 1e5), "segments";
        /// Lower quality (fraction of the segments' weight that supports the triad) yields no triad.
        min_quality: f64 = 0.25, between(0.0, 1.0), "";
        /// Segments that make a cluster count as populated; fewer than two populated clusters yield no triad.
        min_cluster_lines: usize = 3, between(1.0, 1e5), "segments";
        /// A triad whose orientation is less certain than this is dropped.
        max_rotation_sd_deg: f64 = 5.0, between(0.01, 90.0), "degrees";
        /// Share of the directions found that are replaced by random ones: for experiments on robustness.
        outlier_share: f64 = 0.0, between(0.0, 1.0), "";
    }
}

/// Three vanishing directions of a picture, the paper's v_i.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Triad {
    /// Rows of the 3 x 3 matrix whose columns are the three directions in the camera frame: orthonormal (unless
    /// [`spoil`] replaced some), of arbitrary order and sign.
    pub camera_from_triad: [[f64; 3]; 3],
    /// Fraction of the segments' weight that supports the triad, 0..1.
    pub quality: f64,
    /// Segments in each direction's cluster.
    pub line_counts: [usize; 3],
    /// For every segment given, the direction (0, 1, 2) whose cluster it belongs to; `None` if in none or not used.
    pub clusters: Vec<Option<u8>>,
    /// Covariance of the rotation vector d, in radians squared, for the perturbation `V exp([d]x)` of the matrix V.
    pub covariance: [[f64; 3]; 3],
    /// Standard deviation in radians of the roll that the direction closest to the picture's vertical predicts; `None`
    /// if none is within 45 degrees of the picture plane's vertical.
    pub roll_sd: Option<f64>,
}

impl Triad {
    /// The matrix whose columns are the directions in the camera frame.
    pub fn matrix(&self) -> Matrix3<f64> {
        matrix_from_rows(&self.camera_from_triad)
    }
}

/// Why a picture has no triad.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "reason")]
pub enum MissingTriad {
    /// Fewer usable segments than needed.
    TooFewLines {
        /// Usable segments.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The best triad explains too little of the segments.
    LowQuality {
        /// Its quality.
        quality: f64,
        /// The quality needed.
        needed: f64,
    },
    /// Fewer than two directions have enough segments.
    TooFewClusters {
        /// Populated clusters.
        populated: usize,
        /// Clusters needed.
        needed: usize,
    },
    /// The orientation is too uncertain about at least one axis.
    Uncertain {
        /// Largest standard deviation over the axes, in radians.
        sd: f64,
        /// The largest allowed, in radians.
        allowed: f64,
    },
}

/// What the search for a picture's vanishing directions came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TriadOutcome {
    /// Three directions.
    Found(Triad),
    /// None, and why.
    Missing(MissingTriad),
}

impl TriadOutcome {
    /// The triad, if there is one.
    pub fn triad(&self) -> Option<&Triad> {
        match self {
            Self::Found(triad) => Some(triad),
            Self::Missing(_) => None,
        }
    }
}

/// Clusters that must be populated: a single direction does not fix an orientation.
const NEEDED_CLUSTERS: usize = 2;

/// Finds the three vanishing directions of one picture.
///
/// `lines` are in the working pixels of `frame`, `focal_px` too; segments that are too short, not finite or artifacts
/// of the frame are ignored. `generator` drives the choice of hypotheses: the same generator gives the same triad.
/// Cost: about `draws * 90 / step_deg * search_lines` evaluations, 1 to 2 ms with the defaults.
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
    focal_px: f64,
    frame: &WorkingFrame,
    options: &VanishingOptions,
    generator: &mut impl Rng,
) -> TriadOutcome {
    let planes = InterpretationPlanes::new(lines, focal_px, frame, options);
    if planes.len() < options.min_lines {
        let missing = MissingTriad::TooFewLines { found: planes.len(), needed: options.min_lines };
        return TriadOutcome::Missing(missing);
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

/// Replaces each direction of a triad, independently with probability `share`, by one drawn uniformly from the sphere;
/// the others stay, so that the triad is no longer orthogonal.
///
/// # Source
/// The noise of the paper's experiment on its robust scheme; the paper does not say how its noise is drawn.
pub fn spoil(outcome: &mut TriadOutcome, share: f64, generator: &mut impl Rng) {
    let TriadOutcome::Found(triad) = outcome else { return };
    let mut matrix = triad.matrix();
    for column in 0..3 {
        // Drawn whether used or not, so that a larger share spoils the same directions and more.
        let chance: f64 = generator.random();
        let (height, turn): (f64, f64) =
            (generator.random_range(-1.0..1.0), generator.random_range(0.0..std::f64::consts::TAU));
        if chance < share {
            let radius = (1.0 - height * height).sqrt();
            matrix.set_column(column, &Vector3::new(radius * turn.cos(), radius * turn.sin(), height));
        }
    }
    triad.camera_from_triad = rows_of(&matrix);
}

/// Accepts a refined triad or says why not.
pub(crate) fn judge(
    refined: &RefinedTriad,
    planes: &InterpretationPlanes,
    line_count: usize,
    options: &VanishingOptions,
) -> TriadOutcome {
    let quality = refined.score / planes.total_weight;
    if quality.is_nan() || quality < options.min_quality {
        return TriadOutcome::Missing(MissingTriad::LowQuality { quality, needed: options.min_quality });
    }
    let (clusters, line_counts) = refined.clusters(planes, line_count, options);
    let populated = line_counts.iter().filter(|&&count| count >= options.min_cluster_lines).count();
    if populated < NEEDED_CLUSTERS {
        return TriadOutcome::Missing(MissingTriad::TooFewClusters { populated, needed: NEEDED_CLUSTERS });
    }
    let covariance = refined.covariance();
    let sd = covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
    let allowed = options.max_rotation_sd_deg.to_radians();
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

/// The column whose picture-plane direction is within 45 degrees of the vertical and that is closest to the y axis.
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
