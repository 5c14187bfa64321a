//! The paper's equations on inputs small enough to be solved by hand, corrected and as printed.

use nalgebra::{Matrix3, Vector3};
use trueup_core::StageContext;
use trueup_core::camera::Camera;
use trueup_core::geometry::{rotation_about_y, rotation_about_z};
use trueup_core::matches::PointMatch;

use super::synthetic::{FOCAL_PX, SIZE, Sweep, SyntheticScene, World, found, joined};
use super::tests::overlap;
use super::*;
use crate::vanishing::VanishingOptions;
use path_voting::path_weights;
use weighted_solve::{DataTerm, TurnTerm, solve_unit_vectors};

/// What `vpg-published` fixes.
fn published() -> SimilarityOptions {
    SimilarityOptions {
        gate: GateMode::Paper,
        fallback: Fallback::Gsp3d,
        guided_redetection: false,
        joint_refinement: false,
        camera_correction: false,
        pooled_search: false,
        vertical_only: false,
        pitch_prior: 0.0,
        ..SimilarityOptions::default()
    }
}

fn as_printed(names: &str) -> PrintedEquations {
    names.parse().expect("names of equations")
}

/// Cameras that pan by 30 degrees each and are rolled by `rolls_deg`, with exact directions, joined in a row.
fn rolled_row(rolls_deg: &[f64]) -> SyntheticScene {
    let count = rolls_deg.len();
    let mut scene = SyntheticScene::new(Sweep { count, ..Sweep::default() }, World::Random, 0.0, 0);
    for (index, &roll) in rolls_deg.iter().enumerate() {
        let world_from_camera =
            rotation_about_y((30.0 * index as f64).to_radians()) * rotation_about_z(roll.to_radians());
        scene.cameras[index] = Camera::new(FOCAL_PX, SIZE.0, SIZE.1, &world_from_camera.transpose());
        scene.triads[index] = found(&world_from_camera.transpose());
    }
    scene
}

fn theta_deg(scene: &SyntheticScene, options: &SimilarityOptions, reference: usize) -> Vec<f64> {
    let vanishing = VanishingOptions::default();
    let input = PriorInput { reference, ..scene.input(&vanishing) };
    let prior = run(&input, options, &StageContext::default()).expect("a well-formed scene");
    assert!(prior.guidance.used, "{:?}", prior.guidance.failed_clause);
    prior.theta.iter().map(|theta| theta.to_degrees()).collect()
}

fn assert_close(values: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(values.len(), expected.len());
    let close = values.iter().zip(expected).all(|(value, expected)| (value - expected).abs() < tolerance);
    assert!(close, "{values:?} instead of {expected:?}");
}

/// Eq. 5 takes the world's axes from the reference camera. One that is rolled by 50 degrees has the horizontal nearest
/// to its y axis; six cameras together know better.
#[test]
fn eq_5_as_printed_depends_on_the_reference() {
    let rotations: Vec<Matrix3<f64>> = [50.0_f64, 0.0, 0.0, 0.0, 0.0, 0.0]
        .iter()
        .enumerate()
        .map(|(index, roll)| rotation_about_y((30.0 * index as f64).to_radians()) * rotation_about_z(roll.to_radians()))
        .map(|world_from_camera| world_from_camera.transpose())
        .collect();
    let frame = Matrix3::identity();
    let down = |reference: usize| vertical::vertical_by_reference(&frame, &rotations[reference]);
    // Rolled clockwise, the camera sees the world's x axis 50 degrees above its own.
    assert!((down(0) + Vector3::x()).norm() < 1e-12, "{}", down(0));
    assert!((down(1) - Vector3::y()).norm() < 1e-12, "{}", down(1));
    assert!((vertical::vertical_of(&frame, &rotations) - Vector3::y()).norm() < 1e-12);
}

/// Rolls of 5, 17 and -3 degrees: eq. 6 as printed has that of the reference for all.
#[test]
fn eq_6_as_printed_gives_all_photographs_the_roll_of_the_reference() {
    let scene = rolled_row(&[5.0, 17.0, -3.0]);
    let alone = SimilarityOptions { relative_weight: 0.0, ..published() };
    assert_close(&theta_deg(&scene, &alone, 1), &[5.0, 17.0, -3.0], 1e-6);
    let printed = SimilarityOptions { as_printed: as_printed("alpha"), ..alone };
    assert_close(&theta_deg(&scene, &printed, 1), &[17.0; 3], 1e-6);
    assert_close(&theta_deg(&scene, &printed, 2), &[-3.0; 3], 1e-6);
}

