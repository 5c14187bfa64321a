//! What of a canvas is covered, and the largest rectangle in it.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::stretches::complement;

use crate::deformed_grid::DeformedGrid;
use crate::layout::CanvasLayout;

/// A rectangle of canvas pixels.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rectangle {
    /// Columns.
    pub columns: Range<usize>,
    /// Rows.
    pub rows: Range<usize>,
}

impl Rectangle {
    /// Number of pixels.
    pub fn area(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// All of a canvas of `size` pixels (width, height).
    pub fn whole([width, height]: [usize; 2]) -> Self {
        Self { columns: 0..width, rows: 0..height }
    }

    /// Where its first pixel's corner lies.
    pub fn corner(&self) -> [f64; 2] {
        [self.columns.start as f64, self.rows.start as f64]
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.columns.len(), self.rows.len()]
    }
}

/// Which pixels of a canvas some photograph covers wholly. Of grids alone, it knows nothing of what is transparent.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    width: usize,
    /// For every row disjoint ascending stretches of columns that do not touch.
    rows: Vec<Vec<Range<usize>>>,
}

/// Rows of the canvas whose cells are found together.
const BAND_ROWS: usize = 32;

impl Coverage {
    /// The pixels that lie wholly inside of at least one photograph's grid.
    ///
    /// A grid's outline is followed along the pixel row's upper and lower edge and through its middle; between these,
    /// it is taken as straight. Time grows with rows and cells, not with pixels.
    pub fn of(layout: &CanvasLayout) -> Self {
        let (layout, _) = layout.unrolled(0);
        let (width, height) = (layout.width, layout.height);
        let grids: Vec<DeformedGrid> =
            layout.placed.par_iter().map(|placed| DeformedGrid::new(&placed.mesh, 1.0, false, width, height)).collect();
        let bands: Vec<Vec<Vec<Range<usize>>>> = (0..height.div_ceil(BAND_ROWS))
            .into_par_iter()
            .map(|band| {
                let rows = band * BAND_ROWS..((band + 1) * BAND_ROWS).min(height);
                let mut covered = vec![Vec::new(); rows.len()];
                let mut candidates = Vec::new();
                for grid in &grids {
                    grid.cells_in_rows(&(rows.start.saturating_sub(1)..rows.end + 1), &mut candidates);
                    for (y, covered) in rows.clone().zip(&mut covered) {
                        covered.extend(whole_pixels(grid, y, &candidates, width));
                    }
                }
                covered.into_iter().map(united).collect()
            })
            .collect();
        Self { width, rows: bands.into_iter().flatten().collect() }
    }

    /// Whether the pixel is covered.
    pub(crate) fn holds(&self, x: usize, y: usize) -> bool {
        let stretches = self.rows.get(y).map_or(&[][..], Vec::as_slice);
        let next = stretches.partition_point(|stretch| stretch.end <= x);
        stretches.get(next).is_some_and(|stretch| stretch.start <= x)
    }

    /// The stretches of `columns` in row `y` that are covered, in ascending order.
    pub(crate) fn covered(&self, columns: Range<usize>, y: usize) -> impl Iterator<Item = Range<usize>> + Clone {
        let stretches = self.rows.get(y).map_or(&[][..], Vec::as_slice);
        let first = stretches.partition_point(|stretch| stretch.end <= columns.start);
        let Range { start, end } = columns;
        let inside = move |stretch: &Range<usize>| stretch.start.max(start)..stretch.end.min(end);
        stretches[first..].iter().take_while(move |stretch| stretch.start < end).map(inside)
    }

    /// The stretches of `columns` in row `y` that are not covered, in ascending order; some are empty.
    pub(crate) fn uncovered(&self, columns: Range<usize>, y: usize) -> impl Iterator<Item = Range<usize>> {
        complement(columns.clone(), self.covered(columns, y))
    }

    /// The coverage with those of the other pixels that `as_well` names.
    pub(crate) fn with(&self, as_well: impl Fn(usize, usize) -> bool + Sync) -> Self {
        let filled = |(y, stretches): (usize, &Vec<Range<usize>>)| {
            let others = self.uncovered(0..self.width, y).flatten();
            let more = others.filter(|&x| as_well(x, y)).map(|x| x..x + 1);
            united(stretches.iter().cloned().chain(more).collect())
        };
        Self { width: self.width, rows: self.rows.par_iter().enumerate().map(filled).collect() }
    }

