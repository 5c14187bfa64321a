//! One overlap seen through its pixels: samples and their equations.

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use trueup_core::mesh::GridMesh;

use super::super::normal_equations::{Metric, WeightedVertex};
use super::colors::Colors;
use super::pyramid::{Gray, GrayPyramid};
use super::sample::PixelSample;
use crate::evidence::CommonSum;
use crate::match_points::OverlapWarp;

/// Vertices of one cell in each photograph.
const MEMBERS: usize = 8;
/// Unordered couplings of them.
const COUPLINGS: usize = MEMBERS * (MEMBERS + 1) / 2;
/// Half the width of a Tukey weight, in standard deviations: 95 % efficient for a Gaussian.
const TUKEY: f64 = 4.685;
/// Standard deviation of a Gaussian per median absolute deviation.
const SIGMA_PER_MAD: f64 = 1.4826;

/// Distance of the samples in the finest photographs, working px; twice as far in each coarser one. Edges are two to three
/// pixels wide: at 4 px many are passed over, and NCC MSE is 1 % higher on four of five sets.
const SPACING_PX: f64 = 3.0;
/// The distance that the option `photometric.weight` belongs to.
const WEIGHED_SPACING_PX: f64 = 4.0;
/// Samples with a smaller change of gray in both photographs are passed over, gray levels per working px.
const MIN_GRADIENT: f64 = 2.0;
/// Overlaps with fewer samples are left as they are.
const MIN_SAMPLES: usize = 50;
/// Smaller standard deviations of the difference are not believed, gray levels: rounding and compression differ from
/// place to place.
const LEAST_NOISE: f64 = 3.0;

