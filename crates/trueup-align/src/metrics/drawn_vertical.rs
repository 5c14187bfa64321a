//! How far what stands upright leans where a panorama draws it.

use nalgebra::{Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::{circular_mean, roll_from_down};
use trueup_core::lines::LineSegment;
use trueup_core::mesh::GridMesh;

use crate::vanishing::FULL_WEIGHT_LENGTH_PX;

/// Sine of the angle from straight up or down (20 degrees) within which nothing is seen to stand: plumb lines go all
/// ways there, and a length of one reaches to the other side.
const NEAR_PLUMB: f64 = 0.342_020_143_325_668_7;

/// How far plumb lines of a photograph lean clockwise in the panorama, radians in [-pi, pi): the mean over `segments`,
/// the upright ones of the photograph, in the pixels of `mesh` and `camera`, each weighed by its length as it votes for
/// a direction.
///
/// Not the segments lean, which are found with an error each, but plumb lines in their places and of their lengths, as
/// `down`, the vertical in the camera's frame (a unit vector), has them. `None` where the panorama shows none of them
/// but straight above and below.
pub fn drawn_lean(mesh: &GridMesh, camera: &Camera, down: &Vector3<f64>, segments: &[LineSegment]) -> Option<f64> {
    let drawn = |segment: &LineSegment| {
        let middle = Vector2::from(segment.start).lerp(&segment.end.into(), 0.5);
        let bearing = camera.bearing(middle);
        if bearing.normalize().cross(down).norm() < NEAR_PLUMB {
            return None;
        }
        let toward = camera.projection_derivatives(bearing)?.by_bearing * down;
        let half = toward.try_normalize(f64::MIN_POSITIVE)? * (segment.length() / 2.0);
        let along = mesh.warp(middle + half) - mesh.warp(middle - half);
        // What is not shown is not a number, and a comparison with that is false.
        let shown = along.norm_squared() > 0.0;
        let weight = segment.length().min(FULL_WEIGHT_LENGTH_PX);
        shown.then(|| (-roll_from_down(&along.push(0.0)), weight))
    };
    circular_mean(segments.iter().filter_map(drawn))
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    const SIDE_PX: f64 = 400.0;

    fn plumb(x: f64, from: f64, to: f64) -> LineSegment {
        LineSegment { start: [x, from], end: [x, to], width_px: 2.0, significance: 10.0 }
    }

    fn camera() -> Camera {
        Camera::new(SIDE_PX, SIDE_PX, SIDE_PX, &Matrix3::identity())
    }

    fn sheared(by: impl Fn(f64) -> f64) -> GridMesh {
        let mut mesh = GridMesh::regular(SIDE_PX, SIDE_PX, 40.0);
        for vertex in &mut mesh.target {
            vertex[0] -= by(vertex[0]) * vertex[1];
        }
        mesh
    }

    /// The camera looks 60 degrees down: 10 degrees beside the foot of the plumb line, lines tell nothing.
    #[test]
    fn what_lies_straight_below_does_not_stand() {
        let down = Vector3::new(0.0, 0.5, 0.75_f64.sqrt());
        let lean = |y: f64| drawn_lean(&sheared(|_| 0.1), &camera(), &down, &[plumb(200.0, y - 10.0, y + 10.0)]);
        // tan 20 degrees is 0.364.
        assert_eq!(lean(200.0 + 0.364 * SIDE_PX), None);
        // At tan 5 degrees, by hand: atan 0.1 to the left below.
        let upper = lean(200.0 + 0.0875 * SIDE_PX).expect("stands");
        assert!((upper - 0.1_f64.atan()).abs() < 1e-3, "{upper}");
    }

    /// The left half of the photograph stands upright, in the right half what points down is drawn to the left by a
    /// tenth. By hand: lines of 60 and 180 px, which count for 120, in either: a third of nothing and two thirds of
    /// atan 0.1, as sums of unit vectors.
    #[test]
    fn what_leans_counts_where_upright_lines_are() {
        let mesh = sheared(|x| if x > 200.0 { 0.1 } else { 0.0 });
        let lean = |segments: &[LineSegment]| drawn_lean(&mesh, &camera(), &Vector3::y(), segments).expect("shown");
        let (left, right) = (plumb(100.0, 100.0, 160.0), plumb(300.0, 100.0, 280.0));
        assert!(lean(&[left]).abs() < 1e-12);
        assert!((lean(&[right]) - 0.1_f64.atan()).abs() < 1e-12);
        let angle = 0.1_f64.atan();
        let expected = (2.0 * angle.sin()).atan2(1.0 + 2.0 * angle.cos());
        assert!((lean(&[left, right]) - expected).abs() < 1e-12, "{}", lean(&[left, right]));
    }

    /// A camera that looks up: plumb lines meet. By hand: with down = (0, cos p, -sin p), what is x to the right of the
    /// middle points by (x sin p, f cos p) down, and so leans to the left by the arc tangent of x / f tan p.
    #[test]
    fn plumb_lines_of_a_raised_camera_meet() {
        let pitch = 0.2_f64;
        let down = Vector3::new(0.0, pitch.cos(), -pitch.sin());
        let mesh = sheared(|_| 0.0);
        let lean = drawn_lean(&mesh, &camera(), &down, &[plumb(300.0, 190.0, 210.0)]).expect("shown");
        assert!((lean + (0.25 * pitch.tan()).atan()).abs() < 1e-12, "{lean}");
    }

    #[test]
    fn what_is_not_shown_has_no_lean() {
        let mut mesh = sheared(|_| 0.0);
        mesh.target.fill([f64::NAN; 2]);
        assert_eq!(drawn_lean(&mesh, &camera(), &Vector3::y(), &[plumb(100.0, 100.0, 160.0)]), None);
        assert_eq!(drawn_lean(&sheared(|_| 0.0), &camera(), &Vector3::y(), &[]), None);
    }
}
