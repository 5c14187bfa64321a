//! Path voting: how far neighbors up to a few edges away confirm a picture's own roll.

use trueup_core::geometry::wrap_angle;

/// Parameters of the vote.
#[derive(Debug, Clone, Copy)]
pub(super) struct PathVote {
    /// Longest path, in edges (the paper's f_max).
    pub max_edges: usize,
    /// Largest disagreement in radians between a prediction and the picture's own roll that supports it.
    pub tolerance: f64,
    /// Most paths per picture.
    pub max_paths: usize,
}

/// A simple path from the picture under vote.
struct Path {
    nodes: Vec<usize>,
    /// Sum of the relative rolls along the path.
    turn: f64,
}

impl PathVote {
    /// The weight psi_i of every picture: a sigmoid of the supporting share; 0 for pictures without a roll.
    ///
    /// `rolls`: each inlier's own roll alpha_i; `neighbors[i]`: pairs (j, beta_ij) with beta_ij predicting
    /// alpha_j - alpha_i. A supporting path counts by its length L, an opposing one by `max_edges` + 1 - L: a long path
    /// that agrees and a short one that does not say most.
    ///
    /// # Source
    /// The paper's section on robust weighting; the sigmoid's slope 10 and center 0.5 are not printed there.
    pub fn weights(&self, rolls: &[Option<f64>], neighbors: &[Vec<(usize, f64)>]) -> Vec<f64> {
        const SLOPE: f64 = 10.0;
        const CENTER: f64 = 0.5;
        let weight = |index: usize| {
            rolls[index].map_or(0.0, |own| {
                let share = self.supporting_share(index, own, rolls, neighbors);
                1.0 / (1.0 + (-SLOPE * (share - CENTER)).exp())
            })
        };
        (0..rolls.len()).map(weight).collect()
    }

    /// The supporting share of all paths from `start`; one half without any path.
    fn supporting_share(&self, start: usize, own: f64, rolls: &[Option<f64>], neighbors: &[Vec<(usize, f64)>]) -> f64 {
        let (mut support, mut opposition) = (0.0, 0.0);
        let mut paths_left = self.max_paths;
        let mut frontier = vec![Path { nodes: vec![start], turn: 0.0 }];
        // Breadth first: when the cap strikes it strikes the longest paths.
        for length in 1..=self.max_edges {
            let mut next = Vec::new();
            for path in &frontier {
                let Some(&last) = path.nodes.last() else { continue };
                for &(end, beta) in &neighbors[last] {
                    let Some(roll) = rolls[end].filter(|_| !path.nodes.contains(&end) && paths_left > 0) else {
                        continue;
                    };
                    paths_left -= 1;
                    let turn = path.turn + beta;
                    if wrap_angle(roll - turn - own).abs() <= self.tolerance {
                        support += length as f64;
                    } else {
                        opposition += (self.max_edges + 1 - length) as f64;
                    }
                    if length < self.max_edges {
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
}
