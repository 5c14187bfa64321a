//! The cameras that some of the pairs tell: start values, then all refined together.

use trueup_core::camera::Camera;
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::{Result, StageContext};

use super::bundle::Parameters;
use super::expected_focal::OpenFocal;
use super::intrinsics::InitialIntrinsics;
use super::observations::{MATCHES_PER_PAIR, MATCHES_PER_PAIR_FOR_LENSES, Observations};
use super::options::CameraOptions;
use super::prior::CameraPrior;
use super::refinement::{self, RefinementInput};
use super::straightness::CurveObservations;
use super::{focal, rotations};
use crate::stitch_graph::{GraphEdge, StitchGraph};

/// The cameras by some of the pairs.
pub(super) struct Solution {
    pub(super) cameras: Vec<Camera>,
    /// As the matches alone have them.
    pub(super) by_matches: Vec<Camera>,
    /// Where these leave focal lengths open.
    pub(super) opened: Option<OpenFocal>,
    pub(super) per_picture_focal: bool,
    pub(super) focal_failed: bool,
    /// See [`refinement::Refined`].
    pub(super) lens_doubt_px: Option<f64>,
}

/// What was seen of the photographs.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub(super) pairs: &'a [&'a PairMatches],
    pub(super) curves: &'a CurveObservations,
    /// Line segments of each photograph.
    pub(super) lines: &'a [Vec<LineSegment>],
}

/// The cameras by what was seen, relative to photograph `anchor`.
pub(super) fn solve(
    priors: &[CameraPrior],
    Seen { pairs, curves, lines }: Seen<'_>,
    anchor: usize,
    options: &CameraOptions,
    context: &StageContext,
) -> Result<Solution> {
    let observations = Observations::choose(priors, pairs, MATCHES_PER_PAIR);
    let for_lenses = Observations::choose(priors, pairs, MATCHES_PER_PAIR_FOR_LENSES);
    let intrinsics = focal::initial_intrinsics(priors, pairs, &observations, options);
    let relative = rotations::relative_rotations(priors, pairs, &observations, &intrinsics);
    let graph = graph_of(priors.len(), pairs.iter().copied());
    let rotations = rotations::average(&graph, pairs, &relative, anchor);
    let InitialIntrinsics { focal_px, lenses } = intrinsics;
    let start = Parameters { focal_px, rotations, lenses };
    let input = RefinementInput { priors, observations: &observations, for_lenses: &for_lenses, curves, lines, anchor };
    let refined = refinement::refine(input, &start, options, context)?;
    Ok(Solution {
        cameras: refined.parameters.cameras(priors),
        by_matches: refined.by_matches.as_ref().map_or(&refined.parameters, |found| &found.parameters).cameras(priors),
        opened: refined.by_matches.map(|found| found.opened),
        per_picture_focal: refined.per_picture_focal,
        focal_failed: refined.focal_failed,
        lens_doubt_px: refined.lens_doubt_px,
    })
}

/// The stitch graph of pairs.
pub(super) fn graph_of<'a>(photographs: usize, pairs: impl Iterator<Item = &'a PairMatches>) -> StitchGraph {
    StitchGraph::from_edges(photographs, pairs.map(GraphEdge::of).collect())
}
