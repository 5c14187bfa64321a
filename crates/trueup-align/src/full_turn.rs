//! A full turn laid out flat must be cut somewhere: which overlaps lie across the cut, and how many turns apart.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::geometry::wrap_angle;

use crate::stitch_graph::{GraphEdge, StitchGraph};

/// Where a full turn is cut.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FullTurnCut {
    /// Direction of the cut in the levelled world, radians from its forward axis towards the right.
    pub yaw: f64,
    /// Overlapping pairs (a < b) across the cut, sorted: laid flat, their photographs lie a whole turn apart.
    pub severed: Vec<(usize, usize)>,
    /// Those of them that can close the turn; empty if the photographs do not hold together without them.
    pub closing: Vec<ClosingPair>,
}

/// An overlap across the cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClosingPair {
    /// First photograph.
    pub a: usize,
    /// Second photograph, greater than the first.
    pub b: usize,
    /// Turns by which the first photograph's part of the overlap lies to the right of the second's: 1 or -1.
    pub turns: f64,
}

impl FullTurnCut {
    /// Turns by which the part of an overlap in photograph `from` lies to the right of that in photograph `to`; `None`
    /// if the two do not close the turn.
    pub fn turns(&self, from: usize, to: usize) -> Option<f64> {
        let pair = self.closing.iter().find(|pair| (pair.a, pair.b) == (from.min(to), from.max(to)))?;
        Some(if from < to { pair.turns } else { -pair.turns })
    }
}

/// Decides whether the photographs go all the way round, and if so where to cut: through the direction that the weakest
/// overlaps cross.
///
/// `level_from_world` levels the world (y down). `edges` are the joined pairs of the component. Returns `None` when the
/// photographs lie flat without tearing: then every overlap can take part.
pub fn find_cut(cameras: &[Camera], edges: &[GraphEdge], level_from_world: &Matrix3<f64>) -> Option<FullTurnCut> {
    let yaws: Vec<f64> = cameras.iter().map(|camera| viewing_yaw(camera, level_from_world)).collect();
    if lies_flat(&yaws, edges) {
        return None;
    }
    let mut directions: Vec<f64> = yaws.clone();
    directions.sort_by(f64::total_cmp);
    let middles = (0..directions.len()).map(|k| {
        let next = directions.get(k + 1).copied().unwrap_or(directions[0] + TAU);
        wrap_angle(0.5 * (directions[k] + next))
    });
    let weight = |yaw: f64| -> usize { severed_by(yaw, &yaws, edges).iter().map(|edge| edge.weight).sum() };
    let mut candidates: Vec<CutCandidate> = middles.map(|yaw| CutCandidate { yaw, weight: weight(yaw) }).collect();
    // Of equals the first.
    candidates.sort_by_key(|candidate| candidate.weight);
    let whole = candidates.iter().find(|candidate| stays_connected(candidate.yaw, &yaws, edges));
    let torn = whole.is_none();
    let yaw = whole.or(candidates.first())?.yaw;
    let severed = severed_by(yaw, &yaws, edges);
    // A photograph that looks at a pole lies beside every direction; its overlaps say nothing of the turn.
    let turns_round = |edge: &&&GraphEdge| {
        [edge.a, edge.b].iter().all(|&k| is_moderate(viewing_direction(&cameras[k], level_from_world)))
    };
    let turns = |edge: &GraphEdge| (from_cut(yaw, yaws[edge.a]) - from_cut(yaw, yaws[edge.b])).signum();
    let closing = severed.iter().filter(|_| !torn).filter(turns_round);
    let closing = closing.map(|edge| ClosingPair { a: edge.a, b: edge.b, turns: turns(edge) }).collect();
    Some(FullTurnCut { yaw, severed: severed.iter().map(|edge| (edge.a, edge.b)).collect(), closing })
}

/// A direction that a full turn might be cut through.
#[derive(Debug, Clone, Copy)]
struct CutCandidate {
    yaw: f64,
    /// Matches in all overlaps that it severs.
    weight: usize,
}

/// Whether the overlaps lead all the way round: the photographs cannot be laid flat without cutting some.
pub(crate) fn goes_round(cameras: &[Camera], edges: &[GraphEdge], level_from_world: &Matrix3<f64>) -> bool {
    let yaws: Vec<f64> = cameras.iter().map(|camera| viewing_yaw(camera, level_from_world)).collect();
    !lies_flat(&yaws, edges)
}

/// Whether a direction in the level world is far enough from the poles to be unrolled.
pub(crate) fn is_moderate(ray: Vector3<f64>) -> bool {
    /// Sine of the largest latitude that is unrolled, 70 degrees.
    const STEEPEST: f64 = 0.94;
    (ray.y / ray.norm()).abs() <= STEEPEST
}

/// The direction a camera looks in, in the level world.
fn viewing_direction(camera: &Camera, level_from_world: &Matrix3<f64>) -> Vector3<f64> {
    level_from_world * camera.forward()
}

/// The direction a camera looks in, radians from the levelled forward axis towards the right.
fn viewing_yaw(camera: &Camera, level_from_world: &Matrix3<f64>) -> f64 {
    let forward = viewing_direction(camera, level_from_world);
    forward.x.atan2(forward.z)
}

/// Where a direction lies right of the cut, 0 to a whole turn.
fn from_cut(cut: f64, yaw: f64) -> f64 {
    (yaw - cut).rem_euclid(TAU)
}

