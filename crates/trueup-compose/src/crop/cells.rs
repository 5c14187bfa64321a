//! The panorama in cells: as much of it as deciding about its frame takes.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::Result;
use trueup_core::raster::{LUMA, RowSource};

use crate::coverage::Coverage;

/// Cells at most: a thing of half a hundredth of the panorama's longer side is one or more of them, and the search
/// among all rectangles takes a fraction of a second.
const MOST_CELLS: usize = 1 << 16;

/// Rows of pixels that are read of a row of cells, at most: enough for means of one level in noise.
const ROWS_READ: usize = 4;

/// The panorama, reduced.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cells {
    /// Panorama pixels a side.
    pub(super) side: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Whether photographs cover all of a cell.
    pub(super) covered: Vec<bool>,
    /// Mean red, green and blue of what is covered, levels as encoded (0 to 255).
    pub(super) colors: Vec<[f32; 3]>,
    /// Standard deviation of the luma within a cell, levels.
    pub(super) deviations: Vec<f32>,
    /// Whether the last column lies beside the first.
    pub(super) around: bool,
}

/// A canvas cut into cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct CellGrid {
    /// Width and height of the canvas, pixels.
    pub(super) canvas: [usize; 2],
    /// Pixels a side; cells at the right and lower end may be smaller.
    pub(super) side: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

impl CellGrid {
    /// As fine as [`MOST_CELLS`] allow.
    pub(super) fn of([width, height]: [usize; 2]) -> Self {
        let side = (1..).find(|side| width.div_ceil(*side) * height.div_ceil(*side) <= MOST_CELLS).unwrap_or(1);
        Self { canvas: [width, height], side, columns: width.div_ceil(side), rows: height.div_ceil(side) }
    }

    /// Which cells photographs cover wholly.
    pub(super) fn covered(&self, coverage: &Coverage) -> Vec<bool> {
        let length = |index: usize, axis: usize| self.pixels(index, axis).len();
        let full = |at: usize| length(at % self.columns, 0) * length(at / self.columns, 1);
        coverage.in_cells(self.side).iter().enumerate().map(|(at, &count)| count == full(at)).collect()
    }

    /// The columns (`axis` 0) or rows (1) of pixels of a column or row of cells.
    pub(super) fn pixels(&self, index: usize, axis: usize) -> Range<usize> {
        index * self.side..((index + 1) * self.side).min(self.canvas[axis])
    }

    /// The rows of pixels that are read of a row of cells: at most [`ROWS_READ`], evenly.
    pub(super) fn rows_read(&self, row: usize) -> impl Iterator<Item = usize> + use<> {
        let pixels = self.pixels(row, 1);
        let (top, high) = (pixels.start, pixels.len());
        let lines = high.min(ROWS_READ);
        (0..lines).map(move |line| top + (2 * line + 1) * high / (2 * lines))
    }
}

/// Sums over the pixels of a cell.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    count: f32,
    colors: [f32; 3],
    luma: f32,
    luma_squared: f32,
}

impl Cells {
    /// Reads the panorama; `around` if it is a full turn.
    ///
    /// # Errors
    /// Those of reading its rows.
    pub(super) fn of(picture: &dyn RowSource, coverage: &Coverage, around: bool) -> Result<Self> {
        let grid = CellGrid::of([picture.width(), picture.height()]);
        let CellGrid { side, columns, rows, .. } = grid;
        let covered = grid.covered(coverage);
        let sums: Vec<Vec<Sums>> = (0..rows)
            .into_par_iter()
            .map(|row| {
                let mut sums = vec![Sums::default(); columns];
                let mut pixels = vec![0; 4 * picture.width()];
                for y in grid.rows_read(row) {
                    picture.rgba8_row(y, &mut pixels)?;
                    for (sums, pixels) in sums.iter_mut().zip(pixels.chunks(4 * side)) {
                        for &[r, g, b, alpha] in pixels.as_chunks::<4>().0 {
                            if alpha == u8::MAX {
                                sums.add([r, g, b].map(f32::from));
                            }
                        }
                    }
                }
                Ok(sums)
            })
            .collect::<Result<_>>()?;
        let sums = || sums.iter().flatten();
        let colors = sums().map(Sums::color).collect();
        let deviations = sums().map(Sums::deviation).collect();
        Ok(Self { side, columns, rows, covered, colors, deviations, around })
    }

    /// The same, where covered cells of which nothing `is_seen` are as those beside them are in the mean, step by step
    /// from what is seen.
    pub(super) fn with_unseen(mut self, mut is_seen: Vec<bool>) -> Self {
        let mut unseen: Vec<usize> = (0..is_seen.len()).filter(|&at| self.covered[at] && !is_seen[at]).collect();
        while !unseen.is_empty() {
            let is_next = |at: &usize| near(&self, *at).any(|other| is_seen[other]);
            let (next, rest): (Vec<usize>, Vec<usize>) = unseen.into_iter().partition(is_next);
            let mean = |&at: &usize| {
                let (mut color, mut deviation, mut count) = ([0.0_f32; 3], 0.0, 0.0_f32);
                for other in near(&self, at).filter(|&other| is_seen[other]) {
                    color.iter_mut().zip(self.colors[other]).for_each(|(sum, level)| *sum += level);
                    deviation += self.deviations[other];
                    count += 1.0;
                }
                (color.map(|sum| sum / count.max(1.0)), deviation / count.max(1.0))
            };
            let means: Vec<([f32; 3], f32)> = next.iter().map(mean).collect();
            for (&at, (color, deviation)) in next.iter().zip(means) {
                (self.colors[at], self.deviations[at], is_seen[at]) = (color, deviation, true);
            }
            // Beside nothing that is seen.
            unseen = if next.is_empty() { Vec::new() } else { rest };
        }
        self
    }

    /// The largest difference of a channel between two cells, levels.
    pub(super) fn contrast(&self, a: usize, b: usize) -> f32 {
        let (a, b) = (self.colors[a], self.colors[b]);
        (0..3).map(|channel| (a[channel] - b[channel]).abs()).fold(0.0, f32::max)
    }
}

/// The cells around one, across the ends of a full turn, too.
pub(super) fn near(cells: &Cells, at: usize) -> impl Iterator<Item = usize> {
    let (columns, rows, around) = (cells.columns, cells.rows, cells.around);
    let (x, y) = (at % columns, at / columns);
    let beside = move |step: usize| {
        // 0, 1, 2: left, here, right.
        match (x + step).checked_sub(1) {
            Some(other) if other < columns => Some(other),
            _ if around => Some((x + step + columns - 1) % columns),
            _ => None,
        }
    };
    (y.saturating_sub(1)..(y + 2).min(rows)).flat_map(move |v| (0..3).filter_map(beside).map(move |u| v * columns + u))
}

impl Sums {
    /// Adds a pixel's red, green and blue.
    pub(super) fn add(&mut self, pixel: [f32; 3]) {
        let mut luma = 0.0;
        for ((sum, level), share) in self.colors.iter_mut().zip(pixel).zip(LUMA) {
            *sum += level;
            luma += share * level;
        }
        self.count += 1.0;
        self.luma += luma;
        self.luma_squared += luma * luma;
    }

    /// How many pixels were added.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    /// Mean red, green and blue; 0 without any.
    pub(super) fn color(&self) -> [f32; 3] {
        self.colors.map(|sum| sum / self.count.max(1.0))
    }

    /// Standard deviation of the luma.
    pub(super) fn deviation(&self) -> f32 {
        let count = self.count.max(1.0);
        let mean = self.luma / count;
        (self.luma_squared / count - mean * mean).max(0.0).sqrt()
    }
}
