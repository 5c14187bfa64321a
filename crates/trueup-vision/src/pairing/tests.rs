use rand::Rng;

use trueup_core::matches::{PairVerdict, PointMatches};
use trueup_core::{Error, StageContext};

use super::*;
use crate::features::{DESCRIPTOR_LENGTH, FeaturePoint, Features};

/// Photographs along a row: each shares half of its descriptors with the next.
fn row(count: usize, shared: usize) -> Vec<Features> {
    let mut generator = StageContext::default().generator("test", 0);
    let mut descriptors = vec![[0; DESCRIPTOR_LENGTH]; (count + 1) * shared];
    descriptors.iter_mut().for_each(|descriptor| generator.fill_bytes(descriptor));
    let photograph = |index: usize| {
        let descriptors = descriptors[index * shared..(index + 2) * shared].to_vec();
        let point = |k: usize| FeaturePoint {
            position: [(k * 37 % 800) as f64, (k * 91 % 600) as f64],
            scale_px: 2.0,
            response: 10.0,
        };
        let points = (0..descriptors.len()).map(point).collect();
        let descriptor_points = (0..descriptors.len() as u32).collect();
        Features { points, descriptors, descriptor_points, ..Features::default() }
    };
    (0..count).map(photograph).collect()
}

const FRAME: WorkingFrame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };

fn proposals<'a>(features: &[Features], frames: &'a [WorkingFrame], options: &'a PairingOptions) -> Proposals<'a> {
    Proposals::new(&features, frames, options, || likeness(&features, &StageContext::default())).expect("valid")
}

/// A pair that was matched; of joined ones, the second shows what lies 200 pixels to the right for each step in order.
fn matched((a, b): (usize, usize), joined: bool) -> PairMatches {
    let shift = 200.0 * (b - a) as f64;
    PairMatches {
        a,
        b,
        putative: 50,
        in_overlap: 50,
        agreeing: 50,
        needed: 15,
        verdict: if joined { PairVerdict::Joined } else { PairVerdict::TooFewInliers },
        b_from_a: joined.then_some([[1.0, 0.0, -shift], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        inliers: PointMatches::default(),
        elsewhere: PointMatches::default(),
    }
}

#[test]
fn few_photographs_are_paired_with_all_at_once() {
    let (options, frames) = (PairingOptions::default(), [FRAME; 4]);
    let mut few = proposals(&row(4, 5), &frames, &options);
    assert_eq!(few.next(&[]), [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]);
    assert!(few.next(&[matched((0, 1), true)]).is_empty());
    for count in [0, 1] {
        assert!(proposals(&row(count, 5), &frames[..count], &options).next(&[]).is_empty());
    }
}

#[test]
fn many_photographs_are_paired_with_those_that_look_alike() {
    let options = PairingOptions { exhaustive_up_to: 5, neighbors: 2, consecutive: false };
    let frames = [FRAME; 40];
    let pairs = proposals(&row(40, 50), &frames, &options).next(&[]);
    for photograph in 1..40 {
        assert!(pairs.contains(&(photograph - 1, photograph)), "{photograph}");
    }
    assert!(pairs.is_sorted() && pairs.len() <= 80, "{}", pairs.len());
}

#[test]
fn overlaps_predict_others_until_none_is_left() {
    let options = PairingOptions { exhaustive_up_to: 5, neighbors: 2, consecutive: true };
    let frames = [FRAME; 12];
    // Nothing looks alike: the order alone tells.
    let mut row = proposals(&row(12, 0), &frames, &options);
    let mut tried = BTreeSet::new();
    let mut last: Vec<PairMatches> = Vec::new();
    loop {
        let pairs = row.next(&last);
        if pairs.is_empty() {
            break;
        }
        assert!(pairs.iter().all(|&pair| tried.insert(pair)), "none twice");
        last = pairs.into_iter().map(|(a, b)| matched((a, b), b - a < 4)).collect();
    }
    // Neighbors share three quarters, the next half, the third in order a quarter, the fourth a border, which might be
    // more.
    let expected: BTreeSet<(usize, usize)> = all_pairs(12).into_iter().filter(|(a, b)| b - a <= 4).collect();
    assert_eq!(tried, expected);
}

#[test]
fn what_stays_apart_is_tried_with_everything_that_may_join_it() {
    let options = PairingOptions { exhaustive_up_to: 0, neighbors: 4, consecutive: true };
    let (features, frames) = (row(8, 20), [FRAME; 8]);
    let mut apart = proposals(&features, &frames, &options);
    let mut tried: Vec<(usize, usize)> = apart.next(&[]);
    // Photograph 7 joins only photograph 0, which it does not look like.
    let is_joined = |&(a, b): &(usize, usize)| (b < 7 && b - a == 1) || (a, b) == (0, 7);
    let mut last = tried.clone();
    while !last.is_empty() {
        let verified: Vec<PairMatches> = last.iter().map(|pair| matched(*pair, is_joined(pair))).collect();
        last = apart.next(&verified);
        tried.extend(&last);
    }
    assert!(tried.contains(&(0, 7)), "{tried:?}");
}

#[test]
fn photographs_without_features_are_paired_with_their_neighbors_in_order_only() {
    let options = PairingOptions { exhaustive_up_to: 0, ..PairingOptions::default() };
    let (empty, frames) = (vec![Features::default(); 4], [FRAME; 4]);
    let mut in_order = proposals(&empty, &frames, &options);
    assert_eq!(in_order.next(&[]), [(0, 1), (1, 2), (2, 3)]);
    assert!(in_order.next(&[matched((0, 1), false)]).is_empty());
    let options = PairingOptions { consecutive: false, ..options };
    assert!(proposals(&empty, &frames, &options).next(&[]).is_empty());
}

#[test]
fn bad_options_and_cancelling_are_errors() {
    let options = PairingOptions { neighbors: 0, ..PairingOptions::default() };
    let outcome = Proposals::new(&Vec::new(), &[], &options, || Ok(Likeness::default()));
    assert!(matches!(outcome, Err(Error::Options(invalid)) if invalid.len() == 1));
    let token = trueup_core::context::CancelToken::default();
    token.cancel();
    let context = StageContext::new(&trueup_core::context::Silent, &token);
    let options = PairingOptions { exhaustive_up_to: 1, ..PairingOptions::default() };
    let features = row(3, 5);
    let outcome = Proposals::new(&features, &[FRAME; 3], &options, || likeness(&features, &context));
    assert!(matches!(outcome, Err(Error::Cancelled)));
}
