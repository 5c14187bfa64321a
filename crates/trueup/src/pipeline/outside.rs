//! What was measured of a photograph outside its parts that are not looked at.

use trueup_core::lines::{EdgeCurve, LineSegment};
use trueup_core::mask::Mask;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;
use trueup_vision::features::Features;

/// The features of a photograph outside its ignored parts.
pub(super) fn features_outside(features: &Features, ignored: &Mask, frame: &WorkingFrame) -> Features {
    features.filtered(|point| !ignored.contains(point.position.map(|length| length / frame.working_from_full)))
}

/// The segments of which most lies outside the ignored parts.
pub(super) fn lines_outside(lines: Vec<LineSegment>, ignored: &Mask, frame: &WorkingFrame) -> Vec<LineSegment> {
    /// Points along a segment that are looked at.
    const POINTS: usize = 9;
    let is_ignored = |line: &LineSegment, point: usize| {
        let share = point as f64 / (POINTS - 1) as f64;
        let along = |axis: usize| line.start[axis] + share * (line.end[axis] - line.start[axis]);
        ignored.contains([along(0), along(1)].map(|length| length / frame.working_from_full))
    };
    let mostly_outside = |line: &LineSegment| 2 * (0..POINTS).filter(|&point| is_ignored(line, point)).count() < POINTS;
    lines.into_iter().filter(mostly_outside).collect()
}

/// The curves none of whose places are ignored.
pub(super) fn curves_outside(curves: Vec<EdgeCurve>, ignored: &Mask, frame: &WorkingFrame) -> Vec<EdgeCurve> {
    let is_ignored = |place: &[f64; 2]| ignored.contains(place.map(|length| length / frame.working_from_full));
    curves.into_iter().filter(|curve| !curve.places.iter().any(is_ignored)).collect()
}

/// Blackens the ignored parts of a thumbnail: what is too dark to tell brightness takes no part in evening it out.
pub(super) fn blacken(thumbnail: &mut Raster<u8>, ignored: &Mask, frame: &WorkingFrame) {
    let size = [1.0 / frame.working_from_full; 2];
    for y in 0..thumbnail.height() {
        for x in 0..thumbnail.width() {
            let place = [x, y].map(|pixel| (pixel as f64 + 0.5) / frame.working_from_full);
            if ignored.any_within(place, size) {
                thumbnail.pixel_mut(x, y).fill(0);
            }
        }
    }
}
