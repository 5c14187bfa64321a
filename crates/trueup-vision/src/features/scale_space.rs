//! The Gaussian scale space: octaves of ever more blurred copies of the photograph.

use rayon::prelude::*;
use trueup_core::raster::Raster;
use trueup_core::{Result, StageContext};

use super::simd::{InstructionSet, Lanes, MAX_LANES, VectorKernel};

/// Scales sampled in each doubling of scale (Lowe 2004, section 3.2).
pub(super) const LEVELS_PER_OCTAVE: usize = 3;

/// Blur of the first level of each octave, in the octave's samples (Lowe 2004, section 3.3).
pub(super) const BASE_SIGMA: f64 = 1.6;

/// Blur that a photograph is assumed to have already, in its pixels (Lowe 2004, section 3.3).
pub(super) const ASSUMED_BLUR_PX: f64 = 0.5;

/// Smallest side of an octave, in its samples.
const MIN_OCTAVE_SIDE: usize = 8;

/// The Gaussian is cut off at this many standard deviations.
const KERNEL_REACH: f64 = 3.0;

/// Rows that one task blurs; enough to share the rows read, few enough to stay in the second-level cache.
const BAND_ROWS: usize = 32;

/// Columns blurred together, so that all rows a kernel touches stay in the first-level cache.
const STRIP_COLUMNS: usize = 256;

/// One blurred copy of the photograph, rows padded for vector loads.
#[derive(Debug, Clone, Default)]
pub(super) struct BlurredPlane {
    /// Samples in a row.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// Distance of two rows in `data`; what lies between is arbitrary but finite where the photograph is.
    pub(super) stride: usize,
    /// `height * stride` samples and a padding of [`MAX_LANES`] + 1.
    pub(super) data: Vec<f32>,
}

impl BlurredPlane {
    fn new(width: usize, height: usize) -> Self {
        // An odd number of vectors a row keeps the rows of one column in different cache sets.
        let stride = (width.div_ceil(MAX_LANES) | 1) * MAX_LANES;
        Self { width, height, stride, data: vec![0.0; height * stride + MAX_LANES + 1] }
    }

    /// The samples of row `y`.
    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.data[y * self.stride..y * self.stride + self.width]
    }

    /// The bands of rows, as (index of the first row, samples with padding).
    fn bands(&mut self) -> impl IndexedParallelIterator<Item = (usize, &mut [f32])> {
        let used = self.height * self.stride;
        let bands = self.data[..used].par_chunks_mut(BAND_ROWS * self.stride);
        bands.enumerate().map(|(band, rows)| (band * BAND_ROWS, rows))
    }
}

/// The copies of one octave.
#[derive(Debug)]
pub(super) struct Octave {
    /// Distance of two samples, in the photograph's pixels: a power of two.
    pub(super) step_px: f64,
    /// [`LEVELS_PER_OCTAVE`] + 3 planes; plane s has blur [`BASE_SIGMA`] 2^(s / [`LEVELS_PER_OCTAVE`]) samples.
    pub(super) planes: Vec<BlurredPlane>,
}

/// At which size a photograph is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SearchSize {
    /// As it is.
    Original,
    /// Doubled, which shows finer detail.
    Doubled,
}

/// Builds all octaves of a photograph of one channel.
///
/// # Source
/// Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 2004, section 3.
///
/// # Departures
/// The doubled photograph takes the samples between two pixels by cubic interpolation (Lowe: linear), which keeps more
/// of the fine detail. Kernels are cut at three standard deviations, and their width corrected so that the variance
/// is exact.
pub(super) fn build(
    picture: &Raster<f32>,
    size: SearchSize,
    instructions: InstructionSet,
    context: &StageContext,
) -> Result<Vec<Octave>> {
    let (mut base, mut step_px) = match size {
        SearchSize::Original => (plane_of(picture), 1.0),
        SearchSize::Doubled => (doubled(&plane_of(picture)), 0.5),
    };
    let assumed_blur = ASSUMED_BLUR_PX / step_px;
    let missing_blur = (BASE_SIGMA.powi(2) - assumed_blur.powi(2)).max(0.0).sqrt();
    base = blurred(&base, missing_blur, instructions);
    let mut octaves = Vec::new();
    while base.width.min(base.height) >= MIN_OCTAVE_SIDE {
        let mut planes = vec![std::mem::take(&mut base)];
        for level in 1..LEVELS_PER_OCTAVE + 3 {
            context.check_cancelled()?;
            let blur = |level: usize| BASE_SIGMA * (level as f64 / LEVELS_PER_OCTAVE as f64).exp2();
            let step = (blur(level).powi(2) - blur(level - 1).powi(2)).sqrt();
            planes.push(blurred(&planes[level - 1], step, instructions));
        }
        base = halved(&planes[LEVELS_PER_OCTAVE]);
        octaves.push(Octave { step_px, planes });
        step_px *= 2.0;
    }
    Ok(octaves)
}

