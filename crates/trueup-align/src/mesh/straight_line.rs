//! Lines of a photograph that keep the shape which the base gives them.

use nalgebra::Vector2;
use trueup_core::lines::LineSegment;
use trueup_core::mesh::GridMesh;

use super::current_grids::CurrentGrids;
use super::metric::Metric;
use super::normal_equations::{NormalEquations, WeightedVertex};

/// Largest distance of a line's samples, working px: two or more in every cell of the usual grid.
const SPACING_PX: f64 = 20.0;

/// Which deviations of a sample count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DeviationTerm {
    /// In every direction: the line keeps its shape and its division.
    All,
    /// Across the line only: it keeps straight.
    Across,
}

/// Samples of a straight segment, from end to end.
pub(super) struct StraightLine {
    photograph: usize,
    /// Grid corners and shares of every sample.
    samples: Vec<([usize; 4], [f64; 4])>,
}

impl StraightLine {
    /// At least three samples.
    pub(super) fn along(photograph: usize, line: &LineSegment, grids: &[GridMesh]) -> Self {
        let steps = (line.length() / SPACING_PX).ceil().max(2.0) as usize;
        let (start, end) = (Vector2::from(line.start), Vector2::from(line.end));
        let at = |k: usize| grids[photograph].bilinear(start.lerp(&end, k as f64 / steps as f64));
        Self { photograph, samples: (0..=steps).map(at).collect() }
    }

    /// Adds weight |phi(p_k) - (1 - u_k) phi(p_0) - u_k phi(p_n)|^2 relative to the base for every inner sample.
    pub(super) fn add(&self, term: DeviationTerm, weight: f64, equations: &mut NormalEquations, grids: &CurrentGrids) {
        let last = self.samples.len() - 1;
        let place = |sample: usize| {
            let (corners, shares) = self.samples[sample];
            let mesh = &grids.solved[self.photograph];
            (0..4).fold(Vector2::zeros(), |sum, k| sum + Vector2::from(mesh.target[corners[k]]) * shares[k])
        };
        let chord: Vector2<f64> = place(last) - place(0);
        let Some(along) = chord.try_normalize(f64::EPSILON) else { return };
        let metric = match term {
            DeviationTerm::All => Metric::isotropic(weight),
            DeviationTerm::Across => Metric::along(Vector2::new(-along.y, along.x), weight),
        };
        let base = &grids.places[self.photograph];
        for inner in 1..last {
            let share = inner as f64 / last as f64;
            let members: [WeightedVertex; 12] = std::array::from_fn(|k| {
                let (sample, factor) = [(inner, 1.0), (0, share - 1.0), (last, -share)][k / 4];
                let (corners, shares) = self.samples[sample];
                WeightedVertex { photograph: self.photograph, vertex: corners[k % 4], weight: factor * shares[k % 4] }
            });
            let wanted = members.iter().fold(Vector2::zeros(), |sum, one| sum + base[one.vertex] * one.weight);
            equations.add_sum(&members, metric, wanted);
        }
    }
}
