//! What projections are drawn from.

use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;

/// A photograph whose camera is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PosedPhotograph {
    /// In the photograph's own pixels; its world is the level one.
    pub camera: Camera,
    /// The photograph's grid in the plane of the solved mesh.
    pub mesh: GridMesh,
}
