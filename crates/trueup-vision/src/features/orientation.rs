//! The dominant gradient directions around a point.

use super::scale_space::Plane;
use super::simd::{Kernel, Lanes};

/// Bins of the direction histogram (Lowe 2004, section 5).
const BINS: usize = 36;

/// Standard deviation of the window, in units of the point's blur (Lowe 2004, section 5).
const WINDOW: f64 = 1.5;

/// The window is cut off at this many of its standard deviations.
const WINDOW_REACH: f64 = 3.0;

/// A peak counts from this share of the greatest on (Lowe 2004, section 5).
const PEAK_SHARE: f32 = 0.8;

/// Samples handled together.
const CHUNK: usize = 16;

/// Finds the directions at (x, y), in samples, of a plane whose blur is about `sigma` samples.
pub(super) struct Orientations<'a> {
    pub(super) plane: &'a Plane,
    pub(super) position: [f64; 2],
    pub(super) sigma: f64,
    /// Most directions returned, strongest first.
    pub(super) limit: usize,
}

impl Kernel for Orientations<'_> {
    /// Radians, clockwise on the screen from the x axis, strongest first.
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<f64> {
        let histogram = smoothed(&histogram(self.plane, self.position, self.sigma));
        peaks(&histogram, self.limit)
    }
}

/// Gradient magnitudes by direction, weighed by a Gaussian window and shared between the two nearest bins.
#[inline(always)]
fn histogram(plane: &Plane, position: [f64; 2], sigma: f64) -> [f32; BINS] {
    let window = WINDOW * sigma;
    let reach = WINDOW_REACH * window;
    let range = |centre: f64, size: usize| {
        let first = (centre - reach).ceil().max(1.0) as usize;
        let end = ((centre + reach).floor().max(0.0) as usize + 1).min(size.saturating_sub(1));
        first..end.max(first)
    };
    let (columns, rows) = (range(position[0], plane.width), range(position[1], plane.height));
    let falloff = (-0.5 / (window * window)) as f32;
    let reach_squared = (reach * reach) as f32;
    // Neighbouring samples often fall into one bin; two histograms halve the wait for the previous addition.
    let mut histograms = [[0.0_f32; BINS + 2]; 2];
    for y in rows {
        let dy = (y as f64 - position[1]) as f32;
        for first in columns.clone().step_by(CHUNK) {
            let at = y * plane.stride + first;
            let middle: &[f32; CHUNK + 2] = window_of(&plane.data, at - 1);
            let above: &[f32; CHUNK] = window_of(&plane.data, at - plane.stride);
            let below: &[f32; CHUNK] = window_of(&plane.data, at + plane.stride);
            let (mut bins, mut weights) = ([0.0_f32; CHUNK], [0.0_f32; CHUNK]);
            let start = (first as f64 - position[0]) as f32;
            for k in 0..CHUNK {
                let (gx, gy) = (middle[k + 2] - middle[k], below[k] - above[k]);
                let dx = start + k as f32;
                let distance_squared = dx * dx + dy * dy;
                let inside = distance_squared <= reach_squared;
                let weight = (gx * gx + gy * gy).sqrt() * super::maths::exp(distance_squared * falloff);
                weights[k] = if inside { weight } else { 0.0 };
                bins[k] = super::maths::turns(gy, gx) * BINS as f32;
            }
            let used = CHUNK.min(columns.end - first);
            for k in 0..used {
                let bin = (bins[k] as usize).min(BINS);
                let share = bins[k] - bin as f32;
                let histogram = &mut histograms[k % 2];
                histogram[bin] += weights[k] * (1.0 - share);
                histogram[bin + 1] += weights[k] * share;
            }
        }
    }
    let [even, odd] = histograms;
    let mut total: [f32; BINS] = std::array::from_fn(|bin| even[bin] + odd[bin]);
    for excess in [BINS, BINS + 1] {
        total[excess - BINS] += even[excess] + odd[excess];
    }
    total
}

/// `N` samples from `at` on. The padding of a [`Plane`] makes room for a chunk that begins inside the picture.
#[inline(always)]
fn window_of<const N: usize>(samples: &[f32], at: usize) -> &[f32; N] {
    match samples[at..].first_chunk() {
        Some(window) => window,
        None => &[0.0; N],
    }
}

/// The histogram after the binomial filter of five bins, around the circle.
fn smoothed(histogram: &[f32; BINS]) -> [f32; BINS] {
    let at = |bin: usize| histogram[bin % BINS];
    std::array::from_fn(|bin| {
        let next = at(bin + BINS - 1) + at(bin + 1);
        let far = at(bin + BINS - 2) + at(bin + 2);
        (6.0 * at(bin) + 4.0 * next + far) * (1.0 / 16.0)
    })
}

/// The peaks between the bins by a parabola through three of them, strongest first.
fn peaks(histogram: &[f32; BINS], limit: usize) -> Vec<f64> {
    let greatest = histogram.iter().copied().fold(0.0, f32::max);
    let mut found: Vec<(f32, f64)> = Vec::new();
    for bin in 0..BINS {
        let (before, here, after) = (histogram[(bin + BINS - 1) % BINS], histogram[bin], histogram[(bin + 1) % BINS]);
        if here > before && here >= after && here >= PEAK_SHARE * greatest {
            let offset = 0.5 * f64::from(before - after) / f64::from(before - 2.0 * here + after);
            let bin = (bin as f64 + offset).rem_euclid(BINS as f64);
            found.push((here, bin * std::f64::consts::TAU / BINS as f64));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(limit);
    found.into_iter().map(|(_, angle)| angle).collect()
}
