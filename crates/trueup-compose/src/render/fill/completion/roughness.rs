//! How rough the border of a gap is: of an even one, nothing is more like it than a smooth surface.

use rayon::prelude::*;

use super::part::{Part, beside};
use super::samples::difference;

/// Differences beside each other that noise and the slope of a sky make, distance of roots of light.
const EVEN: f32 = 3.0 / 255.0;

/// Samples of the border that a sample of the gap is judged by, at most.
const ASKED: usize = 64;

/// Share of them that differs by less than what counts.
const RANK: f32 = 0.67;

/// How much the border beside each sample of a gap differs from sample to sample, beyond what noise does: of the
/// nearest stretch of the border, what a third of it exceeds. So one lamp in an even sky is nothing, and clouds are
/// something.
pub(super) fn of(part: &Part) -> Vec<f32> {
    let is_border = part.is_border();
    let step = |at: usize| {
        let beside = beside(at, part.width(), part.rows.len()).filter(|&other| is_border[other]);
        let (sum, count) = beside.fold((0.0, 0.0_f32), |(sum, count), other| {
            (sum + difference(part.colors[at], part.colors[other]), count + 1.0)
        });
        sum / count.max(1.0)
    };
    let steps: Vec<(usize, f32)> = part.border.iter().map(|&[at, _]| (at, step(at))).collect();
    let of_sample = |&at: &usize| {
        let mut near: Vec<(usize, f32)> =
            steps.iter().map(|&(other, step)| (part.distance_squared(at, other), step)).collect();
        if near.len() > ASKED {
            near.select_nth_unstable_by(ASKED, |one, other| one.0.cmp(&other.0).then(one.1.total_cmp(&other.1)));
            near.truncate(ASKED);
        }
        let rank = (RANK * near.len() as f32) as usize;
        near.sort_unstable_by(|one, other| one.1.total_cmp(&other.1));
        near.get(rank).map_or(0.0, |&(_, step)| (step - EVEN).max(0.0))
    };
    part.gap.par_iter().map(of_sample).collect()
}
