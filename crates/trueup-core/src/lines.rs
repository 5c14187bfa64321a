//! Straight line segments found in a photograph.

use serde::{Deserialize, Serialize};

/// A straight segment in working pixels, directed so that the brighter side lies to its right when y points down
/// (the sense of the detector's gradient); most uses ignore the direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LineSegment {
    /// First end (x, y).
    pub start: [f64; 2],
    /// Second end (x, y).
    pub end: [f64; 2],
    /// Width of the supporting region in working pixels.
    pub width_px: f64,
    /// -log10 of the expected number of false alarms: larger is surer.
    pub significance: f64,
}

impl LineSegment {
    /// Length in working pixels.
    pub fn length(&self) -> f64 {
        (self.end[0] - self.start[0]).hypot(self.end[1] - self.start[1])
    }
}

/// An edge of a photograph that may be a straight line of the scene behind a lens that bends it: places along it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct EdgeCurve {
    /// Places in working pixels, from one end to the other; each is the mean of the edge points around it.
    pub places: Vec<[f64; 2]>,
}

/// Segments of two photographs that show the same edge.
#[derive(Debug, Clone, PartialEq)]
pub struct PairLines {
    /// Index of the first photograph.
    pub a: usize,
    /// Index of the second photograph.
    pub b: usize,
    /// The matched segments, in the working pixels of the first and of the second.
    pub lines: Vec<[LineSegment; 2]>,
}
