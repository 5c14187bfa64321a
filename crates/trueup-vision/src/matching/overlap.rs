//! The overlap of two photographs that a homography predicts, and whether it is believable there.

use nalgebra::{Vector2, Vector3};
use trueup_core::geometry::Homography;
use trueup_core::matches::PointMatch;
use trueup_core::source::WorkingFrame;

use super::turned::TurnedLens;

/// A map between two photographs' frames, both ways.
#[derive(Debug, Clone)]
pub(crate) struct PredictedOverlap<'a> {
    maps: Maps,
    frame_a: &'a WorkingFrame,
    frame_b: &'a WorkingFrame,
}

#[derive(Debug, Clone)]
enum Maps {
    Homographies { b_from_a: Homography, a_from_b: Homography },
    Turn(Box<TurnedLens>),
}

impl<'a> PredictedOverlap<'a> {
    /// `b_from_a` signed so that its denominator is positive on the visible side; `None` if it is singular.
    pub(crate) fn new(b_from_a: Homography, frame_a: &'a WorkingFrame, frame_b: &'a WorkingFrame) -> Option<Self> {
        let a_from_b = b_from_a.inverse()?;
        Some(Self { maps: Maps::Homographies { b_from_a, a_from_b }, frame_a, frame_b })
    }

    /// That of a lens that turned.
    pub(super) fn of_turn(turned: TurnedLens, frame_a: &'a WorkingFrame, frame_b: &'a WorkingFrame) -> Self {
        Self { maps: Maps::Turn(Box::new(turned)), frame_a, frame_b }
    }

    /// Where a point of a is in b; `None` if it is not in the overlap.
    pub(super) fn point_in_b(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        self.b_from_a(point).filter(|at| self.frame_b.contains(at.x, at.y))
    }

    /// Where a point of b is in a; `None` if it is not in the overlap.
    pub(super) fn point_in_a(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        self.a_from_b(point).filter(|at| self.frame_a.contains(at.x, at.y))
    }

    /// Where a point of a is in b's picture, however far that reaches; `None` of what lies behind it.
    fn b_from_a(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        match &self.maps {
            Maps::Homographies { b_from_a, .. } => in_front(b_from_a, point),
            Maps::Turn(turned) => turned.in_b(point),
        }
    }

    /// The same the other way.
    fn a_from_b(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        match &self.maps {
            Maps::Homographies { a_from_b, .. } => in_front(a_from_b, point),
            Maps::Turn(turned) => turned.in_a(point),
        }
    }

    /// The share of one photograph that the other shows, of that of which it is more, by `side` x `side` places spread
    /// evenly over each, from border to border. What lies beyond the other by up to `margin` of its sides counts as
    /// shown.
    pub(crate) fn larger_share(&self, side: usize, margin: f64) -> f64 {
        let share = |frame: &WorkingFrame, other: &WorkingFrame, map: &dyn Fn(Vector2<f64>) -> Option<Vector2<f64>>| {
            let place = |cell: usize, length: f64| cell as f64 / (side - 1) as f64 * length;
            let is_near = |at: f64, length: f64| (-margin * length..=(1.0 + margin) * length).contains(&at);
            let is_shown = |cell: &usize| {
                let at = Vector2::new(place(cell % side, frame.width), place(cell / side, frame.height));
                map(at).is_some_and(|at| is_near(at.x, other.width) && is_near(at.y, other.height))
            };
            (0..side * side).filter(is_shown).count() as f64 / (side * side) as f64
        };
        let [is_b_missed, is_a_missed] = self.misses(margin);
        let of_a = if is_b_missed { 0.0 } else { share(self.frame_a, self.frame_b, &|point| self.b_from_a(point)) };
        let of_b = if is_a_missed { 0.0 } else { share(self.frame_b, self.frame_a, &|point| self.a_from_b(point)) };
        of_a.max(of_b)
    }

    /// Whether a is seen to miss b, which reaches `margin` of its sides beyond each border, and b to miss such an a.
    /// Most photographs that paths over overlaps lead to are far apart, which four corners tell in place of all places.
    /// Of a turn nothing is seen.
    fn misses(&self, margin: f64) -> [bool; 2] {
        let Maps::Homographies { b_from_a, a_from_b } = &self.maps else { return [false; 2] };
        // What is linear in a place is negative at all of them where it is at their corners.
        let misses = |map: &Homography, frame: &WorkingFrame, other: &WorkingFrame| {
            let corners = corners(frame);
            let is_beyond = |line: &Vector3<f64>| corners.iter().all(|corner| side(line, corner) < 0.0);
            is_beyond(&map.0.row(2).transpose()) || borders(map, other, margin).iter().any(is_beyond)
        };
        [misses(b_from_a, self.frame_a, self.frame_b), misses(a_from_b, self.frame_b, self.frame_a)]
    }

