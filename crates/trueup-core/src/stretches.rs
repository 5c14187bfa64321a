//! Stretches of a row of pixels.

use std::ops::Range;

/// What of the columns `of` lies outside of `stretches` of them, which ascend and do not overlap: ascending stretches,
/// one more than these; some may be empty.
pub fn complement(
    of: Range<usize>,
    stretches: impl Iterator<Item = Range<usize>> + Clone,
) -> impl Iterator<Item = Range<usize>> {
    let starts = std::iter::once(of.start).chain(stretches.clone().map(|stretch| stretch.end));
    let ends = stretches.map(|stretch| stretch.start).chain([of.end]);
    starts.zip(ends).map(|(start, end)| start..end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_complement_is_what_is_left() {
        let left = |stretches: Vec<Range<usize>>| complement(2..9, stretches.into_iter()).collect::<Vec<_>>();
        assert_eq!(left(vec![3..5, 6..9]), [2..3, 5..6, 9..9]);
        assert_eq!(left(Vec::new()), vec![2..9]);
    }
}
