//! Line segments of two photographs that show the same edge.
//!
//! A transfer between the photographs says where a segment should be; what lies along both sides of it, which of
//! several parallel ones it is.
//!
//! # Source
//! The guided line matching of dual-feature warping (Li and others, ICCV 2015), reconstructed.
//!
//! # Departures
//! The description of a segment is the mean gray values of bands beside it, in a few sections along the part that both
//! photographs show; alike means a high normalized correlation.

mod strip;

use nalgebra::Vector2;
use trueup_core::lines::LineSegment;
use trueup_core::raster::Raster;

use strip::{Stretch, likeness};

/// Shorter segments are not matched, in working pixels.
const MIN_LENGTH_PX: f64 = 25.0;

/// Largest angle between a segment and where the other is carried, in degrees.
const MAX_ANGLE_DEG: f64 = 5.0;

/// Largest distance of a carried segment's ends from the other's line, in working pixels.
const MAX_DISTANCE_PX: f64 = 5.0;

/// Share of the shorter segment, along the line, that the two must have in common.
const MIN_OVERLAP: f64 = 0.5;

/// Least likeness (normalized correlation) of what lies beside two segments.
const MIN_LIKENESS: f64 = 0.7;

/// Largest ratio of the best match's unlikeness to the second best's.
const MAX_RATIO: f64 = 0.8;

/// A segment of the first photograph and one of the second, by their indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineMatch {
    /// In the first photograph.
    pub in_a: usize,
    /// In the second photograph.
    pub in_b: usize,
}

/// A photograph of a pair, at its working size: gray values 0 to 255 in one channel, and its segments.
#[derive(Debug, Clone, Copy)]
pub struct PhotographWithLines<'a> {
    /// Gray values.
    pub gray: &'a Raster<u8>,
    /// Segments in its pixels.
    pub lines: &'a [LineSegment],
}

/// How far the likeness of the same edge varies by noise: edges that are both this alike cannot be told apart.
const UNSURE: f64 = 0.05;

/// Two segments that could be the same edge.
struct Candidate {
    in_a: usize,
    in_b: usize,
    likeness: f64,
}

/// Pairs of segments that show the same edge, each segment at most once, in the order of the first photograph's.
///
/// `b_from_a` carries a pixel of the first photograph to the second, `None` outside the overlap.
pub fn find(
    a: PhotographWithLines,
    b: PhotographWithLines,
    b_from_a: impl Fn(Vector2<f64>) -> Option<Vector2<f64>>,
) -> Vec<LineMatch> {
    let candidates = candidates(a, b, b_from_a);
    let is_best = |one: &Candidate, rivals: &dyn Fn(&Candidate) -> bool, lines: [&LineSegment; 2]| {
        // Another piece of the same edge is no rival.
        let [own_a, own_b] = lines;
        candidates.iter().filter(|other| rivals(other)).all(|other| {
            let same = (other.in_a, other.in_b) == (one.in_a, one.in_b)
                || (continues(own_a, &a.lines[other.in_a]) && continues(own_b, &b.lines[other.in_b]));
            if same {
                return other.likeness <= one.likeness;
            }
            UNSURE + 1.0 - one.likeness <= MAX_RATIO * (UNSURE + 1.0 - other.likeness)
        })
    };
    candidates
        .iter()
        .filter(|one| {
            let lines = [&a.lines[one.in_a], &b.lines[one.in_b]];
            is_best(one, &|other| other.in_a == one.in_a, lines) && is_best(one, &|other| other.in_b == one.in_b, lines)
        })
        .map(|one| LineMatch { in_a: one.in_a, in_b: one.in_b })
        .collect()
}

