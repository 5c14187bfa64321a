//! The inner loops, compiled for the processor's vector instructions where it has them.
//!
//! Every function chooses at run time and has a portable form with the same order of operations and no fused
//! multiply-add, so that both give the same bits.

use crate::exposure::{LightTable, exposed};
use crate::sampling::Kernel;
use crate::weights::{Feather, weight};

/// The inverse of one cell's bilinear map along one canvas row.
///
/// A point of the cell is `p = u e + v f + u v g` from its top left corner, with `e` the top edge, `f` the left edge and
/// `g` the deviation from a parallelogram. Crossing `p - v f = u (e + v g)` with `e + v g` leaves a quadratic in v,
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

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

impl InverseBilinear {
    /// For the cell with the given corners (top left, top right, bottom right, bottom left, canvas pixels), whose top left
    /// is `source` in the photograph and whose extent there is `source_size`; `y` is the row's pixel centre.
    pub(crate) fn new(corners: [[f64; 2]; 4], source: [f64; 2], source_size: [f64; 2], y: f64) -> Self {
        let [a, b, c, d] = corners;
        let e = [b[0] - a[0], b[1] - a[1]];
        let f = [d[0] - a[0], d[1] - a[1]];
        let g = [a[0] - b[0] + c[0] - d[0], a[1] - b[1] + c[1] - d[1]];
        let middle = cross([e[0] + 0.5 * g[0], e[1] + 0.5 * g[1]], [f[0] + 0.5 * g[0], f[1] + 0.5 * g[1]]);
        Self { top_left: a, e, f, g, orientation: if middle < 0.0 { -1.0 } else { 1.0 }, source, source_size, y }
    }
}

/// Positions in a photograph for consecutive pixels of a canvas row, split into whole pixel and fraction: the position is
/// `(column + fraction_x + 0.5, row + fraction_y + 0.5)`, fractions in [0, 1].
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

/// Fills `positions` for the canvas pixels from column `first` on.
pub(crate) fn invert_row(cell: &InverseBilinear, first: usize, positions: &mut Positions) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::invert_row(cell, first, positions) };
    }
    invert_row_portable(cell, first, positions);
}

/// A whole number within the range of `i32` as one; a plain cast checks the range and is not vectorised.
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

/// A loop to be compiled for the processor's vector instructions. `run` must be `#[inline(always)]` (a closure is not).
pub(crate) trait VectorLoop {
    /// Runs the loop.
    fn run(self);
}

/// Runs a loop, compiled for AVX2 where the processor has it.
pub(crate) fn with_vector_instructions(work: impl VectorLoop) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::run(work) };
    }
    work.run();
}

/// How a weighted sample joins what a canvas pixel already holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Combine {
    /// Feather weights, added.
    Feathered,
    /// Equal weights, added.
    Equal,
}

/// What one photograph brings to [`accumulate`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contribution<'a> {
    pub(crate) feather: &'a Feather,
    /// Factors on linear light.
    pub(crate) light: &'a LightTable,
    /// Size of a canvas pixel in photograph pixels where the photograph's border may cut canvas pixels.
    pub(crate) border_footprint: Option<[f32; 2]>,
    pub(crate) combine: Combine,
}

/// Linearises `samples` (red, green, blue, alpha from 0 to 255), weighs them and joins them to the canvas pixels `sums`.
pub(crate) fn accumulate(
    contribution: Contribution<'_>,
    positions: &Positions,
    samples: &[[f32; 4]],
    sums: &mut [[f32; 4]],
) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::accumulate(contribution, positions, samples, sums) };
    }
    accumulate_portable(contribution, positions, samples, sums);
}

#[inline(always)]
fn accumulate_portable(
    contribution: Contribution<'_>,
    positions: &Positions,
    samples: &[[f32; 4]],
    sums: &mut [[f32; 4]],
) {
    const PER_LEVEL: f32 = 1.0 / 255.0;
    let Contribution { feather, light, border_footprint, combine } = contribution;
    let (gain, varies) = (light.gain, light.varies());
    let linearise = light.linearise.as_ref();
    let length = sums.len();
    let (columns, rows) = (&positions.column[..length], &positions.row[..length]);
    let (fractions_x, fractions_y) = (&positions.fraction_x[..length], &positions.fraction_y[..length]);
    let samples = &samples[..length];
    for index in 0..length {
        let (column, row) = (columns[index], rows[index]);
        let (fraction_x, fraction_y) = (fractions_x[index], fractions_y[index]);
        let [r, g, b, opacity] = samples[index];
        let mut share = (opacity * PER_LEVEL).clamp(0.0, 1.0);
        if let Some(footprint) = border_footprint {
            let position = [column as f32 + 0.5 + fraction_x, row as f32 + 0.5 + fraction_y];
            share *= feather.coverage(position, footprint);
        }
        let inside = if combine == Combine::Equal { 1.0 } else { feather.at(column, row, fraction_x, fraction_y) };
        let weight = weight(share, inside);
        let lift = if varies { light.at(column as f32 + 0.5 + fraction_x, row as f32 + 0.5 + fraction_y) } else { 1.0 };
        let light = |level: f32, gain: f32| exposed(linearise.linear(level), gain * lift);
        let (r, g, b) = (light(r, gain[0]), light(g, gain[1]), light(b, gain[2]));
        let sum = &mut sums[index];
        *sum = [sum[0] + r * weight, sum[1] + g * weight, sum[2] + b * weight, sum[3] + weight];
    }
}

