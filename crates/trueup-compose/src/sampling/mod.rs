//! Interpolation of photographs at real positions, in their own encoding, on the scale of 0 to 255.

mod fitted;
mod narrow;
mod reduce;

pub(crate) use fitted::reduce_by;
pub(crate) use reduce::reduce_by_two;

use std::marker::PhantomData;

use trueup_core::raster::{Photograph, Raster};

use crate::kernel::{Bilinear, InterpolationKernel};
use crate::simd::{Positions, Rgb8, VectorLoop, cubic_rgb8, cubic_window, linear_rgb8, with_vector_instructions};
use narrow::{BLOCK, NarrowTaps, average_narrow, is_narrow};

/// Taps of a widened kernel per axis, at most: a kernel of radius 2 widened 15 times has 60.
const MAX_TAPS: usize = 64;

/// Alpha of a sample that hides what is behind it.
const OPAQUE: f32 = 255.0;

/// Widest a kernel is made; see [`MAX_TAPS`].
pub(crate) const MAX_STRETCH: f64 = 15.0;

/// A sample of a photograph at its own depth.
trait Sample: Copy + Default + Send + Sync {
    /// On the scale of 0 to 255.
    fn level(self) -> f32;

    /// The sample nearest to a level, which may lie outside the scale.
    fn of_level(level: f32) -> Self;
}

impl Sample for u8 {
    #[inline(always)]
    fn level(self) -> f32 {
        f32::from(self)
    }

    #[inline(always)]
    fn of_level(level: f32) -> Self {
        // The addition rounds; the conversion truncates and saturates.
        (level + 0.5) as u8
    }
}

impl Sample for u16 {
    #[inline(always)]
    fn level(self) -> f32 {
        f32::from(self) * (1.0 / 257.0)
    }

    #[inline(always)]
    fn of_level(level: f32) -> Self {
        (level * 257.0 + 0.5) as u16
    }
}

/// Interpolates a photograph at every position: red, green, blue and alpha from 0 to 255, not yet clamped.
///
/// Positions outside see the nearest sample. `stretch` is how much wider than a sample the kernel is, along x and y: 1
/// to interpolate, more to average where the photograph is reduced. Colors next to transparent samples are weighted by
/// alpha, so that what lies under a mask does not show. `at_border` is scratch space.
pub(crate) fn interpolate<K: InterpolationKernel>(
    photograph: &Photograph,
    positions: &Positions,
    stretch: [f64; 2],
    out: &mut [[f32; 4]],
    at_border: &mut Vec<usize>,
) {
    match photograph {
        Photograph::Eight(raster) if raster.channels() == 3 && stretch == [1.0, 1.0] => {
            let picture = Rgb8 { samples: raster.data(), width: raster.width(), height: raster.height() };
            at_border.clear();
            if K::IS_LINEAR {
                linear_rgb8(picture, positions, out, at_border);
            } else {
                cubic_rgb8(picture, positions, out, at_border);
            }
            for &index in &*at_border {
                out[index] = match K::IS_LINEAR {
                    true => interpolate_one::<K, u8, 3>(raster, positions, index),
                    false => cubic_at_border(raster, positions, index),
                };
            }
        }
        Photograph::Eight(raster) => interpolate_depth::<K, u8>(raster, positions, stretch, out),
        Photograph::Sixteen(raster) => interpolate_depth::<K, u16>(raster, positions, stretch, out),
    }
}

fn interpolate_depth<K: InterpolationKernel, T: Sample>(
    raster: &Raster<T>,
    positions: &Positions,
    stretch: [f64; 2],
    out: &mut [[f32; 4]],
) {
    match raster.channels() {
        1 => interpolate_channels::<K, T, 1>(raster, positions, stretch, out),
        3 => interpolate_channels::<K, T, 3>(raster, positions, stretch, out),
        _ => interpolate_channels::<K, T, 4>(raster, positions, stretch, out),
    }
}

fn interpolate_channels<K: InterpolationKernel, T: Sample, const C: usize>(
    raster: &Raster<T>,
    positions: &Positions,
    stretch: [f64; 2],
    out: &mut [[f32; 4]],
) {
    if stretch == [1.0, 1.0] {
        for (index, out) in out.iter_mut().enumerate().take(positions.len()) {
            *out = interpolate_one::<K, T, C>(raster, positions, index);
        }
    } else {
        with_vector_instructions(Averages::<K, T, C> { raster, positions, stretch, out, kernel: PhantomData });
    }
}

/// A run of [`average_one`].
struct Averages<'a, K, T, const C: usize> {
    raster: &'a Raster<T>,
    positions: &'a Positions,
    stretch: [f64; 2],
    out: &'a mut [[f32; 4]],
    kernel: PhantomData<K>,
}

