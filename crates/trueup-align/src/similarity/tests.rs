use nalgebra::{Matrix3, Vector2, Vector3};
use proptest::prelude::*;
use trueup_core::StageContext;
use trueup_core::geometry::{
    nearest_rotation, random_rotation, roll_from_down, rotation_about_x, rotation_about_y, rotation_about_z, rows_of,
    wrap_angle,
};
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::source::{GravitySource, RecordedGravity};

use super::synthetic::{Sweep, SyntheticScene, World, joined, noise_rotation, photograph_lines};
use super::*;
use crate::match_points::OverlapWarp;
use crate::vanishing::{TriadOutcome, VanishingOptions};

const CLEAN: World = World::Manhattan { noise_deg: 0.0, bad_share: 0.0 };

fn paper() -> SimilarityOptions {
    SimilarityOptions {
        joint_refinement: false,
        vertical_only: false,
        guided_redetection: false,
        ..SimilarityOptions::default()
    }
}

/// The five configurations of the published formulas' numeric check.
fn configurations() -> [Sweep; 5] {
    [
        Sweep::default(),
        Sweep { pitch_base_deg: 20.0, ..Sweep::default() },
        Sweep { count: 12, pitch_base_deg: 10.0, yaw_step_deg: 30.0, ..Sweep::default() },
        Sweep { count: 18, rows: 3, ..Sweep::default() },
        Sweep { count: 36, rows: 2, yaw_step_deg: 20.0, ..Sweep::default() },
    ]
}

