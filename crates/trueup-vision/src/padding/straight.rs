//! Padding that ends along four straight sides.

use trueup_core::outline::Outline;

use super::{EvenRay, FEW_RAYS, MARGIN_PX, MOST, Padding, Ray, SAME_PX, STRAIGHT_PX, Side, believable};

/// A photograph with four straight sides in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightSided {
    /// In the picture's pixels.
    pub outline: Outline,
    /// Whether a side is not parallel to the picture's, which [`border`](crate::border) asks for.
    pub is_askew: bool,
}

impl Padding {
    /// The photograph of the photograph in this picture of `size` pixels, where padding ends along four straight lines, one
    /// at each side: a photograph that was turned, or a print on paper. `None` otherwise: a night above and below a lit street ends
    /// along two.
    pub fn quadrilateral(&self, size: [usize; 2]) -> Option<StraightSided> {
        let middle = size.map(|length| 0.5 * length as f64);
        let places: Vec<[f64; 2]> = self.told(size).collect();
        let mut open = places.clone();
        let mut edges: Vec<Edge> = Vec::new();
        for _ in Side::ALL {
            let edge = longest_edge(&open, middle)?;
            open.retain(|&place| !edge.holds(place));
            edges.push(edge);
        }
        let one_each = Side::ALL.iter().all(|&side| edges.iter().any(|edge| edge.side() == side));
        let along = 1.0 - open.len() as f64 / places.len() as f64;
        // Nothing but what is even is cut off.
        let depth = |ray: &Ray| edges.iter().map(|edge| edge.depth(ray)).fold(0.0, f64::max);
        let cut_off = |(number, told): (usize, &EvenRay)| {
            let depth = depth(&Ray::new(number, size));
            (depth > 2.0 * STRAIGHT_PX).then(|| f64::from(told.depth.saturating_add(SAME_PX)) >= depth)
        };
        let (cut, even) = self
            .rays
            .iter()
            .enumerate()
            .filter_map(cut_off)
            .fold((0_usize, 0_usize), |(cut, even), is_even| (cut + 1, even + usize::from(is_even)));
        if !one_each || along < MOST || (even as f64) < MOST * cut as f64 {
            return None;
        }
        let inner = edges.iter().map(|edge| Edge { offset: edge.offset + MARGIN_PX, ..*edge });
        let [width, height] = size.map(|length| length as f64);
        let picture = vec![[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        let outline = believable(inner.fold(picture, |corners, edge| edge.clipped(&corners)), size)?;
        Some(StraightSided { outline, is_askew: edges.iter().any(|edge| edge.drop(size) > 2.0 * STRAIGHT_PX) })
    }
}

/// The line along which most of the `places` lie; `None` if few do.
fn longest_edge(places: &[[f64; 2]], middle: [f64; 2]) -> Option<Edge> {
    let pairs = places.iter().zip(places.get(FEW_RAYS..)?);
    let held = |edge: &Edge| places.iter().filter(|&&place| edge.holds(place)).count();
    let edges = pairs.filter_map(|(&one, &other)| Edge::through(one, other, middle));
    // Of equal ones the first.
    let (mut longest, mut most) = (None, FEW_RAYS - 1);
    for edge in edges {
        let count = held(&edge);
        if count > most {
            (longest, most) = (Some(edge), count);
        }
    }
    // A line through two whole pixels is off by a degree or so: fitted twice, it gathers all of its places.
    (0..2).try_fold(longest?, |edge, _| {
        let held: Vec<[f64; 2]> = places.iter().copied().filter(|&place| edge.holds(place)).collect();
        Edge::fitting(&held, middle)
    })
}

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
    fn fitting(places: &[[f64; 2]], middle: [f64; 2]) -> Option<Self> {
        let count = places.len() as f64;
        let mean: [f64; 2] = std::array::from_fn(|axis| places.iter().map(|place| place[axis]).sum::<f64>() / count);
        let sum = |one: usize, other: usize| -> f64 {
            places.iter().map(|place| (place[one] - mean[one]) * (place[other] - mean[other])).sum()
        };
        let angle = 0.5 * (2.0 * sum(0, 1)).atan2(sum(0, 0) - sum(1, 1));
        Self::through(mean, [mean[0] + angle.cos(), mean[1] + angle.sin()], middle).filter(|_| places.len() > 1)
    }

    /// How far inside a place lies.
    pub(super) fn beyond(&self, [x, y]: [f64; 2]) -> f64 {
        self.normal[0] * x + self.normal[1] * y - self.offset
    }

    pub(super) fn holds(&self, place: [f64; 2]) -> bool {
        self.beyond(place).abs() <= STRAIGHT_PX
    }

    /// How far along a ray it lies; not above 0 where the ray starts inside.
    fn depth(&self, ray: &Ray) -> f64 {
        let [x, y] = ray.direction;
        let approach = self.normal[0] * x + self.normal[1] * y;
        if approach > 0.0 { -self.beyond(ray.start) / approach } else { 0.0 }
    }

    /// The side of the picture beside which it runs.
    fn side(&self) -> Side {
        let [x, y] = self.normal;
        match (x.abs() > y.abs(), x > 0.0, y > 0.0) {
            (true, true, _) => Side::Left,
            (true, false, _) => Side::Right,
            (false, _, true) => Side::Top,
            (false, _, false) => Side::Bottom,
        }
    }

    /// How much farther from the picture's side one end of it lies than the other.
    fn drop(&self, [width, height]: [usize; 2]) -> f64 {
        let [x, y] = self.normal.map(f64::abs);
        if x > y { y / x * height as f64 } else { x / y * width as f64 }
    }

    /// What of a polygon lies inside.
    fn clipped(&self, corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
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
