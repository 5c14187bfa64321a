//! What a mesh is judged by, and what the cameras draw from.

use nalgebra::Matrix3;
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;

use crate::match_points::OverlapWarp;

/// What the mesh is judged by.
#[derive(Debug, Clone, Copy)]
pub struct ByCamerasInput<'a> {
    /// The undeformed grids.
    pub grids: &'a [GridMesh],
    /// The cameras as the prior's lines correct them, in working pixels; their world is the level one.
    pub cameras: &'a [Camera],
    /// Match points of all pairs, those across the cut of a full turn among them.
    pub warps: &'a [OverlapWarp],
    /// Pairs (a < b, sorted) whose photographs the mesh lays a whole turn apart.
    pub severed: &'a [(usize, usize)],
    /// The scene's dominant directions in the level world (columns), if they are known.
    pub dominant: Option<&'a Matrix3<f64>>,
    /// Panorama units per radian.
    pub units_per_radian: f64,
}
