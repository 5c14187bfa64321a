//! What of a panorama matters: what is lost with a cell, and what is broken by cutting between two.

use super::cells::Cells;
use crate::window::near;

/// Contrast of neighboring cells from which on an edge is a full one, levels: that of a gray stone wall beside a gray
/// sky.
const FULL_EDGE: f32 = 40.0;
/// Half the side of the square over which edges make a thing, as a share of the panorama's longer side: that of a head
/// in a street.
const THING: f64 = 0.006;
/// Half the side of a thing's surroundings, as a share of the panorama's longer side.
const SURROUNDINGS: f64 = 0.05;
/// How much edges all around take of a thing's salience: with 2, a lawn or a tree's crown has a third of what the same
/// edges have by themselves.
const CROWDED: f32 = 2.0;

/// Salience from which on there is a thing, and up to which there is none: what rises from the one to the other within
/// [`HEADROOM`] ends there.
const THERE: f32 = 0.2;
const CALM: f32 = 0.1;
/// Calm above a thing that shows that it ends there, as a share of the panorama's longer side; half of it is to be
/// kept.
const HEADROOM: f64 = 0.012;
/// Strength of an edge from which on a line alone in front of what is calm is seen, as a mast before a sky (4 levels),
/// and up to which what is beside it is calm (2 levels). Adobe-shanghai-tiny's spire is kept with 0.07 to 0.13 and 0.03
/// to 0.09.
const LINE_EDGE: f32 = 0.1;
const BESIDE_LINE: f32 = 0.05;
/// Columns from the middle of such a line to what is beside it, as a share of the panorama's longer side: a mast, and
/// the slope of its edges. With 0.005 that spire is lost, with 0.007 and 0.01 it is kept.
const LINE_REACH: f64 = 0.008;
/// Half the width of the skyline over which a thing stands out, as a share of the panorama's longer side.
const SKYLINE: f64 = 0.1;

/// What of a panorama matters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Worth {
    /// Strength of the edge at a cell, 0 to 1; 0 where nothing is covered.
    pub(super) edges: Vec<f32>,
    /// How far a cell is part of a thing that stands out, 0 to 1; 0 where nothing is covered.
    pub(super) salience: Vec<f32>,
    /// For every column, where the thing that is highest there ends within the picture.
    pub(super) ends: Vec<Option<UpperEnd>>,
}

/// The upper end of a thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UpperEnd {
    /// The first row of cells that is to be kept for it.
    pub(super) row: usize,
    /// Its own first row of cells.
    pub(super) top: usize,
    /// Rows of cells by which it rises above most of what ends beside it.
    pub(super) prominence: usize,
}

impl Worth {
    pub(super) fn of(cells: &Cells) -> Self {
        let longer = cells.columns.max(cells.rows) as f64;
        let reach = |share: f64| (share * longer).round().max(1.0) as usize;
        let edges: Vec<f32> = (0..cells.covered.len()).map(|at| edge(cells, at)).collect();
        let things = box_means(&edges, &cells.covered, cells, reach(THING));
        let around = box_means(&edges, &cells.covered, cells, reach(SURROUNDINGS));
        let salience: Vec<f32> = things
            .iter()
            .zip(&around)
            .zip(&cells.covered)
            .map(|((&thing, &around), &covered)| match covered && thing > 0.0 {
                true => thing * thing / (thing + CROWDED * around),
                false => 0.0,
            })
            .collect();
        let ends = ends(cells, &edges, &salience, longer);
        Self { edges, salience, ends }
    }
}

/// Strength of the edge at a cell, 0 to 1: how its covered neighbors differ from it.
fn edge(cells: &Cells, at: usize) -> f32 {
    if !cells.covered[at] {
        return 0.0;
    }
    let (x, y) = (at % cells.columns, at / cells.columns);
    let beside = near(x, 1, cells.columns, cells.around).map(|x| y * cells.columns + x);
    let above_and_below = near(y, 1, cells.rows, false).map(|y| y * cells.columns + x);
    let contrasts = beside.chain(above_and_below).filter(|&other| cells.covered[other]);
    let strongest = contrasts.map(|other| cells.contrast(at, other)).fold(0.0, f32::max);
    (strongest / FULL_EDGE).min(1.0)
}

