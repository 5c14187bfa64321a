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

impl WarpedMesh {
    /// Whether the photographs lie in one piece each: not round and round, and torn at no pole.
    pub fn lies_flat(&self) -> bool {
        /// Cells over a pole reach up to a turn; whole photographs are seldom wider than this, radians.
        const MOST_OF_A_CELL: f64 = 1.0;
        let most = self.by_cameras.map_or(f64::INFINITY, |plane| MOST_OF_A_CELL * plane.units_per_radian);
        let is_whole = |mesh: &GridMesh| {
            let rows = mesh.target.chunks(mesh.columns);
            rows.flat_map(|row| row.windows(2)).all(|pair| (pair[1][0] - pair[0][0]).abs() <= most)
        };
        self.period.is_none() && self.meshes.iter().all(is_whole)
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten cells of 40 units: 0.4 radians at 100 units each, 4 at 10.
    #[test]
    fn what_goes_round_or_is_torn_does_not_lie_flat() {
        let plane = |units_per_radian| CameraPlane { yaw: 0.0, units_per_radian, origin: [0.0; 2] };
        let drawn = |units_per_radian, period| WarpedMesh {
            meshes: vec![GridMesh::regular(400.0, 300.0, 40.0)],
            alignment_rms: 0.0,
            folds: 0,
            relative_gradient: 0.0,
            period,
            by_cameras: Some(plane(units_per_radian)),
        };
        assert!(drawn(100.0, None).lies_flat());
        assert!(!drawn(100.0, Some(628.3)).lies_flat());
        assert!(!drawn(10.0, None).lies_flat());
        assert!(WarpedMesh { by_cameras: None, ..drawn(10.0, None) }.lies_flat());
    }
}