fn candidates(
    a: PhotographWithLines,
    b: PhotographWithLines,
    b_from_a: impl Fn(Vector2<f64>) -> Option<Vector2<f64>>,
) -> Vec<Candidate> {
    let long_enough = |line: &&LineSegment| line.length() >= MIN_LENGTH_PX;
    let lines_b: Vec<(usize, Directed)> = b
        .lines
        .iter()
        .enumerate()
        .filter(|(_, line)| long_enough(line))
        .map(|(k, line)| (k, Directed::of(line)))
        .collect();
    let mut found = Vec::new();
    for (in_a, line_a) in a.lines.iter().enumerate().filter(|(_, line)| long_enough(line)) {
        let Some(carried) = Carried::of(line_a, &b_from_a) else { continue };
        for &(in_b, ref line_b) in &lines_b {
            let Some(stretch) = carried.common(line_b) else { continue };
            let Some(likeness) = likeness(a.gray, b.gray, &stretch) else { continue };
            if likeness >= MIN_LIKENESS {
                found.push(Candidate { in_a, in_b, likeness });
            }
        }
    }
    found
}

/// Whether two segments lie on one line.
fn continues(one: &LineSegment, other: &LineSegment) -> bool {
    /// Largest distance of the other's ends from the line.
    const BESIDE_PX: f64 = 2.0;
    let (start, along) = (Vector2::from(one.start), (Vector2::from(one.end) - Vector2::from(one.start)).normalize());
    [other.start, other.end].iter().all(|&end| along.perp(&(Vector2::from(end) - start)).abs() <= BESIDE_PX)
}

/// A segment as it is asked for again and again.
struct Directed {
    start: Vector2<f64>,
    /// Unit length.
    along: Vector2<f64>,
    length: f64,
}

impl Directed {
    fn of(line: &LineSegment) -> Self {
        let [start, end] = [line.start, line.end].map(Vector2::from);
        let length = line.length();
        Self { start, along: (end - start) / length, length }
    }
}

/// The part of a segment that lies in the overlap, in both photographs.
struct Carried {
    here: [Vector2<f64>; 2],
    there: [Vector2<f64>; 2],
}

impl Carried {
    /// `None` if less than [`MIN_LENGTH_PX`] of the segment is carried over.
    fn of(line: &LineSegment, b_from_a: &impl Fn(Vector2<f64>) -> Option<Vector2<f64>>) -> Option<Self> {
        /// Distance of the points that are carried.
        const STEP_PX: f64 = 5.0;
        let (start, end) = (Vector2::from(line.start), Vector2::from(line.end));
        let steps = (line.length() / STEP_PX).ceil().max(1.0) as usize;
        let points = (0..=steps).map(|k| start.lerp(&end, k as f64 / steps as f64));
        let carried: Vec<(Vector2<f64>, Vector2<f64>)> =
            points.filter_map(|point| Some((point, b_from_a(point)?))).collect();
        let (first, last) = (carried.first()?, carried.last()?);
        let long_enough =
            (last.0 - first.0).norm() >= MIN_LENGTH_PX && (last.1 - first.1).norm() >= MIN_LENGTH_PX / 2.0;
        long_enough.then_some(Self { here: [first.0, last.0], there: [first.1, last.1] })
    }

    /// What the segment has in common with one of the other photograph; `None` if the two cannot be the same edge.
    fn common(&self, line: &Directed) -> Option<Stretch> {
        let &Directed { start, along, length } = line;
        let [from, to] = self.there;
        let (sine, cosine) = ((to - from).perp(&along), (to - from).dot(&along));
        // Segments know their brighter side: the same edge has the same sense.
        if cosine <= 0.0 || sine.abs() > cosine * MAX_ANGLE_DEG.to_radians().tan() {
            return None;
        }
        if self.there.iter().any(|point| along.perp(&(point - start)).abs() > MAX_DISTANCE_PX) {
            return None;
        }
        let [low, high] = self.there.map(|point| along.dot(&(point - start)));
        let (first, last) = (low.max(0.0), high.min(length));
        if last - first < MIN_OVERLAP * (high - low).min(length) {
            return None;
        }
        let here = |at: f64| self.here[0].lerp(&self.here[1], (at - low) / (high - low));
        Some(Stretch { a: [here(first), here(last)], b: [start + along * first, start + along * last] })
    }
}

#[cfg(test)]
mod tests;