/// Means over those cells that are `counted` of a square of `2 * reach + 1` cells around each, across the ends of a
/// full turn, too; 0 without any.
pub(super) fn box_means(values: &[f32], counted: &[bool], cells: &Cells, reach: usize) -> Vec<f32> {
    let (columns, rows) = (cells.columns, cells.rows);
    // A full turn is unrolled, so far that no cell counts twice.
    let lead = if cells.around { reach.min(columns.saturating_sub(1) / 2) } else { 0 };
    let reach_across = if cells.around { lead } else { reach };
    let wide = columns + 2 * lead;
    // Sums over all cells above and left of a corner.
    let mut sums = vec![[0.0_f64; 2]; (wide + 1) * (rows + 1)];
    for y in 0..rows {
        let mut row = [0.0_f64; 2];
        for x in 0..wide {
            let at = y * columns + (x + columns - lead) % columns;
            if counted[at] {
                row = [row[0] + f64::from(values[at]), row[1] + 1.0];
            }
            let above = sums[y * (wide + 1) + x + 1];
            sums[(y + 1) * (wide + 1) + x + 1] = [above[0] + row[0], above[1] + row[1]];
        }
    }
    let mean = |at: usize| {
        let (x, y) = (at % columns + lead, at / columns);
        let (left, right) = (x.saturating_sub(reach_across), (x + reach_across + 1).min(wide));
        let (top, bottom) = (y.saturating_sub(reach), (y + reach + 1).min(rows));
        let corner = |x: usize, y: usize| sums[y * (wide + 1) + x];
        let [sum, count] = [0, 1]
            .map(|k| corner(right, bottom)[k] - corner(left, bottom)[k] - corner(right, top)[k] + corner(left, top)[k]);
        (sum / count.max(1.0)) as f32
    };
    (0..columns * rows).map(mean).collect()
}

/// See [`Worth::ends`].
fn ends(cells: &Cells, edges: &[f32], salience: &[f32], longer: f64) -> Vec<Option<UpperEnd>> {
    let headroom = (HEADROOM * longer).round().max(2.0) as usize;
    let at = |x: usize, y: usize| y * cells.columns + x;
    let first = |x: usize| (0..cells.rows).find(|&y| cells.covered[at(x, y)]);
    let end = |x: usize| {
        let first = first(x)?;
        let rising = (first..cells.rows).find(|&y| salience[at(x, y)] >= CALM)?;
        let thing = (rising..cells.rows).find(|&y| salience[at(x, y)] >= THERE)?;
        (rising >= first + headroom && thing <= rising + headroom).then_some(thing)
    };
    let mut rows: Vec<Option<usize>> = (0..cells.columns).map(end).collect();
    // A line has so few edges that the thing which bears it seems to end below, or nowhere.
    let line = LineAbove { cells, edges, reach: (LINE_REACH * longer).round().max(2.0) as usize };
    for x in 0..cells.columns {
        let Some(thing) = (0..cells.rows).find(|&y| salience[at(x, y)] >= THERE) else { continue };
        let [tip, row] = line.tip([x, thing]);
        let is_long = row + headroom <= thing;
        let is_free = || first(tip).is_some_and(|first| row >= first + headroom);
        let is_calm_above = || (row - headroom..row).all(|y| salience[at(tip, y)] < CALM);
        if is_long && is_free() && is_calm_above() {
            rows[tip] = Some(rows[tip].map_or(row, |end| end.min(row)));
        }
    }
    let reach = (SKYLINE * longer).round() as usize;
    let with_prominence = |x: usize| {
        let row = rows[x]?;
        let mut beside: Vec<usize> = near(x, reach, rows.len(), cells.around).filter_map(|other| rows[other]).collect();
        beside.sort_unstable();
        let prominence = beside[beside.len() / 2].saturating_sub(row);
        Some(UpperEnd { row: row - headroom / 2, top: row, prominence })
    };
    (0..rows.len()).map(with_prominence).collect()
}

/// Lines that go up from things alone: masts, and the tips of spires.
struct LineAbove<'a> {
    cells: &'a Cells,
    edges: &'a [f32],
    /// Columns from a line to what is beside it.
    reach: usize,
}

impl LineAbove<'_> {
    /// The column and row of cells up to which a line goes on from those given, along the strongest edges; the same if
    /// there is none.
    fn tip(&self, [mut x, mut y]: [usize; 2]) -> [usize; 2] {
        let Self { cells, edges, .. } = self;
        while let Some(above) = y.checked_sub(1) {
            let strength = |x: usize| edges[above * cells.columns + x];
            let lines = near(x, 1, cells.columns, cells.around).filter(|&x| self.is_line(x, above));
            let strongest = lines.reduce(|best, next| if strength(next) > strength(best) { next } else { best });
            let Some(next) = strongest else { break };
            (x, y) = (next, above);
        }
        [x, y]
    }

    /// Whether a cell is part of a line that what is calm lies beside on both sides.
    fn is_line(&self, x: usize, y: usize) -> bool {
        let Self { cells, edges, reach } = self;
        let columns = cells.columns;
        let beside = match cells.around {
            true => [(x + columns - reach % columns) % columns, (x + reach) % columns].map(Some),
            false => [x.checked_sub(*reach), Some(x + reach).filter(|&x| x < columns)],
        };
        let row = y * columns;
        let is_calm = |x: Option<usize>| x.is_some_and(|x| cells.covered[row + x] && edges[row + x] <= BESIDE_LINE);
        edges[row + x] >= LINE_EDGE && beside.into_iter().all(is_calm)
    }
}
