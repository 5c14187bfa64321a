//! How photographs are drawn that give way.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use trueup_core::mesh::GridMesh;

/// By how many of its own pixels each vertex of a photograph's grid looks aside, row-major.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct ParallaxShift {
    /// One for each vertex; bilinear between.
    pub aside: Vec<Vector2<f64>>,
}

impl From<Vec<[f64; 2]>> for ParallaxShift {
    fn from(aside: Vec<[f64; 2]>) -> Self {
        Self { aside: aside.into_iter().map(Vector2::from).collect() }
    }
}

impl From<ParallaxShift> for Vec<[f64; 2]> {
    fn from(shift: ParallaxShift) -> Self {
        shift.aside.into_iter().map(<[f64; 2]>::from).collect()
    }
}

impl ParallaxShift {
    /// The pixel whose ray is drawn where `pixel` of the photograph over which `mesh` lies is shown.
    pub(crate) fn looked_through(&self, mesh: &GridMesh, pixel: Vector2<f64>) -> Vector2<f64> {
        let (corners, shares) = mesh.bilinear(pixel);
        (0..4).fold(pixel, |sum, k| sum + self.aside[corners[k]] * shares[k])
    }
}
