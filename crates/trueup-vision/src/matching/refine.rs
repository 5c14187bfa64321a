//! Least-squares refinement of a homography.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, SVector, Vector2};
use trueup_core::geometry::Homography;

use super::ransac::MatchedPoints;

/// Largest number of steps tried.
const MAX_STEPS: usize = 30;
/// Relative decrease of the sum of squares below which the minimum counts as reached.
const CONVERGED: f64 = 1e-9;
/// Damping at the start, and its change after a bad and a good step.
const DAMPING: (f64, f64, f64) = (1e-4, 10.0, 0.2);

type Parameters = SVector<f64, 8>;
type Normal = SMatrix<f64, 8, 8>;

/// The homography of least symmetric transfer error sum |b - H a|^2 + |a - H^-1 b|^2 near `start`; `None` if `start`
/// is singular or puts a match behind the horizon.
///
/// # Source
/// Hartley and Zisserman, Multiple View Geometry, equation 4.7, minimised by Levenberg and Marquardt's method. The
/// derivative of the backward error follows from H(H^-1 b) = b.
pub fn minimise_symmetric_error(start: &Homography, points: &MatchedPoints) -> Option<Homography> {
    let frame = CentredFrame::of(points)?;
    let mut map = frame.centre(start)?;
    let (mut normal, mut gradient, mut error) = frame.linearise(&map)?;
    let (mut damping, worse, better) = DAMPING;
    for _ in 0..MAX_STEPS {
        let mut damped = normal;
        for k in 0..8 {
            damped[(k, k)] *= 1.0 + damping;
        }
        let Some(step) = damped.cholesky().map(|factor| factor.solve(&gradient)) else { break };
        let candidate = stepped(&map, &step);
        match frame.linearise(&candidate) {
            Some((next_normal, next_gradient, next_error)) if next_error < error => {
                let converged = error - next_error <= CONVERGED * error;
                (map, normal, gradient, error) = (candidate, next_normal, next_gradient, next_error);
                damping *= better;
                if converged {
                    break;
                }
            }
            _ => damping *= worse,
        }
    }
    frame.uncentre(&map)
}

/// The eight free entries moved by `step`; the last entry stays 1.
fn stepped(map: &Homography, step: &Parameters) -> Homography {
    Homography(map.0 + Matrix3::new(step[0], step[1], step[2], step[3], step[4], step[5], step[6], step[7], 0.0))
}

/// The matches moved and scaled to be about the origin with unit spread, where the last entry of a map that sees them
/// is far from zero and the others are of like size.
struct CentredFrame {
    points: MatchedPoints,
    centre_a: Vector2<f64>,
    centre_b: Vector2<f64>,
    spread_a: f64,
    spread_b: f64,
}

impl CentredFrame {
    fn of(points: &MatchedPoints) -> Option<Self> {
        let (centre_a, spread_a) = centre_and_spread(&points.in_a)?;
        let (centre_b, spread_b) = centre_and_spread(&points.in_b)?;
        let points = MatchedPoints {
            in_a: points.in_a.iter().map(|point| (point - centre_a) / spread_a).collect(),
            in_b: points.in_b.iter().map(|point| (point - centre_b) / spread_b).collect(),
        };
        Some(Self { points, centre_a, centre_b, spread_a, spread_b })
    }

    fn centre(&self, map: &Homography) -> Option<Homography> {
        let to_b = Matrix3::new_translation(&-self.centre_b).append_scaling(1.0 / self.spread_b);
        let from_a = Matrix3::new_scaling(self.spread_a).append_translation(&self.centre_a);
        let centred = to_b * map.0 * from_a;
        (centred[(2, 2)] > 0.0).then(|| Homography(centred / centred[(2, 2)]))
    }

    fn uncentre(&self, map: &Homography) -> Option<Homography> {
        let to_a = Matrix3::new_translation(&-self.centre_a).append_scaling(1.0 / self.spread_a);
        let from_b = Matrix3::new_scaling(self.spread_b).append_translation(&self.centre_b);
        let matrix = from_b * map.0 * to_a;
        let scaled = matrix / matrix.amax();
        scaled.iter().all(|entry| entry.is_finite()).then_some(Homography(scaled))
    }

