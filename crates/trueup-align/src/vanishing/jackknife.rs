//! How much a frame of the scene depends on which segments are asked: refinements without some of them.
//!
//! # Source
//! Efron and Tibshirani, An Introduction to the Bootstrap, chapter 11 (delete-a-group jackknife).

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::vanishing::joint::{LineVote, Refinement};

/// Most groups that photographs are left out in to learn how sure the refinement is.
const MAX_GROUPS: usize = 8;
/// A deviation estimated from k groups is too small for Student's t by about this over k - 1 (one standard deviation).
const FEW_GROUPS: f64 = 0.66;
/// A covariance has the shape that so many more groups would give it that scatter alike all round. Reasoned: the two
/// axes of a vertical, a group each.
const SHAPELESS_GROUPS: f64 = 2.0;

/// Standard deviation, about any level axis, of what all lines of a scene err by alike, degrees. Fitted on 276
/// photographs cut from panoramas: the smallest hundredth with which the 95 % interval holds the truth of 95 % of them.
/// docs/quality.md has the coverage on others.
pub(crate) const SCENE_DEVIATION_DEG: f64 = 0.04;
/// Width of a sector of the scene, degrees of longitude: a facade, seen from where its lines can be told apart.
const SECTOR_DEG: f64 = 20.0;
/// Fewer sectors with lines tell nothing of how they scatter.
pub(crate) const MIN_SECTORS: usize = 4;

/// The sector of longitude about the vertical, column `vertical` of a frame, that a direction of the common frame lies
/// in: a number from 0.
fn sector(frame: &Matrix3<f64>, vertical: usize, toward: &Vector3<f64>) -> usize {
    let (across, along) = (frame.column((vertical + 1) % 3), frame.column((vertical + 2) % 3));
    let longitude = toward.dot(&across).atan2(toward.dot(&along));
    // The longitude from 0 to a full turn; the cast saturates.
    ((longitude + std::f64::consts::PI) / SECTOR_DEG.to_radians()) as usize
}

/// How far an axis of a frame depends on what is asked of the scene, by frames found without one group of it each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AxisScatter {
    /// Covariance of the axis, rad^2; too small of few groups, as Student's t knows.
    pub covariance: Matrix3<f64>,
    /// How many groups it comes from: two or more.
    pub groups: usize,
}

impl AxisScatter {
    /// Of column `axis` of frames found without one group each; `None` of fewer than two.
    pub(crate) fn of(frames: &[Matrix3<f64>], axis: usize) -> Option<Self> {
        if frames.len() < 2 {
            return None;
        }
        let groups = frames.len() as f64;
        let mean = frames.iter().map(|frame| frame.column(axis).into_owned()).sum::<Vector3<f64>>() / groups;
        let from_mean = |frame: &Matrix3<f64>| frame.column(axis) - mean;
        let spread: Matrix3<f64> = frames.iter().map(|frame| from_mean(frame) * from_mean(frame).transpose()).sum();
        Some(Self { covariance: spread * ((groups - 1.0) / groups), groups: frames.len() })
    }

    /// Degrees of freedom that the covariance is estimated with.
    pub(crate) fn degrees_of_freedom(&self) -> usize {
        self.groups - 1
    }

    /// The covariance to weigh `axis` by: it grows as Student's t does, and the fewer groups tell it, the less it is
    /// believed that the axis is surer one way than the other.
    pub(crate) fn widened(&self, axis: &Vector3<f64>) -> Matrix3<f64> {
        let free = self.degrees_of_freedom() as f64;
        let about = (Matrix3::identity() - axis * axis.transpose()) * (0.5 * self.covariance.trace());
        (self.covariance * free + about * SHAPELESS_GROUPS) / (free + SHAPELESS_GROUPS) * few(free).powi(2)
    }
}

/// Standard deviation in radians of an axis of this covariance, about both of its tangents together.
pub(crate) fn deviation(covariance: &Matrix3<f64>) -> f64 {
    covariance.trace().sqrt()
}

/// Covariance of the vertical, column `vertical` of a frame that a refinement found, rad^2, by what is left without one
/// sector of the scene each; `None` with fewer than [`MIN_SECTORS`]. One thing that several photographs show is in the
/// lines of all of them: leaving out photographs does not show that all rests on it.
pub(crate) fn covariance_by_sectors(
    vote: &LineVote,
    refinement: Refinement<'_>,
    vertical: usize,
) -> Option<Matrix3<f64>> {
    let frames = without_each_sector(vote, refinement, vertical);
    let scatter = AxisScatter::of(&frames, vertical).filter(|scatter| scatter.groups >= MIN_SECTORS)?;
    Some(scatter.widened(&refinement.start.column(vertical).into_owned()))
}

/// Covariance, rad^2, by a delete-a-group jackknife over the photographs, of an axis (a column) of a frame that a
/// refinement found, from which it starts again: how much it depends on which photographs are asked. Infinite on the
/// diagonal of a single photograph, of which nothing is known.
///
/// Photographs, not segments, are left out, because the segments of one photograph err together.
pub(crate) fn covariance_by_photographs(vote: &LineVote, refinement: Refinement<'_>, axis: usize) -> Matrix3<f64> {
    let scatter = AxisScatter::of(&without_some_photographs(vote, refinement), axis);
    let widened = |scatter: AxisScatter| scatter.widened(&refinement.start.column(axis).into_owned());
    scatter.map_or_else(|| Matrix3::from_diagonal_element(f64::INFINITY), widened)
}

