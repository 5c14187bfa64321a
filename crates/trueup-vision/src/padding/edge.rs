//! Straight lines along which padding ends.

use trueup_core::side::Side;

use super::{Ray, STRAIGHT_PX};

/// Most that places of an outline may lie beside it when it is told by fewer, in working pixels.
const SIMPLER_PX: f64 = 1.0;

/// A straight line: the places p with `normal` . p = `offset`. The photograph lies where it is more.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    normal: [f64; 2],
    offset: f64,
}

impl Edge {
    /// The line through two places, `middle` on its inner side; `None` if these are one.
    pub(super) fn through([x, y]: [f64; 2], [other_x, other_y]: [f64; 2], middle: [f64; 2]) -> Option<Self> {
        let length = (other_x - x).hypot(other_y - y);
        let normal = [(y - other_y) / length, (other_x - x) / length];
        let edge = Self { normal, offset: normal[0] * x + normal[1] * y };
        (length > 0.0).then(|| match edge.beyond(middle) >= 0.0 {
            true => edge,
            false => Self { normal: normal.map(|part| -part), offset: -edge.offset },
        })
    }

    /// The line that fits all of some places best; `None` of one place.
    pub(super) fn fitting(places: &[[f64; 2]], middle: [f64; 2]) -> Option<Self> {
        let count = places.len() as f64;
        let mean: [f64; 2] = std::array::from_fn(|axis| places.iter().map(|place| place[axis]).sum::<f64>() / count);
        let sum = |one: usize, other: usize| -> f64 {
            places.iter().map(|place| (place[one] - mean[one]) * (place[other] - mean[other])).sum()
        };
        let angle = 0.5 * (2.0 * sum(0, 1)).atan2(sum(0, 0) - sum(1, 1));
        Self::through(mean, [mean[0] + angle.cos(), mean[1] + angle.sin()], middle).filter(|_| places.len() > 1)
    }

    /// The line so many pixels farther inside.
    pub(super) fn moved_in(&self, distance: f64) -> Self {
        Self { offset: self.offset + distance, ..*self }
    }

    /// How far inside a place lies.
    pub(super) fn beyond(&self, [x, y]: [f64; 2]) -> f64 {
        self.normal[0] * x + self.normal[1] * y - self.offset
    }

    pub(super) fn holds(&self, place: [f64; 2]) -> bool {
        self.beyond(place).abs() <= STRAIGHT_PX
    }

    /// How far along a ray it lies; not above 0 where the ray starts inside.
    pub(super) fn depth(&self, ray: &Ray) -> f64 {
        let [x, y] = ray.direction;
        let approach = self.normal[0] * x + self.normal[1] * y;
        if approach > 0.0 { -self.beyond(ray.start) / approach } else { 0.0 }
    }

    /// The side of the picture beside which it runs.
    pub(super) fn side(&self) -> Side {
        let [x, y] = self.normal;
        match (x.abs() > y.abs(), x > 0.0, y > 0.0) {
            (true, true, _) => Side::Left,
            (true, false, _) => Side::Right,
            (false, _, true) => Side::Top,
            (false, _, false) => Side::Bottom,
        }
    }

    /// How much farther from the picture's side one end of it lies than the other.
    pub(super) fn drop(&self, [width, height]: [usize; 2]) -> f64 {
        let [x, y] = self.normal.map(f64::abs);
        if x > y { y / x * height as f64 } else { x / y * width as f64 }
    }

    /// What of a polygon lies inside.
    pub(super) fn clipped(&self, corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut clipped = Vec::with_capacity(corners.len() + 1);
        for (&corner, &next) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (here, there) = (self.beyond(corner), self.beyond(next));
            if here >= 0.0 {
                clipped.push(corner);
            }
            if (here >= 0.0) != (there >= 0.0) {
                let share = here / (here - there);
                clipped.push(std::array::from_fn(|axis| corner[axis] + share * (next[axis] - corner[axis])));
            }
        }
        clipped
    }
}

/// Appends those of the `places` that tell the way from the first to the last one, but for the first: Ramer, Douglas
/// and Peucker's.
pub(super) fn simplify(places: &[[f64; 2]], simpler: &mut Vec<[f64; 2]>) {
    let [first, inner @ .., last] = places else { return };
    let chord = Edge::through(*first, *last, *first);
    let away = |place: &[f64; 2]| match chord {
        Some(chord) => chord.beyond(*place).abs(),
        None => (place[0] - first[0]).hypot(place[1] - first[1]),
    };
    let farthest = (0..inner.len()).max_by(|&one, &other| away(&inner[one]).total_cmp(&away(&inner[other])));
    match farthest.filter(|&at| away(&inner[at]) > SIMPLER_PX) {
        Some(at) => {
            simplify(&places[..=at + 1], simpler);
            simplify(&places[at + 1..], simpler);
        }
        None => simpler.push(*last),
    }
}
