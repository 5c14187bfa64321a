//! Squares of a photograph, by which the room that features take up is measured, and what in them stands still.

use std::collections::BTreeSet;

use crate::features::FeaturePoint;

/// Side of a square, working pixels.
pub(crate) const SQUARE_PX: f64 = 40.0;

/// Farthest that a place of something fixed to the camera, or written on photographs, is from where it is in another
/// one, working pixels: what shines through moves its corners.
pub(crate) const STILL_PX: f64 = 1.5;

/// A square: its column and its row.
pub(crate) type Square = [i64; 2];

/// The square in which a place is.
pub(crate) fn square(position: [f64; 2]) -> Square {
    position.map(|along| (along / SQUARE_PX).floor() as i64)
}

/// The squares in which these features are.
pub(crate) fn featured(points: &[FeaturePoint]) -> BTreeSet<Square> {
    points.iter().map(|point| square(point.position)).collect()
}