impl<K: InterpolationKernel, T: Sample, const C: usize> VectorLoop for Averages<'_, K, T, C> {
    #[inline(always)]
    fn run(self) {
        let Self { raster, positions, stretch, out, .. } = self;
        let mut workspace = Workspace { wx: [0.0; MAX_TAPS], wy: [0.0; MAX_TAPS], columns: [0.0; 3 * MAX_TAPS] };
        let count = positions.len().min(out.len());
        if C != 3 || !(is_narrow::<K>(stretch[0]) && is_narrow::<K>(stretch[1])) {
            for (index, out) in out[..count].iter_mut().enumerate() {
                *out = average_one::<K, T, C>(raster, positions, index, stretch, &mut workspace);
            }
            return;
        }
        for start in (0..count).step_by(BLOCK) {
            let block = start..(start + BLOCK).min(count);
            let (columns, rows) = (&positions.column[block.clone()], &positions.row[block.clone()]);
            let across = NarrowTaps::of::<K>(columns, &positions.fraction_x[block.clone()], stretch[0]);
            let down = NarrowTaps::of::<K>(rows, &positions.fraction_y[block.clone()], stretch[1]);
            for (at, index) in block.enumerate() {
                out[index] = match average_narrow(raster, &across, &down, at) {
                    Some(mean) => mean,
                    None => average_one::<K, T, C>(raster, positions, index, stretch, &mut workspace),
                };
            }
        }
    }
}

/// One pixel as red, green, blue and alpha.
#[inline(always)]
fn pixel<T: Sample, const C: usize>(row: &[T], column: usize) -> [f32; 4] {
    match C {
        1 => {
            let level = row[column].level();
            [level, level, level, OPAQUE]
        }
        3 => {
            let rgb = &row[3 * column..3 * column + 3];
            [rgb[0].level(), rgb[1].level(), rgb[2].level(), OPAQUE]
        }
        _ => {
            let rgba = &row[4 * column..4 * column + 4];
            [rgba[0].level(), rgba[1].level(), rgba[2].level(), rgba[3].level()]
        }
    }
}

/// The columns and rows of the 4 x 4 samples around a position; beyond the border, the outermost ones again.
fn window_around<'r, T: Sample>(
    raster: &'r Raster<T>,
    positions: &Positions,
    index: usize,
) -> ([usize; 4], [&'r [T]; 4]) {
    let tap = |at: i32, tap: usize, size: usize| (at.saturating_add(tap as i32 - 1).max(0) as usize).min(size - 1);
    let columns = std::array::from_fn(|i| tap(positions.column[index], i, raster.width()));
    (columns, std::array::from_fn(|i| raster.row(tap(positions.row[index], i, raster.height()))))
}

/// 8-bit RGB by cubic convolution where the border cuts the window.
fn cubic_at_border(raster: &Raster<u8>, positions: &Positions, index: usize) -> [f32; 4] {
    let (columns, rows) = window_around(raster, positions, index);
    let pixel = |row: &[u8], column: usize| [row[3 * column], row[3 * column + 1], row[3 * column + 2]];
    let window = columns.map(|column| rows.map(|row| pixel(row, column)));
    cubic_window(window, positions.fraction_x[index], positions.fraction_y[index])
}

/// The 4 x 4 samples around a position, weighted along the columns first.
fn interpolate_one<K: InterpolationKernel, T: Sample, const C: usize>(
    raster: &Raster<T>,
    positions: &Positions,
    index: usize,
) -> [f32; 4] {
    let (columns, rows) = window_around(raster, positions, index);
    let (fraction_x, fraction_y) = (positions.fraction_x[index], positions.fraction_y[index]);
    let (wx, wy) = (K::taps(fraction_x), K::taps(fraction_y));
    let window: [[[f32; 4]; 4]; 4] = columns.map(|column| rows.map(|row| pixel::<T, C>(row, column)));
    if C == 4 && window.iter().flatten().any(|pixel| pixel[3] < OPAQUE) {
        return weigh_by_alpha(&window, Bilinear::taps(fraction_x), Bilinear::taps(fraction_y));
    }
    let sums = window.map(|column| weigh(&column, wy));
    let mut sum = weigh(&sums, wx);
    sum[3] = OPAQUE;
    sum
}

/// `((p0 w0 + p1 w1) + p2 w2) + p3 w3` for each of four values.
#[inline(always)]
fn weigh(pixels: &[[f32; 4]; 4], weights: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|c| {
        ((pixels[0][c] * weights[0] + pixels[1][c] * weights[1]) + pixels[2][c] * weights[2])
            + pixels[3][c] * weights[3]
    })
}

/// Mean of a window (columns of rows) by weights times alpha; weights must not be negative.
fn weigh_by_alpha(window: &[[[f32; 4]; 4]; 4], wx: [f32; 4], wy: [f32; 4]) -> [f32; 4] {
    let mut sum = PremultipliedSum::default();
    for (column, wx) in window.iter().zip(wx) {
        for (pixel, wy) in column.iter().zip(wy) {
            sum.add(*pixel, wx * wy);
        }
    }
    sum.mean()
}

