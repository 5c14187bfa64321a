//! Padding that ends along four straight sides.

use trueup_core::outline::Outline;
use trueup_core::side::Side;

use super::edge::Edge;
use super::{EvenRay, FEW_RAYS, MARGIN_PX, MOST, Padding, Ray, SAME_PX, STRAIGHT_PX, believable};

/// A photograph with four straight sides in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightSided {
    /// In the picture's pixels.
    pub outline: Outline,
    /// Whether a side is not parallel to the picture's, which [`border`](crate::border) asks for.
    pub is_askew: bool,
}

impl Padding {
    /// The outline of the photograph in this picture of `size` pixels, where padding ends along four straight lines,
    /// one at each side: a photograph that was turned, or a print on paper. `None` otherwise: a night above and below a
    /// lit street ends along two.
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
        let inner = edges.iter().map(|edge| edge.moved_in(MARGIN_PX));
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