/// Whether going the short way along every edge gives each photograph one consistent direction.
fn lies_flat(yaws: &[f64], edges: &[GraphEdge]) -> bool {
    let mut neighbors: Vec<Vec<usize>> = vec![Vec::new(); yaws.len()];
    for edge in edges {
        neighbors[edge.a].push(edge.b);
        neighbors[edge.b].push(edge.a);
    }
    let mut unwrapped: Vec<Option<f64>> = vec![None; yaws.len()];
    for start in 0..yaws.len() {
        if unwrapped[start].is_some() {
            continue;
        }
        unwrapped[start] = Some(yaws[start]);
        let mut queue = std::collections::VecDeque::from([start]);
        while let Some(here) = queue.pop_front() {
            let Some(place) = unwrapped[here] else { continue };
            for &other in &neighbors[here] {
                let expected = place + wrap_angle(yaws[other] - yaws[here]);
                match unwrapped[other] {
                    Some(known) if (known - expected).abs() > PI => return false,
                    Some(_) => {}
                    None => {
                        unwrapped[other] = Some(expected);
                        queue.push_back(other);
                    }
                }
            }
        }
    }
    true
}

/// The edges whose short way crosses the direction `cut`.
fn severed_by<'a>(cut: f64, yaws: &[f64], edges: &'a [GraphEdge]) -> Vec<&'a GraphEdge> {
    edges.iter().filter(|edge| is_severed(cut, yaws, edge)).collect()
}

fn is_severed(cut: f64, yaws: &[f64], edge: &GraphEdge) -> bool {
    (from_cut(cut, yaws[edge.a]) - from_cut(cut, yaws[edge.b])).abs() > PI
}

/// Whether the photographs hold together without the edges that cross the direction `cut`.
fn stays_connected(cut: f64, yaws: &[f64], edges: &[GraphEdge]) -> bool {
    let kept = edges.iter().filter(|edge| !is_severed(cut, yaws, edge));
    let graph = StitchGraph::from_edges(yaws.len(), kept.copied().collect());
    graph.components.len() == 1
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y};

    use super::*;

    fn row(degrees: impl Iterator<Item = f64>) -> Vec<Camera> {
        degrees.map(|yaw| Camera::new(600.0, 800.0, 600.0, &rotation_about_y(yaw.to_radians()).transpose())).collect()
    }

    fn chain(photographs: usize, closed: bool, weak: usize) -> Vec<GraphEdge> {
        let mut edges: Vec<GraphEdge> = (0..photographs - 1)
            .map(|k| GraphEdge { a: k, b: k + 1, weight: if k == weak { 20 } else { 100 } })
            .collect();
        if closed {
            edges.push(GraphEdge { a: 0, b: photographs - 1, weight: 90 });
        }
        edges
    }

    #[test]
    fn a_row_or_an_open_turn_is_not_cut() {
        let cameras = row((0..15).map(|k| f64::from(k) * 24.0));
        assert!(find_cut(&cameras, &chain(15, false, 3), &Matrix3::identity()).is_none());
        assert!(find_cut(&cameras[..5], &chain(5, false, 3), &Matrix3::identity()).is_none());
    }

    #[test]
    fn a_closed_turn_is_cut_at_its_weakest_overlap() {
        let cameras = row((0..15).map(|k| f64::from(k) * 24.0));
        let cut = find_cut(&cameras, &chain(15, true, 3), &Matrix3::identity()).expect("a full turn");
        assert_eq!(cut.severed, [(3, 4)]);
        // Photograph 3 lies at the right end, photograph 4 at the left.
        assert_eq!(cut.closing, [ClosingPair { a: 3, b: 4, turns: 1.0 }]);
        assert_eq!((cut.turns(3, 4), cut.turns(4, 3), cut.turns(0, 1)), (Some(1.0), Some(-1.0), None));
        assert!((cut.yaw.to_degrees() - 3.5 * 24.0).abs() < 1e-9);
    }
    #[test]
    fn what_tears_the_turn_and_what_looks_at_a_pole_does_not_close_it() {
        let cameras = row((0..15).map(|k| f64::from(k) * 24.0));
        let mut edges = chain(15, true, 3);
        // Photograph 2 hangs on by its overlap with 15, which looks straight up from the same direction.
        let mut with_zenith = cameras;
        let up = rotation_about_y(60_f64.to_radians()) * rotation_about_x(90_f64.to_radians());
        with_zenith.push(Camera::new(600.0, 800.0, 600.0, &up.transpose()));
        for a in 0..15 {
            edges.push(GraphEdge { a, b: 15, weight: 1 });
        }
        let cut = find_cut(&with_zenith, &edges, &Matrix3::identity()).expect("a full turn");
        assert!(cut.severed.len() > 1, "{:?}", cut.severed);
        assert!(cut.closing.iter().all(|pair| pair.b < 15) && cut.closing.len() == 1, "{:?}", cut.closing);
        // Two photographs that overlap on both sides: the turn hangs on one of the overlaps wherever it is cut.
        let three = row([0.0, 120.0, 240.0].into_iter());
        let edges = [(0, 1), (1, 2), (0, 2)].map(|(a, b)| GraphEdge { a, b, weight: 50 });
        let cut = find_cut(&three, &edges, &Matrix3::identity()).expect("a full turn");
        assert_eq!((cut.severed.len(), cut.closing.len()), (1, 1));
    }
}
