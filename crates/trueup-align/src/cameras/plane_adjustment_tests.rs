//! Analytic gradients against finite differences, and cameras that are known.

use trueup_core::matches::PointMatch;
use trueup_core::source::WorkingFrame;

use super::super::intrinsics::{FreeTerms, only_focal};
use super::*;

const FRAME: WorkingFrame = WorkingFrame { width: 640.0, height: 480.0, working_from_full: 1.0 };

fn problem<'a>(priors: &'a [CameraPrior], observations: &'a Observations, may_tilt: bool) -> PlaneAdjustment<'a> {
    let count = priors.len();
    PlaneAdjustment {
        priors,
        observations,
        start_focal_px: vec![500.0; count],
        focal_sd: vec![0.3; count],
        anchor: 0,
        may_tilt,
    }
}

/// Focal length and first radial term of both photographs.
fn bending() -> IntrinsicsModel {
    let mut free: FreeTerms = only_focal();
    free[RADIAL] = true;
    IntrinsicsModel::grouped(&[0, 1], &[free; 2])
}

#[test]
fn the_gradient_by_every_unknown_matches_finite_differences() {
    let priors: Vec<CameraPrior> = [0, 1].map(|group| CameraPrior::unknown(FRAME, group)).to_vec();
    let matches = vec![
        PointMatch { in_a: [400.0, 200.0], in_b: [180.0, 260.0] },
        PointMatch { in_a: [520.0, 410.0], in_b: [300.0, 440.0] },
        PointMatch { in_a: [610.0, 30.0], in_b: [390.0, 60.0] },
    ];
    let observations = Observations { pairs: vec![PairObservations { a: 0, b: 1, matches }] };
    let problem = problem(&priors, &observations, true);
    let lens = |k1: f64| {
        let mut lens = LensState::default();
        lens.add(RADIAL, k1);
        lens
    };
    let at = PlaneParameters {
        focal_px: vec![510.0, 480.0],
        lenses: vec![lens(-0.05), lens(0.08)],
        rotations: [[0.1, -0.2, 0.0], [-0.15, 0.1, 0.3]].map(|turn| exp_rotation(&Vector3::from(turn))).to_vec(),
        axis_points: vec![Vector2::zeros(), Vector2::new(210.0, -30.0)],
        ln_distances: vec![0.0, 0.1],
    };
    let (model, huge) = (bending(), 1e9);
    let columns = observations.pairs.iter().map(|pair| problem.columns(pair, &model)).collect();
    let unknowns = 2 * OWN + model.parameters;
    let pass = Pass {
        problem: &problem,
        model: &model,
        huber_px: huge,
        pattern: NormalPattern::new(unknowns, columns).expect("little memory"),
    };
    let gradient = pass.equations(&at).expect("little memory").gradient;
    let mut moving = 0;
    for unknown in 0..unknowns {
        let shifted = |amount: f64| {
            let mut step = faer::Mat::<f64>::zeros(unknowns, 1);
            step[(unknown, 0)] = amount;
            problem.cost(&problem.moved(&at, &model, &step), &model, huge)
        };
        let step = 1e-6;
        let numeric = (shifted(step) - shifted(-step)) / (2.0 * step);
        // The cost is the sum of squares; its gradient is twice J^T r. Turning about the normal moves the pull towards
        // it by a second-order amount, which the equations leave out.
        let analytic = 2.0 * gradient[(unknown, 0)];
        assert!((numeric - analytic).abs() < 1e-2 + 1e-4 * analytic.abs(), "{unknown}: {numeric} {analytic}");
        moving += usize::from(numeric != 0.0);
    }
    // All but the anchor's turn in the plane, axis point and distance.
    assert_eq!(moving, unknowns - 4);
}

/// Three photographs of a plane by a scanner: the second lies 300 units to the right of the first and is turned by 10
/// degrees, the third 200 below at half the resolution.
#[test]
fn photographs_taken_straight_on_are_found_at_once() {
    let priors: Vec<CameraPrior> = [0; 3].map(|group| CameraPrior::unknown(FRAME, group)).to_vec();
    let middle = Vector2::new(320.0, 240.0);
    let turn = 10.0_f64.to_radians();
    // The photographs' pixels of a place on the plane, by hand.
    let seen = |photograph: usize, place: Vector2<f64>| -> [f64; 2] {
        let pixel = match photograph {
            0 => place,
            1 => {
                let aside = place - Vector2::new(300.0, 0.0);
                Vector2::new(aside.x * turn.cos() + aside.y * turn.sin(), aside.y * turn.cos() - aside.x * turn.sin())
            }
            _ => (place - Vector2::new(0.0, 200.0)) * 0.5,
        };
        (pixel + middle).into()
    };
    let places = [[120.0, 10.0], [250.0, 150.0], [180.0, 90.0], [60.0, 170.0], [140.0, 120.0]];
    let pair = |a: usize, b: usize| PairObservations {
        a,
        b,
        matches: places.map(|place| PointMatch { in_a: seen(a, place.into()), in_b: seen(b, place.into()) }).to_vec(),
    };
    let observations = Observations { pairs: vec![pair(0, 1), pair(0, 2), pair(1, 2)] };
    let problem = problem(&priors, &observations, false);
    let found = problem.straight_on(vec![LensState::default(); 3]).expect("connected").cameras(&priors);
    assert!((Vector2::from(found[1].axis_point) - Vector2::new(300.0, 0.0)).norm() < 1e-6, "{:?}", found[1]);
    assert!((Vector2::from(found[2].axis_point) - Vector2::new(0.0, 200.0)).norm() < 1e-6, "{:?}", found[2]);
    // Whose picture is turned counterclockwise stands upright by a clockwise turn.
    assert!((found[1].roll() - turn).abs() < 1e-9, "{}", found[1].roll());
    let resolutions: Vec<f64> = found.iter().map(PlaneCamera::pixels_per_unit).collect();
    for (found, expected) in resolutions.iter().zip([1.0, 1.0, 0.5]) {
        assert!((found - expected).abs() < 1e-9, "{resolutions:?}");
    }
}
