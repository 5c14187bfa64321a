//! How sure all that is known is of every photograph's roll: the uprightness of a panorama, without truth.
//!
//! The vertical of a panorama is known from the segments of all its photographs, through the cameras, far better than
//! one photograph's own vertical lines tell it. What it may still be wrong by is one turn of the whole scene, and a
//! small turn of every camera against the others:
//!
//! * Segments do not err independently. A line is found in pieces, and again in every photograph that shows it; the
//!   frames of a facade's windows are as plumb as the facade. Sectors of the scene, not segments, are what is left out
//!   in the jackknife that tells how far the vertical depends on chance. Where one thing fills several sectors, leaving
//!   out one of them shows nothing; leaving out a photograph may: the jackknife over these is asked as well.
//! * Upright and level lines may tell of different verticals, each of them sure of its own, as where pavements drain.
//!   What is open between them (see `witnesses`) is asked as well.
//! * Each of the three estimates the same variance from a few groups, and is now too small, now too large. Their mean
//!   counts: the largest of three is nearly always too large. Where photographs agree on nothing and the frame of all
//!   lines together guides, the largest does: what one of them cannot see is to be expected there.
//! * Plumb lines are not plumb, level ones not level, lenses and focal lengths a little different from what was found,
//!   alike in all sectors: no comparison of sectors shows that.
//! * The turns of single cameras have what segments and overlaps leave open of them.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::{matrix_from_rows, orthonormal_complement, roll_from_down, rows_of};
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;

use super::camera_correction::{corrected_rotations, relative_certainties, turn_covariances};
use super::prior::{SimilarityPrior, VerticalSpread};
use super::vertical::roll_of;
use super::vpg::axis_weights;
use crate::vanishing::jackknife::{
    AxisScatter, MIN_SECTORS, SCENE_DEVIATION_DEG, without_each_sector, without_some_photographs,
};
use crate::vanishing::joint::{AxisWeights, LineVote, Refinement};
use crate::vanishing::{InterpretationPlanes, VERTICAL_LINE_DEG};

/// Fewer photographs tell nothing of how they scatter: of two, Student's t is 12.7.
const MIN_GROUPS: usize = 3;
/// Fewest photographs that must show vertical lines, three each: a single one has nothing to agree with.
const MIN_PHOTOGRAPHS: usize = 2;
/// Where no prior was believed, the vertical is sought so near to where the cameras expect it, degrees.
const FARTHEST_DEG: f64 = 20.0;
/// Of a normal distribution 95 % lie within so many standard deviations.
const NORMAL_95: f64 = 1.959_964;

/// What the rolls of photographs are judged by. All lists but `edges` have an entry per photograph.
#[derive(Debug, Clone, Copy)]
pub struct RollsInput<'a> {
    /// Cameras in working pixels, in the common world that the prior was made from.
    pub cameras: &'a [Camera],
    /// The joined pairs.
    pub edges: &'a [PairMatches],
    /// Each photograph's segments, unfiltered.
    pub lines: &'a [Vec<LineSegment>],
    /// Each photograph's working frame.
    pub frames: &'a [WorkingFrame],
    /// The prior of the panorama; where lines guided it, its vertical is the estimate.
    pub prior: &'a SimilarityPrior,
}

/// A photograph's roll and how sure it is. Radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatedRoll {
    /// The vertical in the camera's frame, a unit vector.
    pub down: Vector3<f64>,
    /// The angle from the photograph's down to the vertical: the clockwise turn that stands it upright.
    pub roll: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// With a probability of 95 %, the true roll is not farther from `roll`.
    pub within: f64,
}

/// The roll of every photograph by the lines of all of them, and how sure it is; `None` for those that look within 15
/// degrees of straight up or down.
///
/// `None` altogether where fewer than two photographs show vertical lines, three each, or where these lie in fewer than
/// four sectors of the scene.
///
/// # Source
/// Efron and Tibshirani, An Introduction to the Bootstrap, chapter 11 (jackknife, here over sectors, and over
/// photographs); Student's t with one degree of freedom less than there are of these.
pub fn estimated_rolls(input: &RollsInput<'_>) -> Option<Vec<Option<EstimatedRoll>>> {
    let scene = UprightScene::of(input)?;
    let vote = scene.vote(input);
    let down = scene.down();
    let support = vote.support(&down, VERTICAL_LINE_DEG.to_radians());
    if support.photographs < MIN_PHOTOGRAPHS {
        return None;
    }
    let UprightScene { frame, vertical, axes_used, axis_weights, .. } = &scene;
    let refinement = Refinement { start: frame, axes_used: *axes_used, axis_weights: *axis_weights };
    let scatter = |frames: Vec<Matrix3<f64>>, fewest: usize| {
        AxisScatter::of(&frames, *vertical).filter(|scatter| scatter.groups >= fewest)
    };
    let by_sectors = scatter(without_each_sector(&vote, refinement, *vertical), MIN_SECTORS)?;
    let by_photographs = scatter(without_some_photographs(&vote, refinement), MIN_GROUPS);
    let by_kinds = scene.spread.as_ref().and_then(scatter_of_spread);
    let others = by_photographs.into_iter().chain(by_kinds);
    let scatters: Vec<AxisScatter> = match input.prior.guidance.pooled {
        true => std::iter::once(by_sectors).chain(others).collect(),
        false => vec![mean_scatter(by_sectors, others)],
    };
    let certainties = relative_certainties(&scene.cameras(input), input.edges);
    let turns = turn_covariances(&scene.rotations, &certainties, &vote, frame, *axis_weights)?;
    let estimate = |(rotation, turn): (&Matrix3<f64>, &Matrix3<f64>)| {
        let estimates = scatters.iter().filter_map(|scatter| estimated_roll(scatter, &down, rotation, turn));
        estimates.max_by(|one, other| one.within.total_cmp(&other.within))
    };
    Some(scene.rotations.iter().zip(&turns).map(estimate).collect())
}

