//! One overlap seen through its pixels.

use trueup_core::mesh::GridMesh;

use super::pyramid::GrayPyramid;
use crate::match_points::OverlapWarp;

/// One direction of a pair: the photograph whose pixels are sampled, and the one they are looked up in.
pub(super) struct PhotometricOverlap<'a> {
    pub warp: &'a OverlapWarp,
    /// The solved grids, whose vertices are unknown.
    pub solved: [&'a GridMesh; 2],
    /// The same, subdivided along the base.
    pub fine: [&'a GridMesh; 2],
    pub pyramids: [&'a GrayPyramid; 2],
}
