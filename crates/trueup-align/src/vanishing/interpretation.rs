//! The interpretation planes of a picture's segments.

use nalgebra::{Vector2, Vector3};
use trueup_core::lines::LineSegment;
use trueup_core::source::WorkingFrame;

use super::VanishingOptions;

/// Usable segments of one picture, longest first, as planes through the camera's center.
#[derive(Debug, Clone)]
pub(crate) struct InterpretationPlanes {
    /// Unit normals in the camera frame.
    pub normals: Vec<Vector3<f64>>,
    /// P x Q of the segment's ends P, Q = (x, y, f), x and y from the principal point: the normal's direction, of
    /// magnitude area.
    pub moments: Vec<Vector3<f64>>,
    /// Midpoints from the principal point, in working pixels.
    pub midpoints: Vec<Vector2<f64>>,
    /// Lengths in working pixels.
    pub lengths: Vec<f64>,
    /// Weights: the length, capped.
    pub weights: Vec<f64>,
    /// Index of each among the segments given.
    pub indices: Vec<usize>,
    /// Sum of `weights`.
    pub total_weight: f64,
}

impl InterpretationPlanes {
    /// Keeps the segments that are finite, long enough and no artifact of the picture's border, the longest first.
    ///
    /// Empty if the focal length or the frame is not a positive number.
    pub fn new(lines: &[LineSegment], focal_px: f64, frame: &WorkingFrame, options: &VanishingOptions) -> Self {
        let usable = focal_px.is_finite() && focal_px > 0.0 && frame.diagonal().is_finite();
        let min_length = options.min_length_px.max(options.min_length_diagonal * frame.diagonal());
        let mut kept: Vec<(usize, f64)> = lines
            .iter()
            .enumerate()
            .map(|(index, line)| (index, line.length()))
            // A comparison with NaN is false: segments that are not finite are dropped here too.
            .filter(|&(index, length)| {
                usable && length >= min_length && length.is_finite() && !on_border(&lines[index], frame, options)
            })
            .collect();
        // Ties are broken by the position in the input, so that the order is the same everywhere.
        kept.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        kept.truncate(options.max_lines);
        let mut planes = Self::with_capacity(kept.len());
        let center = Vector2::new(frame.width / 2.0, frame.height / 2.0);
        for (index, length) in kept {
            planes.push(index, &lines[index], length, center, focal_px, options.weight_cap_px);
        }
        planes
    }

    fn with_capacity(count: usize) -> Self {
        Self {
            normals: Vec::with_capacity(count),
            moments: Vec::with_capacity(count),
            midpoints: Vec::with_capacity(count),
            lengths: Vec::with_capacity(count),
            weights: Vec::with_capacity(count),
            indices: Vec::with_capacity(count),
            total_weight: 0.0,
        }
    }

    fn push(&mut self, index: usize, line: &LineSegment, length: f64, center: Vector2<f64>, focal_px: f64, cap: f64) {
        let (start, end) = (Vector2::from(line.start) - center, Vector2::from(line.end) - center);
        let moment = start.push(focal_px).cross(&end.push(focal_px));
        let norm = moment.norm();
        if !(norm > 0.0 && norm.is_finite()) {
            return;
        }
        let weight = length.min(cap);
        self.normals.push(moment / norm);
        self.moments.push(moment);
        self.midpoints.push((start + end) / 2.0);
        self.lengths.push(length);
        self.weights.push(weight);
        self.indices.push(index);
        self.total_weight += weight;
    }

    /// Number of usable segments.
    pub fn len(&self) -> usize {
        self.normals.len()
    }
}

/// Whether both ends lie within the margin of one and the same side of the picture.
fn on_border(line: &LineSegment, frame: &WorkingFrame, options: &VanishingOptions) -> bool {
    let margin = options.border_margin_px;
    let ends = [line.start, line.end];
    [(0, frame.width), (1, frame.height)].into_iter().any(|(axis, extent)| {
        ends.iter().all(|end| end[axis] < margin) || ends.iter().all(|end| end[axis] > extent - margin)
    })
}
