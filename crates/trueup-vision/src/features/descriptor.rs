//! Histograms of gradient directions that describe a point's surroundings.

use std::sync::LazyLock;

use super::feature::{DESCRIPTOR_LENGTH, Descriptor};
use super::patch::{Grid, gradients, sample};
use super::scale_space::BlurredPlane;
use super::simd::{Lanes, VectorKernel};

/// Spatial bins on a side.
const SPATIAL_BINS: usize = 4;

/// Direction bins.
const DIRECTION_BINS: usize = 8;

/// Width of a spatial bin, in units of the point's blur (Lowe's implementation, and all since).
const BIN_WIDTH: f64 = 3.0;

/// Gradients sampled on a side; they cover the bins and the half bin around them that interpolation reaches.
const GRID: usize = 16;

/// Spatial bins that the grid covers.
const COVERED_BINS: f64 = SPATIAL_BINS as f64 + 1.0;

/// Gray values sampled on a side: the corners of the gradient cells.
const CORNERS: usize = GRID + 1;

/// Largest component of the normalized descriptor (Lowe 2004, section 6.1).
const CLAMP: f32 = 0.2;

/// The factor from a component of the normalized descriptor to its byte (Lowe's implementation).
const QUANTIZATION: f32 = 512.0;

/// Describes the surroundings of a point in a plane whose blur is about `sigma` samples.
///
/// # Source
/// Lowe 2004, section 6.
///
/// # Departures
/// Lowe takes the gradients of all pixels around the point and rotates them. Here gray values are sampled on a grid of
/// [`CORNERS`] x [`CORNERS`] that is already turned and scaled with the point, and gradients are differences on that
/// grid. Its step is 0.94 times the blur, so that the blur leaves little to see between the samples, and the
/// weights of interpolation are the same for all points.
pub(super) struct Describe<'a> {
    pub(super) plane: &'a BlurredPlane,
    /// Position (x, y) in samples.
    pub(super) position: [f64; 2],
    pub(super) sigma: f64,
    /// Direction of the point, radians clockwise on the screen from the x axis.
    pub(super) angle: f64,
}

impl VectorKernel for Describe<'_> {
    /// `None` where the surroundings are flat or not finite.
    type Output = Option<Descriptor>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<Descriptor> {
        let grid = Grid {
            center: self.position,
            step: BIN_WIDTH * self.sigma * COVERED_BINS / GRID as f64,
            angle: self.angle,
        };
        let corners = sample::<CORNERS>(self.plane, &grid);
        quantized(histogram(&corners))
    }
}

/// Gradient magnitudes shared between the nearest bins of place and direction, weighed by the Gaussian window.
#[inline(always)]
fn histogram(corners: &[[f32; CORNERS]; CORNERS]) -> [f32; DESCRIPTOR_LENGTH] {
    let weights = &*BIN_WEIGHTS;
    // Summed over the rows of the grid first: by row of bins, direction and column of the grid.
    let mut by_column = [[[0.0_f32; GRID]; DIRECTION_BINS]; SPATIAL_BINS];
    for v in 0..GRID {
        let (magnitude, turns) = gradients::<CORNERS, GRID>(&corners[v], &corners[v + 1]);
        let direction = turns.map(|turns| turns * DIRECTION_BINS as f32);
        #[allow(clippy::needless_range_loop, reason = "the index is also the direction, and indexes two arrays deep")]
        for bin in 0..DIRECTION_BINS {
            let mut share = [0.0_f32; GRID];
            for u in 0..GRID {
                let distance = (direction[u] - bin as f32).abs();
                let other_way = DIRECTION_BINS as f32 - distance;
                let nearest = 1.0 - if distance < other_way { distance } else { other_way };
                share[u] = magnitude[u] * if nearest > 0.0 { nearest } else { 0.0 };
            }
            for (row, weights) in weights.iter().enumerate() {
                let weight = weights[v];
                if weight > 0.0 {
                    for u in 0..GRID {
                        by_column[row][bin][u] += weight * share[u];
                    }
                }
            }
        }
    }
    let mut histogram = [0.0_f32; DESCRIPTOR_LENGTH];
    for row in 0..SPATIAL_BINS {
        for column in 0..SPATIAL_BINS {
            for bin in 0..DIRECTION_BINS {
                histogram[(row * SPATIAL_BINS + column) * DIRECTION_BINS + bin] =
                    dot(&by_column[row][bin], &weights[column]);
            }
        }
    }
    histogram
}

/// The sum of products, in eight partial sums that are then added in a fixed order.
#[inline(always)]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0_f32; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let [s0, s1, s2, s3, s4, s5, s6, s7] = sums;
    ((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7))
}

/// The weight of each line of the grid in each line of bins: linear interpolation times the Gaussian window, whose
/// standard deviation is half the width of the bins together.
static BIN_WEIGHTS: LazyLock<[[f32; GRID]; SPATIAL_BINS]> = LazyLock::new(|| {
    std::array::from_fn(|bin| {
        std::array::from_fn(|line| {
            let place = ((line as f64 + 0.5) / GRID as f64 - 0.5) * COVERED_BINS;
            let center = bin as f64 - 0.5 * (SPATIAL_BINS as f64 - 1.0);
            let window = place / (0.5 * SPATIAL_BINS as f64);
            ((1.0 - (place - center).abs()).max(0.0) * (-0.5 * window * window).exp()) as f32
        })
    })
});

/// Normalizes, clamps, normalizes again and rounds to bytes.
#[inline(always)]
fn quantized(mut histogram: [f32; DESCRIPTOR_LENGTH]) -> Option<Descriptor> {
    let length = dot(&histogram, &histogram).sqrt();
    if !(length > f32::MIN_POSITIVE && length.is_finite()) {
        return None;
    }
    let limit = CLAMP * length;
    for component in &mut histogram {
        *component = if *component < limit { *component } else { limit };
    }
    let length = dot(&histogram, &histogram).sqrt();
    for component in &mut histogram {
        *component /= length;
    }
    // The conversion to a byte stops at 255.
    Some(histogram.map(|component| (component * QUANTIZATION + 0.5) as u8))
}
