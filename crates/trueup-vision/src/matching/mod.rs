//! Matches between pairs of pictures, and which pairs overlap.
//!
//! Descriptors of the strongest features are compared exhaustively (`putative`), a homography is sought that many matches agree on
//! (`ransac`), the pair is judged by how many do, and the matches of a joined pair are completed by further planes
//! (`planes`) and by a second look near the predicted places (`guided`).

mod duplicates;
mod guided;
mod local;
mod options;
mod overlap;
mod planes;
mod putative;
mod ransac;
mod search;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use rand::Rng;
use rayon::prelude::*;
use trueup_core::geometry::Homography;
use trueup_core::matches::{PairMatches, PairVerdict, PointMatch};
use trueup_core::options::StageOptions;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result, StageContext};

pub use duplicates::{is_near_duplicate, report_near_duplicates};
pub use options::MatchingOptions;
pub use putative::{PutativeMatch, putative_matches};
pub use search::{Kernel, Nearest, Neighbor};

use crate::features::Features;
use guided::Follower;
use overlap::Overlap;
use ransac::{Consensus, MatchedPoints, NoConsensus, Search};

/// The stage's name in progress and generators.
const STAGE: &str = MatchingOptions::STAGE;

/// What matching needs to know of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// Its index among the pictures.
    pub index: usize,
    /// Its features.
    pub features: &'a Features,
    /// The frame these are measured in.
    pub frame: &'a WorkingFrame,
}

/// Matches the pictures of every pair, in parallel; the results are in the order of `pairs`.
///
/// `forced` holds the pairs (smaller index first) that the user's graph joins.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if a pair names a picture that is not there or twice the same, or if features
/// contradict themselves; [`Error::Cancelled`].
pub fn run(
    features: &[Features],
    frames: &[WorkingFrame],
    pairs: &[(usize, usize)],
    forced: &BTreeSet<(usize, usize)>,
    options: &MatchingOptions,
    context: &StageContext<'_>,
) -> Result<Vec<PairMatches>> {
    let picture = |index: usize| match (features.get(index), frames.get(index)) {
        (Some(features), Some(frame)) => Ok(Picture { index, features, frame }),
        _ => Err(Error::input(
            format!("picture {index}"),
            "a pair names it but it is not there",
            "Pairs may only name the pictures given.",
        )),
    };
    context.progress().begin(STAGE, pairs.len() as u64);
    let matched: Result<Vec<PairMatches>> = pairs
        .par_iter()
        .map(|&(a, b)| {
            let is_forced = forced.contains(&(a.min(b), a.max(b)));
            let matches = match_pair(picture(a)?, picture(b)?, is_forced, options, context)?;
            context.progress().advance(STAGE, 1);
            Ok(matches)
        })
        .collect();
    context.progress().finish(STAGE);
    matched
}

/// Matches two pictures and judges whether they overlap.
///
/// A pair is joined if its homography is believable in the overlap it predicts, and the matches that agree with it are
/// at least `min_inliers` and more than `brown_lowe_alpha` + `brown_lowe_beta` n_f of the n_f matches in that overlap.
/// A `forced` pair needs only `min_inliers_by_graph`. The result names the smaller index first whatever the order.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if the pictures are the same or features contradict themselves;
/// [`Error::Cancelled`].
///
/// # Source
/// The test: Brown and Lowe, Automatic panoramic image stitching using invariant features, section 3.2.
pub fn match_pair(
    a: Picture<'_>,
    b: Picture<'_>,
    forced: bool,
    options: &MatchingOptions,
    context: &StageContext<'_>,
) -> Result<PairMatches> {
    let (a, b) = if a.index <= b.index { (a, b) } else { (b, a) };
    check(a, b, options)?;
    context.check_cancelled()?;
    let [compared_a, compared_b] = [a, b].map(|one| one.features.strongest(options.compared_features));
    let putative = by_distinctiveness(putative_matches(&compared_a, &compared_b, options));
    let mut pair = PairMatches {
        a: a.index,
        b: b.index,
        putative: putative.len(),
        in_overlap: 0,
        agreeing: 0,
        needed: needed(0, forced, options),
        verdict: PairVerdict::TooFewMatches,
        b_from_a: None,
        inliers: Vec::new(),
    };
    if putative.len() < 4 {
        return Ok(pair);
    }
    context.check_cancelled()?;
    // Seeded by what is matched, so that the result does not depend on which other pictures there are.
    let mut generator = context.generator(STAGE, fingerprint(a.features).rotate_left(1) ^ fingerprint(b.features));
    let points = matched_points(&putative);
    let search = Search {
        inlier_px: options.inlier_px,
        confidence: options.confidence,
        max_samples: options.max_samples,
        useful_inliers: pair.needed,
        start: None,
    };
    let is_plausible = plausibility(a.frame, b.frame, options);
    let global = ransac::find_homography(&points, &search, &is_plausible, &mut generator);
    let global = match global {
        Ok(global) => global,
        Err(failure) => {
            pair.verdict = match failure {
                NoConsensus::NoSample => PairVerdict::TooFewInliers,
                NoConsensus::Implausible => PairVerdict::ImplausibleHomography,
            };
            return Ok(pair);
        }
    };
    let Some(overlap) = Overlap::new(global.b_from_a, a.frame, b.frame) else { return Ok(pair) };
    pair.in_overlap = putative.iter().filter(|candidate| overlap.contains(&candidate.at)).count();
    pair.agreeing = global.inliers.iter().filter(|&&k| overlap.contains(&putative[k].at)).count();
    pair.b_from_a = Some(scaled_rows(&global.b_from_a));
    pair.needed = needed(pair.in_overlap, forced, options);
    pair.verdict = if pair.agreeing >= needed(pair.in_overlap, false, options) {
        PairVerdict::Joined
    } else if forced && pair.agreeing >= pair.needed {
        PairVerdict::JoinedByGraph
    } else {
        PairVerdict::TooFewInliers
    };
    if pair.verdict.is_joined() {
        pair.inliers = all_inliers((a, b), &putative, &points, &global, &overlap, options, &mut generator);
    }
    Ok(pair)
}

