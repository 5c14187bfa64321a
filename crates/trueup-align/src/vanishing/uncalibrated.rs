//! Vanishing points of one photograph without its focal length: found one after the other in the photograph, and joined
//! by the focal length at which two of them are orthogonal.

use nalgebra::{Matrix3, Vector2, Vector3};
use rand::Rng;

use super::interpretation::InterpretationPlanes;
use super::options::VanishingOptions;
use super::search::{cumulative_weights, draw};

/// Vanishing points that are sought one after the other, each among the segments that support none before it.
const MAX_POINTS: usize = 5;
/// Segments that must support a vanishing point.
const MIN_SUPPORT: usize = 3;
/// Steps of the least squares that moves a point to where its segments meet.
const REFINEMENT_STEPS: usize = 5;
/// Focal lengths that are believed, per larger side of the photograph: from a fisheye's to a long telephoto lens's.
const BELIEVABLE_FOCAL: std::ops::RangeInclusive<f64> = 0.3..=5.0;
/// Focal length per larger side where a pair of points does not tell: that of a lens of 36 mm on film.
const ORDINARY_FOCAL: f64 = 1.0;
/// Farthest that directions may be from orthogonal at a focal length that they do not tell: cosine of 80 degrees.
const MAX_COSINE: f64 = 0.173_648_177_666_930_33;
/// Farther from the center than this many larger sides, a vanishing point tells no focal length: its distance is too
/// uncertain.
const FAR: f64 = 10.0;

/// Three orthogonal directions and the focal length they were joined by.
#[derive(Debug, Clone, Copy)]
pub(super) struct UncalibratedTriad {
    /// Focal length, working pixels.
    pub focal_px: f64,
    /// Columns are the directions in the frame of a camera of that focal length; a rotation.
    pub triad: Matrix3<f64>,
}

/// A segment about the photograph's center, in larger sides of the photograph.
struct Segment {
    middle: Vector2<f64>,
    /// Of unit length.
    along: Vector2<f64>,
    /// The line through both ends, its normal of unit length.
    line: Vector3<f64>,
    weight: f64,
}

/// The triad of most support, where one is found; the focal length that `planes` were made with does not matter.
///
/// Vanishing points are homogeneous, so that one at infinity is no special case. A segment supports a point by the
/// angle between it and the way from its middle to the point, w max(0, 1 - (sine / sin tolerance)^2), which asks no
/// focal length. Points are found one after the other: hypotheses are where two drawn segments meet, the best is moved
/// by least squares, and its segments leave. Two points p, q with centers of coordinates in the photograph's are
/// orthogonal at the focal length f^2 = -p.q; each pair that can be makes a triad, and the segments choose.
///
/// # Source
/// Loosely Lee, Hebert and Kanade, Geometric Reasoning for Single Image Structure Recovery (CVPR 2009), as the paper
/// follows it; the focal length of two orthogonal vanishing points is Caprile and Torre's (1990).
///
/// # Departures
/// Their search over all triples is one over pairs, since the third point follows from two.
pub(super) fn search(
    planes: &InterpretationPlanes,
    larger_side: f64,
    options: &VanishingOptions,
    generator: &mut impl Rng,
) -> Option<UncalibratedTriad> {
    let segments = segments(planes, larger_side);
    let tolerance = options.tolerance_deg.to_radians().sin();
    let points = vanishing_points(&segments, tolerance, options, generator);
    let mut best: Option<(f64, UncalibratedTriad)> = None;
    for (index, first) in points.iter().enumerate() {
        for second in &points[index + 1..] {
            let Some((focal, triad)) = joined(first, second) else { continue };
            // A direction (x, y, z) vanishes at the homogeneous point (x, y, z / f).
            let seen = [0, 1, 2].map(|k| triad.column(k).component_mul(&Vector3::new(1.0, 1.0, 1.0 / focal)));
            let support: f64 = segments.iter().map(|segment| segment.support_of_any(&seen, tolerance)).sum();
            if best.as_ref().is_none_or(|(most, _)| support > *most) {
                best = Some((support, UncalibratedTriad { focal_px: focal * larger_side, triad }));
            }
        }
    }
    best.map(|(_, triad)| triad)
}

impl Segment {
    /// Sine of the angle between the segment and the way from its middle to a homogeneous point.
    fn sine(&self, point: &Vector3<f64>) -> f64 {
        let way = point.xy() - self.middle * point.z;
        let length = way.norm();
        // In its middle every direction is one to the point.
        if length > 0.0 { (way.perp(&self.along) / length).abs() } else { 0.0 }
    }

