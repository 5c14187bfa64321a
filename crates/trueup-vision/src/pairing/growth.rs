//! Overlaps that known overlaps predict: two photographs that overlap a third mostly lie where their homographies put
//! them, and so do two at the ends of three overlaps in a row.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix3;
use rayon::prelude::*;
use trueup_core::geometry::Homography;
use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;

use super::ordered;
use crate::matching::PredictedOverlap;

/// Places along each side of a photograph, from border to border, that are asked whether the other shows them.
const PLACES: usize = 10;
/// How far beyond a photograph's border what it is predicted to show may lie, as a share of its sides: predictions over
/// two homographies are off by so much where features are few.
const MARGIN: f64 = 0.05;
/// Share of a photograph that another one must be predicted to show, margin and all: smaller overlaps are hardly ever
/// verified.
const LEAST_SHARE: f64 = 0.01;

/// The overlaps verified so far.
#[derive(Debug, Default)]
pub(super) struct VerifiedOverlaps {
    /// For every photograph those that overlap it, with the map to each.
    neighbors: BTreeMap<usize, BTreeMap<usize, Matrix3<f64>>>,
}

impl VerifiedOverlaps {
    /// Photographs that are known to overlap one.
    pub(super) fn partners(&self, photograph: usize) -> usize {
        self.neighbors.get(&photograph).map_or(0, BTreeMap::len)
    }

    /// Takes in the joined ones of `pairs`, and returns those that are predicted by them and not yet `tried`: the
    /// largest overlaps first, and none of a photograph that has `most_partners` already. Where they predict none over
    /// one photograph, all that are known do over two.
    pub(super) fn grow(
        &mut self,
        pairs: &[PairMatches],
        frames: &[WorkingFrame],
        tried: &BTreeSet<(usize, usize)>,
        most_partners: usize,
    ) -> Vec<(usize, usize)> {
        let fresh: Vec<(usize, usize)> = pairs.iter().filter_map(|pair| self.take_in(pair)).collect();
        let prediction = Prediction { known: self, frames, tried };
        let near = self.with_room(prediction.over(&fresh, Prediction::over_one), most_partners);
        if !near.is_empty() {
            return near;
        }
        let beyond = |(&one, neighbors): (&usize, &BTreeMap<usize, Matrix3<f64>>)| {
            neighbors.range(one..).map(move |(&other, _)| (one, other)).collect::<Vec<_>>()
        };
        let all: Vec<(usize, usize)> = self.neighbors.iter().flat_map(beyond).collect();
        self.with_room(prediction.over(&all, Prediction::over_two), most_partners)
    }

    /// These pairs, the largest shares first, without those of photographs that have `most_partners`, known or before
    /// in the order.
    fn with_room(&self, predicted: BTreeMap<(usize, usize), f64>, most_partners: usize) -> Vec<(usize, usize)> {
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

    /// The other photographs that overlap one, with the map to each.
    fn others(&self, photograph: usize, but: usize) -> impl Iterator<Item = (usize, &Matrix3<f64>)> {
        let neighbors = self.neighbors.get(&photograph).into_iter().flatten();
        neighbors.map(|(&other, map)| (other, map)).filter(move |&(other, _)| other != but)
    }

    /// The map of an overlap that is known.
    fn map(&self, to: usize, from: usize) -> Option<&Matrix3<f64>> {
        self.neighbors.get(&from)?.get(&to)
    }
}

/// A pair that is predicted, and the larger share of one photograph that the other shows.
type PredictedPair = ((usize, usize), f64);

/// What known overlaps are asked.
#[derive(Clone, Copy)]
struct Prediction<'a> {
    known: &'a VerifiedOverlaps,
    frames: &'a [WorkingFrame],
    tried: &'a BTreeSet<(usize, usize)>,
}

impl Prediction<'_> {
    /// The pairs that paths over these overlaps predict, each with its largest share.
    fn over(
        &self,
        overlaps: &[(usize, usize)],
        paths: impl Fn(&Self, usize, usize) -> Vec<PredictedPair> + Sync,
    ) -> BTreeMap<(usize, usize), f64> {
        let found: Vec<PredictedPair> = overlaps.par_iter().flat_map_iter(|&(a, b)| paths(self, a, b)).collect();
        let mut predicted: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for (pair, share) in found {
            let known = predicted.entry(pair).or_default();
            *known = known.max(share);
        }
        predicted
    }

    /// Either of an overlap with what overlaps the other.
    fn over_one(&self, a: usize, b: usize) -> Vec<PredictedPair> {
        let beyond = |from: usize, middle: usize| {
            let middle_from_from = self.known.map(middle, from);
            let ends = self.known.others(middle, from);
            ends.filter_map(move |(to, to_from_middle)| self.predicted(from, to, to_from_middle * middle_from_from?))
        };
        beyond(a, b).chain(beyond(b, a)).collect()
    }

    /// What overlaps one of an overlap with what overlaps the other.
    fn over_two(&self, a: usize, b: usize) -> Vec<PredictedPair> {
        let Some(b_from_a) = self.known.map(b, a) else { return Vec::new() };
        let from_start = |from: usize| {
            let b_from_from = self.known.map(a, from).map(|a_from_from| b_from_a * a_from_from);
            let ends = self.known.others(b, a);
            ends.filter_map(move |(to, to_from_b)| self.predicted(from, to, to_from_b * b_from_from?))
        };
        self.known.others(a, b).flat_map(|(from, _)| from_start(from)).collect()
    }

    /// The pair if it was not tried and enough of one photograph is predicted to be in the other.
    fn predicted(&self, from: usize, to: usize, to_from_from: Matrix3<f64>) -> Option<PredictedPair> {
        let pair = ordered(from, to);
        if from == to || self.tried.contains(&pair) {
            return None;
        }
        let (from, to) = (self.frames.get(from)?, self.frames.get(to)?);
        let share = PredictedOverlap::new(Homography(to_from_from), from, to)?.larger_share(PLACES, MARGIN);
        (share >= LEAST_SHARE).then_some((pair, share))
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

    /// 0 and 3 overlap by an eighth, and no photograph between them joined both: 0 at 0, 1 at 300, 2 at 350, 3 at 700.
    #[test]
    fn the_ends_of_three_overlaps_in_a_row_are_predicted() {
        let pairs = [shifted(0, 1, 300.0), shifted(1, 2, 50.0), shifted(2, 3, 350.0)];
        let tried = [(0, 1), (1, 2), (2, 3), (0, 2), (1, 3)].into();
        assert_eq!(VerifiedOverlaps::default().grow(&pairs, &frames(), &tried, 9), [(0, 3)]);
        // Known one after the other, each end may be the last to be known.
        let mut known = VerifiedOverlaps::default();
        assert!(known.grow(&pairs[..2], &frames(), &tried, 9).is_empty());
        assert_eq!(known.grow(&pairs[2..], &frames(), &tried, 9), [(0, 3)]);
    }

    /// What a prediction has beyond the border by less than a twentieth of the side may be within it.
    #[test]
    fn what_is_predicted_just_beyond_the_border_is_tried() {
        for (shift, expected) in [(410.0, vec![(0, 2)]), (430.0, vec![])] {
            let pairs = [shifted(0, 1, shift), shifted(1, 2, shift)];
            let tried = [(0, 1), (1, 2)].into();
            assert_eq!(VerifiedOverlaps::default().grow(&pairs, &frames(), &tried, 9), expected);
        }
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
