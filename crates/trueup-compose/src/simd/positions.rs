//! Where the pixels of a canvas row lie in a photograph.

use super::{VectorLoop, with_vector_instructions};
use crate::linear_table::ROUNDING;

/// The inverse of one cell's bilinear map along one canvas row.
///
/// A point of the cell is `p = u e + v f + u v g` from its top left corner, with `e` the top edge, `f` the left edge
/// and `g` the deviation from a parallelogram. Crossing `p - v f = u (e + v g)` with `e + v g` leaves a quadratic in v,
/// `(g x f) v^2 + (e x f + p x g) v + p x e = 0`, whose discriminant's root is the Jacobian: its sign picks the root.
///
/// # Source
/// The standard elimination; solved in the form 2c / (-b -+ sqrt(b^2 - 4ac)), which needs no case for parallelograms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InverseBilinear {
    top_left: [f64; 2],
    e: [f64; 2],
    f: [f64; 2],
    g: [f64; 2],
    /// +1, or -1 for a mirrored cell.
    orientation: f64,
    source: [f64; 2],
    source_size: [f64; 2],
    y: f64,
}

/// Largest side of a cell, pixels of the photograph, whose inverse single precision gives to 2^-14 of a pixel: what it
/// is off by is a few times 2^-24 of the side. A cell of the mesh is 40 pixels of the working copy.
const SINGLE_PRECISION_PX: f64 = 256.0;

/// The same for its side on the canvas.
const SINGLE_PRECISION_CANVAS_PX: f64 = 1024.0;

/// Smallest Jacobian of such a cell, as a share of the product of its longest sides: where a cell all but folds, the
/// discriminant is a small difference of two large numbers, and what is off by r relative to them is off by r / (4
/// share^2) in the root.
const SINGLE_PRECISION_JACOBIAN_SHARE: f64 = 0.5;

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

impl InverseBilinear {
    /// For the cell with the given corners (top left, top right, bottom right, bottom left, canvas pixels), whose top
    /// left is `source` in the photograph and whose extent there is `source_size`; `y` is the row's pixel center.
    pub(crate) fn new(corners: [[f64; 2]; 4], source: [f64; 2], source_size: [f64; 2], y: f64) -> Self {
        let [a, b, c, d] = corners;
        let e = [b[0] - a[0], b[1] - a[1]];
        let f = [d[0] - a[0], d[1] - a[1]];
        let g = [a[0] - b[0] + c[0] - d[0], a[1] - b[1] + c[1] - d[1]];
        let middle = cross([e[0] + 0.5 * g[0], e[1] + 0.5 * g[1]], [f[0] + 0.5 * g[0], f[1] + 0.5 * g[1]]);
        Self { top_left: a, e, f, g, orientation: if middle < 0.0 { -1.0 } else { 1.0 }, source, source_size, y }
    }

    /// Whether single precision gives the inverse to 2^-14 of a pixel.
    fn bears_single_precision(&self) -> bool {
        let Self { e, f, g, .. } = *self;
        let (bottom, right) = ([e[0] + g[0], e[1] + g[1]], [f[0] + g[0], f[1] + g[1]]);
        let is_within = |sides: [f64; 2], most: f64| sides[0].abs().max(sides[1].abs()) <= most;
        // The Jacobian is linear in u and v: least in a corner.
        let jacobians = [cross(e, f), cross(e, right), cross(bottom, f), cross(bottom, right)];
        let least = jacobians.into_iter().map(|jacobian| jacobian * self.orientation).fold(f64::INFINITY, f64::min);
        let square = |side: [f64; 2]| side[0] * side[0] + side[1] * side[1];
        let longest_squares = square(e).max(square(bottom)) * square(f).max(square(right));
        is_within(self.source_size, SINGLE_PRECISION_PX)
            && [e, f, g].into_iter().all(|side| is_within(side, SINGLE_PRECISION_CANVAS_PX))
            && least > 0.0
            && least * least >= SINGLE_PRECISION_JACOBIAN_SHARE * SINGLE_PRECISION_JACOBIAN_SHARE * longest_squares
    }
}

/// Positions in a photograph for consecutive pixels of a canvas row, split into whole pixel and fraction: the position
/// is `(column + fraction_x + 0.5, row + fraction_y + 0.5)`, fractions in [0, 1].
#[derive(Debug, Default)]
pub(crate) struct Positions {
    pub(crate) column: Vec<i32>,
    pub(crate) row: Vec<i32>,
    pub(crate) fraction_x: Vec<f32>,
    pub(crate) fraction_y: Vec<f32>,
}

impl Positions {
    /// Position `index` in the photograph's pixels.
    pub(crate) fn place(&self, index: usize) -> [f64; 2] {
        [
            f64::from(self.column[index]) + 0.5 + f64::from(self.fraction_x[index]),
            f64::from(self.row[index]) + 0.5 + f64::from(self.fraction_y[index]),
        ]
    }