/// Two photographs whose rolls alpha are 0 and 10 degrees, weights 1 and 1/2, beta 0, lambda 10: with e = exp(10i deg),
/// 11 z0 - 10 z1 = 1 and -10 z0 + 10.5 z1 = e / 2, so that z0 = (10.5 + 5 e) / 15.5, z1 = (10 + 5.5 e) / 15.5.
#[test]
fn eq_7_and_9_weigh_rolls_against_relative_rolls() {
    let data = [(0, 0.0_f64, 1.0), (1, 10.0, 0.5)];
    let data = data.map(|(index, angle, weight)| DataTerm { index, angle: angle.to_radians(), weight });
    let turns = [TurnTerm { i: 0, j: 1, turn: 0.0, weight: 10.0 }];
    let vectors = solve_unit_vectors(2, &data, &turns).expect("determined");
    let angles: Vec<f64> = vectors.iter().map(|[u, v]| v.atan2(*u).to_degrees()).collect();
    assert_close(&angles, &[3.221_860_020, 3.545_003_795], 1e-8);
    assert!((vectors[0][0].hypot(vectors[0][1]) - 0.996_674_625).abs() < 1e-9);
}

/// In the published form the equations act: the middle one of three photographs sees directions that are rolled by 8
/// degrees against its camera, and is drawn to its neighbors the more the greater lambda is. With weights 1 and beta 0,
/// rolls 0, 8 and 0 would leave 8 / (1 + 3 lambda) degrees between them: 8, 2 and 0.26; the common vertical takes a
/// third of the 8 degrees, which a pan of 30 degrees turns into a beta of 0.36 degrees.
#[test]
fn lambda_matters_in_the_published_form() {
    let mut scene = rolled_row(&[0.0; 3]);
    scene.triads[1] = found(&(rotation_about_z(-8_f64.to_radians()) * scene.cameras[1].rotation()));
    let apart = |lambda: f64| {
        let options = SimilarityOptions { relative_weight: lambda, path_voting: false, ..published() };
        let theta = theta_deg(&scene, &options, 0);
        theta[1] - theta[0]
    };
    assert!((apart(0.0) - 8.0).abs() < 1e-6, "{}", apart(0.0));
    assert!((apart(1.0) - 2.3).abs() < 0.4, "{}", apart(1.0));
    assert!((apart(10.0) - 0.6).abs() < 0.3, "{}", apart(10.0));
}

/// On the row 0 - 1 - 2 with rolls 0, 0, 20 and beta 0: from 0, the path to 1 supports (length 1), that to 2 opposes
/// (3 + 1 - 2 = 2); from 1, one supports (1), one opposes (3); from 2, both oppose. psi = 1 / (1 + exp(-10 (x - 1/2)))
/// of x = 1/3, 1/4 and 0.
#[test]
fn eq_8_weighs_paths_by_their_lengths() {
    let rolls = [0.0_f64, 0.0, 20.0].map(|roll| Some(roll.to_radians()));
    let weights = path_weights(&rolls, &[vec![(1, 0.0)], vec![(0, 0.0), (2, 0.0)], vec![(1, 0.0)]]);
    assert_close(&weights, &[0.158_869_105, 0.075_858_180, 0.006_692_851], 1e-9);
}

/// Matches on a square of 100 px in one photograph and of 50 px in the other: eta = 2. The photograph in which they
/// span more must shrink: s = 2/3 and 4/3; as printed it is enlarged: 4/3 and 2/3.
#[test]
fn eq_10_and_11_shrink_the_photograph_in_which_matches_span_more() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]];
    let square = |side: f64, [x, y]: [f64; 2]| [10.0 + side * x, 20.0 + side * y];
    let matches = corners.map(|corner| PointMatch { in_a: square(100.0, corner), in_b: square(50.0, corner) });
    let edges = [joined(0, 1, matches.into())];
    let scales = |printed| scale::scales(&edges, &[700.0, 700.0], printed);
    assert_close(&scales(PrintedEquations::NONE), &[2.0 / 3.0, 4.0 / 3.0], 1e-12);
    assert_close(&scales(as_printed("scale")), &[4.0 / 3.0, 2.0 / 3.0], 1e-12);
}

