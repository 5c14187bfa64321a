//! One overlap seen through its pixels: samples, the color model between the two pictures, and their equations.

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use trueup_core::mesh::GridMesh;

use super::super::evidence::quotient;
use super::super::normal_equations::{Metric, Share};
use super::PhotometricOptions;
use super::pyramid::{Gray, Pyramid};
use crate::match_points::OverlapWarp;

/// Vertices of one cell in each picture.
pub(super) const MEMBERS: usize = 8;
/// Unordered couplings of them.
const COUPLINGS: usize = MEMBERS * (MEMBERS + 1) / 2;
/// Half the width of a Tukey weight, in standard deviations: 95 % efficient for a Gaussian.
const TUKEY: f64 = 4.685;
/// Standard deviation of a Gaussian per median absolute deviation.
const SIGMA_PER_MAD: f64 = 1.4826;

/// One direction of a pair: the picture whose pixels are sampled, and the one they are looked up in.
pub(super) struct Overlap<'a> {
    pub warp: &'a OverlapWarp,
    /// The solved grids, whose vertices are unknown.
    pub solved: [&'a GridMesh; 2],
    /// The same, subdivided along the base.
    pub fine: [&'a GridMesh; 2],
    pub pyramids: [&'a Pyramid; 2],
}

/// A pixel of the first picture and what lies on it in the panorama.
struct Sample {
    corners: [[u32; 4]; 2],
    shares: [[f64; 4]; 2],
    /// Gray values; their slopes are per panorama unit.
    gray: [Gray; 2],
    /// Bilinear place by the solved vertices in the first picture minus that in the second: what the bases' sags differ by.
    gap: Vector2<f64>,
}

/// All samples of an overlap with what they differ by.
struct Compared {
    samples: Vec<Sample>,
    colors: Colors,
    residuals: Vec<f64>,
    /// Their standard deviation, robustly, and the weights that follow.
    sigma: f64,
    weights: Vec<f64>,
}

/// The second picture's gray values as the first would show them: gain times value plus bias.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Color {
    gain: f64,
    bias: f64,
}

/// The equations of all samples in one cell of each picture.
pub(super) struct CellPair {
    pub members: [Share; MEMBERS],
    pub metrics: [Metric; COUPLINGS],
    pub right: [Vector2<f64>; MEMBERS],
}

/// What one overlap says in one round.
pub(super) struct OverlapEquations {
    pub cells: Vec<CellPair>,
    /// Sum over the samples of |residual| that the robust weight lets count, and of those weights.
    pub misfit: [f64; 2],
}

impl Overlap<'_> {
    /// The linearized photometric equations around the present grids, at a level of the pyramids.
    /// `share` of its weight is what the overlap has.
    pub fn equations(&self, level: usize, share: f64, options: &PhotometricOptions) -> OverlapEquations {
        let Some(Compared { samples, colors, residuals, sigma, weights }) = self.compared(level, options) else {
            return OverlapEquations { cells: Vec::new(), misfit: [0.0; 2] };
        };
        let noise = (options.noise_level / sigma.max(options.least_noise)).powi(2);
        let share = share * options.weight * noise * (spacing_px(level, options) / super::PUBLISHED_SPACING_PX).powi(2);
        let mut order: Vec<usize> = (0..samples.len()).filter(|&k| weights[k] > 0.0).collect();
        let cells_of = |k: usize| (samples[k].corners[0][0], samples[k].corners[1][0]);
        order.sort_by_key(|&k| cells_of(k));
        let groups: Vec<&[usize]> = order.chunk_by(|&one, &other| cells_of(one) == cells_of(other)).collect();
        let pictures = [self.warp.from, self.warp.to];
        let cells = groups
            .into_iter()
            .map(|group| {
                let mut cells = CellPair::empty(pictures, &samples[group[0]]);
                for &k in group {
                    let gain = colors.of_sample(&samples[k]).gain;
                    cells.add(&samples[k], gain, residuals[k], share * weights[k]);
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

    fn compared(&self, level: usize, options: &PhotometricOptions) -> Option<Compared> {
        let samples = self.samples(level, options);
        if samples.len() < options.min_samples {
            return None;
        }
        let colors = Colors::of(&samples, self.solved[0], options);
        let residuals: Vec<f64> = samples.iter().map(|sample| colors.residual(sample)).collect();
        let sigma = spread(&residuals);
        let weights = residuals.iter().map(|residual| tukey_weight(residual / sigma)).collect();
        Some(Compared { samples, colors, residuals, sigma, weights })
    }

    /// Square, per axis, of the misalignment that the pixels of neighboring cells have in common, at a level.
    pub fn common_square(&self, level: usize, options: &PhotometricOptions) -> f64 {
        let Some(compared) = self.compared(level, options) else { return 0.0 };
        let grid = self.solved[0];
        let per_sample = compared.sigma.max(options.least_noise).powi(-2);
        let mut cells = vec![(Matrix2::zeros(), Vector2::zeros()); grid.len()];
        for ((sample, residual), weight) in compared.samples.iter().zip(&compared.residuals).zip(&compared.weights) {
            let slope = sample.mean_slope(compared.colors.of_sample(sample).gain);
            let (information, pull) = &mut cells[sample.corners[0][0] as usize];
            *information += slope * slope.transpose() * (weight * per_sample);
            *pull -= slope * (residual * weight * per_sample);
        }
        // Each cell's own displacement, drawn to none with the weight of the mesh's match points, and what share of a true
        // one it has.
        let own: Vec<Option<(Vector2<f64>, Matrix2<f64>)>> = cells
            .iter()
            .map(|(information, pull)| {
                let inverse = (information + Matrix2::identity()).try_inverse()?;
                Some((inverse * pull, inverse * information))
            })
            .collect();
        let (mut sum, mut squares) = ([0.0; 2], 0.0);
        for vertex in 0..grid.len() {
            let right = Some(vertex + 1).filter(|next| next % grid.columns != 0);
            for neighbor in [right, Some(vertex + grid.columns)].into_iter().flatten() {
                if let (Some((one, seen)), Some(Some((other, seen_there)))) = (own[vertex], own.get(neighbor)) {
                    sum[0] += one.dot(other);
                    squares += one.dot(other).powi(2);
                    sum[1] += (seen * seen_there.transpose()).trace();
                }
            }
        }
        // Less the standard error that the sum has if cells have nothing in common.
        quotient([sum[0] - squares.sqrt(), sum[1]])
    }

    fn samples(&self, level: usize, options: &PhotometricOptions) -> Vec<Sample> {
        let spacing = spacing_px(level, options);
        let (columns, rows) = (self.solved[0].width / spacing, self.solved[0].height / spacing);
        (0..rows as usize)
            .into_par_iter()
            .flat_map_iter(|row| {
                (0..columns as usize).filter_map(move |column| {
                    let point = Vector2::new((column as f64 + 0.5) * spacing, (row as f64 + 0.5) * spacing);
                    self.sample(point, level, options.min_gradient)
                })
            })
            .collect()
    }

    fn sample(&self, point: Vector2<f64>, level: usize, min_gradient: f64) -> Option<Sample> {
        let (corners_here, shares_here) = self.solved[0].bilinear(point);
        let start = self.warp.at(self.solved[0], point)?;
        let there = self.fine[1].source_of(self.fine[0].warp(point), start)?;
        let here_gray = self.pyramids[0].at(level, point)?;
        let there_gray = self.pyramids[1].at(level, there)?;
        if here_gray.slope.norm().max(there_gray.slope.norm()) < min_gradient {
            return None;
        }
        let (corners_there, shares_there) = self.solved[1].bilinear(there);
        let gray = [
            on_panorama(here_gray, &self.fine[0].derivative(point))?,
            on_panorama(there_gray, &self.fine[1].derivative(there))?,
        ];
        Some(Sample {
            corners: [corners_here, corners_there].map(|corners| corners.map(|corner| corner as u32)),
            shares: [shares_here, shares_there],
            gray,
            gap: self.solved[0].warp(point) - self.solved[1].warp(there),
        })
    }
}

impl Sample {
    /// Mean of both pictures' slopes, the second's as the first would show it with a gain.
    fn mean_slope(&self, gain: f64) -> Vector2<f64> {
        0.5 * (gain * self.gray[1].slope + self.gray[0].slope)
    }
}

/// Distance of samples at a level: twice as far at the next.
fn spacing_px(level: usize, options: &PhotometricOptions) -> f64 {
    options.spacing_px * 2.0_f64.powi(level as i32)
}

/// The gray value with its slope per panorama unit.
fn on_panorama(gray: Gray, derivative: &Matrix2<f64>) -> Option<Gray> {
    Some(Gray { slope: derivative.try_inverse()?.transpose() * gray.slope, ..gray })
}

/// Standard deviation of residuals, gray levels, of which less than half are outliers.
fn spread(residuals: &[f64]) -> f64 {
    /// Least standard deviation: that of rounding both pictures.
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

/// A color model for every cell of the first picture.
struct Colors {
    overall: Color,
    /// By the cell's first vertex.
    cells: Vec<Option<Color>>,
}

/// Sums from which a color model follows.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    sums: [f64; 2],
    squares: [f64; 2],
}

impl Moments {
    fn add(&mut self, sample: &Sample) {
        self.count += 1.0;
        for side in 0..2 {
            self.sums[side] += sample.gray[side].value;
            self.squares[side] += sample.gray[side].value.powi(2);
        }
    }

    /// Sums of squared deviations from the mean.
    fn deviations(&self) -> [f64; 2] {
        [0, 1].map(|side| (self.squares[side] - self.sums[side].powi(2) / self.count.max(1.0)).max(0.0))
    }
}

impl Colors {
    /// # Departures
    /// The gain is the quotient of the standard deviations. The least-squares gain of one picture on the other shrinks
    /// while the pictures are not yet aligned, and would explain the misalignment as lack of contrast.
    fn of(samples: &[Sample], grid: &GridMesh, options: &PhotometricOptions) -> Self {
        let mut all = Moments::default();
        let mut cells = vec![Moments::default(); grid.len()];
        for sample in samples {
            all.add(sample);
            cells[sample.corners[0][0] as usize].add(sample);
        }
        let [here, there] = all.deviations();
        let gain = if here > 0.0 && there > 0.0 { (here / there).sqrt() } else { 1.0 };
        let gain = gain.clamp(1.0 / options.max_gain, options.max_gain);
        let overall = Color { gain, bias: (all.sums[0] - gain * all.sums[1]) / all.count.max(1.0) };
        let variance = there / all.count.max(1.0);
        let cells = cells
            .iter()
            .map(|cell| {
                let [here, there] = cell.deviations();
                let ridge = options.color_ridge;
                let drawn = (here + ridge * gain * gain * variance) / (there + ridge * variance);
                let gain = if drawn.is_finite() && drawn > 0.0 { drawn.sqrt() } else { gain };
                let gain = gain.clamp(1.0 / options.max_gain, options.max_gain);
                let count = cell.count + ridge;
                // What the ridge contributes is the overall model at the overlap's mean gray value.
                let mean = all.sums[1] / all.count.max(1.0);
                let wanted = ridge * (overall.bias + (overall.gain - gain) * mean);
                let bias = (cell.sums[0] - gain * cell.sums[1] + wanted) / count;
                (cell.count > 0.0 && count > 0.0).then_some(Color { gain, bias })
            })
            .collect();
        Self { overall, cells }
    }

    fn of_sample(&self, sample: &Sample) -> Color {
        self.cells[sample.corners[0][0] as usize].unwrap_or(self.overall)
    }

    fn residual(&self, sample: &Sample) -> f64 {
        let Color { gain, bias } = self.of_sample(sample);
        gain * sample.gray[1].value + bias - sample.gray[0].value
    }
}

impl CellPair {
    fn empty(pictures: [usize; 2], sample: &Sample) -> Self {
        let members = std::array::from_fn(|k| Share {
            picture: pictures[k / 4],
            vertex: sample.corners[k / 4][k % 4] as usize,
            share: 1.0,
        });
        Self { members, metrics: [Metric::default(); COUPLINGS], right: [Vector2::zeros(); MEMBERS] }
    }

    /// Adds weight (residual + slope . (change of the first place - change of the second))^2.
    ///
    /// The slope is the mean of both pictures': with it a step errs in the third order of the misalignment, with one
    /// picture's alone in the second.
    fn add(&mut self, sample: &Sample, gain: f64, residual: f64, weight: f64) {
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
