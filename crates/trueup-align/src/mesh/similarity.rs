//! The energies of grid edges: E_l keeps every edge in a similarity with its neighborhood, E_g draws that similarity to
//! the prior's scale and rotation.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use super::complex::product;
use super::normal_equations::{Coefficient, NormalEquations};
use super::options::MeshOptions;

/// The cell size that the published weights belong to.
pub(super) const PUBLISHED_CELL_PX: f64 = 40.0;
/// Growth of the prior's weight with the distance from the overlap, per diagonal of the photograph; as published.
pub(super) const PRIOR_SLOPE: f64 = 20.0;

/// E_l and E_g of one photograph, both relative to a base grid: with a base that is a similarity of the photograph they
/// are the published energies.
///
/// For an edge from a to b the neighborhood is the 4-neighbors of a and of b without a. The similarity c + i s that
/// maps the undeformed differences from a to the deformed ones best is linear in the vertices:
/// sum_m conj(d_m) (v_m - v_a) / sum |d_m|^2 with complex numbers for points of the plane.
#[derive(Debug)]
pub(super) struct SimilarityEnergy<'a> {
    grid: &'a GridMesh,
    base: &'a [Vector2<f64>],
    local_weight: f64,
    /// Weight of the prior for every cell, row-major.
    cell_weights: Vec<f64>,
}

impl<'a> SimilarityEnergy<'a> {
    /// `base` holds a place for every vertex of `grid`, up to translation: the shape without cost. `overlap` tells for
    /// every cell whether match points lie in it: the prior's weight grows with the distance to the nearest such cell,
    /// by `prior_slope` per diagonal (see [`PRIOR_SLOPE`]).
    ///
    /// # Departures
    /// The distance is the exact one to the nearest cell with match points; the published code propagates it from cell
    /// to cell, which can miss the nearest.
    pub(super) fn new(
        grid: &'a GridMesh,
        base: &'a [Vector2<f64>],
        overlap: &[bool],
        options: &MeshOptions,
        prior_slope: f64,
    ) -> Self {
        let columns = grid.columns - 1;
        let center = |cell: usize| {
            Vector2::new(
                ((cell % columns) as f64 + 0.5) * grid.cell_width(),
                ((cell / columns) as f64 + 0.5) * grid.cell_height(),
            )
        };
        let bearing: Vec<Vector2<f64>> = (0..overlap.len()).filter(|&cell| overlap[cell]).map(center).collect();
        let diagonal = grid.width.hypot(grid.height);
        // The published weights belong to 40 px cells: E_g has no unit, the other energies are in pixels.
        let unit = options.cell_px / PUBLISHED_CELL_PX;
        let cell_weights = (0..overlap.len())
            .map(|cell| {
                let here = center(cell);
                let nearest = bearing.iter().map(|other| (other - here).norm()).min_by(f64::total_cmp);
                unit * (options.prior_weight + prior_slope * nearest.unwrap_or(0.0) / diagonal)
            })
            .collect();
        Self { grid, base, local_weight: options.local_weight, cell_weights }
    }

    /// Adds both energies for every edge of the grid of `photograph`.
    pub(super) fn add(&self, photograph: usize, equations: &mut NormalEquations) {
        let (rows, columns) = (self.grid.rows, self.grid.columns);
        for row in 0..rows {
            for column in 0..columns {
                let a = row * columns + column;
                if column + 1 < columns {
                    let weight = self.mean_weight(row.checked_sub(1), Some(row), Some(column), Some(column));
                    self.add_edge(photograph, a, a + 1, weight, equations);
                }
                if row + 1 < rows {
                    let weight = self.mean_weight(Some(row), Some(row), column.checked_sub(1), Some(column));
                    self.add_edge(photograph, a, a + columns, weight, equations);
                }
            }
        }
    }

    /// Mean weight of the one or two cells that share an edge; cells outside the grid do not count.
    fn mean_weight(
        &self,
        row: Option<usize>,
        other_row: Option<usize>,
        column: Option<usize>,
        other_column: Option<usize>,
    ) -> f64 {
        let columns = self.grid.columns - 1;
        let weight = |row: Option<usize>, column: Option<usize>| match (row, column) {
            (Some(row), Some(column)) if row + 1 < self.grid.rows && column < columns => {
                self.cell_weights.get(row * columns + column).copied()
            }
            _ => None,
        };
        let (first, second) = (weight(row, column), weight(other_row, other_column));
        match (first, second) {
            (Some(one), Some(other)) => 0.5 * (one + other),
            (one, other) => one.or(other).unwrap_or_default(),
        }
    }

    fn add_edge(&self, photograph: usize, a: usize, b: usize, weight: f64, equations: &mut NormalEquations) {
        let neighborhood = self.neighborhood(a, b);
        let origin = self.grid.source(a);
        let difference = |m: usize| self.grid.source(m) - origin;
        let total: f64 = neighborhood.iter().map(|&m| difference(m).norm_squared()).sum();
        let mut similarity: Vec<(usize, Coefficient)> = Vec::with_capacity(neighborhood.len() + 1);
        let mut at_origin = Vector2::zeros();
        for &m in &neighborhood {
            let d = difference(m);
            let factor = Vector2::new(d.x, -d.y) / total;
            similarity.push((m, factor));
            at_origin -= factor;
        }
        similarity.push((a, at_origin));

        let edge = difference(b);
        let local: Vec<(usize, Coefficient)> = similarity
            .iter()
            .map(|&(m, factor)| {
                let mut coefficient = -product(edge, factor);
                if m == b {
                    coefficient.x += 1.0;
                } else if m == a {
                    coefficient.x -= 1.0;
                }
                (m, coefficient * self.local_weight)
            })
            .collect();
        equations.add_inside(photograph, &local, self.of_base(&local));
        for (_, factor) in &mut similarity {
            *factor *= weight;
        }
        equations.add_inside(photograph, &similarity, self.of_base(&similarity));
    }

    /// What a combination of vertices amounts to on the base.
    fn of_base(&self, members: &[(usize, Coefficient)]) -> Vector2<f64> {
        members.iter().fold(Vector2::zeros(), |sum, &(m, factor)| sum + product(factor, self.base[m]))
    }

    /// The 4-neighbors of a and b without a, ascending, each once.
    fn neighborhood(&self, a: usize, b: usize) -> Vec<usize> {
        let (rows, columns) = (self.grid.rows, self.grid.columns);
        let mut found = Vec::with_capacity(8);
        for vertex in [a, b] {
            let (row, column) = (vertex / columns, vertex % columns);
            found.extend((row > 0).then(|| vertex - columns));
            found.extend((column > 0).then(|| vertex - 1));
            found.extend((column + 1 < columns).then_some(vertex + 1));
            found.extend((row + 1 < rows).then_some(vertex + columns));
        }
        found.sort_unstable();
        found.dedup();
        found.retain(|&vertex| vertex != a);
        found
    }
}
