//! Focal lengths and rotations of the pictures of one component: the paper's R_i.
//!
//! Start values come from metadata, from the pair homographies and from a search over a common focal length
//! (`focal`); rotations from the spanning tree and from averaging over all edges (`rotations`); both are refined
//! together by bundle adjustment (`bundle`).

mod bundle;
pub mod focal;
mod observations;
mod rotations;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};

use crate::stitch_graph::{GraphEdge, StitchGraph};
use crate::{full_turn, similarity};
use bundle::{FocalModel, Parameters};
use observations::Observations;

trueup_core::choice! {
    /// Which pictures share a focal length.
    pub enum FocalSharing {
        /// One focal length per camera and size, unless the pictures themselves say that it varies.
        Auto = "auto",
        /// One focal length per camera and size.
        Shared = "shared",
        /// A focal length for every picture.
        PerPicture = "per-picture",
    }
}

trueup_core::options! {
    /// How cameras are found.
    pub struct CameraOptions("cameras") {
        /// Which pictures share a focal length.
        focal_sharing: FocalSharing = FocalSharing::Auto, Allowed::Any, "";
        /// Relative spread of separately estimated focal lengths above which `auto` lets every picture have its own.
        zoom_spread: f64 = 0.03, between(0.001, 1.0), "";
        /// Matches used per pair in bundle adjustment, spread evenly over the overlap.
        matches_per_pair: usize = 200, between(8.0, 10000.0), "matches";
        /// Matches used in all; pairs share them evenly when there are many.
        matches_in_all: usize = 16000, between(100.0, 1000000.0), "matches";
        /// Distance beyond which the influence of a match grows only linearly, in the first pass.
        coarse_huber_px: f64 = 20.0, between(0.1, 1000.0), "working px";
        /// The same in the final pass.
        fine_huber_px: f64 = 2.0, between(0.05, 1000.0), "working px";
        /// Most iterations of the final pass.
        max_iterations: usize = 100, between(1.0, 1000.0), "iterations";
        /// Standard deviation of a focal length from metadata, relative.
        known_focal_sd: f64 = 0.1, between(0.001, 10.0), "";
        /// Standard deviation of an estimated start value of the focal length, relative.
        estimated_focal_sd: f64 = 0.3, between(0.001, 10.0), "";
        /// Root mean square residual above which a pair is set aside, if the pictures stay connected without it.
        max_pair_rms_px: f64 = 10.0, between(0.5, 1000.0), "working px";
        /// Smallest focal length, relative to the picture's longer side.
        min_focal: f64 = 0.3, between(0.05, 1.0), "longer sides";
        /// Largest focal length, relative to the picture's longer side.
        max_focal: f64 = 10.0, between(1.0, 1000.0), "longer sides";
    }
}

/// What is known of a picture's camera beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPrior {
    /// The picture's working frame.
    pub frame: WorkingFrame,
    /// Focal length from metadata in working pixels, if any.
    pub focal_px: Option<f64>,
    /// Pictures with equal numbers were taken with one camera at one size and may share a focal length.
    pub camera_group: usize,
}

/// The cameras of one component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cameras {
    /// One camera per picture, in working pixels; the reference picture's rotation is the identity.
    pub cameras: Vec<Camera>,
    /// Whether every picture has a focal length of its own.
    pub per_picture_focal: bool,
    /// Root mean square residual of each pair in working pixels, in the order of the pairs given.
    pub pair_rms_px: Vec<f64>,
    /// Pairs (positions in the list given) that contradict the others and take no further part.
    pub contradicting: Vec<usize>,
}

