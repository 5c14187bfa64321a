//! A vertical, and what it means for the cameras.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::roll_from_down;

/// A vertical and the turns that follow from it.
pub(super) struct Upright {
    /// Down, in the cameras' world.
    pub down: Vector3<f64>,
    /// Turns in radians, without the one that the user wants.
    pub theta: Vec<f64>,
    /// The cameras' rotations, as far as lines correct them.
    pub rotations: Vec<Matrix3<f64>>,
}

/// The roll of each camera for a vertical in their world.
pub(super) fn rolls(down: &Vector3<f64>, rotations: &[Matrix3<f64>]) -> Vec<f64> {
    rotations.iter().map(|rotation| roll_from_down(&(rotation * down))).collect()
}
