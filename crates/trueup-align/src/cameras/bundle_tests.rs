//! Analytic gradients against finite differences.

use trueup_core::lens::{LensProjection, LensTerms};
use trueup_core::matches::PointMatch;
use trueup_core::source::WorkingFrame;

use super::*;

const FRAME: WorkingFrame = WorkingFrame { width: 640.0, height: 480.0, working_from_full: 1.0 };

/// Every unknown but the reference photograph's rotation, at two photographs of these lenses.
fn check_gradient(model: &IntrinsicsModel, lenses: Vec<LensState>) {
    let priors: Vec<CameraPrior> = [0, 1].map(|group| CameraPrior::unknown(FRAME, group)).to_vec();
    let matches = vec![
        PointMatch { in_a: [400.0, 200.0], in_b: [180.0, 260.0] },
        PointMatch { in_a: [520.0, 410.0], in_b: [300.0, 440.0] },
    ];
    let observations = Observations { pairs: vec![PairObservations { a: 0, b: 1, matches }] };
    let problem = BundleAdjustment {
        priors: &priors,
        observations: &observations,
        curves: &CurveObservations::default(),
        start_focal_px: vec![500.0, 520.0],
        reference: 0,
        focal_sd: vec![0.1, 0.3],
    };
    let at = Parameters {
        focal_px: vec![510.0, 505.0],
        rotations: vec![Matrix3::identity(), exp_rotation(&Vector3::new(0.05, -0.35, 0.1))],
        lenses,
    };
    let huge = 1e9;
    let pattern = problem.pattern::<LENS_LOCAL>(model).expect("little memory");
    let gradient = match at.has_lens() || model.has_lens() {
        true => problem.normal_equations(&at, model, huge, &pattern).expect("little memory").gradient,
        false => {
            let pattern = problem.pattern::<PINHOLE_LOCAL>(model).expect("little memory");
            problem.normal_equations(&at, model, huge, &pattern).expect("little memory").gradient
        }
    };
    for unknown in 3..problem.unknowns(model) {
        let shifted = |amount: f64| {
            let mut step = faer::Mat::<f64>::zeros(problem.unknowns(model), 1);
            step[(unknown, 0)] = amount;
            problem.cost::<LENS_LOCAL>(&problem.moved(&at, model, &step), model, huge)
        };
        let step = 1e-6;
        let numeric = (shifted(step) - shifted(-step)) / (2.0 * step);
        // The cost is the sum of squares; its gradient is twice J^T r.
        let analytic = 2.0 * gradient[(unknown, 0)];
        assert!((numeric - analytic).abs() < 1e-4 * (1.0 + analytic.abs()), "{unknown}: {numeric} {analytic}");
    }
}

#[test]
fn gradient_matches_finite_differences() {
    check_gradient(&IntrinsicsModel::per_photograph(2), vec![LensState::default(); 2]);
}

/// Once with lenses of their own, once with a common one.
#[test]
fn the_gradient_by_every_term_of_a_lens_matches_finite_differences() {
    for projection in [LensProjection::Rectilinear, LensProjection::Equidistant] {
        let lens = |k1: f64| LensState {
            terms: LensTerms { projection, radial: [k1, 0.02, -0.01, 0.002], tangential: [1e-3, -2e-3] },
            center_px: [4.0, -3.0],
        };
        check_gradient(&IntrinsicsModel::grouped(&[0, 1], &[[true; INTRINSICS]; 2]), vec![lens(-0.1), lens(0.05)]);
        check_gradient(&IntrinsicsModel::grouped(&[0, 0], &[[true; INTRINSICS]; 1]), vec![lens(-0.1); 2]);
    }
}

/// Two photographs of focal length 500 that turned by 0.35 about the vertical, behind matches on a grid: `error_px` is
/// how far each is displaced sideways in b. The adjusted focal length before and after the sharp pass.
fn sharpened_focal_px(error_px: impl Fn(usize) -> f64) -> [f64; 2] {
    let priors: Vec<CameraPrior> = vec![CameraPrior::unknown(FRAME, 0); 2];
    let turn = exp_rotation(&Vector3::new(0.0, -0.35, 0.0));
    let cameras = [priors[0].unturned_camera(500.0), priors[1].camera(500.0, &turn)];
    let places =
        (0..20).flat_map(|row| (0..20).map(move |column| [205.0 + 21.0 * column as f64, 20.0 + 22.0 * row as f64]));
    let seen = places.filter_map(|in_a| {
        let in_b = cameras[0].transfer(&cameras[1], in_a.into()).filter(|at| FRAME.contains(at.x, at.y))?;
        Some(PointMatch { in_a, in_b: in_b.into() })
    });
    let displaced =
        |(k, one): (usize, PointMatch)| PointMatch { in_b: [one.in_b[0] + error_px(k), one.in_b[1]], ..one };
    let matches: Vec<PointMatch> = seen.enumerate().map(displaced).collect();
    assert!(matches.len() > 150, "{}", matches.len());
    let observations = Observations { pairs: vec![PairObservations { a: 0, b: 1, matches }] };
    let problem = BundleAdjustment {
        priors: &priors,
        observations: &observations,
        curves: &CurveObservations::default(),
        start_focal_px: vec![500.0; 2],
        reference: 0,
        focal_sd: vec![0.3; 2],
    };
    let start = Parameters {
        focal_px: vec![500.0; 2],
        rotations: vec![Matrix3::identity(), turn],
        lenses: vec![LensState::default(); 2],
    };
    let (model, context) = (IntrinsicsModel::shared(&priors), StageContext::default());
    let fine = problem.minimize(start, &model, FINE_HUBER_PX, &context).expect("not cancelled");
    let sharp = problem.sharpened(fine.clone(), &model, &context).expect("not cancelled");
    [fine, sharp].map(|parameters| parameters.focal_px[0])
}

/// Of every ten matches three lie up to 1.9 px aside, the more the farther down the list, the others 0.1 px to and fro:
/// nearly normal errors with a long tail. The sharp pass is at least twice as near to the true focal length.
#[test]
fn long_tails_hardly_move_what_the_sharp_pass_finds() {
    let [fine, sharp] = sharpened_focal_px(|k| match k % 10 {
        0 | 3 | 7 if k % 4 != 0 => 1.9,
        even if even % 2 == 0 => 0.1,
        _ => -0.1,
    });
    assert!((sharp - 500.0).abs() < 0.5 * (fine - 500.0).abs(), "{fine} {sharp}");
}

/// Where most matches are farther off than the fine limit, parallax sets them apart: nothing is changed.
#[test]
fn parallax_is_not_sharpened() {
    let [fine, sharp] = sharpened_focal_px(|k| if k % 2 == 0 { 6.0 } else { -6.0 });
    assert_eq!(fine, sharp);
}
