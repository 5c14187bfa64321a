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
        let kernel: Vec<f64> =
            self.samples.iter().map(|sample| (-(sample.position - point).norm() / DECAY_PX).exp()).collect();
        let mut trend = Matrix3x2::<f64>::zeros();
        for round in 0..ROUNDS {
            let mut normal = Matrix3::from_diagonal(&(Vector3::new(1.0, SLOPE_SHRINKAGE, SLOPE_SHRINKAGE) * SHRINKAGE));
            let mut right = Matrix3x2::zeros();
            for (sample, &near) in self.samples.iter().zip(&kernel) {
                let offset = (sample.position - point) / DECAY_PX;
                let row = Vector3::new(1.0, offset.x, offset.y);
                // Without a trend yet, a common deviation would make every match look wrong.
                let misfit = match round {
                    0 => 0.0,
                    _ => (sample.deviation - trend.transpose() * row).norm() / NOISE_PX,
                };
                let weight = near / (1.0 + misfit * misfit);
                normal += row * row.transpose() * weight;
                right += row * sample.deviation.transpose() * weight;
            }
            let Some(factor) = normal.cholesky() else { break };
            trend = factor.solve(&right);
        }
        trend.row(0).transpose()
    }
}
