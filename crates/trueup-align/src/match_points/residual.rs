//! The cameras' transfer corrected by what the matches around a place say.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};

use super::moving_dlt::DECAY_PX;
use crate::cameras::CameraTransfer;
use crate::evidence::{self, OverlapGap};

/// Largest distance of a carried vertex from its place without local corrections, in diagonals of the other photograph.
pub(super) const MAX_DEVIATION: f64 = 0.1;

/// Carries points from one photograph to another by the cameras, plus a smooth correction.
///
/// The correction at a place is a local linear regression of the matches' deviations from the cameras, weighted by
/// distance and robustly, and drawn towards zero. Where the photographs were taken from one point it vanishes and the
/// places are as consistent as the cameras. Deviations of several planes it follows only in part, see
/// [`Self::common_square`].
///
/// # Departures
/// The published method carries vertices by moving DLT from the matches alone. On rotating cameras that adds the noise
/// of a few local matches, and extrapolates it where there are none.
pub(super) struct CameraResidual<'a> {
    cameras: CameraTransfer<'a>,
    samples: Vec<Sample>,
    /// Farthest outside the other photograph that a correction could still bring a point in.
    margin: f64,
}

struct Sample {
    position: Vector2<f64>,
    deviation: Vector2<f64>,
}

impl<'a> CameraResidual<'a> {
    pub(super) fn new(cameras: CameraTransfer<'a>, source: &[Vector2<f64>], target: &[Vector2<f64>]) -> Self {
        let samples = source
            .iter()
            .zip(target)
            .filter_map(|(&position, target)| {
                cameras.at(position).map(|place| Sample { position, deviation: target - place })
            })
            .collect();
        let [x, y] = cameras.to().principal_point;
        let margin = MAX_DEVIATION * 2.0 * x.hypot(y);
        Self { cameras, samples, margin }
    }

    /// The place of `point` in the other photograph; `None` behind its camera or far outside.
    pub(super) fn at(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        let place = self.cameras.at(point)?;
        let [x, y] = self.cameras.to().principal_point;
        let near = (place.x - x).abs() <= x + self.margin && (place.y - y).abs() <= y + self.margin;
        if !near {
            return None;
        }
        let correction = self.correction(point);
        (correction.norm() <= self.margin).then(|| place + correction)
    }

    /// Square, per axis, of the deviation that neighboring matches have in common, in the mean of all: parallax, beyond
    /// what noise explains.
    pub(super) fn common_square(&self) -> f64 {
        let gap =
            |sample: &Sample| OverlapGap { place: sample.position, gap: sample.deviation, known: Matrix2::identity() };
        evidence::common_square(&self.samples.iter().map(gap).collect::<Vec<_>>())
    }

    fn correction(&self, point: Vector2<f64>) -> Vector2<f64> {
        /// Rounds of reweighting.
        const ROUNDS: usize = 3;
        /// Deviations from the local trend below this are noise of the matches.
        const NOISE_PX: f64 = 1.5;
        /// Strength, in matches, with which the correction is drawn towards none.
        const SHRINKAGE: f64 = 0.5;
        /// The slope is drawn towards zero this many times as strongly as the offset (in units of the decay length).
        const SLOPE_SHRINKAGE: f64 = 4.0;
        // Of every sample its offset, in decay lengths, and its weight by distance.
        let around: Vec<(Vector2<f64>, f64)> = self
            .samples
            .iter()
            .map(|sample| {
                let offset = (sample.position - point) / DECAY_PX;
                (offset, (-offset.norm()).exp())
            })
            .collect();
        let mut trend = Matrix3x2::<f64>::zeros();
        for round in 0..ROUNDS {
            // Sums of the products of (1, x, y) with one another, and with the deviations.
            let (mut products, mut deviations) = ([0.0; 6], [0.0; 6]);
            for (sample, &(offset, near)) in self.samples.iter().zip(&around) {
                let (x, y) = (offset.x, offset.y);
                // Without a trend yet, a common deviation would make every match look wrong.
                let weight = match round {
                    0 => near,
                    _ => {
                        let expected = |axis: usize| trend[(0, axis)] + trend[(1, axis)] * x + trend[(2, axis)] * y;
                        let misfit = sample.deviation - Vector2::new(expected(0), expected(1));
                        near / (1.0 + misfit.norm_squared() / (NOISE_PX * NOISE_PX))
                    }
                };
                let row = [weight, weight * x, weight * y];
                let [of_1, of_x, of_y] = row;
                for (sum, product) in products.iter_mut().zip([of_1, of_x, of_y, of_x * x, of_x * y, of_y * y]) {
                    *sum += product;
                }
                for (sums, weighed) in deviations.chunks_exact_mut(2).zip(row) {
                    sums[0] += weighed * sample.deviation.x;
                    sums[1] += weighed * sample.deviation.y;
                }
            }
            let [n, x, y, xx, xy, yy] = products;
            let shrinkage = Matrix3::from_diagonal(&(Vector3::new(1.0, SLOPE_SHRINKAGE, SLOPE_SHRINKAGE) * SHRINKAGE));
            let normal = Matrix3::new(n, x, y, x, xx, xy, y, xy, yy) + shrinkage;
            let right = Matrix3x2::from_row_slice(&deviations);
            let Some(factor) = normal.cholesky() else { break };
            trend = factor.solve(&right);
        }
        trend.row(0).transpose()
    }
}
