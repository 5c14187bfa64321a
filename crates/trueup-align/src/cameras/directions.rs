//! What the directions of lines tell of focal lengths.
//!
//! Upright and level edges of what is built lie along three directions at right angles. Through the right focal length
//! they do so in all photographs at once; through another one right angles are none, and directions that photographs
//! share come apart.
//!
//! # Source
//! Caprile and Torre, "Using vanishing points for camera calibration" (1990): the focal length makes vanishing points
//! those of right angles.
//!
//! # Departures
//! No vanishing point is formed. The lines of all photographs are asked together, seen through the cameras that the
//! matches have at each focal length, how well they fit one frame; how sure that is, the scene tells without one sector
//! of it each.

use std::collections::BTreeSet;

use nalgebra::Matrix3;
use rayon::prelude::*;
use trueup_core::camera::Camera;
use trueup_core::lines::LineSegment;
use trueup_core::source::WorkingFrame;

use crate::straightening::{PITCH_PRIOR, straighten_with_pitch};
use crate::vanishing::InterpretationPlanes;
use crate::vanishing::frame_search::{GUIDING_SIGNIFICANCE, search_frames};
use crate::vanishing::jackknife::{deviation_of, sectors};
use crate::vanishing::joint::{AxisWeights, LineVote};

/// Fewer sectors with lines tell nothing of how they scatter.
const FEWEST_SECTORS: usize = 3;
/// Standard deviation of what all lines of a scene err by alike, relative: what a lens bends, and what is not quite at
/// right angles. Measured: seven pairs of one telephone scatter by 0.015 about the focal length that its maker states,
/// seven other sets by 0.08.
const SCENE_DEVIATION: f64 = 0.06;
/// Segments that are asked, shared out evenly among the photographs, the longest first.
const MAX_SEGMENTS: usize = 600;
/// Of so many focal lengths one has its frame searched from nothing.
const SEARCHED_EVERY: usize = 6;

/// A focal length that lines tell.
#[derive(Debug, Clone, Copy)]
pub(super) struct FocalByLines {
    /// As the logarithm of a factor on those of the matches.
    log_factor: f64,
    /// Its standard deviation.
    deviation: f64,
    /// Degrees of freedom of that.
    free: f64,
}

/// The frame that lines fit best through cameras of one focal length.
struct BestFrame {
    /// Columns are directions of the common frame, the vertical first.
    frame: Matrix3<f64>,
    /// How well lines fit it.
    fit: f64,
    /// How far it stands out among all, standard deviations; `None` where it was followed from another focal length.
    significance: Option<f64>,
}

impl BestFrame {
    /// `None` with too few lines.
    fn searched(vote: &LineVote, rotations: &[Matrix3<f64>]) -> Option<Self> {
        let pooled = search_frames(vote, &straighten_with_pitch(rotations, PITCH_PRIOR))?;
        let frame = pooled.refined(vote)?;
        Some(Self { frame, fit: vote.fit(&frame), significance: Some(pooled.significance) })
    }

    /// The one near that of another focal length.
    fn followed(vote: &LineVote, from: &Self) -> Self {
        let frame = vote.refine_frame(&from.frame, AxisWeights::alike(0));
        Self { frame, fit: vote.fit(&frame), significance: None }
    }
}

fn rotations_of(cameras: &[Camera]) -> Vec<Matrix3<f64>> {
    cameras.iter().map(Camera::rotation).collect()
}

/// The best frames through the cameras of each focal length in turn. It turns little from one to the next, so that few
/// are searched from nothing.
fn best_frames(votes: &[LineVote], cameras: &[Vec<Camera>]) -> Option<Vec<BestFrame>> {
    let search = |index: usize| BestFrame::searched(&votes[index], &rotations_of(&cameras[index]));
    let is_searched = |index: usize| index % SEARCHED_EVERY == SEARCHED_EVERY / 2;
    let searched = (0..votes.len()).into_par_iter().map(|index| is_searched(index).then(|| search(index)));
    let mut best: Vec<Option<BestFrame>> =
        searched.map(|found| found.map_or(Some(None), |found| found.map(Some))).collect::<Option<_>>()?;
    let mut follow = |from: usize, to: usize| {
        let followed = best[from].as_ref().map(|from| BestFrame::followed(&votes[to], from));
        if let Some(followed) = followed.filter(|one| best[to].as_ref().is_none_or(|own| one.fit > own.fit)) {
            best[to] = Some(followed);
        }
    };
    (1..votes.len()).for_each(|index| follow(index - 1, index));
    (1..votes.len()).rev().for_each(|index| follow(index, index - 1));
    best.into_iter().collect()
}