/// A vertical, and cameras corrected by it, in the level world of the prior.
struct UprightScene {
    /// Rotations from the level world to each camera.
    rotations: Vec<Matrix3<f64>>,
    /// Directions of the scene (columns).
    frame: Matrix3<f64>,
    /// Which of them is the vertical, up or down.
    vertical: usize,
    /// How many of them segments know: all, or the first alone.
    axes_used: usize,
    axis_weights: AxisWeights,
    /// What upright and level lines say apart.
    spread: Option<VerticalSpread>,
}

impl UprightScene {
    /// The scene as the prior has it where lines guide it; otherwise the vertical that the segments point to near the
    /// prior's.
    fn of(input: &RollsInput<'_>) -> Option<Self> {
        let prior = input.prior;
        let world_from_level = prior.level_from_world().transpose();
        let corrected = prior.camera_from_world.iter().map(|rows| matrix_from_rows(rows) * world_from_level).collect();
        let (first, second) = orthonormal_complement(&Vector3::y());
        let level = Matrix3::from_columns(&[Vector3::y(), first, second]);
        let alone = Self {
            rotations: corrected,
            frame: level,
            vertical: 0,
            axes_used: 1,
            axis_weights: AxisWeights::alike(0).upright_alone(),
            spread: None,
        };
        match (&prior.guidance.dominant, prior.guidance.used) {
            (Some(rows), true) => {
                let frame = matrix_from_rows(rows);
                let axis_weights = axis_weights(&frame, &Vector3::y(), &prior.guidance);
                let vertical = frame.row(1).transpose().iamax();
                let spread = prior.guidance.spread;
                Some(Self { frame, vertical, axes_used: 3, axis_weights, spread, ..alone })
            }
            (None, true) => Some(alone),
            (_, false) => alone.by_lines(input),
        }
    }

    /// The vertical that the segments point to, and cameras that they correct.
    fn by_lines(self, input: &RollsInput<'_>) -> Option<Self> {
        let vote = self.vote(input);
        let frame = vote.refine_first_axis(&self.frame);
        // A comparison with NaN is false.
        let near = frame.column(0).y >= FARTHEST_DEG.to_radians().cos();
        if !near {
            return None;
        }
        let certainties = relative_certainties(&self.cameras(input), input.edges);
        let rotations = corrected_rotations(&self.rotations, &certainties, &vote, &frame, self.axis_weights);
        Some(Self { rotations, frame, ..self })
    }

    /// Down.
    fn down(&self) -> Vector3<f64> {
        let axis = self.frame.column(self.vertical);
        axis * axis.y.signum()
    }

    fn cameras(&self, input: &RollsInput<'_>) -> Vec<Camera> {
        let leveled = |(camera, rotation): (&Camera, _)| Camera { camera_from_world: rows_of(rotation), ..*camera };
        input.cameras.iter().zip(&self.rotations).map(leveled).collect()
    }

    fn vote(&self, input: &RollsInput<'_>) -> LineVote {
        LineVote::new(&self.rotations, InterpretationPlanes::of_all(input.lines, input.cameras, input.frames))
    }
}

/// That of a spread; `None` of fewer groups than tell anything. It is of the sectors, or photographs, that others are
/// of.
fn scatter_of_spread(spread: &VerticalSpread) -> Option<AxisScatter> {
    let covariance = matrix_from_rows(&spread.covariance);
    (spread.groups >= MIN_GROUPS).then_some(AxisScatter { covariance, groups: spread.groups })
}

/// The mean of several estimates of one covariance, with the most groups of them: they are of the same lines.
fn mean_scatter(first: AxisScatter, others: impl Iterator<Item = AxisScatter>) -> AxisScatter {
    let (sum, count) = others.fold((first, 1.0), |(sum, count), one| {
        let groups = sum.groups.max(one.groups);
        (AxisScatter { covariance: sum.covariance + one.covariance, groups }, count + 1.0)
    });
    AxisScatter { covariance: sum.covariance / count, ..sum }
}

