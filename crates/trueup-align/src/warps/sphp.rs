//! The shape-preserving half-projective warp (SPHP): a homography on one side, a similarity on the other, and a
//! quadratic or cubic transition between.

use nalgebra::{Matrix2, Matrix3, Matrix4, Vector2, Vector4};
use trueup_core::geometry::Homography;

/// A homography that turns into a similarity across the lines u = `first` and u = `second`, u being the direction in
/// which the homography's denominator falls.
///
/// Coordinates have their origin at the photograph's center. The map and its derivative are continuous across both
/// lines.
///
/// # Source
/// Chang, Sato and Chuang, "Shape-preserving half-projective warps for image stitching" (2014), section 3; the
/// zero-rotation variant as in the authors' program.
#[derive(Debug, Clone)]
pub(super) struct SphpWarp {
    homography: Homography,
    /// Cosine and sine of the direction of u.
    direction: [f64; 2],
    first: f64,
    second: f64,
    /// X = a(u) v + b(u), Y = e(u) v + f(u); coefficients of 1, u, u^2, u^3.
    a: Vector4<f64>,
    b: Vector4<f64>,
    e: Vector4<f64>,
    f: Vector4<f64>,
    similarity: Matrix3<f64>,
}

impl SphpWarp {
    /// The warp of a homography with h33 = 1 between the lines u = `first` and u = `second` (pixels). With
    /// `zero_rotation` the similarity keeps photographs upright.
    ///
    /// `None` if the homography is affine (it has no direction u and needs no warp), if a line crosses the horizon
    /// 1 = c u, or if `second` is not larger than `first`.
    pub(super) fn new(homography: &Homography, first: f64, second: f64, zero_rotation: bool) -> Option<Self> {
        let h = homography.0 / homography.0[(2, 2)];
        let c = h[(2, 0)].hypot(h[(2, 1)]);
        let w = 1.0 - c * first;
        let direction = Self::growth(homography)?;
        if !(w > 0.0 && second > first) {
            return None;
        }
        let (cosine, sine) = (direction.x, direction.y);
        let p = [0, 1].map(|k| h[(k, 0)] * cosine + h[(k, 1)] * sine);
        let q = [0, 1].map(|k| -h[(k, 0)] * sine + h[(k, 1)] * cosine);

        let value_and_slope = |k: usize| (q[k] / w, c * q[k] / (w * w));
        let free = |k: usize| {
            let (value, slope) = value_and_slope(k);
            quadratic(first, second, value, slope, 0.0)
        };
        let (mut a, mut e) = (free(0)?, free(1)?);
        let (mut scale_cosine, mut scale_sine) = (polynomial(&e, second), -polynomial(&a, second));
        if zero_rotation {
            let scale = scale_cosine.hypot(scale_sine);
            (scale_cosine, scale_sine) = (scale * cosine, scale * sine);
            let fixed = |k: usize, end: f64| {
                let (value, slope) = value_and_slope(k);
                cubic(first, second, value, slope, end)
            };
            (a, e) = (fixed(0, -scale_sine)?, fixed(1, scale_cosine)?);
        }
        let offset = |k: usize, end_slope: f64| {
            let value = (p[k] * first + h[(k, 2)]) / w;
            quadratic(first, second, value, (p[k] + c * h[(k, 2)]) / (w * w), end_slope)
        };
        let (b, f) = (offset(0, scale_cosine)?, offset(1, scale_sine)?);
        let shift = (polynomial(&b, second) - scale_cosine * second, polynomial(&f, second) - scale_sine * second);
        let similarity =
            Matrix3::new(scale_cosine, -scale_sine, shift.0, scale_sine, scale_cosine, shift.1, 0.0, 0.0, 1.0)
                * Matrix3::new(cosine, sine, 0.0, -sine, cosine, 0.0, 0.0, 0.0, 1.0);
        Some(Self { homography: Homography(h), direction: [cosine, sine], first, second, a, b, e, f, similarity })
    }

    /// The direction u of a homography with h33 = 1: that in which its denominator falls, unit length. `None` if it is
    /// affine.
    pub(super) fn growth(homography: &Homography) -> Option<Vector2<f64>> {
        const AFFINE: f64 = 1e-8;
        let h = homography.0 / homography.0[(2, 2)];
        Vector2::new(-h[(2, 0)], -h[(2, 1)]).try_normalize(AFFINE)
    }

    /// The derivative of [`Self::apply`] at a point.
    pub(super) fn jacobian(&self, point: Vector2<f64>) -> Matrix2<f64> {
        let [cosine, sine] = self.direction;
        let (u, v) = (cosine * point.x + sine * point.y, -sine * point.x + cosine * point.y);
        if u <= self.first {
            self.homography.jacobian(point)
        } else if u > self.second {
            self.similarity.fixed_view::<2, 2>(0, 0).into_owned()
        } else {
            let along = |a: &Vector4<f64>, b: &Vector4<f64>| slope(a, u) * v + slope(b, u);
            let by_uv = Matrix2::new(
                along(&self.a, &self.b),
                polynomial(&self.a, u),
                along(&self.e, &self.f),
                polynomial(&self.e, u),
            );
            by_uv * Matrix2::new(cosine, sine, -sine, cosine)
        }
    }