fn max(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn one_camera_of_known_roll_is_told_to_turn_by_it() {
    let world_from_camera = rotation_about_y(35_f64.to_radians())
        * rotation_about_x(-12_f64.to_radians())
        * rotation_about_z(17_f64.to_radians());
    let down = world_from_camera.transpose() * Vector3::y();
    assert!((roll_from_down(&down).to_degrees() - 17.0).abs() < 1e-9);
    assert!(vertical::roll_of(&Vector3::new(0.01, 0.1, 1.0)).is_none());
}

#[test]
fn clean_scenes_are_upright() {
    for (seed, sweep) in configurations().into_iter().enumerate() {
        let scene = SyntheticScene::new(sweep, CLEAN, 0.0, seed as u64);
        let prior = scene.prior(&paper());
        assert!(prior.guidance.used, "{sweep:?}: {:?}", prior.guidance.failed_clause);
        assert!(max(&scene.errors_deg(&prior)) < 1e-6, "{sweep:?}");
        let level = prior.level_from_world();
        for ((camera, roll), truth) in scene.cameras.iter().zip(&prior.roll).zip(&scene.roll) {
            let down = camera.rotation() * level.row(1).transpose();
            assert!((down.x.atan2(down.y) - roll).abs() < 1e-12 && (roll - truth).abs() < 1e-8);
        }
    }
}

#[test]
fn noise_of_one_degree_leaves_less_than_half_a_degree() {
    let world = World::Manhattan { noise_deg: 1.0, bad_share: 0.0 };
    let errors: Vec<f64> = (0..20)
        .map(|seed| {
            let sweep = Sweep { count: 15, rows: 3, pitch_base_deg: 8.0, ..Sweep::default() };
            let scene = SyntheticScene::new(sweep, world, 0.2, seed);
            mean(&scene.errors_deg(&scene.prior(&paper())))
        })
        .collect();
    assert!(mean(&errors) < 0.5, "{errors:?}");
}

#[test]
fn the_twist_of_pitched_cameras_is_biased_and_the_world_roll_is_not() {
    let sweep = Sweep { pitch_base_deg: 20.0, roll_sd_deg: 2.0, ..Sweep::default() };
    let scene = SyntheticScene::new(sweep, CLEAN, 0.0, 3);
    let relative = scene.prior(&SimilarityOptions { beta_mode: BetaMode::Relative, ..paper() });
    assert!(max(&scene.errors_deg(&relative)) > 5.0);
    assert!(max(&scene.errors_deg(&scene.prior(&paper()))) < 1e-6);
}

#[test]
fn the_world_frame_of_the_cameras_does_not_matter() {
    let world = World::Manhattan { noise_deg: 1.0, bad_share: 0.2 };
    let scene = SyntheticScene::new(Sweep { count: 10, pitch_base_deg: 15.0, ..Sweep::default() }, world, 0.2, 1);
    let expected = scene.prior(&paper());
    for reference in 0..10 {
        // The frame of each camera in turn, as a reference would make it.
        let mut moved = scene.clone();
        let gauge = scene.cameras[reference].rotation().transpose();
        for camera in &mut moved.cameras {
            let rotation = camera.rotation() * gauge;
            camera.set_rotation(&rotation);
        }
        let prior = moved.prior(&paper());
        for (theta, other) in prior.theta.iter().zip(&expected.theta) {
            assert!(wrap_angle(theta - other).abs().to_degrees() < 1e-6);
        }
    }
}

#[test]
fn focal_ratios_come_back_as_scales() {
    let focals = [900.0, 1125.0, 720.0, 900.0, 1000.0, 810.0];
    let sweep = Sweep { count: 6, roll_sd_deg: 3.0, ..Sweep::default() };
    let scene = SyntheticScene::new(sweep, CLEAN, 0.0, 5);
    let (width, height) = (1000.0, 750.0);
    let mut generator = StageContext::default().generator("matches", 0);
    let camera = |i: usize| Camera::new(focals[i], width, height, &scene.world_from_camera[i].transpose());
    let edges: Vec<PairMatches> = (0..5)
        .map(|i| {
            let points = (0..300).filter_map(|_| {
                let point = Vector2::new(generator.random::<f64>() * width, generator.random::<f64>() * height);
                let other = camera(i).transfer(&camera(i + 1), point)?;
                let inside = (0.0..width).contains(&other.x) && (0.0..height).contains(&other.y);
                inside.then(|| PointMatch { in_a: point.into(), in_b: other.into() })
            });
            joined(i, i + 1, points.collect())
        })
        .collect();
    let scales = scale::scales(&edges, &focals, PrintedEquations::NONE);
    let mean_inverse = focals.iter().map(|focal| 1.0 / focal).sum::<f64>() / 6.0;
    for (scale, focal) in scales.iter().zip(focals) {
        assert!((scale * focal * mean_inverse - 1.0).abs() < 0.06, "{scales:?}");
    }
    // Without matches the focal lengths decide only if the hulls contradict themselves: here nothing is known.
    assert!(
        scale::scales(&[joined(0, 1, Vec::new())], &[500.0, 700.0], PrintedEquations::NONE)
            .iter()
            .all(|s| (s - 1.0).abs() < 1e-9)
    );
}

fn accepted(world: World, camera_noise_deg: f64, count: usize) -> usize {
    (0..100)
        .filter(|&seed| {
            let sweep = Sweep { count, rows: if count >= 15 { 3 } else { 1 }, ..Sweep::default() };
            SyntheticScene::new(sweep, world, camera_noise_deg, seed).prior(&paper()).guidance.used
        })
        .count()
}

#[test]
fn the_gate_refuses_random_directions() {
    for count in 4..=15 {
        assert!(accepted(World::Random, 0.3, count) <= 1, "N = {count}");
    }
}

#[test]
fn the_gate_accepts_noisy_manhattan_scenes() {
    for count in 4..=15 {
        let passed = accepted(World::Manhattan { noise_deg: 3.0, bad_share: 0.2 }, 0.3, count);
        assert!(passed >= 95, "N = {count}: {passed}");
    }
}

#[test]
fn two_photographs_that_look_up_alike_are_guided() {
    for pitch_base_deg in [-32.0, -25.0, 30.0] {
        let world = World::Manhattan { noise_deg: 0.5, bad_share: 0.0 };
        let scene = SyntheticScene::new(Sweep { count: 2, pitch_base_deg, ..Sweep::default() }, world, 0.2, 7);
        let prior = scene.prior(&paper());
        assert!(prior.guidance.used, "{pitch_base_deg}: {:?}", prior.guidance.failed_clause);
        assert!(mean(&scene.errors_deg(&prior)) < 1.0, "{pitch_base_deg}");
    }
    assert!(accepted(World::Random, 0.3, 2) <= 2);
}

#[test]
fn gauss_newton_reaches_the_procrustes_solution() {
    let mut generator = StageContext::default().generator("procrustes", 0);
    for _ in 0..3 {
        let truth = random_rotation(&mut generator);
        let triads: Vec<Matrix3<f64>> = (0..9).map(|_| noise_rotation(2.0, &mut generator) * truth).collect();
        let start = truth * noise_rotation(3.0, &mut generator);
        let refined = dominant::refine_frame(&start, &triads, 9.0);
        let closed_form = nearest_rotation(&triads.iter().sum());
        assert!((refined - closed_form).amax() < 1e-9);
    }
}

#[test]
fn residual_is_four_times_one_minus_the_cosine_of_misorientation() {
    let turned = rotation_about_z(0.3);
    let (matched, residual) = signed_permutation::match_triad(&Matrix3::identity(), &turned);
    assert!((residual - 4.0 * (1.0 - 0.3_f64.cos())).abs() < 1e-12);
    assert!((matched - turned).amax() < 1e-12);
    let swapped = Matrix3::from_columns(&[-turned.column(2), turned.column(0).into(), turned.column(1).into()]);
    assert!((signed_permutation::match_triad(&Matrix3::identity(), &swapped).0 - turned).amax() < 1e-12);
}

/// OpenCV's wave correction for horizontal panoramas, in its own form: rg1 the least eigenvector, rg0 = rg1 x sum z.
fn wave_correction(rotations: &[Matrix3<f64>]) -> Vec<f64> {
    let rows = |row: usize| rotations.iter().map(move |rotation| rotation.row(row).transpose());
    let moment: Matrix3<f64> = rows(0).map(|x| x * x.transpose()).sum();
    let eigen = moment.symmetric_eigen();
    let mut rg1: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let mut rg0 = rg1.cross(&rows(2).sum()).normalize();
    let rg2 = rg0.cross(&rg1);
    if rows(0).map(|x| x.dot(&rg0)).sum::<f64>() < 0.0 {
        (rg0, rg1) = (-rg0, -rg1);
    }
    let correction = Matrix3::from_rows(&[rg0.transpose(), rg1.transpose(), rg2.transpose()]);
    rotations
        .iter()
        .map(|rotation| {
            let level = correction * rotation.transpose();
            level[(1, 0)].atan2(level[(1, 1)])
        })
        .collect()
}

#[test]
fn straightening_is_wave_correction() {
    for (seed, sweep) in configurations().into_iter().enumerate() {
        let scene = SyntheticScene::new(sweep, CLEAN, 0.2, 40 + seed as u64);
        let rotations: Vec<Matrix3<f64>> = scene.cameras.iter().map(Camera::rotation).collect();
        let straightened = straightening::straighten(&rotations);
        assert!(straightened.conditioned);
        for (roll, expected) in rolls(&straightened.down, &rotations).iter().zip(wave_correction(&rotations)) {
            assert!(wrap_angle(roll - expected).abs() < 1e-9);
        }
        let level = straightening::level_from_world(&straightened.down, &rotations);
        assert!((level * level.transpose() - Matrix3::identity()).amax() < 1e-9 && level.determinant() > 0.0);
    }
}

#[test]
fn one_photograph_and_parallel_photographs_have_a_finite_prior() {
    for count in [1, 2] {
        let sweep = Sweep { count, yaw_step_deg: 0.0, ..Sweep::default() };
        let mut scene = SyntheticScene::new(sweep, World::Random, 0.0, 9);
        scene.triads = vec![missing(); count];
        let prior = scene.prior(&SimilarityOptions::default());
        assert!(!prior.guidance.used && prior.guidance.failed_clause.is_some());
        assert!(prior.theta.iter().chain(&prior.scale).all(|value| value.is_finite()));
    }
}

pub(super) fn missing() -> TriadOutcome {
    TriadOutcome::Missing(crate::vanishing::MissingTriad::TooFewLines { found: 0, needed: 10 })
}

#[test]
fn a_triad_that_is_not_finite_counts_as_missing() {
    let mut scene = SyntheticScene::new(Sweep::default(), CLEAN, 0.0, 0);
    scene.triads[3] = synthetic::found(&Matrix3::from_element(f64::NAN));
    let prior = scene.prior(&paper());
    assert!(prior.guidance.used && prior.guidance.residuals[3].is_none());
    assert!(max(&scene.errors_deg(&prior)) < 1e-6);
}

#[test]
fn malformed_input_is_an_error() {
    let scene = SyntheticScene::new(Sweep::default(), CLEAN, 0.0, 0);
    let mut broken = scene.cameras.clone();
    broken[2].focal_px = f64::NAN;
    let vanishing = VanishingOptions::default();
    let input = PriorInput { cameras: &broken, ..scene.input(&vanishing) };
    let options = SimilarityOptions::default();
    assert!(run(&input, &options, &StageContext::default()).is_err());
    let nowhere = [OverlapWarp { from: 0, to: 1, vertices: Vec::new() }];
    let no_grid = PriorInput { cameras: &scene.cameras, overlaps: &nowhere, cell_px: 0.0, ..input };
    assert!(run(&no_grid, &options, &StageContext::default()).is_err());
    let empty = PriorInput { cameras: &[], triads: &[], lines: &[], frames: &[], edges: &[], ..input };
    assert!(run(&empty, &options, &StageContext::default()).is_err());
}

/// Segments for every photograph of a scene; the true cameras draw them.
pub(super) fn with_lines(mut scene: SyntheticScene, clutter: usize, noise_px: f64) -> SyntheticScene {
    let mut generator = StageContext::default().generator("lines", 0);
    scene.lines = scene
        .world_from_camera
        .iter()
        .map(|rotation| photograph_lines(&rotation.transpose(), 20, clutter, noise_px, &mut generator))
        .collect();
    scene
}

#[test]
fn joint_refinement_is_better_than_the_triads() {
    let world = World::Manhattan { noise_deg: 1.0, bad_share: 0.2 };
    let scene = with_lines(SyntheticScene::new(Sweep::default(), world, 0.0, 11), 40, 0.5);
    let joint = mean(&scene.errors_deg(&scene.prior(&SimilarityOptions::default())));
    let alone = mean(&scene.errors_deg(&scene.prior(&paper())));
    assert!(joint < 0.03 && joint < alone, "{joint} and {alone}");
}

#[test]
fn a_clear_vertical_guides_alone_and_a_faint_one_does_not() {
    let mut scene =
        with_lines(SyntheticScene::new(Sweep { count: 3, ..Sweep::default() }, World::Random, 0.0, 12), 5, 0.5);
    scene.triads = vec![missing(); 3];
    // Of the three directions the vertical's segments are kept.
    for lines in &mut scene.lines {
        lines.drain(40..60);
        lines.drain(0..20);
    }
    // The pooled search would find a frame with the same vertical first.
    let options = SimilarityOptions { pooled_search: false, ..SimilarityOptions::default() };
    let prior = scene.prior(&options);
    assert!(prior.guidance.used && prior.guidance.vertical_only);
    assert!(max(&scene.errors_deg(&prior)) < 0.2);
    for lines in &mut scene.lines {
        lines.drain(0..20);
    }
    assert!(!scene.prior(&options).guidance.used);
}

#[test]
fn the_overlap_range_takes_the_shortest_arc() {
    let range = edge_range::TurnRange::around(&[3.1, -3.1, 3.0]).expect("three turns");
    assert!((range.start - 3.0).abs() < 1e-12 && range.contains(3.12) && range.contains(-3.12));
    assert!(!range.contains(-3.0) && !range.contains(0.0));
    assert!(edge_range::TurnRange::around(&[]).is_none());
}

/// The grid vertices of one camera carried into another.
pub(super) fn overlap(scene: &SyntheticScene, from: usize, to: usize) -> OverlapWarp {
    let frame = scene.frames[from];
    let grid = trueup_core::mesh::GridMesh::regular(frame.width, frame.height, 40.0);
    let carry = |vertex| {
        let place = scene.cameras[from].transfer(&scene.cameras[to], grid.source(vertex))?;
        frame.contains(place.x, place.y).then(|| place.into())
    };
    OverlapWarp { from, to, vertices: (0..grid.len()).map(carry).collect() }
}

/// Neighbors in a row that looks 40 degrees up are twisted against each other by 13 degrees, and none is rolled for it:
/// the level sphere has the twist already.
#[test]
fn the_fallback_does_not_roll_steep_rows() {
    let sweep = Sweep { count: 2, yaw_step_deg: 20.0, pitch_base_deg: 40.0, roll_sd_deg: 2.0, ..Sweep::default() };
    let scene = SyntheticScene::new(sweep, CLEAN, 0.0, 21);
    let overlaps = [overlap(&scene, 0, 1), overlap(&scene, 1, 0)];
    let vanishing = VanishingOptions::default();
    let method = PriorMethod::Straightening;
    let input = PriorInput { method, overlaps: &overlaps, ..scene.input(&vanishing) };
    let prior = run(&input, &SimilarityOptions::default(), &StageContext::default()).expect("a well-formed scene");
    for (theta, roll) in prior.theta.iter().zip(&prior.roll) {
        assert!((theta - roll).abs() < 1e-12);
    }
}

/// Gravity that every camera of `scene` recorded, off by `noise_deg`, of cameras turned by `turn` about their axes.
fn recorded_gravity(scene: &SyntheticScene, noise_deg: f64, seed: u64) -> Vec<Option<RecordedGravity>> {
    let mut generator = StageContext::default().generator("gravity", seed);
    let of = |world_from_camera: &Matrix3<f64>| {
        let down = noise_rotation(noise_deg, &mut generator) * world_from_camera.transpose() * Vector3::y();
        Some(RecordedGravity { down: down.into(), source: GravitySource::AppleAcceleration })
    };
    scene.world_from_camera.iter().map(of).collect()
}

/// Eight photographs that look up and lean by 8 degrees, of a scene without lines: straightening is off by degrees,
/// gravity that is off by 1.5 degrees in each is not; lines that are seen outweigh both.
#[test]
fn recorded_gravity_levels_what_has_no_lines() {
    let vanishing = VanishingOptions::default();
    let sweep = Sweep { pitch_base_deg: 15.0, ..Sweep::default() };
    let (mut with, mut without, mut with_both) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..8 {
        let scene = SyntheticScene::new(sweep, World::Random, 0.0, seed);
        let gravity = recorded_gravity(&scene, 1.5, seed);
        let errors = |options: &SimilarityOptions| {
            let input = PriorInput { gravity: &gravity, ..scene.input(&vanishing) };
            let prior = run(&input, options, &StageContext::default()).expect("a well-formed scene");
            assert!(!prior.guidance.used);
            mean(&scene.errors_deg(&prior))
        };
        with.push(errors(&SimilarityOptions::default()));
        without.push(errors(&SimilarityOptions { gravity: false, ..SimilarityOptions::default() }));
        let seen = with_lines(SyntheticScene::new(sweep, CLEAN, 0.0, seed), 40, 0.3);
        let input = PriorInput { gravity: &gravity, ..seen.input(&vanishing) };
        let prior = run(&input, &SimilarityOptions::default(), &StageContext::default()).expect("a well-formed scene");
        assert!(prior.guidance.used);
        let sources: Vec<LevelSource> = prior.guidance.level.iter().map(|one| one.source).collect();
        assert_eq!(sources, [LevelSource::Lines, LevelSource::Cameras, LevelSource::Gravity]);
        with_both.push(mean(&seen.errors_deg(&prior)));
    }
    assert!(mean(&with) < 1.0 && mean(&without) > 2.0 * mean(&with), "{with:?} and {without:?}");
    assert!(mean(&with_both) < 0.25, "{with_both:?}");
}

/// All photographs lie on their sides, because a program lost their orientation: gravity stands them up, and the lines
/// of the scene make it exact.
#[test]
fn photographs_on_their_sides_are_stood_up_by_gravity() {
    let vanishing = VanishingOptions::default();
    let mut scene = SyntheticScene::new(Sweep { roll_sd_deg: 1.0, ..Sweep::default() }, CLEAN, 0.0, 4);
    let on_side = rotation_about_z(std::f64::consts::FRAC_PI_2);
    for (camera, triad) in scene.cameras.iter_mut().zip(&mut scene.triads) {
        camera.set_rotation(&(on_side * camera.rotation()));
        if let TriadOutcome::Found(triad) = triad {
            triad.camera_from_triad = rows_of(&(on_side * triad.matrix()));
        }
    }
    for (world_from_camera, roll) in scene.world_from_camera.iter_mut().zip(&mut scene.roll) {
        *world_from_camera *= on_side.transpose();
        *roll = wrap_angle(*roll - std::f64::consts::FRAC_PI_2);
    }
    let gravity = recorded_gravity(&scene, 1.0, 4);
    let input = PriorInput { gravity: &gravity, ..scene.input(&vanishing) };
    let prior = run(&input, &SimilarityOptions::default(), &StageContext::default()).expect("a well-formed scene");
    assert!(prior.guidance.used, "{:?}", prior.guidance.failed_clause);
    assert!(max(&scene.errors_deg(&prior)) < 1e-6, "{:?}", scene.errors_deg(&prior));
}

/// Lines that lean by 12 degrees in the whole scene, as a hillside's fences may, do not outvote eight sensors.
#[test]
fn lines_that_gravity_contradicts_do_not_guide() {
    let vanishing = VanishingOptions::default();
    let scene = with_lines(SyntheticScene::new(Sweep::default(), CLEAN, 0.0, 5), 40, 0.3);
    let lean = rotation_about_x(12_f64.to_radians());
    let mut leaning = scene.clone();
    for world_from_camera in &mut leaning.world_from_camera {
        *world_from_camera = lean * *world_from_camera;
    }
    let gravity = recorded_gravity(&leaning, 1.0, 5);
    let input = PriorInput { gravity: &gravity, ..scene.input(&vanishing) };
    let prior = run(&input, &SimilarityOptions::default(), &StageContext::default()).expect("a well-formed scene");
    assert!(!prior.guidance.used);
    let clause = prior.guidance.failed_clause.expect("a reason");
    assert!(clause.contains("from the one that the cameras recorded"), "{clause}");
}

#[test]
fn options_default_inside_their_ranges() {
    use trueup_core::options::StageOptions;
    assert!(SimilarityOptions::default().invalid().is_empty());
    assert!(VanishingOptions::default().invalid().is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_rolled_photograph_rolls_its_prior(turn in -0.5..0.5_f64, seed in 0_u64..100) {
        let world = World::Manhattan { noise_deg: 0.5, bad_share: 0.0 };
        let scene = SyntheticScene::new(Sweep::default(), world, 0.1, seed);
        let mut rolled = scene.clone();
        // Turning every camera about its axis leaves the world where it is.
        let about_axis = rotation_about_z(-turn);
        for (camera, triad) in rolled.cameras.iter_mut().zip(&mut rolled.triads) {
            camera.set_rotation(&(about_axis * camera.rotation()));
            if let TriadOutcome::Found(triad) = triad {
                triad.camera_from_triad = rows_of(&(about_axis * triad.matrix()));
            }
        }
        let options = SimilarityOptions { gate: GateMode::Paper, ..paper() };
        let (before, after) = (scene.prior(&options), rolled.prior(&options));
        for (theta, other) in before.theta.iter().zip(&after.theta) {
            prop_assert!(wrap_angle(other - theta - turn).abs() < 1e-6);
        }
    }

    #[test]
    fn permuted_photographs_permute_the_prior(shift in 1_usize..8, seed in 0_u64..100) {
        let world = World::Manhattan { noise_deg: 0.5, bad_share: 0.0 };
        let scene = SyntheticScene::new(Sweep::default(), world, 0.1, seed);
        let mut permuted = scene.clone();
        permuted.cameras.rotate_left(shift);
        permuted.triads.rotate_left(shift);
        for edge in &mut permuted.edges {
            edge.a = (edge.a + 8 - shift) % 8;
            edge.b = (edge.b + 8 - shift) % 8;
        }
        let (mut before, after) = (scene.prior(&paper()), permuted.prior(&paper()));
        before.theta.rotate_left(shift);
        for (theta, other) in before.theta.iter().zip(&after.theta) {
            prop_assert!(wrap_angle(other - theta).abs() < 1e-6);
        }
    }
}

#[test]
fn the_prior_is_the_same_on_one_and_two_threads() {
    let world = World::Manhattan { noise_deg: 1.0, bad_share: 0.2 };
    let scene = with_lines(SyntheticScene::new(Sweep::default(), world, 0.1, 2), 40, 0.5);
    let with_threads = |count| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a thread pool");
        pool.install(|| scene.prior(&SimilarityOptions::default()))
    };
    assert_eq!(with_threads(1), with_threads(2));
}