/// What one photograph brings to [`develop`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Development<'a> {
    pub(crate) feather: &'a Feather,
    /// Factors on linear light.
    pub(crate) light: &'a LightTable,
    /// Size of a canvas pixel in photograph pixels where the photograph's border may cut canvas pixels.
    pub(crate) border_footprint: Option<[f32; 2]>,
}

/// Turns `samples` (red, green, blue, alpha from 0 to 255) in place into square roots of corrected linear light and the
/// share of the canvas pixel that is covered, 0 to 1.
pub(crate) fn develop(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::develop(development, positions, samples) };
    }
    develop_portable(development, positions, samples);
}

#[inline(always)]
fn develop_portable(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
    const PER_LEVEL: f32 = 1.0 / 255.0;
    let Development { feather, light, border_footprint } = development;
    let (gain, varies) = (light.gain, light.varies());
    let linearise = light.linearise.as_ref();
    let length = samples.len();
    let (columns, rows) = (&positions.column[..length], &positions.row[..length]);
    let (fractions_x, fractions_y) = (&positions.fraction_x[..length], &positions.fraction_y[..length]);
    for (index, sample) in samples.iter_mut().enumerate() {
        let position =
            [columns[index] as f32 + 0.5 + fractions_x[index], rows[index] as f32 + 0.5 + fractions_y[index]];
        let [r, g, b, opacity] = *sample;
        let mut share = (opacity * PER_LEVEL).clamp(0.0, 1.0);
        if let Some(footprint) = border_footprint {
            share *= feather.coverage(position, footprint);
        }
        let lift = if varies { light.at(position[0], position[1]) } else { 1.0 };
        let root = |level: f32, gain: f32| exposed(linearise.linear(level), gain * lift).sqrt();
        *sample = [root(r, gain[0]), root(g, gain[1]), root(b, gain[2]), share];
    }
}

/// An 8-bit RGB picture as the interpolation sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rgb8<'a> {
    pub(crate) samples: &'a [u8],
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Rgb8<'_> {
    /// Index of the first of the 4 x 4 pixels around a position, if 16 bytes can be read from each of their rows.
    #[inline(always)]
    fn window(&self, column: i32, row: i32) -> Option<usize> {
        // Sixteen bytes end a pixel and a third after the fourth pixel of a row: two columns more than the window.
        let inside = column >= 1 && row >= 1 && column as usize + 5 <= self.width && row as usize + 3 <= self.height;
        inside.then(|| ((row as usize - 1) * self.width + column as usize - 1) * 3)
    }
}

/// Interpolates 8-bit RGB at every position, on the scale of 0 to 255 and not yet clamped; the fourth value is 255.
///
/// Returns nothing for positions too near the border for a whole window: their indices go to `at_border`.
pub(crate) fn interpolate_rgb8<K: Kernel>(
    picture: Rgb8<'_>,
    positions: &Positions,
    out: &mut [[f32; 4]],
    at_border: &mut Vec<usize>,
) {
    debug_assert_eq!(picture.samples.len(), picture.width * picture.height * 3);
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::interpolate_rgb8::<K>(picture, positions, out, at_border) };
    }
    interpolate_rgb8_portable::<K>(picture, positions, out, at_border);
}