    /// Where a point goes.
    pub(super) fn apply(&self, point: Vector2<f64>) -> Vector2<f64> {
        let [cosine, sine] = self.direction;
        let (u, v) = (cosine * point.x + sine * point.y, -sine * point.x + cosine * point.y);
        if u <= self.first {
            self.homography.apply(point)
        } else if u > self.second {
            Homography(self.similarity).apply(point)
        } else {
            Vector2::new(
                polynomial(&self.a, u) * v + polynomial(&self.b, u),
                polynomial(&self.e, u) * v + polynomial(&self.f, u),
            )
        }
    }

    /// Clockwise rotation of the similarity side, radians.
    #[cfg(test)]
    pub(super) fn similarity_rotation(&self) -> f64 {
        self.similarity[(1, 0)].atan2(self.similarity[(0, 0)])
    }
}

fn polynomial(coefficients: &Vector4<f64>, u: f64) -> f64 {
    coefficients.dot(&Vector4::new(1.0, u, u * u, u * u * u))
}

fn slope(coefficients: &Vector4<f64>, u: f64) -> f64 {
    coefficients.dot(&Vector4::new(0.0, 1.0, 2.0 * u, 3.0 * u * u))
}

/// The quadratic with this value and slope at `first` and this slope at `second`.
fn quadratic(first: f64, second: f64, value: f64, slope: f64, end_slope: f64) -> Option<Vector4<f64>> {
    let curvature = (end_slope - slope) / (2.0 * (second - first));
    let linear = slope - 2.0 * curvature * first;
    let constant = value - linear * first - curvature * first * first;
    let coefficients = Vector4::new(constant, linear, curvature, 0.0);
    coefficients.iter().all(|entry| entry.is_finite()).then_some(coefficients)
}

/// The cubic with this value and slope at `first`, and this value and no slope at `second`.
fn cubic(first: f64, second: f64, value: f64, slope: f64, end: f64) -> Option<Vector4<f64>> {
    let at = |u: f64| [1.0, u, u * u, u * u * u];
    let along = |u: f64| [0.0, 1.0, 2.0 * u, 3.0 * u * u];
    let rows = [at(first), along(first), at(second), along(second)];
    let system = Matrix4::from_fn(|row, column| rows[row][column]);
    system.lu().solve(&Vector4::new(value, slope, end, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The homography and lines of numeric check 18 of the specification.
    fn example(zero_rotation: bool) -> SphpWarp {
        let h = Homography(Matrix3::new(1.05, 0.08, 200.0, -0.06, 1.02, 30.0, -4e-4, 6e-5, 1.0));
        SphpWarp::new(&h, -60.0, 220.0, zero_rotation).expect("a projective map")
    }

    /// A7: value and derivative are continuous across both lines, with the switch on and off.
    #[test]
    fn the_warp_is_smooth_across_both_lines() {
        for zero_rotation in [false, true] {
            let warp = example(zero_rotation);
            let along = Vector2::from(warp.direction);
            let across = Vector2::new(-along.y, along.x);
            for line in [-60.0, 220.0] {
                for v in [-200.0, 0.0, 150.0] {
                    let at = |u: f64| warp.apply(along * u + across * v);
                    let (near, step) = (1e-9, 1e-3);
                    assert!((at(line + near) - at(line - near)).norm() < 1e-6);
                    let before = (at(line - near) - at(line - near - step)) / step;
                    let after = (at(line + near + step) - at(line + near)) / step;
                    assert!((after - before).norm() < 1e-5, "{}", (after - before).norm());
                }
            }
        }
    }

    /// Expected rotation: numeric check 18 (-4.689 degrees without the switch, 0 with it).
    #[test]
    fn the_similarity_is_upright_with_the_switch() {
        assert!((example(false).similarity_rotation().to_degrees().abs() - 4.689).abs() < 1e-3);
        assert!(example(true).similarity_rotation().abs() < 1e-9);
    }

    #[test]
    fn the_derivative_is_that_of_finite_differences() {
        let (warp, step) = (example(true), 1e-4);
        for point in [(-300.0, 50.0), (80.0, -120.0), (400.0, 10.0)].map(|(x, y)| Vector2::new(x, y)) {
            let along =
                |axis: Vector2<f64>| (warp.apply(point + axis * step) - warp.apply(point - axis * step)) / (2.0 * step);
            let numeric = Matrix2::from_columns(&[along(Vector2::x()), along(Vector2::y())]);
            assert!((warp.jacobian(point) - numeric).amax() < 1e-6);
        }
    }

    #[test]
    fn affine_maps_and_crossed_lines_are_refused() {
        let affine = Homography(Matrix3::new(1.0, 0.1, 5.0, 0.0, 1.0, 2.0, 0.0, 0.0, 1.0));
        assert!(SphpWarp::new(&affine, -60.0, 220.0, true).is_none());
        let h = Homography(Matrix3::new(1.05, 0.08, 200.0, -0.06, 1.02, 30.0, -4e-4, 6e-5, 1.0));
        assert!(SphpWarp::new(&h, 220.0, -60.0, true).is_none());
        assert!(SphpWarp::new(&h, 1e6, 2e6, true).is_none());
    }
}
