//! The grids around which the equations of a round are made, and pixels that should meet on them.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use super::cell_pair::{CellPairs, MEMBERS};
use super::metric::Metric;

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
    /// Their cells, by the first vertices.
    first: [u32; 2],
    /// The vertices' shares of the distance.
    shares: [f64; MEMBERS],
    /// Their distance in the panorama now.
    pub gap: Vector2<f64>,
    /// What the bilinear sum over the vertices should come to: minus the difference of the bases' sags.
    value: Vector2<f64>,
}

impl PixelPair {
    pub(super) fn new(one: PhotographPixel, other: PhotographPixel, grids: &CurrentGrids) -> Self {
        let (a, b) = (one.photograph, other.photograph);
        let (corners_a, shares_a) = grids.solved[a].bilinear(one.at);
        let (corners_b, shares_b) = grids.solved[b].bilinear(other.at);
        let shares = std::array::from_fn(|k| if k < 4 { shares_a[k] } else { -shares_b[k - 4] });
        let gap = grids.gap(one, other);
        let value = grids.solved[a].warp(one.at) - grids.solved[b].warp(other.at) - gap;
        Self { first: [corners_a[0] as u32, corners_b[0] as u32], shares, gap, value }
    }

    /// Adds the squared distance of the two, weighed by `metric`, to the equations of their photographs.
    pub(super) fn add(&self, metric: Metric, equations: &mut CellPairs) {
        equations.of(self.first).add(&self.shares, metric, metric.apply(self.value));
    }
}
