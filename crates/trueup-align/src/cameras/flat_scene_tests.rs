//! What is taken for flat, on synthetic photographs with known cameras.

use crate::cameras::tests::joined;
use nalgebra::Matrix3;
use rand::RngExt;
use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};
use trueup_core::lens::{Lens, LensProjection, LensTerms};
use trueup_core::matches::PointMatch;
use trueup_core::source::WorkingFrame;

use super::super::{CameraInput, Cameras, run};
use super::*;

const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 600.0;
/// 60 degrees across.
const FOCAL: f64 = 692.8;

fn before(tilt_deg: [f64; 3], axis_point: [f64; 2], distance: f64) -> PlaneCamera {
    let [x, y, z] = tilt_deg.map(f64::to_radians);
    let turn: Matrix3<f64> = rotation_about_z(z) * rotation_about_x(x) * rotation_about_y(y);
    PlaneCamera { camera: Camera::new(FOCAL, WIDTH, HEIGHT, &turn), axis_point, distance }
}

/// Five photographs along a wall, half a photograph apart, with hands that shake.
fn mural() -> Vec<PlaneCamera> {
    let tilts = [[3.0, -6.0, 1.0], [-5.0, 4.0, -2.0], [2.0, 8.0, 0.5], [6.0, -3.0, 2.0], [-4.0, 5.0, -1.0]];
    let distances = [700.0, 650.0, 720.0, 690.0, 740.0];
    (0..5).map(|k| before(tilts[k], [390.0 * k as f64, 30.0 * (k % 2) as f64], distances[k])).collect()
}

/// Matches between all photographs that overlap, with noise of half a pixel, by where `transfer` has a pixel of one in
/// another.
fn matched(count: usize, transfer: impl Fn(usize, usize, Vector2<f64>) -> Option<Vector2<f64>>) -> Vec<PairMatches> {
    let context = StageContext::default();
    let mut pairs = Vec::new();
    for a in 0..count {
        for b in a + 1..count {
            let mut generator = context.generator("flat scene test", (a * count + b) as u64);
            let mut noise = || 0.5 * ((0..12).map(|_| generator.random::<f64>()).sum::<f64>() - 6.0);
            let mut inliers = Vec::new();
            for k in 0..400 {
                let source = Vector2::new(
                    (f64::from(k) * 0.618_034).fract() * WIDTH,
                    (f64::from(k) * 0.754_877).fract() * HEIGHT,
                );
                let Some(target) = transfer(a, b, source) else { continue };
                if (0.0..WIDTH).contains(&target.x) && (0.0..HEIGHT).contains(&target.y) {
                    inliers.push(PointMatch {
                        in_a: [source.x + noise(), source.y + noise()],
                        in_b: [target.x + noise(), target.y + noise()],
                    });
                }
            }
            if inliers.len() >= 40 {
                pairs.push(joined(a, b, inliers));
            }
        }
    }
    pairs
}

fn found(pairs: &[PairMatches], count: usize, focal_px: Option<f64>, scene: SceneModel) -> Cameras {
    let frame = WorkingFrame { width: WIDTH, height: HEIGHT, working_from_full: 1.0 };
    let priors = vec![CameraPrior { focal_px, ..CameraPrior::unknown(frame, 0) }; count];
    let options = CameraOptions { scene, ..CameraOptions::default() };
    run(
        &CameraInput { priors: &priors, pairs, curves: &[], lines: &[], reference: 0 },
        &options,
        &StageContext::default(),
    )
    .expect("solvable")
}

/// Largest distance, in units of the true plane, of the found plane from a scaled, turned and moved copy of the true
/// one, over the corners of all photographs.
fn farthest_from_a_similarity(truth: &[PlaneCamera], found: &[PlaneCamera]) -> f64 {
    let corners = [[0.0, 0.0], [WIDTH, 0.0], [0.0, HEIGHT], [WIDTH, HEIGHT]].map(Vector2::from);
    let places = |cameras: &[PlaneCamera]| -> Vec<Vector2<f64>> {
        let of_one = |camera: &PlaneCamera| corners.map(|corner| camera.place(corner).expect("seen"));
        cameras.iter().flat_map(of_one).collect()
    };
    let (wanted, got) = (places(truth), places(found));
    let mean = |places: &[Vector2<f64>]| places.iter().sum::<Vector2<f64>>() / places.len() as f64;
    let (wanted_mean, got_mean) = (mean(&wanted), mean(&got));
    // The least-squares similarity as a complex number.
    let (mut product, mut square) = (Vector2::zeros(), 0.0);
    for (wanted, got) in wanted.iter().zip(&got) {
        let (w, g) = (wanted - wanted_mean, got - got_mean);
        product += Vector2::new(g.dot(&w), g.perp(&w));
        square += g.norm_squared();
    }
    let factor = product / square;
    let off = wanted.iter().zip(&got).map(|(wanted, got)| {
        let g = got - got_mean;
        let carried = Vector2::new(g.x * factor.x - g.y * factor.y, g.x * factor.y + g.y * factor.x);
        (carried - (wanted - wanted_mean)).norm()
    });
    off.fold(0.0, f64::max)
}

