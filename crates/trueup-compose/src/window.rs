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

/// What two ranges have in common; empty if they are apart.
pub(crate) fn common(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    a.start.max(b.start)..a.end.min(b.end)
}