    /// The same in a photograph without so many rows above.
    pub(crate) fn move_up(&mut self, rows: usize) {
        if rows > 0 {
            self.row.iter_mut().for_each(|row| *row = row.wrapping_sub(rows as i32));
        }
    }

    /// Undoes [`Self::move_up`].
    pub(crate) fn move_down(&mut self, rows: usize) {
        if rows > 0 {
            self.row.iter_mut().for_each(|row| *row = row.wrapping_add(rows as i32));
        }
    }

    /// Makes room for `length` positions.
    pub(crate) fn resize(&mut self, length: usize) {
        self.column.resize(length, 0);
        self.row.resize(length, 0);
        self.fraction_x.resize(length, 0.0);
        self.fraction_y.resize(length, 0.0);
    }

    /// Number of positions.
    pub(crate) fn len(&self) -> usize {
        self.column.len()
    }
}

/// Fills `positions` for the canvas pixels from column `first` on. What comes of a pixel does not depend on the others.
pub(crate) fn invert_row(cell: &InverseBilinear, first: usize, positions: &mut Positions) {
    if cell.bears_single_precision() {
        return with_vector_instructions(SmallCell { cell, first, positions });
    }
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::invert_row(cell, first, positions) };
    }
    invert_row_portable(cell, first, positions);
}

/// [`invert_row`] of a small cell that is far from folding, in single precision: twice as many pixels side by side,
/// whose square roots and quotients take less.
struct SmallCell<'a> {
    cell: &'a InverseBilinear,
    first: usize,
    positions: &'a mut Positions,
}

/// A place as the whole number at or below it, and the rest.
#[inline(always)]
fn split(place: f64) -> (i32, f32) {
    let whole = place.floor();
    // The cast saturates.
    (whole as i32, (place - whole) as f32)
}

impl VectorLoop for SmallCell<'_> {
    #[allow(clippy::manual_clamp)]
    #[inline(always)]
    fn run(self) {
        let Self { cell, first, positions } = self;
        let InverseBilinear { top_left, e, f, g, orientation, source, source_size, y } = *cell;
        let (quadratic, jacobian) = (cross(g, f) as f32, cross(e, f) as f32);
        let py = (y - top_left[1]) as f32;
        // From the corner to a pixel's middle: exact but for one rounding, wherever the row begins.
        let (corner, beyond) = split(top_left[0] - 0.5);
        let from = (first as i64 - i64::from(corner)) as i32;
        let ((left, right_of_left), (top, below_top)) = (split(source[0] - 0.5), split(source[1] - 0.5));
        let [e, f, g, size] = [e, f, g, source_size].map(|pair| pair.map(|value| value as f32));
        let orientation = orientation as f32;
        let length = positions.column.len();
        let (columns, rows) = (&mut positions.column[..length], &mut positions.row[..length]);
        let (fractions_x, fractions_y) = (&mut positions.fraction_x[..length], &mut positions.fraction_y[..length]);
        for index in 0..length {
            let px = from.wrapping_add(index as i32) as f32 - beyond;
            let constant = px * e[1] - py * e[0];
            let linear = jacobian + (px * g[1] - py * g[0]);
            let discriminant = (linear * linear - 4.0 * quadratic * constant).max(0.0);
            // `max` before `min` turns the NaN of a collapsed cell into a number.
            let v = (-2.0 * constant / (linear + orientation * discriminant.sqrt())).max(0.0).min(1.0);
            let along = [e[0] + v * g[0], e[1] + v * g[1]];
            let u = (((px - v * f[0]) * along[0] + (py - v * f[1]) * along[1])
                / (along[0] * along[0] + along[1] * along[1]))
                .max(0.0)
                .min(1.0);
            let x = right_of_left + u * size[0];
            let y = below_top + v * size[1];
            // Neither is below 0: half a pixel less, rounded, is the whole number at or below; at one itself either
            // side will do.
            let rounded = [(x - 0.5) + ROUNDING, (y - 0.5) + ROUNDING];
            let whole = [rounded[0] - ROUNDING, rounded[1] - ROUNDING];
            columns[index] = left.wrapping_add(rounded[0].to_bits().wrapping_sub(ROUNDING.to_bits()) as i32);
            rows[index] = top.wrapping_add(rounded[1].to_bits().wrapping_sub(ROUNDING.to_bits()) as i32);
            fractions_x[index] = x - whole[0];
            fractions_y[index] = y - whole[1];
        }
    }
}

/// A whole number within the range of `i32` as one; a plain cast checks the range and is not vectorized.
#[inline(always)]
fn low_bits(whole: f64) -> i32 {
    // Adding 1.5 * 2^52 leaves the whole number in the low bits of the mantissa.
    const ROUNDING: f64 = 6_755_399_441_055_744.0;
    (whole + ROUNDING).to_bits() as i32
}