/// One direction of a pair: the photograph whose pixels are sampled, and the one they are looked up in.
pub(super) struct PhotometricOverlap<'a> {
    pub warp: &'a OverlapWarp,
    /// The solved grids, whose vertices are unknown.
    pub solved: [&'a GridMesh; 2],
    /// The same, subdivided along the base.
    pub fine: [&'a GridMesh; 2],
    pub pyramids: [&'a GrayPyramid; 2],
}

/// All samples of an overlap with what they differ by.
struct Compared {
    samples: Vec<PixelSample>,
    colors: Colors,
    residuals: Vec<f64>,
    /// Their standard deviation, robustly, and the weights that follow.
    sigma: f64,
    weights: Vec<f64>,
}

/// The equations of all samples in one cell of each photograph.
pub(super) struct CellPair {
    pub members: [WeightedVertex; MEMBERS],
    pub metrics: [Metric; COUPLINGS],
    pub right: [Vector2<f64>; MEMBERS],
}

/// What one overlap says in one round.
pub(super) struct OverlapEquations {
    pub cells: Vec<CellPair>,
    /// Sum over the samples of |residual| that the robust weight lets count, and of those weights.
    pub misfit: [f64; 2],
}

impl PhotometricOverlap<'_> {
    /// The linearized photometric equations around the current grids, at a level of the pyramids. `weight` is that of a
    /// squared difference of gray levels in this overlap, for samples of the finest level and the usual noise.
    pub(super) fn equations(&self, level: usize, weight: f64) -> OverlapEquations {
        /// Standard deviation of the difference that the weight belongs to, gray levels: overlaps that agree better
        /// weigh more.
        const USUAL_NOISE: f64 = 10.0;
        let Some(Compared { samples, colors, residuals, sigma, weights }) = self.compared(level) else {
            return OverlapEquations { cells: Vec::new(), misfit: [0.0; 2] };
        };
        let noise = (USUAL_NOISE / sigma.max(LEAST_NOISE)).powi(2);
        let weight = weight * noise * (spacing_px(level) / WEIGHED_SPACING_PX).powi(2);
        let mut order: Vec<usize> = (0..samples.len()).filter(|&k| weights[k] > 0.0).collect();
        let cells_of = |k: usize| (samples[k].corners[0][0], samples[k].corners[1][0]);
        order.sort_by_key(|&k| cells_of(k));
        let groups: Vec<&[usize]> = order.chunk_by(|&one, &other| cells_of(one) == cells_of(other)).collect();
        let photographs = [self.warp.from, self.warp.to];
        let cells = groups
            .into_iter()
            .map(|group| {
                let mut cells = CellPair::empty(photographs, &samples[group[0]]);
                for &k in group {
                    let gain = colors.of_sample(&samples[k]).gain;
                    cells.add(&samples[k], gain, residuals[k], weight * weights[k]);
                }
                cells
            })
            .collect();
        let misfit = residuals
            .iter()
            .zip(&weights)
            .fold([0.0; 2], |[sum, count], (residual, weight)| [sum + weight * residual.abs(), count + weight]);
        OverlapEquations { cells, misfit }
    }

    fn compared(&self, level: usize) -> Option<Compared> {
        let samples = self.samples(level);
        if samples.len() < MIN_SAMPLES {
            return None;
        }
        let colors = Colors::of(&samples, self.solved[0]);
        let residuals: Vec<f64> = samples.iter().map(|sample| colors.residual(sample)).collect();
        let sigma = spread(&residuals);
        let weights = residuals.iter().map(|residual| tukey_weight(residual / sigma)).collect();
        Some(Compared { samples, colors, residuals, sigma, weights })
    }

    /// Square, per axis, of the misalignment that the pixels of neighboring cells have in common, at a level.
    pub(super) fn common_square(&self, level: usize) -> f64 {
        let Some(compared) = self.compared(level) else { return 0.0 };
        let grid = self.solved[0];
        let per_sample = compared.sigma.max(LEAST_NOISE).powi(-2);
        let mut cells = vec![(Matrix2::zeros(), Vector2::zeros()); grid.len()];
        for ((sample, residual), weight) in compared.samples.iter().zip(&compared.residuals).zip(&compared.weights) {
            let slope = sample.mean_slope(compared.colors.of_sample(sample).gain);
            let (information, pull) = &mut cells[sample.corners[0][0] as usize];
            *information += slope * slope.transpose() * (weight * per_sample);
            *pull -= slope * (residual * weight * per_sample);
        }
        // Each cell's own displacement, drawn to none with the weight of the mesh's match points, and what share of a
        // true one it has.
        let own: Vec<Option<(Vector2<f64>, Matrix2<f64>)>> = cells
            .iter()
            .map(|(information, pull)| {
                let inverse = (information + Matrix2::identity()).try_inverse()?;
                Some((inverse * pull, inverse * information))
            })
            .collect();
        let (mut sum, mut squares) = (CommonSum::default(), 0.0);
        for vertex in 0..grid.len() {
            let right = Some(vertex + 1).filter(|next| next % grid.columns != 0);
            for neighbor in [right, Some(vertex + grid.columns)].into_iter().flatten() {
                if let (Some((one, seen)), Some(Some((other, seen_there)))) = (own[vertex], own.get(neighbor)) {
                    sum.products += one.dot(other);
                    squares += one.dot(other).powi(2);
                    sum.units += (seen * seen_there.transpose()).trace();
                }
            }
        }
        // Less the standard error that the sum has if cells have nothing in common.
        CommonSum { products: sum.products - squares.sqrt(), ..sum }.mean_square()
    }

    fn samples(&self, level: usize) -> Vec<PixelSample> {
        let spacing = spacing_px(level);
        let (columns, rows) = (self.solved[0].width / spacing, self.solved[0].height / spacing);
        (0..rows as usize)
            .into_par_iter()
            .flat_map_iter(|row| {
                (0..columns as usize).filter_map(move |column| {
                    let point = Vector2::new((column as f64 + 0.5) * spacing, (row as f64 + 0.5) * spacing);
                    self.sample(point, level)
                })
            })
            .collect()
    }

    fn sample(&self, point: Vector2<f64>, level: usize) -> Option<PixelSample> {
        let (corners_here, shares_here) = self.solved[0].bilinear(point);
        let start = self.warp.at(self.solved[0], point)?;
        let there = self.fine[1].source_of(self.fine[0].warp(point), start)?;
        let here_gray = self.pyramids[0].at(level, point)?;
        let there_gray = self.pyramids[1].at(level, there)?;
        if here_gray.slope.norm().max(there_gray.slope.norm()) < MIN_GRADIENT {
            return None;
        }
        let (corners_there, shares_there) = self.solved[1].bilinear(there);
        let gray = [
            on_panorama(here_gray, &self.fine[0].derivative(point))?,
            on_panorama(there_gray, &self.fine[1].derivative(there))?,
        ];
        Some(PixelSample {
            corners: [corners_here, corners_there].map(|corners| corners.map(|corner| corner as u32)),
            shares: [shares_here, shares_there],
            gray,
            gap: self.solved[0].warp(point) - self.solved[1].warp(there),
        })
    }
}

/// Distance of samples at a level: twice as far at the next.
fn spacing_px(level: usize) -> f64 {
    SPACING_PX * 2.0_f64.powi(level as i32)
}

/// The gray value with its slope per panorama unit.
fn on_panorama(gray: Gray, derivative: &Matrix2<f64>) -> Option<Gray> {
    Some(Gray { slope: derivative.try_inverse()?.transpose() * gray.slope, ..gray })
}

/// Standard deviation of residuals, gray levels, of which less than half are outliers.
fn spread(residuals: &[f64]) -> f64 {
    /// Least standard deviation: that of rounding both photographs.
    const ROUNDING: f64 = 0.5;
    let mut sizes: Vec<f64> = residuals.iter().map(|residual| residual.abs()).collect();
    let middle = sizes.len() / 2;
    (SIGMA_PER_MAD * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1).max(ROUNDING)
}

/// Tukey's biweight of a residual in standard deviations.
fn tukey_weight(residual: f64) -> f64 {
    let share = residual / TUKEY;
    if share.abs() < 1.0 { (1.0 - share * share).powi(2) } else { 0.0 }
}

impl CellPair {
    fn empty(photographs: [usize; 2], sample: &PixelSample) -> Self {
        let members = std::array::from_fn(|k| WeightedVertex {
            photograph: photographs[k / 4],
            vertex: sample.corners[k / 4][k % 4] as usize,
            weight: 1.0,
        });
        Self { members, metrics: [Metric::default(); COUPLINGS], right: [Vector2::zeros(); MEMBERS] }
    }

    /// Adds weight (residual + slope . (change of the first place - change of the second))^2.
    ///
    /// The slope is the mean of both photographs': with it a step errs in the third order of the misalignment, with one
    /// photograph's alone in the second.
    fn add(&mut self, sample: &PixelSample, gain: f64, residual: f64, weight: f64) {
        let slope = sample.mean_slope(gain);
        let metric = Metric::along(slope, weight);
        let value = slope.dot(&sample.gap) - residual;
        let shares: [f64; MEMBERS] = std::array::from_fn(|k| {
            let share = sample.shares[k / 4][k % 4];
            if k < 4 { share } else { -share }
        });
        let mut coupling = 0;
        for (k, &share) in shares.iter().enumerate() {
            self.right[k] += slope * (weight * value * share);
            for &other in &shares[..=k] {
                let product = share * other;
                let sum = &mut self.metrics[coupling];
                sum.xx += product * metric.xx;
                sum.xy += product * metric.xy;
                sum.yy += product * metric.yy;
                coupling += 1;
            }
        }
    }
}
