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
