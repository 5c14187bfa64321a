//! A part of one level, reduced and interpolated.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::bulk::Bulk;
use crate::simd::{VectorLoop, with_vector_instructions};

/// Something that can be summed with weights.
pub(crate) trait Texel: Copy + Default {
    /// `self + weight * other`.
    fn plus(self, other: Self, weight: f32) -> Self;
}

impl Texel for f32 {
    #[inline(always)]
    fn plus(self, other: Self, weight: f32) -> Self {
        self + weight * other
    }
}

impl Texel for [f32; 4] {
    #[inline(always)]
    fn plus(self, other: Self, weight: f32) -> Self {
        [
            self[0] + weight * other[0],
            self[1] + weight * other[1],
            self[2] + weight * other[2],
            self[3] + weight * other[3],
        ]
    }
}

/// A part of one level; all outside is zero. Four channels are three of color times the share, and the share.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Bulk")]
pub(crate) struct PyramidPlane<T> {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
    #[serde(with = "crate::bulk")]
    pub(crate) texels: Vec<T>,
}

impl<T> PyramidPlane<T> {
    /// Whether it holds a sample for each of its places.
    pub(crate) fn is_whole(&self) -> bool {
        self.columns.len().checked_mul(self.rows.len()) == Some(self.texels.len())
    }
}

impl<T: Texel> PyramidPlane<T> {
    /// Zeros.
    pub(crate) fn new(columns: Range<usize>, rows: Range<usize>) -> Self {
        let texels = vec![T::default(); columns.len() * rows.len()];
        Self { columns, rows, texels }
    }

    /// The samples of row `y`, which the plane holds.
    pub(crate) fn row(&self, y: usize) -> &[T] {
        let width = self.columns.len();
        &self.texels[(y - self.rows.start) * width..][..width]
    }

    pub(crate) fn row_mut(&mut self, y: usize) -> &mut [T] {
        let width = self.columns.len();
        &mut self.texels[(y - self.rows.start) * width..][..width]
    }

    /// Copies the samples `first..first + out.len()` of row `y` to `out`; zeros where the plane holds none. `first` may
    /// lie left of the canvas.
    fn copy_row(&self, y: isize, first: isize, out: &mut [T]) {
        out.fill(T::default());
        if y < self.rows.start as isize || y >= self.rows.end as isize {
            return;
        }
        let row = self.row(y as usize);
        let from = first.max(self.columns.start as isize);
        let to = (first + out.len() as isize).min(self.columns.end as isize);
        if from < to {
            let source =
                &row[(from - self.columns.start as isize) as usize..(to - self.columns.start as isize) as usize];
            out[(from - first) as usize..(to - first) as usize].copy_from_slice(source);
        }
    }

    /// The part `columns` x `rows`, all of which the plane holds.
    pub(crate) fn part(&self, columns: &Range<usize>, rows: &Range<usize>) -> Self {
        let mut part = Self::new(columns.clone(), rows.clone());
        let first = columns.start - self.columns.start;
        for y in rows.clone() {
            part.row_mut(y).copy_from_slice(&self.row(y)[first..first + columns.len()]);
        }
        part
    }

    /// The next coarser level: every sample whose middle this plane holds.
    pub(crate) fn reduced(&self) -> Self {
        let half = |range: &Range<usize>| range.start.div_ceil(2)..range.end.div_ceil(2);
        let mut reduced = Self::new(half(&self.columns), half(&self.rows));
        if reduced.columns.is_empty() {
            return reduced;
        }
        with_vector_instructions(Reducing { plane: self, reduced: &mut reduced });
        reduced
    }

    /// The part `columns` x `rows` of the next finer level, interpolated; sums not divided by their shares.
    pub(crate) fn expanded(&self, columns: &Range<usize>, rows: &Range<usize>) -> Self {
        let mut expanded = Self::new(columns.clone(), rows.clone());
        let mut expansion = self.expansion(columns, rows.start);
        for y in rows.clone() {
            expansion.next_row(expanded.row_mut(y));
        }
        expanded
    }

    /// [`Self::expanded`] row by row, from row `first_row` on.
    pub(crate) fn expansion(&self, columns: &Range<usize>, first_row: usize) -> Expansion<'_, T> {
        let width = columns.len();
        Expansion {
            plane: self,
            first: columns.start as isize / 2 - 1,
            odd: columns.start % 2,
            padded: vec![T::default(); width / 2 + 4],
            window: std::array::from_fn(|_| vec![T::default(); width]),
            next: first_row as isize / 2 - 1,
            row: first_row,
        }
    }
}

/// A plane, and the samples of its next coarser level, which are to be made.
struct Reducing<'a, T> {
    plane: &'a PyramidPlane<T>,
    reduced: &'a mut PyramidPlane<T>,
}

