//! The rectangle that loses least of what matters.

use std::borrow::Cow;

use super::cells::{Cells, near};
use super::search::{Best, Worths};
use super::smooth::{Fillable, Smoothness};
use super::worth::{UpperEnd, Worth};
use crate::coverage::{Coverage, Rectangle};
use crate::gaps::FRAME_REACH;
use crate::layout::CanvasLayout;
use crate::window;

/// What a cell of a thing that stands out is worth beside a calm one, which is worth 1.
const THING: f32 = 4.0;
/// Cost of a cell that no photograph covers and that is filled: it is filled only where that saves more than as many
/// calm cells.
const FILLED: f32 = 1.0;
/// Further cost of a filled cell if the border near it were not smooth at all; a share of it for a share.
const FILLED_BESIDE_ROUGH: f32 = 10.0;
/// Cost of a thing that ends in front of what is filled, as a wire or a lamp post that ran out of the photograph, for
/// each filled cell at it: calm cells as a multiple of the panorama's longer side, so many rows of them. A line three
/// cells wide costs a strip of about a twentieth of the longer side. Times the cube of the share of the border that is
/// smooth there: alone in an even sky it is seen to end, among others it is not.
const ENDED: f32 = 10.0;
/// Strength of an edge up to which nothing is seen to end there: noise, and the soft edges of clouds.
const CALM_EDGE: f32 = 0.2;
/// Cost of cutting through a thing, for each cell of the cut: calm cells as a share of the panorama's longer side.
const CUT: f32 = 0.1;
/// Of that, what cutting it to the left or right costs: things that stand on the ground are expected to go on to the
/// sides.
const CUT_ASIDE: f32 = 0.5;
/// Cost of cutting off the upper end of a thing that ends within the picture, for each column of cells: calm cells as a
/// share of the panorama's longer side.
const BEHEADED: f32 = 0.3;
/// How much more it costs if the end rises above most of what is beside it, for each part of the panorama's longer side
/// by which it does: a tower that rises by a tenth counts four times as much as a roof among roofs.
const PROMINENT: f32 = 30.0;
/// Share of the panorama's longer side by which a thing rises above most of what is beside it that is not to be cut
/// off: a tower.
const TOWERING: f32 = 0.04;
/// Half the width of the thing that an upper end belongs to, as a share of the panorama's longer side: a spire counts
/// as much as the tower that bears it.
const BEARER: f64 = 0.02;

/// What may be filled of a rectangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Filling {
    /// What goes on smoothly, at a cost where a thing ends in front of it.
    Unnoticed,
    /// That at no such cost.
    Ending,
    /// What goes on smoothly at that cost, and at none above a row of pixels, where also what goes on as clouds do.
    CloudsAbove(usize),
}

/// A rectangle of a canvas.
#[derive(Debug, Clone)]
pub(super) struct Chosen {
    pub(super) rectangle: Rectangle,
    /// Whether it cuts off the upper end of a thing that towers above what is beside it.
    pub(super) beheads: bool,
}

/// A canvas, and what of it matters and may be filled.
pub(super) struct Choice<'a> {
    cells: &'a Cells,
    layout: &'a CanvasLayout,
    coverage: &'a Coverage,
    worth: Worth,
    /// Cells from what is covered up to which it may be filled.
    reach: usize,
    sky: Fillable,
}

impl<'a> Choice<'a> {
    /// Among the rectangles of a canvas that is seen in `cells`.
    pub(super) fn new(cells: &'a Cells, layout: &'a CanvasLayout, coverage: &'a Coverage) -> Self {
        let mut worth = Worth::of(cells);
        worth.ends = widened(&worth.ends, (BEARER * f64::from(longer_side(cells))).round() as usize, cells.around);
        let reach = (FRAME_REACH * layout.photograph_side() / cells.side as f64) as usize;
        let reach = reach.min(cells.columns + cells.rows);
        let sky = Fillable::of(cells, Smoothness::SKY, reach);
        Self { cells, layout, coverage, worth, reach, sky }
    }