fn plane_of(picture: &Raster<f32>) -> BlurredPlane {
    let mut plane = BlurredPlane::new(picture.width(), picture.height());
    let width = plane.width;
    plane.bands().for_each(|(first, rows)| {
        let stride = (width.div_ceil(MAX_LANES) | 1) * MAX_LANES;
        for (offset, row) in rows.chunks_exact_mut(stride).enumerate() {
            row[..width].copy_from_slice(picture.row(first + offset));
        }
    });
    plane
}

/// Twice the samples: sample 2k lies on sample k of the source, so that positions scale by two exactly.
fn doubled(source: &BlurredPlane) -> BlurredPlane {
    let mut target = BlurredPlane::new(2 * source.width, 2 * source.height);
    let stride = target.stride;
    let last = source.height - 1;
    target.bands().for_each(|(first, rows)| {
        let mut between = vec![0.0; source.width];
        for (offset, row) in rows.chunks_exact_mut(stride).enumerate() {
            let (y, odd) = ((first + offset) / 2, (first + offset) % 2 == 1);
            let line = if odd {
                let [a, b, c, d] = [y.saturating_sub(1), y, (y + 1).min(last), (y + 2).min(last)];
                let (a, b, c, d) = (source.row(a), source.row(b), source.row(c), source.row(d));
                for (x, sample) in between.iter_mut().enumerate() {
                    *sample = half_way(a[x], b[x], c[x], d[x]);
                }
                &between
            } else {
                source.row(y)
            };
            double_row(line, row);
        }
    });
    target
}

fn double_row(source: &[f32], target: &mut [f32]) {
    let at = |index: usize| source[index.min(source.len() - 1)];
    for (x, pair) in target[..2 * source.len()].chunks_exact_mut(2).enumerate() {
        pair[0] = source[x];
        pair[1] = half_way(at(x.saturating_sub(1)), at(x), at(x + 1), at(x + 2));
    }
}

/// The value half way between `b` and `c` by Catmull and Rom's cubic.
#[inline]
fn half_way(a: f32, b: f32, c: f32, d: f32) -> f32 {
    (9.0 * (b + c) - (a + d)) * (1.0 / 16.0)
}

/// Every second sample: sample k of the result lies on sample 2k of the source.
fn halved(source: &BlurredPlane) -> BlurredPlane {
    let mut target = BlurredPlane::new(source.width.div_ceil(2), source.height.div_ceil(2));
    let stride = target.stride;
    target.bands().for_each(|(first, rows)| {
        for (offset, row) in rows.chunks_exact_mut(stride).enumerate() {
            let line = source.row(2 * (first + offset));
            for (sample, pair) in row.iter_mut().zip(line.chunks(2)) {
                *sample = pair[0];
            }
        }
    });
    target
}

/// Convolves with a Gaussian of standard deviation `sigma` samples; the photograph's edge is continued outwards.
fn blurred(source: &BlurredPlane, sigma: f64, instructions: InstructionSet) -> BlurredPlane {
    let taps = gaussian_taps(sigma);
    let mut target = BlurredPlane::new(source.width, source.height);
    target.bands().for_each_init(Vec::new, |scratch, (first_row, rows)| {
        instructions.run(BlurBand { source, taps: &taps, first_row, rows, scratch });
    });
    target
}

/// Half of a symmetric kernel: the center tap, then the taps at distance 1, 2 and so on; the whole sums to one.
fn gaussian_taps(sigma: f64) -> Vec<f32> {
    let reach = (KERNEL_REACH * sigma).ceil() as usize;
    let weights = |width: f64| -> Vec<f64> {
        let raw: Vec<f64> = (0..=reach).map(|x| (-0.5 * (x as f64 / width).powi(2)).exp()).collect();
        let sum = raw[0] + 2.0 * raw[1..].iter().sum::<f64>();
        raw.iter().map(|weight| weight / sum).collect()
    };
    let variance = |weights: &[f64]| -> f64 {
        2.0 * weights.iter().enumerate().map(|(x, weight)| (x * x) as f64 * weight).sum::<f64>()
    };
    // Cutting the tails off takes variance away; a slightly wider Gaussian gives it back.
    const CORRECTIONS: usize = 8;
    let mut width = sigma.max(f64::MIN_POSITIVE);
    for _ in 0..CORRECTIONS {
        let present = variance(&weights(width));
        if present > 0.0 {
            width *= sigma / present.sqrt();
        }
    }
    if reach == 0 { vec![1.0] } else { weights(width).iter().map(|&weight| weight as f32).collect() }
}

/// Blurs some rows of a plane: columns first, into scratch rows, then those rows.
struct BlurBand<'a> {
    source: &'a BlurredPlane,
    taps: &'a [f32],
    first_row: usize,
    /// The rows to write, with the stride of `source`.
    rows: &'a mut [f32],
    scratch: &'a mut Vec<f32>,
}