    /// What of it lies in the stretches that `of_row` names for each row, disjoint ascending ones that do not touch.
    ///
    /// # Errors
    /// Those of `of_row`.
    pub(crate) fn within<E: Send>(
        &self,
        of_row: impl Fn(usize) -> Result<Vec<Range<usize>>, E> + Sync,
    ) -> Result<Self, E> {
        let part = |(y, stretches): (usize, &Vec<Range<usize>>)| match stretches.is_empty() {
            true => Ok(Vec::new()),
            false => Ok(intersection(stretches, &of_row(y)?)),
        };
        let rows = self.rows.par_iter().enumerate().map(part).collect::<Result<_, E>>()?;
        Ok(Self { width: self.width, rows })
    }

    /// Number of pixels covered.
    pub fn area(&self) -> usize {
        self.rows.iter().flatten().map(Range::len).sum()
    }

    /// Number of pixels covered of a rectangle.
    pub fn area_within(&self, rectangle: &Rectangle) -> usize {
        let inside = |stretch: &Range<usize>| common_length(stretch, &rectangle.columns);
        let rows = self.rows.get(rectangle.rows.clone()).unwrap_or_default();
        rows.iter().flatten().map(inside).sum()
    }

    /// Numbers of pixels covered of each cell of `side` x `side` pixels, row by row.
    pub(crate) fn in_cells(&self, side: usize) -> Vec<usize> {
        let columns = self.width.div_ceil(side);
        let of_rows = |rows: &[Vec<Range<usize>>]| {
            let mut counts = vec![0; columns];
            for stretch in rows.iter().flatten() {
                let cells = stretch.start / side..stretch.end.div_ceil(side);
                for (cell, count) in cells.clone().zip(&mut counts[cells]) {
                    *count += common_length(stretch, &(cell * side..(cell + 1) * side));
                }
            }
            counts
        };
        self.rows.par_chunks(side).flat_map_iter(of_rows).collect()
    }

    /// The largest rectangle of covered pixels, the topmost and leftmost of equal ones; empty if nothing is covered.
    ///
    /// Heights of covered columns above each row, and the largest rectangle under their outline by a stack: a few
    /// operations a pixel. Rows whose columns all go on below cannot be a largest rectangle's last, and are only
    /// counted.
    pub fn largest_rectangle(&self) -> Rectangle {
        let mut best = Rectangle { columns: 0..0, rows: 0..0 };
        let mut heights = vec![0_usize; self.width];
        let mut stack: Vec<(usize, usize)> = Vec::new();
        for (y, stretches) in self.rows.iter().enumerate() {
            let mut end = 0;
            for stretch in stretches {
                heights[end..stretch.start].fill(0);
                heights[stretch.clone()].iter_mut().for_each(|height| *height += 1);
                end = stretch.end;
            }
            heights[end..].fill(0);
            if self.rows.get(y + 1).is_some_and(|below| stretches.iter().all(|stretch| lies_within(stretch, below))) {
                continue;
            }
            for stretch in stretches {
                let tallest = heights[stretch.clone()].iter().copied().max().unwrap_or(0);
                if tallest * stretch.len() > best.area() {
                    under_outline(&heights, stretch, y + 1, &mut stack, &mut best);
                }
            }
        }
        best
    }

    /// The longest run of rows that are covered over the whole width; empty if there is none.
    pub fn longest_whole_rows(&self) -> Rectangle {
        let (mut best, mut start) = (0..0, 0);
        for (y, stretches) in self.rows.iter().enumerate() {
            if stretches.len() != 1 || stretches[0] != (0..self.width) {
                start = y + 1;
            } else if y + 1 - start > best.len() {
                best = start..y + 1;
            }
        }
        Rectangle { columns: 0..self.width, rows: best }
    }
}

