//! Photographs that all lie on their side: by the way the camera went.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{Matrix3, Vector3};
use trueup_core::camera::Camera;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::geometry::orthonormal_complement;

/// Photographs sweep farther than this only about the vertical: up and down, people look from 30 degrees below the
/// horizon to the zenith at most. Degrees.
const LEAST_SWEEP_DEG: f64 = 125.0;

/// Most that the axis of the sweep may lean to the side of a photograph that lies on its side: people hold the camera
/// level to a few degrees, and tilt it up and down by more. Degrees.
const MOST_LEAN_DEG: f64 = 30.0;

/// Fewer photographs make no sweep.
const FEWEST: usize = 3;

/// A warning if the camera went all its way along the photographs' own up and down, farther than anybody looks up and
/// down: then the vertical lies along their rows, and lines that are upright beside it are level in truth. None if
/// `down`, which the panorama was leveled by, lies along their rows.
pub(crate) fn warning(cameras: &[Camera], down: &Vector3<f64>, members: &[usize]) -> Option<Diagnostic> {
    let first = *members.first()?;
    let SideSweep { axis, sweep } = SideSweep::of(cameras)?;
    if axis.dot(down).abs() > FRAC_1_SQRT_2 {
        return None;
    }
    Some(Diagnostic::warning(
        "photographs-on-side",
        Subject::Photograph(first),
        format!(
            "it and all the others lie on their side, it seems: the camera turned by {sweep:.0} degrees along their columns, and \
             nobody looks so far up and down; the panorama lies on its side, too"
        ),
        "Turn the photographs by a quarter and stitch them again, for example with `exiftool -Orientation#=6 photo.jpg` (or 8).",
    ))
}

/// How the camera turned about an axis along the rows of all photographs, by more than people look up and down.
struct SideSweep {
    /// The axis in the cameras' world.
    axis: Vector3<f64>,
    /// By how many degrees.
    sweep: f64,
}

impl SideSweep {
    fn of(cameras: &[Camera]) -> Option<Self> {
        if cameras.len() < FEWEST {
            return None;
        }
        // Rows of the rotation from world to camera are the camera's own axes in the world.
        let axis = |row: usize| move |camera: &Camera| Vector3::from(camera.camera_from_world[row]);
        let views: Vec<Vector3<f64>> = cameras.iter().map(axis(2)).collect();
        let moment: Matrix3<f64> = views.iter().map(|view| view * view.transpose()).sum();
        let eigen = moment.symmetric_eigen();
        let turned_about = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let least = MOST_LEAN_DEG.to_radians().cos();
        if !cameras.iter().map(axis(0)).all(|rows| rows.dot(&turned_about).abs() >= least) {
            return None;
        }
        let (along, across) = orthonormal_complement(&turned_about);
        let mut angles: Vec<f64> = views.iter().map(|view| view.dot(&across).atan2(view.dot(&along))).collect();
        angles.sort_by(f64::total_cmp);
        let around = angles.first()? + std::f64::consts::TAU - angles.last()?;
        let widest_gap = angles.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max);
        let sweep = (std::f64::consts::TAU - widest_gap).to_degrees();
        (sweep >= LEAST_SWEEP_DEG).then_some(Self { axis: turned_about, sweep })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;

    /// Cameras that turn about the vertical, each rolled and pitched, their pixels turned by `quarter` quarters.
    fn cameras(count: usize, step_deg: f64, quarter: f64) -> Vec<Camera> {
        let camera = |k: usize| {
            let wobble = (k as f64 * 2.4).sin();
            let yaw = Rotation3::from_axis_angle(&Vector3::y_axis(), (k as f64 * step_deg).to_radians());
            let pitch = Rotation3::from_axis_angle(&Vector3::x_axis(), (8.0 * wobble).to_radians());
            let roll = (3.0 * wobble + 90.0 * quarter).to_radians();
            let roll = Rotation3::from_axis_angle(&Vector3::z_axis(), roll);
            Camera::new(500.0, 640.0, 480.0, (roll * pitch * yaw).matrix())
        };
        (0..count).map(camera).collect()
    }

    fn sweep_on_side(cameras: &[Camera]) -> Option<f64> {
        SideSweep::of(cameras).map(|found| found.sweep)
    }

    #[test]
    fn photographs_that_all_lie_on_their_side_are_told() {
        for quarter in [1.0, -1.0] {
            let found = sweep_on_side(&cameras(8, 20.0, quarter)).expect("on their side");
            assert!((found - 140.0).abs() < 3.0, "{found}");
            assert!(sweep_on_side(&cameras(12, 30.0, quarter)).is_some(), "a full turn");
        }
        // The panorama lies on its side, too; or it stands upright, as they turned about what is down.
        let told_if_down_is = |down| warning(&cameras(8, 20.0, 1.0), &down, &[4, 5, 6, 7, 8, 9, 10, 11]);
        assert_eq!(told_if_down_is(Vector3::y()), None);
        let told = told_if_down_is(Vector3::x()).expect("a warning");
        assert_eq!((told.code.as_str(), told.subject), ("photographs-on-side", Subject::Photograph(4)));
    }

    #[test]
    fn upright_ones_and_short_sweeps_are_left_alone() {
        for quarter in [0.0, 2.0] {
            assert_eq!(sweep_on_side(&cameras(12, 30.0, quarter)), None);
            assert_eq!(sweep_on_side(&cameras(8, 20.0, quarter)), None);
        }
        // From the ground to the zenith: a tower.
        assert_eq!(sweep_on_side(&cameras(6, 20.0, 1.0)), None);
        assert_eq!(sweep_on_side(&cameras(2, 170.0, 1.0)), None);
        assert_eq!(sweep_on_side(&[]), None);
    }
}