impl FocalByLines {
    /// The focal length through which `lines` fit a frame of right angles best. `cameras` are the same photographs'
    /// with ever longer focal lengths: by a factor of e^`first`, and then each by one of e^`step`.
    ///
    /// `None` where no frame stands out from chance, where the best is the first or the last, and where lines are in
    /// too few sectors of the scene.
    pub(super) fn told(
        cameras: &[Vec<Camera>],
        first: f64,
        step: f64,
        lines: &[Vec<LineSegment>],
        frames: &[WorkingFrame],
    ) -> Option<Self> {
        let of_each = MAX_SEGMENTS.div_ceil(frames.len().max(1));
        let vote = |cameras: &Vec<Camera>| {
            LineVote::new(&rotations_of(cameras), InterpretationPlanes::longest_of_all(lines, cameras, frames, of_each))
        };
        let votes: Vec<LineVote> = cameras.iter().map(vote).collect();
        let found = best_frames(&votes, cameras)?;
        let fits: Vec<Vec<f64>> = votes
            .par_iter()
            .zip(&found)
            .map(|(vote, one)| vote.fits_of_own(&one.frame).into_iter().flatten().collect())
            .collect();
        let best = peak(&fits.iter().map(|fits| fits.iter().sum()).collect::<Vec<_>>())?;
        let nearest = best.round() as usize;
        let searched = || BestFrame::searched(&votes[nearest], &rotations_of(&cameras[nearest]))?.significance;
        if found[nearest].significance.or_else(searched)? < GUIDING_SIGNIFICANCE {
            return None;
        }
        let sectors: Vec<usize> = sectors(&votes[nearest], &found[nearest].frame, 0).into_iter().flatten().collect();
        let without_each = peaks_without_each(&fits, &sectors, nearest)?;
        if without_each.len() < FEWEST_SECTORS {
            return None;
        }
        let deviation = (step * deviation_of(&without_each)).hypot(SCENE_DEVIATION);
        Some(Self { log_factor: first + step * best, deviation, free: (without_each.len() - 1) as f64 })
    }

    /// Minus twice the logarithm of its probability by Student's t, at another factor.
    pub(super) fn improbable(&self, log_factor: f64) -> f64 {
        let off = (log_factor - self.log_factor) / self.deviation;
        (self.free + 1.0) * (off * off / self.free).ln_1p()
    }
}

/// Where lines fit best without those of one sector each, of those in which some fit at `nearest`; `fits` are of each
/// segment at each focal length. `None` if that is the first or the last focal length for any.
fn peaks_without_each(fits: &[Vec<f64>], sectors: &[usize], nearest: usize) -> Option<Vec<f64>> {
    let supporting = sectors.iter().zip(&fits[nearest]).filter(|(_, fit)| **fit > 0.0);
    let populated: BTreeSet<usize> = supporting.map(|(&sector, _)| sector).collect();
    let without = |left_out: usize| {
        let kept = |(fit, &sector): (&f64, &usize)| if sector == left_out { 0.0 } else { *fit };
        let sums = fits.iter().map(|fits| fits.iter().zip(sectors).map(kept).sum::<f64>());
        peak(&sums.collect::<Vec<f64>>())
    };
    populated.into_iter().map(without).collect()
}

/// Where values at 0, 1, 2, ... are greatest, by the parabola through the greatest one and those beside it; `None` if
/// it is the first or the last.
pub(super) fn peak(values: &[f64]) -> Option<f64> {
    let greatest = (0..values.len()).reduce(|best, one| if values[one] > values[best] { one } else { best })?;
    let before = values[greatest.checked_sub(1)?];
    let (at, after) = (values[greatest], *values.get(greatest + 1)?);
    let bend = before - 2.0 * at + after;
    Some(greatest as f64 + if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// -(x - 1.3)^2 at 0, 1, 2 and 3.
    #[test]
    fn a_peak_is_that_of_the_parabola() {
        let found = peak(&[-1.69, -0.09, -0.49, -2.89]).expect("a peak");
        assert!((found - 1.3).abs() < 1e-12, "{found}");
        assert_eq!((peak(&[1.0, 2.0]), peak(&[2.0, 1.0, 0.0]), peak(&[])), (None, None, None));
        assert_eq!(peak(&[1.0, f64::NAN, 1.0]), None);
    }

    /// By hand, of Student's t with 3 degrees of freedom: 4 ln(1 + 4 / 3) = 3.389 two deviations away.
    #[test]
    fn what_lines_tell_falls_off_as_students_t() {
        let told = FocalByLines { log_factor: 0.1, deviation: 0.05, free: 3.0 };
        assert!((told.improbable(0.2) - 3.389).abs() < 1e-3 && told.improbable(0.1) == 0.0);
    }
}
