//! Start values for focal lengths and lenses.

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_core::geometry::Homography;
use trueup_core::lens::{TriedLens, tried_lenses};
use trueup_core::matches::PairMatches;

use super::homography_focal::{FocalLengths, focal_from_homography};
use super::intrinsics::{InitialIntrinsics, LensState};
use super::local_focal::local_focal_lengths;
use super::observations::{Observations, PairObservations};
use super::options::{CameraOptions, LensKind, StartFocal};
use super::prior::CameraPrior;
use super::rotations::fit_rotation;

/// A normal lens: the focal length equals the diagonal. Used when the photographs tell nothing.
const NORMAL_LENS: f64 = 1.0;
/// Candidates for the common focal length run from a very wide lens, in diagonals, ...
const SHORTEST: f64 = 0.3;
/// ... in steps of 8 % ...
const STEP: f64 = 1.08;
/// ... to a long one.
const CANDIDATES: i32 = 36;
/// Matches of a pair, spread evenly, that candidates are judged by.
const SAMPLE: usize = 48;
/// Distance in working pixels at which the cost of a match stops growing while candidates are judged.
const MATCH_COST_LIMIT_PX: f64 = 20.0;

/// Mean error of the matches, working pixels, above which another lens is looked for: more than parallax mostly leaves.
const MISFIT_PX: f64 = 4.0;
/// Share of a pinhole's errors that another lens may leave to be believed.
const LENS_SHARE: f64 = 0.6;

/// A focal length and a lens for every photograph: the lens that was told, and one common to all others, of this kind.
pub(super) fn initial_intrinsics(
    priors: &[CameraPrior],
    pairs: &[&PairMatches],
    observations: &Observations,
    options: &CameraOptions,
) -> InitialIntrinsics {
    let kind = options.kind_of_lens();
    let with_others = |lens: LensState| priors.iter().map(|prior| prior.lens.map_or(lens, LensState::from)).collect();
    let lenses: Vec<LensState> = with_others(LensState::default());
    if options.start_focal == StartFocal::LocalHomographies && kind != LensKind::Fisheye {
        let local = local_focal_lengths(priors, pairs);
        let known = known_focal_lengths(priors);
        let focal_px = known.iter().zip(local).map(|(known, local)| known.unwrap_or(local)).collect();
        return InitialIntrinsics { focal_px, lenses };
    }
    let straight = InitialIntrinsics { focal_px: initial_focal_lengths(priors, pairs, observations, &lenses), lenses };
    let InitialIntrinsics { focal_px, lenses } = &straight;
    if kind == LensKind::Pinhole || priors.iter().all(|prior| prior.lens.is_some()) {
        return straight;
    }
    let matches: usize = observations.pairs.iter().map(|pair| pair.matches.len()).sum();
    let is_fisheye = kind == LensKind::Fisheye;
    let by_pinhole = common_cost(priors, observations, focal_px, lenses);
    if !is_fisheye && by_pinhole <= MISFIT_PX * matches as f64 {
        return straight;
    }
    let known = known_focal_lengths(priors);
    let suits = |lens: &TriedLens| match kind {
        LensKind::Fisheye => lens.lens.is_fisheye(),
        LensKind::Rectilinear => !lens.lens.is_fisheye(),
        _ => true,
    };
    let start_with = |TriedLens { lens, relative_focal }: TriedLens| {
        let focal_px = priors.iter().zip(&known).map(|(prior, known)| {
            known.unwrap_or_else(|| {
                prior.believable_focal_px(relative_focal * prior.frame.width.max(prior.frame.height))
            })
        });
        let (focal_px, lenses): (Vec<f64>, Vec<LensState>) =
            (focal_px.collect(), with_others(LensState { terms: lens.terms(), ..LensState::default() }));
        (common_cost(priors, observations, &focal_px, &lenses), InitialIntrinsics { focal_px, lenses })
    };
    let tried: Vec<(f64, InitialIntrinsics)> = tried_lenses().into_par_iter().filter(suits).map(start_with).collect();
    let best = tried.into_iter().min_by(|one, other| one.0.total_cmp(&other.0));
    best.filter(|(cost, _)| is_fisheye || *cost < LENS_SHARE * by_pinhole).map_or(straight, |(_, start)| start)
}

/// How badly rotations of these cameras explain all pairs.
fn common_cost(priors: &[CameraPrior], observations: &Observations, focal_px: &[f64], lenses: &[LensState]) -> f64 {
    observations.pairs.iter().map(|pair| rotation_cost(priors, focal_px, lenses, pair)).sum()
}

