//! Grids with more vertices.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use super::base::BaseMap;

/// The undeformed grid with `factor` cells per cell of `grid` along each axis.
pub fn divided(grid: &GridMesh, factor: usize) -> GridMesh {
    let (rows, columns) = ((grid.rows - 1) * factor + 1, (grid.columns - 1) * factor + 1);
    let mut fine = GridMesh { rows, columns, target: Vec::new(), lines: None, ..*grid };
    fine.target = (0..fine.len()).map(|vertex| fine.source(vertex).into()).collect();
    fine
}

/// How far the base is from its bilinear interpolation over the cells of `grid`, at the vertices of the grid
/// [`divided`].
pub(super) fn sags(grid: &GridMesh, base: &BaseMap, places: &[Vector2<f64>], factor: usize) -> Vec<Vector2<f64>> {
    let fine = divided(grid, factor);
    (0..fine.len()).map(|vertex| base.sag(grid, places, fine.source(vertex))).collect()
}

/// A solved grid with more vertices: the base's own curves plus the bilinear deviation from it, given the base's
/// [`sags`].
pub(super) fn subdivided(solved: &GridMesh, sags: &[Vector2<f64>], factor: usize) -> GridMesh {
    let mut fine = divided(solved, factor);
    fine.target = sags.iter().enumerate().map(|(v, sag)| (solved.warp(fine.source(v)) + sag).into()).collect();
    fine
}
