//! Focal lengths of a photographer who went a step aside.

use super::super::intrinsics::{FOCAL, LensState, RADIAL, only_focal};
use super::super::observations::{MATCHES_PER_PAIR, Observations};
use super::super::straightness::CurveObservations;
use super::super::tests::{ROLLS, bent, joined, matched, row};
use super::super::{CameraInput, run};
use super::*;
use nalgebra::{Matrix3, Vector3};
use trueup_core::camera::{Camera, INTRINSICS};
use trueup_core::geometry::rotation_about_y;
use trueup_core::lines::LineSegment;
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::source::WorkingFrame;

const FRAME: WorkingFrame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
const FOCAL_PX: f64 = 660.0;

/// Two photographs 15 degrees apart.
fn cameras(focal_px: f64) -> [Camera; 2] {
    [0.0_f64, 15.0]
        .map(|yaw| Camera::new(focal_px, FRAME.width, FRAME.height, &rotation_about_y(yaw.to_radians()).transpose()))
}

/// A wall 4 m away, whose parts stand out by up to 0.2 m, in two photographs; the second from so many meters to the
/// right.
fn pair(focal_px: f64, step_m: f64) -> PairMatches {
    let cameras = cameras(focal_px);
    let mut inliers = Vec::new();
    for k in 0..400 {
        let share = |step: f64| (f64::from(k) * step).fract();
        let place =
            Vector3::new(5.0 * share(0.618_034) - 1.5, 3.6 * share(0.754_877) - 1.8, 4.0 - 0.2 * share(0.414_213));
        let seen = |camera: &Camera, from: Vector3<f64>| camera.project(camera.rotation() * (place - from));
        let (a, b) = (seen(&cameras[0], Vector3::zeros()), seen(&cameras[1], Vector3::new(step_m, 0.0, 0.0)));
        if let (Some(a), Some(b)) = (a, b)
            && FRAME.contains(a.x, a.y)
            && FRAME.contains(b.x, b.y)
        {
            inliers.push(PointMatch { in_a: a.into(), in_b: b.into() });
        }
    }
    joined(0, 1, inliers)
}

/// The relative focal length that comes out, and the codes of what is said.
fn found(step_m: f64, recorded_px: Option<f64>) -> (f64, Vec<String>) {
    let priors = [CameraPrior { focal_px: recorded_px, ..CameraPrior::unknown(FRAME, 0) }; 2];
    let context = StageContext::default();
    let input =
        CameraInput { priors: &priors, pairs: &[pair(FOCAL_PX, step_m)], curves: &[], lines: &[], reference: 0 };
    let cameras = run(&input, &CameraOptions::default(), &context).expect("solvable").cameras;
    (cameras[0].focal_px / FOCAL_PX, context.findings().into_iter().map(|finding| finding.code.to_string()).collect())
}

#[test]
fn a_step_aside_leaves_the_recorded_focal_length() {
    let (from_one_place, said) = found(0.0, Some(600.0));
    assert!(
        (from_one_place - 1.0).abs() < 1e-3 && !said.contains(&"focal-expected".to_owned()),
        "{from_one_place} {said:?}"
    );
    let (recorded, said) = found(0.6, Some(FOCAL_PX));
    assert!((recorded - 1.0).abs() < 0.1, "{recorded}");
    assert!(said.contains(&"focal-expected".to_owned()), "{said:?}");
}

/// Edges of houses that stand aslant, in the same two photographs.
fn edges(focal_px: f64, step_m: f64) -> Vec<Vec<LineSegment>> {
    let directions = rotation_about_y(35_f64.to_radians());
    let steps = [0.0, step_m].map(|step_m| Vector3::new(step_m, 0.0, 0.0));
    let of_photograph = |(camera, from): (Camera, Vector3<f64>)| {
        let share = |k: usize, step: f64| (k as f64 * step).fract();
        let edges = (0..90).filter_map(|k| {
            let middle = Vector3::new(
                7.0 * share(k, 0.618_034) - 2.5,
                4.0 * share(k, 0.754_877) - 2.0,
                5.0 + 3.0 * share(k, 0.569_840),
            );
            let along = directions.column(k % 3) * 0.5;
            let seen = |place: Vector3<f64>| camera.project(camera.rotation() * (place - from));
            let (start, end) = (seen(middle - along)?, seen(middle + along)?);
            let is_inside = FRAME.contains(start.x, start.y) && FRAME.contains(end.x, end.y);
            is_inside.then(|| LineSegment { start: start.into(), end: end.into(), width_px: 2.0, significance: 3.0 })
        });
        edges.collect()
    };
    cameras(focal_px).into_iter().zip(steps).map(of_photograph).collect()
}