/// Finds the cameras of pictures 0..N that `pairs` connect.
///
/// `names` are for messages. The rotations are relative to picture `reference`. Everything is solved relative to the
/// central picture and turned in the end, so that the shape does not depend on the reference: a solution that starts
/// from another picture may end in another local minimum where parallax leaves several.
///
/// A focal length that metadata or pictures get wrong never ends the run: non-finite or absurd results are replaced by a
/// solution with the focal lengths fixed to their median, and a diagnostic says so.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
///
/// # Source
/// Brown and Lowe, "Automatic panoramic image stitching using invariant features" (2007), section 4.
///
/// # Departures
/// Pictures are not added one at a time: averaging the relative rotations over all edges first gives a start from which
/// all cameras can be refined together, at a fraction of the cost. Focal lengths are shared within a camera unless the
/// data contradict it, which keeps short rows from drifting.
pub fn run(
    priors: &[CameraPrior],
    pairs: &[PairMatches],
    reference: usize,
    options: &CameraOptions,
    context: &StageContext,
) -> Result<Cameras> {
    let everything: Vec<usize> = (0..priors.len()).collect();
    let anchor =
        StitchGraph::from_edges(priors.len(), pairs.iter().map(edge_of).collect()).central_picture(&everything);
    let mut active: Vec<usize> = (0..pairs.len()).collect();
    let mut solution = solve(priors, pairs, &active, anchor, options, context)?;
    let contradicting = contradicting_pairs(&solution.cameras, pairs, &solution.pair_rms_px, options);
    if !contradicting.is_empty() {
        active.retain(|position| contradicting.binary_search(position).is_err());
        for &position in &contradicting {
            let pair = &pairs[position];
            context.report(Diagnostic::note(
                "pair-contradicts",
                Subject::Pair(pair.a, pair.b),
                format!(
                    "this overlap contradicts the others by {:.1} px and is not used",
                    solution.pair_rms_px[position]
                ),
                "",
            ));
        }
        solution = solve(priors, pairs, &active, anchor, options, context)?;
    }
    turn_to(&mut solution.cameras, reference);
    if solution.focal_failed {
        context.report(Diagnostic::warning(
            "focal-uncertain",
            Subject::stage("cameras"),
            "the focal length cannot be told from these pictures; a common value was used",
            "Keep the camera's metadata in the files, or overlap the pictures more.",
        ));
    }
    Ok(Cameras {
        cameras: solution.cameras,
        per_picture_focal: solution.per_picture_focal,
        pair_rms_px: solution.pair_rms_px,
        contradicting,
    })
}

/// Makes the rotation of picture `reference` the identity.
fn turn_to(cameras: &mut [Camera], reference: usize) {
    let Some(back) = cameras.get(reference).map(|camera| camera.rotation().transpose()) else { return };
    for camera in cameras {
        camera.set_rotation(&(camera.rotation() * back));
    }
}

struct Solution {
    cameras: Vec<Camera>,
    per_picture_focal: bool,
    pair_rms_px: Vec<f64>,
    focal_failed: bool,
}

fn solve(
    priors: &[CameraPrior],
    pairs: &[PairMatches],
    active: &[usize],
    anchor: usize,
    options: &CameraOptions,
    context: &StageContext,
) -> Result<Solution> {
    let used: Vec<&PairMatches> = active.iter().map(|&position| &pairs[position]).collect();
    let observations = Observations::choose(priors, &used, options);
    let start_focal = focal::initial_focal_lengths(priors, &used, &observations, options);
    let relative = rotations::relative_rotations(priors, &used, &observations, &start_focal);
    let graph = StitchGraph::from_edges(priors.len(), used.iter().map(|&pair| edge_of(pair)).collect());
    let rotations = rotations::average(&graph, &used, &relative, anchor);
    let start = Parameters { focal_px: start_focal.clone(), rotations };
    let (parameters, per_picture_focal, focal_failed) = refine(priors, &observations, start, anchor, options, context)?;

    let cameras: Vec<Camera> = (0..priors.len())
        .map(|k| {
            let frame = &priors[k].frame;
            Camera::new(parameters.focal_px[k], frame.width, frame.height, &parameters.rotations[k])
        })
        .collect();
    let pair_rms_px = pairs.iter().map(|pair| observations::pair_rms(&cameras, pair)).collect();
    Ok(Solution { cameras, per_picture_focal, pair_rms_px, focal_failed })
}

