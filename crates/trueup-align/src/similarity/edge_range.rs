//! What the deformation of an overlap says of the turn between two photographs: a range and a best value per edge.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_core::geometry::{Homography, circular_mean, wrap_angle};
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::source::WorkingFrame;

use super::input::PriorInput;
use super::weighted_solve::TurnTerm;
use crate::match_points::OverlapWarp;

/// Residual weight of an edge whose turn lies in its range, and of one that takes the lines' turn instead.
const IN_RANGE_WEIGHT: f64 = 10.0;
const OUT_OF_RANGE_WEIGHT: f64 = 1.0;
/// Shortest segment that takes part in the turn of least line distortion, working pixels.
const MIN_LINE_PX: f64 = 10.0;
/// Narrowest such segment, working pixels.
const MIN_LINE_WIDTH_PX: f64 = 2.0;

/// The turns theta_j - theta_i that the overlap allows: from `start` counter to the sense of wrapping over `extent`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TurnRange {
    /// Smallest turn in radians.
    pub start: f64,
    /// Width of the range in radians; half a turn or more allows everything.
    pub extent: f64,
}

impl TurnRange {
    /// The shortest arc that holds all of `turns`; `None` without any.
    pub(super) fn around(turns: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = turns.iter().copied().filter(|turn| turn.is_finite()).map(wrap_angle).collect();
        sorted.sort_by(f64::total_cmp);
        let (&first, &last) = (sorted.first()?, sorted.last()?);
        // The arc is the circle without its widest gap.
        let mut widest = (first + TAU - last, first);
        for pair in sorted.windows(2) {
            if pair[1] - pair[0] > widest.0 {
                widest = (pair[1] - pair[0], pair[1]);
            }
        }
        Some(Self { start: widest.1, extent: TAU - widest.0 })
    }

    /// Whether the range holds `turn`.
    pub(super) fn contains(&self, turn: f64) -> bool {
        /// Slack for turns that were computed on two ways, radians.
        const ROUNDING: f64 = 1e-9;
        self.contains_within(turn, ROUNDING)
    }

    /// The range of the turns the other way.
    pub(super) fn reversed(&self) -> Self {
        Self { start: -self.start - self.extent, extent: self.extent }
    }

    /// Whether the range, longer by `slack` (radians) at both ends, holds `turn`.
    pub(super) fn contains_within(&self, turn: f64, slack: f64) -> bool {
        self.extent >= PI || (turn - self.start + slack).rem_euclid(TAU) <= self.extent + 2.0 * slack
    }
}

/// What the overlap of a joined pair says of the turn theta_b - theta_a.
#[derive(Debug, Clone)]
pub(super) struct OverlapTurns {
    /// The turns at which one grid edge of the overlap would be parallel to its image in the other photograph.
    candidates: Vec<f64>,
    /// The range of the candidates; `None` without a warped overlap.
    pub range: Option<TurnRange>,
}

impl OverlapTurns {
    /// Asks the grid edges of both directions.
    pub(super) fn of(input: &PriorInput<'_>, edge: &PairMatches) -> Self {
        let candidates = overlap_turns(input, edge.a, edge.b);
        let range = TurnRange::around(&candidates);
        Self { candidates, range }
    }

    /// The turn of least line distortion, or the middle candidate where no segment crosses the overlap; `None` without
    /// either.
    pub(super) fn best(&self, input: &PriorInput<'_>, edge: &PairMatches) -> Option<f64> {
        least_line_distortion(input, edge).or_else(|| circular_median(&self.candidates))
    }
}

/// The turns of all edges, weighed: that of `rolls` (of straightened cameras) where the overlap allows it, otherwise
/// the turn of least line distortion with a weight far smaller.
///
/// # Source
/// GSP's three-dimensional prior (Chen and Chuang, Natural Image Stitching with the Global Similarity Prior, section
/// 4).
pub(super) fn allowed_turns(input: &PriorInput<'_>, rolls: &[f64]) -> Vec<TurnTerm> {
    input.edges.par_iter().map(|edge| allowed_turn(input, edge, rolls)).collect()
}

fn allowed_turn(input: &PriorInput<'_>, edge: &PairMatches, rolls: &[f64]) -> TurnTerm {
    let (i, j) = (edge.a, edge.b);
    let turn = wrap_angle(rolls[j] - rolls[i]);
    let term = |turn, weight: f64| TurnTerm { i, j, turn, weight: weight * weight };
    let overlap = OverlapTurns::of(input, edge);
    // Without a warped overlap nothing contradicts the cameras.
    match overlap.range.filter(|range| !range.contains(turn)).and_then(|_| overlap.best(input, edge)) {
        Some(better) => term(better, OUT_OF_RANGE_WEIGHT),
        None => term(turn, IN_RANGE_WEIGHT),
    }
}