    /// Normal matrix, negative gradient and sum of squares (square pixels); `None` if a match is behind the horizon.
    fn linearise(&self, map: &Homography) -> Option<(Normal, Parameters, f64)> {
        let inverse = map.inverse()?;
        let (mut normal, mut gradient, mut error) = (Normal::zeros(), Parameters::zeros(), 0.0);
        for (&a, &b) in self.points.in_a.iter().zip(&self.points.in_b) {
            if map.denominator(a) <= 0.0 || inverse.denominator(b) <= 0.0 {
                return None;
            }
            let forward = (b - map.apply(a)) * self.spread_b;
            let forward_rows = derivative(map, a) * self.spread_b;
            let back = inverse.apply(b);
            let backward = (a - back) * self.spread_a;
            let turn: Matrix2<f64> = map.jacobian(back).try_inverse()?;
            let backward_rows = -turn * derivative(map, back) * self.spread_a;
            for (residual, rows) in [(forward, forward_rows), (backward, backward_rows)] {
                normal += rows.tr_mul(&rows);
                gradient += rows.tr_mul(&residual);
                error += residual.norm_squared();
            }
        }
        error.is_finite().then_some((normal, gradient, error))
    }
}

/// The derivative of the mapped point by the first eight entries of the map, row-major.
fn derivative(map: &Homography, point: Vector2<f64>) -> SMatrix<f64, 2, 8> {
    let w = map.denominator(point);
    let mapped = map.apply(point);
    let (x, y, one) = (point.x / w, point.y / w, 1.0 / w);
    let last = Matrix2x3::new(-mapped.x * x, -mapped.x * y, 0.0, -mapped.y * x, -mapped.y * y, 0.0);
    SMatrix::<f64, 2, 8>::from_row_slice(&[
        x,
        y,
        one,
        0.0,
        0.0,
        0.0,
        last[(0, 0)],
        last[(0, 1)], //
        0.0,
        0.0,
        0.0,
        x,
        y,
        one,
        last[(1, 0)],
        last[(1, 1)],
    ])
}

/// Mean and root mean square distance from it; `None` if the points coincide.
fn centre_and_spread(points: &[Vector2<f64>]) -> Option<(Vector2<f64>, f64)> {
    let count = points.len() as f64;
    let centre = points.iter().sum::<Vector2<f64>>() / count;
    let spread = (points.iter().map(|point| (point - centre).norm_squared()).sum::<f64>() / count).sqrt();
    (spread > f64::EPSILON).then_some((centre, spread))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Homography {
        Homography(Matrix3::new(1.05, 0.08, 200.0, -0.06, 1.02, 30.0, -4e-4, 6e-5, 1.0))
    }

    /// Points of a quasi-regular grid, those in b displaced by up to about `noise_px`.
    fn points(noise_px: f64) -> MatchedPoints {
        let in_a: Vec<Vector2<f64>> =
            (0..60).map(|k| Vector2::new(f64::from(k * 97 % 640), f64::from(k * 61 % 480))).collect();
        let noise = |k: usize| Vector2::new((k as f64 * 1.7).sin(), (k as f64 * 2.3).cos()) * noise_px;
        let in_b = in_a.iter().enumerate().map(|(k, &p)| example().apply(p) + noise(k)).collect();
        MatchedPoints { in_a, in_b }
    }

    fn symmetric_error(map: &Homography, points: &MatchedPoints) -> f64 {
        let inverse = map.inverse().expect("regular");
        let pairs = points.in_a.iter().zip(&points.in_b);
        pairs.map(|(&a, &b)| (b - map.apply(a)).norm_squared() + (a - inverse.apply(b)).norm_squared()).sum()
    }

    #[test]
    fn exact_matches_give_the_exact_map_from_a_rough_start() {
        let start = Homography(example().0 + Matrix3::new(0.02, -0.01, 4.0, 0.01, 0.02, -3.0, 1e-5, -1e-5, 0.0));
        let refined = minimise_symmetric_error(&start, &points(0.0)).expect("regular");
        assert!((refined.0 / refined.0[(2, 2)] - example().0).amax() < 1e-6);
    }

    #[test]
    fn the_result_is_a_minimum() {
        let points = points(1.5);
        let refined = minimise_symmetric_error(&example(), &points).expect("regular");
        let refined = Homography(refined.0 / refined.0[(2, 2)]);
        let least = symmetric_error(&refined, &points);
        assert!(least < symmetric_error(&example(), &points));
        for entry in 0..8 {
            let scale = [1e-3, 1e-3, 0.3, 1e-3, 1e-3, 0.3, 2e-6, 2e-6][entry];
            for step in [-scale, scale] {
                let mut moved = refined;
                moved.0[(entry / 3, entry % 3)] += step;
                assert!(symmetric_error(&moved, &points) > least, "entry {entry}");
            }
        }
    }

    #[test]
    fn coincident_points_and_singular_maps_are_refused() {
        let same = MatchedPoints { in_a: vec![Vector2::new(1.0, 2.0); 5], in_b: vec![Vector2::new(1.0, 2.0); 5] };
        assert!(minimise_symmetric_error(&example(), &same).is_none());
        assert!(minimise_symmetric_error(&Homography(Matrix3::zeros()), &points(0.0)).is_none());
    }
}
