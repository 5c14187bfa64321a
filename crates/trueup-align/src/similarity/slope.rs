//! Whether what passes for level in a scene is level.
//!
//! Floors, window sills and eaves are; pavements drain, streets climb, and the lines along them vanish below or above the
//! horizon. Together with the upright lines they make a frame of right angles that leans by as much as they slope. Where the
//! vertical of the upright lines alone and the one that the level lines imply contradict each other by more than both are
//! uncertain, the level lines are of a slope.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::orthonormal_complement;

use super::jackknife::axis_deviations;
use super::joint::{AxisWeights, LineVote, Refinement, TOLERANCE_DEG};

/// Standard deviation, about either axis, of the vertical that truly level lines imply from the true one, degrees. Reasoned: what is
/// built level is so to a few millimeters in a meter.
const LEVEL_SPREAD_DEG: f64 = 0.2;
/// The same for lines along a slope, degrees. Reasoned: pavements drain by 1 to 2 degrees, streets and ramps climb by up to 6.
const SLOPE_SPREAD_DEG: f64 = 3.0;
/// Share of scenes whose level lines lie along a slope. Reasoned.
const SLOPING_SHARE: f64 = 0.2;
/// Fewer photographs tell nothing of how uncertain the verticals are: a jackknife over two or three scatters by its own size.
const MIN_PHOTOGRAPHS: usize = 4;
/// Fewest of them that must show upright lines, three each, to contradict the level ones.
const MIN_UPRIGHT_PHOTOGRAPHS: usize = 2;
/// Level lines of less weight beside the upright ones tilt nothing, slope or not.
const MIN_WEIGHT: f64 = 0.1;

/// A vertical that the level lines of a scene contradict.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slope {
    /// The vertical of the upright lines alone.
    pub vertical: Vector3<f64>,
    /// Angle in radians between it and the one that the level lines imply.
    pub angle: f64,
}

/// The slope of the level lines of `frame`, whose column `vertical` is the vertical; `None` where they agree with the upright lines as
/// far as both are sure (by a jackknife over the photographs), do not count anyway, or are of too few photographs.
pub(super) fn slope(
    vote: &LineVote,
    frame: &Matrix3<f64>,
    vertical: usize,
    axis_weights: &AxisWeights,
) -> Option<Slope> {
    let level_weights: AxisWeights =
        std::array::from_fn(|axis| if axis == vertical { 0.0 } else { axis_weights[axis] });
    if vote.photographs() < MIN_PHOTOGRAPHS || level_weights.iter().all(|&weight| weight < MIN_WEIGHT) {
        return None;
    }
    let start: Vector3<f64> = frame.column(vertical).into_owned();
    let (first, second) = orthonormal_complement(&start);
    let upright = vote.refine_first_axis(&Matrix3::from_columns(&[start, first, second]));
    let upright_vertical: Vector3<f64> = upright.column(0).into_owned();
    if vote.support(&upright_vertical, TOLERANCE_DEG.to_radians()).photographs < MIN_UPRIGHT_PHOTOGRAPHS {
        return None;
    }
    let level = vote.refine_frame(frame, &level_weights);
    let angle = upright_vertical.angle(&level.column(vertical));
    let upright_deviation =
        axis_deviations(vote, Refinement { start: &upright, axes_used: 1, axis_weights: &[1.0; 3] })[0];
    let level_deviation =
        axis_deviations(vote, Refinement { start: &level, axes_used: 3, axis_weights: &level_weights })[vertical];
    let uncertainty = upright_deviation.hypot(level_deviation);
    is_slope(angle, uncertainty).then_some(Slope { vertical: upright_vertical, angle })
}

/// Whether an angle between two verticals is more likely one of a slope than of level lines. `uncertainty` is the standard deviation of
/// their difference about both axes together; all in radians.
fn is_slope(angle: f64, uncertainty: f64) -> bool {
    let likelihood = |spread_deg: f64| {
        let variance = 0.5 * uncertainty.powi(2) + spread_deg.to_radians().powi(2);
        (-0.5 * angle.powi(2) / variance).exp() / variance
    };
    // Of an infinite uncertainty both are 0.
    SLOPING_SHARE * likelihood(SLOPE_SPREAD_DEG) > (1.0 - SLOPING_SHARE) * likelihood(LEVEL_SPREAD_DEG)
}

#[cfg(test)]
mod tests {
    use trueup_core::StageContext;
    use trueup_core::geometry::rotation_about_x;

    use super::super::options::SimilarityOptions;
    use super::super::synthetic::{Sweep, SyntheticScene, World, photograph_lines};
    use super::super::tests::with_lines;
    use super::*;

    /// By hand, with no uncertainty: 0.2 / 9 exp(-d^2 / 18) beyond 0.8 / 0.04 exp(-d^2 / 0.08) from
    /// d^2 (12.5 - 0.0556) = ln 900, d = 0.739 degrees. With one of 2 degrees about both axes, variances are 2.04 and 11:
    /// d^2 (0.2451 - 0.04545) = ln (0.8 x 11 / (0.2 x 2.04)) = 3.071, d = 3.922 degrees.
    #[test]
    fn level_lines_are_of_a_slope_where_they_contradict_the_upright_ones() {
        let slopes =
            |angle_deg: f64, uncertainty_deg: f64| is_slope(angle_deg.to_radians(), uncertainty_deg.to_radians());
        assert!(!slopes(0.735, 0.0) && slopes(0.743, 0.0));
        assert!(!slopes(3.91, 2.0) && slopes(3.94, 2.0));
        assert!(!is_slope(0.1, f64::INFINITY) && !is_slope(f64::NAN, 0.1));
    }

    /// A square that drains: its joints climb by 2.5 degrees toward the building, whose edges are plumb.
    #[test]
    fn lines_along_a_slope_do_not_tilt_the_vertical() {
        const SLOPE_DEG: f64 = 2.5;
        let world = World::Manhattan { noise_deg: 0.5, bad_share: 0.0 };
        let level = with_lines(SyntheticScene::new(Sweep::default(), world, 0.0, 13), 20, 0.5);
        assert_eq!(level.prior(&SimilarityOptions::default()).guidance.slope, None);
        let mut sloping = level.clone();
        let mut generator = StageContext::default().generator("slope", 0);
        let slope = rotation_about_x(SLOPE_DEG.to_radians());
        for (lines, rotation) in sloping.lines.iter_mut().zip(&level.world_from_camera) {
            let along = photograph_lines(&(rotation.transpose() * slope), 20, 0, 0.5, &mut generator);
            // Of the three directions the second is the vertical.
            lines[0..20].copy_from_slice(&along[0..20]);
            lines[40..60].copy_from_slice(&along[40..60]);
        }
        let prior = sloping.prior(&SimilarityOptions::default());
        let found = prior.guidance.slope.expect("a slope").to_degrees();
        assert!((found - SLOPE_DEG).abs() < 0.1, "{found} degrees");
        let largest = sloping.errors_deg(&prior).into_iter().fold(0.0, f64::max);
        assert!(largest < 0.1, "{largest} degrees");
    }
}
