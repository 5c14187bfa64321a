//! The turns of all photographs: their own rolls against the relative rolls of pairs.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::wrap_angle;
use trueup_core::matches::PairMatches;

use super::options::{BetaMode, SimilarityOptions};
use super::path_voting::path_weights;
use super::upright::rolls;
use super::weighted_solve::{DataTerm, TurnTerm, solve_unit_vectors};

/// Length of a solved vector below which its terms contradict each other.
const CONTRADICTED: f64 = 0.1;

/// What is known of the photographs' rolls. All lists but `edges` have an entry per photograph.
#[derive(Debug, Clone, Copy)]
pub(super) struct RollEvidence<'a> {
    /// Down, in the cameras' world.
    pub down: &'a Vector3<f64>,
    /// Rolls alpha_i in radians by the photographs' own directions.
    pub own: &'a [Option<f64>],
    /// The cameras' rotations as they were given.
    pub given_rotations: &'a [Matrix3<f64>],
    /// The same, as far as lines correct them.
    pub corrected_rotations: &'a [Matrix3<f64>],
    /// The joined pairs.
    pub edges: &'a [PairMatches],
}

/// The turns, and how much each photograph's own roll had to say.
#[derive(Debug, Clone)]
pub(super) struct SolvedTurns {
    /// Turns theta_i in radians.
    pub theta: Vec<f64>,
    /// Weights psi_i; 0 for photographs without a roll of their own.
    pub weights: Vec<f64>,
}

/// The paper's weighted least squares: own rolls against relative rolls.
pub(super) fn solve_turns(evidence: &RollEvidence<'_>, options: &SimilarityOptions) -> SolvedTurns {
    let own = evidence.own;
    let predicted = rolls(evidence.down, evidence.corrected_rotations);
    let turns: Vec<TurnTerm> = evidence
        .edges
        .iter()
        .map(|edge| {
            let (i, j) = (edge.a, edge.b);
            let turn = match options.beta_mode {
                BetaMode::World => wrap_angle(predicted[j] - predicted[i]),
                BetaMode::Relative => -printed_twist(&evidence.given_rotations[i], &evidence.given_rotations[j]),
                BetaMode::Printed => printed_twist(&evidence.given_rotations[i], &evidence.given_rotations[j]),
            };
            TurnTerm { i, j, turn, weight: options.relative_weight }
        })
        .collect();
    let weights: Vec<f64> = match options.path_voting {
        true => path_weights(own, &neighbors(own.len(), &turns)),
        false => own.iter().map(|roll| f64::from(u8::from(roll.is_some()))).collect(),
    };
    let data: Vec<DataTerm> = own
        .iter()
        .zip(&weights)
        .enumerate()
        .filter_map(|(index, (roll, &weight))| roll.map(|angle| DataTerm { index, angle, weight }))
        .collect();
    let theta = match solve_unit_vectors(own.len(), &data, &turns) {
        Some(vectors) => vectors.iter().zip(&predicted).map(|(vector, &roll)| angle_of(vector, roll)).collect(),
        // Some photograph has neither a roll of its own nor a neighbor.
        None => predicted,
    };
    SolvedTurns { theta, weights }
}

/// Per photograph its neighbors j with beta_ij, which predicts theta_j - theta_i.
fn neighbors(photographs: usize, turns: &[TurnTerm]) -> Vec<Vec<(usize, f64)>> {
    let mut neighbors = vec![Vec::new(); photographs];
    for &TurnTerm { i, j, turn, .. } in turns {
        neighbors[i].push((j, turn));
        neighbors[j].push((i, -turn));
    }
    neighbors
}

/// The twist about the viewing direction of R_j R_i^-1, the paper's beta_ij.
///
/// # Departures
/// What predicts theta_j - theta_i has the opposite sign, since R_i takes the world to the camera; and the twist is the
/// difference of upright rolls only for level cameras: two level cameras at pitch p that pan by y twist by about y sin
/// p.
fn printed_twist(rotation_i: &Matrix3<f64>, rotation_j: &Matrix3<f64>) -> f64 {
    let relative = rotation_j * rotation_i.transpose();
    (relative[(1, 0)] - relative[(0, 1)]).atan2(relative[(0, 0)] + relative[(1, 1)])
}

fn angle_of(vector: &[f64; 2], otherwise: f64) -> f64 {
    let [u, v] = *vector;
    if u.hypot(v) < CONTRADICTED { otherwise } else { v.atan2(u) }
}
