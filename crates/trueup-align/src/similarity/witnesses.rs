//! What upright and level lines of a scene say of its vertical, each by how sure it is.
//!
//! Floors, window sills and eaves are level; pavements drain, streets climb, and the lines along them vanish below or
//! above the horizon. Together with the upright lines they make a frame of right angles that leans by as much as they
//! slope; it may agree with itself in every photograph, so that nothing but upright and level lines heard apart shows
//! it. Each gives a vertical with a covariance. How far these contradict each other says how probable a slope is, and,
//! whatever is taken for the vertical, how far it may be off.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};
use trueup_core::geometry::orthonormal_complement;

use crate::vanishing::jackknife::{
    AxisScatter, MIN_SECTORS, SCENE_DEVIATION_DEG, without_each_sector, without_some_photographs,
};
use crate::vanishing::joint::{AxisWeights, LineVote, Refinement, TOLERANCE_DEG};
use crate::vanishing::supporters::BUILT_DEVIATION_DEG;

/// [`BUILT_DEVIATION_DEG`] for lines along a slope, degrees. Reasoned: pavements drain by 1 to 2 degrees, streets and
/// ramps climb by up to 6.
const SLOPE_SPREAD_DEG: f64 = 3.0;
/// Share of scenes whose level lines lie along a slope. Reasoned.
const SLOPING_SHARE: f64 = 0.2;
/// Fewest photographs that must show upright lines, three each, to be heard beside the level ones.
pub(super) const MIN_UPRIGHT_PHOTOGRAPHS: usize = 2;
/// Farthest that a vertical of upright lines may lie from the frame they were sought near, in tolerances of a segment's
/// vote: others found another direction.
const MAX_DISTANCE_TOLERANCES: f64 = 2.0;

/// A vertical of upright and level lines together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reconciled {
    /// The mean of what is probable: a unit vector of the common frame, on the side of the frame's column.
    pub vertical: Vector3<f64>,
    /// Covariance of what is probable about it, rad^2.
    pub covariance: Matrix3<f64>,
    /// How many sectors of the scene, or photographs, the covariance comes from.
    pub groups: usize,
    /// The vertical of the upright lines alone.
    pub upright: Vector3<f64>,
    /// Angle in radians between it and the one that the level lines imply.
    pub angle: f64,
    /// How probable it is that the level lines lie along a slope.
    pub sloping: f64,
    /// Whether the upright lines are in too few sectors of the scene to tell how they scatter.
    pub is_narrow: bool,
}

/// A vertical as coordinates in a tangent plane, radians.
#[derive(Debug, Clone, Copy)]
struct Say {
    place: Vector2<f64>,
    covariance: Matrix2<f64>,
}

/// Two says weighed against each other.
#[derive(Debug, Clone, Copy)]
struct Weighed {
    mean: Say,
    sloping: f64,
}

/// What the upright and the level lines near `frame`, whose column `vertical` is the vertical, say together.
/// `agreement`, from 0 to 1, is the weight of level lines, as far as photographs agree on their directions: where
/// buildings stand at several angles, what passes for one of them says less.
///
/// `None` where level lines have no weight, or upright lines are in too few photographs.
pub(super) fn reconciled(vote: &LineVote, frame: &Matrix3<f64>, vertical: usize, agreement: f64) -> Option<Reconciled> {
    // A comparison with NaN is false.
    let counts = agreement > 0.0;
    if !counts {
        return None;
    }
    let start: Vector3<f64> = frame.column(vertical).into_owned();
    let (first, second) = orthonormal_complement(&start);
    let upright_frame = vote.refine_first_axis(&Matrix3::from_columns(&[start, first, second]));
    let upright: Vector3<f64> = upright_frame.column(0).into_owned();
    let farthest = MAX_DISTANCE_TOLERANCES * TOLERANCE_DEG.to_radians();
    let shown = vote.photographs_along(&upright);
    if shown < MIN_UPRIGHT_PHOTOGRAPHS || upright.angle(&start) > farthest {
        return None;
    }
    let level_weights = AxisWeights::new(vertical, 0.0, 1.0);
    let level_frame = vote.refine_frame(frame, level_weights);
    let level: Vector3<f64> = level_frame.column(vertical).into_owned();
    let tangent = Matrix3x2::from_columns(&[first, second]);
    let upright_refinement =
        Refinement { start: &upright_frame, axes_used: 1, axis_weights: AxisWeights::alike(0).upright_alone() };
    let level_refinement = Refinement { start: &level_frame, axes_used: 3, axis_weights: level_weights };
    let (upright_scatter, is_narrow) = scatter(vote, upright_refinement, 0)?;
    let (level_scatter, _) = scatter(vote, level_refinement, vertical)?;
    let say = |direction: &Vector3<f64>, scatter: &AxisScatter| Say {
        place: tangent.tr_mul(direction),
        covariance: tangent.tr_mul(&(scatter.covariance * tangent)),
    };
    let weighed = weighed(&say(&upright, &upright_scatter), &say(&level, &level_scatter), agreement)?;
    let covariance = tangent * weighed.mean.covariance * tangent.transpose();
    let vertical = (start + tangent * weighed.mean.place).normalize();
    let finite = vertical.iter().chain(covariance.iter()).all(|value| value.is_finite());
    let angle = upright.angle(&level);
    let groups = upright_scatter.groups;
    finite.then_some(Reconciled { vertical, covariance, groups, upright, angle, sloping: weighed.sloping, is_narrow })
}

