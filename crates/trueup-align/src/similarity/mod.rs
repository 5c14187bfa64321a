//! The similarity prior: how each picture should be turned and scaled so that the panorama stands upright.
//!
//! One file a prior; all share straightening, scales and the least squares over unit vectors.

mod camera_correction;
mod dominant;
mod edge_range;
mod frame_search;
mod gate;
mod gsp_2d;
mod gsp_3d;
mod joint;
mod path_voting;
mod scale;
mod signed_permutation;
mod straighten;
mod vertical;
mod vertical_vote;
mod vpg;
mod weighted_solve;

#[cfg(test)]
mod gsp_tests;
#[cfg(test)]
mod pooled_tests;
#[cfg(test)]
pub(crate) mod synthetic;
#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::geometry::{matrix_from_rows, roll_from_down, rows_of, wrap_angle};
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result, StageContext};

use crate::match_points::OverlapWarp;
use crate::vanishing::{TriadOutcome, VanishingOptions};

trueup_core::choice! {
    /// Where the turns and scales come from.
    pub enum PriorMethod {
        /// Vanishing points, straightening where they are not believed.
        VanishingPoints = "vpg",
        /// Straightening.
        Straightening = "straightening",
        /// The global similarity prior in two dimensions, as published: the reference is upright, and so is every picture
        /// that its overlaps let be.
        Gsp2d = "gsp-2d",
        /// The global similarity prior in three dimensions, as published: cameras straightened without a prior on their
        /// pitch, corrected by overlaps from the reference outwards.
        Gsp3d = "gsp-3d",
    }
}

trueup_core::choice! {
    /// Where the relative roll of two pictures comes from.
    pub enum BetaMode {
        /// The difference of the rolls that the dominant vertical means for each camera.
        World = "world",
        /// The twist of the relative rotation, as published; biased when cameras are pitched.
        Relative = "relative",
    }
}

trueup_core::choice! {
    /// Which conditions accept the dominant directions.
    pub enum GateMode {
        /// Divergence, number of agreeing pictures, straightening and roll.
        Full = "full",
        /// The divergence alone, as published.
        Paper = "paper",
    }
}

