//! Which dominant direction is the vertical, and what roll a vertical means for a photograph.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::roll_from_down;

use super::signed_permutation::match_triad;

/// Difference of mean squared sines of the roll within which two directions would leave the cameras equally rolled.
const TIE: f64 = 0.05;
/// Squared sine of the angle to the viewing direction below which a direction counts for little in a camera's roll: 10 degrees.
/// Of 1,500 drawn pairs, one rolled by 20 to 60 degrees, 2 % then take a wrong direction (74 % by the distance from the x axes
/// alone), and of 2,500 drawn rows looking 40 to 90 degrees up or down as many as by that.
const ALONG_THE_VIEW: f64 = 0.030_153_689_607_045_8;
/// Sine of the angle to the viewing direction below which the vertical says nothing of the roll: sin 15 degrees.
const MIN_SINE: f64 = 0.258_819_045_102_520_74;

/// The column of `frame` that is the scene's vertical, pointing down. All in one common frame; `rotations` take it to
/// each camera.
///
/// # Departures
/// The paper takes, in the reference camera's frame, the nearest world axis (eq. 5), without signs or a one-to-one
/// rule; that fails for steep references. Here: the direction by which the cameras are rolled least, in the mean of
/// squared sines, since people seldom twist the camera; among near equals the one closer to the cameras' y axes. What a
/// camera looks along tells little of its roll, and counts the less the nearer. No reference takes part.
pub(super) fn vertical_of(frame: &Matrix3<f64>, rotations: &[Matrix3<f64>]) -> Vector3<f64> {
    let count = rotations.len().max(1) as f64;
    let mut rolled = [0.0; 3];
    let mut along_y = [0.0; 3];
    let mut signed_y = [0.0; 3];
    for rotation in rotations {
        let in_camera = rotation * frame;
        for k in 0..3 {
            let (x, y) = (in_camera[(0, k)], in_camera[(1, k)]);
            rolled[k] += x * x / (x * x + y * y + ALONG_THE_VIEW) / count;
            along_y[k] += in_camera[(1, k)].abs() / count;
            signed_y[k] += in_camera[(1, k)];
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| rolled[a].total_cmp(&rolled[b]));
    let tie = rolled[order[1]] - rolled[order[0]] < TIE && along_y[order[1]] > along_y[order[0]];
    let vertical = if tie { order[1] } else { order[0] };
    frame.column(vertical) * if signed_y[vertical] > 0.0 { 1.0 } else { -1.0 }
}

/// The column of `frame` that lies nearest to the y axis of the `reference` camera, pointing down: the paper's eq. 5.
///
/// # Departures
/// The paper takes for each direction the nearest of the world's axes, which heeds no sign and may take one axis twice,
/// so that its M has no inverse; here one axis goes to one direction, whatever its sign, for the largest sum of cosines.
pub(super) fn vertical_by_reference(frame: &Matrix3<f64>, reference: &Matrix3<f64>) -> Vector3<f64> {
    // The world's axes are those of the reference camera.
    let (down, _) = match_triad(&reference.transpose(), frame);
    down.column(1).into_owned()
}

/// The roll of a camera that sees "down" in direction `down` of its own frame: atan2(g_x, g_y), positive when the
/// photograph must be turned clockwise to stand upright. `None` if the camera looks within 15 degrees of straight up or
/// down.
pub(super) fn roll_of(down: &Vector3<f64>) -> Option<f64> {
    (down.x.hypot(down.y) >= MIN_SINE * down.norm()).then(|| roll_from_down(down))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    /// Cameras from the level world by turns, pitches and rolls in degrees.
    fn cameras(angles: &[[f64; 3]]) -> Vec<Matrix3<f64>> {
        let camera = |&[yaw, pitch, roll]: &[f64; 3]| {
            rotation_about_z(roll.to_radians())
                * rotation_about_x(pitch.to_radians())
                * rotation_about_y(yaw.to_radians())
        };
        angles.iter().map(camera).collect()
    }

    fn is_found(angles: &[[f64; 3]]) -> bool {
        (vertical_of(&Matrix3::identity(), &cameras(angles)) - Vector3::y()).norm() < 1e-12
    }

    #[test]
    fn one_of_two_photographs_may_be_rolled() {
        for roll in [0.0, 20.0, 30.0, 45.0, 60.0] {
            assert!(is_found(&[[-12.0, 0.0, 0.0], [12.0, 0.0, roll]]), "{roll}");
            assert!(is_found(&[[-20.0, 3.0, 1.0], [15.0, -4.0, -roll]]), "{roll}");
        }
    }

    #[test]
    fn steep_rows_keep_their_vertical() {
        for pitch in [-65.0, -50.0, 50.0, 65.0] {
            assert!(is_found(&[-60.0, -30.0, 0.0, 30.0, 60.0].map(|yaw| [yaw, pitch, 0.0])), "{pitch}");
        }
    }

    proptest! {
        /// Rows as people take them, whichever way they begin.
        #[test]
        fn rows_are_upright(start in 0.0..360.0_f64, step in 15.0..40.0_f64, pitch in -30.0..30.0_f64, roll in -8.0..8.0_f64) {
            let row: Vec<[f64; 3]> = (0..5).map(|k| [start + step * f64::from(k), pitch, roll]).collect();
            prop_assert!(is_found(&row));
        }
    }
}