impl VectorKernel for BlurBand<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { source, taps, first_row, rows, scratch } = self;
        let stride = source.stride;
        let reach = taps.len() - 1;
        let margin = reach.next_multiple_of(MAX_LANES);
        let padded = stride + 2 * margin;
        let count = rows.len() / stride;
        scratch.resize(count * padded, 0.0);
        for strip in (0..stride).step_by(STRIP_COLUMNS) {
            let end = (strip + STRIP_COLUMNS).min(stride);
            for (offset, line) in scratch.chunks_exact_mut(padded).enumerate() {
                blur_columns::<L>(source, taps, first_row + offset, strip..end, &mut line[margin..]);
            }
        }
        for (line, row) in scratch.chunks_exact_mut(padded).zip(rows.chunks_exact_mut(stride)) {
            let (left, right) = (line[margin], line[margin + source.width - 1]);
            line[..margin].fill(left);
            line[margin + source.width..].fill(right);
            blur_row::<L>(line, margin, taps, row);
        }
    }
}

/// Row `y` of the plane convolved along its columns, for some columns.
#[inline(always)]
fn blur_columns<L: Lanes>(
    source: &BlurredPlane,
    taps: &[f32],
    y: usize,
    columns: std::ops::Range<usize>,
    target: &mut [f32],
) {
    let row_start = |row: usize| row.min(source.height - 1) * source.stride;
    let mut x = columns.start;
    while x < columns.end {
        let above = |distance: usize| row_start(y.saturating_sub(distance)) + x;
        let below = |distance: usize| row_start(y + distance) + x;
        if x + 4 * L::COUNT <= columns.end {
            convolve::<L, 4>(&source.data, taps, above, below, target, x);
            x += 4 * L::COUNT;
        } else {
            convolve::<L, 1>(&source.data, taps, above, below, target, x);
            x += L::COUNT;
        }
    }
}

/// A row convolved along itself; `line` has `margin` samples before and after it.
#[inline(always)]
fn blur_row<L: Lanes>(line: &[f32], margin: usize, taps: &[f32], target: &mut [f32]) {
    let mut x = 0;
    while x < target.len() {
        let before = |distance: usize| margin + x - distance;
        let after = |distance: usize| margin + x + distance;
        if x + 4 * L::COUNT <= target.len() {
            convolve::<L, 4>(line, taps, before, after, target, x);
            x += 4 * L::COUNT;
        } else {
            convolve::<L, 1>(line, taps, before, after, target, x);
            x += L::COUNT;
        }
    }
}

/// `N` vectors of a convolution with a symmetric kernel, stored at `target[at]`; `before` and `after` say where the
/// samples at a distance begin in `source`.
#[inline(always)]
fn convolve<L: Lanes, const N: usize>(
    source: &[f32],
    taps: &[f32],
    before: impl Fn(usize) -> usize,
    after: impl Fn(usize) -> usize,
    target: &mut [f32],
    at: usize,
) {
    let center_tap = L::splat(taps[0]);
    let center = &source[before(0)..before(0) + N * L::COUNT];
    let mut sums: [L; N] = std::array::from_fn(|n| L::load(center, n * L::COUNT) * center_tap);
    for (distance, &tap) in taps.iter().enumerate().skip(1) {
        let tap = L::splat(tap);
        let first = &source[before(distance)..before(distance) + N * L::COUNT];
        let second = &source[after(distance)..after(distance) + N * L::COUNT];
        for (n, sum) in sums.iter_mut().enumerate() {
            *sum = *sum + tap * (L::load(first, n * L::COUNT) + L::load(second, n * L::COUNT));
        }
    }
    for (n, sum) in sums.into_iter().enumerate() {
        sum.store(target, at + n * L::COUNT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_sum_to_one_and_have_the_variance_asked_for() {
        for sigma in [0.6, 1.2, 2.0, 3.1] {
            let taps = gaussian_taps(sigma);
            let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f32>();
            let variance: f64 = taps.iter().enumerate().map(|(x, &tap)| 2.0 * (x * x) as f64 * f64::from(tap)).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            assert!((variance.sqrt() / sigma - 1.0).abs() < 1e-3, "{sigma}: {}", variance.sqrt());
        }
        assert_eq!(gaussian_taps(0.0), [1.0]);
    }

    #[test]
    fn a_constant_stays_constant_and_a_ramp_stays_a_ramp_inside() {
        let mut plane = BlurredPlane::new(70, 50);
        let stride = plane.stride;
        for y in 0..50 {
            for x in 0..70 {
                plane.data[y * stride + x] = 2.0 * x as f32 + y as f32;
            }
        }
        let smooth = blurred(&plane, 2.0, InstructionSet::detect());
        for (x, y) in [(20, 20), (45, 30), (60, 10)] {
            assert!((smooth.row(y)[x] - plane.row(y)[x]).abs() < 1e-3);
        }
    }
}
