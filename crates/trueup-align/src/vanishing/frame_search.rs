//! The frame that the segments of all photographs vote for together, and whether the vote could be chance.
//!
//! A photograph with a handful of segments has no triad of its own, or a wrong one; seen through the cameras, the
//! segments of all photographs are one set on one sphere. Every level or tilted frame near the cameras' own vertical is
//! scored on them. Where the scene has dominant directions, one frame stands out from all the others; where it has
//! none, the best is a little better than the rest.

use std::f64::consts::{FRAC_PI_2, TAU as FULL_TURN};

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use trueup_core::geometry::orthonormal_complement;

use super::joint::{AxisWeights, LineVote};

/// How far from the cameras' own vertical the segments' is sought, degrees.
pub(crate) const SEARCH_DEG: f64 = 25.0;

/// Turns about a vertical that are scored: steps of 1.5 degrees over the quarter turn after which a frame repeats.
const TURNS: usize = 60;

/// Largest error of a turn that is only to tell which frames to score, radians.
const TURN_ERROR: f64 = 2e-5;

/// Segments that are scored, shared out evenly among the photographs, the longest first.
const MAX_SEGMENTS: usize = 1200;
/// Fewer segments in all photographs together are no evidence.
const MIN_SEGMENTS: usize = 10;
/// Largest angle between a segment and a direction for the segment to support it, degrees.
const TOLERANCE_DEG: f64 = 1.5;
/// Step of the vertical, degrees.
const STEP_DEG: f64 = 2.0;
/// How far a frame must stand out to guide where the photographs do not agree, standard deviations. Measured: chosen on
/// the 130 sets of the gate's experiment and on real sets.
pub(crate) const GUIDING_SIGNIFICANCE: f64 = 7.0;

/// Verticals whose best frames are refined: within the search's step and tolerance, few segments fit as well elsewhere
/// as at the best. Measured: on cut sets of a room with one blank wall the first alone ended beside the best one once
/// in nine, the first four never.
const REFINED: usize = 8;

/// The best frames, and how far the first stands out.
#[derive(Debug, Clone)]
pub(crate) struct PooledFrames {
    /// The best frame of each of the best verticals tried, the best first. Columns are the directions in the common
    /// frame, the vertical first; rotations.
    starts: Vec<Matrix3<f64>>,
    /// Score of the first.
    best: f64,
    /// Score of the first above the mean over all frames tried, in standard deviations of these.
    pub significance: f64,
}

impl PooledFrames {
    /// Whether the first scores more than another frame by the same segments. What was found by steps rarely outscores
    /// a frame that is right.
    pub(crate) fn outscores(&self, other: &Matrix3<f64>, vote: &LineVote) -> bool {
        let tolerance = TOLERANCE_DEG.to_radians().sin();
        let score = |(normal, weight): &(Vector3<f64>, f64)| weight * fit(other.tr_mul(normal).abs().min(), tolerance);
        self.best > vote.longest(MAX_SEGMENTS).iter().map(score).sum()
    }

    /// The frame that fits best of those that all segments refine, those of all three directions alike: what made a
    /// frame stand out is what it is known by. `None` without any.
    pub(crate) fn refined(&self, vote: &LineVote) -> Option<Matrix3<f64>> {
        let refine = |start: &Matrix3<f64>| {
            let frame = vote.refine_frame(start, AxisWeights::alike(0));
            (frame, vote.fit(&frame))
        };
        let refined: Vec<(Matrix3<f64>, f64)> = self.starts.par_iter().map(refine).collect();
        // Of equals the one that scored better.
        let best = refined.into_iter().reduce(|best, one| if one.1 > best.1 { one } else { best });
        best.map(|(frame, _)| frame)
    }
}

/// Sums over the turns about one vertical.
struct Ring {
    sum: f64,
    squares: f64,
    best: f64,
    turn: usize,
}