/// Two of four photographs agree, with residuals 0.1 and 0.3: their mean over their share is 0.4, their sum over it
/// 0.8.
#[test]
fn eq_15_is_a_mean_over_the_share_of_agreeing_photographs() {
    assert!((gate::divergence(&[0.1, 0.3], 4, false) - 0.4).abs() < 1e-12);
    assert!((gate::divergence(&[0.1, 0.3], 4, true) - 0.8).abs() < 1e-12);
    assert!(gate::divergence(&[], 4, true).is_infinite());
}

/// Eq. 3 and 4 as printed fit all photographs: a wrong triad among four pulls the common vertical by degrees, where the
/// truncated cost leaves it alone.
#[test]
fn eq_3_and_4_as_printed_are_moved_by_one_wrong_photograph() {
    let mut scene = rolled_row(&[2.0, -4.0, 6.0, 0.0]);
    let tilted = trueup_core::geometry::rotation_about_x(40_f64.to_radians());
    scene.triads[0] = found(&(rotation_about_z(-30_f64.to_radians()) * tilted * scene.cameras[0].rotation()));
    let worst = |printed| {
        let options = SimilarityOptions { as_printed: printed, max_divergence: 1e3, ..published() };
        let theta = theta_deg(&scene, &options, 1);
        theta[1..].iter().zip([-4.0, 6.0, 0.0]).map(|(theta, roll)| (theta - roll).abs()).fold(0.0, f64::max)
    };
    assert!(worst(PrintedEquations::NONE) < 1e-6);
    assert!(worst(as_printed("dominant")) > 0.5);
}

/// Where the divergence is too large, the published form has the turns of GSP in three dimensions.
#[test]
fn the_published_form_falls_back_to_gsp_in_three_dimensions() {
    let sweep = Sweep { count: 6, pitch_base_deg: 25.0, ..Sweep::default() };
    let scene = SyntheticScene::new(sweep, World::Manhattan { noise_deg: 2.0, bad_share: 0.0 }, 0.0, 31);
    let overlaps: Vec<_> = scene
        .edges
        .iter()
        .flat_map(|edge| [overlap(&scene, edge.a, edge.b), overlap(&scene, edge.b, edge.a)])
        .collect();
    let vanishing = VanishingOptions::default();
    let prior = |method, options: &SimilarityOptions| {
        let input = PriorInput { method, overlaps: &overlaps, ..scene.input(&vanishing) };
        run(&input, options, &StageContext::default()).expect("a well-formed scene")
    };
    assert!(prior(PriorMethod::VanishingPoints, &published()).guidance.used);
    // Far less than directions that are wrong by 2 degrees diverge by.
    let strict = SimilarityOptions { max_divergence: 1e-6, ..published() };
    let fallen = prior(PriorMethod::VanishingPoints, &strict);
    assert!(!fallen.guidance.used && fallen.guidance.failed_clause.is_some());
    assert_eq!(fallen.theta, prior(PriorMethod::Gsp3d, &strict).theta);
    let straightened = SimilarityOptions { fallback: Fallback::Straightening, ..strict };
    assert_ne!(fallen.theta, prior(PriorMethod::VanishingPoints, &straightened).theta);
}

/// Relative rolls have the opposite sign in print: cameras rolled by 5 and 17 degrees ask for 12 degrees from one to
/// the other.
#[test]
fn the_printed_relative_roll_turns_neighbors_the_wrong_way() {
    let mut scene = rolled_row(&[5.0, 17.0]);
    // Without pan the twist is all there is.
    for (camera, roll) in scene.cameras.iter_mut().zip([5.0_f64, 17.0]) {
        camera.set_rotation(&rotation_about_z(-roll.to_radians()));
    }
    scene.triads = [5.0_f64, 17.0].map(|roll| found(&rotation_about_z(-roll.to_radians()))).to_vec();
    let turned = |beta_mode| {
        let options = SimilarityOptions { beta_mode, path_voting: false, relative_weight: 1e5, ..published() };
        let theta = theta_deg(&scene, &options, 0);
        theta[1] - theta[0]
    };
    assert!((turned(BetaMode::World) - 12.0).abs() < 1e-6);
    assert!((turned(BetaMode::Relative) - 12.0).abs() < 1e-6);
    assert!((turned(BetaMode::Printed) + 12.0).abs() < 1e-2);
}