    fn support(&self, point: &Vector3<f64>, tolerance: f64) -> f64 {
        self.weight * (1.0 - (self.sine(point) / tolerance).powi(2)).max(0.0)
    }

    fn support_of_any(&self, points: &[Vector3<f64>; 3], tolerance: f64) -> f64 {
        points.iter().map(|point| self.support(point, tolerance)).fold(0.0, f64::max)
    }
}

fn segments(planes: &InterpretationPlanes, larger_side: f64) -> Vec<Segment> {
    let focal_px = planes.focal_px;
    let segment = |index: usize| {
        // The plane's normal (a, b, c) over (x, y, f) is the line (a, b, c f) over (x, y, 1).
        let normal = planes.normals[index];
        let line = Vector3::new(normal.x, normal.y, normal.z * focal_px / larger_side);
        let line = line / line.xy().norm();
        Segment {
            middle: planes.straight_middle(index) / larger_side,
            along: Vector2::new(-line.y, line.x),
            line,
            weight: planes.weights[index],
        }
    };
    let is_placed = |segment: &Segment| segment.line.iter().chain(&segment.middle).all(|value| value.is_finite());
    (0..planes.len()).map(segment).filter(is_placed).collect()
}

/// At most [`MAX_POINTS`] homogeneous points of unit length, the one of most support first.
fn vanishing_points(
    segments: &[Segment],
    tolerance: f64,
    options: &VanishingOptions,
    generator: &mut impl Rng,
) -> Vec<Vector3<f64>> {
    let mut left: Vec<&Segment> = segments.iter().collect();
    let mut points = Vec::new();
    while points.len() < MAX_POINTS && left.len() >= MIN_SUPPORT {
        let Some(hypothesis) = best_meeting(&left, tolerance, options, generator) else { break };
        let point = refined(&hypothesis, &left, tolerance);
        let before = left.len();
        left.retain(|segment| segment.sine(&point) >= tolerance);
        if before - left.len() < MIN_SUPPORT {
            break;
        }
        points.push(point);
    }
    points
}

/// Where two of the segments meet that are drawn by weight, of most support.
fn best_meeting(
    segments: &[&Segment],
    tolerance: f64,
    options: &VanishingOptions,
    generator: &mut impl Rng,
) -> Option<Vector3<f64>> {
    let weights: Vec<f64> = segments.iter().map(|segment| segment.weight).collect();
    let cumulative = cumulative_weights(&weights);
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for _ in 0..options.draws {
        let (a, b) = (draw(&cumulative, generator), draw(&cumulative, generator));
        let Some(point) = segments[a].line.cross(&segments[b].line).try_normalize(f64::EPSILON) else { continue };
        let support: f64 = segments.iter().map(|segment| segment.support(&point, tolerance)).sum();
        if best.as_ref().is_none_or(|(most, _)| support > *most) {
            best = Some((support, point));
        }
    }
    best.map(|(_, point)| point)
}

/// The point that minimizes the weighted squared sines of its supporters, to first order in each step.
fn refined(start: &Vector3<f64>, segments: &[&Segment], tolerance: f64) -> Vector3<f64> {
    let mut point = *start;
    for _ in 0..REFINEMENT_STEPS {
        let mut moment = Matrix3::zeros();
        for segment in segments.iter().filter(|segment| segment.sine(&point) < tolerance) {
            let way = (point.xy() - segment.middle * point.z).norm();
            // The sine is the point's distance from the line through the middle, over the length of the way.
            if way > 0.0 {
                moment += segment.line * segment.line.transpose() * (segment.weight / (way * way));
            }
        }
        let eigen = moment.symmetric_eigen();
        let next: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        if !next.iter().all(|value| value.is_finite()) {
            break;
        }
        point = next;
    }
    point
}

/// The focal length, in larger sides, at which two vanishing points are orthogonal, and the directions then; `None` if
/// they cannot be.
fn joined(first: &Vector3<f64>, second: &Vector3<f64>) -> Option<(f64, Matrix3<f64>)> {
    let is_near = |point: &Vector3<f64>| point.xy().norm() < FAR * point.z.abs();
    let focal = match is_near(first) && is_near(second) {
        true => {
            let squared = -first.xy().dot(&second.xy()) / (first.z * second.z);
            Some(squared.sqrt()).filter(|focal| BELIEVABLE_FOCAL.contains(focal))?
        }
        false => ORDINARY_FOCAL,
    };
    let direction = |point: &Vector3<f64>| Vector3::new(point.x, point.y, point.z * focal).normalize();
    let (a, b) = (direction(first), direction(second));
    if a.dot(&b).abs() > MAX_COSINE {
        return None;
    }
    let third = a.cross(&b).normalize();
    Some((focal, Matrix3::from_columns(&[a, third.cross(&a), third])))
}