/// Scores all frames whose vertical is within [`SEARCH_DEG`] of `expected`.
///
/// The score of a frame is the sum over segments of weight times (1 - (sine / sine of the tolerance)^2) for the frame's
/// direction that fits best. `None` with fewer than [`MIN_SEGMENTS`] segments.
pub(crate) fn search_frames(vote: &LineVote, expected: &Vector3<f64>) -> Option<PooledFrames> {
    let segments = vote.longest(MAX_SEGMENTS);
    if segments.len() < MIN_SEGMENTS {
        return None;
    }
    let tolerance = TOLERANCE_DEG.to_radians().sin();
    let step = STEP_DEG.to_radians();
    let verticals = cone(expected, SEARCH_DEG.to_radians(), step);
    let turns: [(f64, f64); TURNS] = std::array::from_fn(|index| turn_of(index).sin_cos());
    let rings: Vec<Ring> = verticals.par_iter().map(|vertical| ring(vertical, &turns, &segments, tolerance)).collect();
    let count = (rings.len() * TURNS) as f64;
    let mean = rings.iter().map(|ring| ring.sum).sum::<f64>() / count;
    let variance = rings.iter().map(|ring| ring.squares).sum::<f64>() / count - mean * mean;
    let mut order: Vec<usize> = (0..rings.len()).collect();
    order.sort_by(|&one, &other| rings[other].best.total_cmp(&rings[one].best));
    order.truncate(REFINED);
    let best = rings[*order.first()?].best;
    let significance = (best - mean) / variance.sqrt();
    let frame = |&index: &usize| {
        let vertical = verticals[index];
        let (first, second) = orthonormal_complement(&vertical);
        let (sine, cosine) = turn_of(rings[index].turn).sin_cos();
        let horizontal = first * cosine + second * sine;
        Matrix3::from_columns(&[vertical, horizontal, vertical.cross(&horizontal)])
    };
    significance.is_finite().then(|| PooledFrames { starts: order.iter().map(frame).collect(), best, significance })
}

fn turn_of(index: usize) -> f64 {
    (index as f64 + 0.5) * FRAC_PI_2 / TURNS as f64
}

/// So many segments are looked at before the turns that they reach are scored: the arithmetic of several then goes on
/// at the same time, where it would wait for the turns of each.
const TOGETHER: usize = 8;

/// Scores the frames of one vertical; `turns` are the sines and cosines of theirs. Each segment reaches only the few
/// turns that it fits.
fn ring(
    vertical: &Vector3<f64>,
    turns: &[(f64, f64); TURNS],
    segments: &[(Vector3<f64>, f64)],
    tolerance: f64,
) -> Ring {
    let (first, second) = orthonormal_complement(vertical);
    let places = TURNS as f64 / FRAC_PI_2;
    let mut scores = [0.0; TURNS];
    let mut common = 0.0;
    for segments in segments.chunks(TOGETHER) {
        let mut seen = [Seen::default(); TOGETHER];
        for (seen, (normal, _)) in seen.iter_mut().zip(segments) {
            *seen = Seen::of(normal, [vertical, &first, &second], tolerance);
        }
        for (Seen { upright, along, across, turn, half }, (_, weight)) in seen.iter().zip(segments) {
            common += weight * upright;
            // Beyond a quarter turn the same ones come again: counted from a full one below, none is negative, and
            // casts round downward.
            let from = ((turn - half + FULL_TURN) * places + 0.5) as usize;
            let to = ((turn + half + FULL_TURN) * places + 0.5) as usize;
            let mut place = from % TURNS;
            for _ in 0..(to - from).min(TURNS) {
                let (sine, cosine) = turns[place];
                let nearest = (along * cosine + across * sine).abs().min((across * cosine - along * sine).abs());
                let level = fit(nearest, tolerance);
                if level > *upright {
                    scores[place] += weight * (level - upright);
                }
                place = if place + 1 == TURNS { 0 } else { place + 1 };
            }
        }
    }
    let mut ring = Ring { sum: 0.0, squares: 0.0, best: f64::NEG_INFINITY, turn: 0 };
    for (turn, score) in scores.iter().map(|score| score + common).enumerate() {
        ring.sum += score;
        ring.squares += score * score;
        if score > ring.best {
            (ring.best, ring.turn) = (score, turn);
        }
    }
    ring
}

