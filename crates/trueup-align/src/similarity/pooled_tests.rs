//! Tests of what the segments of all photographs say together.

use nalgebra::Vector3;
use trueup_core::StageContext;
use trueup_core::camera::Camera;
use trueup_core::geometry::{rotation_about_x, rotation_about_z};

use super::synthetic::{Sweep, SyntheticScene, World, found, noise_rotation, photograph_lines};
use super::tests::{missing, with_lines};
use super::vertical::roll_of;
use super::{Guidance, LevelSource, SimilarityOptions};
use crate::vanishing::InterpretationPlanes;
use crate::vanishing::frame_search::GUIDING_SIGNIFICANCE;
use crate::vanishing::jackknife::{self, covariance_by_photographs};
use crate::vanishing::joint::{AxisWeights, LineVote, Refinement};

fn max(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// Eight photographs of 60 segments each, none with vanishing directions of its own.
fn without_triads(per_direction: usize, clutter: usize) -> SyntheticScene {
    let mut scene = with_lines(SyntheticScene::new(Sweep::default(), World::Random, 0.0, 12), clutter, 0.5);
    scene.triads = vec![missing(); scene.triads.len()];
    for lines in &mut scene.lines {
        // `with_lines` draws 20 along each axis, the clutter after them.
        for axis in (0..3).rev() {
            lines.drain(20 * axis + per_direction..20 * (axis + 1));
        }
    }
    scene
}

#[test]
fn the_segments_of_all_photographs_guide_where_no_photograph_has_directions() {
    let scene = without_triads(6, 30);
    let prior = scene.prior(&SimilarityOptions::default());
    assert!(prior.guidance.used && prior.guidance.pooled && !prior.guidance.vertical_only);
    assert!(prior.guidance.level[0].photographs > 0, "{:?}", prior.guidance.level);
    assert!(max(&scene.errors_deg(&prior)) < 0.2, "{:?}", scene.errors_deg(&prior));
    assert!(prior.guidance.vertical_deviation.is_some_and(|deviation| deviation < 0.2_f64.to_radians()));
    let alone = SimilarityOptions { pooled_search: false, vertical_only: false, ..SimilarityOptions::default() };
    assert!(!scene.prior(&alone).guidance.used);
}

/// Upright lines in two photographs of eight, six each: by these alone the vertical is known badly. The level ones of
/// all photographs tell the rest.
#[test]
fn level_lines_of_all_photographs_tell_the_vertical_where_few_are_upright() {
    let mut scene = without_triads(6, 30);
    for lines in &mut scene.lines[2..] {
        lines.drain(6..12);
    }
    let prior = scene.prior(&SimilarityOptions::default());
    assert!(prior.guidance.used && prior.guidance.pooled, "{:?}", prior.guidance.failed_clause);
    assert!(max(&scene.errors_deg(&prior)) < 0.2, "{:?}", scene.errors_deg(&prior));
}

/// Eight photographs whose segments are all along two level directions, which climb by `slope_deg`. Cameras are rolled
/// by 3 degrees, and so know the vertical to 1.6.
fn without_upright_lines(slope_deg: f64) -> SyntheticScene {
    let sweep = Sweep { roll_sd_deg: 3.0, ..Sweep::default() };
    let level = with_lines(SyntheticScene::new(sweep, World::Random, 0.0, 13), 30, 0.5);
    let mut scene = level.on_a_slope(slope_deg);
    scene.triads = vec![missing(); scene.triads.len()];
    for lines in &mut scene.lines {
        lines.drain(20..40);
    }
    scene
}

/// Skylines and slopes make a frame of right angles, too: where this one lies 7.6 deviations from the cameras', it
/// would have to stand out by 21.
#[test]
fn level_lines_alone_guide_near_where_the_cameras_call_down() {
    let near = without_upright_lines(0.0).prior(&SimilarityOptions::default()).guidance;
    assert!(near.used && near.pooled, "{:?}", near.failed_clause);
    let far = without_upright_lines(12.0).prior(&SimilarityOptions::default()).guidance;
    assert!(far.significance.is_some_and(|figure| figure > GUIDING_SIGNIFICANCE), "{:?}", far.significance);
    assert!(!far.used, "{:?}", far.level);
}

/// By hand: 0.8 x 0.2^2 + 0.2 x 3^2 = 1.832 square degrees about each of two axes, a deviation of 1.914.
#[test]
fn level_lines_alone_leave_open_what_they_slope() {
    let guidance = without_upright_lines(0.0).prior(&SimilarityOptions::default()).guidance;
    let deviation = guidance.vertical_deviation.expect("known").to_degrees();
    assert!((1.914..1.95).contains(&deviation), "{deviation}");
}

/// Segments without noise fit the true frame with all of their weight, and one that is two degrees off with next to
/// nothing of it.
#[test]
fn segments_fit_the_frame_they_are_of() {
    let scene = with_lines(SyntheticScene::new(Sweep::default(), World::Random, 0.0, 11), 0, 0.0);
    let planes = |k: usize| InterpretationPlanes::new(&scene.lines[k], &scene.cameras[k], &scene.frames[k]);
    let rotations: Vec<_> = scene.cameras.iter().map(Camera::rotation).collect();
    let vote = LineVote::new(&rotations, (0..rotations.len()).map(planes).collect());
    let frame = rotations[0].transpose() * scene.world_from_camera[0].transpose();
    assert!((vote.fit(&frame) / vote.total_weight() - 1.0).abs() < 1e-6);
    assert!(vote.fit(&(rotation_about_z(2_f64.to_radians()) * frame)) < 0.7 * vote.total_weight());
}

/// Before a tower that fills two photographs tilted by some 40 degrees, lines of another frame, a half of those along
/// the tower's, stand out within the search's reach, where the tower's vertical does not lie.
#[test]
fn a_frame_does_not_guide_where_photographs_agree_on_a_better_one_out_of_reach() {
    let world = World::Manhattan { noise_deg: 0.3, bad_share: 0.0 };
    let sweep = Sweep { count: 2, pitch_base_deg: -46.0, roll_sd_deg: 0.0, ..Sweep::default() };
    let mut scene = with_lines(SyntheticScene::new(sweep, world, 0.0, 1), 0, 0.5);
    let mut generator = StageContext::default().generator("other frame", 0);
    let other = rotation_about_x(-20_f64.to_radians()) * rotation_about_z(8_f64.to_radians());
    for (lines, world_from_camera) in scene.lines.iter_mut().zip(&scene.world_from_camera) {
        lines.extend(photograph_lines(&(world_from_camera.transpose() * other), 10, 0, 0.5, &mut generator));
    }
    let guidance = scene.prior(&SimilarityOptions::default()).guidance;
    let refused = guidance.failed_clause.is_some_and(|clause| clause.contains("from the vertical of the cameras"));
    assert!(refused && !guidance.used, "{:?}", guidance.significance);
    scene.triads = vec![missing(); scene.triads.len()];
    let guidance = scene.prior(&SimilarityOptions::default()).guidance;
    assert!(guidance.used && guidance.pooled, "{:?}", guidance.failed_clause);
}

/// Photographs whose own directions agree, but in a frame of which two axes are 10 degrees and more from all lines, so
/// that what little fits turns its vertical by 11 and 13 degrees: the segments of all of them outvote it.
#[test]
fn directions_that_agree_are_outvoted_by_the_segments_of_all() {
    let world = World::Manhattan { noise_deg: 0.3, bad_share: 0.0 };
    for (tilt_deg, roll_deg, pitch_base_deg) in [(3.6_f64, 10_f64, 20.0), (4.5, 10.0, 0.0)] {
        let sweep = Sweep { pitch_base_deg, roll_sd_deg: 4.0, count: 6, ..Sweep::default() };
        let mut scene = with_lines(SyntheticScene::new(sweep, world, 0.0, 3), 0, 0.5);
        let askew = rotation_about_x(tilt_deg.to_radians()) * rotation_about_z(roll_deg.to_radians());
        for (triad, world_from_camera) in scene.triads.iter_mut().zip(&scene.world_from_camera) {
            *triad = found(&(world_from_camera.transpose() * askew));
        }
        let prior = scene.prior(&SimilarityOptions::default());
        assert!(prior.guidance.used && prior.guidance.pooled, "{:?}", prior.guidance.failed_clause);
        assert!(max(&scene.errors_deg(&prior)) < 0.2, "{:?}", scene.errors_deg(&prior));
    }
}

/// Photographs of a Manhattan world, all of them held rolled by as much, so that their row runs askew through it.
/// Returns the guidance and the largest error of the rolls, degrees.
fn held_rolled(count: usize, rolled_deg: f64, noise_deg: f64) -> (Guidance, f64) {
    let sweep = Sweep { count, roll_sd_deg: 1.0, ..Sweep::default() };
    let mut scene = SyntheticScene::new(sweep, World::Random, 0.0, 3);
    let world = rotation_about_z(rolled_deg.to_radians());
    let mut generator = StageContext::default().generator("held rolled", 0);
    for k in 0..count {
        let camera_from_world = scene.world_from_camera[k].transpose() * world;
        scene.triads[k] = found(&(noise_rotation(noise_deg, &mut generator) * camera_from_world));
        scene.lines[k] = photograph_lines(&camera_from_world, 20, 20, 0.5, &mut generator);
        scene.roll[k] = roll_of(&(camera_from_world * Vector3::y())).expect("no photograph looks straight up");
    }
    let prior = scene.prior(&SimilarityOptions { vertical_only: false, ..SimilarityOptions::default() });
    let worst = max(&scene.errors_deg(&prior));
    (prior.guidance, worst)
}

/// A row of photographs that were all rolled alike looks level to the cameras. Four that agree closely are believed,
/// three are not, nor are five that only agree as far as the gate allows near the cameras' level, nor what is as near
/// to a level direction.
#[test]
fn four_photographs_that_agree_closely_stand_upright_however_they_were_held() {
    for rolled_deg in [22.0, 30.0, 34.0] {
        let (guidance, worst_deg) = held_rolled(4, rolled_deg, 0.3);
        assert!(guidance.used && !guidance.pooled, "{rolled_deg}: {:?}", guidance.failed_clause);
        assert!(worst_deg < 0.5, "{rolled_deg}: {worst_deg}");
    }
    for (count, rolled_deg, noise_deg) in [(3, 30.0, 0.3), (5, 30.0, 4.0), (5, 40.0, 0.3)] {
        let (guidance, _) = held_rolled(count, rolled_deg, noise_deg);
        let refused = guidance.failed_clause.is_some_and(|clause| clause.contains("from the vertical of the cameras"));
        assert!(refused && !guidance.used, "{count} {rolled_deg} {noise_deg}: {:?}", guidance.divergence);
    }
}

/// Three upright lines in each of five photographs among forty that lie anyhow do not guide; the panorama leans by a
/// third less all the same, in the mean of eight. What lies anyhow changes little.
#[test]
fn a_few_upright_lines_level_what_they_cannot_guide() {
    let leans = |upright: usize| {
        let of_seed = |seed: u64| {
            let sweep = Sweep { count: 5, roll_sd_deg: 4.0, ..Sweep::default() };
            let mut scene = with_lines(SyntheticScene::new(sweep, World::Random, 0.0, seed), 40, 0.5);
            scene.triads = vec![missing(); scene.triads.len()];
            for lines in &mut scene.lines {
                lines.drain(40..60);
                lines.drain(20 + upright..40);
                lines.drain(..20);
            }
            let mean = |options: &SimilarityOptions| {
                let prior = scene.prior(options);
                assert!(!prior.guidance.used, "{seed}");
                let is_told = prior.guidance.level[0].source == LevelSource::Lines;
                assert!(!is_told || options.vertical_only, "{:?}", prior.guidance.level);
                let errors = scene.errors_deg(&prior);
                errors.iter().sum::<f64>() / errors.len() as f64
            };
            let alone = SimilarityOptions { vertical_only: false, ..SimilarityOptions::default() };
            [mean(&SimilarityOptions::default()), mean(&alone)]
        };
        (20..28).map(of_seed).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
    };
    let [with, without] = leans(3);
    assert!(with < 0.67 * without, "{with} and {without}");
    let [with, without] = leans(0);
    assert!(with < 1.1 * without, "{with} and {without}");
}

#[test]
fn clutter_stands_out_nowhere() {
    for clutter in [5, 20, 60] {
        let scene = without_triads(0, clutter);
        let guidance = scene.prior(&SimilarityOptions::default()).guidance;
        assert!(!guidance.used && guidance.significance.is_some_and(|figure| figure < GUIDING_SIGNIFICANCE));
    }
}

#[test]
fn photographs_that_contradict_each_other_leave_the_vertical_uncertain() {
    let mut scene = with_lines(SyntheticScene::new(Sweep::default(), World::Random, 0.0, 11), 0, 0.3);
    let deviation = |scene: &SyntheticScene| {
        let planes = |k: usize| InterpretationPlanes::new(&scene.lines[k], &scene.cameras[k], &scene.frames[k]);
        let rotations: Vec<_> = scene.cameras.iter().map(Camera::rotation).collect();
        let vote = LineVote::new(&rotations, (0..rotations.len()).map(planes).collect());
        // The true frame in the cameras' world.
        let frame = rotations[0].transpose() * scene.world_from_camera[0].transpose();
        let weights = AxisWeights::alike(1);
        let start = vote.refine_frame(&frame, weights);
        let refinement = Refinement { start: &start, axes_used: 3, axis_weights: weights };
        jackknife::deviation(&covariance_by_photographs(&vote, refinement, 1))
    };
    let agreed = deviation(&scene);
    assert!(agreed < 0.1_f64.to_radians(), "{agreed}");
    // Half of the cameras are told to be rolled by two degrees more than they are.
    for k in (0..scene.cameras.len()).step_by(2) {
        let turned = rotation_about_z(2_f64.to_radians()) * scene.cameras[k].rotation();
        scene.cameras[k].set_rotation(&turned);
    }
    assert!(deviation(&scene) > 2.0 * agreed, "{} and {agreed}", deviation(&scene));
    scene.cameras.truncate(1);
    assert!(deviation(&scene).is_infinite());
}
