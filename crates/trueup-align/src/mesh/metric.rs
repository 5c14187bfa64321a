//! How residuals of the plane are weighed.

use nalgebra::Vector2;

/// A symmetric 2 x 2 matrix [[xx, xy], [xy, yy]] that weighs a residual of the plane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Metric {
    /// Weight of the square of x.
    pub xx: f64,
    /// Weight of the product of x and y.
    pub xy: f64,
    /// Weight of the square of y.
    pub yy: f64,
}

impl Metric {
    /// All directions alike.
    pub(super) fn isotropic(weight: f64) -> Self {
        Self { xx: weight, xy: 0.0, yy: weight }
    }

    /// Only what goes along `direction`: weight (direction . residual)^2.
    pub(super) fn along(direction: Vector2<f64>, weight: f64) -> Self {
        Self {
            xx: weight * direction.x * direction.x,
            xy: weight * direction.x * direction.y,
            yy: weight * direction.y * direction.y,
        }
    }

    /// The matrix times a vector.
    pub(super) fn apply(&self, value: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.xx * value.x + self.xy * value.y, self.xy * value.x + self.yy * value.y)
    }

    /// The rows of the matrix, times `factor`.
    pub(super) fn block(&self, factor: f64) -> [f64; 4] {
        [factor * self.xx, factor * self.xy, factor * self.xy, factor * self.yy]
    }
}