trueup_core::options! {
    /// How the similarity prior is found.
    pub struct SimilarityOptions("similarity") {
        /// The prior.
        prior: PriorMethod = PriorMethod::VanishingPoints, Allowed::Any, "";
        /// Sum of squared distances of a picture's directions from the dominant ones up to which it agrees with them;
        /// 0.24 is a misorientation of 19.9 degrees.
        rejection: f64 = 0.24, between(1e-6, 1e9), "";
        /// Hypotheses that join directions of two pictures.
        max_cross_pairs: usize = 2000, between(0.0, 1e6), "";
        /// Where relative rolls come from.
        beta_mode: BetaMode = BetaMode::World, Allowed::Any, "";
        /// Weight of the relative rolls against the pictures' own.
        relative_weight: f64 = 10.0, between(0.0, 1e6), "";
        /// Whether pictures vote along paths on how much a picture's own roll weighs; otherwise all weigh the same.
        path_voting: bool = true, Allowed::Any, "";
        /// Longest path by which pictures vote on each other.
        max_path_edges: usize = 3, between(1.0, 6.0), "edges";
        /// Most paths that vote on one picture.
        max_paths: usize = 2000, between(1.0, 1e6), "";
        /// Largest disagreement that counts as support.
        path_tolerance_deg: f64 = 5.0, between(0.01, 90.0), "degrees";
        /// Which conditions accept the dominant directions.
        gate: GateMode = GateMode::Full, Allowed::Any, "";
        /// Largest divergence of the vanishing directions.
        max_divergence: f64 = 0.10, between(0.0, 1e3), "";
        /// The same with three pictures or fewer.
        max_divergence_few: f64 = 0.02, between(0.0, 1e3), "";
        /// Least share of agreeing pictures with 6 pictures or fewer.
        min_inlier_share_few: f64 = 0.6, between(0.0, 1.0), "";
        /// Least share of agreeing pictures with more than 6.
        min_inlier_share: f64 = 0.4, between(0.0, 1.0), "";
        /// Largest angle between the dominant vertical and the one that straightening finds.
        max_straightening_angle_deg: f64 = 20.0, between(0.0, 180.0), "degrees";
        /// Largest median roll of the agreeing pictures.
        max_median_roll_deg: f64 = 45.0, between(0.0, 180.0), "degrees";
        /// Whether pictures that disagree are searched again near the dominant directions.
        guided_redetection: bool = true, Allowed::Any, "";
        /// Whether the segments of all pictures refine the dominant directions together.
        joint_refinement: bool = true, Allowed::Any, "";
        /// Scale of the robust loss at which the joint refinement starts.
        joint_start_scale_px: f64 = 4.0, between(0.01, 100.0), "working px";
        /// Scale of the robust loss at which the joint refinement ends.
        joint_scale_px: f64 = 0.5, between(0.01, 100.0), "working px";
        /// Largest angle between a segment and a direction for the segment to vote.
        joint_tolerance_deg: f64 = 3.0, between(0.1, 30.0), "degrees";
        /// Root mean square misorientation of the pictures' directions that is detection noise; beyond, the horizontal
        /// directions lose weight in the joint refinement.
        ordinary_misorientation_deg: f64 = 1.0, between(0.01, 90.0), "degrees";
        /// Whether each camera is turned so that its own segments point to the common directions, as far as its overlaps
        /// allow.
        camera_correction: bool = true, Allowed::Any, "";
        /// What the segments of one picture together leave uncertain, as if each erred alone by this much.
        line_error_px: f64 = 0.5, between(0.01, 1000.0), "working px";
        /// Least error of an overlap's relative rotation; where the matches show parallax, that counts.
        min_overlap_error_px: f64 = 0.1, between(0.01, 1000.0), "working px";
        /// Whether the segments of all pictures are searched together for one frame: to confirm the directions that the
        /// pictures agree on, and in their place where they do not agree.
        pooled_search: bool = true, Allowed::Any, "";
        /// Segments in the pooled search, shared out evenly among the pictures, the longest first.
        max_pooled_lines: usize = 1200, between(10.0, 1e6), "segments";
        /// Fewer segments in all pictures together are no evidence.
        min_pooled_lines: usize = 10, between(3.0, 1e6), "segments";
        /// Largest angle between a segment and a direction for the segment to support it in the pooled search.
        pooled_tolerance_deg: f64 = 1.5, between(0.1, 30.0), "degrees";
        /// Step of the vertical in the pooled search.
        pooled_step_deg: f64 = 2.0, between(0.2, 10.0), "degrees";
        /// How far the best frame must stand out in the pooled search to confirm the pictures' own directions.
        min_significance: f64 = 5.0, between(0.0, 1e3), "standard deviations";
        /// How far it must stand out to guide where the pictures do not agree.
        pooled_significance: f64 = 7.0, between(0.0, 1e3), "standard deviations";
        /// Largest standard deviation of the vertical, by asking different pictures; straightening is wrong by 1 to 2 degrees.
        max_vertical_deviation_deg: f64 = 1.5, between(0.0, 180.0), "degrees";
        /// The same for the pooled search in place of directions that the pictures agree on.
        max_pooled_deviation_deg: f64 = 1.0, between(0.0, 180.0), "degrees";
        /// Whether a vertical alone may guide where the horizontal directions do not agree.
        vertical_only: bool = true, Allowed::Any, "";
        /// How far from the cameras' own vertical the segments' is sought.
        vertical_search_deg: f64 = 25.0, between(1.0, 90.0), "degrees";
        /// Largest angle between a segment and the vertical for the segment to support it.
        vertical_tolerance_deg: f64 = 2.0, between(0.1, 30.0), "degrees";
        /// Largest score of a rival direction, relative to the vertical's.
        max_vertical_rivalry: f64 = 0.5, between(0.0, 1.0), "";
        /// Least share of the segments' weight that supports the vertical.
        min_vertical_share: f64 = 0.15, between(0.0, 1.0), "";
        /// Least share of the pictures with at least three supporting segments.
        min_vertical_pictures: f64 = 0.6, between(0.0, 1.0), "";
        /// How much straightening expects pictures to look level: variance of the roll over that of the pitch among
        /// photographers. 0 is the published form, which lets a short sweep with some roll pitch by tens of degrees; it is
        /// what the priors of the published methods always take.
        pitch_prior: f64 = 0.1, between(0.0, 1.0), "";
    }
}

/// What the prior is made from. Pictures are counted 0..N; all lists but `edges` and `overlaps` have N entries.
#[derive(Debug, Clone, Copy)]
pub struct PriorInput<'a> {
    /// Cameras in working pixels, in any common world frame.
    pub cameras: &'a [Camera],
    /// Each picture's vanishing directions.
    pub triads: &'a [TriadOutcome],
    /// Each picture's segments, unfiltered.
    pub lines: &'a [Vec<LineSegment>],
    /// Each picture's working frame.
    pub frames: &'a [WorkingFrame],
    /// The joined pairs.
    pub edges: &'a [PairMatches],
    /// Grid vertices carried across the pairs, both directions. May be empty: then overlaps correct nothing.
    pub overlaps: &'a [OverlapWarp],
    /// Largest cell of the grids of `overlaps`, working pixels.
    pub cell_px: f64,
    /// The options the triads were found with; they choose the segments of the joint refinement too.
    pub vanishing: &'a VanishingOptions,
    /// Clockwise turn in radians that the user wants on top of upright for the whole panorama.
    pub turn: f64,
    /// The reference picture; only the published global similarity priors heed it.
    pub reference: usize,
}

