//! The samples of an overlap: pixels of one photograph, and what lies on them in the panorama.

use std::ops::Range;

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;

use super::cell::{LastCell, PixelWalk, inverse};
use super::overlap::PhotometricOverlap;
use super::pyramid::Gray;
use super::sample::PixelSample;

/// Samples with a smaller change of gray in both photographs are passed over, gray levels per working px.
const MIN_GRADIENT: f64 = 2.0;

/// The samples of an overlap at a level of the pyramids, `spacing` working px apart along both axes, that have some
/// gradient: a list for every row of cells of the first photograph's solved grid.
pub(super) fn bands(overlap: &PhotometricOverlap, level: usize, spacing: f64) -> Vec<Vec<PixelSample>> {
    let grid = overlap.solved[0];
    let lattice = Lattice { spacing, columns: lines(grid.width, spacing), rows: lines(grid.height, spacing) };
    (0..grid.rows - 1).into_par_iter().map(|row| band(overlap, level, &lattice, row)).collect()
}

/// Lines of samples that fit into a length.
fn lines(length: f64, spacing: f64) -> usize {
    (length / spacing) as usize
}

/// Evenly spaced samples, the first half a spacing from the corner.
struct Lattice {
    spacing: f64,
    columns: usize,
    rows: usize,
}

impl Lattice {
    /// The lines of samples, of `count` in all, from `start` up to `end`; the last cell's, where there is no `end`, go
    /// to the border.
    fn between(&self, start: f64, end: Option<f64>, count: usize) -> Range<usize> {
        let first_from = |at: f64| ((at / self.spacing - 0.5).ceil().max(0.0) as usize).min(count);
        first_from(start)..end.map_or(count, first_from)
    }

    fn place(&self, line: usize) -> f64 {
        (line as f64 + 0.5) * self.spacing
    }
}

fn band(overlap: &PhotometricOverlap, level: usize, lattice: &Lattice, row: usize) -> Vec<PixelSample> {
    let grid = overlap.solved[0];
    let corner = |row: usize, column: usize| grid.source(row * grid.columns + column);
    let below = (row + 2 < grid.rows).then(|| corner(row + 1, 0).y);
    // The samples of the cells that the overlap reaches.
    let cells: Vec<Range<usize>> = (0..grid.columns - 1)
        .map(|column| {
            if !reaches(overlap, row * grid.columns + column) {
                return 0..0;
            }
            let right = (column + 2 < grid.columns).then(|| corner(row, column + 1).x);
            lattice.between(corner(row, column).x, right, lattice.columns)
        })
        .collect();
    let rows = lattice.between(corner(row, 0).y, below, lattice.rows);
    let mut samples = Vec::with_capacity(rows.len() * cells.iter().map(Range::len).sum::<usize>());
    let mut sampler = Sampler::new(overlap, level);
    for y in rows {
        sampler.there.stop();
        for cell in &cells {
            if cell.is_empty() {
                sampler.there.stop();
            }
            let points = cell.clone().map(|x| Vector2::new(lattice.place(x), lattice.place(y)));
            samples.extend(points.filter_map(|point| sampler.sample(point)));
        }
    }
    samples
}

/// Whether any corner of a cell, which is given by its first vertex, is carried into the other photograph.
fn reaches(overlap: &PhotometricOverlap, first: usize) -> bool {
    let columns = overlap.solved[0].columns;
    let corners = [first, first + 1, first + columns, first + columns + 1];
    corners.iter().any(|&corner| overlap.warp.vertices.get(corner).is_some_and(Option::is_some))
}

/// Takes one sample after the other.
struct Sampler<'a> {
    overlap: &'a PhotometricOverlap<'a>,
    level: usize,
    /// The cells of both solved grids.
    solved: [LastCell<'a>; 2],
    /// The cell of the first photograph's delivered grid.
    here: LastCell<'a>,
    /// The way through the second's.
    there: PixelWalk<'a>,
}

impl<'a> Sampler<'a> {
    fn new(overlap: &'a PhotometricOverlap<'a>, level: usize) -> Self {
        Self {
            overlap,
            level,
            solved: overlap.solved.map(|grid| LastCell::new(grid, Vector2::zeros())),
            here: LastCell::new(overlap.fine[0], Vector2::zeros()),
            there: PixelWalk::new(overlap.fine[1]),
        }
    }

    fn sample(&mut self, point: Vector2<f64>) -> Option<PixelSample> {
        let PhotometricOverlap { warp, pyramids, solved, .. } = self.overlap;
        let here_gray = pyramids[0].at(self.level, point)?;
        let within_here = self.here.enter(point);
        let there = self.there.to(self.here.warp(within_here), || warp.at(solved[0], point))?;
        let there_gray = pyramids[1].at(self.level, there.pixel)?;
        if here_gray.slope.norm_squared().max(there_gray.slope.norm_squared()) < MIN_GRADIENT * MIN_GRADIENT {
            return None;
        }
        let pixel_from_place = inverse(&self.here.derivative(within_here))?;
        let gray = [on_panorama(here_gray, &pixel_from_place), on_panorama(there_gray, &there.pixel_from_place)];
        let [here, there] = [(0, point), (1, there.pixel)].map(|(side, pixel)| {
            let cell = &mut self.solved[side];
            let within = cell.enter(pixel);
            (cell.first as u32, within, cell.warp(within))
        });
        Some(PixelSample { cells: [here.0, there.0], within: [here.1, there.1], gray, gap: here.2 - there.2 })
    }
}

/// The gray value with its slope per panorama unit.
fn on_panorama(gray: Gray, pixel_from_place: &Matrix2<f64>) -> Gray {
    Gray { slope: pixel_from_place.transpose() * gray.slope, ..gray }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells of 40 px and samples of 12: none lies in two cells, none in no cell.
    #[test]
    fn every_line_of_samples_belongs_to_one_cell() {
        let lattice = Lattice { spacing: 12.0, columns: lines(160.0, 12.0), rows: 0 };
        assert_eq!(lattice.columns, 13);
        let cells: Vec<Range<usize>> = (0..4)
            .map(|cell| {
                let end = (cell < 3).then(|| 40.0 * f64::from(cell + 1));
                lattice.between(40.0 * f64::from(cell), end, lattice.columns)
            })
            .collect();
        // At 6, 18, 30, then 42 and so on.
        assert_eq!(cells, [0..3, 3..7, 7..10, 10..13]);
        assert_eq!(lattice.place(3), 42.0);
    }
}
