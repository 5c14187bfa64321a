//! The canvas as it is blended: a cylinder is unrolled, with as much of the turns before and after as blending reaches.

use std::borrow::Cow;
use std::ops::Range;

use trueup_core::{Error, Result};

use crate::layout::{CanvasLayout, Placed};
use crate::seam::{Label, NOBODY, Seams};

/// A layout without a period, on which the photographs of one with a period lie wherever they are seen. The turn between
/// [`Self::lead`] and `lead + width` is the panorama. Without a period the layout is as it was.
pub(super) struct Unrolled<'a> {
    original: &'a CanvasLayout,
    layout: Cow<'a, CanvasLayout>,
    /// For each placement the position of its photograph in the original.
    originals: Vec<usize>,
    lead: usize,
}

impl<'a> Unrolled<'a> {
    /// With room for `levels` above `first_level`, or for cutting without blending.
    pub(super) fn new(layout: &'a CanvasLayout, first_level: u32, levels: Option<u32>) -> Result<Self> {
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

    /// The layout that was unrolled.
    pub(super) fn original_layout(&self) -> &CanvasLayout {
        self.original
    }

    /// The photographs wherever they are seen, on the unrolled canvas.
    pub(super) fn layout(&self) -> &CanvasLayout {
        &self.layout
    }

    /// Size of the unrolled canvas.
    pub(super) fn canvas(&self) -> [usize; 2] {
        [self.layout.width, self.layout.height]
    }

    /// Size of what is finished of it.
    pub(super) fn finished(&self) -> [usize; 2] {
        [self.original.width, self.original.height]
    }

    /// Columns before the first one that is finished, a multiple of 2^first_level.
    pub(super) fn lead(&self) -> usize {
        self.lead
    }

    /// The photographs wherever they are seen; those of one photograph follow each other.
    pub(super) fn placed(&self) -> &[Placed] {
        &self.layout.placed
    }

    /// The position in the original of the photograph of a placement.
    pub(super) fn original(&self, placement: usize) -> usize {
        self.originals[placement]
    }

    /// The placements of the photograph at a position of the original.
    pub(super) fn placements(&self, original: usize) -> Range<usize> {
        let first = self.originals.partition_point(|&one| one < original);
        first..self.originals.partition_point(|&one| one <= original)
    }

    /// The seams' label of a placement.
    pub(super) fn label(&self, placement: Label) -> Label {
        self.originals.get(usize::from(placement)).map_or(NOBODY, |&original| original as Label)
    }

    /// Labels at the middles of squares of `step` pixels of the unrolled canvas, `columns` of row `y` of them.
    pub(super) fn labels(
        &self,
        seams: &Seams,
        (y, columns): (usize, &Range<usize>),
        step: usize,
        out: &mut Vec<Label>,
    ) {
        match self.original.period {
            None => seams.row(y, columns, self.canvas().map(|length| length.div_ceil(step)), out),
            Some(_) => {
                let points = |pixels: usize| pixels as f64 / step as f64;
                seams.row_around(y, columns, (points(self.lead), self.finished().map(points)), out);
            }
        }
    }

    /// The placements that a box of the unrolled canvas may show, in order.
    pub(super) fn shown_in(&self, seams: &Seams, columns: &Range<usize>, rows: &Range<usize>) -> Vec<Label> {
        let Some(period) = self.original.period else { return seams.shown_in(columns, rows, self.canvas()) };
        // Canvas pixels by which a photograph's border is felt beyond it.
        const RIM_PX: f64 = 2.0;
        let ahead = self.lead.div_ceil(period) * period - self.lead;
        let shown = seams.shown_in(&(columns.start + ahead..columns.end + ahead), rows, self.finished());
        let is_there = |placement: usize| {
            let (low, high) = self.placed()[placement].mesh.bounds();
            low.x - RIM_PX < columns.end as f64 && high.x + RIM_PX > columns.start as f64
        };
        let placements = shown.iter().flat_map(|&label| self.placements(usize::from(label)));
        placements.filter(|&placement| is_there(placement)).map(|placement| placement as Label).collect()
    }
}
