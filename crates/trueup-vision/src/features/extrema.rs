//! Extrema of the difference of Gaussians, located between the samples.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::{Result, StageContext};

use super::options::FeatureOptions;
use super::scale_space::{BASE_SIGMA, LEVELS_PER_OCTAVE, Octave};
use super::simd::{InstructionSet, Lanes, MAX_LANES, VectorKernel};

/// Largest ratio of the two principal curvatures of a point; above it, it lies on an edge (Lowe 2004, section 4.1).
const MAX_CURVATURE_RATIO: f64 = 10.0;

/// Responses below this many gray levels are rounding errors of a flat photograph.
const ROUNDING_NOISE: f32 = 1e-3;

/// A sample may fall this much short of the peak threshold, because the interpolated peak is higher.
const LOOSE_FACTOR: f32 = 0.5;

/// How often an extremum may move to a neighboring sample before it is given up.
const MAX_MOVES: usize = 5;

/// A move is made when the extremum lies farther than this from the sample, in samples.
const MOVE_OFFSET: f64 = 0.6;

/// Rows that one task scans.
const BAND_ROWS: usize = 64;

/// An extremum of the difference of Gaussians.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extremum {
    /// Index of its octave.
    pub(super) octave: usize,
    /// Index of the difference's lower plane, 1 to [`LEVELS_PER_OCTAVE`].
    pub(super) level: usize,
    /// The nearest sample (column, row).
    pub(super) sample: [usize; 2],
    /// Position (x, y) in the octave's samples; a whole number lies on a sample.
    pub(super) position: [f64; 2],
    /// Blur in the octave's samples.
    pub(super) sigma: f64,
    /// Interpolated difference of Gaussians, in gray levels; positive for dark blobs.
    pub(super) response: f64,
}

/// All extrema of one octave that pass the peak and edge thresholds, row by row.
///
/// # Source
/// Lowe 2004, sections 3.1 and 4: 26 neighbors, quadratic fit in position and scale, ratio of principal curvatures.
///
/// # Departures
/// The place is then fitted once more, in the plane interpolated to the extremum's scale.
pub(super) fn find(
    octaves: &[Octave],
    octave: usize,
    options: &FeatureOptions,
    instructions: InstructionSet,
    context: &StageContext,
) -> Result<Vec<Extremum>> {
    let planes = &octaves[octave].planes;
    let (width, height) = (planes[0].width, planes[0].height);
    if width < 3 || height < 3 {
        return Ok(Vec::new());
    }
    let bands = (height - 2).div_ceil(BAND_ROWS);
    let found: Result<Vec<Vec<Extremum>>> = (0..bands)
        .into_par_iter()
        .map(|band| {
            context.check_cancelled()?;
            let first_row = 1 + band * BAND_ROWS;
            let rows = first_row..(first_row + BAND_ROWS).min(height - 1);
            let threshold = ROUNDING_NOISE.max(LOOSE_FACTOR * options.peak_threshold as f32);
            let candidates = instructions.run(ScanBand { octave: &octaves[octave], rows, threshold });
            Ok(candidates.iter().filter_map(|candidate| refine(octaves, octave, candidate, options)).collect())
        })
        .collect();
    let mut extrema: Vec<Extremum> = found?.into_iter().flatten().collect();
    // Two samples may move to the same extremum.
    extrema.sort_by_key(|extremum| (extremum.sample[1], extremum.sample[0], extremum.level));
    extrema.dedup_by_key(|extremum| (extremum.sample[1], extremum.sample[0], extremum.level));
    Ok(extrema)
}

/// A sample that is the greatest or least of its 27 neighbors.
struct Candidate {
    level: usize,
    x: usize,
    y: usize,
}

/// Finds the candidates of some rows, in all levels of an octave.
struct ScanBand<'a> {
    octave: &'a Octave,
    rows: std::ops::Range<usize>,
    /// Smallest absolute difference, in gray levels.
    threshold: f32,
}

impl VectorKernel for ScanBand<'_> {
    type Output = Vec<Candidate>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<Candidate> {
        let planes = &self.octave.planes;
        let stride = planes[0].stride;
        let padded = stride + 2 * MAX_LANES;
        let differences = planes.len() - 1;
        let mut found = Vec::new();
        // The differences of the last three rows; row y is kept in slot y % 3.
        let mut recent = vec![0.0_f32; 3 * differences * padded];
        // For each level between the outer ones, the greatest and the least of 3 levels x 3 rows.
        let mut extremes = vec![0.0_f32; 2 * (differences - 2) * padded];
        for y in [self.rows.start - 1, self.rows.start] {
            subtract_row::<L>(self.octave, y, padded, &mut recent);
        }
        for y in self.rows.clone() {
            subtract_row::<L>(self.octave, y + 1, padded, &mut recent);
            column_extremes::<L>(&recent, differences, padded, &mut extremes);
            for level in 1..differences - 1 {
                let slot = ((y % 3) * differences + level) * padded;
                let center = &recent[slot..slot + padded];
                let (greatest, least) = extremes[2 * (level - 1) * padded..][..2 * padded].split_at(padded);
                compare_row::<L>(center, greatest, least, self.threshold, planes[0].width, |x| {
                    found.push(Candidate { level, x, y });
                });
            }
        }
        found
    }
}

