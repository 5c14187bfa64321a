//! Boxes of canvas pixels.

use std::ops::Range;

/// A part of the canvas.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window<'a> {
    pub(crate) columns: &'a Range<usize>,
    pub(crate) rows: &'a Range<usize>,
}
