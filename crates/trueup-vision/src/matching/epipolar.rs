//! The epipolar geometry of two photographs that many of their matches agree on.
//!
//! # Source
//! Hartley and Zisserman, Multiple View Geometry, sections 11.1 to 11.6: the eight-point algorithm on normalized
//! coordinates, Sampson's distance, RANSAC; samples are judged as MSAC does (Torr and Zisserman, MLESAC, section 4).
//!
//! # Departures
//! On bearings instead of places, so that lenses that bend have one, too. What is normalized is their second moment,
//! which for pinholes does what Hartley's normalization does. A wrong focal length is a linear map of the bearings,
//! which the matrix takes over.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rand::Rng;

use super::ransac::different_indices;

/// Matches in a sample.
const SAMPLE: usize = 8;
/// Samples that are drawn: 0.995 sure to have one without outliers from three wrong ones of ten on.
const SAMPLES: usize = 1000;
/// Least-squares fits to all that agree, from the best sample on.
const REFITS: usize = 4;

/// Two views of the same points: b^T `matrix` a = 0 for their bearings.
#[derive(Debug, Clone, Copy)]
struct EpipolarGeometry {
    matrix: Matrix3<f64>,
}

impl EpipolarGeometry {
    /// Through eight matches or more, in the sense of least algebraic squares; `None` where they do not tell.
    fn fit(in_a: &[Vector3<f64>], in_b: &[Vector3<f64>]) -> Option<Self> {
        let (whitening_a, whitening_b) = (whitening(in_a)?, whitening(in_b)?);
        let mut normal = SMatrix::<f64, 9, 9>::zeros();
        for (a, b) in in_a.iter().zip(in_b) {
            let product = (whitening_b * b) * (whitening_a * a).transpose();
            let row = SVector::<f64, 9>::from_column_slice(product.as_slice());
            normal.syger(1.0, &row, &row, 1.0);
        }
        normal.fill_upper_triangle_with_lower_triangle();
        let full = Matrix3::from_column_slice(least_eigenvector(&normal)?.as_slice());
        // The nearest matrix of rank 2 lacks what the direction of the least singular value is carried to.
        let moment = full.tr_mul(&full).symmetric_eigen();
        let lost = moment.eigenvectors.column(moment.eigenvalues.imin());
        let matrix = whitening_b.transpose() * (full - full * lost * lost.transpose()) * whitening_a;
        matrix.iter().all(|entry| entry.is_finite()).then_some(Self { matrix })
    }

    /// Square of the angle in radians, to first order, by which a match misses the geometry.
    fn squared_error(&self, a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
        let (plane_in_b, plane_in_a) = (self.matrix * a, self.matrix.tr_mul(b));
        let product = b.dot(&plane_in_b);
        let slopes = plane_in_b.norm_squared() + plane_in_a.norm_squared() - 2.0 * product * product;
        if slopes > 0.0 { product * product / slopes } else { f64::INFINITY }
    }

    fn agreeing(&self, in_a: &[Vector3<f64>], in_b: &[Vector3<f64>], within: f64) -> Vec<usize> {
        let agrees = |&k: &usize| self.squared_error(&in_a[k], &in_b[k]) <= within * within;
        (0..in_a.len()).filter(agrees).collect()
    }

    /// Sum of min(1, error^2 / within^2), if it is less than `limit`.
    fn cost_below(&self, limit: f64, in_a: &[Vector3<f64>], in_b: &[Vector3<f64>], within: f64) -> Option<f64> {
        let scale = (within * within).recip();
        let mut cost = 0.0;
        for (a, b) in in_a.iter().zip(in_b) {
            cost += (self.squared_error(a, b) * scale).min(1.0);
            if cost >= limit {
                return None;
            }
        }
        Some(cost)
    }
}

