use nalgebra::Matrix3;
use trueup_core::lens::{Lens, LensTerms};

use super::*;

fn camera(k1: f64) -> Camera {
    let lens = Lens::new(LensTerms { radial: [k1, 0.0, 0.0, 0.0], ..LensTerms::default() });
    Camera { lens, ..Camera::new(650.0, 800.0, 600.0, &Matrix3::identity()) }
}

/// What `camera` shows of straight lines: x = a + b y and y = a + b x at depth 1.
fn seen(camera: &Camera) -> Vec<EdgeCurve> {
    let ends = [(-0.45, 0.1), (-0.2, -0.2), (0.1, 0.05), (0.4, 0.3)];
    let curve = |(offset, slope): (f64, f64), upright: bool| {
        let place = |k: i32| {
            let along = 0.4 * (f64::from(k) / 8.0 - 1.0);
            let across = offset + slope * along;
            let ray = if upright { Vector3::new(across, along, 1.0) } else { Vector3::new(along, across, 1.0) };
            camera.project(ray).expect("in front").into()
        };
        EdgeCurve { places: (0..=16).map(place).collect() }
    };
    ends.iter().flat_map(|&end| [curve(end, true), curve(end, false)]).collect()
}

/// By hand: at depth 1 and k1 = -0.1 the line y = 0.4 is seen at 0.4 (1 - 0.1 (x^2 + 0.16)), a parabola over x = -0.4
/// to 0.4 that is off its mean by 0.4 * 0.1 * 0.16 sqrt(4 / 45) in the mean square: 1.24 px.
#[test]
fn a_line_is_straight_through_its_lens_and_bent_without() {
    let line = seen(&camera(-0.1)).remove(7);
    let line = EdgeCurve { places: line.places.iter().map(|place| [place[0], place[1]]).collect() };
    let rms = |camera: &Camera| linearized(camera, &line).expect("a plane").0.mean_square().sqrt();
    assert!(rms(&camera(-0.1)) < 1e-6);
    // The line is y = 0.4 + 0.3 x here, bent by nearly as much.
    assert!((0.9..1.6).contains(&rms(&camera(0.0))), "{}", rms(&camera(0.0)));
}

#[test]
fn distances_change_with_the_lens_as_their_derivatives_say() {
    let at = camera(-0.09);
    for curve in seen(&camera(-0.1)) {
        let (plane, jacobian) = linearized(&at, &curve).expect("a plane");
        let step = 1e-4;
        let [before, after] = [-step, step].map(|step| linearized(&camera(-0.09 + step), &curve).expect("a plane").0);
        // The sense of a normal is anyone's.
        let alike = |one: &Plane| one.distances_px.clone() * one.normal.dot(&plane.normal).signum();
        let numeric = (alike(&after) - alike(&before)) / (2.0 * step);
        let analytic = DVector::from_iterator(jacobian.len(), jacobian.iter().map(|row| row[3]));
        assert!((&numeric - &analytic).norm() < 0.02 * numeric.norm() + 1e-3, "{numeric} {analytic}");
    }
}

/// A step of Gauss and Newton from a pinhole, with the weights of straight edges, comes most of the way to the lens.
/// Twenty directions within a thousandth of the plane across (2, -1, 2) / 3.
#[test]
fn the_flattest_direction_is_found() {
    let normal = Vector3::new(2.0, -1.0, 2.0) / 3.0;
    let (one, other) =
        (Vector3::new(1.0, 2.0, 0.0).normalize(), normal.cross(&Vector3::new(1.0, 2.0, 0.0).normalize()));
    let ray = |k: i32| {
        let angle = 0.02 * f64::from(k);
        one * angle.cos() + other * angle.sin() + normal * (1e-3 * f64::from(k * k % 3 - 1))
    };
    let scatter = (0..20).map(|k| ray(k) * ray(k).transpose()).sum::<Matrix3<f64>>();
    let found = flattest(&scatter).expect("finite");
    let eigen = scatter.symmetric_eigen();
    let expected = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    assert!(found.cross(&expected).norm() < 1e-9 && found.cross(&normal).norm() < 0.02, "{found} {expected}");
    assert_eq!(flattest(&Matrix3::repeat(f64::NAN)), None);
    assert_eq!(flattest(&Matrix3::zeros()), None);
}

#[test]
fn edges_tell_the_lens() {
    let cluster = CurveCluster { photograph: 0, curves: seen(&camera(-0.1)) };
    let mut k1 = 0.0;
    for _ in 0..4 {
        let term = CurveTerm::new(&[camera(k1)], &cluster, 20.0);
        k1 -= term.gradient[3] / term.normal[(3, 3)];
    }
    assert!((k1 + 0.1).abs() < 1e-4, "{k1}");
    let cost = |k1: f64| curve_cost(&[camera(k1)], &cluster, 20.0);
    assert!(cost(k1) < 1e-3 * cost(0.0), "{} {}", cost(k1), cost(0.0));
    // A focal length is not told by pinholes.
    let straight = CurveCluster { photograph: 0, curves: seen(&camera(0.0)) };
    let term = CurveTerm::new(&[camera(0.0)], &straight, 20.0);
    assert!(term.normal[(0, 0)] < 1e-12 * term.normal[(3, 3)]);
}

#[test]
fn edges_of_one_part_of_a_photograph_are_together() {
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let seen = seen(&camera(0.0));
    let found = CurveObservations::new([frame, frame].into_iter(), &[&[], &seen]);
    assert!(found.clusters.len() > 3 && found.clusters.iter().all(|cluster| cluster.photograph == 1));
    assert_eq!(found.clusters.iter().map(|cluster| cluster.curves.len()).sum::<usize>(), seen.len());
}

/// Lists of 4, 1 and 3 entries: of five, the first turn takes three and the second two.
#[test]
fn lists_are_kept_in_turns() {
    let lists = || vec![vec!['a', 'b', 'c', 'd'], vec!['e'], vec!['f', 'g', 'h']];
    let kept = |limit: usize| {
        let mut lists = lists();
        keep_in_turns(&mut lists, limit);
        lists
    };
    assert_eq!(kept(5), [vec!['a', 'b'], vec!['e'], vec!['f', 'g']]);
    assert_eq!(kept(2), [vec!['a'], vec!['e'], vec![]]);
    assert_eq!(kept(8), lists());
    assert_eq!(kept(100), lists());
}
