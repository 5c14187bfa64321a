//! What happens to the segments after detection: frame artifacts dropped, neighbors merged, longest first.

use trueup_core::lines::LineSegment;

use super::LineOptions;

/// Drops segments along the borders and short ones, merges if asked to, sorts by length and keeps the longest.
pub(super) fn tidy(mut segments: Vec<LineSegment>, width: f64, height: f64, options: &LineOptions) -> Vec<LineSegment> {
    segments.retain(|segment| !follows_border(segment, width, height, options));
    sort(&mut segments);
    if options.merge {
        segments = merged(&segments, options);
    }
    segments.retain(|segment| segment.length() >= options.min_length_px);
    segments.truncate(options.max_segments);
    segments
}

/// Segments with neighbors on one line joined within the `merge_` options, whatever [`LineOptions::merge`] says; longest
/// first. The segments must be ordered so.
pub fn merged(segments: &[LineSegment], options: &LineOptions) -> Vec<LineSegment> {
    let mut joined = merge(segments, options);
    sort(&mut joined);
    joined
}

/// Longest first; equal lengths by position, so that the order is total.
fn sort(segments: &mut [LineSegment]) {
    let key = |segment: &LineSegment| [segment.start[1], segment.start[0], segment.end[1], segment.end[0]];
    segments.sort_by(|a, b| {
        b.length().total_cmp(&a.length()).then_with(|| {
            let pairs = key(a).into_iter().zip(key(b));
            pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        })
    });
}

/// Whether more than `border_share` of the segment lies within `border_distance_px` of one border.
fn follows_border(segment: &LineSegment, width: f64, height: f64, options: &LineOptions) -> bool {
    let distance = options.border_distance_px;
    let ends = [segment.start, segment.end];
    let sides = [
        ends.map(|end| end[0]),
        ends.map(|end| width - end[0]),
        ends.map(|end| end[1]),
        ends.map(|end| height - end[1]),
    ];
    distance > 0.0 && sides.iter().any(|&[a, b]| share_below(a, b, distance) > options.border_share)
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
fn merge(segments: &[LineSegment], options: &LineOptions) -> Vec<LineSegment> {
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
                if !*taken && let Some(joined) = join(&whole, other, options) {
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
fn join(longer: &LineSegment, shorter: &LineSegment, options: &LineOptions) -> Option<LineSegment> {
    let (direction, length) = unit(longer)?;
    let (other, other_length) = unit(shorter)?;
    let sine = options.merge_angle_deg.to_radians().sin();
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
    let gap = (start - length).max(-end);
    if start_off.abs().max(end_off.abs()) > options.merge_distance_px || gap > options.merge_gap_px {
        return None;
    }
    let (axis, center) = common_axis([(longer, direction, length), (shorter, other, other_length)]);
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

fn unit(segment: &LineSegment) -> Option<([f64; 2], f64)> {
    let length = segment.length();
    let direction = [(segment.end[0] - segment.start[0]) / length, (segment.end[1] - segment.start[1]) / length];
    (length > 0.0).then_some((direction, length))
}

/// Principal axis and center of mass of two uniform rods, the axis in the sense of the first.
fn common_axis(rods: [(&LineSegment, [f64; 2], f64); 2]) -> ([f64; 2], [f64; 2]) {
    let middles = rods.map(|(rod, ..)| [0.5 * (rod.start[0] + rod.end[0]), 0.5 * (rod.start[1] + rod.end[1])]);
    let total = rods[0].2 + rods[1].2;
    let center = [0, 1].map(|axis| (middles[0][axis] * rods[0].2 + middles[1][axis] * rods[1].2) / total);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for ((_, direction, length), middle) in rods.iter().zip(middles) {
        let [dx, dy] = [middle[0] - center[0], middle[1] - center[1]];
        // A rod's own second moment along itself is length^3 / 12.
        let own = length.powi(3) / 12.0;
        xx += length * dx * dx + own * direction[0] * direction[0];
        xy += length * dx * dy + own * direction[0] * direction[1];
        yy += length * dy * dy + own * direction[1] * direction[1];
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let axis = [angle.cos(), angle.sin()];
    let along = rods[0].1[0] * axis[0] + rods[0].1[1] * axis[1];
    (if along < 0.0 { axis.map(|component| -component) } else { axis }, center)
}