/// How the vanishing directions took part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Guidance {
    /// Whether lines guide the prior; otherwise straightening does.
    pub used: bool,
    /// Whether the frame guides that the segments of all pictures together stand for, since the pictures' own directions
    /// did not agree.
    pub pooled: bool,
    /// How far the best frame of the pooled search stands out, in standard deviations over all frames tried; `None`
    /// without enough segments.
    pub significance: Option<f64>,
    /// Standard deviation of the vertical in radians, by a jackknife over the pictures; `None` where it was not asked for.
    pub vertical_deviation: Option<f64>,
    /// Whether the vertical alone guides, since the gate refused the dominant directions.
    pub vertical_only: bool,
    /// The divergence epsilon; `None` without any agreeing picture.
    pub divergence: Option<f64>,
    /// The largest divergence allowed.
    pub threshold: f64,
    /// Share of the pictures whose directions agree with the dominant ones.
    pub inlier_ratio: f64,
    /// The gate's clause that refused the dominant directions, in words.
    pub failed_clause: Option<String>,
    /// Rows of the dominant directions (columns) in the level world, if accepted: one column is (0, 1, 0) up to sign,
    /// rounding.
    pub dominant: Option<[[f64; 3]; 3]>,
    /// Pictures that agree with the dominant directions (the paper's Psi), ascending.
    pub inliers: Vec<usize>,
    /// Per picture the sum of squared distances of its directions from the dominant ones; `None` without a triad.
    pub residuals: Vec<Option<f64>>,
    /// Per picture the weight psi_i of its own roll; 0 for pictures without one.
    pub weights: Vec<f64>,
    /// Score of the strongest rival of the vertical over the vertical's own, from the segments of all pictures; `None`
    /// where the dominant directions were accepted and where there are no segments.
    pub vertical_rivalry: Option<f64>,
    /// Share of the segments' weight that supports the vertical; `None` as above.
    pub vertical_share: Option<f64>,
}

/// How each picture should be turned and scaled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimilarityPrior {
    /// Clockwise turns theta_i in radians.
    pub theta: Vec<f64>,
    /// Scales s_i, of mean 1.
    pub scale: Vec<f64>,
    /// How the vanishing directions took part.
    pub guidance: Guidance,
    /// Rows of the rotation that takes the cameras' world to a level one: y down, the mean viewing direction above z.
    pub level_from_world: [[f64; 3]; 3],
    /// Per picture the rows of the rotation from the cameras' world to the camera as its own segments correct it; the
    /// rotation given where nothing does.
    pub camera_from_world: Vec<[[f64; 3]; 3]>,
    /// Roll rho_i in radians of each of these cameras in the level world: the turn that stands it upright.
    pub roll: Vec<f64>,
}

/// The rotation that levels the common frame by the cameras alone; for the frame see [`SimilarityPrior::level_from_world`].
pub(crate) fn level_by_cameras(cameras: &[Camera]) -> Matrix3<f64> {
    let rotations: Vec<Matrix3<f64>> = cameras.iter().map(|camera| camera.rotation()).collect();
    straighten::level_from_world(&straighten::straighten(&rotations).down, &rotations)
}

impl SimilarityPrior {
    /// The rotation that levels the cameras' world.
    pub fn level_from_world(&self) -> Matrix3<f64> {
        matrix_from_rows(&self.level_from_world)
    }

    /// The cameras as the segments correct them: `cameras` must be those that the prior was made from.
    pub fn corrected_cameras(&self, cameras: &[Camera]) -> Vec<Camera> {
        let corrected = |(camera, &camera_from_world): (&Camera, _)| Camera { camera_from_world, ..*camera };
        cameras.iter().zip(&self.camera_from_world).map(corrected).collect()
    }
}

/// What a user can do when lines do not guide the panorama.
const REFUSED_HINT: &str =
    "The panorama is levelled by the cameras alone; pictures that show upright edges level it better";

/// The stage's name in errors and generators.
const STAGE: &str = "similarity";

