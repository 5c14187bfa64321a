//! Which lines of a photograph are vertical ones.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::lines::LineSegment;
use trueup_core::source::WorkingFrame;

use crate::vanishing::{FULL_WEIGHT_LENGTH_PX, InterpretationPlanes, VERTICAL_LINE_DEG};

/// Steps of the search for the vertical, each with a smaller scale of the robust loss, then as many at the last scale.
const STEPS: usize = 10;
/// Sine of the angle between viewing direction and vertical below which a photograph has no upright: sin 15 degrees.
const MIN_SINE: f64 = 0.258_819_045_102_520_74;

/// A photograph whose vertical lines are sought, in the working pixels of `frame`.
#[derive(Debug, Clone, Copy)]
pub struct VerticalLinesInput<'a> {
    /// All segments found.
    pub lines: &'a [LineSegment],
    /// The working frame.
    pub frame: &'a WorkingFrame,
    /// The camera of that frame.
    pub camera: &'a Camera,
    /// Where the cameras expect down, in the camera's frame: a unit vector. Segments decide where it is.
    pub expected_down: Vector3<f64>,
}

/// Which of a photograph's segments are its vertical lines, by their positions in `photograph.lines`, ascending.
///
/// The vertical vanishing direction is the one that the photograph's segments point to nearest to where it is expected,
/// by iteratively reweighted least squares on the segments' interpretation planes; its lines are those within 1.5
/// degrees. Empty if they point to no such direction, or if the photograph looks within 15 degrees of straight up or
/// down, where there is no upright.
pub fn vertical_segments(photograph: &VerticalLinesInput) -> Vec<usize> {
    let planes = InterpretationPlanes::new(photograph.lines, photograph.camera, photograph.frame);
    let found = vertical_direction(&planes, &photograph.expected_down);
    // Not a number is no direction either.
    let Some(down) = found.filter(|down| down.x.hypot(down.y) >= MIN_SINE) else { return Vec::new() };
    pointing_down(&planes, &down)
}

/// Which of a photograph's segments carry a vertical that is known, by their positions in `photograph.lines`,
/// ascending: those within 1.5 degrees of `photograph.expected_down`.
///
/// Empty if there are fewer than three, or no more than segments of any direction would show by chance, at 99 %; and
/// where there is no upright, as for [`vertical_segments`].
pub fn carrying_segments(photograph: &VerticalLinesInput) -> Vec<usize> {
    let Some(down) = photograph.expected_down.try_normalize(f64::MIN_POSITIVE) else { return Vec::new() };
    let planes = InterpretationPlanes::new(photograph.lines, photograph.camera, photograph.frame);
    let segments = if down.xy().norm() >= MIN_SINE { pointing_down(&planes, &down) } else { Vec::new() };
    if segments.len() >= fewest_carrying(planes.len()) { segments } else { Vec::new() }
}

/// How many of so many segments must point to the vertical: three, and more than chance lets of segments that point
/// anywhere, at 99 %.
fn fewest_carrying(segments: usize) -> usize {
    /// As many make a direction elsewhere, too; two cross in one whatever they are.
    const LEAST: usize = 3;
    /// Of a normal distribution 99 % lie below so many standard deviations.
    const NORMAL_99: f64 = 2.326_348;
    // Either side of the direction, of half a turn.
    let share = 2.0 * VERTICAL_LINE_DEG / 180.0;
    let expected = segments as f64 * share;
    let by_chance = expected + NORMAL_99 * (expected * (1.0 - share)).sqrt();
    LEAST.max(by_chance.floor() as usize + 1)
}

/// The segments within 1.5 degrees of `down`, a unit vector.
fn pointing_down(planes: &InterpretationPlanes, down: &Vector3<f64>) -> Vec<usize> {
    let tolerance = VERTICAL_LINE_DEG.to_radians().sin();
    let points_down = |plane: &usize| planes.normals[*plane].dot(down).abs() <= tolerance;
    let mut segments: Vec<usize> = (0..planes.len()).filter(points_down).map(|plane| planes.indices[plane]).collect();
    segments.sort_unstable();
    segments
}