/// Covariance in rad^2 of the `vertical` that level lines imply, by what they may slope: what they add to their scatter
/// where no upright lines are heard beside them.
pub(super) fn covariance_of_slopes(vertical: &Vector3<f64>) -> Matrix3<f64> {
    let square = |deviation_deg: f64| deviation_deg.to_radians().powi(2);
    let variance = (1.0 - SLOPING_SHARE) * square(BUILT_DEVIATION_DEG) + SLOPING_SHARE * square(SLOPE_SPREAD_DEG);
    (Matrix3::identity() - vertical * vertical.transpose()) * variance
}

/// Scatter of column `axis` of a refined frame by leaving out one sector of the scene each; where lines are in too few
/// of these, one photograph each, and whether they are. `None` with a single photograph.
fn scatter(vote: &LineVote, refinement: Refinement<'_>, axis: usize) -> Option<(AxisScatter, bool)> {
    let by_sectors = without_each_sector(vote, refinement, axis);
    let is_narrow = by_sectors.len() < MIN_SECTORS;
    let frames = if is_narrow { without_some_photographs(vote, refinement) } else { by_sectors };
    AxisScatter::of(&frames, axis).map(|scatter| (scatter, is_narrow))
}

/// The mean of two normal distributions: that level lines are level, and that they lie along a slope. Each has the
/// place of least squares, and is as probable as the says' distance from each other makes it. `agreement` divides the
/// level lines' variance. `None` where that cannot be told.
fn weighed(upright: &Say, level: &Say, agreement: f64) -> Option<Weighed> {
    let variance = |deviation_deg: f64| Matrix2::identity() * deviation_deg.to_radians().powi(2);
    let upright = Say { covariance: upright.covariance + variance(SCENE_DEVIATION_DEG), ..*upright };
    let apart = level.place - upright.place;
    let together = |spread_deg: f64, share: f64| {
        let of_level = (level.covariance + variance(spread_deg)) / agreement;
        let inverse = (upright.covariance + of_level).try_inverse()?;
        let gain = upright.covariance * inverse;
        let mean =
            Say { place: upright.place + gain * apart, covariance: upright.covariance - gain * upright.covariance };
        let log_likelihood = share.ln() - 0.5 * apart.dot(&(inverse * apart)) + 0.5 * inverse.determinant().ln();
        Some((mean, log_likelihood))
    };
    let (if_level, log_level) = together(BUILT_DEVIATION_DEG, 1.0 - SLOPING_SHARE)?;
    let (if_sloping, log_sloping) = together(SLOPE_SPREAD_DEG, SLOPING_SHARE)?;
    let sloping = 1.0 / (1.0 + (log_level - log_sloping).exp());
    let place = if_level.place * (1.0 - sloping) + if_sloping.place * sloping;
    let about = |one: &Say| one.covariance + (one.place - place) * (one.place - place).transpose();
    let covariance = about(&if_level) * (1.0 - sloping) + about(&if_sloping) * sloping;
    Some(Weighed { mean: Say { place, covariance }, sloping })
}

#[cfg(test)]
mod tests {
    use super::super::options::SimilarityOptions;
    use super::super::synthetic::{Sweep, SyntheticScene, World};
    use super::super::tests::with_lines;
    use super::*;

    fn say(x_deg: f64, deviation_deg: f64) -> Say {
        let covariance = Matrix2::identity() * deviation_deg.to_radians().powi(2);
        Say { place: Vector2::new(x_deg.to_radians(), 0.0), covariance }
    }

