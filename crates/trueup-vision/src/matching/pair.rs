//! One pair: whether its photographs overlap, and all its matches.

use rand::Rng;
use trueup_core::geometry::Homography;
use trueup_core::matches::{PairMatches, PairVerdict, PointMatch};
use trueup_core::options::StageOptions;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result, StageContext};

use super::consistent::matches_elsewhere;
use super::guided::{GuidedInput, PlaneMap, PointMap, guided_matches};
use super::matched_points::MatchedPoints;
use super::options::MatchingOptions;
use super::overlap::PredictedOverlap;
use super::planes::{PLANE_INLIER_PX, find_planes};
use super::putative::{PutativeMatch, putative_matches};
use super::ransac::{Consensus, HomographySearch, NoConsensus, find_homography};
use super::turned::{TurnConsensus, find_turned_lens};
use crate::features::Features;

/// See [`PairInput::compared_features`]. More would find smaller overlaps; the time grows with the square.
pub(super) const COMPARED_FEATURES: usize = 4000;

/// Largest number of samples drawn for the global homography. More would find pairs of which fewer matches agree.
pub(super) const MAX_SAMPLES: usize = 6000;

/// alpha of the Brown-Lowe test: a pair is joined if more than alpha + beta n_f of its n_f matches in the predicted overlap
/// agree (Brown and Lowe, section 3.2).
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

/// A photograph of a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct PhotographFeatures<'a> {
    /// Its index among the photographs.
    pub(super) index: usize,
    /// Its features.
    pub(super) features: &'a Features,
    /// The frame these are measured in.
    pub(super) frame: &'a WorkingFrame,
}

/// Two photographs to be matched, the smaller index first.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairInput<'a> {
    pub(super) a: PhotographFeatures<'a>,
    pub(super) b: PhotographFeatures<'a>,
    /// Whether the user's graph joins them.
    pub(super) forced: bool,
    /// Strongest features of each that are compared with all such of the other; those beyond are matched near the places
    /// that these predict.
    pub(super) compared_features: usize,
}

