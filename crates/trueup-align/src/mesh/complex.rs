//! Points of the plane as complex numbers: multiplication turns and scales.

use nalgebra::Vector2;

/// a b.
pub(super) fn product(a: Vector2<f64>, b: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

/// conj(a) b.
pub(super) fn conjugate_product(a: Vector2<f64>, b: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(a.x * b.x + a.y * b.y, a.x * b.y - a.y * b.x)
}
