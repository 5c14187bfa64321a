//! Which placement of a photograph is shown where on an unrolled canvas.

use std::ops::Range;

use crate::label::{Label, NOBODY};
use crate::layout::Unrolled;
use crate::seam::Seams;

/// Seams on an unrolled canvas.
#[derive(Clone, Copy)]
pub(super) struct ShownWhere<'a> {
    pub(super) unrolled: &'a Unrolled<'a>,
    pub(super) seams: &'a Seams,
}

impl ShownWhere<'_> {
    /// The seams' label of a placement.
    pub(super) fn label(&self, placement: Label) -> Label {
        self.unrolled.original_of(usize::from(placement)).map_or(NOBODY, |original| original as Label)
    }

    /// Labels at the middles of squares of `step` pixels of the unrolled canvas, `columns` of row `y` of them.
    pub(super) fn labels(&self, y: usize, columns: &Range<usize>, step: usize, out: &mut Vec<Label>) {
        let Self { unrolled, seams } = self;
        match unrolled.original_layout().period {
            None => seams.row(y, columns, unrolled.canvas().map(|length| length.div_ceil(step)), out),
            Some(_) => {
                let points = |pixels: usize| pixels as f64 / step as f64;
                seams.row_around(y, columns, points(unrolled.lead()), unrolled.finished().map(points), out);
            }
        }
    }

    /// The placements that a box of the unrolled canvas may show, in order.
    pub(super) fn shown_in(&self, columns: &Range<usize>, rows: &Range<usize>) -> Vec<Label> {
        let Self { unrolled, seams } = self;
        let Some(period) = unrolled.original_layout().period else {
            return seams.shown_in(columns, rows, unrolled.canvas());
        };
        // Canvas pixels by which a photograph's border is felt beyond it.
        const RIM_PX: f64 = 2.0;
        let lead = unrolled.lead();
        let ahead = lead.div_ceil(period) * period - lead;
        let shown = seams.shown_in(&(columns.start + ahead..columns.end + ahead), rows, unrolled.finished());
        let is_there = |placement: usize| {
            let (low, high) = unrolled.placed()[placement].mesh.bounds();
            low.x - RIM_PX < columns.end as f64 && high.x + RIM_PX > columns.start as f64
        };
        let placements = shown.iter().flat_map(|&label| unrolled.placements(usize::from(label)));
        placements.filter(|&placement| is_there(placement)).map(|placement| placement as Label).collect()
    }
}
