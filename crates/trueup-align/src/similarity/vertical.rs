//! Which dominant direction is the vertical, and what roll a vertical means for a photograph.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::roll_from_down;

use super::held::improbability;
use super::signed_permutation::match_triad;

/// Sine of the angle to the viewing direction below which the vertical says nothing of the roll: sin 15 degrees.
const MIN_SINE: f64 = 0.258_819_045_102_520_74;

/// The column of `frame` that is the scene's vertical, pointing down. All in one common frame; `rotations` take it to
/// each camera.
///
/// # Departures
/// The paper takes, in the reference camera's frame, the nearest world axis (eq. 5), without signs or a one-to-one
/// rule; that fails for steep references. Here: the direction by which all cameras are most probably held, little
/// rolled but for some that were turned on purpose, and about level. No reference takes part.
pub(super) fn vertical_of(frame: &Matrix3<f64>, rotations: &[Matrix3<f64>]) -> Vector3<f64> {
    let improbabilities: [f64; 3] = std::array::from_fn(|k| improbability(&frame.column(k).into_owned(), rotations));
    let order = |&a: &usize, &b: &usize| improbabilities[a].total_cmp(&improbabilities[b]);
    let vertical = frame.column((0..3).min_by(order).unwrap_or(1)).into_owned();
    let along_y: f64 = rotations.iter().map(|rotation| (rotation * vertical).y).sum();
    if along_y > 0.0 { vertical } else { -vertical }
}

/// The column of `frame` that lies nearest to `expected`, or its opposite, whichever points the same way.
pub(super) fn vertical_near(frame: &Matrix3<f64>, expected: &Vector3<f64>) -> Vector3<f64> {
    let along = frame.tr_mul(expected);
    let nearest = along.iamax();
    frame.column(nearest) * along[nearest].signum()
}

/// The column of `frame` that lies nearest to the y axis of the `reference` camera, pointing down: the paper's eq. 5.
///
/// # Departures
/// The paper takes for each direction the nearest of the world's axes, which heeds no sign and may take one axis twice,
/// so that its M has no inverse; here one axis goes to one direction, whatever its sign, for the largest sum of
/// cosines.
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
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    /// Two photographs of a wall, one turned by 45 degrees: the depth of the scene is orthogonal to both x axes, and no
    /// vertical. By hand: the vertical's x is 0 and sin 45 degrees, so that its mean sin^2 is 1/4; that of the
    /// horizontal is 3/4.
    #[test]
    fn the_line_of_sight_is_no_vertical() {
        let rotations = [rotation_about_y(-0.1), rotation_about_z(45_f64.to_radians()) * rotation_about_y(0.1)];
        let down = vertical_of(&Matrix3::identity(), &rotations);
        assert!(down.angle(&Vector3::y()) < 1e-12, "{down}");
    }

    /// One of two photographs is turned by a quarter, so that both rolls are as probable; by the depth of the scene as
    /// vertical they would look up by 70 and 45 degrees.
    #[test]
    fn of_photographs_turned_against_each_other_those_that_look_level_tell() {
        for turned_deg in [-90.0_f64, -75.0, 75.0, 90.0] {
            let views = [20.0_f64, 45.0].map(|yaw_deg| rotation_about_y(yaw_deg.to_radians()));
            let rotations = [rotation_about_z(0.03) * views[0], rotation_about_z(turned_deg.to_radians()) * views[1]];
            let down = vertical_of(&Matrix3::identity(), &rotations);
            assert!(down.angle(&Vector3::y()) < 1e-12, "{turned_deg}: {down}");
        }
    }

    #[test]
    fn steep_photographs_keep_their_vertical() {
        for pitch_deg in [-40.0_f64, -20.0, 20.0, 40.0] {
            let rotations =
                [-0.5, 0.0, 0.5].map(|yaw| rotation_about_x(pitch_deg.to_radians()) * rotation_about_y(yaw));
            let down = vertical_of(&Matrix3::identity(), &rotations);
            assert!(down.angle(&Vector3::y()) < 1e-12, "{pitch_deg}: {down}");
        }
    }
}
