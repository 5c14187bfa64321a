//! Which placement of a photograph is shown where on an unrolled canvas.

use std::collections::BTreeSet;
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
        // Canvas pixels by which a photograph's border is felt beyond it.
        const RIM_PX: f64 = 2.0;
        let is_there = |placement: usize| {
            let (low, high) = unrolled.placed()[placement].mesh.bounds();
            low.x - RIM_PX < columns.end as f64 && high.x + RIM_PX > columns.start as f64
        };
        let shown: Vec<Label> = match unrolled.original_layout().period {
            None => seams.shown_in(columns, rows, unrolled.canvas()),
            Some(period) => {
                let lead = unrolled.lead();
                let ahead = lead.div_ceil(period) * period - lead;
                let shown = seams.shown_in(&(columns.start + ahead..columns.end + ahead), rows, unrolled.finished());
                let placements = shown.iter().flat_map(|&label| unrolled.placements(usize::from(label)));
                placements.filter(|&placement| is_there(placement)).map(|placement| placement as Label).collect()
            }
        };
        let [_, height] = unrolled.canvas();
        if rows.start > 0 && rows.end < height {
            return shown;
        }
        // Beside the pole of a sphere, one photograph lies on the canvas in sectors, and its cells are wide: of two
        // sectors, one may cover what the small views, which see no row so near the pole, show of the other.
        let placed = unrolled.placed();
        let photographs: BTreeSet<usize> =
            shown.iter().map(|&placement| placed[usize::from(placement)].photograph).collect();
        let is_sector = |placement: usize| photographs.contains(&placed[placement].photograph) && is_there(placement);
        let as_well = (0..placed.len()).filter(|&placement| is_sector(placement)).map(|placement| placement as Label);
        shown.iter().copied().chain(as_well).collect::<BTreeSet<Label>>().into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::mesh::GridMesh;

    use super::*;
    use crate::layout::{CanvasLayout, Placed};

    /// A photograph in two sectors and another one; the small views show the first sector everywhere.
    #[test]
    fn beside_a_pole_the_other_sectors_of_a_photograph_are_shown_as_well() {
        const SIDE: usize = 400;
        let placed = |photograph: usize, left: f64| {
            let mut mesh = GridMesh::regular(200.0, SIDE as f64, 40.0);
            mesh.target.iter_mut().for_each(|vertex| vertex[0] += left);
            Placed { photograph, mesh }
        };
        let layout = CanvasLayout {
            width: SIDE,
            height: SIDE,
            canvas_from_target: 1.0,
            origin: [0.0; 2],
            placed: vec![placed(0, 0.0), placed(0, 150.0), placed(1, 150.0)],
            period: None,
        };
        let unrolled = Unrolled::new(&layout, 0, None).expect("few placements");
        let seams = Seams::of_one(SIDE, SIDE);
        let shown = ShownWhere { unrolled: &unrolled, seams: &seams };
        assert_eq!(shown.shown_in(&(160..224), &(0..64)), [0, 1]);
        assert_eq!(shown.shown_in(&(160..224), &(350..SIDE)), [0, 1]);
        assert_eq!(shown.shown_in(&(160..224), &(64..128)), [0]);
        assert_eq!(shown.shown_in(&(0..64), &(0..64)), [0]);
    }
}
