//! The dominant gradient directions around a point.

use std::sync::LazyLock;

use super::patch::{Grid, gradients, sample};
use super::scale_space::BlurredPlane;
use super::simd::{Lanes, VectorKernel};

/// Bins of the direction histogram (Lowe 2004, section 5).
const BINS: usize = 36;

/// Standard deviation of the window, in units of the point's blur (Lowe 2004, section 5).
const WINDOW: f64 = 1.5;

/// The window is cut off at this many of its standard deviations.
const WINDOW_REACH: f64 = 3.0;

/// A peak counts from this share of the greatest on (Lowe 2004, section 5).
const PEAK_SHARE: f32 = 0.8;

/// Most directions of a point, each with a descriptor of its own (Lowe sets no limit).
const MAX_ORIENTATIONS: usize = 4;

/// Gradients sampled on a side of the window.
const GRID: usize = 16;

/// Gray values sampled on a side: the corners of the gradient cells.
const CORNERS: usize = GRID + 1;

/// Finds the directions at a point in a plane whose blur is about `sigma` samples.
///
/// # Source
/// Lowe 2004, section 5.
///
/// # Departures
/// Lowe takes the gradients of all pixels in the window. Here they are taken on a grid of [`GRID`] x [`GRID`] cells
/// that is centered on the point and 0.5625 times the blur apart, as for the descriptor. The histogram is smoothed.
pub(super) struct Orientations<'a> {
    pub(super) plane: &'a BlurredPlane,
    /// Position (x, y) in samples.
    pub(super) position: [f64; 2],
    pub(super) sigma: f64,
}

impl VectorKernel for Orientations<'_> {
    /// Radians, clockwise on the screen from the x axis, strongest first.
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<f64> {
        let step = 2.0 * WINDOW_REACH * WINDOW * self.sigma / GRID as f64;
        let corners = sample::<CORNERS>(self.plane, &Grid { center: self.position, step, angle: 0.0 });
        peaks(&smoothed(&histogram(&corners)))
    }
}

/// Gradient magnitudes by direction, weighed by a Gaussian window and shared between the two nearest bins.
#[inline(always)]
fn histogram(corners: &[[f32; CORNERS]; CORNERS]) -> [f32; BINS] {
    let window = &*WINDOW_WEIGHTS;
    // Neighboring cells often fall into one bin; two histograms halve the wait for the previous addition.
    let mut histograms = [[0.0_f32; BINS + 2]; 2];
    for v in 0..GRID {
        let (mut weights, turns) = gradients::<CORNERS, GRID>(&corners[v], &corners[v + 1]);
        let (mut bins, mut shares) = ([0_u32; GRID], [0.0_f32; GRID]);
        for u in 0..GRID {
            let place = turns[u] * BINS as f32;
            weights[u] *= window[v][u];
            bins[u] = place as u32;
            shares[u] = weights[u] * (place - bins[u] as f32);
        }
        for u in 0..GRID {
            let bin = (bins[u] as usize).min(BINS);
            histograms[u % 2][bin] += weights[u] - shares[u];
            histograms[u % 2][bin + 1] += shares[u];
        }
    }
    let [even, odd] = histograms;
    let mut total: [f32; BINS] = std::array::from_fn(|bin| even[bin] + odd[bin]);
    for excess in [BINS, BINS + 1] {
        total[excess - BINS] += even[excess] + odd[excess];
    }
    total
}

/// The Gaussian window on the grid, zero outside the circle of its reach.
static WINDOW_WEIGHTS: LazyLock<[[f32; GRID]; GRID]> = LazyLock::new(|| {
    let place = |line: usize| ((line as f64 + 0.5) / GRID as f64 - 0.5) * 2.0 * WINDOW_REACH;
    std::array::from_fn(|v| {
        std::array::from_fn(|u| {
            let squared = place(u).powi(2) + place(v).powi(2);
            if squared <= WINDOW_REACH.powi(2) { (-0.5 * squared).exp() as f32 } else { 0.0 }
        })
    })
});

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
fn peaks(histogram: &[f32; BINS]) -> Vec<f64> {
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
    found.truncate(MAX_ORIENTATIONS);
    found.into_iter().map(|(_, angle)| angle).collect()
}
