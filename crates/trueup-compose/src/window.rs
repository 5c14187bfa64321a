//! Boxes of canvas pixels.

use std::ops::Range;

/// A part of the canvas.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window<'a> {
    pub(crate) columns: &'a Range<usize>,
    pub(crate) rows: &'a Range<usize>,
}

/// What two ranges have in common; empty if they are apart.
pub(crate) fn common(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    a.start.max(b.start)..a.end.min(b.end)
}