/// Bundle adjustment from coarse to fine with the focal model that the options and the data ask for.
fn refine(
    priors: &[CameraPrior],
    observations: &Observations,
    start: Parameters,
    anchor: usize,
    options: &CameraOptions,
    context: &StageContext,
) -> Result<(Parameters, bool, bool)> {
    let problem =
        bundle::Problem { priors, observations, start_focal: start.focal_px.clone(), reference: anchor, options };
    // Start values that already differ (metadata of a zoom) keep their ratios inside a shared model.
    let shared = FocalModel::shared(priors);
    let own = FocalModel::per_picture(priors.len());
    let mut per_picture = options.focal_sharing == FocalSharing::PerPicture;
    let first_model = if per_picture { &own } else { &shared };

    let coarse = problem.minimize(start.clone(), first_model, options.coarse_huber_px, context)?;
    let mut fine = problem.minimize(coarse, first_model, options.fine_huber_px, context)?;
    if options.focal_sharing == FocalSharing::Auto && priors.len() > 1 {
        let free = problem.minimize(fine.clone(), &own, options.coarse_huber_px, context)?;
        if problem.is_sound(&free) && focal_spread(&shared, &fine.focal_px, &free.focal_px) > options.zoom_spread {
            fine = problem.minimize(free, &own, options.fine_huber_px, context)?;
            per_picture = true;
        }
    }
    if problem.is_sound(&fine) {
        return Ok((fine, per_picture, false));
    }
    let mut sorted = start.focal_px.clone();
    sorted.sort_by(f64::total_cmp);
    let common = sorted[sorted.len() / 2];
    let fixed = Parameters { focal_px: vec![common; priors.len()], rotations: start.rotations };
    let fixed_model = FocalModel::fixed(priors.len());
    let coarse = problem.minimize(fixed, &fixed_model, options.coarse_huber_px, context)?;
    Ok((problem.minimize(coarse, &fixed_model, options.fine_huber_px, context)?, false, true))
}

/// The largest robust spread, within a group, of the ratio of free to shared focal lengths: half the range between the
/// quartile-like order statistics, which one runaway picture cannot move.
fn focal_spread(shared: &FocalModel, shared_focal: &[f64], free_focal: &[f64]) -> f64 {
    let mut spread: f64 = 0.0;
    for group in 0..shared.parameters {
        let mut logs: Vec<f64> = (0..shared_focal.len())
            .filter(|&k| shared.parameter_of[k] == Some(group))
            .map(|k| (free_focal[k] / shared_focal[k]).ln())
            .collect();
        if logs.len() < 2 {
            continue;
        }
        logs.sort_by(f64::total_cmp);
        let (low, high) = (logs.len() / 4, logs.len() - 1 - logs.len() / 4);
        spread = spread.max(0.5 * (logs[high] - logs[low]));
    }
    spread
}

/// Pairs whose residual is too large, worst first as long as the rest stays connected; ascending positions.
///
/// Where that would open a full turn, pairs that close it are spared unless they are far too bad: what they contradict by is
/// then mostly what the turn tells of the focal length, which no other pair tells as well.
fn contradicting_pairs(
    cameras: &[Camera],
    pairs: &[PairMatches],
    pair_rms_px: &[f64],
    options: &CameraOptions,
) -> Vec<usize> {
    /// Residual up to which a pair that closes a full turn is spared, in units of that of other pairs.
    const SPARED: f64 = 2.0;
    let pictures = cameras.len();
    let mut suspects: Vec<usize> =
        (0..pairs.len()).filter(|&position| pair_rms_px[position] > options.max_pair_rms_px).collect();
    suspects.sort_by(|&first, &second| pair_rms_px[second].total_cmp(&pair_rms_px[first]).then(first.cmp(&second)));
    let mut dropped: Vec<usize> = Vec::new();
    for suspect in suspects {
        let rest: Vec<GraphEdge> = (0..pairs.len())
            .filter(|position| *position != suspect && !dropped.contains(position))
            .map(|position| edge_of(&pairs[position]))
            .collect();
        if StitchGraph::from_edges(pictures, rest).components.len() == 1 {
            dropped.push(suspect);
        }
    }
    let level = similarity::level_by_cameras(cameras);
    let goes_round = |left_out: &dyn Fn(usize) -> bool| {
        let edges: Vec<GraphEdge> = (0..pairs.len())
            .filter(|&position| !left_out(position))
            .map(|position| edge_of(&pairs[position]))
            .collect();
        full_turn::goes_round(cameras, &edges, &level)
    };
    if goes_round(&|_| false) && !goes_round(&|position| dropped.contains(&position)) {
        let all = dropped.clone();
        let closes = |pair: usize| goes_round(&|position| position != pair && all.contains(&position));
        dropped.retain(|&pair| pair_rms_px[pair] > SPARED * options.max_pair_rms_px || !closes(pair));
    }
    dropped.sort_unstable();
    dropped
}

fn edge_of(pair: &PairMatches) -> GraphEdge {
    GraphEdge { a: pair.a, b: pair.b, weight: pair.agreeing }
}

/// Rotation of picture j seen from picture i: `R_j R_i^T`.
pub(crate) fn relative_rotation(first: &Matrix3<f64>, second: &Matrix3<f64>) -> Matrix3<f64> {
    second * first.transpose()
}

#[cfg(test)]
mod tests;
