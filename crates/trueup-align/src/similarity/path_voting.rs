//! Path voting: how far neighbors up to a few edges away confirm a photograph's own roll.

use trueup_core::geometry::wrap_angle;

/// Longest path by which photographs vote on each other, edges (the paper's f_max).
const MAX_EDGES: usize = 3;
/// Most paths that vote on one photograph.
const MAX_PATHS: usize = 2000;
/// Largest disagreement in degrees between a prediction and the photograph's own roll that supports it.
const TOLERANCE_DEG: f64 = 5.0;
/// Slope of the sigmoid that makes a weight of the supporting share; not printed in the paper.
const SLOPE: f64 = 10.0;
/// Supporting share that yields the weight one half; not printed in the paper.
const CENTER: f64 = 0.5;

/// A simple path from the photograph under vote.
struct Path {
    nodes: Vec<usize>,
    /// Sum of the relative rolls along the path.
    turn: f64,
}

/// The weight psi_i of every photograph: a sigmoid of the supporting share; 0 for photographs without a roll.
///
/// `rolls`: each inlier's own roll alpha_i; `neighbors[i]`: pairs (j, beta_ij) with beta_ij predicting
/// alpha_j - alpha_i. A supporting path counts by its length L, an opposing one by [`MAX_EDGES`] + 1 - L: a long path
/// that agrees and a short one that does not say most.
///
/// # Source
/// The paper's section on robust weighting.
pub(super) fn path_weights(rolls: &[Option<f64>], neighbors: &[Vec<(usize, f64)>]) -> Vec<f64> {
    let weight = |index: usize| {
        rolls[index].map_or(0.0, |own| {
            let share = supporting_share(index, own, rolls, neighbors);
            1.0 / (1.0 + (-SLOPE * (share - CENTER)).exp())
        })
    };
    (0..rolls.len()).map(weight).collect()
}

/// The supporting share of all paths from `start`; one half without any path.
fn supporting_share(start: usize, own: f64, rolls: &[Option<f64>], neighbors: &[Vec<(usize, f64)>]) -> f64 {
    let (mut support, mut opposition) = (0.0, 0.0);
    let tolerance = TOLERANCE_DEG.to_radians();
    let mut paths_left = MAX_PATHS;
    let mut frontier = vec![Path { nodes: vec![start], turn: 0.0 }];
    // Breadth first: when the cap strikes it strikes the longest paths.
    for length in 1..=MAX_EDGES {
        let mut next = Vec::new();
        for path in &frontier {
            let Some(&last) = path.nodes.last() else { continue };
            for &(end, beta) in &neighbors[last] {
                let Some(roll) = rolls[end].filter(|_| !path.nodes.contains(&end) && paths_left > 0) else {
                    continue;
                };
                paths_left -= 1;
                let turn = path.turn + beta;
                if wrap_angle(roll - turn - own).abs() <= tolerance {
                    support += length as f64;
                } else {
                    opposition += (MAX_EDGES + 1 - length) as f64;
                }
                if length < MAX_EDGES {
                    let mut nodes = path.nodes.clone();
                    nodes.push(end);
                    next.push(Path { nodes, turn });
                }
            }
        }
        frontier = next;
    }
    if support + opposition > 0.0 { support / (support + opposition) } else { 0.5 }
}
