//! One pair: whether its photographs overlap, and all its matches.

use nalgebra::{Matrix3, Vector2};
use rand::Rng;
use trueup_core::camera::Camera;
use trueup_core::geometry::Homography;
use trueup_core::matches::{PairMatches, PairVerdict, PointMatch, PointMatches};
use trueup_core::options::StageOptions;
use trueup_core::source::WorkingFrame;
use trueup_core::told_lens::ToldLens;
use trueup_core::{Error, Result, StageContext};

use super::Demand;
use super::compared::{ComparedPair, MAX_SAMPLES};
use super::consistent::matches_elsewhere;
use super::matched_points::MatchedPoints;
use super::options::MatchingOptions;
use super::overlap::PredictedOverlap;
use super::planes::find_planes;
use super::putative::PutativeMatch;
use super::ransac::{Consensus, HomographySearch, NoConsensus, find_homography};
use super::refined::{Refiner, ScaledMatch};
use super::resemblance::Resemblance;
use super::turned::{TurnConsensus, TurnedLens, find_turned_lens};
use crate::features::Features;

/// alpha of the Brown-Lowe test: a pair is joined if more than alpha + beta n_f of its n_f matches in the predicted
/// overlap agree (Brown and Lowe, section 3.2).
const BROWN_LOWE_ALPHA: f64 = 8.0;

/// beta of the Brown-Lowe test, see [`BROWN_LOWE_ALPHA`].
const BROWN_LOWE_BETA: f64 = 0.3;

/// Fewest agreeing matches of a pair that the user's graph joins.
const MIN_INLIERS_BY_GRAPH: usize = 8;

/// Largest factor by which a homography may enlarge or reduce areas in the overlap it predicts.
const MAX_AREA_RATIO: f64 = 20.0;

/// A turned lens stands in for the homography if this many times as many matches agree with it ...
const TURN_FACTOR: f64 = 1.25;
/// ... and this many more: a homography has two unknowns more to please wrong matches with.
const TURN_MORE: usize = 15;

/// Fewest matches elsewhere in depth that are believed if they are confirmed by what surrounds them. Beside a plane,
/// any two tell where the epipole is and so agree.
const FEWEST_CONFIRMED: usize = 3;
/// The share of them that must be confirmed, of that of matches on planes. Of 27 overlaps of photographs from one point
/// in which eight or more were found, all false, 19 come to none and one to this with three confirmed; of 41 overlaps
/// of seven photographed sets 33 do, most of these to twice as much.
const LEAST_CONFIRMED: f64 = 0.3;
/// Matches on planes that are asked; more hardly change their share.
const ASKED_ON_PLANES: usize = 60;
/// Fewest that are believed where nothing is known of what surrounds features: of photographs from one point six false
/// ones came together at most.
const FEWEST_UNCONFIRMED: usize = 8;

/// A photograph of a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct PhotographFeatures<'a> {
    /// Its index among the photographs.
    pub(super) index: usize,
    /// Its features.
    pub(super) features: &'a Features,
    /// The frame these are measured in.
    pub(super) frame: &'a WorkingFrame,
    /// What the user told of its lens.
    pub(super) told: ToldLens,
}

/// Two photographs to be matched, the smaller index first.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairInput<'a> {
    pub(super) a: PhotographFeatures<'a>,
    pub(super) b: PhotographFeatures<'a>,
    /// What they must show to be joined.
    pub(super) demand: Demand,
}

impl<'a> PairInput<'a> {
    /// Of two photographs in any order.
    pub(super) fn new(one: PhotographFeatures<'a>, other: PhotographFeatures<'a>, demand: Demand) -> Self {
        let (a, b) = if one.index <= other.index { (one, other) } else { (other, one) };
        Self { a, b, demand }
    }

    fn check(&self) -> Result<()> {
        if self.a.index == self.b.index {
            return Err(Error::input(
                format!("photograph {}", self.a.index),
                "it is paired with itself",
                "Pair different photographs.",
            ));
        }
        self.a.features.check(self.a.index)?;
        self.b.features.check(self.b.index)
    }

    /// Whether a homography is believable in the overlap it predicts.
    fn is_plausible(&self, map: &Homography) -> bool {
        PredictedOverlap::new(*map, self.a.frame, self.b.frame)
            .is_some_and(|overlap| overlap.is_plausible(MAX_AREA_RATIO))
    }

