//! Grids under a map.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

/// The grid whose vertices go where `place` says.
pub(super) fn deformed(grid: &GridMesh, place: impl Fn(Vector2<f64>) -> Vector2<f64>) -> GridMesh {
    let target = (0..grid.len()).map(|vertex| place(grid.source(vertex)).into()).collect();
    GridMesh { target, ..grid.clone() }
}
