//! The direction of the vertical lines of a photograph: a measure of how upright it stands that needs no truth.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::{circular_mean, roll_from_down, wrap_angle};
use trueup_core::lines::LineSegment;
use trueup_core::mesh::GridMesh;
use trueup_core::source::WorkingFrame;

use crate::vanishing::{FULL_WEIGHT_LENGTH_PX, InterpretationPlanes};

/// A photograph with fewer vertical lines says nothing certain of its direction.
const MIN_LINES: usize = 6;
/// Nor does one whose vertical lines disagree so much that the standard error of their mean direction is larger,
/// degrees.
const MAX_STANDARD_ERROR_DEG: f64 = 0.25;
/// Upright strips of a photograph whose lines are taken to err alike, as those of one thing do.
const STRIPS: usize = 12;
/// Largest angle between the vertical and a segment's interpretation plane for the segment to be a vertical line,
/// degrees.
const TOLERANCE_DEG: f64 = 1.5;
/// Steps of the search for the vertical, each with a smaller scale of the robust loss, then as many at the last scale.
const STEPS: usize = 10;
/// Sine of the angle between viewing direction and vertical below which a photograph has no upright: sin 15 degrees.
const MIN_SINE: f64 = 0.258_819_045_102_520_74;

/// What a photograph's own vertical lines say of its direction. Radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VerticalLines {
    /// Mean direction of the lines in the panorama: by how much they lean clockwise, in [-pi/2, pi/2).
    pub lean: f64,
    /// Standard error of `lean`, as if lines in different strips of the photograph were independent.
    pub standard_error: f64,
    /// Segments that point to the vertical vanishing direction.
    pub lines: usize,
    /// The angle in the photograph between its downward axis and the vertical, from the lines' common vanishing
    /// direction.
    pub gamma: f64,
}

impl VerticalLines {
    /// Whether there are enough lines, 6, and they agree, with a standard error of at most 0.25 degrees.
    pub fn is_certain(&self) -> bool {
        self.lines >= MIN_LINES && self.standard_error <= MAX_STANDARD_ERROR_DEG.to_radians()
    }
}

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

/// Finds the vertical lines of a photograph and their direction in the panorama.
///
/// The vertical vanishing direction is the one that the photograph's segments point to nearest to where it is expected,
/// by iteratively reweighted least squares on the segments' interpretation planes; its lines are those within 1.5
/// degrees. Each is carried to the panorama by `mesh`, which lies over the working frame; `lean` is the circular mean
/// of their angles to the panorama's vertical, weighted by length up to 120 px.
///
/// `None` if its segments point to no such direction, only within one strip, or if the photograph looks within 15
/// degrees of straight up or down, where there is no upright.
pub fn vertical_lines(photograph: &VerticalLinesInput, mesh: &GridMesh) -> Option<VerticalLines> {
    let (planes, down) = planes_and_down(photograph)?;
    let leans: Vec<Lean> = pointing_down(&planes, &down)
        .filter_map(|k| {
            let share = planes.midpoints[k].x / photograph.frame.width + 0.5;
            // The cast saturates.
            let strip = ((share * STRIPS as f64) as usize).min(STRIPS - 1);
            let angle = lean_of(&photograph.lines[planes.indices[k]], mesh)?;
            Some(Lean { angle, weight: planes.weights[k], strip })
        })
        .collect();
    // A line has no sense: its angle counts modulo a half turn, so that twice the angle lies on the circle.
    let lean = circular_mean(leans.iter().map(|one| (2.0 * one.angle, one.weight)))? / 2.0;
    let standard_error = standard_error(&leans, lean, STRIPS)?;
    Some(VerticalLines { lean, standard_error, lines: leans.len(), gamma: roll_from_down(&down) })
}

/// Which of a photograph's segments are its vertical lines: those whose direction [`vertical_lines`] measures, by their
/// positions in `photograph.lines`, ascending. Empty where that finds none to measure.
pub fn vertical_segments(photograph: &VerticalLinesInput) -> Vec<usize> {
    let Some((planes, down)) = planes_and_down(photograph) else { return Vec::new() };
    let mut segments: Vec<usize> = pointing_down(&planes, &down).map(|plane| planes.indices[plane]).collect();
    segments.sort_unstable();
    segments
}

/// A photograph's segments as planes and their vertical vanishing direction; `None` if they point to none, or if the
/// photograph looks within 15 degrees of straight up or down.
fn planes_and_down(photograph: &VerticalLinesInput) -> Option<(InterpretationPlanes, Vector3<f64>)> {
    let planes = InterpretationPlanes::new(photograph.lines, photograph.camera, photograph.frame);
    let down = vertical_direction(&planes, &photograph.expected_down)?;
    // Not a number is no direction either.
    (down.x.hypot(down.y) >= MIN_SINE).then_some((planes, down))
}

/// The planes whose segments point to the vertical vanishing direction `down`.
fn pointing_down<'a>(planes: &'a InterpretationPlanes, down: &'a Vector3<f64>) -> impl Iterator<Item = usize> + 'a {
    let tolerance = TOLERANCE_DEG.to_radians().sin();
    (0..planes.len()).filter(move |&plane| planes.normals[plane].dot(down).abs() <= tolerance)
}

/// A vertical line in the panorama.
#[derive(Debug, Clone, Copy)]
struct Lean {
    /// By how much it leans clockwise, radians.
    angle: f64,
    weight: f64,
    /// The strip of the photograph it lies in.
    strip: usize,
}