#[cfg(test)]
mod tests {
    use trueup_core::StageContext;
    use trueup_core::camera::Camera;
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};
    use trueup_core::source::WorkingFrame;

    use super::*;
    use crate::similarity::synthetic::{FOCAL_PX, SIZE, photograph_lines};
    use crate::vanishing::{Intrinsics, detect_triad};

    /// f^2 = -(300 * -400 + 50 * 60) = 117000 px^2, f = 342.0526 px.
    #[test]
    fn two_orthogonal_points_tell_the_focal_length() {
        let side = 1000.0;
        let point = |x: f64, y: f64| Vector3::new(x / side, y / side, 1.0) * -0.3;
        let (focal, triad) =
            joined(&point(300.0, 50.0), &point(-400.0, 60.0)).expect("orthogonal at some focal length");
        assert!((focal * side - 342.052_627_5).abs() < 1e-6);
        assert!((triad.transpose() * triad - Matrix3::identity()).norm() < 1e-12 && triad.determinant() > 0.0);
        // On the same side of the center they are orthogonal at no focal length.
        assert!(joined(&point(300.0, 50.0), &point(400.0, 60.0)).is_none());
        // At infinity they tell none, and are orthogonal in the photograph or not at all.
        assert!(joined(&Vector3::new(1.0, 0.0, 0.0), &Vector3::new(0.05, 1.0, 0.0)).is_some());
        assert!(joined(&Vector3::new(1.0, 0.0, 0.0), &Vector3::new(0.5, 1.0, 0.0)).is_none());
    }

    /// Lines towards (200, -100) px from the center: a segment on one of them is at angle zero, one turned by 2 degrees
    /// at 2.
    #[test]
    fn a_segment_is_judged_by_the_angle_at_its_middle() {
        let point = Vector3::new(0.2, -0.1, 1.0);
        let middle = Vector2::new(-0.3, 0.15);
        let way = (point.xy() - middle).normalize();
        for degrees in [0.0_f64, 2.0, -5.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let along = Vector2::new(cosine * way.x - sine * way.y, sine * way.x + cosine * way.y);
            let line = Vector3::new(along.y, -along.x, -middle.x * along.y + middle.y * along.x);
            let segment = Segment { middle, along, line, weight: 1.0 };
            assert!((segment.sine(&point) - sine.abs()).abs() < 1e-12);
            assert!(line.dot(&middle.push(1.0)).abs() < 1e-12);
        }
    }

    /// Photographs that see two or three finite vanishing points, and one that looks straight at a wall: the roll comes
    /// out whatever the focal length of the camera was thought to be.
    #[test]
    fn the_triad_is_found_whatever_the_focal_length_was_thought_to_be() {
        let options = VanishingOptions { intrinsics: Intrinsics::Unknown, ..VanishingOptions::default() };
        let frame = WorkingFrame { width: SIZE.0, height: SIZE.1, working_from_full: 1.0 };
        for (yaw, pitch, roll) in
            [(40.0_f64, 12.0_f64, 5.0_f64), (35.0, -15.0, -8.0), (50.0, 3.0, 12.0), (0.0, 0.0, 4.0)]
        {
            let world_from_camera = rotation_about_y(yaw.to_radians())
                * rotation_about_x(pitch.to_radians())
                * rotation_about_z(roll.to_radians());
            let mut generator = StageContext::default().generator("uncalibrated test", roll.abs() as u64);
            let lines = photograph_lines(&world_from_camera.transpose(), 25, 10, 0.3, &mut generator);
            let mut rolls = Vec::new();
            for thought in [0.5, 1.0, 2.0] {
                let camera = Camera::new(FOCAL_PX * thought, SIZE.0, SIZE.1, &Matrix3::identity());
                let mut generator = StageContext::default().generator("uncalibrated test", 7);
                let found = detect_triad(&lines, &camera, &frame, &options, &mut generator);
                let triad = found.triad().unwrap_or_else(|| panic!("{yaw} {pitch} {roll}: {found:?}")).matrix();
                let down = (0..3).map(|k| triad.column(k).into_owned()).max_by(|a, b| a.y.abs().total_cmp(&b.y.abs()));
                let down = down.map(|down| down * down.y.signum()).expect("three directions");
                rolls.push(down.x.atan2(down.y).to_degrees());
                assert!((rolls[0] - roll).abs() < 0.7, "{yaw} {pitch} {roll}: {rolls:?}");
            }
            assert!(rolls.iter().all(|other| (other - rolls[0]).abs() < 1e-6), "{rolls:?}");
        }
    }
}