/// The focal lengths that metadata state.
fn known_focal_lengths(priors: &[CameraPrior]) -> Vec<Option<f64>> {
    priors
        .iter()
        .map(|prior| prior.focal_px.filter(|focal| focal.is_finite()).map(|focal| prior.believable_focal_px(focal)))
        .collect()
}

/// A focal length for every photograph: from metadata where there is any, else from the photographs.
///
/// Photographs without metadata get a common value (relative to their diagonal), found by trying a range of values and
/// the homographies' own estimates and keeping the one under which rotations explain the matches best.
fn initial_focal_lengths(
    priors: &[CameraPrior],
    pairs: &[&PairMatches],
    observations: &Observations,
    lenses: &[LensState],
) -> Vec<f64> {
    let known = known_focal_lengths(priors);
    let relative = common_relative_focal(priors, pairs, observations, &known, lenses);
    filled_in(priors, &known, relative)
}

/// The known focal lengths; for the others `relative` diagonals.
fn filled_in(priors: &[CameraPrior], known: &[Option<f64>], relative: f64) -> Vec<f64> {
    priors
        .iter()
        .zip(known)
        .map(|(prior, known)| known.unwrap_or_else(|| prior.believable_focal_px(relative * prior.frame.diagonal())))
        .collect()
}

/// The focal length, in diagonals, that explains the pairs best when all photographs without metadata share it.
fn common_relative_focal(
    priors: &[CameraPrior],
    pairs: &[&PairMatches],
    observations: &Observations,
    known: &[Option<f64>],
    lenses: &[LensState],
) -> f64 {
    if known.iter().all(Option::is_some) {
        return NORMAL_LENS;
    }
    let mut candidates: Vec<f64> = (0..CANDIDATES).map(|k| SHORTEST * STEP.powi(k)).collect();
    candidates.extend(median_from_homographies(priors, pairs));
    let cost = |relative: f64| common_cost(priors, observations, &filled_in(priors, known, relative), lenses);
    let costs: Vec<f64> = candidates.par_iter().map(|&candidate| cost(candidate)).collect();
    let best = (0..candidates.len()).min_by(|&one, &other| costs[one].total_cmp(&costs[other]));
    best.filter(|&best| costs[best] > 0.0 && costs[best].is_finite()).map_or(NORMAL_LENS, |best| candidates[best])
}

/// Median over pairs and photographs of the homographies' focal lengths, in diagonals.
fn median_from_homographies(priors: &[CameraPrior], pairs: &[&PairMatches]) -> Option<f64> {
    let mut estimates = Vec::new();
    for pair in pairs {
        let Some(rows) = &pair.b_from_a else { continue };
        let b_from_a = Homography::from_rows(rows);
        let frames = [&priors[pair.a].frame, &priors[pair.b].frame];
        if let Some(FocalLengths { source, target }) = focal_from_homography(&b_from_a, frames) {
            estimates.push(source / priors[pair.a].frame.diagonal());
            estimates.push(target / priors[pair.b].frame.diagonal());
        }
    }
    estimates.sort_by(f64::total_cmp);
    estimates.get(estimates.len() / 2).copied()
}

/// How badly the best rotation explains a pair: Huber-like sum of transfer errors over a subset of the matches.
fn rotation_cost(priors: &[CameraPrior], focal: &[f64], lenses: &[LensState], pair: &PairObservations) -> f64 {
    let step = pair.matches.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<_> = pair.matches.iter().copied().step_by(step).collect();
    let (prior_a, prior_b) = (&priors[pair.a], &priors[pair.b]);
    let camera_a = lenses[pair.a].on(prior_a.unturned_camera(focal[pair.a]));
    let mut turned = lenses[pair.b].on(prior_b.unturned_camera(focal[pair.b]));
    turned.set_rotation(&fit_rotation(&camera_a, &turned, &sample));
    let sum: f64 = sample
        .iter()
        .map(|one| {
            let error = camera_a
                .transfer(&turned, Vector2::from(one.in_a))
                .map_or(MATCH_COST_LIMIT_PX, |place| (place - Vector2::from(one.in_b)).norm());
            error.min(MATCH_COST_LIMIT_PX)
        })
        .sum();
    // Pairs count by their matches, not by the size of the sample.
    sum * pair.matches.len() as f64 / sample.len().max(1) as f64
}
