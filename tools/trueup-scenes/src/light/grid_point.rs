//! A grid point of a face in the world.

use nalgebra::Vector3;

/// One grid point in the world.
#[derive(Debug, Clone, Copy)]
pub(super) struct GridPoint {
    pub(super) point: Vector3<f64>,
    pub(super) normal: Vector3<f64>,
    pub(super) buried: bool,
    /// Which of the patterns of directions it deserves, 0 the densest: what is far off or turned away matters less.
    pub(super) pattern: usize,
}

/// The pattern a place deserves: nobody sees what is turned away, nor much of what is far off.
pub(super) fn importance(point: Vector3<f64>, normal: Vector3<f64>, eye: Vector3<f64>) -> usize {
    /// The camera wanders about the eye by this much at most, metres.
    const WANDER_M: f64 = 1.0;
    const FAR_M: f64 = 22.0;
    let to_eye = eye - point;
    if normal.dot(&to_eye) < -WANDER_M { 2 } else { usize::from(to_eye.norm() > FAR_M) }
}
