//! Two photographs whose features are compared: what every search among their matches begins from.

use trueup_core::source::WorkingFrame;

use super::matched_points::MatchedPoints;
use super::options::MatchingOptions;
use super::putative::{PutativeMatch, putative_matches};
use super::written::without_written;
use crate::features::Features;

/// Largest number of samples drawn for the global homography. More would find pairs of which fewer matches agree.
pub(super) const MAX_SAMPLES: usize = 6000;

/// What looks alike in two photographs.
pub(super) struct ComparedPair<'a> {
    features: [&'a Features; 2],
    /// Most distinctive first; none on writing.
    pub(super) putative: Vec<PutativeMatch>,
    /// Their places.
    pub(super) points: MatchedPoints,
}

impl<'a> ComparedPair<'a> {
    /// Compares each feature of the first with all of the second; with the frames that they are measured in.
    pub(super) fn new(
        [(a, frame_a), (b, frame_b)]: [(&'a Features, &WorkingFrame); 2],
        options: &MatchingOptions,
    ) -> Self {
        let mut putative = without_written(putative_matches(a, b, options), a, [frame_a, frame_b]);
        putative.sort_by(|j, k| j.ratio.total_cmp(&k.ratio).then(j.point_a.cmp(&k.point_a)));
        let points = MatchedPoints {
            in_a: putative.iter().map(|candidate| candidate.at.in_a.into()).collect(),
            in_b: putative.iter().map(|candidate| candidate.at.in_b.into()).collect(),
        };
        Self { features: [a, b], putative, points }
    }

    /// A seed of what is matched: draws do not depend on which other photographs there are.
    pub(super) fn seed(&self) -> u64 {
        let [a, b] = self.features.map(fingerprint);
        a.rotate_left(1) ^ b
    }
}

/// A number that tells the features of one photograph from those of another.
fn fingerprint(features: &Features) -> u64 {
    // FNV-1a over whole words, turned so that high bits count.
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let words = features.points.iter().flat_map(|point| point.position.map(f64::to_bits));
    words.fold(OFFSET, |hash, word| (hash ^ word).wrapping_mul(PRIME).rotate_left(29))
}