impl<'a> PairInput<'a> {
    /// Of two photographs in any order.
    pub(super) fn new(one: PhotographFeatures<'a>, other: PhotographFeatures<'a>, forced: bool) -> Self {
        let (a, b) = if one.index <= other.index { (one, other) } else { (other, one) };
        Self { a, b, forced, compared_features: COMPARED_FEATURES }
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
    /// few that suffice for a pair `forced`.
    fn needed(in_overlap: usize, forced: bool, options: &MatchingOptions) -> usize {
        let more_than = BROWN_LOWE_ALPHA + BROWN_LOWE_BETA * in_overlap as f64;
        let tested = options.min_inliers.max(more_than.floor() as usize + 1);
        if forced { MIN_INLIERS_BY_GRAPH.min(tested) } else { tested }
    }

    /// The verdict on a pair whose matches are counted.
    fn judge(&self, pair: &mut PairMatches, options: &MatchingOptions) {
        pair.needed = Self::needed(pair.in_overlap, self.forced, options);
        pair.verdict = if pair.agreeing >= Self::needed(pair.in_overlap, false, options) {
            PairVerdict::Joined
        } else if self.forced && pair.agreeing >= pair.needed {
            PairVerdict::JoinedByGraph
        } else {
            PairVerdict::TooFewInliers
        };
    }
}

/// The turned lens that clearly more matches agree with than with the homography, if there is one.
fn better_turn(
    input: &PairInput<'_>,
    points: &MatchedPoints,
    global: Option<&Consensus>,
    seed: u64,
    options: &MatchingOptions,
    context: &StageContext<'_>,
) -> Option<TurnConsensus> {
    let agreeing = global.map_or(0, |global| global.inliers.len());
    let wanted = ((TURN_FACTOR * agreeing as f64) as usize).max(agreeing + TURN_MORE).max(options.min_inliers);
    if points.in_a.len() < wanted {
        return None;
    }
    // Draws of its own: what the homography draws does not depend on whether lenses are tried.
    let mut generator = context.generator("turned lens", seed);
    find_turned_lens(points, [input.a.frame, input.b.frame], options.inlier_px, wanted, &mut generator)
}

/// Judges a pair by the turned lens, and completes its matches.
fn judge_turn(
    pair: &mut PairMatches,
    input: &PairInput<'_>,
    putative: &[PutativeMatch],
    turn: &TurnConsensus,
    options: &MatchingOptions,
) {
    let overlap = PredictedOverlap::of_turn(turn.turned, input.a.frame, input.b.frame);
    pair.in_overlap = putative.iter().filter(|candidate| overlap.contains(&candidate.at)).count();
    pair.agreeing = turn.inliers.iter().filter(|&&k| overlap.contains(&putative[k].at)).count();
    let known: Vec<PutativeMatch> = turn.inliers.iter().map(|&k| putative[k]).collect();
    let at = matched_points(&known);
    pair.b_from_a = Homography::fit(&at.in_a, &at.in_b, None).map(|map| scaled_rows(&map));
    input.judge(pair, options);
    if !pair.verdict.is_joined() {
        return;
    }
    pair.inliers = known.iter().map(|known| known.at).collect();
    if options.guided {
        let more = guided_matches(&GuidedInput {
            a: input.a.features,
            b: input.b.features,
            known: &known,
            plane_of_known: &vec![0; known.len()],
            planes: &[PlaneMap { b_from_a: PointMap::Turn(Box::new(turn.turned)), inlier_px: options.inlier_px }],
            overlap: &overlap,
        });
        pair.inliers.extend(more.iter().map(|found| found.at));
    }
}

/// Matches two photographs and judges whether they overlap.
///
/// Where clearly more matches agree with a lens that turned than with any homography, that is what is believed.
///
/// A pair is joined if its homography is believable in the overlap it predicts, and the matches that agree with it are
/// at least `min_inliers` and more than alpha + beta n_f of the n_f matches in that overlap. A forced pair needs only
/// [`MIN_INLIERS_BY_GRAPH`].
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if the photographs are the same or features contradict themselves;
/// [`Error::Cancelled`].
///
/// # Source
/// The test: Brown and Lowe, Automatic panoramic image stitching using invariant features, section 3.2.
pub(super) fn match_pair(
    input: &PairInput<'_>,
    options: &MatchingOptions,
    context: &StageContext<'_>,
) -> Result<PairMatches> {
    options.check()?;
    input.check()?;
    context.check_cancelled()?;
    let PairInput { a, b, forced, compared_features } = *input;
    let [compared_a, compared_b] = [a, b].map(|one| one.features.strongest(compared_features));
    let putative = by_distinctiveness(putative_matches(&compared_a, &compared_b, options));
    let mut pair = PairMatches {
        a: a.index,
        b: b.index,
        putative: putative.len(),
        in_overlap: 0,
        agreeing: 0,
        needed: PairInput::needed(0, forced, options),
        verdict: PairVerdict::TooFewMatches,
        b_from_a: None,
        inliers: Vec::new(),
        elsewhere: Vec::new(),
    };
    if putative.len() < 4 {
        return Ok(pair);
    }
    context.check_cancelled()?;
    // Seeded by what is matched, so that the result does not depend on which other photographs there are.
    let seed = fingerprint(a.features).rotate_left(1) ^ fingerprint(b.features);
    let mut generator = context.generator(MatchingOptions::STAGE, seed);
    let points = matched_points(&putative);
    let search = HomographySearch {
        inlier_px: options.inlier_px,
        max_samples: MAX_SAMPLES,
        useful_inliers: pair.needed,
        start: None,
    };
    let found = find_homography(&points, &search, |map| input.is_plausible(map), &mut generator);
    if let Some(turn) = better_turn(input, &points, found.as_ref().ok(), seed, options, context) {
        judge_turn(&mut pair, input, &putative, &turn, options);
        return Ok(pair);
    }
    let global = match found {
        Ok(global) => global,
        Err(failure) => {
            pair.verdict = match failure {
                NoConsensus::NoSample => PairVerdict::TooFewInliers,
                NoConsensus::Implausible => PairVerdict::ImplausibleHomography,
            };
            return Ok(pair);
        }
    };
    let Some(overlap) = PredictedOverlap::new(global.b_from_a, a.frame, b.frame) else { return Ok(pair) };
    pair.in_overlap = putative.iter().filter(|candidate| overlap.contains(&candidate.at)).count();
    pair.agreeing = global.inliers.iter().filter(|&&k| overlap.contains(&putative[k].at)).count();
    pair.b_from_a = Some(scaled_rows(&global.b_from_a));
    input.judge(&mut pair, options);
    if pair.verdict.is_joined() {
        let joined = JoinedPair { input, putative: &putative, points: &points, global: &global, overlap: &overlap };
        let (inliers, is_known) = joined.all_inliers(options, &mut generator);
        pair.inliers = inliers;
        let mut generator = context.generator("matches elsewhere", seed);
        let frames = [input.a.frame, input.b.frame];
        let found = matches_elsewhere(&points, &is_known, &global.b_from_a, frames, &mut generator);
        pair.elsewhere = found.into_iter().map(|k| putative[k].at).collect();
    }
    Ok(pair)
}

/// A joined pair whose matches are to be completed.
struct JoinedPair<'a> {
    input: &'a PairInput<'a>,
    /// Most distinctive first.
    putative: &'a [PutativeMatch],
    /// Their places.
    points: &'a MatchedPoints,
    global: &'a Consensus,
    overlap: &'a PredictedOverlap<'a>,
}

