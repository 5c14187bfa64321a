//! What edges that are to be straight tell of lenses.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::rows_of;

use super::*;

/// What these cameras show of a scene of straight edges, off by `noise_px`: a lattice of lines at depth 1 before the
/// first.
fn edges(cameras: &[Camera], noise_px: f64) -> Vec<Vec<EdgeCurve>> {
    let mut generator = StageContext::default().generator("edges", 1);
    let mut noise = move || noise_px * ((0..12).map(|_| generator.random::<f64>()).sum::<f64>() - 6.0);
    let mut of_camera = |camera: &Camera| {
        let line = |number: i32, upright: bool| {
            let offset = 0.12 * f64::from(number) - 0.6;
            let place = |k: i32| {
                let along = 0.05 * f64::from(k) - 0.6;
                let [x, y] = if upright { [offset + 0.02 * along, along] } else { [along, offset - 0.03 * along] };
                let pixel = camera.project(Vector3::new(x, y, 1.0)).expect("in front");
                frame().contains(pixel.x, pixel.y).then_some([pixel.x, pixel.y])
            };
            EdgeCurve { places: (0..=24).filter_map(place).collect() }
        };
        let lines = (0..=10).flat_map(|number| [line(number, true), line(number, false)]);
        let mut lines: Vec<EdgeCurve> = lines.filter(|line| line.places.len() >= 6).collect();
        lines.iter_mut().flat_map(|line| &mut line.places).for_each(|place| {
            *place = place.map(|coordinate| coordinate + noise());
        });
        lines
    };
    cameras
        .iter()
        .map(|camera| of_camera(&Camera { camera_from_world: rows_of(&Matrix3::identity()), ..*camera }))
        .collect()
}

fn of_a_pair(truth: &[Camera], curves: &[Vec<EdgeCurve>]) -> (Cameras, Vec<String>) {
    let pairs = matched(truth, 0.3, 0.0);
    let curves: Vec<&[EdgeCurve]> = curves.iter().map(Vec::as_slice).collect();
    let input = CameraInput {
        priors: &[CameraPrior::unknown(frame(), 0); 2],
        pairs: &pairs,
        curves: &curves,
        lines: &[],
        reference: 0,
    };
    let found =
        StageContext::default().gather(|context| run(&input, &CameraOptions::default(), context)).expect("solvable");
    (found.value, found.findings.into_iter().map(|finding| finding.code).collect())
}

/// Two photographs' matches tell no lens; their edges do, and with it the focal length is right.
#[test]
fn straight_edges_tell_the_lens_of_a_pair() {
    let truth = bent(row(ROLLS)[..2].to_vec(), [-0.08, 0.015, 0.0, 0.0], [0.0; 2]);
    let (cameras, findings) = of_a_pair(&truth, &edges(&truth, 0.1));
    assert!(findings.is_empty(), "{findings:?}");
    let corner = Vector3::new(0.6, 0.45, 1.0);
    for (camera, truth) in cameras.cameras.iter().zip(&truth) {
        let [seen, wanted] =
            [camera, truth].map(|camera| camera.lens.place(corner).expect("in front") * camera.focal_px);
        assert!((seen - wanted).norm() < 3.0 && (camera.focal_px / 650.0).ln().abs() < 0.01, "{camera:?}");
    }
    assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.15);
}

/// A pinhole's edges say that it is one; without edges nothing is known, and that is said.
#[test]
fn a_pinhole_stays_one_and_doubt_is_said() {
    let truth = row(ROLLS)[..2].to_vec();
    let (cameras, findings) = of_a_pair(&truth, &edges(&truth, 0.1));
    assert!(cameras.cameras.iter().all(|camera| camera.lens.is_pinhole()) && findings.is_empty(), "{findings:?}");
    let (without, findings) = of_a_pair(&truth, &[Vec::new(), Vec::new()]);
    assert_eq!(findings, ["lens-uncertain"]);
    assert_eq!(without.cameras, cameras.cameras);
}

/// Round things alone, each as round as it likes, make no lens.
#[test]
fn what_is_round_in_the_scene_makes_no_lens() {
    let truth = row(ROLLS)[..2].to_vec();
    let mut curves = edges(&truth, 0.1);
    for (number, curve) in curves.iter_mut().flatten().enumerate() {
        let (middle, count) = (curve.places.len() as f64 / 2.0, curve.places.len() as f64);
        let bend_px = 3.0 * (number as f64 * 1.7).sin();
        for (k, place) in curve.places.iter_mut().enumerate() {
            let rise = bend_px * (1.0 - ((k as f64 - middle) / (0.5 * count)).powi(2));
            *place = [place[0] + rise, place[1] + rise];
        }
    }
    let (cameras, _) = of_a_pair(&truth, &curves);
    assert!(cameras.cameras.iter().all(|camera| camera.lens.is_pinhole()), "{:?}", cameras.cameras[0].lens);
}
