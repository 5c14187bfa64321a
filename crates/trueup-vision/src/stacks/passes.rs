//! In which orders the exposures of a scene may have been taken.
//!
//! Cameras that bracket take all exposures of a view before it is turned. Who sets them by hand may as well turn once
//! round at the one, and again at the next, with a panorama head that comes to rest at the same places.

use std::iter::once;

/// Most passes: who sets exposures by hand takes two, three or five.
const MOST_PASSES: usize = 5;

/// Photographs in an order in which those of one view follow one another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ShotOrder {
    /// Their numbers.
    pub(super) numbers: Vec<usize>,
    /// How many of them, one after the other, are of one view at most; every so many photographs, another view begins.
    pub(super) of_view: usize,
}

impl ShotOrder {
    pub(super) fn views(&self) -> usize {
        self.numbers.len() / self.of_view
    }

    /// The first `most` views alone.
    pub(super) fn first_views(&self, most: usize) -> Self {
        let count = self.numbers.len().min(most * self.of_view);
        Self { numbers: self.numbers[..count].to_vec(), of_view: self.of_view }
    }
}

/// As photographs come; where a view ends is not known.
pub(super) fn one_by_one(count: usize) -> ShotOrder {
    ShotOrder { numbers: (0..count).collect(), of_view: count.max(1) }
}

/// Passes over as many views each, two views at least: each in the direction of the first, or every other one back
/// again. The most passes first: of four, every other two are two passes as well.
pub(super) fn orders(count: usize) -> impl Iterator<Item = ShotOrder> {
    let splits = (2..=MOST_PASSES).rev().filter(move |passes| count.is_multiple_of(*passes) && count / passes >= 2);
    splits.flat_map(move |passes| once(in_passes(count, passes, false)).chain(once(in_passes(count, passes, true))))
}

fn in_passes(count: usize, passes: usize, and_back: bool) -> ShotOrder {
    let views = count / passes;
    let number = |view: usize, pass: usize| {
        let is_back = and_back && pass % 2 == 1;
        pass * views + if is_back { views - 1 - view } else { view }
    };
    let number = &number;
    let numbers = (0..views).flat_map(|view| (0..passes).map(move |pass| number(view, pass))).collect();
    ShotOrder { numbers, of_view: passes }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six photographs are two passes over three views or three over two.
    #[test]
    fn passes_go_round_or_there_and_back() {
        let found: Vec<(usize, Vec<usize>)> = orders(6).map(|order| (order.of_view, order.numbers)).collect();
        let expected = [
            (3, vec![0, 2, 4, 1, 3, 5]),
            (3, vec![0, 3, 4, 1, 2, 5]),
            (2, vec![0, 3, 1, 4, 2, 5]),
            (2, vec![0, 5, 1, 4, 2, 3]),
        ];
        assert_eq!(found, expected);
        for few in 0..4 {
            assert_eq!(orders(few).count(), 0, "two views at two exposures are four photographs");
        }
        let order = one_by_one(0);
        assert_eq!((order.views(), order.first_views(4)), (0, order.clone()));
        assert_eq!(in_passes(12, 2, false).first_views(2).numbers, [0, 6, 1, 7]);
    }
}
