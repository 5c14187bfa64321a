//! Rays.

use nalgebra::Vector3;

/// Distance by which rays start off a surface, metres.
pub(crate) const SURFACE_OFFSET_M: f64 = 1e-4;

/// A ray with what the slab test wants precomputed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    pub(crate) origin: Vector3<f64>,
    pub(crate) direction: Vector3<f64>,
    pub(super) inverse: Vector3<f64>,
    /// Where in a node's bounds the ray enters along each axis; it leaves by the other side.
    pub(super) entering: [usize; 3],
}

impl Ray {
    pub(crate) fn new(origin: Vector3<f64>, direction: Vector3<f64>) -> Self {
        // A component of exactly 0 would make 0 * infinity; a tiny one keeps the slab test sound.
        let inverse = direction.map(|component| if component == 0.0 { 1e300 } else { 1.0 / component });
        let entering = std::array::from_fn(|axis| if inverse[axis] < 0.0 { axis + 3 } else { axis });
        Self { origin, direction, inverse, entering }
    }
}