#[test]
fn a_wall_seen_by_moving_cameras_is_flat_and_right_angles_stay_right() {
    let truth = mural();
    let pairs = matched(5, |a, b, pixel| truth[a].transfer(&truth[b], pixel));
    let cameras = found(&pairs, 5, None, SceneModel::Auto);
    let scene = cameras.flat_scene.expect("recognized");
    assert!(!scene.evidence.told && !scene.evidence.straight_on);
    assert!(scene.evidence.explained > 0.99, "{:?}", scene.evidence);
    assert!((scene.cameras[0].camera.focal_px / FOCAL - 1.0).abs() < 0.03, "{}", scene.cameras[0].camera.focal_px);
    let off = farthest_from_a_similarity(&truth, &scene.cameras);
    // Units of about a pixel, over a wall of 2400: matches are half a pixel off.
    assert!(off < 4.0, "{off}");
    assert!(cameras.pair_rms_px.iter().all(|&rms| rms < 2.0), "{:?}", cameras.pair_rms_px);
}

/// The same lens for all, which bends by 3 % in the corners.
#[test]
fn the_lens_before_a_wall_is_found() {
    let mut truth = mural();
    for one in &mut truth {
        let terms =
            LensTerms { projection: LensProjection::Rectilinear, radial: [-0.06, 0.0, 0.0, 0.0], tangential: [0.0; 2] };
        one.camera.lens = Lens::new(terms);
    }
    let pairs = matched(5, |a, b, pixel| truth[a].transfer(&truth[b], pixel));
    let scene = found(&pairs, 5, Some(FOCAL), SceneModel::Auto).flat_scene.expect("recognized");
    let k1 = scene.cameras[0].camera.lens.terms().radial[0];
    assert!((k1 + 0.06).abs() < 0.006, "{k1}");
}

/// Six sheets on a scanner, each laid on it a little turned.
#[test]
fn scans_are_flat_and_have_no_focal_length() {
    let turns = [0.3, -1.2, 0.8, 2.0, -0.5, 1.1];
    let truth: Vec<PlaneCamera> =
        (0..6).map(|k| before([0.0, 0.0, turns[k]], [500.0 * (k % 3) as f64, 400.0 * (k / 3) as f64], 700.0)).collect();
    let pairs = matched(6, |a, b, pixel| truth[a].transfer(&truth[b], pixel));
    let scene = found(&pairs, 6, None, SceneModel::Auto).flat_scene.expect("recognized");
    assert!(scene.evidence.straight_on, "{:?}", scene.evidence);
    assert!(farthest_from_a_similarity(&truth, &scene.cameras) < 2.0);
    // In the mean as they were laid.
    let mean = scene.cameras.iter().map(PlaneCamera::roll).sum::<f64>() / 6.0;
    assert!(mean.abs() < 1e-3, "{mean}");
}

#[test]
fn rotating_cameras_are_no_flat_scene_unless_told() {
    let rotating: Vec<Camera> = (0..4)
        .map(|k| {
            let turn = rotation_about_y((20.0 * f64::from(k)).to_radians()) * rotation_about_x(0.02 * f64::from(k % 2));
            Camera::new(FOCAL, WIDTH, HEIGHT, &turn.transpose())
        })
        .collect();
    let pairs = matched(4, |a, b, pixel| rotating[a].transfer(&rotating[b], pixel));
    assert_eq!(found(&pairs, 4, None, SceneModel::Auto).flat_scene, None);
    let told = found(&pairs, 4, Some(FOCAL), SceneModel::Plane).flat_scene.expect("any plane does");
    assert!(told.evidence.told && told.evidence.explained > 0.99, "{:?}", told.evidence);
}

/// A step aside before a wall that is not the whole scene: every third match is of what stands before it.
#[test]
fn a_wall_with_things_before_it_is_no_flat_scene() {
    let truth = mural();
    let nearer = |camera: &PlaneCamera| PlaneCamera { distance: 0.8 * camera.distance, ..*camera };
    let pairs = matched(5, |a, b, pixel| match (pixel.x as usize) % 3 {
        0 => nearer(&truth[a]).transfer(&nearer(&truth[b]), pixel),
        _ => truth[a].transfer(&truth[b], pixel),
    });
    assert_eq!(found(&pairs, 5, None, SceneModel::Auto).flat_scene, None);
    let truth = mural();
    let flat = matched(5, |a, b, pixel| truth[a].transfer(&truth[b], pixel));
    assert_eq!(found(&flat, 5, None, SceneModel::Rotating).flat_scene, None, "as the user says");
}

/// A row of 5 x 30 degrees lies within a hemisphere, and so do two that look nearly apart; eight of 45 degrees go
/// round, and three of 120.
#[test]
fn cameras_look_all_round_where_no_hemisphere_holds_them() {
    let along = |degrees: &[f64]| -> Vec<Camera> {
        let of_one = |degrees: &f64| Camera::new(FOCAL, WIDTH, HEIGHT, &rotation_about_y(degrees.to_radians()));
        degrees.iter().map(of_one).collect()
    };
    let turn: Vec<f64> = (0..8).map(|k| 45.0 * f64::from(k)).collect();
    assert!(look_all_round(&along(&turn)) && look_all_round(&along(&[0.0, 120.0, 240.0])));
    assert!(!look_all_round(&along(&[-60.0, -30.0, 0.0, 30.0, 60.0])) && !look_all_round(&along(&[0.0, 175.0])));
    assert!(!look_all_round(&[]));
}
