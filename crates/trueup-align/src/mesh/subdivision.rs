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

/// A solved grid with more vertices: the base's own curves plus the bilinear deviation from it.
pub(super) fn subdivided(solved: &GridMesh, base: &BaseMap, places: &[Vector2<f64>], factor: usize) -> GridMesh {
    let mut fine = divided(solved, factor);
    let place = |pixel: Vector2<f64>| solved.warp(pixel) + base.sag(solved, places, pixel);
    fine.target = (0..fine.len()).map(|vertex| place(fine.source(vertex)).into()).collect();
    fine
}