/// Of a lens twice as long as is usual, the step aside, which tells nothing, leaves the usual one; edges at right
/// angles do not.
#[test]
fn lines_tell_a_focal_length_that_a_step_aside_leaves_open() {
    let focal_px = 1300.0;
    let found = |lines: &[Vec<LineSegment>]| {
        let priors = [CameraPrior::unknown(FRAME, 0); 2];
        let input = CameraInput { priors: &priors, pairs: &[pair(focal_px, 0.6)], curves: &[], lines, reference: 0 };
        let context = StageContext::default();
        let cameras = run(&input, &CameraOptions::default(), &context).expect("solvable").cameras;
        (cameras[0].focal_px / focal_px).ln()
    };
    let (without, with) = (found(&[]), found(&edges(focal_px, 0.6)));
    assert!(without.abs() > 0.2 && with.abs() < 0.05, "{without} {with}");
}

#[test]
fn a_step_aside_leaves_a_usual_focal_length_where_none_is_recorded() {
    let priors = [CameraPrior::unknown(FRAME, 0); 2];
    let observations = Observations::choose(&priors, &[&pair(FOCAL_PX, 0.6)], MATCHES_PER_PAIR);
    let problem = BundleAdjustment {
        priors: &priors,
        observations: &observations,
        curves: &CurveObservations::default(),
        start_focal_px: vec![FOCAL_PX; 2],
        reference: 0,
        focal_sd: vec![0.3; 2],
    };
    let start = Parameters {
        focal_px: vec![FOCAL_PX; 2],
        rotations: vec![Matrix3::identity(), rotation_about_y(0.2).transpose()],
        lenses: vec![Default::default(); 2],
    };
    let context = StageContext::default();
    let shared = IntrinsicsModel::shared(&priors);
    let by_matches = problem.minimize(start, &shared, FINE_HUBER_PX, &context).expect("solvable");
    let expected =
        expected(&problem, &by_matches, &shared, &[], &CameraOptions::default(), &context).expect("solvable");
    let expected = expected.expect("the wall leaves it open");
    // 0.85 of 800 px.
    let off = |focal_px: f64| (focal_px / 680.0).ln().abs();
    let (before, after) = (off(by_matches.focal_px[0]), off(expected.parameters.focal_px[0]));
    assert!(before > 0.2 && after < 0.6 * before, "{before} {after}");
    assert!((expected.parameters.focal_px[0] / by_matches.focal_px[0] / expected.opened.factor - 1.0).abs() < 1e-12);
}

/// By hand: twice as long as expected is ln 2 = 0.693; with a deviation of 0.4, (0.693 / 0.4)^2 = 3.003, and half as
/// long again nothing.
#[test]
fn what_is_expected_falls_off_as_a_bell() {
    let expectation = Expectation { off: 2.0_f64.ln(), sd: 0.4, is_recorded: false };
    assert!((expectation.improbable(0.0) - 3.003).abs() < 1e-3);
    assert!(expectation.improbable(0.5_f64.ln()).abs() < 1e-12);
}

/// By hand: a witness of four errors' worth, (0.693 / 0.1)^2 = 48.05 off, makes 4 ln(1 + 48.05 / 4) = 10.26 improbable;
/// one that is off by little, its square.
#[test]
fn what_metadata_say_may_be_wrong_altogether() {
    let expectation = Expectation { off: 2.0_f64.ln(), sd: 0.1, is_recorded: true };
    assert!((expectation.improbable(0.0) - 10.263).abs() < 1e-3);
    assert!((tailed(1e-3) - 1e-3).abs() < 1e-6 && tailed(0.0) == 0.0);
}

