//! Which way is up on a plane: by the lines on it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;
use trueup_core::lines::LineSegment;

use super::plane_camera::PlaneCamera;

/// Farthest that lines may turn the plane from where the photographs' own up and down have it, radians: 8 degrees. Most
/// people hold a camera straighter in the mean, and put paper straighter on a scanner.
const FARTHEST: f64 = 0.14;
/// Distance from the commonest direction up to which a line agrees with it, radians: half a degree.
const AGREES: f64 = 0.0087;
/// Steps in which directions are tried, radians: a twentieth of a degree.
const STEP: f64 = 8.7e-4;
/// Times that lines agree with the commonest direction more often than if they lay at random.
const STANDS_OUT: f64 = 4.0;
/// Shortest line that is asked, in diagonals of its photograph: shorter ones are letters and leaves.
const SHORTEST: f64 = 0.03;

/// A line's direction on the plane, and what it counts for.
struct Direction {
    /// From the nearer of the plane's two axes, clockwise, in -pi/4 to pi/4.
    angle: f64,
    /// Its length in the photograph, diagonals.
    weight: f64,
}

/// The clockwise turn, radians, that brings most lines along the rows or columns of the plane; `None` where they do not
/// agree, or agree on a turn of more than [`FARTHEST`].
pub(super) fn turn_by_lines(cameras: &[PlaneCamera], lines: &[Vec<LineSegment>]) -> Option<f64> {
    let directions: Vec<Direction> = cameras
        .iter()
        .zip(lines)
        .flat_map(|(camera, lines)| lines.iter().filter_map(|line| direction(camera, line)))
        .collect();
    let all: f64 = directions.iter().map(|one| one.weight).sum();
    let apart = |one: &Direction, at: f64| {
        let apart = (one.angle - at).rem_euclid(FRAC_PI_2);
        apart.min(FRAC_PI_2 - apart)
    };
    let agreeing =
        |at: f64| -> f64 { directions.iter().filter(|one| apart(one, at) <= AGREES).map(|one| one.weight).sum() };
    let steps = (FRAC_PI_2 / STEP).round() as usize;
    let tried = (0..steps).map(|step| (step as f64 / steps as f64 - 0.5) * FRAC_PI_2);
    // The commonest of all directions, not of those near: a plane that lies aslant is left so.
    let (most, commonest) =
        tried.map(|at| (agreeing(at), at)).fold((0.0, 0.0), |best, one| if one.0 > best.0 { one } else { best });
    let at_random = all * 2.0 * AGREES / FRAC_PI_2;
    if commonest.abs() > FARTHEST || most < STANDS_OUT * at_random || most == 0.0 {
        return None;
    }
    let offset: f64 = directions
        .iter()
        .filter(|one| apart(one, commonest) <= AGREES)
        .map(|one| {
            let off = (one.angle - commonest + FRAC_PI_2 / 2.0).rem_euclid(FRAC_PI_2) - FRAC_PI_2 / 2.0;
            off * one.weight
        })
        .sum();
    Some(-(commonest + offset / most))
}

fn direction(camera: &PlaneCamera, line: &LineSegment) -> Option<Direction> {
    let [width, height] = camera.camera.principal_point.map(|coordinate| 2.0 * coordinate);
    let weight = line.length() / width.hypot(height);
    if weight < SHORTEST {
        return None;
    }
    let along = camera.place(Vector2::from(line.end))? - camera.place(Vector2::from(line.start))?;
    let angle = (along.y.atan2(along.x) + FRAC_PI_2 / 2.0).rem_euclid(FRAC_PI_2) - FRAC_PI_2 / 2.0;
    Some(Direction { angle, weight })
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::camera::Camera;

    use super::*;

    fn camera() -> PlaneCamera {
        let camera = Camera::new(1000.0, 800.0, 600.0, &Matrix3::identity());
        PlaneCamera { camera, axis_point: [0.0, 0.0], distance: 1000.0 }
    }

    /// From the photograph's middle, `degrees` clockwise from the right.
    fn line(degrees: f64, length: f64) -> LineSegment {
        let along = Vector2::new(degrees.to_radians().cos(), degrees.to_radians().sin()) * length;
        LineSegment {
            start: [400.0, 300.0],
            end: [400.0 + along.x, 300.0 + along.y],
            width_px: 1.0,
            significance: 10.0,
        }
    }

    #[test]
    fn rows_and_columns_that_lean_by_three_degrees_are_turned_back() {
        let mut lines = vec![line(3.1, 100.0), line(93.0, 200.0), line(2.9, 100.0), line(-177.0, 90.0)];
        // All round, and letters.
        lines.extend((0..30).map(|k| line(f64::from(k) * 12.0 + 1.0, 50.0)));
        lines.extend((0..300).map(|_| line(-5.0, 20.0)));
        let turn = turn_by_lines(&[camera()], &[lines]).expect("they agree");
        assert!((turn.to_degrees() + 3.0).abs() < 0.06, "{}", turn.to_degrees());
    }

    #[test]
    fn lines_all_round_and_lines_aslant_turn_nothing() {
        let all_round: Vec<LineSegment> = (0..90).map(|k| line(f64::from(k) * 4.0, 100.0)).collect();
        assert_eq!(turn_by_lines(&[camera()], &[all_round]), None);
        assert_eq!(turn_by_lines(&[camera()], &[vec![line(20.0, 100.0); 5]]), None);
        assert_eq!(turn_by_lines(&[camera()], &[Vec::new()]), None);
    }
}