#[allow(clippy::manual_clamp)]
#[inline(always)]
fn invert_row_portable(cell: &InverseBilinear, first: usize, positions: &mut Positions) {
    let InverseBilinear { top_left, e, f, g, orientation, source, source_size, y } = *cell;
    let py = y - top_left[1];
    let first_px = first as f64 + 0.5 - top_left[0];
    let quadratic = cross(g, f);
    let jacobian = cross(e, f);
    let length = positions.column.len();
    let (columns, rows) = (&mut positions.column[..length], &mut positions.row[..length]);
    let (fractions_x, fractions_y) = (&mut positions.fraction_x[..length], &mut positions.fraction_y[..length]);
    for index in 0..length {
        let px = first_px + f64::from(index as i32);
        let constant = px * e[1] - py * e[0];
        let linear = jacobian + (px * g[1] - py * g[0]);
        let discriminant = (linear * linear - 4.0 * quadratic * constant).max(0.0);
        // `max` before `min` turns the NaN of a collapsed cell into a number.
        let v = (-2.0 * constant / (linear + orientation * discriminant.sqrt())).max(0.0).min(1.0);
        let along = [e[0] + v * g[0], e[1] + v * g[1]];
        let u = (((px - v * f[0]) * along[0] + (py - v * f[1]) * along[1])
            / (along[0] * along[0] + along[1] * along[1]))
            .max(0.0)
            .min(1.0);
        let x = source[0] + u * source_size[0] - 0.5;
        let y = source[1] + v * source_size[1] - 0.5;
        let (column, row) = (x.floor(), y.floor());
        columns[index] = low_bits(column);
        rows[index] = low_bits(row);
        fractions_x[index] = (x - column) as f32;
        fractions_y[index] = (y - row) as f32;
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{InverseBilinear, Positions};

    #[target_feature(enable = "avx2")]
    pub(super) fn invert_row(cell: &InverseBilinear, first: usize, positions: &mut Positions) {
        super::invert_row_portable(cell, first, positions);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells of 40 pixels of a photograph, far from its corner, drawn leaning, squeezed and bulging, a pixel row
    /// through the middle of each.
    fn cells() -> Vec<InverseBilinear> {
        let corner = [2317.25, 1840.6];
        let shapes = [
            [[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]],
            [[0.0, 0.0], [31.3, -7.1], [36.2, 28.4], [4.9, 33.0]],
            [[0.0, 0.0], [90.5, 11.0], [71.0, 83.0], [-12.0, 60.0]],
        ];
        let of = |shape: [[f64; 2]; 4]| {
            let corners = shape.map(|[x, y]| [corner[0] + x, corner[1] + y]);
            let middle = corners.iter().map(|corner| corner[1]).sum::<f64>() / 4.0;
            InverseBilinear::new(corners, [3000.0, 1200.0], [40.0, 40.0], middle.floor() + 0.5)
        };
        shapes.into_iter().map(of).collect()
    }

    /// A cell that folds in its top left corner: beside it, single precision was off by 0.0007 pixels.
    fn folded() -> InverseBilinear {
        let corners = [[35.2596, 35.5304], [44.4488, 24.3834], [50.0, 54.955], [25.2054, 44.6967]];
        InverseBilinear::new(corners, [20.0, 20.0], [20.0, 20.0], 42.5)
    }

    fn places(invert: impl Fn(&mut Positions), length: usize) -> Vec<[f64; 2]> {
        let mut positions = Positions::default();
        positions.resize(length);
        invert(&mut positions);
        (0..length).map(|index| positions.place(index)).collect()
    }

    #[test]
    fn single_precision_is_as_near_as_it_says() {
        assert!(cells().iter().all(InverseBilinear::bears_single_precision));
        for cell in cells().into_iter().chain([folded()]) {
            let first = cell.top_left[0] as usize - 7;
            let single = places(|positions| invert_row(&cell, first, positions), 120);
            let double = places(|positions| invert_row_portable(&cell, first, positions), 120);
            for (single, double) in single.iter().zip(&double) {
                let apart = (single[0] - double[0]).abs().max((single[1] - double[1]).abs());
                assert!(apart < 1.0 / 16384.0, "{single:?} for {double:?}");
            }
        }
    }

    #[test]
    fn a_place_does_not_depend_on_where_the_row_begins() {
        for cell in cells() {
            let all = places(|positions| invert_row(&cell, 2310, positions), 60);
            for first in 1..60 {
                let rest = places(|positions| invert_row(&cell, 2310 + first, positions), 60 - first);
                assert_eq!(rest, all[first..], "from {first}");
            }
        }
    }
}
