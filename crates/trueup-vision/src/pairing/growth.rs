//! Overlaps that known overlaps predict: two photographs that overlap a third mostly lie where their homographies put them.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix3;
use trueup_core::geometry::Homography;
use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;

use crate::matching::PredictedOverlap;

/// Places along each side of a photograph that are asked whether the other shows them.
const PLACES: usize = 10;
/// Share of a photograph that another one must be predicted to show: smaller overlaps are hardly ever verified. (Of 178 among 60
/// photographs the smallest was 0.027.)
const LEAST_SHARE: f64 = 0.02;

/// The overlaps verified so far.
#[derive(Debug, Default)]
pub(super) struct VerifiedOverlaps {
    /// For every photograph those that overlap it, with the map to each.
    neighbors: BTreeMap<usize, BTreeMap<usize, Matrix3<f64>>>,
}

/// A pair that is predicted to overlap.
#[derive(Debug, Clone, Copy)]
struct PredictedPair {
    pair: (usize, usize),
    /// Share of the first photograph that the second one shows.
    share: f64,
}

impl VerifiedOverlaps {
    /// Photographs that are known to overlap one.
    pub(super) fn partners(&self, photograph: usize) -> usize {
        self.neighbors.get(&photograph).map_or(0, BTreeMap::len)
    }

    /// Takes in the joined ones of `pairs`, and returns those that are predicted by them and not yet `tried`: the largest
    /// overlaps first, and none of a photograph that has `most_partners` already.
    pub(super) fn grow(
        &mut self,
        pairs: &[PairMatches],
        frames: &[WorkingFrame],
        tried: &BTreeSet<(usize, usize)>,
        most_partners: usize,
    ) -> Vec<(usize, usize)> {
        let fresh: Vec<(usize, usize)> = pairs.iter().filter_map(|pair| self.take_in(pair)).collect();
        let mut predicted: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for &(a, b) in &fresh {
            for (from, middle) in [(a, b), (b, a)] {
                for PredictedPair { pair, share } in self.predicted_over(from, middle, frames, tried) {
                    let known = predicted.entry(pair).or_default();
                    *known = known.max(share);
                }
            }
        }
        let mut predicted: Vec<((usize, usize), f64)> = predicted.into_iter().collect();
        predicted.sort_by(|one, other| other.1.total_cmp(&one.1).then(one.0.cmp(&other.0)));
        let mut partners: BTreeMap<usize, usize> = BTreeMap::new();
        predicted.retain(|&((a, b), _)| {
            let mut room = |photograph: usize| {
                *partners.entry(photograph).or_insert_with(|| self.partners(photograph)) < most_partners
            };
            let wanted = room(a) && room(b);
            if wanted {
                [a, b].into_iter().for_each(|one| *partners.entry(one).or_default() += 1);
            }
            wanted
        });
        predicted.into_iter().map(|(pair, _)| pair).collect()
    }

    /// Takes in a joined pair whose homography is known.
    fn take_in(&mut self, pair: &PairMatches) -> Option<(usize, usize)> {
        let b_from_a = Homography::from_rows(&pair.b_from_a.filter(|_| pair.verdict.is_joined())?);
        let a_from_b = b_from_a.inverse()?;
        self.neighbors.entry(pair.a).or_default().insert(pair.b, b_from_a.0);
        self.neighbors.entry(pair.b).or_default().insert(pair.a, a_from_b.0);
        Some((pair.a, pair.b))
    }

    /// The pairs of `from` with the other neighbors of `middle` that are predicted to overlap.
    fn predicted_over(
        &self,
        from: usize,
        middle: usize,
        frames: &[WorkingFrame],
        tried: &BTreeSet<(usize, usize)>,
    ) -> Vec<PredictedPair> {
        let nothing = BTreeMap::new();
        let of = |photograph: usize| self.neighbors.get(&photograph).unwrap_or(&nothing);
        let Some(middle_from_from) = of(from).get(&middle) else { return Vec::new() };
        let untried =
            of(middle).iter().filter(|&(&to, _)| to != from && !tried.contains(&(from.min(to), from.max(to))));
        let predict = |(&to, to_from_middle): (&usize, &Matrix3<f64>)| {
            let to_from_from = Homography(to_from_middle * middle_from_from);
            let share = PredictedOverlap::new(to_from_from, frames.get(from)?, frames.get(to)?)?.share_of_a(PLACES);
            (share >= LEAST_SHARE).then_some(PredictedPair { pair: (from.min(to), from.max(to)), share })
        };
        untried.filter_map(predict).collect()
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::matches::{PairVerdict, PointMatches};

    use super::*;

    fn frames() -> Vec<WorkingFrame> {
        vec![WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 }; 6]
    }

    /// The second photograph shows what lies `shift` pixels to the right in the first.
    fn shifted(a: usize, b: usize, shift: f64) -> PairMatches {
        PairMatches {
            a,
            b,
            putative: 50,
            in_overlap: 50,
            agreeing: 50,
            needed: 15,
            verdict: PairVerdict::Joined,
            b_from_a: Some([[1.0, 0.0, -shift], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            inliers: PointMatches::default(),
            elsewhere: PointMatches::default(),
        }
    }

    #[test]
    fn what_lies_beyond_a_neighbor_is_predicted_as_far_as_it_overlaps() {
        // A row: 0 at 0, 1 at 300, 2 at 600, 3 at 1000.
        let pairs = [shifted(0, 1, 300.0), shifted(1, 2, 300.0), shifted(2, 3, 400.0)];
        let tried = pairs.iter().map(|pair| (pair.a, pair.b)).collect();
        let mut known = VerifiedOverlaps::default();
        // 0 and 2 share a quarter of the view, 1 and 3 an eighth.
        assert_eq!(known.grow(&pairs, &frames(), &tried, 9), [(0, 2), (1, 3)]);
        assert_eq!((known.partners(1), known.partners(4)), (2, 0));
        // Nothing is new.
        assert!(known.grow(&[], &frames(), &tried, 9).is_empty());
        // With (0, 2) tried and verified, 0 and 3 are predicted from 600 + 400 px: no overlap.
        let more = [shifted(0, 2, 600.0)];
        let tried = [(0, 1), (1, 2), (2, 3), (0, 2), (1, 3)].into();
        assert!(known.grow(&more, &frames(), &tried, 9).is_empty());
    }

    #[test]
    fn photographs_with_enough_partners_get_no_more() {
        let pairs = [shifted(0, 1, 100.0), shifted(0, 2, 200.0), shifted(0, 3, 300.0)];
        let tried = pairs.iter().map(|pair| (pair.a, pair.b)).collect();
        let mut known = VerifiedOverlaps::default();
        // All three lie 100 or 200 px from each other; of equals the first goes.
        assert_eq!(known.grow(&pairs, &frames(), &tried, 2), [(1, 2)]);
    }

    #[test]
    fn pairs_that_are_not_joined_or_have_no_homography_predict_nothing() {
        let mut pairs = [shifted(0, 1, 100.0), shifted(1, 2, 100.0)];
        pairs[0].verdict = PairVerdict::TooFewInliers;
        assert!(VerifiedOverlaps::default().grow(&pairs, &frames(), &BTreeSet::new(), 9).is_empty());
        pairs[0].verdict = PairVerdict::Joined;
        pairs[0].b_from_a = None;
        assert!(VerifiedOverlaps::default().grow(&pairs, &frames(), &BTreeSet::new(), 9).is_empty());
    }
}
