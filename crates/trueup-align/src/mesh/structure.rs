//! Long straight lines keep the shape that the base gives them, across the cells of a grid.
//!
//! # Source
//! The structure term of GES-GSP (Du and others, "Geometric structure preserving warp for natural image stitching", CVPR
//! 2022): samples of a long curve keep their coordinates in the frame of the curve's chord.
//!
//! # Departures
//! The curves are chains of collinear segments, whose samples lie on the chord; relative to the base, as all energies here.

use nalgebra::Vector2;
use trueup_core::lines::LineSegment;
use trueup_core::mesh::GridMesh;

use super::line_alignment::Present;
use super::normal_equations::{Metric, NormalEquations, Share};

trueup_core::options! {
    /// How long lines keep their shape (`stitch.structure = lines`).
    pub struct StructureOptions("structure") {
        /// Weight of a squared deviation of a line's sample from its place between the line's ends.
        weight: f64 = 2.25, between(0.0, 10000.0), "per working px squared";
        /// Shortest line that counts, as a share of the picture's diagonal.
        min_diagonal: f64 = 0.1, between(0.0, 2.0), "diagonals";
        /// Distance of the samples.
        spacing_px: f64 = 20.0, between(1.0, 1000.0), "working px";
    }
}

/// What the structure energy is given.
#[derive(Debug, Clone, Copy)]
pub struct StructureInput<'a> {
    /// Chains of collinear segments of every picture, as one segment each.
    pub chains: &'a [Vec<LineSegment>],
    /// How.
    pub options: &'a StructureOptions,
}

impl StructureInput<'_> {
    /// Adds the equations of all long chains.
    pub(super) fn add(&self, equations: &mut NormalEquations, present: &Present) {
        for (picture, chains) in self.chains.iter().enumerate() {
            let grid = &present.solved[picture];
            let shortest = self.options.min_diagonal * grid.width.hypot(grid.height);
            for chain in chains.iter().filter(|chain| chain.length() >= shortest) {
                let rod = Rod::along(picture, chain, self.options.spacing_px, present.solved);
                rod.add(RodTerm::All, self.options.weight, equations, present);
            }
        }
    }
}

/// Which deviations of a sample count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RodTerm {
    /// In every direction: the line keeps its shape and its division.
    All,
    /// Across the line only: it keeps straight.
    Across,
}

/// Samples of a straight segment, from end to end.
pub(super) struct Rod {
    picture: usize,
    /// Grid corners and shares of every sample.
    samples: Vec<([usize; 4], [f64; 4])>,
}

impl Rod {
    /// Samples at most `spacing_px` apart, at least three.
    pub fn along(picture: usize, line: &LineSegment, spacing_px: f64, grids: &[GridMesh]) -> Self {
        let steps = (line.length() / spacing_px).ceil().max(2.0) as usize;
        let (start, end) = (Vector2::from(line.start), Vector2::from(line.end));
        let at = |k: usize| grids[picture].bilinear(start.lerp(&end, k as f64 / steps as f64));
        Self { picture, samples: (0..=steps).map(at).collect() }
    }

    /// Adds weight |phi(p_k) - (1 - u_k) phi(p_0) - u_k phi(p_n)|^2 relative to the base for every inner sample.
    pub fn add(&self, term: RodTerm, weight: f64, equations: &mut NormalEquations, present: &Present) {
        let last = self.samples.len() - 1;
        let place = |sample: usize| {
            let (corners, shares) = self.samples[sample];
            let mesh = &present.solved[self.picture];
            (0..4).fold(Vector2::zeros(), |sum, k| sum + Vector2::from(mesh.target[corners[k]]) * shares[k])
        };
        let chord: Vector2<f64> = place(last) - place(0);
        let Some(along) = chord.try_normalize(f64::EPSILON) else { return };
        let metric = match term {
            RodTerm::All => Metric::isotropic(weight),
            RodTerm::Across => Metric::along(Vector2::new(-along.y, along.x), weight),
        };
        let base = &present.places[self.picture];
        for inner in 1..last {
            let share = inner as f64 / last as f64;
            let members: [Share; 12] = std::array::from_fn(|k| {
                let (sample, factor) = [(inner, 1.0), (0, share - 1.0), (last, -share)][k / 4];
                let (corners, shares) = self.samples[sample];
                Share { picture: self.picture, vertex: corners[k % 4], share: factor * shares[k % 4] }
            });
            let wanted = members.iter().fold(Vector2::zeros(), |sum, one| sum + base[one.vertex] * one.share);
            equations.add_sum(&members, metric, wanted);
        }
    }
}
