//! Plane projective maps.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::rotation::{matrix_from_rows, rows_of};

/// A projective map of the plane, `target_from_source`, scaled so that its largest entry has modulus about 1 or its
/// last entry is 1 where that is well away from zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homography(pub Matrix3<f64>);

impl Homography {
    /// The identity map.
    pub fn identity() -> Self {
        Self(Matrix3::identity())
    }

    /// From rows.
    pub fn from_rows(rows: &[[f64; 3]; 3]) -> Self {
        Self(matrix_from_rows(rows))
    }

    /// To rows.
    pub fn to_rows(self) -> [[f64; 3]; 3] {
        rows_of(&self.0)
    }

    /// The denominator w = h31 x + h32 y + h33 at a point; its sign tells the side of the horizon.
    pub fn denominator(&self, point: Vector2<f64>) -> f64 {
        self.0[(2, 0)] * point.x + self.0[(2, 1)] * point.y + self.0[(2, 2)]
    }

    /// Where a point goes. Not finite on the horizon line.
    pub fn apply(&self, point: Vector2<f64>) -> Vector2<f64> {
        let mapped = self.0 * Vector3::new(point.x, point.y, 1.0);
        Vector2::new(mapped.x / mapped.z, mapped.y / mapped.z)
    }

    /// The derivative of [`Self::apply`] at a point.
    pub fn jacobian(&self, point: Vector2<f64>) -> Matrix2<f64> {
        let h = &self.0;
        let w = self.denominator(point);
        let mapped = self.apply(point);
        Matrix2::new(
            (h[(0, 0)] - h[(2, 0)] * mapped.x) / w,
            (h[(0, 1)] - h[(2, 1)] * mapped.x) / w,
            (h[(1, 0)] - h[(2, 0)] * mapped.y) / w,
            (h[(1, 1)] - h[(2, 1)] * mapped.y) / w,
        )
    }

    /// The inverse map; `None` if singular.
    pub fn inverse(&self) -> Option<Self> {
        self.0.try_inverse().map(Self)
    }

    /// `self` after `first`.
    pub fn after(&self, first: &Self) -> Self {
        Self(self.0 * first.0)
    }

    /// The map through four points; `None` if three of them are collinear (up to rounding).
    pub fn from_four_points(source: &[Vector2<f64>; 4], target: &[Vector2<f64>; 4]) -> Option<Self> {
        let (source_norm, target_norm) = (Normalization::of(source)?, Normalization::of(target)?);
        let mut system = SMatrix::<f64, 8, 8>::zeros();
        let mut right = SVector::<f64, 8>::zeros();
        for k in 0..4 {
            let (p, q) = (source_norm.apply(source[k]), target_norm.apply(target[k]));
            let rows = dlt_rows(p, q);
            for column in 0..8 {
                system[(2 * k, column)] = rows[0][column];
                system[(2 * k + 1, column)] = rows[1][column];
            }
            right[2 * k] = -rows[0][8];
            right[2 * k + 1] = -rows[1][8];
        }
        let h = system.lu().solve(&right)?;
        let normalized = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
        finite(Self(target_norm.inverse() * normalized * source_norm.matrix()))
    }