/// The frames that come out of a refined one when the segments of one group of photographs at a time are not asked: at
/// most [`MAX_GROUPS`] groups, of equal numbers of photographs as far as these can be divided.
pub(crate) fn without_some_photographs(vote: &LineVote, refinement: Refinement<'_>) -> Vec<Matrix3<f64>> {
    let groups = vote.photographs().min(MAX_GROUPS);
    let without = |group: usize| vote.refine_again(refinement, |one| one.photograph % groups != group);
    (0..groups).into_par_iter().map(without).collect()
}

/// The sector of longitude about the vertical, column `vertical` of `frame`, that the midpoint of every segment lies
/// in, a number from 0; by photograph.
pub(crate) fn sectors(vote: &LineVote, frame: &Matrix3<f64>, vertical: usize) -> Vec<Vec<usize>> {
    vote.by_midpoint(|toward| sector(frame, vertical, &toward))
}

/// Standard deviation of a number that was found without one group each, two or more; it grows as Student's t does of
/// few. What [`AxisScatter`] is of an axis.
pub(crate) fn deviation_of(without_each: &[f64]) -> f64 {
    let groups = without_each.len() as f64;
    let mean = without_each.iter().sum::<f64>() / groups;
    let squares: f64 = without_each.iter().map(|one| (one - mean).powi(2)).sum();
    (squares * (groups - 1.0) / groups).sqrt() * few(groups - 1.0)
}

/// By which factor a deviation with so many degrees of freedom is too small.
fn few(degrees_of_freedom: f64) -> f64 {
    1.0 + FEW_GROUPS / degrees_of_freedom
}

/// The frames that come out of a refined one, whose column `vertical` is the vertical, when the segments of one sector
/// of the scene at a time are not asked, whatever photographs show them. Only sectors with segments that support an
/// axis that is used count.
///
/// The pieces of a line, its views in several photographs, and the window frames of a facade lie in one sector. What
/// they err by alike, leaving out photographs would not show: another photograph still has it.
pub(crate) fn without_each_sector(vote: &LineVote, refinement: Refinement<'_>, vertical: usize) -> Vec<Matrix3<f64>> {
    let Refinement { start: frame, axes_used, .. } = refinement;
    let sector_of = sectors(vote, frame, vertical);
    let supporters = vote.supporters(frame, axes_used);
    let mut populated: Vec<usize> = supporters.iter().map(|one| sector_of[one.photograph][one.line]).collect();
    populated.sort_unstable();
    populated.dedup();
    let without = |sector: usize| vote.refine_again(refinement, |one| sector_of[one.photograph][one.line] != sector);
    populated.into_par_iter().map(without).collect()
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_y, rotation_about_z};

    use super::*;

    /// The first axis 0.01 aside to four sides, four groups: the squares sum up to 4e-4, of which 3/4 count, times 1 +
    /// 0.66 / 3 for their fewness. The third axis moves with the turns about y alone: squares of 2e-4.
    #[test]
    fn the_jackknife_of_known_frames() {
        let frames = [rotation_about_y(0.01), rotation_about_y(-0.01), rotation_about_z(0.01), rotation_about_z(-0.01)];
        let found =
            |axis| deviation(&AxisScatter::of(&frames, axis).expect("four groups").widened(&Vector3::ith(axis, 1.0)));
        let few = 1.22;
        assert!((found(0) / (few * 3e-4_f64.sqrt()) - 1.0).abs() < 1e-4);
        assert!((found(2) / (few * 1.5e-4_f64.sqrt()) - 1.0).abs() < 1e-4);
        assert_eq!(AxisScatter::of(&frames[..1], 0), None);
    }

    /// By hand: mean 4, squares 4 + 1 + 9 = 14, of which 2/3 count, times 1 + 0.66 / 2: 1.33 sqrt(9.3333) = 4.0632.
    #[test]
    fn the_jackknife_of_known_numbers() {
        assert!((deviation_of(&[2.0, 3.0, 7.0]) - 4.0632).abs() < 1e-4);
        assert_eq!(deviation_of(&[5.0; 4]), 0.0);
    }

    /// By hand: of variances 8 and 0 about x and z, mean 4, three groups have two degrees of freedom: (2 x 8 + 2 x 4) /
    /// 4 = 6 and (2 x 0 + 2 x 4) / 4 = 2, times (1 + 0.66 / 2)^2 = 1.7689; of a thousand groups nearly 8 and 0.
    #[test]
    fn few_groups_tell_little_of_a_scatters_shape() {
        let covariance = Matrix3::from_diagonal(&Vector3::new(8e-4, 0.0, 0.0));
        let widened = |groups| AxisScatter { covariance, groups }.widened(&Vector3::y());
        let expected = Matrix3::from_diagonal(&Vector3::new(6e-4, 0.0, 2e-4)) * 1.7689;
        assert!((widened(3) - expected).norm() < 1e-12, "{}", widened(3));
        assert!((widened(1000) - covariance).norm() < 3e-6);
    }

    /// By hand: sectors are counted from half a turn to the left of the axis after the next one, toward the next.
    #[test]
    fn sectors_go_round_the_vertical() {
        let frame = Matrix3::identity();
        let toward = |degrees: f64| Vector3::new(degrees.to_radians().cos(), 7.0, degrees.to_radians().sin());
        // The vertical is y: the axis after it z, the next x.
        let sectors = [-179.0, -150.0, 1.0, 19.0, 21.0, 179.0].map(|degrees| sector(&frame, 1, &toward(degrees)));
        assert_eq!(sectors, [0, 1, 9, 9, 10, 17]);
    }
}