/// The final matches: global inliers, those of further planes, those found near predicted places.
fn all_inliers(
    (a, b): (Picture<'_>, Picture<'_>),
    putative: &[PutativeMatch],
    points: &MatchedPoints,
    global: &Consensus,
    overlap: &Overlap<'_>,
    options: &MatchingOptions,
    generator: &mut impl Rng,
) -> Vec<PointMatch> {
    let is_plausible = plausibility(a.frame, b.frame, options);
    let max_displacement_px = options.max_plane_displacement * b.frame.diagonal();
    let planes = planes::find_planes(points, &global.b_from_a, max_displacement_px, options, is_plausible, generator);
    let mut followers = vec![Follower { b_from_a: global.b_from_a, inlier_px: options.inlier_px }];
    let mut maps: Vec<Option<usize>> = vec![None; putative.len()];
    let mut matches: Vec<usize> = global.inliers.clone();
    global.inliers.iter().for_each(|&k| maps[k] = Some(0));
    for plane in &planes {
        for &k in &plane.inliers {
            if maps[k].is_none() {
                matches.push(k);
                maps[k] = Some(followers.len());
            }
        }
        followers.push(Follower { b_from_a: plane.b_from_a, inlier_px: options.plane_inlier_px });
    }
    let known: Vec<PutativeMatch> = matches.iter().map(|&k| putative[k]).collect();
    let mut inliers: Vec<PointMatch> = known.iter().map(|known| known.at).collect();
    if options.guided {
        let maps: Vec<usize> = matches.iter().map(|&k| maps[k].unwrap_or(0)).collect();
        let more = guided::guided_matches((a.features, b.features), &known, &maps, &followers, overlap, options);
        inliers.extend(more.iter().map(|found| found.at));
    }
    inliers
}

/// A number that tells the features of one picture from those of another.
fn fingerprint(features: &Features) -> u64 {
    // FNV-1a over whole words, turned so that high bits count.
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let words = features.points.iter().flat_map(|point| point.position.map(f64::to_bits));
    words.fold(OFFSET, |hash, word| (hash ^ word).wrapping_mul(PRIME).rotate_left(29))
}

/// How many matches must agree when `in_overlap` lie in the predicted overlap.
fn needed(in_overlap: usize, forced: bool, options: &MatchingOptions) -> usize {
    let more_than = options.brown_lowe_alpha + options.brown_lowe_beta * in_overlap as f64;
    let tested = options.min_inliers.max(more_than.floor() as usize + 1);
    if forced { options.min_inliers_by_graph.min(tested) } else { tested }
}

fn plausibility<'a>(
    frame_a: &'a WorkingFrame,
    frame_b: &'a WorkingFrame,
    options: &MatchingOptions,
) -> impl Fn(&Homography) -> bool + 'a {
    let max_area_ratio = options.max_area_ratio;
    move |map| Overlap::new(*map, frame_a, frame_b).is_some_and(|overlap| overlap.is_plausible(max_area_ratio))
}

/// Most distinctive first.
fn by_distinctiveness(mut putative: Vec<PutativeMatch>) -> Vec<PutativeMatch> {
    putative.sort_by(|j, k| j.ratio.total_cmp(&k.ratio).then(j.point_a.cmp(&k.point_a)));
    putative
}

fn matched_points(putative: &[PutativeMatch]) -> MatchedPoints {
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

fn check(a: Picture<'_>, b: Picture<'_>, options: &MatchingOptions) -> Result<()> {
    options.check()?;
    if a.index == b.index {
        return Err(Error::input(
            format!("picture {}", a.index),
            "it is paired with itself",
            "Pair different pictures.",
        ));
    }
    check_features(a.index, a.features)?;
    check_features(b.index, b.features)
}

/// Whether descriptors and points fit together, so that no index is out of range later.
pub(crate) fn check_features(index: usize, features: &Features) -> Result<()> {
    let owners = &features.descriptor_points;
    let consistent = owners.len() == features.descriptors.len()
        && owners.is_sorted()
        && owners.last().is_none_or(|&last| (last as usize) < features.points.len())
        && features.points.iter().all(|point| point.position.iter().all(|x| x.is_finite()));
    if consistent {
        return Ok(());
    }
    Err(Error::input(
        format!("features of picture {index}"),
        "descriptors and points do not fit together, or positions are not finite",
        "Detect the features anew.",
    ))
}