/// Room for the weights and the sums over rows of one mean, kept from pixel to pixel.
struct Workspace {
    wx: [f32; MAX_TAPS],
    wy: [f32; MAX_TAPS],
    columns: [f32; 3 * MAX_TAPS],
}

/// A mean over a kernel `stretch` times as wide as the interpolating one.
#[inline(always)]
fn average_one<K: InterpolationKernel, T: Sample, const C: usize>(
    raster: &Raster<T>,
    positions: &Positions,
    index: usize,
    stretch: [f64; 2],
    workspace: &mut Workspace,
) -> [f32; 4] {
    let x = f64::from(positions.column[index]) + f64::from(positions.fraction_x[index]);
    let y = f64::from(positions.row[index]) + f64::from(positions.fraction_y[index]);
    let (first_column, wx) = widened_taps::<K>(x, stretch[0], &mut workspace.wx);
    let (first_row, wy) = widened_taps::<K>(y, stretch[1], &mut workspace.wy);
    let clamped = |first: i64, tap: usize, size: usize| (first + tap as i64).clamp(0, size as i64 - 1) as usize;
    let inside = first_column >= 0 && first_column as usize + wx.len() <= raster.width();
    if C != 4 && inside {
        return average_inside::<T, C>(raster, first_column as usize, first_row, wx, wy, &mut workspace.columns);
    }
    let mut sum = PremultipliedSum::default();
    for (j, &wy) in wy.iter().enumerate() {
        let row = raster.row(clamped(first_row, j, raster.height()));
        for (i, &wx) in wx.iter().enumerate() {
            let pixel = pixel::<T, C>(row, clamped(first_column, i, raster.width()));
            // A negative lobe over transparent samples would divide by nearly nothing.
            sum.add(pixel, if C == 4 { (wx * wy).max(0.0) } else { wx * wy });
        }
    }
    sum.mean()
}

/// [`average_one`] for opaque photographs where all columns lie inside: rows are summed first, as they lie in memory.
#[inline(always)]
fn average_inside<T: Sample, const C: usize>(
    raster: &Raster<T>,
    first_column: usize,
    first_row: i64,
    wx: &[f32],
    wy: &[f32],
    columns: &mut [f32; 3 * MAX_TAPS],
) -> [f32; 4] {
    let columns = &mut columns[..wx.len() * C];
    columns.fill(0.0);
    for (j, &wy) in wy.iter().enumerate() {
        let row = raster.row((first_row + j as i64).clamp(0, raster.height() as i64 - 1) as usize);
        let samples = &row[first_column * C..][..columns.len()];
        for (sum, sample) in columns.iter_mut().zip(samples) {
            *sum += wy * sample.level();
        }
    }
    let mut sum = [0.0, 0.0, 0.0, OPAQUE];
    for (column, &wx) in columns.chunks_exact(C).zip(wx) {
        for (channel, sum) in sum[..3].iter_mut().enumerate() {
            *sum += wx * column[channel % C];
        }
    }
    sum
}

/// First sample and normalized weights of a kernel widened by `stretch` around `position` (0 at the first sample).
#[inline(always)]
fn widened_taps<K: InterpolationKernel>(position: f64, stretch: f64, taps: &mut [f32; MAX_TAPS]) -> (i64, &[f32]) {
    let stretch = stretch.clamp(1.0, MAX_STRETCH);
    let radius = K::RADIUS * stretch;
    let first = (position - radius).ceil();
    let count = (((position + radius).floor() - first).max(0.0) as usize + 1).min(MAX_TAPS);
    let (step, start) = (stretch.recip() as f32, ((first - position) / stretch) as f32);
    let mut sum = 0.0;
    for (tap, weight) in taps.iter_mut().take(count).enumerate() {
        *weight = K::at(start + tap as f32 * step);
        sum += *weight;
    }
    let normalize = 1.0 / sum;
    for weight in &mut taps[..count] {
        *weight *= normalize;
    }
    (first as i64, &taps[..count])
}

/// A weighted sum of colors multiplied by their alpha.
#[derive(Debug, Default)]
struct PremultipliedSum {
    color: [f32; 3],
    alpha: f32,
    weight: f32,
}

impl PremultipliedSum {
    #[inline(always)]
    fn add(&mut self, pixel: [f32; 4], weight: f32) {
        let weighted = weight * pixel[3];
        for (sum, level) in self.color.iter_mut().zip(pixel) {
            *sum += weighted * level;
        }
        self.alpha += weighted;
        self.weight += weight;
    }

    fn mean(&self) -> [f32; 4] {
        if self.alpha <= 0.0 {
            return [0.0; 4];
        }
        let [r, g, b] = self.color.map(|sum| sum / self.alpha);
        [r, g, b, self.alpha / self.weight]
    }
}

#[cfg(test)]
mod tests;