    /// How many matches must agree when `in_overlap` lie in the predicted overlap: as many as the test wants, or those
    /// few that suffice for a pair of the user's graph.
    fn needed(in_overlap: usize, demand: Demand, options: &MatchingOptions) -> usize {
        let more_than = BROWN_LOWE_ALPHA + BROWN_LOWE_BETA * in_overlap as f64;
        let tested = options.min_inliers.max(more_than.floor() as usize + 1);
        if demand == Demand::Graph { MIN_INLIERS_BY_GRAPH.min(tested) } else { tested }
    }

    /// The verdict on a pair whose matches are counted.
    fn judge(&self, pair: &mut PairMatches, options: &MatchingOptions) {
        pair.needed = Self::needed(pair.in_overlap, self.demand, options);
        pair.verdict = if pair.agreeing >= Self::needed(pair.in_overlap, Demand::Test, options) {
            PairVerdict::Joined
        } else if self.demand == Demand::Graph && pair.agreeing >= pair.needed {
            PairVerdict::JoinedByGraph
        } else {
            PairVerdict::TooFewInliers
        };
    }
}

/// The turned lens that clearly more matches agree with than with the homography, if there is one; of lenses that are
/// told wholly, and are no pinholes, the one that as many agree with.
fn better_turn(
    input: &PairInput<'_>,
    points: &MatchedPoints,
    global: Option<&Consensus>,
    seed: u64,
    options: &MatchingOptions,
    context: &StageContext<'_>,
) -> Option<TurnConsensus> {
    let told = [&input.a.told, &input.b.told];
    if told.iter().all(|told| told.is_pinhole()) {
        return None;
    }
    let agreeing = global.map_or(0, |global| global.inliers.len());
    let wanted = match told.iter().all(|told| told.is_whole()) {
        true => agreeing,
        false => ((TURN_FACTOR * agreeing as f64) as usize).max(agreeing + TURN_MORE),
    };
    let wanted = wanted.max(options.min_inliers);
    if points.in_a.len() < wanted {
        return None;
    }
    // Draws of its own: what the homography draws does not depend on whether lenses are tried.
    let mut generator = context.generator("turned lens", seed);
    find_turned_lens(points, [input.a.frame, input.b.frame], told, options.inlier_px, wanted, &mut generator)
}

/// Matches two photographs and judges whether they overlap.
///
/// Where clearly more matches agree with a lens that turned than with any homography, that is what is believed.
///
/// A pair is joined if its homography is believable in the overlap it predicts, and the matches that agree with it are
/// at least `min_inliers` and more than alpha + beta n_f of the n_f matches in that overlap. Where they are
/// `min_inliers` and not enough, those on further planes and elsewhere in depth count with them. It is not joined where
/// little else in the overlap matches or looks alike ([`Resemblance`]). [`Demand`] says of which pairs fewer must
/// agree.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if the photographs are the same or features contradict themselves;
/// [`Error::Cancelled`].
///
/// # Source
/// The test: Brown and Lowe, Automatic panoramic image stitching using invariant features, section 3.2.
///
/// # Departures
/// Brown and Lowe count what agrees with one homography, since their cameras turn about one point, and join whatever
/// passes: equal bays of a hall do, too.
pub(super) fn match_pair(
    input: &PairInput<'_>,
    options: &MatchingOptions,
    context: &StageContext<'_>,
) -> Result<PairMatches> {
    options.check()?;
    input.check()?;
    context.check_cancelled()?;
    let PairInput { a, b, demand } = *input;
    let compared = ComparedPair::new([(a.features, a.frame), (b.features, b.frame)], options);
    let ComparedPair { putative, points, .. } = &compared;
    let mut pair = PairMatches {
        a: a.index,
        b: b.index,
        putative: putative.len(),
        in_overlap: 0,
        agreeing: 0,
        needed: PairInput::needed(0, demand, options),
        verdict: PairVerdict::TooFewMatches,
        b_from_a: None,
        inliers: PointMatches::default(),
        elsewhere: PointMatches::default(),
    };
    if putative.len() < 4 {
        return Ok(pair);
    }
    context.check_cancelled()?;
    let seed = compared.seed();
    let mut generator = context.generator(MatchingOptions::STAGE, seed);
    let search = HomographySearch {
        inlier_px: options.inlier_px,
        max_samples: MAX_SAMPLES,
        useful_inliers: pair.needed,
        start: None,
    };
    let found = find_homography(points, &search, |map| input.is_plausible(map), &mut generator);
    let turn = better_turn(input, points, found.as_ref().ok(), seed, options, context);
    let Some(model) = (match (turn, found) {
        (Some(turn), _) => Model::of_turn(&turn, points),
        (None, Ok(global)) => {
            let Consensus { b_from_a, inliers } = global;
            Some(Model { turned: None, b_from_a, inliers })
        }
        (None, Err(failure)) => {
            pair.verdict = match failure {
                NoConsensus::NoSample => PairVerdict::TooFewInliers,
                NoConsensus::Implausible => PairVerdict::ImplausibleHomography,
            };
            return Ok(pair);
        }
    }) else {
        return Ok(pair);
    };
    let Some(overlap) = model.overlap(a.frame, b.frame) else { return Ok(pair) };
    pair.in_overlap = putative.iter().filter(|candidate| overlap.contains(&candidate.at)).count();
    pair.agreeing = model.inliers.iter().filter(|&&k| overlap.contains(&putative[k].at)).count();
    pair.b_from_a = Some(scaled_rows(&model.b_from_a));
    input.judge(&mut pair, options);
    // Before strong parallax no plane alone explains enough of the matches: what else two cameras explain counts as
    // well.
    let is_promising = pair.verdict == PairVerdict::TooFewInliers && pair.agreeing >= options.min_inliers;
    let suffices_if_alike = demand == Demand::FewIfAlike && pair.agreeing >= options.fewest_if_alike();
    if pair.verdict.is_joined() || is_promising || suffices_if_alike {
        let modeled = ModeledPair { input, putative, points, model: &model };
        let explained = modeled.explained(&mut generator, &mut context.generator("matches elsewhere", seed));
        if is_promising {
            pair.agreeing = explained.all.iter().filter(|&&k| overlap.contains(&putative[k].at)).count();
            input.judge(&mut pair, options);
        }
        let resemblance = Resemblance { a: a.features, b: b.features, overlap: &overlap };
        pair.verdict = match pair.verdict {
            // Who names a pair in a graph knows better.
            PairVerdict::Joined if demand != Demand::Graph && resemblance.is_missing(pair.in_overlap) => {
                PairVerdict::LooksDifferent
            }
            PairVerdict::TooFewInliers if suffices_if_alike && resemblance.is_confirmed(pair.agreeing) => {
                PairVerdict::JoinedByLooks
            }
            verdict => verdict,
        };
        if pair.verdict.is_joined() {
            pair.inliers = explained.inliers.into();
            pair.elsewhere = explained.elsewhere.into();
        }
    }
    Ok(pair)
}