/// The turns theta_j - theta_i at which a grid edge of the overlap would be parallel to its image in the other
/// photograph.
fn overlap_turns(input: &PriorInput<'_>, i: usize, j: usize) -> Vec<f64> {
    let mut turns = Vec::new();
    for warp in input.overlaps {
        let sign = match (warp.from, warp.to) {
            // Rot(theta_i) a parallel to Rot(theta_j) b: angle(b) - angle(a) = theta_i - theta_j.
            pair if pair == (i, j) => -1.0,
            pair if pair == (j, i) => 1.0,
            _ => continue,
        };
        let Some(frame) = input.frames.get(warp.from) else { continue };
        let grid = GridMesh::regular(frame.width, frame.height, input.cell_px);
        turns.extend(edge_turns(&grid, warp).map(|turn| sign * turn));
    }
    turns
}

/// Angle of each warped grid edge minus that of the edge itself.
fn edge_turns<'a>(grid: &'a GridMesh, warp: &'a OverlapWarp) -> impl Iterator<Item = f64> + 'a {
    let (rows, columns) = (grid.rows, grid.columns);
    (0..rows * columns).flat_map(move |index| {
        let right = (index % columns + 1 < columns).then_some(index + 1);
        let below = (index / columns + 1 < rows).then_some(index + columns);
        [right, below].into_iter().flatten().filter_map(move |other| {
            let (from, to) = (warp.vertices.get(index).copied()??, warp.vertices.get(other).copied()??);
            let warped = Vector2::from(to) - Vector2::from(from);
            let original = grid.source(other) - grid.source(index);
            Some(wrap_angle(warped.y.atan2(warped.x) - original.y.atan2(original.x)))
        })
    })
}

/// The turn of least line distortion: the mean by which segments turn on their way into the other photograph, weighed
/// by length, width and warped length. `None` without a usable segment.
///
/// # Departures
/// Segments are carried by the pair's global homography instead of a moving one: the mean over a whole overlap changes
/// by less than the spread of the turns.
fn least_line_distortion(input: &PriorInput<'_>, edge: &PairMatches) -> Option<f64> {
    let forward = Homography::from_rows(edge.b_from_a.as_ref()?);
    let backward = forward.inverse()?;
    let mut turns: Vec<(f64, f64)> = Vec::new();
    for (from, to, map, sign) in [(edge.a, edge.b, forward, -1.0), (edge.b, edge.a, backward, 1.0)] {
        let (Some(lines), Some(frame)) = (input.lines.get(from), input.frames.get(to)) else { continue };
        for line in salient(lines) {
            let (start, end) = (Vector2::from(line.start), Vector2::from(line.end));
            if map.denominator(start) * map.denominator(end) <= 0.0 {
                continue;
            }
            let (warped_start, warped_end) = (map.apply(start), map.apply(end));
            if !crosses(frame, warped_start, warped_end) {
                continue;
            }
            let (original, warped) = (end - start, warped_end - warped_start);
            let turn = warped.y.atan2(warped.x) - original.y.atan2(original.x);
            turns.push((sign * turn, line.length() * line.width_px.max(1.0) * warped.norm()));
        }
    }
    circular_mean(turns)
}

/// Whether the segment between two points shares a point with the photograph (Liang and Barsky's clipping).
pub(super) fn crosses(frame: &WorkingFrame, start: Vector2<f64>, end: Vector2<f64>) -> bool {
    let along = end - start;
    // The part of the segment, from 0 to 1, that lies inside every side so far.
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (direction, from, extent) in [(along.x, start.x, frame.width), (along.y, start.y, frame.height)] {
        if direction == 0.0 {
            if !(0.0..=extent).contains(&from) {
                return false;
            }
            continue;
        }
        let (first, second) = (-from / direction, (extent - from) / direction);
        enter = enter.max(first.min(second));
        leave = leave.min(first.max(second));
    }
    enter <= leave
}

/// The segments at least as long as the mean and as wide as half way between the narrowest and the mean.
fn salient(lines: &[LineSegment]) -> impl Iterator<Item = &LineSegment> {
    let count = lines.len().max(1) as f64;
    let mean_length = lines.iter().map(LineSegment::length).sum::<f64>() / count;
    let mean_width = lines.iter().map(|line| line.width_px).sum::<f64>() / count;
    let least_width = lines.iter().map(|line| line.width_px).fold(f64::INFINITY, f64::min);
    let min_width = MIN_LINE_WIDTH_PX.max((least_width + mean_width) / 2.0);
    let min_length = MIN_LINE_PX.max(mean_length);
    lines.iter().filter(move |line| line.length() >= min_length && line.width_px >= min_width)
}

/// The middle one of the angles, counted from the start of the shortest arc around them.
fn circular_median(angles: &[f64]) -> Option<f64> {
    let range = TurnRange::around(angles)?;
    let mut offsets: Vec<f64> = angles
        .iter()
        .filter(|angle| angle.is_finite())
        .map(|angle| (angle - range.start).rem_euclid(TAU))
        .map(|offset| if offset > range.extent + PI * 0.5 { 0.0 } else { offset })
        .collect();
    offsets.sort_by(f64::total_cmp);
    offsets.get(offsets.len() / 2).map(|offset| wrap_angle(range.start + offset))
}