    /// Whether both ends of a match lie in the overlap.
    pub(super) fn contains(&self, at: &PointMatch) -> bool {
        self.point_in_b(at.in_a.into()).is_some() && self.point_in_a(at.in_b.into()).is_some()
    }

    /// Whether the overlap is not empty, and at its corners the map keeps the orientation and changes areas by a
    /// factor of at most `max_area_ratio`. A turn is always plausible.
    ///
    /// # Departures
    /// Outside the overlap nothing is asked: in a wide photograph turned far from its neighbor, parts that the neighbor
    /// does not see lie on or beyond its horizon, rightly.
    pub(super) fn is_plausible(&self, max_area_ratio: f64) -> bool {
        let Maps::Homographies { b_from_a, .. } = &self.maps else { return true };
        let corners = self.corners_in_a(b_from_a);
        let area_ratio = |corner: &Vector2<f64>| b_from_a.jacobian(*corner).determinant();
        corners.len() >= 3
            && corners.iter().map(area_ratio).all(|ratio| (1.0 / max_area_ratio..=max_area_ratio).contains(&ratio))
    }

    /// The corners of the overlap, a convex polygon in a; empty if there is none.
    fn corners_in_a(&self, b_from_a: &Homography) -> Vec<Vector2<f64>> {
        let start = corners(self.frame_a).to_vec();
        borders(b_from_a, self.frame_b, 0.0).iter().fold(start, |polygon, line| clip(&polygon, line))
    }
}

/// The corners of a photograph, one after the other around it.
fn corners(frame: &WorkingFrame) -> [Vector2<f64>; 4] {
    let (width, height) = (frame.width, frame.height);
    [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]].map(Vector2::from)
}

/// The lines (x, y, 1) that are not negative where a point is carried into `target`, which reaches `margin` of its
/// sides beyond each border: there -m W <= x/w <= (1 + m) W and the like of y, with w > 0, is linear in the point.
fn borders(target_from_source: &Homography, target: &WorkingFrame, margin: f64) -> [Vector3<f64>; 4] {
    let rows: [Vector3<f64>; 3] = std::array::from_fn(|row| target_from_source.0.row(row).transpose());
    let [x, y, w] = rows;
    let between = |at: Vector3<f64>, length: f64| [at + w * (margin * length), w * ((1.0 + margin) * length) - at];
    let ([left, right], [top, bottom]) = (between(x, target.width), between(y, target.height));
    [left, right, top, bottom]
}

/// What a line (x, y, 1) says of a point.
fn side(line: &Vector3<f64>, point: &Vector2<f64>) -> f64 {
    line.x * point.x + line.y * point.y + line.z
}

fn in_front(target_from_source: &Homography, point: Vector2<f64>) -> Option<Vector2<f64>> {
    (target_from_source.denominator(point) > 0.0).then(|| target_from_source.apply(point))
}

