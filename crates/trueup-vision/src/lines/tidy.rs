//! What happens to the segments after detection: frame artifacts dropped, longest first, neighbors merged.

use trueup_core::lines::LineSegment;

/// A segment along a photograph's frame is dropped if more than [`BORDER_SHARE`] of its length lies within this
/// distance of one border, in pixels: an artifact of scans and of earlier warps.
const BORDER_DISTANCE_PX: f64 = 5.0;

/// See [`BORDER_DISTANCE_PX`].
const BORDER_SHARE: f64 = 0.8;

/// Largest angle between segments that are joined, in degrees.
const MERGE_ANGLE_DEG: f64 = 2.0;

/// Largest distance of the other's ends from the longer segment's line, in pixels.
const MERGE_DISTANCE_PX: f64 = 2.0;

/// Largest gap along the line between segments that are joined, in pixels.
const MERGE_GAP_PX: f64 = 20.0;

/// Drops segments along the borders of a photograph of the given size in pixels.
pub(super) fn drop_frame(segments: &mut Vec<LineSegment>, width: f64, height: f64) {
    segments.retain(|segment| !follows_border(segment, width, height));
}

/// Sorts by length, drops those shorter than `min_length_px`, and keeps at most `most`.
pub(super) fn longest_first(mut segments: Vec<LineSegment>, min_length_px: f64, most: usize) -> Vec<LineSegment> {
    sort(&mut segments);
    segments.retain(|segment| segment.length() >= min_length_px);
    segments.truncate(most);
    segments
}

/// Segments with neighbors on one line joined; longest first. The segments must be ordered so.
pub fn merged(segments: &[LineSegment]) -> Vec<LineSegment> {
    let mut joined = merge(segments);
    sort(&mut joined);
    joined
}

/// Longest first; equal lengths by position, so that the order is total.
fn sort(segments: &mut [LineSegment]) {
    let key = |segment: &LineSegment| [segment.start[1], segment.start[0], segment.end[1], segment.end[0]];
    // Each length once, not at each comparison.
    let mut measured: Vec<(f64, LineSegment)> = segments.iter().map(|segment| (segment.length(), *segment)).collect();
    measured.sort_by(|(a_length, a), (b_length, b)| {
        b_length.total_cmp(a_length).then_with(|| {
            let pairs = key(a).into_iter().zip(key(b));
            pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        })
    });
    segments.iter_mut().zip(measured).for_each(|(segment, (_, sorted))| *segment = sorted);
}

/// Whether more than [`BORDER_SHARE`] of the segment lies within [`BORDER_DISTANCE_PX`] of one border.
fn follows_border(segment: &LineSegment, width: f64, height: f64) -> bool {
    let ends = [segment.start, segment.end];
    let sides = [
        ends.map(|end| end[0]),
        ends.map(|end| width - end[0]),
        ends.map(|end| end[1]),
        ends.map(|end| height - end[1]),
    ];
    sides.iter().any(|&[a, b]| share_below(a, b, BORDER_DISTANCE_PX) > BORDER_SHARE)
}

/// The share of a segment whose distance runs from `a` to `b` that is closer than `limit`.
fn share_below(a: f64, b: f64, limit: f64) -> f64 {
    let (near, far) = (a.min(b), a.max(b));
    if far <= limit {
        1.0
    } else if near >= limit {
        0.0
    } else {
        (limit - near) / (far - near)
    }
}

/// Joins each segment, longest first, with the shorter ones that continue it, until none does.
fn merge(segments: &[LineSegment]) -> Vec<LineSegment> {
    let mut taken = vec![false; segments.len()];
    let mut merged = Vec::with_capacity(segments.len());
    for first in 0..segments.len() {
        if taken[first] {
            continue;
        }
        taken[first] = true;
        let mut whole = segments[first];
        let mut grown = true;
        while grown {
            grown = false;
            for (other, taken) in segments.iter().zip(&mut taken).skip(first + 1) {
                if !*taken && let Some(joined) = join(&whole, other) {
                    (whole, *taken, grown) = (joined, true, true);
                }
            }
        }
        merged.push(whole);
    }
    merged
}

/// The segment over both, if `shorter` continues `longer` in the same sense.
///
/// Its line passes through the lengths' common center of mass along their principal axis.
fn join(longer: &LineSegment, shorter: &LineSegment) -> Option<LineSegment> {
    let (long, short) = (DirectedSegment::of(longer)?, DirectedSegment::of(shorter)?);
    let (direction, other) = (long.direction, short.direction);
    let sine = MERGE_ANGLE_DEG.to_radians().sin();
    let dot = direction[0] * other[0] + direction[1] * other[1];
    let cross = direction[0] * other[1] - direction[1] * other[0];
    if dot <= 0.0 || cross.abs() > sine {
        return None;
    }
    let place = |point: [f64; 2]| {
        let [dx, dy] = [point[0] - longer.start[0], point[1] - longer.start[1]];
        (dx * direction[0] + dy * direction[1], dy * direction[0] - dx * direction[1])
    };
    let ((start, start_off), (end, end_off)) = (place(shorter.start), place(shorter.end));
    let gap = (start - long.length).max(-end);
    if start_off.abs().max(end_off.abs()) > MERGE_DISTANCE_PX || gap > MERGE_GAP_PX {
        return None;
    }
    let (axis, center) = common_axis(&[long, short]);
    let along = |point: [f64; 2]| (point[0] - center[0]) * axis[0] + (point[1] - center[1]) * axis[1];
    let low = along(longer.start).min(along(shorter.start));
    let high = along(longer.end).max(along(shorter.end));
    let at = |along: f64| [center[0] + along * axis[0], center[1] + along * axis[1]];
    Some(LineSegment {
        start: at(low),
        end: at(high),
        width_px: longer.width_px.max(shorter.width_px),
        significance: longer.significance.max(shorter.significance),
    })
}

/// A segment of some length as a uniform body.
struct DirectedSegment {
    middle: [f64; 2],
    /// Unit vector from start to end.
    direction: [f64; 2],
    length: f64,
}

impl DirectedSegment {
    /// `None` if the segment has no length.
    fn of(segment: &LineSegment) -> Option<Self> {
        let LineSegment { start, end, .. } = segment;
        let length = segment.length();
        let direction = [(end[0] - start[0]) / length, (end[1] - start[1]) / length];
        let middle = [0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])];
        (length > 0.0).then_some(Self { middle, direction, length })
    }
}

/// Principal axis and center of mass of two segments, the axis in the sense of the first.
fn common_axis(segments: &[DirectedSegment; 2]) -> ([f64; 2], [f64; 2]) {
    let [first, second] = segments;
    let total = first.length + second.length;
    let center = [0, 1].map(|axis| (first.middle[axis] * first.length + second.middle[axis] * second.length) / total);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for DirectedSegment { middle, direction, length } in segments {
        let [dx, dy] = [middle[0] - center[0], middle[1] - center[1]];
        // A segment's own second moment along itself is length^3 / 12.
        let own = length.powi(3) / 12.0;
        xx += length * dx * dx + own * direction[0] * direction[0];
        xy += length * dx * dy + own * direction[0] * direction[1];
        yy += length * dy * dy + own * direction[1] * direction[1];
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let axis = [angle.cos(), angle.sin()];
    let along = first.direction[0] * axis[0] + first.direction[1] * axis[1];
    (if along < 0.0 { axis.map(|component| -component) } else { axis }, center)
}
