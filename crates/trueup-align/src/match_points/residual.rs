//! The cameras' transfer corrected by what the matches around a place say.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};

use crate::cameras::CameraTransfer;
use crate::evidence::{self, CommonSquare, FULL_PX, NEGLIGIBLE_SHARE, OverlapGap};
use crate::moving_dlt::DECAY_PX;

/// Largest distance of a carried vertex from its place without local corrections, in diagonals of the other photograph.
pub(super) const MAX_DEVIATION: f64 = 0.1;

/// Carries points from one photograph to another by the cameras, plus a smooth correction.
///
/// The correction at a place is a local linear regression of the matches' deviations from the cameras, weighted by
/// distance and robustly, and drawn towards zero: as strongly as the noise of a match exceeds what neighbors have in
/// common (the ridge of best linear prediction). Where the photographs were taken from one point it vanishes and the
/// places are as consistent as the cameras. So it does where only things that moved themselves deviate. Deviations of
/// several planes it follows only in part, see [`Self::common_square`].
///
/// # Source
/// A. E. Hoerl and R. W. Kennard, "Ridge regression: biased estimation for nonorthogonal problems" (1970): the best
/// ridge is the variance of the noise over that of the coefficients.
///
/// # Departures
/// The published method carries vertices by moving DLT from the matches alone. On rotating cameras that adds the noise
/// of a few local matches, and extrapolates it where there are none.
pub(super) struct CameraResidual<'a> {
    cameras: CameraTransfer<'a>,
    samples: Vec<Sample>,
    /// See [`Self::common_square`].
    common_square: f64,
    /// Strength, in matches, with which corrections are drawn towards none; infinite where the cameras explain all
    /// matches to their noise.
    shrinkage: f64,
    /// Farthest outside the other photograph that a correction could still bring a point in.
    margin: f64,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    position: Vector2<f64>,
    deviation: Vector2<f64>,
}

/// Deviations from the local trend below this are noise of the matches, pixels.
const NOISE_PX: f64 = 1.5;
/// Least strength, in matches, with which a correction is drawn towards none.
const LEAST_SHRINKAGE: f64 = 0.5;

/// Weight of a match that deviates by `misfit` pixels from where it is expected (Cauchy's loss).
fn robust_weight(misfit: Vector2<f64>) -> f64 {
    1.0 / (1.0 + misfit.norm_squared() / (NOISE_PX * NOISE_PX))
}

/// What the matches say of how far the cameras are wrong.
fn gaps(samples: &[Sample]) -> Vec<OverlapGap> {
    let gap =
        |sample: &Sample| OverlapGap { place: sample.position, gap: sample.deviation, known: Matrix2::identity() };
    samples.iter().map(gap).collect()
}

/// Without those of things that moved, where all others say that the cameras are right; with what neighbors' deviations
/// have in common, in the mean of all.
fn of_what_stayed(samples: Vec<Sample>) -> (Vec<Sample>, CommonSquare) {
    let is_negligible = |common: CommonSquare| evidence::share(common.sure(), FULL_PX) <= NEGLIGIBLE_SHARE;
    let all = gaps(&samples);
    let common = CommonSquare::of(&all);
    if is_negligible(common) {
        return (samples, common);
    }
    let still: Vec<usize> = evidence::still(&all).collect();
    let of_still = CommonSquare::of(&still.iter().map(|&k| all[k]).collect::<Vec<_>>());
    if !is_negligible(of_still) {
        return (samples, common);
    }
    (still.into_iter().map(|k| samples[k]).collect(), of_still)
}

/// Square, per axis, of a match's deviation, in the robust mean.
fn mean_square(samples: &[Sample]) -> f64 {
    let sum = samples.iter().fold((0.0, 0.0), |(squares, weights), sample| {
        let weight = robust_weight(sample.deviation);
        (squares + weight * sample.deviation.norm_squared(), weights + weight)
    });
    if sum.1 > 0.0 { 0.5 * sum.0 / sum.1 } else { 0.0 }
}

/// The variance of a match's noise over that of what neighbors have in common, not below [`LEAST_SHRINKAGE`]; infinite
/// without anything in common.
fn shrinkage(mean_square: f64, common_square: f64) -> f64 {
    let noise = (mean_square - common_square).max(0.0);
    let ratio = noise / common_square;
    // Of deviations that are all 0 the ratio is NaN.
    if ratio.is_nan() { f64::INFINITY } else { ratio.max(LEAST_SHRINKAGE) }
}