impl<T: Texel> VectorLoop for Reducing<'_, T> {
    #[inline(always)]
    fn run(self) {
        let Self { plane, reduced } = self;
        let width = reduced.columns.len();
        // Rows of this level, reduced along x: a window of five of them.
        let mut padded = vec![T::default(); 2 * width + 3];
        let mut window: [Vec<T>; 5] = std::array::from_fn(|_| vec![T::default(); width]);
        let first = 2 * reduced.columns.start as isize - 2;
        let mut next = 2 * reduced.rows.start as isize - 2;
        for y in reduced.rows.clone() {
            while next <= 2 * y as isize + 2 {
                plane.copy_row(next, first, &mut padded);
                let row = &mut window[next.rem_euclid(5) as usize];
                for (out, taps) in row.iter_mut().zip(padded.windows(5).step_by(2)) {
                    *out = five(taps[0], taps[1], taps[2], taps[3], taps[4]);
                }
                next += 1;
            }
            let at = |offset: isize| &window[(2 * y as isize + offset).rem_euclid(5) as usize][..width];
            let (a, b, c, d, e) = (at(-2), at(-1), at(0), at(1), at(2));
            for (x, out) in reduced.row_mut(y).iter_mut().enumerate() {
                *out = five(a[x], b[x], c[x], d[x], e[x]);
            }
        }
    }
}

/// Rows of the next finer level, interpolated one after the other.
pub(crate) struct Expansion<'a, T> {
    plane: &'a PyramidPlane<T>,
    /// The first column that is read of the plane; it may lie left of the canvas.
    first: isize,
    /// 1 where the first column is an odd one.
    odd: usize,
    padded: Vec<T>,
    /// Three rows of the plane, interpolated along x.
    window: [Vec<T>; 3],
    /// The next row that is read of the plane.
    next: isize,
    /// The next row that is made.
    row: usize,
}

impl<T: Texel> Expansion<'_, T> {
    /// Makes the next row, as wide as the columns that were asked for.
    pub(crate) fn next_row(&mut self, out: &mut [T]) {
        let y = self.row;
        self.row += 1;
        if !out.is_empty() {
            with_vector_instructions(ExpandedRow { expansion: self, y, out });
        }
    }
}

/// Row `y` of an expansion, which is to be made.
struct ExpandedRow<'e, 'a, T> {
    expansion: &'e mut Expansion<'a, T>,
    y: usize,
    out: &'e mut [T],
}

impl<T: Texel> VectorLoop for ExpandedRow<'_, '_, T> {
    #[inline(always)]
    fn run(self) {
        let Self { expansion, y, out } = self;
        let middle = (y / 2) as isize;
        while expansion.next <= middle + 1 {
            expansion.plane.copy_row(expansion.next, expansion.first, &mut expansion.padded);
            let row = &mut expansion.window[expansion.next.rem_euclid(3) as usize];
            // Columns in pairs that the same taps are for, but for a first odd one.
            let (odd, padded) = (expansion.odd, &expansion.padded);
            if let Some(out) = row.first_mut().filter(|_| odd == 1) {
                *out = two(padded[1], padded[2]);
            }
            for (pair, taps) in row[odd..].chunks_mut(2).zip(padded[odd..].windows(3)) {
                let [even, rest @ ..] = pair else { continue };
                *even = three(taps[0], taps[1], taps[2]);
                if let [odd] = rest {
                    *odd = two(taps[1], taps[2]);
                }
            }
            expansion.next += 1;
        }
        let at = |row: isize| &expansion.window[row.rem_euclid(3) as usize][..out.len()];
        let (above, here, below) = (at(middle - 1), at(middle), at(middle + 1));
        if y.is_multiple_of(2) {
            for (x, out) in out.iter_mut().enumerate() {
                *out = three(above[x], here[x], below[x]);
            }
        } else {
            for (x, out) in out.iter_mut().enumerate() {
                *out = two(here[x], below[x]);
            }
        }
    }
}

impl PyramidPlane<[f32; 4]> {
    /// The color at a place, in samples, between the four around it that the plane holds and that something covers;
    /// `None` without any.
    pub(crate) fn color_at(&self, [x, y]: [f64; 2]) -> Option<[f32; 3]> {
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = ((x - left) as f32, (y - top) as f32);
        let mut sum = [0.0_f32; 4];
        for (down, along) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (column, row) = (left + f64::from(along), top + f64::from(down));
            let is_held = column >= self.columns.start as f64
                && column < self.columns.end as f64
                && row >= self.rows.start as f64
                && row < self.rows.end as f64;
            // A sample beside the place counts a little where none around it does.
            let weight = |far: f32, second: i32| if second == 1 { far } else { 1.0 - far }.max(LEAST_SHARE);
            if is_held && let Some([r, g, b]) = color(self.row(row as usize)[column as usize - self.columns.start]) {
                sum = sum.plus([r, g, b, 1.0], weight(u, along) * weight(v, down));
            }
        }
        (sum[3] > 0.0).then(|| [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]])
    }
}