/// Writes row `y` of all differences into its slot, [`MAX_LANES`] samples from the slot's beginning.
#[inline(always)]
fn subtract_row<L: Lanes>(octave: &Octave, y: usize, padded: usize, recent: &mut [f32]) {
    let differences = octave.planes.len() - 1;
    let stride = octave.planes[0].stride;
    for level in 0..differences {
        let lower = &octave.planes[level].data[y * stride..(y + 1) * stride];
        let upper = &octave.planes[level + 1].data[y * stride..(y + 1) * stride];
        let target = &mut recent[((y % 3) * differences + level) * padded + MAX_LANES..][..stride];
        for x in (0..stride).step_by(L::COUNT) {
            (L::load(upper, x) - L::load(lower, x)).store(target, x);
        }
    }
}

/// The greatest and least over three rows and three neighboring levels, column by column.
#[inline(always)]
fn column_extremes<L: Lanes>(recent: &[f32], differences: usize, padded: usize, extremes: &mut [f32]) {
    let row_stride = differences * padded;
    for x in (0..padded).step_by(L::COUNT) {
        let mut below = row_extremes::<L>(recent, x, row_stride);
        let mut here = row_extremes::<L>(recent, padded + x, row_stride);
        for level in 1..differences - 1 {
            let above = row_extremes::<L>(recent, (level + 1) * padded + x, row_stride);
            let at = 2 * (level - 1) * padded + x;
            below.0.max(here.0).max(above.0).store(extremes, at);
            below.1.min(here.1).min(above.1).store(extremes, at + padded);
            (below, here) = (here, above);
        }
    }
}

/// The greatest and least of three rows that lie `row_stride` samples apart, from sample `at` of the first one on.
///
/// A function, since a closure may be compiled by itself, without the vector instructions, and each of its operations
/// is a call then.
#[inline(always)]
fn row_extremes<L: Lanes>(recent: &[f32], at: usize, row_stride: usize) -> (L, L) {
    let first = L::load(recent, at);
    let second = L::load(recent, at + row_stride);
    let third = L::load(recent, at + 2 * row_stride);
    (first.max(second).max(third), first.min(second).min(third))
}

/// Calls `found` with the columns, border excluded, where the center is as great or as small as all its neighbors.
#[inline(always)]
fn compare_row<L: Lanes>(
    center: &[f32],
    greatest: &[f32],
    least: &[f32],
    threshold: f32,
    width: usize,
    mut found: impl FnMut(usize),
) {
    let (positive, negative) = (L::splat(threshold), L::splat(-threshold));
    for x in (0..width).step_by(L::COUNT) {
        let at = MAX_LANES + x;
        let value = L::load(center, at);
        let (bright, dark) = (value.at_least(positive), negative.at_least(value));
        if bright | dark == 0 {
            continue;
        }
        let high = L::load(greatest, at - 1).max(L::load(greatest, at)).max(L::load(greatest, at + 1));
        let low = L::load(least, at - 1).min(L::load(least, at)).min(L::load(least, at + 1));
        let mut mask = (bright & value.at_least(high)) | (dark & low.at_least(value));
        while mask != 0 {
            let column = x + mask.trailing_zeros() as usize;
            mask &= mask - 1;
            if column >= 1 && column + 1 < width {
                found(column);
            }
        }
    }
}

/// Fits a quadratic to the 27 samples around a candidate and applies the thresholds.
fn refine(octaves: &[Octave], octave: usize, candidate: &Candidate, options: &FeatureOptions) -> Option<Extremum> {
    let planes = &octaves[octave].planes;
    let (mut level, mut x, mut y) = (candidate.level, candidate.x, candidate.y);
    for _ in 0..=MAX_MOVES {
        let fit = Quadratic::around(&octaves[octave], level, x, y);
        let offset = fit.extremum()?;
        let moves =
            offset.map(|component| f64::from(i8::from(component > MOVE_OFFSET) - i8::from(component < -MOVE_OFFSET)));
        let moved = |index: usize, step: f64, last: usize| -> Option<usize> {
            let index = index.checked_add_signed(step as isize)?;
            (index >= 1 && index <= last).then_some(index)
        };
        if moves == Vector3::zeros() {
            let (place, response) = fit.extremum_at(offset[2])?;
            let accepted = response.abs() >= options.peak_threshold.max(f64::from(ROUNDING_NOISE))
                && !fit.is_edge(MAX_CURVATURE_RATIO);
            return accepted.then(|| Extremum {
                octave,
                level,
                sample: [x, y],
                position: [x as f64 + place[0], y as f64 + place[1]],
                sigma: BASE_SIGMA * ((level as f64 + offset[2]) / LEVELS_PER_OCTAVE as f64).exp2(),
                response,
            });
        }
        x = moved(x, moves[0], planes[0].width - 2)?;
        y = moved(y, moves[1], planes[0].height - 2)?;
        level = moved(level, moves[2], LEVELS_PER_OCTAVE)?;
    }
    None
}