    /// The weighted algebraic least-squares map (DLT with Hartley's normalization); `None` with fewer than four
    /// points or a degenerate configuration.
    ///
    /// # Source
    /// Hartley and Zisserman, Multiple View Geometry, algorithm 4.2; with weights, the moving DLT of APAP.
    pub fn fit(source: &[Vector2<f64>], target: &[Vector2<f64>], weights: Option<&[f64]>) -> Option<Self> {
        if source.len() < 4 || source.len() != target.len() {
            return None;
        }
        let (source_norm, target_norm) = (Normalization::of(source)?, Normalization::of(target)?);
        let mut normal = SMatrix::<f64, 9, 9>::zeros();
        for k in 0..source.len() {
            let weight = weights.map_or(1.0, |weights| weights[k]);
            for row in dlt_rows(source_norm.apply(source[k]), target_norm.apply(target[k])) {
                let row = SVector::<f64, 9>::from(row);
                normal.syger(weight * weight, &row, &row, 1.0);
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        let eigen = normal.symmetric_eigen();
        let smallest = eigen.eigenvalues.imin();
        let h = eigen.eigenvectors.column(smallest);
        let normalized = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
        finite(Self(target_norm.inverse() * normalized * source_norm.matrix()))
    }
}

/// The two rows of the direct linear transform for source p and target q: `rows * h = 0`, h row-major.
fn dlt_rows(p: Vector2<f64>, q: Vector2<f64>) -> [[f64; 9]; 2] {
    [
        [p.x, p.y, 1.0, 0.0, 0.0, 0.0, -q.x * p.x, -q.x * p.y, -q.x],
        [0.0, 0.0, 0.0, p.x, p.y, 1.0, -q.y * p.x, -q.y * p.y, -q.y],
    ]
}

/// Scales so that h33 = 1 where possible; `None` if anything is not finite.
fn finite(homography: Homography) -> Option<Homography> {
    let matrix = homography.0;
    let largest = matrix.amax();
    let scale = if matrix[(2, 2)].abs() > 1e-9 * largest { matrix[(2, 2)] } else { largest };
    let scaled = matrix / scale;
    scaled.iter().all(|entry| entry.is_finite()).then_some(Homography(scaled))
}

/// Hartley's normalization of a point set: centroid to the origin, mean distance to sqrt(2).
#[derive(Debug, Clone, Copy)]
pub struct Normalization {
    center: Vector2<f64>,
    scale: f64,
}

impl Normalization {
    /// The normalization of `points`; `None` if they coincide or there are none.
    pub fn of(points: &[Vector2<f64>]) -> Option<Self> {
        const COINCIDENT: f64 = 1e-9;
        let count = points.len() as f64;
        let center = points.iter().sum::<Vector2<f64>>() / count;
        let spread = points.iter().map(|point| (point - center).norm()).sum::<f64>() / count;
        (spread > COINCIDENT).then(|| Self { center, scale: std::f64::consts::SQRT_2 / spread })
    }

    /// A point in normalized coordinates.
    pub fn apply(&self, point: Vector2<f64>) -> Vector2<f64> {
        (point - self.center) * self.scale
    }

    /// `normalized_from_point` as a matrix.
    pub fn matrix(&self) -> Matrix3<f64> {
        let (s, c) = (self.scale, self.center);
        Matrix3::new(s, 0.0, -s * c.x, 0.0, s, -s * c.y, 0.0, 0.0, 1.0)
    }

    /// `point_from_normalized` as a matrix.
    pub fn inverse(&self) -> Matrix3<f64> {
        let (s, c) = (1.0 / self.scale, self.center);
        Matrix3::new(s, 0.0, c.x, 0.0, s, c.y, 0.0, 0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn example() -> Homography {
        Homography(Matrix3::new(1.05, 0.08, 200.0, -0.06, 1.02, 30.0, -4e-4, 6e-5, 1.0))
    }

    fn corners() -> [Vector2<f64>; 4] {
        [(0.0, 0.0), (640.0, 0.0), (640.0, 480.0), (0.0, 480.0)].map(|(x, y)| Vector2::new(x, y))
    }

    #[test]
    fn four_points_determine_the_map() {
        let h = example();
        let recovered = Homography::from_four_points(&corners(), &corners().map(|p| h.apply(p))).expect("regular");
        assert!((recovered.0 - h.0).amax() < 1e-9);
    }

    #[test]
    fn coincident_points_have_no_map() {
        let same = [Vector2::new(3.0, 4.0); 4];
        assert!(Homography::from_four_points(&same, &corners()).is_none());
        assert!(Homography::fit(&same, &corners(), None).is_none());
    }

    proptest! {
        #[test]
        fn the_fit_recovers_an_exact_map(seed in 0_u64..1000) {
            let h = example();
            let source: Vec<Vector2<f64>> = (0..20)
                .map(|k| {
                    let t = (seed * 31 + k * 97) as f64;
                    Vector2::new((t * 0.618).fract() * 640.0, (t * 0.4142).fract() * 480.0)
                })
                .collect();
            let target: Vec<Vector2<f64>> = source.iter().map(|&p| h.apply(p)).collect();
            let fit = Homography::fit(&source, &target, None).expect("general position");
            prop_assert!((fit.0 - h.0).amax() < 1e-6);
        }

        #[test]
        fn jacobian_matches_finite_differences(x in 0.0..640.0_f64, y in 0.0..480.0_f64) {
            let h = example();
            let (point, step) = (Vector2::new(x, y), 1e-4);
            let dx = (h.apply(point + Vector2::x() * step) - h.apply(point - Vector2::x() * step)) / (2.0 * step);
            let dy = (h.apply(point + Vector2::y() * step) - h.apply(point - Vector2::y() * step)) / (2.0 * step);
            let jacobian = h.jacobian(point);
            prop_assert!((jacobian.column(0) - dx).norm() < 1e-6 && (jacobian.column(1) - dy).norm() < 1e-6);
        }
    }
}