/// By how much a segment leans clockwise in the panorama; `None` if it has no length there.
fn lean_of(line: &LineSegment, mesh: &GridMesh) -> Option<f64> {
    let along = mesh.warp(Vector2::from(line.end)) - mesh.warp(Vector2::from(line.start));
    let downward = if along.y < 0.0 { -along } else { along };
    (downward.norm() > 0.0).then(|| -roll_from_down(&downward.push(0.0)))
}

/// Standard error of the weighted mean of angles that err alike within a strip; `None` unless two strips have some.
///
/// # Source
/// The cluster-robust (sandwich) variance of a weighted mean: the squares of each cluster's sum of weighted residuals.
fn standard_error(leans: &[Lean], mean: f64, strips: usize) -> Option<f64> {
    let total: f64 = leans.iter().map(|one| one.weight).sum();
    let mut sums = vec![None; strips];
    for one in leans {
        let residual = one.weight * wrap_angle(2.0 * (one.angle - mean)) / 2.0;
        *sums[one.strip].get_or_insert(0.0) += residual;
    }
    let count = sums.iter().flatten().count() as f64;
    let squares: f64 = sums.iter().flatten().map(|sum| sum * sum).sum();
    (count >= 2.0 && total > 0.0).then(|| (squares * count / (count - 1.0)).sqrt() / total)
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
    use nalgebra::Rotation2;
    use trueup_core::camera::Camera;
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

    /// A grid that unrolls the camera to level longitude and height, where plumb lines are plumb, then turns it.
    fn unrolled(camera: &Camera, turn: f64) -> GridMesh {
        let mut mesh = GridMesh::regular(800.0, 600.0, 5.0);
        mesh.target = (0..mesh.len())
            .map(|vertex| camera.world_direction(mesh.source(vertex)))
            .map(|to| Vector2::new(700.0 * to.x.atan2(to.z), 700.0 * (to.y / to.x.hypot(to.z)).asinh()))
            .map(|at| (Rotation2::new(turn) * at).into())
            .collect();
        mesh
    }

    fn measured(expected: Vector3<f64>, turn: f64) -> VerticalLines {
        let (lines, frame, camera) = photograph();
        let photograph = VerticalLinesInput { lines: &lines, frame: &frame, camera: &camera, expected_down: expected };
        let mesh = unrolled(&camera, turn);
        vertical_lines(&photograph, &mesh).expect("ten lines")
    }

    #[test]
    fn plumb_lines_tell_how_far_the_photograph_leans_whatever_was_expected() {
        let (_, _, camera) = photograph();
        let down = camera.rotation() * Vector3::y();
        let true_gamma = roll_from_down(&down);
        assert!((true_gamma.to_degrees() - 5.0).abs() < 1e-9, "the camera's roll");
        for (error_deg, turn_deg) in [(0.0, 0.0), (4.0, 0.0), (-3.0, 2.0), (2.0, -7.0)] {
            let expected = rotation_about_z(f64::to_radians(error_deg)) * down;
            let found = measured(expected, f64::to_radians(turn_deg));
            assert_eq!(found.lines, 10);
            assert!((found.lean.to_degrees() - turn_deg).abs() < 0.02, "{} {turn_deg}", found.lean.to_degrees());
            assert!((found.gamma - true_gamma).to_degrees().abs() < 0.05, "{error_deg}");
            assert!(found.standard_error.to_degrees() < 0.02 && found.is_certain());
        }
    }

    #[test]
    fn the_vertical_segments_are_the_plumb_lines() {
        let (lines, frame, camera) = photograph();
        let found = |down: Vector3<f64>| {
            let photograph = VerticalLinesInput { lines: &lines, frame: &frame, camera: &camera, expected_down: down };
            vertical_segments(&photograph)
        };
        // Plumb and level lines take turns in the photograph.
        assert_eq!(found(camera.rotation() * Vector3::y()), [0, 2, 4, 6, 8, 10, 12, 14, 16, 18]);
        assert!(found(Vector3::zeros()).is_empty());
    }

    #[test]
    fn without_lines_or_straight_down_there_is_no_direction() {
        let (lines, frame, camera) = photograph();
        let mesh = unrolled(&camera, 0.0);
        let find = |lines: &[LineSegment], expected_down| {
            let photograph = VerticalLinesInput { lines, frame: &frame, camera: &camera, expected_down };
            vertical_lines(&photograph, &mesh)
        };
        assert_eq!(find(&[], Vector3::y()), None);
        assert_eq!(find(&lines[..1], Vector3::y()), None);
        assert_eq!(find(&lines[..0], Vector3::z()), None);
    }

    /// Two lines of equal weight, 0.01 rad either side of their mean: variance 2e-4, of the mean 1e-4. Each twice, in
    /// the same strips, says no more; four of them in four strips halve the variance of the mean with 3 in place of 4
    /// degrees of freedom: sqrt(4e-4 / 4 / 3).
    #[test]
    fn the_standard_error_is_that_of_a_mean_of_strips() {
        let lean = |angle, strip| Lean { angle, weight: 5.0, strip };
        let error = |leans: &[Lean]| standard_error(leans, 0.30, 12).expect("two strips");
        assert!((error(&[lean(0.31, 0), lean(0.29, 11)]) - 0.01).abs() < 1e-12);
        let doubled = [lean(0.31, 0), lean(0.31, 0), lean(0.29, 11), lean(0.29, 11)];
        assert!((error(&doubled) - 0.01).abs() < 1e-12);
        let apart = [lean(0.31, 0), lean(0.31, 3), lean(0.29, 7), lean(0.29, 11)];
        assert!((error(&apart) - (1e-4_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(standard_error(&[lean(0.3, 4), lean(0.3, 4)], 0.3, 12), None);
    }
}
