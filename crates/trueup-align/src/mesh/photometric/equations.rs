//! The equations of one overlap seen through its pixels.

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median_of};

use super::super::cell_pair::CellPairs;
use super::super::metric::Metric;
use super::colors::Colors;
use super::overlap::PhotometricOverlap;
use super::sample::PixelSample;
use super::sampler::bands;
use crate::evidence::CommonSum;

/// Half the width of a Tukey weight, in standard deviations: 95 % efficient for a Gaussian.
const TUKEY: f64 = 4.685;
/// Distance of the samples in the finest photographs, working px; twice as far in each coarser one. Edges are two to
/// three pixels wide: at 4 px many are passed over, and NCC MSE is 1 % higher on four of five sets.
const SPACING_PX: f64 = 3.0;
/// The distance that the option `photometric.weight` belongs to.
const WEIGHED_SPACING_PX: f64 = 4.0;
/// Overlaps with fewer samples are left as they are.
const MIN_SAMPLES: usize = 50;
/// Smaller standard deviations of the difference are not believed, gray levels: rounding and compression differ from
/// place to place.
const LEAST_NOISE: f64 = 3.0;

/// All samples of an overlap with what they differ by.
struct Compared {
    bands: Vec<Band>,
    colors: Colors,
    /// Standard deviation of the residuals, robustly.
    sigma: f64,
}

/// The samples of a row of cells.
struct Band {
    samples: Vec<PixelSample>,
    residuals: Vec<f64>,
    weights: Vec<f64>,
}

impl Band {
    /// Every sample with its residual and its weight.
    fn iter(&self) -> impl Iterator<Item = (&PixelSample, f64, f64)> {
        let numbers = self.residuals.iter().copied().zip(self.weights.iter().copied());
        self.samples.iter().zip(numbers).map(|(sample, (residual, weight))| (sample, residual, weight))
    }
}

/// What one overlap says in one round.
pub(super) struct OverlapEquations {
    pub cells: Vec<CellPairs>,
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
        let Some(Compared { bands, colors, sigma }) = self.compared(level) else {
            return OverlapEquations { cells: Vec::new(), misfit: [0.0; 2] };
        };
        let noise = (USUAL_NOISE / sigma.max(LEAST_NOISE)).powi(2);
        let weight = weight * noise * (spacing_px(level) / WEIGHED_SPACING_PX).powi(2);
        let of_band = |band: &Band| {
            let mut cells = CellPairs::between([self.warp.from, self.warp.to]);
            for (sample, residual, own) in band.iter().filter(|(.., weight)| *weight > 0.0) {
                add_sample(sample, colors.of_sample(sample).gain, residual, weight * own, &mut cells);
            }
            cells
        };
        let cells = bands.par_iter().map(of_band).collect();
        let misfit = bands
            .iter()
            .flat_map(Band::iter)
            .fold([0.0; 2], |[sum, count], (_, residual, weight)| [sum + weight * residual.abs(), count + weight]);
        OverlapEquations { cells, misfit }
    }

    fn compared(&self, level: usize) -> Option<Compared> {
        let samples = bands(self, level, spacing_px(level));
        if samples.iter().map(Vec::len).sum::<usize>() < MIN_SAMPLES {
            return None;
        }
        let colors = Colors::of(&samples, self.solved[0]);
        let with_residuals = |samples: Vec<PixelSample>| {
            let residuals = samples.iter().map(|sample| colors.residual(sample)).collect();
            Band { samples, residuals, weights: Vec::new() }
        };
        let mut bands: Vec<Band> = samples.into_par_iter().map(with_residuals).collect();
        let sigma = spread(bands.iter().flat_map(|band| &band.residuals).copied());
        bands.par_iter_mut().for_each(|band| {
            band.weights = band.residuals.iter().map(|residual| tukey_weight(residual / sigma)).collect();
        });
        Some(Compared { bands, colors, sigma })
    }

    /// Square, per axis, of the misalignment that the pixels of neighboring cells have in common, at a level.
    pub(super) fn common_square(&self, level: usize) -> f64 {
        let Some(compared) = self.compared(level) else { return 0.0 };
        let grid = self.solved[0];
        let per_sample = compared.sigma.max(LEAST_NOISE).powi(-2);
        let mut cells = vec![(Matrix2::zeros(), Vector2::zeros()); grid.len()];
        for (sample, residual, weight) in compared.bands.iter().flat_map(Band::iter) {
            let slope = sample.mean_slope(compared.colors.of_sample(sample).gain);
            let (information, pull) = &mut cells[sample.cells[0] as usize];
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
}

/// Distance of samples at a level: twice as far at the next.
fn spacing_px(level: usize) -> f64 {
    SPACING_PX * 2.0_f64.powi(level as i32)
}

/// Standard deviation of residuals, gray levels, of which less than half are outliers.
fn spread(residuals: impl Iterator<Item = f64>) -> f64 {
    /// Least standard deviation: that of rounding both photographs.
    const ROUNDING: f64 = 0.5;
    median_of(residuals.map(f64::abs)).map_or(ROUNDING, |median| (SD_PER_MEDIAN_MAGNITUDE * median).max(ROUNDING))
}

/// Tukey's biweight of a residual in standard deviations.
fn tukey_weight(residual: f64) -> f64 {
    let share = residual / TUKEY;
    if share.abs() < 1.0 { (1.0 - share * share).powi(2) } else { 0.0 }
}

/// Adds weight (residual + slope . (change of the first place - change of the second))^2.
///
/// The slope is the mean of both photographs': with it a step errs in the third order of the misalignment, with one
/// photograph's alone in the second.
fn add_sample(sample: &PixelSample, gain: f64, residual: f64, weight: f64, cells: &mut CellPairs) {
    let slope = sample.mean_slope(gain);
    let value = slope.dot(&sample.gap) - residual;
    cells.of(sample.cells).add(&sample.shares(), Metric::along(slope, weight), slope * (weight * value));
}
