//! The cells of a panorama before it is composed, and what photographs show of them at the border of what is covered.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cells::{CellGrid, Sums};
use crate::coverage::Coverage;
use crate::layout::CanvasLayout;
use crate::transfer_curve::EncodeRoots;
use crate::warped::{Resampling, SamplingMemory, WarpedPhotograph};
use crate::weights::WHOLE;
use crate::window::Window;

/// Pixels of the small views along a cell's side, at least: fewer, and some cell has none.
const LEAST_PIXELS: f64 = 2.0;

/// Steps from an empty cell to the farthest whose deviation is asked for: to the one beside it, and from there once
/// more.
const BORDER_STEPS: usize = 2;

/// The cells of a canvas of which nothing is composed yet.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct CellsAhead {
    pub(super) grid: CellGrid,
    pub(super) around: bool,
    pub(super) covered: Vec<bool>,
    /// Whether a cell's deviation may be asked for.
    at_border: Vec<bool>,
}

/// Deviations of what one photograph covers of the cells of which they may be asked for, in order of the cells.
pub(crate) type BorderDeviations = Vec<(usize, f32)>;

impl CellsAhead {
    /// Those of a layout whose small views lie on a canvas of `small` pixels; `None` if that is too coarse for them.
    pub(crate) fn new(layout: &CanvasLayout, coverage: &Coverage, small: [usize; 2]) -> Option<Self> {
        let grid = CellGrid::of([layout.width, layout.height]);
        let is_fine = |axis: usize| (grid.side * small[axis]) as f64 >= LEAST_PIXELS * grid.canvas[axis] as f64;
        if !(is_fine(0) && is_fine(1)) {
            return None;
        }
        let around = layout.period.is_some();
        let covered = grid.covered(coverage);
        let at_border = near(&grid, around, covered.iter().map(|&covered| !covered).collect());
        Some(Self { grid, around, covered, at_border })
    }

    /// Whether they are those of a layout: of others, places lie elsewhere.
    pub(crate) fn are_of(&self, layout: &CanvasLayout) -> bool {
        let Self { grid, around, covered, at_border } = self;
        let cells = grid.columns * grid.rows;
        *grid == CellGrid::of([layout.width, layout.height])
            && *around == layout.period.is_some()
            && [covered.len(), at_border.len()] == [cells; 2]
    }

    /// What a photograph alone shows at the border; its grid may run into further turns of a cylinder.
    pub(crate) fn border(
        &self,
        photograph: &WarpedPhotograph<'_>,
        resampling: &Resampling,
        encode: &EncodeRoots,
    ) -> BorderDeviations {
        let CellGrid { canvas: [width, _], side, columns, .. } = self.grid;
        let (across, down) = (photograph.columns(), photograph.rows());
        let rows = down.start / side..down.end.div_ceil(side);
        let turns = if across.is_empty() { 0..0 } else { across.start / width..(across.end - 1) / width + 1 };
        let of_row = |memory: &mut SamplingMemory, row: usize| {
            let border = &self.at_border[row * columns..(row + 1) * columns];
            let mut found = Vec::new();
            for turn in turns.clone() {
                let mut first = 0;
                for same in border.chunk_by(|a, b| a == b) {
                    let cells = first..first + same.len();
                    first = cells.end;
                    if same[0] {
                        self.stretch([row, turn], cells, (photograph, resampling, encode), memory, &mut found);
                    }
                }
            }
            found
        };
        let mut found: BorderDeviations =
            rows.into_par_iter().map_init(SamplingMemory::default, of_row).flatten_iter().collect();
        found.sort_unstable_by_key(|(cell, _)| *cell);
        found.dedup_by_key(|(cell, _)| *cell);
        found
    }

    /// [`Self::border`] of neighboring `cells` of a row, in a turn.
    fn stretch(
        &self,
        [row, turn]: [usize; 2],
        cells: Range<usize>,
        (photograph, resampling, encode): (&WarpedPhotograph<'_>, &Resampling, &EncodeRoots),
        memory: &mut SamplingMemory,
        found: &mut BorderDeviations,
    ) {
        let grid = &self.grid;
        let shift = turn * grid.canvas[0];
        let place = |cell: usize| {
            let pixels = grid.pixels(cell, 0);
            pixels.start + shift..pixels.end + shift
        };
        let inside = photograph.columns();
        let is_inside = |cell: &usize| inside.start < place(*cell).end && place(*cell).start < inside.end;
        let (Some(first), Some(last)) = (cells.clone().find(is_inside), cells.rev().find(is_inside)) else { return };
        let columns = place(first).start.max(inside.start)..place(last).end.min(inside.end);
        let mut sums = vec![Sums::default(); last + 1 - first];
        let mut pixels = vec![[0.0_f32; 4]; columns.len()];
        for y in grid.rows_read(row) {
            pixels.fill([0.0; 4]);
            photograph.sample(Window { columns: &columns, rows: &(y..y + 1) }, &mut pixels, resampling, memory);
            for (cell, sums) in (first..=last).zip(&mut sums) {
                let own = place(cell);
                let own =
                    &pixels[own.start.max(columns.start) - columns.start..own.end.min(columns.end) - columns.start];
                // The casts saturate.
                let level = |root: f32| f32::from(encode.level((root * f32::from(u16::MAX) + 0.5) as u16));
                own.iter().filter(|pixel| pixel[3] >= WHOLE).for_each(|&[r, g, b, _]| sums.add([r, g, b].map(level)));
            }
        }
        for (cell, sums) in (first..=last).zip(&sums).filter(|(_, sums)| sums.count() > 0) {
            found.push((row * grid.columns + cell, sums.deviation()));
        }
    }
}

/// The cells up to [`BORDER_STEPS`] from one of those that are `marked`, in squares.
fn near(grid: &CellGrid, around: bool, marked: Vec<bool>) -> Vec<bool> {
    let CellGrid { columns, rows, .. } = *grid;
    let mut wide = marked.clone();
    for (from, wide) in marked.chunks_exact(columns).zip(wide.chunks_exact_mut(columns)) {
        for x in (0..columns).filter(|&x| from[x]) {
            for step in 0..=2 * BORDER_STEPS {
                let at = x + columns + step - BORDER_STEPS.min(columns);
                if around || (columns..2 * columns).contains(&at) {
                    wide[at % columns] = true;
                }
            }
        }
    }
    let mut near = wide.clone();
    for y in 0..rows {
        for from in y.saturating_sub(BORDER_STEPS)..(y + BORDER_STEPS + 1).min(rows) {
            for x in 0..columns {
                near[y * columns + x] |= wide[from * columns + x];
            }
        }
    }
    near
}
