//! Which dominant direction is the vertical, and what roll a vertical means for a photograph.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::roll_from_down;

use super::signed_permutation::match_triad;

/// Difference of mean squared cosines within which two directions are equally perpendicular to the cameras' x axes.
const TIE: f64 = 0.05;
/// Sine of the angle to the viewing direction below which the vertical says nothing of the roll: sin 15 degrees.
const MIN_SINE: f64 = 0.258_819_045_102_520_74;

/// The column of `frame` that is the scene's vertical, pointing down. All in one common frame; `rotations` take it to
/// each camera.
///
/// # Departures
/// The paper takes, in the reference camera's frame, the nearest world axis (eq. 5), without signs or a one-to-one
/// rule; that fails for steep references. Here: the direction most perpendicular to the x axes of all cameras, since
/// people do not twist the camera; among near equals the one closer to the cameras' y axes. No reference takes part.
pub(super) fn vertical_of(frame: &Matrix3<f64>, rotations: &[Matrix3<f64>]) -> Vector3<f64> {
    let count = rotations.len().max(1) as f64;
    let mut along_x = [0.0; 3];
    let mut along_y = [0.0; 3];
    let mut signed_y = [0.0; 3];
    for rotation in rotations {
        let in_camera = rotation * frame;
        for k in 0..3 {
            along_x[k] += in_camera[(0, k)].powi(2) / count;
            along_y[k] += in_camera[(1, k)].abs() / count;
            signed_y[k] += in_camera[(1, k)];
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| along_x[a].total_cmp(&along_x[b]));
    let tie = along_x[order[1]] - along_x[order[0]] < TIE && along_y[order[1]] > along_y[order[0]];
    let vertical = if tie { order[1] } else { order[0] };
    frame.column(vertical) * if signed_y[vertical] > 0.0 { 1.0 } else { -1.0 }
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