/// A segment as the frames of one vertical see it.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    /// How well it fits the vertical.
    upright: f64,
    /// Parts of its normal along the horizontal axes.
    along: f64,
    across: f64,
    /// The turn that it fits best, but for quarters.
    turn: f64,
    /// How far from that it fits at all.
    half: f64,
}

impl Seen {
    /// By its normal; the axes are the vertical and two horizontal ones.
    #[inline]
    fn of(normal: &Vector3<f64>, [vertical, first, second]: [&Vector3<f64>; 3], tolerance: f64) -> Self {
        let (along, across) = (normal.dot(first), normal.dot(second));
        Self {
            upright: fit(normal.dot(vertical), tolerance),
            along,
            across,
            turn: quarter_turn(along, across),
            half: reached(tolerance.powi(2) / (along * along + across * across)),
        }
    }
}

/// How well a segment fits a direction, by the sine of the angle between them and that of the tolerance: 1 to 0.
fn fit(sine: f64, tolerance: f64) -> f64 {
    (1.0 - (sine / tolerance).powi(2)).max(0.0)
}

/// The turn, but for quarters, of the horizontal directions that are orthogonal to a normal, or nearest to that, by its
/// parts along the horizontal axes; to within [`TURN_ERROR`]: an arc tangent by Hastings, "Approximations for Digital
/// Computers" (1955), sheet 11.
fn quarter_turn(along: f64, across: f64) -> f64 {
    let tangent = if along.abs() > across.abs() { across / along } else { -along / across };
    // Of a normal along the vertical any.
    let tangent = if tangent.is_nan() { 0.0 } else { tangent };
    let square = tangent * tangent;
    tangent
        * (0.999_866 + square * (-0.330_299_5 + square * (0.180_141 + square * (-0.085_133 + square * 0.020_835_1))))
}

/// A little more than the angle whose sine squared is `square`, or a quarter turn.
fn reached(square: f64) -> f64 {
    // (asin x - x) / x^3 grows up to x = 1.
    let farther = |sine: f64| sine + (FRAC_PI_2 - 1.0) * sine.powi(3);
    farther(square.min(1.0).sqrt()) + TURN_ERROR
}

/// Directions within `radius` of `axis`, on rings `step` apart (radians).
pub(crate) fn cone(axis: &Vector3<f64>, radius: f64, step: f64) -> Vec<Vector3<f64>> {
    let (first, second) = orthonormal_complement(axis);
    let frame = Matrix3::from_columns(&[first, second, *axis]);
    let mut directions = vec![*axis];
    let rings = (radius / step).floor() as usize;
    for ring in 1..=rings {
        let polar = ring as f64 * step;
        let count = (std::f64::consts::TAU * polar.sin() / step).ceil().max(1.0) as usize;
        for place in 0..count {
            let azimuth = std::f64::consts::TAU * place as f64 / count as f64;
            let (sine, cosine) = azimuth.sin_cos();
            directions.push(frame * Vector3::new(polar.sin() * cosine, polar.sin() * sine, polar.cos()));
        }
    }
    directions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_reaches_the_turns_that_it_fits() {
        let quarter = |angle: f64| angle.rem_euclid(FRAC_PI_2);
        for step in 0..720 {
            let (along, across) = (f64::from(step) * 0.01).sin_cos();
            let apart = quarter(quarter_turn(along, across) - (-along).atan2(across));
            assert!(apart.min(FRAC_PI_2 - apart) < TURN_ERROR, "{step}: {apart}");
        }
        assert_eq!(quarter_turn(0.0, 0.0), 0.0);
        for step in 0..=100 {
            let angle = f64::from(step) / 100.0 * FRAC_PI_2;
            assert!((angle..1.2 * angle + 0.05).contains(&reached(angle.sin().powi(2))), "{angle}");
        }
        assert!(reached(f64::INFINITY) >= FRAC_PI_2);
    }
}