/// What most matches of a pair agree with.
struct Model {
    /// The lens that turned, if it was no pinhole.
    turned: Option<TurnedLens>,
    /// The homography; beside a lens that turned the one that says nearly the same of the matches.
    b_from_a: Homography,
    /// Indices of the agreeing matches, ascending.
    inliers: Vec<usize>,
}

impl Model {
    /// Of a turned lens; `None` if its matches fix no homography.
    fn of_turn(turn: &TurnConsensus, points: &MatchedPoints) -> Option<Self> {
        let at = points.select(&turn.inliers);
        let b_from_a = Homography::fit(&at.in_a, &at.in_b, None)?;
        Some(Self { turned: Some(turn.turned), b_from_a, inliers: turn.inliers.clone() })
    }

    /// Where a point of photograph a is in b's pixels.
    fn in_b(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        match self.turned {
            None => Some(self.b_from_a.apply(point)),
            Some(turned) => turned.in_b(point),
        }
    }

    fn overlap<'a>(&self, frame_a: &'a WorkingFrame, frame_b: &'a WorkingFrame) -> Option<PredictedOverlap<'a>> {
        match self.turned {
            None => PredictedOverlap::new(self.b_from_a, frame_a, frame_b),
            Some(turned) => Some(PredictedOverlap::of_turn(turned, frame_a, frame_b)),
        }
    }

    /// Cameras of about the photographs' lenses: those that turned, else pinholes of a focal length of the longer side.
    fn cameras(&self, frames: [&WorkingFrame; 2]) -> [Camera; 2] {
        match self.turned {
            Some(turned) => [turned.a, turned.b],
            None => frames.map(|frame| {
                Camera::new(frame.width.max(frame.height), frame.width, frame.height, &Matrix3::identity())
            }),
        }
    }
}

/// A pair whose matches are to be completed.
struct ModeledPair<'a> {
    input: &'a PairInput<'a>,
    /// Most distinctive first.
    putative: &'a [PutativeMatch],
    /// Their places.
    points: &'a MatchedPoints,
    model: &'a Model,
}

/// What two cameras explain of the matches of a pair.
struct ExplainedMatches {
    /// Those on planes, refined.
    inliers: Vec<PointMatch>,
    /// Those elsewhere in depth, refined; none where they are not believed.
    elsewhere: Vec<PointMatch>,
    /// Indices of both.
    all: Vec<usize>,
}