impl JoinedPair<'_> {
    /// The final matches: global inliers, those of further planes, those found near predicted places; and which of the putative ones are among
    /// them.
    fn all_inliers(&self, options: &MatchingOptions, generator: &mut impl Rng) -> (Vec<PointMatch>, Vec<bool>) {
        let (a, b, global) = (self.input.a, self.input.b, self.global);
        let is_plausible = |map: &Homography| self.input.is_plausible(map);
        let planes = find_planes(self.points, &global.b_from_a, b.frame.diagonal(), is_plausible, generator);
        let mut plane_maps =
            vec![PlaneMap { b_from_a: PointMap::Plane(global.b_from_a), inlier_px: options.inlier_px }];
        let mut plane_of: Vec<Option<usize>> = vec![None; self.putative.len()];
        let mut matches: Vec<usize> = global.inliers.clone();
        global.inliers.iter().for_each(|&k| plane_of[k] = Some(0));
        for plane in &planes {
            for &k in &plane.inliers {
                if plane_of[k].is_none() {
                    matches.push(k);
                    plane_of[k] = Some(plane_maps.len());
                }
            }
            plane_maps.push(PlaneMap { b_from_a: PointMap::Plane(plane.b_from_a), inlier_px: PLANE_INLIER_PX });
        }
        let known: Vec<PutativeMatch> = matches.iter().map(|&k| self.putative[k]).collect();
        let mut inliers: Vec<PointMatch> = known.iter().map(|known| known.at).collect();
        if options.guided {
            let plane_of_known: Vec<usize> = matches.iter().map(|&k| plane_of[k].unwrap_or(0)).collect();
            let more = guided_matches(&GuidedInput {
                a: a.features,
                b: b.features,
                known: &known,
                plane_of_known: &plane_of_known,
                planes: &plane_maps,
                overlap: self.overlap,
            });
            inliers.extend(more.iter().map(|found| found.at));
        }
        (inliers, plane_of.iter().map(Option::is_some).collect())
    }
}

/// A number that tells the features of one photograph from those of another.
pub(super) fn fingerprint(features: &Features) -> u64 {
    // FNV-1a over whole words, turned so that high bits count.
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let words = features.points.iter().flat_map(|point| point.position.map(f64::to_bits));
    words.fold(OFFSET, |hash, word| (hash ^ word).wrapping_mul(PRIME).rotate_left(29))
}

/// Most distinctive first.
pub(super) fn by_distinctiveness(mut putative: Vec<PutativeMatch>) -> Vec<PutativeMatch> {
    putative.sort_by(|j, k| j.ratio.total_cmp(&k.ratio).then(j.point_a.cmp(&k.point_a)));
    putative
}

pub(super) fn matched_points(putative: &[PutativeMatch]) -> MatchedPoints {
    MatchedPoints {
        in_a: putative.iter().map(|candidate| candidate.at.in_a.into()).collect(),
        in_b: putative.iter().map(|candidate| candidate.at.in_b.into()).collect(),
    }
}

/// Rows with last entry 1 (or -1 beyond the horizon) where it is well away from zero; positive at the overlap.
fn scaled_rows(map: &Homography) -> [[f64; 3]; 3] {
    const SMALL: f64 = 1e-9;
    let (largest, last) = (map.0.amax(), map.0[(2, 2)].abs());
    Homography(map.0 / if last > SMALL * largest { last } else { largest }).to_rows()
}
