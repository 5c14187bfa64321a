//! The places of a pair's matches, as the search for a homography reads them.

use nalgebra::{Matrix3, Vector2};
use trueup_core::geometry::Homography;

/// Matched points, most distinctive first.
#[derive(Debug, Clone, Default)]
pub(super) struct MatchedPoints {
    /// In photograph a.
    pub(super) in_a: Vec<Vector2<f64>>,
    /// In photograph b.
    pub(super) in_b: Vec<Vector2<f64>>,
}

impl MatchedPoints {
    /// The matches of the given indices.
    pub(super) fn select(&self, indices: &[usize]) -> Self {
        Self {
            in_a: indices.iter().map(|&index| self.in_a[index]).collect(),
            in_b: indices.iter().map(|&index| self.in_b[index]).collect(),
        }
    }

    /// Indices of the matches within `inlier_px` of where a homography predicts them, forward, on the visible side.
    pub(super) fn agreeing(&self, b_from_a: &Homography, inlier_px: f64) -> Vec<usize> {
        let agrees = |&k: &usize| squared_error(&b_from_a.0, self.in_a[k], self.in_b[k]) <= inlier_px.powi(2);
        (0..self.in_a.len()).filter(agrees).collect()
    }
}

/// Squared forward transfer error; infinite behind the horizon.
pub(super) fn squared_error(h: &Matrix3<f64>, a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    let w = h[(2, 0)] * a.x + h[(2, 1)] * a.y + h[(2, 2)];
    let x = h[(0, 0)] * a.x + h[(0, 1)] * a.y + h[(0, 2)] - b.x * w;
    let y = h[(1, 0)] * a.x + h[(1, 1)] * a.y + h[(1, 2)] - b.y * w;
    if w > 0.0 { (x * x + y * y) / (w * w) } else { f64::INFINITY }
}
