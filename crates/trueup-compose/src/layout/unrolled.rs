//! The canvas as it is blended: a cylinder is unrolled, with as much of the turns before and after as blending reaches.

use std::borrow::Cow;
use std::ops::Range;

use trueup_core::{Error, Result};

use super::canvas::{CanvasLayout, Placed};
use crate::label::NOBODY;

/// A layout without a period, on which the photographs of one with a period lie wherever they are seen. The turn
/// between [`Self::lead`] and `lead + width` is the panorama. Without a period the layout is as it was.
pub(crate) struct Unrolled<'a> {
    original: &'a CanvasLayout,
    layout: Cow<'a, CanvasLayout>,
    /// For each placement the position of its photograph in the original.
    originals: Vec<usize>,
    lead: usize,
}

impl<'a> Unrolled<'a> {
    /// With room for `levels` above `first_level`, or for cutting without blending.
    pub(crate) fn new(layout: &'a CanvasLayout, first_level: u32, levels: Option<u32>) -> Result<Self> {
        // Widest samples beside a pixel that it is made of: reducing reaches less than two of them, interpolating less
        // than two more, and rims of photographs are at most a few finer ones wide. Masks that are interpolated to the
        // second widest level reach no farther.
        const REACH: usize = 5;
        let lead = match (layout.period, levels) {
            (Some(_), Some(levels)) => REACH << (first_level + levels),
            _ => 0,
        };
        let (unrolled, originals) = layout.unrolled(lead);
        if originals.len() >= usize::from(NOBODY) {
            return Err(Error::input(
                "seams",
                format!("{} photographs are seen at {} places", layout.placed.len(), originals.len()),
                "Give at most 65534.",
            ));
        }
        Ok(Self { original: layout, layout: unrolled, originals, lead })
    }

    /// The position in the original of the photograph of a placement; `None` if there is no such placement.
    pub(crate) fn original_of(&self, placement: usize) -> Option<usize> {
        self.originals.get(placement).copied()
    }

    /// The layout that was unrolled.
    pub(crate) fn original_layout(&self) -> &CanvasLayout {
        self.original
    }

    /// The photographs wherever they are seen, on the unrolled canvas.
    pub(crate) fn layout(&self) -> &CanvasLayout {
        &self.layout
    }

    /// Size of the unrolled canvas.
    pub(crate) fn canvas(&self) -> [usize; 2] {
        [self.layout.width, self.layout.height]
    }

    /// Size of what is finished of it.
    pub(crate) fn finished(&self) -> [usize; 2] {
        [self.original.width, self.original.height]
    }

    /// Columns before the first one that is finished, a multiple of 2^first_level.
    pub(crate) fn lead(&self) -> usize {
        self.lead
    }

    /// The photographs wherever they are seen; those of one photograph follow each other.
    pub(crate) fn placed(&self) -> &[Placed] {
        &self.layout.placed
    }

    /// The position in the original of the photograph of a placement.
    pub(crate) fn original(&self, placement: usize) -> usize {
        self.originals[placement]
    }

    /// The placements of the photograph at a position of the original.
    pub(crate) fn placements(&self, original: usize) -> Range<usize> {
        let first = self.originals.partition_point(|&one| one < original);
        first..self.originals.partition_point(|&one| one <= original)
    }
}