/// Finds the similarity prior of a connected set of pictures.
///
/// The world frame of the cameras is arbitrary and does not affect the result. The reference affects the published global
/// similarity priors alone.
///
/// # Errors
/// [`Error::Unsolvable`] if there are no pictures, the lists differ in length, an edge or the reference names a picture
/// that does not exist, a camera is not finite, or overlaps come without a usable grid; [`Error::Cancelled`].
///
/// # Source
/// The paper's sections on the vanishing point guided prior; see the modules for equations and departures.
pub fn run(input: &PriorInput<'_>, options: &SimilarityOptions, context: &StageContext<'_>) -> Result<SimilarityPrior> {
    check(input)?;
    context.check_cancelled()?;
    let rotations: Vec<Matrix3<f64>> = input.cameras.iter().map(Camera::rotation).collect();
    let focals: Vec<f64> = input.cameras.iter().map(|camera| camera.focal_px).collect();
    let straightened = straighten::straighten(&rotations);
    let level = straighten::straighten_with_pitch(&rotations, options.pitch_prior);
    let unguided = || vpg::unguided(input.cameras.len(), options);
    let (guidance, upright) = match options.prior {
        PriorMethod::VanishingPoints => vpg::guide(input, &rotations, &straightened, &level, options, context)?,
        PriorMethod::Straightening => (unguided(), None),
        PriorMethod::Gsp2d => (unguided(), Some(gsp_2d::upright(input, straightened.down))),
        PriorMethod::Gsp3d => (unguided(), Some(gsp_3d::upright(input, &rotations, straightened.down))),
    };
    if let Some(clause) = guidance.failed_clause.as_ref().filter(|_| !guidance.used) {
        context.report(Diagnostic::note("vanishing-guidance-refused", Subject::stage(STAGE), clause, REFUSED_HINT));
    }
    let upright = upright.unwrap_or_else(|| fallback(&rotations, &level));
    let level_from_world = straighten::level_from_world(&upright.down, &rotations);
    let mut guidance = guidance;
    guidance.dominant = guidance.dominant.map(|world| rows_of(&(level_from_world * matrix_from_rows(&world))));
    Ok(SimilarityPrior {
        theta: upright.theta.iter().map(|theta| wrap_angle(theta + input.turn)).collect(),
        scale: match options.prior {
            PriorMethod::Gsp2d | PriorMethod::Gsp3d => scale::focal_scales(&focals),
            PriorMethod::VanishingPoints | PriorMethod::Straightening => scale::scales(input.edges, &focals),
        },
        guidance,
        level_from_world: rows_of(&level_from_world),
        roll: rolls(&upright.down, &upright.rotations),
        camera_from_world: upright.rotations.iter().map(rows_of).collect(),
    })
}

/// A vertical and the turns that follow from it.
struct Upright {
    /// Down, in the cameras' world.
    down: Vector3<f64>,
    /// Turns in radians, without the one that the user wants.
    theta: Vec<f64>,
    /// The cameras' rotations, as far as lines correct them.
    rotations: Vec<Matrix3<f64>>,
}

/// The roll of each camera for a vertical in their world.
fn rolls(down: &Vector3<f64>, rotations: &[Matrix3<f64>]) -> Vec<f64> {
    rotations.iter().map(|rotation| roll_from_down(&(rotation * down))).collect()
}

/// Straightened cameras.
///
/// # Departures
/// The paper falls back to the global similarity prior, which corrects turns that an overlap contradicts. Level pictures
/// that look up are twisted against each other although neither is rolled; that correction rolls them by the twist, which
/// adds up along a row. Their place on the level sphere has the twist already.
fn fallback(rotations: &[Matrix3<f64>], down: &Vector3<f64>) -> Upright {
    Upright { down: *down, theta: rolls(down, rotations), rotations: rotations.to_vec() }
}

fn check(input: &PriorInput<'_>) -> Result<()> {
    let count = input.cameras.len();
    let unsolvable = |why: String| Err(Error::unsolvable(STAGE, "similarity prior", why, "Give one entry per picture"));
    if count == 0 {
        return unsolvable("there are no pictures".to_owned());
    }
    if [input.triads.len(), input.lines.len(), input.frames.len()].iter().any(|&length| length != count) {
        return unsolvable(format!("cameras, triads, segments and frames differ in number from {count}"));
    }
    if let Some(edge) = input.edges.iter().find(|edge| edge.a >= count || edge.b >= count || edge.a == edge.b) {
        return unsolvable(format!("there is no pair {} - {} among {count} pictures", edge.a, edge.b));
    }
    if input.reference >= count {
        return unsolvable(format!("there is no reference {} among {count} pictures", input.reference));
    }
    let finite = |camera: &Camera| {
        camera.focal_px > 0.0
            && camera.focal_px.is_finite()
            && camera.camera_from_world.iter().flatten().all(|value| value.is_finite())
    };
    let frame_is_sane = |frame: &WorkingFrame| frame.width > 0.0 && frame.height > 0.0 && frame.diagonal().is_finite();
    let has_grid = input.cell_px >= 1.0 && input.frames.iter().all(frame_is_sane);
    if !input.overlaps.is_empty() && !has_grid {
        return unsolvable(format!("there is no grid of cells of {} pixels on every picture", input.cell_px));
    }
    match input.cameras.iter().position(|camera| !finite(camera)) {
        Some(index) => unsolvable(format!("camera {index} is not finite")),
        None => Ok(()),
    }
}