impl ModeledPair<'_> {
    /// Every match that the model, a further plane or the geometry of two cameras explains.
    fn explained(&self, planes: &mut impl Rng, elsewhere: &mut impl Rng) -> ExplainedMatches {
        let Self { input: PairInput { a, b, .. }, putative, points, model } = *self;
        let (inliers, is_known) = self.all_inliers(planes);
        let cameras = model.cameras([a.frame, b.frame]);
        let found = matches_elsewhere(points, &is_known, &model.b_from_a, &cameras, b.frame, elsewhere);
        let elsewhere = if self.is_believed(&found, &is_known) { found } else { Vec::new() };
        let refiner = self.refiner();
        let in_b = |point| model.in_b(point);
        let known = (0..is_known.len()).filter(|&k| is_known[k]);
        ExplainedMatches {
            inliers: refiner.refined(inliers, in_b),
            elsewhere: refiner.refined(elsewhere.iter().map(|&k| putative[k].at).collect(), in_b),
            all: known.chain(elsewhere.iter().copied()).collect(),
        }
    }

    fn refiner(&self) -> Refiner<'_> {
        let PairInput { a, b, .. } = self.input;
        Refiner { a: &a.features.surroundings, b: &b.features.surroundings }
    }

    /// Whether what surrounds the matches found `elsewhere` confirms as many of them as it does of things that are
    /// there.
    fn is_believed(&self, elsewhere: &[usize], is_known: &[bool]) -> bool {
        let refiner = self.refiner();
        if !refiner.sees() {
            return elsewhere.len() >= FEWEST_UNCONFIRMED;
        }
        if elsewhere.len() < FEWEST_CONFIRMED {
            return false;
        }
        let scaled = |k: usize| {
            let PutativeMatch { point_a, at, .. } = self.putative[k];
            ScaledMatch { at, scale_px: self.input.a.features.points[point_a].scale_px }
        };
        let confirmed = |matches: &[ScaledMatch]| refiner.confirmed(matches, |point| self.model.in_b(point));
        let on_planes: Vec<ScaledMatch> = (0..is_known.len()).filter(|&k| is_known[k]).map(scaled).collect();
        let step = on_planes.len().div_ceil(ASKED_ON_PLANES).max(1);
        let asked: Vec<ScaledMatch> = on_planes.into_iter().step_by(step).collect();
        let usual = confirmed(&asked) as f64 / asked.len().max(1) as f64;
        let count = confirmed(&elsewhere.iter().map(|&k| scaled(k)).collect::<Vec<_>>());
        count >= FEWEST_CONFIRMED && count as f64 >= LEAST_CONFIRMED * usual * elsewhere.len() as f64
    }

    /// The final matches, those that agree with the model and then those of further planes; and which of the putative
    /// ones are among them.
    fn all_inliers(&self, generator: &mut impl Rng) -> (Vec<PointMatch>, Vec<bool>) {
        let mut is_known = vec![false; self.putative.len()];
        let mut inliers: Vec<PointMatch> = Vec::new();
        let of_planes = self.further_planes(generator).into_iter().flat_map(|plane| plane.inliers);
        for k in self.model.inliers.iter().copied().chain(of_planes) {
            if !std::mem::replace(&mut is_known[k], true) {
                inliers.push(self.putative[k].at);
            }
        }
        (inliers, is_known)
    }

    /// The planes beside the model. Under a lens that bends, what the turn explains lies on planes only here and there:
    /// of such pairs they are sought among the other matches.
    fn further_planes(&self, generator: &mut impl Rng) -> Vec<Consensus> {
        let is_plausible = |map: &Homography| self.input.is_plausible(map);
        let (map, diagonal_px) = (&self.model.b_from_a, self.input.b.frame.diagonal());
        if self.model.turned.is_none() {
            return find_planes(self.points, map, diagonal_px, is_plausible, generator);
        }
        let is_left = |k: &usize| self.model.inliers.binary_search(k).is_err();
        let left: Vec<usize> = (0..self.putative.len()).filter(is_left).collect();
        let planes = find_planes(&self.points.select(&left), map, diagonal_px, is_plausible, generator);
        let of_all =
            |plane: Consensus| Consensus { inliers: plane.inliers.iter().map(|&k| left[k]).collect(), ..plane };
        planes.into_iter().map(of_all).collect()
    }
}

/// Rows with last entry 1 (or -1 beyond the horizon) where it is well away from zero; positive at the overlap.
fn scaled_rows(map: &Homography) -> [[f64; 3]; 3] {
    const SMALL: f64 = 1e-9;
    let (largest, last) = (map.0.amax(), map.0[(2, 2)].abs());
    Homography(map.0 / if last > SMALL * largest { last } else { largest }).to_rows()
}
