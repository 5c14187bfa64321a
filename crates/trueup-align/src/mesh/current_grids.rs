//! The grids around which the equations of a round are made, and pixels that should meet on them.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use super::normal_equations::{Metric, NormalEquations, WeightedVertex};

/// Grids around which equations are made.
#[derive(Debug, Clone, Copy)]
pub(super) struct CurrentGrids<'a> {
    /// Those whose vertices are unknown.
    pub solved: &'a [GridMesh],
    /// The same subdivided along the bases.
    pub fine: &'a [GridMesh],
    /// The bases' places of the grids' vertices.
    pub places: &'a [Vec<Vector2<f64>>],
}

/// A place in a photograph.
#[derive(Debug, Clone, Copy)]
pub(super) struct PhotographPixel {
    /// The photograph.
    pub photograph: usize,
    /// Where in it, working pixels.
    pub at: Vector2<f64>,
}

impl CurrentGrids<'_> {
    /// Distance in the panorama of a pixel of one photograph from one of another.
    pub(super) fn gap(&self, one: PhotographPixel, other: PhotographPixel) -> Vector2<f64> {
        self.fine[one.photograph].warp(one.at) - self.fine[other.photograph].warp(other.at)
    }
}

/// A pixel of one photograph and one of another that should meet.
pub(super) struct PixelPair {
    members: [WeightedVertex; 8],
    /// Their distance in the panorama now.
    pub gap: Vector2<f64>,
    /// What the bilinear sum over the members should come to: minus the difference of the bases' sags.
    value: Vector2<f64>,
}

impl PixelPair {
    pub(super) fn new(one: PhotographPixel, other: PhotographPixel, grids: &CurrentGrids) -> Self {
        let (a, b) = (one.photograph, other.photograph);
        let (corners_a, shares_a) = grids.solved[a].bilinear(one.at);
        let (corners_b, shares_b) = grids.solved[b].bilinear(other.at);
        let members = std::array::from_fn(|k| match k {
            0..4 => WeightedVertex { photograph: a, vertex: corners_a[k], weight: shares_a[k] },
            _ => WeightedVertex { photograph: b, vertex: corners_b[k - 4], weight: -shares_b[k - 4] },
        });
        let gap = grids.gap(one, other);
        let value = grids.solved[a].warp(one.at) - grids.solved[b].warp(other.at) - gap;
        Self { members, gap, value }
    }

    /// Adds the squared distance of the two, weighed by `metric`.
    pub(super) fn add(&self, metric: Metric, equations: &mut NormalEquations) {
        equations.add_sum(&self.members, metric, self.value);
    }
}
