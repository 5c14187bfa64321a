//! The deformed grids.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use trueup_core::mesh::GridMesh;

use super::camera_plane::CameraPlane;

/// The deformed grids of one component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WarpedMesh {
    /// One grid per photograph: sources in working pixels, targets in panorama units (about working pixels).
    pub meshes: Vec<GridMesh>,
    /// Root mean square distance between the two places of a match point, in panorama units.
    pub alignment_rms: f64,
    /// Number of grid triangles turned over (signed area not positive), over all photographs.
    pub folds: usize,
    /// Relative gradient |A^T (A x - b)| / |A^T b| of the energy at the solution.
    pub relative_gradient: f64,
    /// Length of a full turn in panorama units: places this far apart in x are the same. `None` if the photographs do
    /// not go all the way round, or their ends do not meet.
    #[serde(default)]
    pub period: Option<f64>,
    /// Where directions lie in the panorama, if it was drawn by the cameras because the mesh was worse.
    #[serde(default)]
    pub by_cameras: Option<CameraPlane>,
}

/// Triangles of the grid with a signed area that is not positive.
pub(crate) fn count_folds(mesh: &GridMesh) -> usize {
    let vertex = |row: usize, column: usize| Vector2::from(mesh.target[row * mesh.columns + column]);
    let mut folds = 0;
    for row in 0..mesh.rows - 1 {
        for column in 0..mesh.columns - 1 {
            let top_left = vertex(row, column);
            let bottom_right = vertex(row + 1, column + 1) - top_left;
            let top_right = vertex(row, column + 1) - top_left;
            let bottom_left = vertex(row + 1, column) - top_left;
            folds += usize::from(top_right.perp(&bottom_right) <= 0.0);
            folds += usize::from(bottom_right.perp(&bottom_left) <= 0.0);
        }
    }
    folds
}

/// Triangles turned over in all of `meshes`.
pub(super) fn total_folds(meshes: &[GridMesh]) -> usize {
    meshes.iter().map(count_folds).sum()
}
