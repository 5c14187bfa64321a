//! A full turn laid out flat must be cut somewhere: which overlaps the mesh leaves out.

use std::f64::consts::{PI, TAU};

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::geometry::wrap_angle;

use crate::stitch_graph::{GraphEdge, StitchGraph};

/// Where a full turn is cut.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FullTurnCut {
    /// Direction of the cut in the levelled world, radians from its forward axis towards the right.
    pub yaw: f64,
    /// Overlapping pairs (a < b) across the cut, sorted; they take no part in the mesh.
    pub severed: Vec<(usize, usize)>,
}

/// Decides whether the pictures go all the way round, and if so where to cut: through the direction that the weakest
/// overlaps cross.
///
/// `level_from_world` levels the world (y down). `edges` are the joined pairs of the component. Returns `None` when the
/// pictures lie flat without tearing: then every overlap can take part.
pub fn find_cut(cameras: &[Camera], edges: &[GraphEdge], level_from_world: &Matrix3<f64>) -> Option<FullTurnCut> {
    let yaws: Vec<f64> = cameras.iter().map(|camera| viewing_yaw(camera, level_from_world)).collect();
    if lies_flat(&yaws, edges) {
        return None;
    }
    let mut directions: Vec<f64> = yaws.clone();
    directions.sort_by(f64::total_cmp);
    let candidates = (0..directions.len()).map(|k| {
        let next = directions.get(k + 1).copied().unwrap_or(directions[0] + TAU);
        wrap_angle(0.5 * (directions[k] + next))
    });
    let mut best: Option<(bool, usize, f64)> = None;
    for yaw in candidates {
        let severed = severed_by(yaw, &yaws, edges);
        let weight: usize = severed.iter().map(|edge| edge.weight).sum();
        let torn = !stays_connected(cameras.len(), edges, &severed);
        let better = best.is_none_or(|(best_torn, best_weight, _)| (torn, weight) < (best_torn, best_weight));
        if better {
            best = Some((torn, weight, yaw));
        }
    }
    best.map(|(_, _, yaw)| {
        let severed = severed_by(yaw, &yaws, edges).iter().map(|edge| (edge.a, edge.b)).collect();
        FullTurnCut { yaw, severed }
    })
}

/// The direction a camera looks in, radians from the levelled forward axis towards the right.
fn viewing_yaw(camera: &Camera, level_from_world: &Matrix3<f64>) -> f64 {
    let forward = level_from_world * camera.rotation().row(2).transpose();
    forward.x.atan2(forward.z)
}

/// Whether going the short way along every edge gives each picture one consistent direction.
fn lies_flat(yaws: &[f64], edges: &[GraphEdge]) -> bool {
    let mut unwrapped: Vec<Option<f64>> = vec![None; yaws.len()];
    for start in 0..yaws.len() {
        if unwrapped[start].is_some() {
            continue;
        }
        unwrapped[start] = Some(yaws[start]);
        let mut queue = std::collections::VecDeque::from([start]);
        while let Some(here) = queue.pop_front() {
            let Some(place) = unwrapped[here] else { continue };
            for edge in edges.iter().filter(|edge| edge.a == here || edge.b == here) {
                let other = if edge.a == here { edge.b } else { edge.a };
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
    edges
        .iter()
        .filter(|edge| {
            let from_cut = |picture: usize| (yaws[picture] - cut).rem_euclid(TAU);
            (from_cut(edge.a) - from_cut(edge.b)).abs() > PI
        })
        .collect()
}

fn stays_connected(pictures: usize, edges: &[GraphEdge], severed: &[&GraphEdge]) -> bool {
    let kept = edges.iter().filter(|edge| !severed.contains(edge));
    let graph = StitchGraph::from_edges(pictures, kept.copied().collect());
    graph.components.len() == 1
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::rotation_about_y;

    use super::*;

    fn row(degrees: impl Iterator<Item = f64>) -> Vec<Camera> {
        degrees.map(|yaw| Camera::new(600.0, 800.0, 600.0, &rotation_about_y(yaw.to_radians()).transpose())).collect()
    }

    fn chain(pictures: usize, closed: bool, weak: usize) -> Vec<GraphEdge> {
        let mut edges: Vec<GraphEdge> =
            (0..pictures - 1).map(|k| GraphEdge { a: k, b: k + 1, weight: if k == weak { 20 } else { 100 } }).collect();
        if closed {
            edges.push(GraphEdge { a: 0, b: pictures - 1, weight: 90 });
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
        assert!((cut.yaw.to_degrees() - 3.5 * 24.0).abs() < 1e-9);
    }
}