/// Which of three directions each of a photograph's segments points to: the nearest of `directions` (in the camera's
/// frame, of unit length), within 1.5 degrees of the segment's interpretation plane. An entry for every segment of
/// `lines`, which are in the working pixels of `camera`; `None` where it points to none of them.
pub fn directions_of_segments(
    lines: &[LineSegment],
    camera: &Camera,
    directions: &[Vector3<f64>; 3],
) -> Vec<Option<usize>> {
    let tolerance = VERTICAL_LINE_DEG.to_radians().sin();
    let pointed_to = |line: &LineSegment| {
        let [start, end] = [line.start, line.end].map(|end| camera.bearing(Vector2::from(end)));
        let normal = start.cross(&end).try_normalize(f64::MIN_POSITIVE)?;
        let off = |direction: usize| normal.dot(&directions[direction]).abs();
        (0..3).min_by(|&one, &two| off(one).total_cmp(&off(two))).filter(|&nearest| off(nearest) <= tolerance)
    };
    lines.iter().map(pointed_to).collect()
}

/// The direction that the segments' planes share, near the expected one, down in the camera's frame.
fn vertical_direction(planes: &InterpretationPlanes, expected: &Vector3<f64>) -> Option<Vector3<f64>> {
    /// Scale of the robust loss at the beginning of the search, about where the cameras expect the vertical, degrees.
    const FIRST_SCALE_DEG: f64 = 8.0;
    /// Scale of the robust loss at its end: about how well plumb lines agree, degrees.
    const LAST_SCALE_DEG: f64 = 0.5;
    /// How surely the vertical is expected there, where a photograph's own lines leave it open, degrees.
    const EXPECTATION_DEG: f64 = 10.0;
    /// A photograph whose lines find it farther from there has no vertical lines, degrees.
    const FARTHEST_DEG: f64 = 20.0;
    let (first, last) = (FIRST_SCALE_DEG.to_radians(), LAST_SCALE_DEG.to_radians());
    let prior = (last / EXPECTATION_DEG.to_radians()).powi(2);
    let mut down = expected.try_normalize(f64::MIN_POSITIVE)?;
    let anchor = (Matrix3::identity() - down * down.transpose()) * prior;
    for step in 0..2 * STEPS {
        let share = (step as f64 / STEPS as f64).min(1.0);
        let scale = first * (last / first).powf(share);
        let moment = (0..planes.len()).fold(anchor, |moment, k| {
            let normal = &planes.normals[k];
            let off = normal.dot(&down).clamp(-1.0, 1.0).asin() / scale;
            // Geman and McClure's weight; a line of full length has weight 1 beside the expectation's.
            let weight = planes.weights[k] / FULL_WEIGHT_LENGTH_PX / (1.0 + off * off).powi(2);
            moment + normal * normal.transpose() * weight
        });
        let eigen = moment.symmetric_eigen();
        let axis: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        down = if axis.dot(&down) < 0.0 { -axis } else { axis };
    }
    // A comparison with NaN is false.
    let near = down.dot(&expected.normalize()) >= FARTHEST_DEG.to_radians().cos();
    near.then_some(down)
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_z};

    use super::*;

    const FOCAL_PX: f64 = 700.0;

    /// A camera rolled by 5 degrees and raised by 10 sees ten plumb lines, and as many level ones.
    fn photograph() -> (Vec<LineSegment>, WorkingFrame, Camera) {
        let frame = WorkingFrame::new(800, 600, 480_000.0);
        let world_from_camera = rotation_about_x(10.0_f64.to_radians()) * rotation_about_z(5.0_f64.to_radians());
        let camera = Camera::new(FOCAL_PX, 800.0, 600.0, &world_from_camera.transpose());
        let segment = |from: Vector3<f64>, to: Vector3<f64>| {
            let at = |point: Vector3<f64>| camera.project(camera.rotation() * point).expect("in front").into();
            LineSegment { start: at(from), end: at(to), width_px: 2.0, significance: 10.0 }
        };
        let mut lines = Vec::new();
        for k in 0..10 {
            let x = -2.0 + 0.4 * f64::from(k);
            lines.push(segment(Vector3::new(x, -0.5, 5.0), Vector3::new(x, 0.5, 5.0)));
            let y = -1.5 + 0.15 * f64::from(k);
            lines.push(segment(Vector3::new(-1.0, y, 5.0), Vector3::new(1.0, y, 6.0)));
        }
        (lines, frame, camera)
    }

    #[test]
    fn the_vertical_segments_are_the_plumb_lines_whatever_was_expected() {
        let (lines, frame, camera) = photograph();
        let found = |expected_down: Vector3<f64>| {
            vertical_segments(&VerticalLinesInput { lines: &lines, frame: &frame, camera: &camera, expected_down })
        };
        // Plumb and level lines take turns in the photograph.
        let plumb: Vec<usize> = (0..20).step_by(2).collect();
        let down = camera.rotation() * Vector3::y();
        for error_deg in [0.0_f64, 4.0, -3.0] {
            assert_eq!(found(rotation_about_z(error_deg.to_radians()) * down), plumb, "{error_deg}");
        }
        assert!(found(Vector3::zeros()).is_empty());
    }

    #[test]
    fn straight_down_and_without_lines_nothing_is_vertical() {
        let (lines, frame, camera) = photograph();
        let found = |lines: &[LineSegment], expected_down| {
            vertical_segments(&VerticalLinesInput { lines, frame: &frame, camera: &camera, expected_down })
        };
        assert!(found(&[], Vector3::y()).is_empty());
        assert!(found(&lines, Vector3::z()).is_empty(), "looks straight down");
    }

    /// By hand: of 20 segments a sixtieth, 0.33, plus 2.33 deviations of 0.57 are 1.67, so that the least counts; of
    /// 400, 6.67 plus 2.33 x 2.56 are 12.6.
    #[test]
    fn what_chance_shows_carries_no_vertical() {
        assert_eq!([0, 20, 400].map(fewest_carrying), [3, 3, 13]);
        let (lines, frame, camera) = photograph();
        let down = camera.rotation() * Vector3::y();
        let carrying = |lines: &[LineSegment], expected_down| {
            carrying_segments(&VerticalLinesInput { lines, frame: &frame, camera: &camera, expected_down })
        };
        assert_eq!(carrying(&lines, down), (0..20).step_by(2).collect::<Vec<usize>>());
        assert_eq!(carrying(&lines[..5], down), [0, 2, 4]);
        assert!(carrying(&lines[..4], down).is_empty(), "two");
        // Where the vertical is known to be elsewhere, its own lines are not asked for another.
        assert!(carrying(&lines, rotation_about_z(4.0_f64.to_radians()) * down).is_empty());
        assert!(carrying(&lines, Vector3::z()).is_empty() && carrying(&lines, Vector3::zeros()).is_empty());
    }

    /// A camera of focal length 100 px that looks along z: an upright segment points to y, one that runs to the middle
    /// to z, one aslant beside it to none, and a point nowhere.
    #[test]
    fn segments_point_to_the_nearest_direction_or_to_none() {
        let camera = Camera::new(100.0, 200.0, 100.0, &Matrix3::identity());
        let segment = |start: [f64; 2], end: [f64; 2]| LineSegment { start, end, width_px: 1.0, significance: 1.0 };
        let lines = [
            segment([20.0, 10.0], [20.0, 90.0]),
            segment([200.0, 100.0], [150.0, 75.0]),
            segment([20.0, 30.0], [60.0, 70.0]),
            segment([5.0, 5.0], [5.0, 5.0]),
        ];
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        assert_eq!(directions_of_segments(&lines, &camera, &axes), [Some(1), Some(2), None, None]);
    }
}