/// The eigenvector of the least eigenvalue of a positive semidefinite matrix; `None` if it is not finite.
///
/// # Source
/// Golub and Van Loan, Matrix Computations, section 8.2.2: inverse iteration, here from a matrix that is shifted by a
/// trillionth, so that one without a rest, as eight matches give, has an inverse, too. It takes a tenth of the time of
/// all nine eigenvectors.
fn least_eigenvector(matrix: &SMatrix<f64, 9, 9>) -> Option<SVector<f64, 9>> {
    const SHIFT: f64 = 1e-12;
    /// A step that turns the vector by less ends the iteration, radians.
    const SETTLED: f64 = 1e-10;
    /// Steps after which two eigenvalues are so near each other that all are computed.
    const STEPS: usize = 40;
    let shifted = matrix + SMatrix::<f64, 9, 9>::identity() * (SHIFT * matrix.trace());
    if let Some(factor) = shifted.cholesky() {
        let mut vector = SVector::<f64, 9>::repeat(1.0 / 3.0);
        for _ in 0..STEPS {
            let next = factor.solve(&vector).normalize();
            let turned = (next - vector * next.dot(&vector)).norm();
            vector = next;
            if turned < SETTLED {
                return Some(vector);
            }
        }
    }
    let eigen = matrix.iter().all(|entry| entry.is_finite()).then(|| matrix.symmetric_eigen())?;
    Some(eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned())
}

/// The linear map after which the bearings' second moment is the identity; `None` where they span no volume.
fn whitening(bearings: &[Vector3<f64>]) -> Option<Matrix3<f64>> {
    let moment: Matrix3<f64> = bearings.iter().map(|bearing| bearing * bearing.transpose()).sum();
    (moment / bearings.len() as f64).cholesky()?.l().try_inverse()
}

/// The matches, ascending, that agree within an angle of `within` radians with the epipolar geometry of least truncated
/// squares; none if there are fewer than eight. Bearings have the length 1, those of a match the same number in both
/// lists.
///
/// Photographs from one point have no epipolar geometry of their own: what agrees with their turn agrees with what is
/// found, too.
pub(super) fn epipolar_matches(
    in_a: &[Vector3<f64>],
    in_b: &[Vector3<f64>],
    within: f64,
    generator: &mut impl Rng,
) -> Vec<usize> {
    let count = in_a.len().min(in_b.len());
    if count < SAMPLE {
        return Vec::new();
    }
    let select = |indices: &[usize]| -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        indices.iter().map(|&k| (in_a[k], in_b[k])).unzip()
    };
    let mut best: Option<(f64, EpipolarGeometry)> = None;
    let mut keep = |found: EpipolarGeometry| {
        let least = best.map_or(f64::INFINITY, |(least, _)| least);
        let Some(cost) = found.cost_below(least, in_a, in_b, within) else { return false };
        best = Some((cost, found));
        true
    };
    for _ in 0..SAMPLES {
        let (sample_a, sample_b) = select(&different_indices::<SAMPLE>(count, generator));
        if let Some(found) = EpipolarGeometry::fit(&sample_a, &sample_b)
            && keep(found)
        {
            let mut refined = found;
            for _ in 0..REFITS {
                let (near_a, near_b) = select(&refined.agreeing(in_a, in_b, within));
                let Some(next) = EpipolarGeometry::fit(&near_a, &near_b).filter(|_| near_a.len() >= SAMPLE) else {
                    break;
                };
                refined = next;
                if !keep(refined) {
                    break;
                }
            }
        }
    }
    best.map_or_else(Vec::new, |(_, found)| found.agreeing(in_a, in_b, within))
}

#[cfg(test)]
mod tests {
    use trueup_core::StageContext;
    use trueup_core::geometry::rotation_about_y;

    use super::*;

