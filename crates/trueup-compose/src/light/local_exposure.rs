//! A factor on light that changes from place to place of the canvas, slowly.

use std::ops::Range;
use std::sync::Arc;

use crate::simd::{VectorLoop, with_vector_instructions};

/// Factors on linear light at the middles of a grid of cells that lie over a canvas.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ExposureMap {
    /// Cells along x and y, at least 1 each.
    pub(crate) cells: [usize; 2],
    /// Size of a cell, canvas pixels.
    pub(crate) cell_px: [f64; 2],
    /// The map's upper left corner, canvas pixels.
    pub(crate) corner: [f64; 2],
    /// Whether the last column of cells lies beside the first, as on a cylinder.
    pub(crate) around: bool,
    /// The factors, row by row.
    pub(crate) factors: Vec<f32>,
}

impl ExposureMap {
    /// The two cells between whose middles places of `first..first + 1` lie along an axis, counted in cells from the
    /// first one's middle; beyond the outer ones they hold on, or go round.
    fn cells_beside(&self, axis: usize, first: f64) -> [usize; 2] {
        let count = self.cells[axis];
        // The casts saturate.
        [first, first + 1.0].map(|cell| match axis == 0 && self.around {
            true => (cell.rem_euclid(count as f64) as usize).min(count - 1),
            false => (cell.max(0.0) as usize).min(count - 1),
        })
    }
}

/// An [`ExposureMap`] as it lies over a canvas of any scale.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LocalExposure {
    map: Arc<ExposureMap>,
    /// Pixels of the map's own canvas per pixel of this one.
    scale: [f64; 2],
    /// Where this canvas's corner (0, 0) lies on the map's own.
    shift: [f64; 2],
}

impl From<ExposureMap> for LocalExposure {
    /// Over the map's own canvas.
    fn from(map: ExposureMap) -> Self {
        Self { map: Arc::new(map), scale: [1.0; 2], shift: [0.0; 2] }
    }
}

impl LocalExposure {
    /// The same over another canvas, whose place p is `scale * p + shift` of this one.
    pub(crate) fn over(&self, scale: [f64; 2], shift: [f64; 2]) -> Self {
        let of = |axis: usize| self.scale[axis] * shift[axis] + self.shift[axis];
        Self {
            map: Arc::clone(&self.map),
            scale: [self.scale[0] * scale[0], self.scale[1] * scale[1]],
            shift: [of(0), of(1)],
        }
    }

    /// The same over a canvas that begins so many columns farther left.
    pub(crate) fn led_by(&self, columns: usize) -> Self {
        self.over([1.0; 2], [-(columns as f64), 0.0])
    }

    /// Fills `out` with the factors at the middles of the pixels `columns` of row `y`.
    pub(crate) fn factors(&self, y: usize, columns: Range<usize>, out: &mut Vec<f32>) {
        let map = self.map.as_ref();
        let down = self.in_cells(1, y);
        let [upper, lower] =
            map.cells_beside(1, down.floor()).map(|row| &map.factors[row * map.cells[0]..(row + 1) * map.cells[0]]);
        let below = (down - down.floor()) as f32;
        let pixels_per_cell = map.cell_px[0] / self.scale[0];
        out.clear();
        let mut x = columns.start;
        // Between the middles of two cells the factor is a straight line.
        while x < columns.end {
            let place = self.in_cells(0, x);
            let first = place.floor();
            let to_next = ((first + 1.0 - place) * pixels_per_cell) as usize;
            let mut end = x.saturating_add(to_next).clamp(x + 1, columns.end);
            while end > x + 1 && self.in_cells(0, end - 1) >= first + 1.0 {
                end -= 1;
            }
            let [left, right] = map.cells_beside(0, first).map(|at| upper[at] + below * (lower[at] - upper[at]));
            let filled = out.len();
            out.resize(filled + end - x, 0.0);
            // Where the first one's middle lies, in pixels: the same for all stretches between the two, wherever they
            // begin.
            let middle = ((first + 0.5) * map.cell_px[0] + map.corner[0] - self.shift[0]) / self.scale[0] - 0.5;
            let whole = middle.floor();
            with_vector_instructions(Straight {
                // The cast saturates; places farther away than 32 bits count hold one factor.
                from: (x as f64 - whole) as i32,
                beyond: (middle - whole) as f32,
                cells_per_pixel: pixels_per_cell.recip() as f32,
                factors: [left, right],
                out: &mut out[filled..],
            });
            x = end;
        }
    }