/// Enlarges `best` to the largest rectangle that ends at row `bottom` under the outline of `heights` in `stretch`.
fn under_outline(
    heights: &[usize],
    stretch: &Range<usize>,
    bottom: usize,
    stack: &mut Vec<(usize, usize)>,
    best: &mut Rectangle,
) {
    // First column and height of the rectangles that are still open, both ascending.
    stack.clear();
    let mut area = best.area();
    // Behind the last column everything closes.
    let outline = heights[stretch.clone()].iter().copied().chain([0]);
    for (x, height) in (stretch.start..).zip(outline) {
        let mut first = x;
        while let Some(&(start, open)) = stack.last().filter(|&&(_, open)| open >= height) {
            stack.pop();
            first = start;
            if open * (x - start) > area {
                area = open * (x - start);
                *best = Rectangle { columns: start..x, rows: bottom - open..bottom };
            }
        }
        stack.push((first, height));
    }
}

fn lies_within(stretch: &Range<usize>, others: &[Range<usize>]) -> bool {
    let next = others.partition_point(|other| other.end < stretch.end);
    others.get(next).is_some_and(|other| other.start <= stretch.start && stretch.end <= other.end)
}

/// How many numbers two stretches have in common.
fn common_length(a: &Range<usize>, b: &Range<usize>) -> usize {
    a.end.min(b.end).saturating_sub(a.start.max(b.start))
}

/// The pixels of row `y` that lie wholly within the grid.
fn whole_pixels(grid: &DeformedGrid, y: usize, candidates: &[u32], width: usize) -> Vec<Range<usize>> {
    /// Just inside of the row's edges, so that a border along the edge belongs to it.
    const INSIDE: f64 = 1e-6;
    let mut common: Option<Vec<Range<usize>>> = None;
    for line in [y as f64 + INSIDE, y as f64 + 0.5, (y + 1) as f64 - INSIDE] {
        let stretches = grid.covered_along(line, candidates);
        let pixels: Vec<Range<usize>> = stretches
            .into_iter()
            .map(|[left, right]| {
                // The casts saturate.
                let first = (left - INSIDE).ceil().max(0.0) as usize;
                first..((right + INSIDE).floor().max(0.0) as usize).min(width)
            })
            .filter(|pixels| !pixels.is_empty())
            .collect();
        common = Some(match common {
            None => pixels,
            Some(common) => intersection(&common, &pixels),
        });
    }
    common.unwrap_or_default()
}

/// Of two ascending lists of stretches what they have in common.
fn intersection(one: &[Range<usize>], other: &[Range<usize>]) -> Vec<Range<usize>> {
    let (mut i, mut j) = (0, 0);
    let mut common = Vec::new();
    while let (Some(a), Some(b)) = (one.get(i), other.get(j)) {
        let both = a.start.max(b.start)..a.end.min(b.end);
        if !both.is_empty() {
            common.push(both);
        }
        if a.end < b.end { i += 1 } else { j += 1 }
    }
    common
}

/// Stretches in any order as disjoint ascending ones that do not touch.
fn united(mut stretches: Vec<Range<usize>>) -> Vec<Range<usize>> {
    stretches.sort_unstable_by_key(|stretch| stretch.start);
    let mut united: Vec<Range<usize>> = Vec::new();
    for stretch in stretches {
        match united.last_mut() {
            Some(last) if stretch.start <= last.end => last.end = last.end.max(stretch.end),
            _ => united.push(stretch),
        }
    }
    united
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn brute_force(rows: &[Vec<bool>]) -> usize {
        let (height, width) = (rows.len(), rows[0].len());
        let mut best = 0;
        for top in 0..height {
            for left in 0..width {
                for bottom in top + 1..=height {
                    for right in left + 1..=width {
                        let area = (bottom - top) * (right - left);
                        if area > best && rows[top..bottom].iter().all(|row| row[left..right].iter().all(|&one| one)) {
                            best = area;
                        }
                    }
                }
            }
        }
        best
    }

    proptest! {
        #[test]
        fn the_largest_rectangle_is_the_largest(seed in prop::collection::vec(prop::collection::vec(0..5_u8, 9), 8)) {
            let cells: Vec<Vec<bool>> = seed.iter().map(|row| row.iter().map(|&one| one > 0).collect()).collect();
            let rows = cells
                .iter()
                .map(|row| united((0..9).filter(|&x| row[x]).map(|x| x..x + 1).collect()))
                .collect();
            let found = Coverage { width: 9, rows }.largest_rectangle();
            prop_assert_eq!(found.area(), brute_force(&cells));
            prop_assert!(cells[found.rows.clone()].iter().all(|row| row[found.columns.clone()].iter().all(|&one| one)));
        }
    }
}