    /// Points at depths of 3 to 9, seen from the origin and from `center` by a camera turned by 10 degrees; of every
    /// fifth another point's bearing in b.
    fn views(center: Vector3<f64>) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        let rotation = rotation_about_y(-0.17);
        let point = |k: usize| {
            let (x, y, z) = (k as f64 * 0.37 % 1.0 - 0.5, k as f64 * 0.61 % 1.0 - 0.5, k as f64 * 0.83 % 1.0);
            Vector3::new(x, y, 1.0) * (3.0 + 6.0 * z)
        };
        let in_b = |k: usize| (rotation * (point(k) - center)).normalize();
        let shown = |k: usize| if k.is_multiple_of(5) { in_b(k + 37) } else { in_b(k) };
        (0..100).map(|k| (point(k).normalize(), shown(k))).unzip()
    }

    fn found(center: Vector3<f64>) -> Vec<usize> {
        let (in_a, in_b) = views(center);
        epipolar_matches(&in_a, &in_b, 1e-3, &mut StageContext::default().generator("test", 7))
    }

    #[test]
    fn points_of_all_depths_agree_and_most_wrong_matches_do_not() {
        let found = found(Vector3::new(0.6, 0.1, 0.2));
        assert!((0..100_usize).filter(|k| !k.is_multiple_of(5)).all(|k| found.contains(&k)), "{found:?}");
        assert!(found.len() <= 83, "{found:?}");
    }

    #[test]
    fn a_turn_about_one_point_agrees_with_what_is_found() {
        let found = found(Vector3::zeros());
        assert!((0..100_usize).filter(|k| !k.is_multiple_of(5)).all(|k| found.contains(&k)), "{found:?}");
    }

    /// Against nalgebra's decomposition: with a clear least eigenvalue, without a rest, and with two that are nearly
    /// alike.
    #[test]
    fn the_least_eigenvector_is_that_of_all_nine() {
        let matrix = |count: usize, noise: f64| {
            let row = |k: usize| {
                let entry = |column: usize| ((k * 9 + column) as f64 * 1.37).sin();
                let along: f64 = (0..9).map(entry).sum::<f64>() / 9.0;
                SVector::<f64, 9>::from_fn(|column, _| entry(column) - along * (1.0 - noise))
            };
            (0..count).map(|k| row(k) * row(k).transpose()).sum::<SMatrix<f64, 9, 9>>()
        };
        for (count, noise) in [(8, 0.0), (8, 0.7), (60, 0.01), (60, 0.9)] {
            let matrix = matrix(count, noise);
            let eigen = matrix.symmetric_eigen();
            let wanted = eigen.eigenvectors.column(eigen.eigenvalues.imin());
            let found = least_eigenvector(&matrix).expect("finite");
            // What several vectors share the least eigenvalue of, any of them solves.
            let residual = (matrix * found).norm() / matrix.trace();
            let least = eigen.eigenvalues.min().max(0.0) / matrix.trace();
            assert!((residual - least).abs() < 1e-9, "{count} {noise}: {residual} {least}");
            if count > 8 {
                assert!(found.dot(&wanted).abs() > 1.0 - 1e-12, "{count} {noise}: {}", found.dot(&wanted));
            }
        }
        assert!(least_eigenvector(&SMatrix::repeat(f64::NAN)).is_none());
    }

    #[test]
    fn the_error_is_the_angle_to_the_epipolar_plane() {
        // A step along x: planes hold the x axis. Half of the angle to the common plane falls on either bearing, so
        // that it counts 1/sqrt(2).
        let geometry = EpipolarGeometry { matrix: Vector3::x().cross_matrix() };
        let (a, b) = (Vector3::z(), Vector3::new(0.0, 0.01_f64.sin(), 0.01_f64.cos()));
        let error = geometry.squared_error(&a, &b).sqrt();
        assert!((error - 0.01 / 2.0_f64.sqrt()).abs() < 1e-6, "{error}");
    }

    #[test]
    fn too_few_matches_agree_with_nothing() {
        let few = [Vector3::z(); 7];
        assert_eq!(epipolar_matches(&few, &few, 0.1, &mut StageContext::default().generator("test", 7)), [0; 0]);
        let same = [Vector3::z(); 20];
        assert_eq!(epipolar_matches(&same, &same, 0.1, &mut StageContext::default().generator("test", 7)), [0; 0]);
    }
}
