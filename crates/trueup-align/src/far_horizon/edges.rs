//! Edges that have sky above them.

use nalgebra::Vector3;

use super::view::{Color, Sides, View};

/// Least difference of the colors on both sides, gray levels.
const MIN_JUMP: f64 = 8.0;
/// Largest step among the colors above, by the difference across the edge: sky is smooth, or its clouds are soft.
const MAX_STEP_SHARE: f64 = 0.6;
/// Farthest that a place's edge may rise or fall against the horizon of the cameras, sine (25 degrees).
const MAX_SLOPE: f64 = 0.42;
/// Farthest from the cameras' horizon that places are looked at, sine (30 degrees).
const MAX_HEIGHT: f64 = 0.5;

/// Part of an edge between two of its places, with sky above both.
#[derive(Debug, Clone, Copy)]
pub(super) struct SkyEdge {
    /// The photograph.
    pub(super) photograph: usize,
    /// The curve among all of the photograph's.
    pub(super) curve: usize,
    /// Its ends, unit length in the common frame.
    pub(super) ends: [Vector3<f64>; 2],
    /// How far the colors on both sides differ, gray levels.
    pub(super) jump: f64,
    /// The color of the sky next to it.
    pub(super) sky: Color,
}

impl SkyEdge {
    /// Its length, radians.
    pub(super) fn length(&self) -> f64 {
        self.ends[0].angle(&self.ends[1])
    }

    pub(super) fn middle(&self) -> Vector3<f64> {
        (self.ends[0] + self.ends[1]).normalize()
    }
}

/// The parts of a photograph's edges that are about level, if `down` is about down, and have sky above them.
pub(super) fn under_sky(photograph: usize, view: &View<'_>, down: &Vector3<f64>) -> Vec<SkyEdge> {
    let mut edges = Vec::new();
    for (curve, edge) in view.curves.iter().enumerate() {
        let [Some(first), Some(last)] = [edge.places.first(), edge.places.last()] else { continue };
        if !is_level([first, last].map(|&place| view.direction(place)), down) {
            continue;
        }
        let directions: Vec<Vector3<f64>> = edge.places.iter().map(|&place| view.direction(place)).collect();
        // The sides of the last place looked at: most are looked at once, though they end two parts.
        let mut looked: Option<(usize, Option<Sides>)> = None;
        for (place, ends) in directions.windows(2).enumerate() {
            if !is_level([ends[0], ends[1]], down) {
                continue;
            }
            let look = |at: usize| {
                let is_brighter = view.is_brighter_above(&directions[at], down);
                is_brighter.then(|| view.sides(&directions[at], down)).flatten().filter(is_even_above)
            };
            let one = looked.filter(|(at, _)| *at == place).map_or_else(|| look(place), |(_, sides)| sides);
            let other = look(place + 1);
            looked = Some((place + 1, other));
            if let (Some(one), Some(other)) = (one, other) {
                edges.push(SkyEdge {
                    photograph,
                    curve,
                    ends: [ends[0], ends[1]],
                    jump: 0.5 * (one.jump() + other.jump()),
                    sky: 0.5 * (one.above[0] + other.above[0]),
                });
            }
        }
    }
    edges
}

/// Whether a part of an edge may be level, and near the horizon, if `down` is about down.
fn is_level(ends: [Vector3<f64>; 2], down: &Vector3<f64>) -> bool {
    let along = ends[1] - ends[0];
    along.dot(down).abs() <= MAX_SLOPE * along.norm() && ends[0].dot(down).abs() <= MAX_HEIGHT
}

/// Whether what is above an edge is even, as sky is, beside the difference across the edge.
fn is_even_above(sides: &Sides) -> bool {
    let jump = sides.jump();
    jump >= MIN_JUMP && sides.step_above() <= MAX_STEP_SHARE * jump
}