/// Photographs from one place whose features are a little worse than most: the recorded focal length, 40 % too long, is
/// not even asked.
#[test]
fn sure_matches_are_left_alone() {
    let truth = row(ROLLS)[..4].to_vec();
    let priors = [CameraPrior { focal_px: Some(910.0), ..CameraPrior::unknown(FRAME, 0) }; 4];
    let pairs = matched(&truth, 0.6, 0.0);
    let observations = Observations::choose(&priors, &pairs.iter().collect::<Vec<_>>(), MATCHES_PER_PAIR);
    let problem = BundleAdjustment {
        priors: &priors,
        observations: &observations,
        curves: &CurveObservations::default(),
        start_focal_px: vec![650.0; 4],
        reference: 0,
        focal_sd: vec![1.0; 4],
    };
    let start = Parameters {
        focal_px: vec![650.0; 4],
        rotations: truth.iter().map(|camera| camera.rotation() * truth[0].rotation().transpose()).collect(),
        lenses: vec![LensState::default(); 4],
    };
    let (context, shared, options) =
        (StageContext::default(), IntrinsicsModel::shared(&priors), CameraOptions::default());
    let found = problem.minimize(start, &shared, FINE_HUBER_PX, &context).expect("solvable");
    let expectation = Expectation::of(&priors, &found, &options);
    assert!(FocalSearch::new(&problem, &found, &shared, &expectation, &context).is_some(), "worse than features");
    let asked = expected(&problem, &found, &shared, &[], &options, &context).expect("solvable");
    assert!(asked.is_none());
}

/// Three photographs through a lens that bends, twice as far off as features: 8 % aside of the focal length, another
/// lens makes their matches meet better than the same one.
#[test]
fn lenses_are_refined_anew_at_each_focal_length() {
    let truth = bent(row(ROLLS)[..3].to_vec(), [-0.08, 0.0, 0.0, 0.0], [0.0; 2]);
    let pairs = matched(&truth, 0.6, 0.0);
    let priors = [CameraPrior::unknown(FRAME, 0); 3];
    let observations = Observations::choose(&priors, &pairs.iter().collect::<Vec<_>>(), MATCHES_PER_PAIR);
    let problem = BundleAdjustment {
        priors: &priors,
        observations: &observations,
        curves: &CurveObservations::default(),
        start_focal_px: vec![650.0; 3],
        reference: 0,
        focal_sd: vec![1.0; 3],
    };
    let context = StageContext::default();
    let lens = LensState { terms: truth[0].lens.terms(), ..LensState::default() };
    let found = Parameters {
        focal_px: vec![650.0; 3],
        rotations: truth.iter().map(|camera| camera.rotation() * truth[0].rotation().transpose()).collect(),
        lenses: vec![lens; 3],
    };
    let bending = |free: [bool; INTRINSICS]| IntrinsicsModel::grouped(&[0; 3], &[free]);
    let cost_aside = |model: &IntrinsicsModel| {
        let expectation = Expectation::of(&priors, &found, &CameraOptions::default());
        let search = FocalSearch::new(&problem, &found, model, &expectation, &context).expect("worse than features");
        let aside = search.candidate(STEP, &found).expect("solvable");
        assert!(((aside.parameters.focal_px[0] / 650.0).ln() - STEP).abs() < 1e-12);
        (problem.fine_costs(&aside.parameters)[0], aside.parameters.lenses[0].terms.radial[0])
    };
    let with_lens = bending(std::array::from_fn(|term| term == FOCAL || term == RADIAL));
    let ((anew, k1), (held, same)) = (cost_aside(&with_lens), cost_aside(&bending(only_focal())));
    assert!(anew < 0.9 * held && k1 != same, "{anew} {held} {k1}");
}

/// Told 660 px where matches say 1320, beside one with 1320 recorded and one of which nothing is known: what is told
/// alone is asked, to 2 %.
#[test]
fn what_is_told_of_one_photograph_is_expected_of_all() {
    let unknown = CameraPrior::unknown(FRAME, 0);
    let recorded = CameraPrior { focal_px: Some(1320.0), ..unknown };
    let told = CameraPrior { focal_px: Some(660.0), focal_told: true, ..unknown };
    let found = Parameters {
        focal_px: vec![1320.0; 3],
        rotations: vec![Matrix3::identity(); 3],
        lenses: vec![Default::default(); 3],
    };
    let expectation = |priors: &[CameraPrior]| Expectation::of(priors, &found, &CameraOptions::default());
    let of_all = expectation(&[unknown, recorded, told]);
    assert!((of_all.off - 2.0_f64.ln()).abs() < 1e-12 && (of_all.sd - 0.02).abs() < 1e-12, "{of_all:?}");
    let without = expectation(&[unknown, recorded, unknown]);
    assert!(without.off.abs() < 1e-12 && (without.sd - 0.1).abs() < 1e-12, "{without:?}");
}