    /// By hand, where both are sure: with 0.04 degrees that all lines err by alike, variances are 0.0416 and 9.0016,
    /// and 0.2 / 9.0016 exp(-d^2 / 18.0032) is beyond 0.8 / 0.0416 exp(-d^2 / 0.0832) from d^2 (12.019 - 0.0555) = ln
    /// 865.5, d = 0.7519 degrees. With deviations of 1 degree each, variances are 2.04 and 11: d^2 (0.2451 - 0.04545) =
    /// ln (0.8 x 11 / (0.2 x 2.04)) = 3.071, d = 3.922 degrees.
    #[test]
    fn level_lines_are_of_a_slope_where_they_contradict_the_upright_ones() {
        let slopes = |angle_deg: f64, deviation_deg: f64| {
            weighed(&say(0.0, deviation_deg), &say(angle_deg, deviation_deg), 1.0).expect("finite").sloping > 0.5
        };
        assert!(!slopes(0.747, 0.0) && slopes(0.757, 0.0));
        assert!(!slopes(3.91, 1.0) && slopes(3.94, 1.0));
        assert!(!slopes(0.1, 1e9));
    }

    /// By hand: variances of 0.2^2 + 0.04^2 = 0.0416 of the upright lines and 0.4^2 + 0.2^2 = 0.2 of the level ones put
    /// the mean at 0.0416 / 0.2416 of 0.1 degrees, 0.0172, and leave 0.0416 x 0.2 / 0.2416 = 0.0344 square degrees. A
    /// slope is 0.25 x 0.2416 / 9.2016 x exp(0.005 x 4.030) = 0.0067 times as probable, and moves either by less than a
    /// hundredth.
    #[test]
    fn upright_and_level_lines_are_weighed_by_their_variances() {
        let weighed = weighed(&say(0.0, 0.2), &say(0.1, 0.4), 1.0).expect("finite");
        assert!((weighed.sloping - 0.0066).abs() < 2e-4, "{}", weighed.sloping);
        let (place, variance) =
            (weighed.mean.place.x.to_degrees(), weighed.mean.covariance[(1, 1)] * 1_f64.to_degrees().powi(2));
        assert!((place - 0.0172).abs() < 2e-4 && (variance - 0.0344).abs() < 1e-4, "{place} {variance}");
    }

    /// By hand: of variances 0.0916 and 0.0425 about the same place, a slope all but excluded, sqrt(0.0916 x 0.0425 /
    /// 0.1341) = 0.170 degrees are left. A degree apart, a slope has a probability of 0.127, its mean lies 0.67 degrees
    /// from the other, and 0.295 are left; at 6 degrees nothing but the upright lines, with 0.301.
    #[test]
    fn what_is_open_widens_the_covariance() {
        let variance = |angle_deg: f64| {
            let found = weighed(&say(0.0, 0.3), &say(angle_deg, 0.05), 1.0).expect("finite");
            found.mean.covariance[(0, 0)].sqrt().to_degrees()
        };
        for (angle_deg, expected) in [(0.0, 0.170), (1.0, 0.295), (6.0, 0.301)] {
            assert!((variance(angle_deg) - expected).abs() < 0.002, "{} at {angle_deg}", variance(angle_deg));
        }
    }

    /// A square that drains: its joints climb by 2.5 degrees toward the building, whose edges are plumb. Three
    /// photographs know it as well as eight.
    #[test]
    fn lines_along_a_slope_do_not_tilt_the_vertical() {
        const SLOPE_DEG: f64 = 2.5;
        for (count, most) in [(3, 0.2), (8, 0.15)] {
            let world = World::Manhattan { noise_deg: 0.5, bad_share: 0.0 };
            let sweep = Sweep { count, ..Sweep::default() };
            let level = with_lines(SyntheticScene::new(sweep, world, 0.0, 13), 20, 0.5);
            assert_eq!(level.prior(&SimilarityOptions::default()).guidance.slope, None);
            let sloping = level.on_a_slope(SLOPE_DEG);
            let prior = sloping.prior(&SimilarityOptions::default());
            let found = prior.guidance.slope.expect("a slope").to_degrees();
            assert!((found - SLOPE_DEG).abs() < 0.15, "{found} degrees of {count}");
            let largest = sloping.errors_deg(&prior).into_iter().fold(0.0, f64::max);
            assert!(largest < most, "{largest} degrees of {count}");
        }
    }
}