/// The part of a convex polygon where `line` (x, y, 1) is not negative (one step of Sutherland and Hodgman).
fn clip(polygon: &[Vector2<f64>], line: &Vector3<f64>) -> Vec<Vector2<f64>> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (index, from) in polygon.iter().enumerate() {
        let to = &polygon[(index + 1) % polygon.len()];
        let (side_from, side_to) = (side(line, from), side(line, to));
        if side_from >= 0.0 {
            kept.push(*from);
        }
        if (side_from > 0.0 && side_to < 0.0) || (side_from < 0.0 && side_to > 0.0) {
            kept.push(from + (to - from) * (side_from / (side_from - side_to)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::geometry::rotation_about_y;

    use super::*;

    fn frame() -> WorkingFrame {
        WorkingFrame::new(800, 600, 480_000.0)
    }

    /// Photographs of horizontal field of view `view_deg`, the second turned right by `turn_deg`.
    fn turned(view_deg: f64, turn_deg: f64) -> Homography {
        let focal = 400.0 / (view_deg / 2.0).to_radians().tan();
        let k = Matrix3::new(focal, 0.0, 400.0, 0.0, focal, 300.0, 0.0, 0.0, 1.0);
        let rotation = rotation_about_y(-turn_deg.to_radians());
        Homography(k * rotation * k.try_inverse().expect("regular"))
    }

    #[test]
    fn a_shift_by_half_a_width_overlaps_by_half() {
        let frame = frame();
        let shift = Homography(Matrix3::new(1.0, 0.0, -400.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
        let overlap = PredictedOverlap::new(shift, &frame, &frame).expect("regular");
        let corners = overlap.corners_in_a(&shift);
        assert_eq!(corners.len(), 4);
        assert!(corners.iter().all(|corner| (400.0..=800.0).contains(&corner.x)));
        assert!(overlap.is_plausible(1.5));
        assert_eq!(overlap.point_in_b(Vector2::new(500.0, 10.0)), Some(Vector2::new(100.0, 10.0)));
        assert_eq!(overlap.point_in_b(Vector2::new(300.0, 10.0)), None);
        assert_eq!(overlap.larger_share(8, 0.0), 0.5);
        // A tenth of 800 pixels more is most of the next of eight columns.
        assert_eq!(overlap.larger_share(8, 0.1), 0.625);
    }

    /// A photograph drawn half as large in the middle of another one is shown wholly, which itself is shown to a
    /// quarter.
    #[test]
    fn the_larger_share_is_that_of_the_narrower_photograph() {
        let frame = frame();
        let zoomed = Homography(Matrix3::new(0.5, 0.0, 200.0, 0.0, 0.5, 150.0, 0.0, 0.0, 1.0));
        for b_from_a in [zoomed, zoomed.inverse().expect("regular")] {
            let overlap = PredictedOverlap::new(b_from_a, &frame, &frame).expect("regular");
            assert_eq!(overlap.larger_share(10, 0.0), 1.0);
        }
    }

    /// Against the places one by one, whatever the turn. With a margin of a twentieth, 40 px, photographs of 60 degrees
    /// (a focal length of 693 px) share nothing from 30 + atan(440 / 693) = 62.4 degrees on, those of 90 (400 px) from
    /// 45 + atan(440 / 400) = 92.7 on, past the horizon, too.
    #[test]
    fn shares_are_those_of_all_places_where_corners_tell_that_there_are_none() {
        let frame = frame();
        let mut missed = 0;
        for view_deg in [60.0, 90.0] {
            for turn_deg in (0..360).step_by(10).map(f64::from) {
                let b_from_a = turned(view_deg, turn_deg);
                let a_from_b = turned(view_deg, -turn_deg);
                let shown = |map: &Homography| {
                    let place = |k: usize| Vector2::new((k % 10) as f64 / 9.0 * 800.0, (k / 10) as f64 / 9.0 * 600.0);
                    let is_shown = |k: &usize| {
                        let mapped = map.0 * place(*k).push(1.0);
                        let (x, y) = (mapped.x / mapped.z, mapped.y / mapped.z);
                        mapped.z > 0.0 && (-40.0..=840.0).contains(&x) && (-30.0..=630.0).contains(&y)
                    };
                    (0..100).filter(is_shown).count() as f64 / 100.0
                };
                let overlap = PredictedOverlap::new(b_from_a, &frame, &frame).expect("regular");
                let expected = shown(&b_from_a).max(shown(&a_from_b));
                assert_eq!(overlap.larger_share(10, 0.05), expected, "{view_deg} {turn_deg}");
                missed += usize::from(overlap.misses(0.05) == [true; 2]);
            }
        }
        // Of turns by tens those from 70 to 290 degrees, and from 100 to 260.
        assert_eq!(missed, 23 + 17);
    }

    #[test]
    fn wide_photographs_turned_far_are_plausible() {
        let frame = frame();
        for turn_deg in [-70.0, 70.0] {
            let overlap = PredictedOverlap::new(turned(90.0, turn_deg), &frame, &frame).expect("regular");
            assert!(overlap.is_plausible(20.0), "{turn_deg}");
        }
    }

    #[test]
    fn mirrored_exploding_and_disjoint_photographs_are_not() {
        let frame = frame();
        let maps = [
            Matrix3::new(-1.0, 0.0, 800.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
            Matrix3::new(6.0, 0.0, -2000.0, 0.0, 6.0, -1500.0, 0.0, 0.0, 1.0),
            Matrix3::new(1.0, 0.0, 900.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        ];
        for map in maps {
            let overlap = PredictedOverlap::new(Homography(map), &frame, &frame).expect("regular");
            assert!(!overlap.is_plausible(20.0), "{map}");
        }
    }
}