impl<'a> CameraResidual<'a> {
    pub(super) fn new(cameras: CameraTransfer<'a>, source: &[Vector2<f64>], target: &[Vector2<f64>]) -> Self {
        let samples: Vec<Sample> = source
            .iter()
            .zip(target)
            .filter_map(|(&position, target)| {
                cameras.at(position).map(|place| Sample { position, deviation: target - place })
            })
            .collect();
        let [x, y] = cameras.to().principal_point;
        let margin = MAX_DEVIATION * 2.0 * x.hypot(y);
        let (samples, common) = of_what_stayed(samples);
        let shrinkage = shrinkage(mean_square(&samples), common.mean());
        Self { cameras, samples, common_square: common.sure(), shrinkage, margin }
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

    /// Square, per axis, of the deviation that neighboring matches have in common, in the mean of all: parallax, as far
    /// as noise surely does not explain it.
    pub(super) fn common_square(&self) -> f64 {
        self.common_square
    }

    /// Farthest that any match deviates from the cameras, pixels; of what stayed, where nothing but things that moved
    /// deviates.
    pub(super) fn largest_deviation(&self) -> f64 {
        self.samples.iter().map(|sample| sample.deviation.norm()).fold(0.0, f64::max)
    }

    fn correction(&self, point: Vector2<f64>) -> Vector2<f64> {
        /// Rounds of reweighting.
        const ROUNDS: usize = 3;
        /// The slope is drawn towards zero this many times as strongly as the offset (in units of the decay length).
        const SLOPE_SHRINKAGE: f64 = 4.0;
        if self.shrinkage.is_infinite() {
            return Vector2::zeros();
        }
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
                        near * robust_weight(misfit)
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
            let ridge = Matrix3::from_diagonal(&(Vector3::new(1.0, SLOPE_SHRINKAGE, SLOPE_SHRINKAGE) * self.shrinkage));
            let normal = Matrix3::new(n, x, y, x, xx, xy, y, xy, yy) + ridge;
            let right = Matrix3x2::from_row_slice(&deviations);
            let Some(factor) = normal.cholesky() else { break };
            trend = factor.solve(&right);
        }
        trend.row(0).transpose()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::camera::Camera;

    use super::*;

    /// By hand: 1.25 square pixels, of which 0.25 in common, are noise of four times what is in common.
    #[test]
    fn corrections_are_drawn_to_zero_as_noise_outweighs_what_is_common() {
        assert!((shrinkage(1.25, 0.25) - 4.0).abs() < 1e-12);
        assert_eq!(shrinkage(1.0, 2.0), LEAST_SHRINKAGE);
        assert_eq!([shrinkage(1.0, 0.0), shrinkage(0.0, 0.0)], [f64::INFINITY; 2]);
    }

    /// Matches of one camera with itself, 20 px apart, that deviate by `deviation` of the column and row.
    fn corrected(deviation: impl Fn(usize, usize) -> Vector2<f64>) -> Vector2<f64> {
        let camera = Camera::new(600.0, 640.0, 480.0, &Matrix3::identity());
        let places: Vec<(usize, usize)> = (0..24).flat_map(|row| (0..32).map(move |column| (column, row))).collect();
        let source: Vec<Vector2<f64>> =
            places.iter().map(|&(column, row)| Vector2::new(column as f64, row as f64) * 20.0).collect();
        let target: Vec<Vector2<f64>> =
            source.iter().zip(&places).map(|(place, &(column, row))| place + deviation(column, row)).collect();
        let residual = CameraResidual::new(CameraTransfer::Rotating(&camera, &camera), &source, &target);
        let point = Vector2::new(320.0, 240.0);
        residual.at(point).expect("inside") - point
    }

    /// Neighbors that deviate to opposite sides have nothing in common: the cameras stay exactly what they are. A shift
    /// that all have is followed, but for the least shrinkage beside the matches around.
    #[test]
    fn noise_corrects_nothing_and_a_common_shift_all() {
        let side = |column: usize, row: usize| if (column + row).is_multiple_of(2) { 0.4 } else { -0.4 };
        assert_eq!(corrected(|column, row| Vector2::new(side(column, row), 0.0)), Vector2::zeros());
        let shift = Vector2::new(0.3, -0.8);
        let found = corrected(|_, _| shift);
        assert!((found - shift).norm() < 0.02, "{found}");
    }

    /// A thing that covers a fifth of the overlap, around the point, went 12 px to the right; all else is where the
    /// cameras have it.
    #[test]
    fn what_moved_corrects_nothing() {
        let is_thing = |column: usize, row: usize| (9..23).contains(&column) && (7..18).contains(&row);
        let moved = |column: usize, row: usize| Vector2::new(if is_thing(column, row) { 12.0 } else { 0.0 }, 0.0);
        assert_eq!(corrected(moved), Vector2::zeros());
    }
}