/// The roll of a camera, which `rotation` takes the world to, and whose own turn has the covariance `turn`; the
/// vertical has that of `scatter`.
fn estimated_roll(
    scatter: &AxisScatter,
    down: &Vector3<f64>,
    rotation: &Matrix3<f64>,
    turn: &Matrix3<f64>,
) -> Option<EstimatedRoll> {
    let seen = rotation * down;
    roll_of(&seen)?;
    let across = Vector2::new(seen.y, -seen.x) / seen.xy().norm_squared();
    // How the roll follows the vertical, and a turn w of the camera, which takes down d to d + w x d.
    let by_down = rotation.tr_mul(&across.push(0.0));
    let by_turn = down.cross(&by_down);
    let asked = by_down.dot(&(scatter.covariance * by_down));
    let alike = by_turn.norm_squared() * SCENE_DEVIATION_DEG.to_radians().powi(2);
    let own = by_turn.dot(&(turn * by_turn));
    let student = student_95(scatter.degrees_of_freedom());
    let within = (student.powi(2) * asked + NORMAL_95.powi(2) * (alike + own)).sqrt();
    let standard_error = (asked + alike + own).sqrt();
    Some(EstimatedRoll { down: seen, roll: roll_from_down(&seen), standard_error, within })
}

/// 95 % of Student's t distribution lie within so many standard deviations.
///
/// # Source
/// The expansion in reciprocal degrees of freedom: Abramowitz and Stegun, Handbook of Mathematical Functions, 26.7.5;
/// right to 0.3 % from three degrees on, to 0.8 % of two.
fn student_95(degrees_of_freedom: usize) -> f64 {
    let (z, n) = (NORMAL_95, degrees_of_freedom as f64);
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    let fourth =
        (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z) / 92_160.0;
    z + first / n + second / n.powi(2) + third / n.powi(3) + fourth / n.powi(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of Student's t at 97.5 %.
    #[test]
    fn few_sectors_have_long_tails() {
        for (degrees_of_freedom, expected) in [(3, 3.182_446), (4, 2.776_445), (10, 2.228_139), (30, 2.042_272)] {
            assert!((student_95(degrees_of_freedom) / expected - 1.0).abs() < 0.003, "{degrees_of_freedom}");
        }
        assert!((student_95(2) / 4.302_653 - 1.0).abs() < 0.008);
    }

    /// Verticals at 1 and -1 hundredths about x and z, four sectors: mean 0, sums of squares 2e-4, times 3/4.
    #[test]
    fn the_jackknife_of_known_verticals() {
        let down =
            |x: f64, z: f64| Matrix3::from_columns(&[Vector3::zeros(), Vector3::new(x, 0.0, z), Vector3::zeros()]);
        let scatter = AxisScatter::of(&[down(0.01, 0.0), down(-0.01, 0.0), down(0.0, 0.01), down(0.0, -0.01)], 1);
        let expected = Matrix3::from_diagonal(&Vector3::new(1.5e-4, 0.0, 1.5e-4));
        assert!((scatter.expect("four").covariance - expected).norm() < 1e-15);
        assert_eq!(scatter.map(|scatter| scatter.degrees_of_freedom()), Some(3));
    }

    /// By hand: diagonals 1, 4, 7 come to 4; of four, six and three groups six count.
    #[test]
    fn estimates_of_one_scatter_are_averaged() {
        let of = |variance: f64, groups| AxisScatter { covariance: Matrix3::identity() * variance, groups };
        let mean = mean_scatter(of(1.0, 4), [of(4.0, 6), of(7.0, 3)].into_iter());
        assert!((mean.covariance - Matrix3::identity() * 4.0).norm() < 1e-12 && mean.groups == 6);
        assert_eq!(mean_scatter(of(1.0, 4), std::iter::empty()), of(1.0, 4));
    }

    /// A level camera that looks along z: a turn about z of the scene is its roll, one about x is none of it.
    #[test]
    fn a_level_camera_rolls_as_far_as_the_vertical_leans_across() {
        let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 0.0, 9e-4));
        let scatter = AxisScatter { covariance, groups: 31 };
        let (down, level) = (Vector3::y(), Matrix3::identity());
        let found = estimated_roll(&scatter, &down, &level, &Matrix3::zeros()).expect("level");
        let alike = SCENE_DEVIATION_DEG.to_radians().powi(2);
        assert!((found.standard_error - (4e-4 + alike).sqrt()).abs() < 1e-12 && found.roll.abs() < 1e-15);
        let expected = (2.042_272_f64.powi(2) * 4e-4 + NORMAL_95.powi(2) * alike).sqrt();
        assert!((found.within / expected - 1.0).abs() < 1e-5);
        let turned = estimated_roll(&scatter, &down, &level, &Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1e-4)));
        assert!((turned.expect("level").standard_error - (5e-4 + alike).sqrt()).abs() < 1e-12);
        let steep = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
        assert_eq!(estimated_roll(&scatter, &down, &steep, &Matrix3::zeros()), None);
    }
}
