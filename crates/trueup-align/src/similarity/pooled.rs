//! Where the segments of all photographs together are heard, instead of the directions that photographs have of their
//! own.

use nalgebra::Matrix3;

use super::dominant::Dominant;
use super::gate::{Agreement, allowed_of_level_lines};
use super::prior::Guidance;
use super::signed_permutation::triad_residual;
use super::upright::Upright;
use super::vpg::{SceneDirections, column_near};
use crate::vanishing::frame_search::{GUIDING_SIGNIFICANCE, PooledFrames};
use crate::vanishing::joint::{self, AxisWeights};

/// Photographs whose own directions must agree for lines of all together not to outvote them: one photograph agrees
/// with itself.
const MIN_AGREEING: usize = 2;
/// How many times better segments of all photographs fit another frame than the one that photographs agree on, for it
/// to be heard instead. Of 273 cut sets two have more and then guide, whose verticals are 0.04 instead of 3.2 degrees
/// off, and 0.04 instead of 0.03; those of 19 with 1.02 to 1.25 would differ by 0.08 at most; of 61 photographed sets
/// none has more than 1.12.
const OUTVOTED: f64 = 1.25;

/// A frame that the segments of all photographs stand for, farther from chance than what guides must be.
pub(super) struct StandingOut {
    frame: Matrix3<f64>,
    /// As of [`PooledFrames`].
    significance: f64,
}

impl SceneDirections<'_> {
    /// The frame of the pooled search, if it stands out far enough.
    pub(super) fn standing_out(&self, pooled: &PooledFrames) -> Option<StandingOut> {
        let significance = pooled.significance;
        let frame = (significance >= GUIDING_SIGNIFICANCE).then(|| pooled.refined(&self.vote)).flatten()?;
        Some(StandingOut { frame, significance })
    }

    /// What stands out, as the directions that are heard: for where photographs agree on none, or on some that leave
    /// the vertical open, are refused or outvoted.
    pub(super) fn pooled(
        &self,
        pooled: &StandingOut,
        own: Option<&Dominant>,
        guidance: &mut Guidance,
    ) -> Option<Dominant> {
        let StandingOut { frame, significance } = *pooled;
        let down = self.vertical(&frame);
        // What stands out so far is agreed on.
        if self.level.angle_to(&down).is_some_and(|found| found.is_too_wide(Agreement::Close)) {
            return None;
        }
        let allowed = allowed_of_level_lines(significance - GUIDING_SIGNIFICANCE);
        if self.by_level_lines(&down).is_some_and(|deviations| deviations > allowed) {
            return None;
        }
        if own.is_some_and(|own| self.is_outdone(&frame, own)) {
            return None;
        }
        let residuals = self.triads.iter().map(|triad| triad.map(|triad| triad_residual(&frame, &triad))).collect();
        let dominant = Dominant { frame, residuals };
        guidance.pooled = true;
        guidance.inliers = self.inliers(&dominant);
        guidance.residuals.clone_from(&dominant.residuals);
        Some(dominant)
    }

    /// The prior of the frame that stands out, where segments fit it far better than the one that photographs agree on:
    /// with few lines each may take others for its directions that nearly agree with its neighbors'.
    pub(super) fn outvoted(
        &mut self,
        pooled: &PooledFrames,
        own: &Dominant,
        before: &Guidance,
    ) -> Option<(Guidance, Upright)> {
        // Most sets end here, before anything is refined.
        if !pooled.outscores(&own.frame, &self.vote) {
            return None;
        }
        let pooled = self.standing_out(pooled)?;
        let own = self.vote.refine_frame(&own.frame, AxisWeights::alike(0));
        if self.vote.fit(&pooled.frame) <= OUTVOTED * self.vote.fit(&own) {
            return None;
        }
        let (triads, mut guidance) = (self.triads.clone(), before.clone());
        let dominant = self.pooled(&pooled, None, &mut guidance);
        let upright = dominant.and_then(|dominant| self.solve_dominant(dominant, &mut guidance).ok());
        if upright.is_none() {
            self.triads = triads;
        }
        upright.map(|upright| (guidance, upright))
    }

    /// Whether segments fit another frame better that photographs agree on themselves and that the pooled search, which
    /// found `frame`, could not see: its vertical is out of reach. Before a tower that fills photographs taken upward,
    /// what stands out within reach is a frame of the lines that lie between its edges.
    fn is_outdone(&self, frame: &Matrix3<f64>, own: &Dominant) -> bool {
        if !self.is_out_of_reach(&self.vertical(&own.frame)) || self.inliers(own).len() < MIN_AGREEING {
            return false;
        }
        let refined = self.vote.refine_frame(&own.frame, AxisWeights::alike(0));
        let down = self.vertical(frame);
        let nearest = refined.column(column_near(&refined, &down)).into_owned();
        let is_other = nearest.dot(&down).abs() < joint::TOLERANCE_DEG.to_radians().cos();
        is_other && self.vote.fit(&refined) > self.vote.fit(frame)
    }
}
