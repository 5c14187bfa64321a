//! Straightening ("wave correction"): a vertical from the cameras alone.

use nalgebra::{Matrix3, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::orthonormal_complement;

/// Second eigenvalue of the mean moment of the x axes below which the photographs do not fix a vertical.
const CONDITIONED: f64 = 0.05;

/// Farthest that two photographs' level may lie from the mean of their y axes, degrees. Reasoned: the prior on the
/// pitch takes the level of two that look up by 40 degrees, a third of a quarter turn apart, but half of the way from
/// there.
const MAX_PAIR_ANGLE_DEG: f64 = 25.0;

/// The vertical that the cameras' x axes span a plane orthogonal to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Straightened {
    /// Down, in the common frame.
    pub down: Vector3<f64>,
    /// Whether the x axes point in sufficiently different directions; otherwise `down` is the mean of the y axes,
    /// freed of the x direction.
    pub conditioned: bool,
}

/// The vertical that makes the cameras' x axes horizontal.
///
/// # Source
/// Brown and Lowe, Automatic Panoramic Image Stitching using Invariant Features, section 5: the eigenvector of least
/// eigenvalue of sum x_i x_i^T.
///
/// # Departures
/// With parallel x axes (one photograph, a tiny pan, a vertical sweep) that eigenvector is arbitrary; the mean of the y
/// axes, made orthogonal to the mean x axis, takes its place.
pub(crate) fn straighten(rotations: &[Matrix3<f64>]) -> Straightened {
    let y_sum: Vector3<f64> = rotations.iter().map(|rotation| rotation.row(1).transpose()).sum();
    let eigen = level_moment(rotations, 0.0).symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let second = eigen.eigenvalues.iter().enumerate().filter(|&(k, _)| k != least).map(|(_, &value)| value);
    let second = second.fold(f64::INFINITY, f64::min) / rotations.len().max(1) as f64;
    if second >= CONDITIONED {
        let axis: Vector3<f64> = eigen.eigenvectors.column(least).into_owned();
        let down = if axis.dot(&y_sum) > 0.0 { axis } else { -axis };
        return Straightened { down, conditioned: true };
    }
    let greatest: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let down = (y_sum - greatest * y_sum.dot(&greatest)).try_normalize(f64::EPSILON).unwrap_or_else(Vector3::y);
    Straightened { down, conditioned: false }
}

/// Variance of the roll over that of the pitch among photographers, where none is told.
///
/// On short sweeps with a roll of 5 degrees it divides the error of the vertical by about three; on full circles it
/// changes little, since the pitch is common to all directions.
pub(crate) const PITCH_PRIOR: f64 = 0.1;

/// [`straighten`] for cameras that are expected to look level as well, though `pitch_prior` times less surely than not
/// to be rolled: the eigenvector of least eigenvalue of sum x_i x_i^T + `pitch_prior` z_i z_i^T. The vertical in the
/// common frame, pointing down.
///
/// The x axes of two photographs contradict no direction: if one was rolled, what both are orthogonal to lies near the
/// line of sight. Farther than [`MAX_PAIR_ANGLE_DEG`] from the mean of their y axes, that mean takes its place.
///
/// A prior of 0 yields [`straighten`].
pub(crate) fn straighten_with_pitch(rotations: &[Matrix3<f64>], pitch_prior: f64) -> Vector3<f64> {
    if pitch_prior <= 0.0 {
        return straighten(rotations).down;
    }
    let eigen = level_moment(rotations, pitch_prior).symmetric_eigen();
    let axis: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let y_sum: Vector3<f64> = rotations.iter().map(|rotation| rotation.row(1).transpose()).sum();
    let down = if axis.dot(&y_sum) > 0.0 { axis } else { -axis };
    match y_sum.try_normalize(f64::EPSILON) {
        Some(mean) if rotations.len() == 2 && down.angle(&mean).to_degrees() > MAX_PAIR_ANGLE_DEG => mean,
        _ => down,
    }
}

/// sum x_i x_i^T + `pitch_prior` z_i z_i^T over the cameras' x and viewing axes, in the common frame.
pub(crate) fn level_moment(rotations: &[Matrix3<f64>], pitch_prior: f64) -> Matrix3<f64> {
    let moments = rotations.iter().map(|rotation| {
        let (x, z) = (rotation.row(0).transpose(), rotation.row(2).transpose());
        x * x.transpose() + z * z.transpose() * pitch_prior
    });
    moments.sum()
}

/// The rotation from the common frame to the level world: `down` becomes y, and the mean viewing direction lies in the
/// plane of y and z.
///
/// # Departures
/// OpenCV's wave correction chooses x so that the cameras' x axes point to positive x; with `down` signed by the y axes
/// the mean viewing direction does the same without a case distinction.
pub(crate) fn level_from_world(down: &Vector3<f64>, rotations: &[Matrix3<f64>]) -> Matrix3<f64> {
    /// Viewing directions that cancel out (a full circle) leave the yaw to the first photograph.
    const CANCELLED: f64 = 1e-6;
    let ahead: Vector3<f64> = rotations.iter().map(|rotation| rotation.row(2).transpose()).sum();
    let horizontal = |direction: Vector3<f64>| direction - down * direction.dot(down);
    let first = rotations.first().map_or_else(Vector3::z, |rotation| rotation.row(2).transpose());
    let z = horizontal(ahead)
        .try_normalize(CANCELLED)
        .or_else(|| horizontal(first).try_normalize(CANCELLED))
        .unwrap_or_else(|| orthonormal_complement(down).0);
    let x = down.cross(&z);
    Matrix3::from_rows(&[x.transpose(), down.transpose(), z.transpose()])
}

/// The rotation that levels the common frame by the cameras alone; y down, the mean viewing direction above
/// z.
pub(crate) fn level_by_cameras(cameras: &[Camera]) -> Matrix3<f64> {
    let rotations: Vec<Matrix3<f64>> = cameras.iter().map(|camera| camera.rotation()).collect();
    level_from_world(&straighten(&rotations).down, &rotations)
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    const PITCH_PRIOR: f64 = 0.1;

    /// By symmetry the level of two photographs at the same place, of which one is rolled by 30 degrees, is rolled
    /// by 15.
    #[test]
    fn one_of_two_that_is_rolled_does_not_turn_down_into_the_scene() {
        let rotations = [Matrix3::identity(), rotation_about_z(30_f64.to_radians())];
        let level = straighten_with_pitch(&rotations, PITCH_PRIOR);
        assert!((level.angle(&Vector3::y()).to_degrees() - 15.0).abs() < 1e-9, "{level}");
        assert!(level.z.abs() < 1e-12);
    }

    /// The prior on the pitch leaves half of it: their y axes are 23 degrees off.
    #[test]
    fn two_that_look_up_are_levelled_by_half() {
        let rotations = [-0.3, 0.3].map(|yaw| rotation_about_x(-0.4) * rotation_about_y(yaw));
        let level = straighten_with_pitch(&rotations, PITCH_PRIOR);
        assert!((10.0..14.0).contains(&level.angle(&Vector3::y()).to_degrees()), "{level}");
    }
}
