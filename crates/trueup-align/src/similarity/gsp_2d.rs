//! The global similarity prior in two dimensions: photographs that their overlaps let be upright are.

use std::collections::VecDeque;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use trueup_core::geometry::{roll_from_down, wrap_angle};

use super::edge_range::{OverlapTurns, TurnRange};
use super::input::PriorInput;
use super::upright::Upright;
use super::weighted_solve::{DataTerm, TurnTerm, solve_unit_vectors};

/// How far outside its range a turn still passes for allowed, radians: 1.5 degrees.
const SLACK: f64 = 1.5 * std::f64::consts::PI / 180.0;
/// Residual weight that ties the reference and the photographs that are upright.
const HARD_WEIGHT: f64 = 1e4;
/// Residual weight of the turn of least line distortion.
const TURN_WEIGHT: f64 = 1.0;

/// One side's view of an edge.
#[derive(Debug, Clone, Copy)]
struct Neighbor {
    index: usize,
    /// The turns theta_index - theta_here that the overlap allows; `None` without a warped overlap.
    range: Option<TurnRange>,
    /// The one of least line distortion.
    best: f64,
}

/// What the walk decided of a photograph.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Decided {
    theta: f64,
    /// Whether the photograph is held where it is: the reference, and photographs that may be upright.
    held: bool,
}

/// The turns of the published prior; `down` is the vertical that straightening finds, in the cameras' world.
///
/// The reference takes the roll that straightening finds for it, and the turn that the user wants. A walk from there
/// leaves every photograph unturned whose overlap with a decided one allows that, and turns the others by least line
/// distortion; a least squares then holds the reference and the unturned photographs and takes the turns of least line
/// distortion along all edges. The result depends on the reference by construction: it alone stands upright among
/// photographs that stay as they were taken.
///
/// # Source
/// Chen and Chuang, Natural Image Stitching with the Global Similarity Prior (2016), section 4 (the 2D method), and
/// what their program does: the reference's roll is that of its three-dimensional method, and the range of an overlap's
/// turns is that of all its grid edges.
///
/// # Departures
/// See `edge_range` for how the turn of least line distortion is measured.
pub(super) fn upright(input: &PriorInput<'_>, down: Vector3<f64>) -> Upright {
    let turns: Vec<(Option<TurnRange>, TurnTerm)> = input
        .edges
        .par_iter()
        .map(|edge| {
            let overlap = OverlapTurns::of(input, edge);
            // Neither segments nor an overlap: nothing is known against no turn at all.
            let turn = overlap.best(input, edge).unwrap_or(0.0);
            (overlap.range, TurnTerm { i: edge.a, j: edge.b, turn, weight: TURN_WEIGHT * TURN_WEIGHT })
        })
        .collect();
    let mut neighbors = vec![Vec::new(); input.cameras.len()];
    for &(range, TurnTerm { i, j, turn, .. }) in &turns {
        neighbors[i].push(Neighbor { index: j, range, best: turn });
        neighbors[j].push(Neighbor { index: i, range: range.map(|range| range.reversed()), best: -turn });
    }
    for of_one in &mut neighbors {
        of_one.sort_by_key(|neighbor| neighbor.index);
    }
    let rotations: Vec<Matrix3<f64>> = input.cameras.iter().map(trueup_core::camera::Camera::rotation).collect();
    let roll = roll_from_down(&(rotations[input.reference] * down));
    let decided = walk(&neighbors, input.reference, wrap_angle(roll + input.turn));
    let hard: Vec<DataTerm> = decided
        .iter()
        .enumerate()
        .filter(|(_, one)| one.held)
        .map(|(index, one)| DataTerm { index, angle: one.theta, weight: HARD_WEIGHT * HARD_WEIGHT })
        .collect();
    let turns: Vec<TurnTerm> = turns.into_iter().map(|(_, term)| term).collect();
    let theta = match solve_unit_vectors(decided.len(), &hard, &turns) {
        Some(vectors) => vectors.iter().map(|[u, v]| v.atan2(*u)).collect::<Vec<f64>>(),
        // Some photograph is joined to none.
        None => decided.iter().map(|one| one.theta).collect(),
    };
    // The reference took the user's turn already; the common last step adds it to every photograph.
    Upright { down, theta: theta.iter().map(|theta| theta - input.turn).collect(), rotations }
}

/// Decides the photographs one after the other, from the reference outwards: those that may be upright first.
/// Photographs that cannot be reached stay as they are.
fn walk(neighbors: &[Vec<Neighbor>], reference: usize, reference_theta: f64) -> Vec<Decided> {
    let mut decided: Vec<Option<Decided>> = vec![None; neighbors.len()];
    let mut visited = vec![false; neighbors.len()];
    decided[reference] = Some(Decided { theta: reference_theta, held: true });
    // A photograph and the turn it takes unless it is upright by the time it is reached.
    let mut queue = VecDeque::from([(reference, reference_theta)]);
    while let Some((here, otherwise)) = queue.pop_front() {
        if std::mem::replace(&mut visited[here], true) {
            continue;
        }
        let theta = decided[here].get_or_insert(Decided { theta: otherwise, held: false }).theta;
        for &Neighbor { index, range, best } in &neighbors[here] {
            if decided[index].is_some() {
                continue;
            }
            if range.is_some_and(|range| range.contains_within(-theta, SLACK)) {
                decided[index] = Some(Decided { theta: 0.0, held: true });
                queue.push_front((index, 0.0));
            } else {
                queue.push_back((index, theta + best));
            }
        }
    }
    decided.into_iter().map(|one| one.unwrap_or(Decided { theta: 0.0, held: false })).collect()
}