#[inline(always)]
fn five<T: Texel>(a: T, b: T, c: T, d: T, e: T) -> T {
    const OUTER: f32 = 1.0 / 16.0;
    const INNER: f32 = 4.0 / 16.0;
    const MIDDLE: f32 = 6.0 / 16.0;
    T::default().plus(a, OUTER).plus(b, INNER).plus(c, MIDDLE).plus(d, INNER).plus(e, OUTER)
}

#[inline(always)]
fn three<T: Texel>(a: T, b: T, c: T) -> T {
    T::default().plus(a, 0.125).plus(b, 0.75).plus(c, 0.125)
}

#[inline(always)]
fn two<T: Texel>(a: T, b: T) -> T {
    T::default().plus(a, 0.5).plus(b, 0.5)
}

/// A smaller share of a sample, a 64th of a step of 16 bits, is none: its color would be made of rounding.
pub(crate) const LEAST_SHARE: f32 = 1.0 / (1 << 22) as f32;

/// Share of samples that are there only so that others have something to be compared with.
pub(crate) const NEXT_TO_NOTHING: f32 = 1e-3;

/// Color divided by the share; `None` where nothing is covered.
#[inline(always)]
pub(crate) fn color(texel: [f32; 4]) -> Option<[f32; 3]> {
    (texel[3] > LEAST_SHARE).then(|| {
        let scale = 1.0 / texel[3];
        [texel[0] * scale, texel[1] * scale, texel[2] * scale]
    })
}

/// Makes every sample that is covered at all count the same when it is interpolated.
pub(crate) fn level_shares(plane: &mut PyramidPlane<[f32; 4]>) {
    for texel in &mut plane.texels {
        *texel = match color(*texel) {
            Some([r, g, b]) => [r, g, b, 1.0],
            None => [0.0; 4],
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(width: usize, height: usize, value: impl Fn(usize, usize) -> [f32; 4]) -> PyramidPlane<[f32; 4]> {
        let mut plane = PyramidPlane::new(0..width, 0..height);
        for y in 0..height {
            for (x, texel) in plane.row_mut(y).iter_mut().enumerate() {
                *texel = value(x, y);
            }
        }
        plane
    }

    #[test]
    fn an_even_picture_stays_even_up_to_its_border() {
        // Covered in an odd box only; the color is 0.3 wherever anything is covered.
        let source = plane(29, 23, |x, y| if x > 4 && y < 17 { [0.3, 0.6, 0.9, 1.0] } else { [0.0; 4] });
        let reduced = source.reduced();
        assert_eq!((reduced.columns.clone(), reduced.rows.clone()), (0..15, 0..12));
        let back = reduced.expanded(&source.columns, &source.rows);
        for (texel, original) in back.texels.iter().zip(&source.texels) {
            if original[3] > 0.0 {
                let [r, g, b] = color(*texel).expect("covered");
                assert!((r - 0.3).abs() < 1e-6 && (g - 0.6).abs() < 1e-6 && (b - 0.9).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn parts_give_the_same_bits_as_the_whole() {
        let source = plane(64, 48, |x, y| [(x * 7 % 13) as f32 * 0.07, y as f32 * 0.013, 0.4, 1.0]);
        let whole = source.reduced();
        let mut part = PyramidPlane::new(16..40, 8..32);
        for y in 8..32 {
            part.row_mut(y).copy_from_slice(&source.row(y)[16..40]);
        }
        let part = part.reduced();
        for y in 5..15 {
            assert_eq!(&part.row(y)[1..11], &whole.row(y)[9..19]);
        }
        let all = whole.expanded(&(0..64), &(0..48));
        let some = whole.expanded(&(13..27), &(5..22));
        for y in 5..22 {
            assert_eq!(some.row(y), &all.row(y)[13..27]);
        }
    }

    #[test]
    fn the_kernel_is_that_of_burt_and_adelson() {
        let impulse = plane(9, 1, |x, _| if x == 4 { [1.0; 4] } else { [0.0; 4] });
        // Middle row: 6/16 along y.
        let taps: Vec<f32> = impulse.reduced().texels.iter().map(|texel| texel[0] * 16.0 / 6.0).collect();
        assert_eq!(taps, [0.0, 0.0625, 0.375, 0.0625, 0.0]);
    }
}