fn interpolate_rgb8_portable<K: Kernel>(
    picture: Rgb8<'_>,
    positions: &Positions,
    out: &mut [[f32; 4]],
    at_border: &mut Vec<usize>,
) {
    for (index, out) in out.iter_mut().enumerate().take(positions.len()) {
        let Some(top_left) = picture.window(positions.column[index], positions.row[index]) else {
            at_border.push(index);
            continue;
        };
        let (wx, wy) = (K::taps(positions.fraction_x[index]), K::taps(positions.fraction_y[index]));
        let stride = 3 * picture.width;
        let rows: [&[u8]; 4] = std::array::from_fn(|row| {
            let start = top_left + row * stride;
            &picture.samples[start..start + 12]
        });
        let columns: [f32; 12] = std::array::from_fn(|index| {
            ((f32::from(rows[0][index]) * wy[0] + f32::from(rows[1][index]) * wy[1])
                + f32::from(rows[2][index]) * wy[2])
                + f32::from(rows[3][index]) * wy[3]
        });
        let channel =
            |c| ((columns[c] * wx[0] + columns[3 + c] * wx[1]) + columns[6 + c] * wx[2]) + columns[9 + c] * wx[3];
        *out = [channel(0), channel(1), channel(2), 255.0];
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        __m128, __m128i, _mm_add_ps, _mm_alignr_epi8, _mm_blend_ps, _mm_castps_si128, _mm_castsi128_ps,
        _mm_cvtepi32_ps, _mm_cvtepu8_epi32, _mm_loadu_si128, _mm_mul_ps, _mm_set1_ps, _mm_srli_si128, _mm_storeu_ps,
        _mm256_add_ps, _mm256_castps256_ps128, _mm256_cvtepi32_ps, _mm256_cvtepu8_epi32, _mm256_extractf128_ps,
        _mm256_mul_ps, _mm256_set1_ps,
    };

    use super::{Contribution, Development, InverseBilinear, Positions, Rgb8, VectorLoop};
    use crate::sampling::Kernel;

    #[target_feature(enable = "avx2")]
    pub(super) fn run(work: impl VectorLoop) {
        work.run();
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn invert_row(cell: &InverseBilinear, first: usize, positions: &mut Positions) {
        super::invert_row_portable(cell, first, positions);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn accumulate(
        contribution: Contribution<'_>,
        positions: &Positions,
        samples: &[[f32; 4]],
        sums: &mut [[f32; 4]],
    ) {
        super::accumulate_portable(contribution, positions, samples, sums);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn develop(development: Development<'_>, positions: &Positions, samples: &mut [[f32; 4]]) {
        super::develop_portable(development, positions, samples);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn interpolate_rgb8<K: Kernel>(
        picture: Rgb8<'_>,
        positions: &Positions,
        out: &mut [[f32; 4]],
        at_border: &mut Vec<usize>,
    ) {
        let stride = 3 * picture.width;
        for (index, out) in out.iter_mut().enumerate().take(positions.len()) {
            let Some(top_left) = picture.window(positions.column[index], positions.row[index]) else {
                at_border.push(index);
                continue;
            };
            let (wx, wy) = (K::taps(positions.fraction_x[index]), K::taps(positions.fraction_y[index]));
            let window = &picture.samples[top_left..top_left + 3 * stride + 16];
            // Twelve sums over the rows: pixels 0 to 2 2/3 in `low`, the rest in `high`.
            let mut low = [_mm256_set1_ps(0.0); 4];
            let mut high = [_mm_set1_ps(0.0); 4];
            for row in 0..4 {
                // SAFETY: `window` holds 16 bytes from the start of each of its four rows.
                let bytes: __m128i = unsafe { _mm_loadu_si128(window.as_ptr().add(row * stride).cast()) };
                low[row] = _mm256_mul_ps(_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(bytes)), _mm256_set1_ps(wy[row]));
                let rest = _mm_cvtepu8_epi32(_mm_srli_si128::<8>(bytes));
                high[row] = _mm_mul_ps(_mm_cvtepi32_ps(rest), _mm_set1_ps(wy[row]));
            }
            let low = _mm256_add_ps(_mm256_add_ps(_mm256_add_ps(low[0], low[1]), low[2]), low[3]);
            let third = _mm_add_ps(_mm_add_ps(_mm_add_ps(high[0], high[1]), high[2]), high[3]);
            // r0 g0 b0 r1 | g1 b1 r2 g2 | b2 r3 g3 b3
            let (first, second) = (_mm256_castps256_ps128(low), _mm256_extractf128_ps::<1>(low));
            let taps = [first, shift::<12>(second, first), shift::<8>(third, second), shift::<4>(third, third)];
            let mut sum = _mm_mul_ps(taps[0], _mm_set1_ps(wx[0]));
            for tap in 1..4 {
                sum = _mm_add_ps(sum, _mm_mul_ps(taps[tap], _mm_set1_ps(wx[tap])));
            }
            let sum = _mm_blend_ps::<0b1000>(sum, _mm_set1_ps(255.0));
            // SAFETY: `out` is four floats.
            unsafe { _mm_storeu_ps(out.as_mut_ptr(), sum) };
        }
    }

    /// The four floats that start `BYTES` bytes into `low` followed by `high`.
    #[target_feature(enable = "avx2")]
    fn shift<const BYTES: i32>(high: __m128, low: __m128) -> __m128 {
        _mm_castsi128_ps(_mm_alignr_epi8::<BYTES>(_mm_castps_si128(high), _mm_castps_si128(low)))
    }
}