    /// The rectangle that loses least of what matters and has no holes but such as may be filled; of a full turn, of
    /// all its width. `None` if there is none.
    pub(super) fn rectangle(&self, filling: Filling) -> Option<Chosen> {
        let Self { cells, layout, worth, .. } = self;
        let (fillable, free_rows) = match filling {
            Filling::Unnoticed => (Cow::Borrowed(&self.sky), 0),
            Filling::Ending => (Cow::Borrowed(&self.sky), cells.rows),
            Filling::CloudsAbove(row) => {
                let rows = row.div_ceil(cells.side);
                let mut fillable = Fillable::of(cells, Smoothness::CLOUDS, self.reach);
                let below = rows * cells.columns;
                fillable.smooth[below..].copy_from_slice(&self.sky.smooth[below..]);
                (Cow::Owned(fillable), rows)
            }
        };
        let best = worths(cells, worth, &fillable, free_rows).best(cells.around)?;
        let is_open = |x: usize, y: usize| {
            self.coverage.holds(x, y) || fillable.smooth[y / cells.side * cells.columns + x / cells.side].is_some()
        };
        let towering = TOWERING * longer_side(cells);
        let is_cut = |end: &UpperEnd| best.rows.start > end.top && end.prominence as f32 >= towering;
        let beheads = worth.ends[best.columns.clone()].iter().flatten().any(is_cut);
        Some(Chosen { rectangle: grown(&best, cells.side, [layout.width, layout.height], is_open), beheads })
    }
}

/// Cells along the panorama's longer side.
fn longer_side(cells: &Cells) -> f32 {
    cells.columns.max(cells.rows) as f32
}

/// What every cell and every cut is worth. In the first `free_rows` it costs nothing if a thing ends in front of what
/// is filled.
fn worths(cells: &Cells, worth: &Worth, fillable: &Fillable, free_rows: usize) -> Worths {
    let (columns, rows) = (cells.columns, cells.rows);
    let Worth { edges, salience, ends } = worth;
    let longer = longer_side(cells);
    let beheaded = |end: &UpperEnd| BEHEADED * (longer + PROMINENT * end.prominence as f32);
    let cell = |at: usize| match cells.covered[at] {
        true => Some(1.0 + THING * salience[at]),
        false => fillable.smooth[at].map(|smooth| {
            let edge = near(cells, at).map(|other| edges[other] - CALM_EDGE).fold(0.0, f32::max);
            let ended = if at < free_rows * columns { 0.0 } else { ENDED * longer * edge * smooth.powi(3) };
            -FILLED - FILLED_BESIDE_ROUGH * (1.0 - smooth) - ended
        }),
    };
    // What two cells have of one thing.
    let joined = |a: usize, b: usize| CUT * longer * salience[a].min(salience[b]);
    let between_rows = |x: usize, y: usize| match y > 0 && y < rows {
        true => joined((y - 1) * columns + x, y * columns + x),
        false => 0.0,
    };
    let above =
        |x: usize, y: usize| between_rows(x, y) + ends[x].as_ref().filter(|end| y > end.row).map_or(0.0, beheaded);
    let beside = |x: usize, y: usize| match x > 0 && x < columns {
        true => CUT_ASIDE * joined(y * columns + x - 1, y * columns + x),
        false => 0.0,
    };
    Worths {
        columns,
        rows,
        cells: (0..columns * rows).map(cell).collect(),
        above: (0..columns * (rows + 1)).map(|at| above(at % columns, at / columns)).collect(),
        below: (0..columns * (rows + 1)).map(|at| between_rows(at % columns, at / columns)).collect(),
        beside: (0..(columns + 1) * rows).map(|at| beside(at % (columns + 1), at / (columns + 1))).collect(),
    }
}

/// The highest end within `reach` columns of each, `around` a full turn across its ends, too.
pub(super) fn widened(ends: &[Option<UpperEnd>], reach: usize, around: bool) -> Vec<Option<UpperEnd>> {
    let beside = |x: usize| window::near(x, reach, ends.len(), around).filter_map(|other| ends[other].as_ref());
    (0..ends.len()).map(|x| beside(x).min_by_key(|end| end.row).copied()).collect()
}

/// A rectangle of cells in pixels, with the rows and columns of pixels around it that are open all along.
fn grown(best: &Best, side: usize, [width, height]: [usize; 2], is_open: impl Fn(usize, usize) -> bool) -> Rectangle {
    let mut columns = best.columns.start * side..(best.columns.end * side).min(width);
    let mut rows = best.rows.start * side..(best.rows.end * side).min(height);
    // What lies farther is another row or column of cells, which the search has left out.
    for _ in 0..side {
        let row_is_open = |y: usize, columns: &std::ops::Range<usize>| columns.clone().all(|x| is_open(x, y));
        if rows.start > 0 && row_is_open(rows.start - 1, &columns) {
            rows.start -= 1;
        }
        if rows.end < height && row_is_open(rows.end, &columns) {
            rows.end += 1;
        }
        let column_is_open = |x: usize| rows.clone().all(|y| is_open(x, y));
        let (left, right) = (columns.start, columns.end);
        if left > 0 && column_is_open(left - 1) {
            columns.start -= 1;
        }
        if right < width && column_is_open(right) {
            columns.end += 1;
        }
    }
    Rectangle { columns, rows }
}
