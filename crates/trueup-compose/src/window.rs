//! Boxes of canvas pixels.

use std::ops::Range;

/// A part of the canvas.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window<'a> {
    pub(crate) columns: &'a Range<usize>,
    pub(crate) rows: &'a Range<usize>,
}

/// A range with so many more on both sides, from 0 to `length`.
pub(crate) fn widened(range: &Range<usize>, margin: usize, length: usize) -> Range<usize> {
    range.start.saturating_sub(margin)..range.end.saturating_add(margin).min(length)
}

/// The places within `reach` of one, from 0 to `length`; `around` a circle of so many each at most once.
pub(crate) fn near(place: usize, reach: usize, length: usize, around: bool) -> impl Iterator<Item = usize> {
    let range = match around {
        true => {
            let reach = reach.min(length.saturating_sub(1) / 2);
            place + length - reach..place + length + reach + 1
        }
        false => place.saturating_sub(reach)..place.saturating_add(reach + 1).min(length),
    };
    range.map(move |place| if place < length { place } else { place % length })
}

/// What two ranges have in common; empty if they are apart.
pub(crate) fn common(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    a.start.max(b.start)..a.end.min(b.end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_goes_across_the_ends_of_a_circle() {
        let places = |place, reach, around| near(place, reach, 6, around).collect::<Vec<_>>();
        assert_eq!([places(1, 2, false), places(5, 2, false)], [vec![0, 1, 2, 3], vec![3, 4, 5]]);
        assert_eq!([places(1, 2, true), places(5, 2, true)], [vec![5, 0, 1, 2, 3], vec![3, 4, 5, 0, 1]]);
        assert_eq!(places(0, 9, true), [4, 5, 0, 1, 2]);
        assert_eq!(widened(&(2..4), 3, 6), 0..6);
    }
}