/// Second-order Taylor expansion of the difference of Gaussians in (x, y, level).
struct Quadratic {
    /// The 27 differences of Gaussians by level, row and column.
    samples: [[[f64; 3]; 3]; 3],
    gradient: Vector3<f64>,
    hessian: Matrix3<f64>,
}

impl Quadratic {
    fn around(octave: &Octave, level: usize, x: usize, y: usize) -> Self {
        let stride = octave.planes[0].stride;
        let d: [[[f64; 3]; 3]; 3] = std::array::from_fn(|dl| {
            let (lower, upper) = (&octave.planes[level + dl - 1].data, &octave.planes[level + dl].data);
            std::array::from_fn(|dy| {
                let start = (y + dy - 1) * stride + x - 1;
                let (lower, upper) = (&lower[start..start + 3], &upper[start..start + 3]);
                std::array::from_fn(|dx| f64::from(upper[dx] - lower[dx]))
            })
        });
        let value = d[1][1][1];
        let gradient = 0.5 * Vector3::new(d[1][1][2] - d[1][1][0], d[1][2][1] - d[1][0][1], d[2][1][1] - d[0][1][1]);
        let xx = d[1][1][2] + d[1][1][0] - 2.0 * value;
        let yy = d[1][2][1] + d[1][0][1] - 2.0 * value;
        let ss = d[2][1][1] + d[0][1][1] - 2.0 * value;
        let xy = 0.25 * (d[1][2][2] - d[1][2][0] - d[1][0][2] + d[1][0][0]);
        let xs = 0.25 * (d[2][1][2] - d[2][1][0] - d[0][1][2] + d[0][1][0]);
        let ys = 0.25 * (d[2][2][1] - d[2][0][1] - d[0][2][1] + d[0][0][1]);
        Self { samples: d, gradient, hessian: Matrix3::new(xx, xy, xs, xy, yy, ys, xs, ys, ss) }
    }

    /// Offset (x, y, level) of the extremum from the sample; `None` where there is none.
    fn extremum(&self) -> Option<Vector3<f64>> {
        let offset = -self.hessian.try_inverse()? * self.gradient;
        offset.iter().all(|component| component.is_finite()).then_some(offset)
    }

    /// Offset (x, y) and value of the extremum in the plane that a parabola through the three levels gives at `level`,
    /// an offset from the middle one; `None` where there is none.
    ///
    /// The curvature changes with scale, which the quadratic in (x, y, level) leaves out: between two levels it misses
    /// the place by up to a seventh of the offset.
    fn extremum_at(&self, level: f64) -> Option<(Vector2<f64>, f64)> {
        let weights = [0.5 * level * (level - 1.0), 1.0 - level * level, 0.5 * level * (level + 1.0)];
        let p: [[f64; 3]; 3] = std::array::from_fn(|y| {
            std::array::from_fn(|x| (0..3).map(|level| weights[level] * self.samples[level][y][x]).sum())
        });
        let gradient = 0.5 * Vector2::new(p[1][2] - p[1][0], p[2][1] - p[0][1]);
        let xy = 0.25 * (p[2][2] - p[2][0] - p[0][2] + p[0][0]);
        let hessian = Matrix2::new(p[1][2] + p[1][0] - 2.0 * p[1][1], xy, xy, p[2][1] + p[0][1] - 2.0 * p[1][1]);
        let offset = -hessian.try_inverse()? * gradient;
        let value = p[1][1] + 0.5 * gradient.dot(&offset);
        (offset.amax() < 1.0 && value.is_finite()).then_some((offset, value))
    }

    /// Whether one principal curvature exceeds `ratio` times the other, or they differ in sign.
    fn is_edge(&self, ratio: f64) -> bool {
        let trace = self.hessian[(0, 0)] + self.hessian[(1, 1)];
        let determinant = self.hessian[(0, 0)] * self.hessian[(1, 1)] - self.hessian[(0, 1)].powi(2);
        !(determinant > 0.0 && trace.powi(2) * ratio < (ratio + 1.0).powi(2) * determinant)
    }
}
