//! Rotations of space as 3 x 3 matrices.

use nalgebra::{Matrix3, Matrix3x2, Vector3};
use rand::{Rng, RngExt};

/// The cross product with v as a matrix: `cross_matrix(v) * w == v.cross(w)`.
pub fn cross_matrix(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// The rows of a matrix, as records and files hold them.
pub fn rows_of(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

/// The matrix of given rows.
pub fn matrix_from_rows(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

/// Whether rows are orthonormal and right-handed, within what printing to six digits loses.
pub fn is_rotation(matrix: &Matrix3<f64>) -> bool {
    const TOLERANCE: f64 = 1e-4;
    let error = matrix * matrix.transpose() - Matrix3::identity();
    error.iter().all(|entry| entry.abs() < TOLERANCE) && matrix.determinant() > 0.0
}

/// The roll of a camera that sees "down" in direction `down` of its own frame: the clockwise turn, in radians, that
/// stands its photograph upright. 0 straight up or down.
pub fn roll_from_down(down: &Vector3<f64>) -> f64 {
    down.x.atan2(down.y)
}

/// Two unit vectors that complete `axis` to a right-handed orthonormal frame (axis, first, second).
pub fn orthonormal_complement(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    // The coordinate axis with the smallest component is farthest from parallel.
    let helper = Vector3::ith(axis.iamin(), 1.0);
    let first = axis.cross(&helper).normalize();
    (first, axis.cross(&first))
}

/// The same two as columns: turns of `axis` by small angles are this times two numbers, and what a symmetric matrix M
/// says of them is basis^T M basis.
pub fn tangent_basis(axis: &Vector3<f64>) -> Matrix3x2<f64> {
    let (first, second) = orthonormal_complement(axis);
    Matrix3x2::from_columns(&[first, second])
}

/// The rotation by |v| radians about v (Rodrigues).
pub fn exp_rotation(v: &Vector3<f64>) -> Matrix3<f64> {
    const SMALL: f64 = 1e-12;
    let angle = v.norm();
    if angle < SMALL {
        return Matrix3::identity() + cross_matrix(v);
    }
    let k = cross_matrix(&(v / angle));
    Matrix3::identity() + k * angle.sin() + k * k * (1.0 - angle.cos())
}

/// The rotation vector of a rotation: axis times angle, angle in [0, pi].
pub fn log_rotation(rotation: &Matrix3<f64>) -> Vector3<f64> {
    nalgebra::Rotation3::from_matrix_unchecked(*rotation).scaled_axis()
}

/// The rotation closest to `matrix` in the Frobenius norm (polar factor with determinant +1).
///
/// A matrix with a negative determinant yields the closest proper rotation; the zero matrix yields the identity up to
/// the singular value decomposition's choice of axes.
pub fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = matrix.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    // nalgebra sorts singular values in decreasing order: the sign goes to the smallest.
    let sign = (u * v_t).determinant().signum();
    u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t
}

/// The rotation by `angle` about x: takes y towards z.
pub fn rotation_about_x(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

/// The rotation by `angle` about y: takes z towards x.
pub fn rotation_about_y(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

/// The rotation by `angle` about z: takes x towards y, clockwise on the screen.
pub fn rotation_about_z(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// A rotation drawn uniformly from all rotations (Shoemake's subgroup algorithm).
pub fn random_rotation(generator: &mut impl Rng) -> Matrix3<f64> {
    use std::f64::consts::TAU;
    let (u, first, second): (f64, f64, f64) =
        (generator.random(), TAU * generator.random::<f64>(), TAU * generator.random::<f64>());
    let quaternion = nalgebra::Quaternion::new(
        u.sqrt() * second.cos(),
        (1.0 - u).sqrt() * first.sin(),
        (1.0 - u).sqrt() * first.cos(),
        u.sqrt() * second.sin(),
    );
    *nalgebra::UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix().matrix()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn quarter_turns_take_the_axes_where_their_docs_say() {
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!((rotation_about_x(quarter) * Vector3::y() - Vector3::z()).norm() < 1e-12);
        assert!((rotation_about_y(quarter) * Vector3::z() - Vector3::x()).norm() < 1e-12);
        assert!((rotation_about_z(quarter) * Vector3::x() - Vector3::y()).norm() < 1e-12);
    }

    proptest! {
        #[test]
        fn logarithm_inverts_exponential(x in -1.7..1.7_f64, y in -1.7..1.7_f64, z in -1.7..1.7_f64) {
            let v = Vector3::new(x, y, z);
            prop_assert!((log_rotation(&exp_rotation(&v)) - v).norm() < 1e-7);
        }

        #[test]
        fn nearest_rotation_is_a_fixed_point_on_rotations(x in -3.0..3.0_f64, y in -3.0..3.0_f64) {
            let rotation = exp_rotation(&Vector3::new(x, y, 0.5));
            prop_assert!((nearest_rotation(&(rotation * 2.5)) - rotation).norm() < 1e-9);
        }
    }
}