    /// Where the middle of a pixel lies along an axis, in cells from the first one's middle.
    #[inline(always)]
    fn in_cells(&self, axis: usize, pixel: usize) -> f64 {
        let place = self.scale[axis] * (pixel as f64 + 0.5) + self.shift[axis];
        (place - self.map.corner[axis]) / self.map.cell_px[axis] - 0.5
    }
}

/// The factors between two cells.
struct Straight<'a> {
    /// The first pixel, counted from the one at or before the middle of the first cell.
    from: i32,
    /// How far beyond that one's middle the cell's lies, pixels.
    beyond: f32,
    cells_per_pixel: f32,
    factors: [f32; 2],
    out: &'a mut [f32],
}

impl VectorLoop for Straight<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { from, beyond, cells_per_pixel, factors: [left, right], out } = self;
        let step = right - left;
        for (index, out) in (from..).zip(out) {
            *out = left + ((index as f32 - beyond) * cells_per_pixel) * step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(around: bool) -> ExposureMap {
        let factors = vec![1.0, 2.0, 4.0, 3.0, 4.0, 6.0];
        ExposureMap { cells: [3, 2], cell_px: [10.0, 20.0], corner: [100.0, 0.0], around, factors }
    }

    fn factor(local: &LocalExposure, x: usize, y: usize) -> f32 {
        let mut out = Vec::new();
        local.factors(y, x..x + 1, &mut out);
        out[0]
    }

    #[test]
    fn between_cells_it_is_bilinear_and_beyond_them_it_holds_on() {
        let local = LocalExposure::from(map(false));
        // The pixel's middle is 110.5, 0.55 of the way between the first two cells' middles, 105 and 115; both rows lie
        // below 10.
        assert!((factor(&local, 110, 3) - 1.55).abs() < 1e-6);
        // Row 19: middle 19.5, 0.475 of the way from 10 to 30.
        assert!((factor(&local, 110, 19) - (1.55 + 0.475 * (3.55 - 1.55))).abs() < 1e-6);
        assert_eq!(factor(&local, 0, 0), 1.0);
        assert_eq!(factor(&local, 500, 500), 6.0);
    }

    #[test]
    fn around_a_cylinder_the_last_cell_lies_beside_the_first() {
        let local = LocalExposure::from(map(true));
        // 129.5 is 0.45 of the way from the last cell's middle, 125, to the first one's, 135 = 105 + 30.
        assert!((factor(&local, 129, 0) - (4.0 - 0.45 * 3.0)).abs() < 1e-6);
        for x in [100, 117, 129] {
            assert!((factor(&local, x, 0) - factor(&local, x + 30, 0)).abs() < 1e-6);
            assert!((factor(&local, x, 0) - factor(&local, x - 90, 0)).abs() < 1e-6);
        }
    }

    #[test]
    fn other_canvases_show_the_same_places() {
        let local = LocalExposure::from(map(false));
        let half = local.over([2.0, 2.0], [0.0; 2]);
        // Its pixel 55 reaches from 110 to 112.
        let mean = 0.5 * (factor(&local, 110, 0) + factor(&local, 111, 0));
        assert!((factor(&half, 55, 0) - mean).abs() < 1e-6);
        assert_eq!(factor(&local.led_by(40), 150, 7), factor(&local, 110, 7));
        assert_eq!(factor(&half.led_by(3), 58, 7), factor(&half, 55, 7));
    }
}
