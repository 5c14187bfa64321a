//! How much a frame of the scene depends on which segments are asked: refinements without some of them.
//!
//! # Source
//! Efron and Tibshirani, An Introduction to the Bootstrap, chapter 11 (delete-a-group jackknife).

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::joint::{LineVote, Refinement};

/// Most groups that photographs are left out in to learn how sure the refinement is.
const MAX_GROUPS: usize = 8;
/// A deviation estimated from k groups is too small for Student's t by about this over k - 1 (one standard deviation).
const FEW_GROUPS: f64 = 0.66;

/// Sectors of longitude of the scene about the vertical.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sectors {
    /// The vertical's column of the frame.
    pub vertical: usize,
    /// Width of a sector, radians.
    pub width: f64,
}

impl Sectors {
    /// The sector, from 0, that a direction of the common frame lies in.
    fn index(self, frame: &Matrix3<f64>, toward: &Vector3<f64>) -> usize {
        let (across, along) = (frame.column((self.vertical + 1) % 3), frame.column((self.vertical + 2) % 3));
        let longitude = toward.dot(&across).atan2(toward.dot(&along));
        // The longitude from 0 to a full turn; the cast saturates.
        ((longitude + std::f64::consts::PI) / self.width) as usize
    }
}

/// Standard deviation in radians, by a delete-a-group jackknife over the photographs, of each axis (a column) of a
/// frame that a refinement found, from which it starts again: how much it depends on which photographs are asked. Infinite for a
/// single photograph.
///
/// Photographs, not segments, are left out, because the segments of one photograph err together.
pub(super) fn axis_deviations(vote: &LineVote, refinement: Refinement<'_>) -> [f64; 3] {
    let groups = vote.photographs().min(MAX_GROUPS);
    if groups < 2 {
        return [f64::INFINITY; 3];
    }
    let frames: Vec<Matrix3<f64>> = (0..groups)
        .into_par_iter()
        .map(|group| vote.refine_again(refinement, |one| one.photograph % groups != group))
        .collect();
    std::array::from_fn(|axis| {
        let mean: Vector3<f64> =
            frames.iter().map(|frame| frame.column(axis).into_owned()).sum::<Vector3<f64>>() / groups as f64;
        let spread: f64 = frames.iter().map(|frame| (frame.column(axis) - mean).norm_squared()).sum();
        let few = 1.0 + FEW_GROUPS / (groups - 1) as f64;
        few * (spread * (groups - 1) as f64 / groups as f64).sqrt()
    })
}

/// The frames that come out of a refined one when the segments of one sector of the scene at a time are not asked,
/// whatever photographs show them. Only sectors with segments that support an axis that is used count.
///
/// The pieces of a line, its views in several photographs, and the window frames of a facade lie in one sector. What
/// they err by alike, leaving out photographs would not show: another photograph still has it.
pub(super) fn without_each_sector(vote: &LineVote, refinement: Refinement<'_>, sectors: Sectors) -> Vec<Matrix3<f64>> {
    let Refinement { start: frame, axes_used, .. } = refinement;
    let sector_of = vote.by_midpoint(|toward| sectors.index(frame, &toward));
    let supporters = vote.supporters(frame, axes_used);
    let mut populated: Vec<usize> = supporters.iter().map(|one| sector_of[one.photograph][one.line]).collect();
    populated.sort_unstable();
    populated.dedup();
    let without = |sector: usize| vote.refine_again(refinement, |one| sector_of[one.photograph][one.line] != sector);
    populated.into_par_iter().map(without).collect()
}
