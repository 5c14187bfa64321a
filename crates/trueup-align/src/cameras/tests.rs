//! Whole-stage tests on synthetic photographs with known cameras.

use nalgebra::{Vector2, Vector3};
use rand::RngExt;
use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z, wrap_angle};
use trueup_core::lens::{Lens, LensProjection, LensTerms};
use trueup_core::matches::{PairVerdict, PointMatch, PointMatches};
use trueup_core::source::WorkingFrame;

use super::bundle::{BundleAdjustment, Parameters};
use super::contradictions::contradicting_pairs;
use super::intrinsics::LensState;
use super::lenses::LensSearch;
use super::observations::Observations;
use super::rotations::relative_rotation;
use super::*;

const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 600.0;

pub(super) fn frame() -> WorkingFrame {
    WorkingFrame { width: WIDTH, height: HEIGHT, working_from_full: 1.0 }
}

/// A camera by yaw, pitch and roll in degrees (camera to world: Ry Rx Rz).
fn camera(focal: f64, yaw: f64, pitch: f64, roll: f64) -> Camera {
    let turn =
        rotation_about_y(yaw.to_radians()) * rotation_about_x(pitch.to_radians()) * rotation_about_z(roll.to_radians());
    Camera::new(focal, WIDTH, HEIGHT, &turn.transpose())
}

/// Matches between all photographs that overlap, with Gaussian-like noise (sum of uniforms) of standard deviation
/// `noise_px` and a share of gross errors.
pub(super) fn matched(truth: &[Camera], noise_px: f64, gross: f64) -> Vec<PairMatches> {
    let context = StageContext::default();
    let mut pairs = Vec::new();
    for a in 0..truth.len() {
        for b in a + 1..truth.len() {
            let mut generator = context.generator("camera test", (a * truth.len() + b) as u64);
            let mut noise = || (0..12).map(|_| generator.random::<f64>()).sum::<f64>() - 6.0;
            let mut inliers = Vec::new();
            for k in 0..400 {
                let (u, v) = ((f64::from(k) * 0.618_034).fract(), (f64::from(k) * 0.754_877).fract());
                let source = Vector2::new(u * WIDTH, v * HEIGHT);
                let Some(target) = truth[a].transfer(&truth[b], source) else { continue };
                if !frame().contains(target.x, target.y) {
                    continue;
                }
                let off = if (f64::from(k) * 0.414_213).fract() < gross { 60.0 } else { 0.0 };
                inliers.push(PointMatch {
                    in_a: [source.x + noise_px * noise(), source.y + noise_px * noise()],
                    in_b: [target.x + noise_px * noise() + off, target.y + noise_px * noise()],
                });
            }
            if inliers.len() >= 40 {
                pairs.push(joined(a, b, inliers));
            }
        }
    }
    pairs
}

/// A pair that was verified, all of whose matches agree.
pub(super) fn joined(a: usize, b: usize, inliers: Vec<PointMatch>) -> PairMatches {
    let count = inliers.len();
    let verdict = PairVerdict::Joined;
    PairMatches {
        a,
        b,
        putative: count,
        in_overlap: count,
        agreeing: count,
        needed: 15,
        verdict,
        b_from_a: None,
        inliers: inliers.into(),
        elsewhere: PointMatches::default(),
    }
}

fn estimate(pairs: &[PairMatches], known_focal: Option<f64>, groups: &[usize]) -> Cameras {
    let priors: Vec<CameraPrior> = groups
        .iter()
        .map(|&group| CameraPrior { focal_px: known_focal, ..CameraPrior::unknown(frame(), group) })
        .collect();
    solved(&priors, pairs, 0)
}

fn solved(priors: &[CameraPrior], pairs: &[PairMatches], reference: usize) -> Cameras {
    let input = CameraInput { priors, pairs, curves: &[], lines: &[], reference };
    let cameras = run(&input, &CameraOptions::default(), &StageContext::default()).expect("solvable");
    assert_eq!((cameras.cameras.len(), cameras.pair_rms_px.len()), (priors.len(), pairs.len()));
    cameras
}

/// Largest angle between estimated and true rotations relative to photograph 0, in degrees.
fn worst_rotation_error(truth: &[Camera], estimated: &[Camera]) -> f64 {
    (0..truth.len())
        .map(|k| {
            let wanted = relative_rotation(&truth[0].rotation(), &truth[k].rotation());
            let found = relative_rotation(&estimated[0].rotation(), &estimated[k].rotation());
            trueup_core::geometry::log_rotation(&relative_rotation(&wanted, &found)).norm().to_degrees()
        })
        .fold(0.0, f64::max)
}

#[test]
fn a_row_without_metadata_is_recovered_despite_gross_errors() {
    let rolls = [3.0, -5.0, 1.0, 7.0, -2.0, 4.0];
    let truth: Vec<Camera> =
        (0..6).map(|k| camera(700.0, 22.0 * f64::from(k), 2.0 * f64::from(k % 3), rolls[k as usize])).collect();
    let cameras = estimate(&matched(&truth, 0.5, 0.1), None, &[0; 6]);
    assert!(!cameras.per_picture_focal);
    let error = worst_rotation_error(&truth, &cameras.cameras);
    assert!(error < 0.25, "rotation error {error} deg");
    for camera in &cameras.cameras {
        assert!((camera.focal_px / 700.0 - 1.0).abs() < 0.01, "focal {}", camera.focal_px);
    }
}

#[test]
fn a_full_turn_closes_from_a_wrong_focal_length() {
    let truth: Vec<Camera> = (0..16).map(|k| camera(650.0, 22.5 * f64::from(k), 1.0, 0.5)).collect();
    let cameras = estimate(&matched(&truth, 0.3, 0.0), Some(800.0), &[0; 16]);
    assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.1);
    assert!((cameras.cameras[3].focal_px / 650.0 - 1.0).abs() < 0.005);
}

#[test]
fn a_zoom_is_noticed() {
    let focal = [700.0, 700.0, 900.0, 700.0, 900.0, 900.0];
    let truth: Vec<Camera> = (0..6).map(|k| camera(focal[k], 14.0 * k as f64, 0.0, 2.0)).collect();
    let cameras = estimate(&matched(&truth, 0.3, 0.0), None, &[0; 6]);
    assert!(cameras.per_picture_focal);
    for (camera, wanted) in cameras.cameras.iter().zip(focal) {
        assert!((camera.focal_px / wanted - 1.0).abs() < 0.03, "{} for {wanted}", camera.focal_px);
    }
}

/// One of eight photographs through a longer lens, or one of a row that two overlap only: fewer than a quarter, which
/// do not move the quartiles.
#[test]
fn a_zoom_of_one_photograph_is_noticed() {
    for (zoomed, longer) in [(3, 1.6), (5, 0.7), (0, 1.08)] {
        let focal_of = |k: usize| if k == zoomed { 700.0 * longer } else { 700.0 };
        let truth: Vec<Camera> = (0..8).map(|k| camera(focal_of(k), 14.0 * k as f64, 0.0, 2.0)).collect();
        let cameras = estimate(&matched(&truth, 0.5, 0.0), None, &[0; 8]);
        assert!(cameras.per_picture_focal, "{zoomed}");
        for (k, camera) in cameras.cameras.iter().enumerate() {
            assert!((camera.focal_px / focal_of(k) - 1.0).abs() < 0.02, "{k}: {} for {}", camera.focal_px, focal_of(k));
        }
    }
}

/// What photographs at one setting tell of its focal length counts together: of a zoom, and of a telephone with two
/// lenses, of which the one moves corners, 500 px from the middle, by 8 px and the other by 100.
#[test]
fn photographs_at_one_setting_share_its_focal_length() {
    let settings = [(700.0, -0.03), (700.0, -0.03), (350.0, -0.1), (700.0, -0.03), (700.0, -0.03), (350.0, -0.1)];
    for bends in [0.0, 1.0] {
        let of = |k: usize, (focal_px, k1): (f64, f64)| {
            let one = vec![camera(focal_px, 16.0 * k as f64, 2.0 * (k % 3) as f64, ROLLS[k])];
            bent(one, [bends * k1, 0.0, 0.0, 0.0], [0.0; 2])
        };
        let truth: Vec<Camera> = settings.into_iter().enumerate().flat_map(|(k, setting)| of(k, setting)).collect();
        let cameras = estimate(&matched(&truth, 0.3, 0.0), None, &[0; 6]).cameras;
        for (one, other) in [(0, 1), (0, 3), (0, 4), (2, 5)] {
            assert_eq!(cameras[one].focal_px, cameras[other].focal_px, "{bends} {one} {other}");
        }
        for (camera, truth) in cameras.iter().zip(&truth) {
            assert!((camera.focal_px / truth.focal_px - 1.0).abs() < 0.003, "{bends}: {}", camera.focal_px);
        }
    }
}

/// Where each photograph is to have its own, those that are alike keep theirs, through a lens, too.
#[test]
fn photographs_that_are_to_have_their_own_focal_length_share_none() {
    let focal_px = [650.0, 656.0, 645.0, 653.0, 647.0, 655.0];
    let row = row(ROLLS).into_iter().zip(focal_px).map(|(camera, focal_px)| Camera { focal_px, ..camera }).collect();
    let pairs = matched(&bent(row, [-0.06, 0.0, 0.0, 0.0], [0.0; 2]), 0.3, 0.0);
    let options = CameraOptions { focal_sharing: FocalSharing::PerPicture, ..CameraOptions::default() };
    let priors = [CameraPrior::unknown(frame(), 0); 6];
    let input = CameraInput { priors: &priors, pairs: &pairs, curves: &[], lines: &[], reference: 0 };
    let cameras = run(&input, &options, &StageContext::default()).expect("solvable").cameras;
    assert!(cameras.iter().all(|camera| !camera.lens.is_pinhole()));
    for (k, camera) in cameras.iter().enumerate().skip(1) {
        let ratio = camera.focal_px / cameras[0].focal_px;
        assert!((ratio / (focal_px[k] / focal_px[0]) - 1.0).abs() < 0.005 && ratio != 1.0, "{k}: {ratio}");
    }
}

/// Two settings of a zoom, each of whose photographs is focused anew.
#[test]
fn a_focus_beside_a_zoom_is_found() {
    let focal_px = [650.0, 653.0, 900.0, 647.0, 904.0, 655.0];
    let truth: Vec<Camera> = (0..6).map(|k| camera(focal_px[k], 14.0 * k as f64, 0.0, ROLLS[k])).collect();
    let cameras = estimate(&matched(&truth, 0.2, 0.0), None, &[0; 6]).cameras;
    for (camera, truth) in cameras.iter().zip(&truth) {
        let ratio = (camera.focal_px / cameras[0].focal_px) / (truth.focal_px / focal_px[0]);
        assert!((ratio - 1.0).abs() < 0.001, "{} for {}", camera.focal_px, truth.focal_px);
    }
}

/// An automatic focus moves the corners of photographs, 500 px from the middle, by up to 5 px. The second row has a
/// lens besides, the third has two photographs.
#[test]
fn focal_lengths_that_the_focus_changes_are_found() {
    let focus = [0.0, 0.7, -0.9, 0.4, -0.2, 1.0, -0.6, 0.3];
    for (count, k1) in [(8, 0.0), (8, -0.06), (2, 0.0)] {
        let refocused =
            |(camera, percent): (Camera, f64)| Camera { focal_px: camera.focal_px * (1.0 + 0.01 * percent), ..camera };
        let truth: Vec<Camera> = row(ROLLS).into_iter().zip(focus).map(refocused).take(count).collect();
        let truth = bent(truth, [k1, 0.0, 0.0, 0.0], [0.0; 2]);
        let cameras = estimate(&matched(&truth, 0.3, 0.0), None, &vec![0; count]);
        assert!(cameras.per_picture_focal, "{count} {k1}");
        for pair in 1..count {
            let ratio = |cameras: &[Camera]| cameras[pair].focal_px / cameras[0].focal_px;
            let error = ratio(&cameras.cameras) / ratio(&truth) - 1.0;
            assert!(error.abs() < 0.001, "{count} {k1}: {error}");
        }
    }
}

/// Three photographs, which neither the focus nor the lens explains alone: it moves corners by 500 (500 / 650)^2 0.04 =
/// 12 px, and is off center besides. A pinhole that was told stays one.
#[test]
fn a_lens_and_the_focus_are_found_at_once() {
    let focal_px = [650.0, 655.0, 645.0];
    let row = row(ROLLS).into_iter().zip(focal_px).map(|(camera, focal_px)| Camera { focal_px, ..camera }).collect();
    let truth = bent(row, [-0.04, 0.0, 0.0, 0.0], [9.0, -5.0]);
    let pairs = matched(&truth, 0.3, 0.0);
    let cameras = estimate(&pairs, None, &[0; 3]);
    assert!(cameras.per_picture_focal);
    for (camera, focal_px) in cameras.cameras.iter().zip(focal_px) {
        assert!((camera.focal_px / focal_px - 1.0).abs() < 0.003, "{camera:?} for {focal_px}");
        let corner = Vector2::new(10.0, 10.0);
        let back = camera.project(truth[0].bearing(corner)).expect("in front");
        let unbent = Camera { lens: Lens::default(), ..*camera }.project(truth[0].bearing(corner)).expect("in front");
        assert!((unbent - back).norm() > 6.0, "{back} {unbent}");
    }
    assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.1);
    let pinhole = CameraOptions { lens: LensKind::Pinhole, ..CameraOptions::default() };
    let priors = [CameraPrior::unknown(frame(), 0); 3];
    let input = CameraInput { priors: &priors, pairs: &pairs, curves: &[], lines: &[], reference: 0 };
    let cameras = run(&input, &pinhole, &StageContext::default()).expect("solvable").cameras;
    assert!(cameras.iter().all(|camera| camera.lens.is_pinhole()));
}

/// Where a lens is sure, what is weaker beside it is found, too: k2, without which k1 is too small by a third, under
/// noise of twice the usual. Photographs of 93 degrees.
#[test]
fn what_hides_beside_a_lens_is_found() {
    for (step_deg, radial) in [(35.0, [-0.06, 0.01, 0.0, 0.0]), (45.0, [-0.05, 0.006, 0.0, 0.0])] {
        let pair = (0..2).map(|k| camera(380.0, step_deg * k as f64, 2.0 * k as f64, ROLLS[k])).collect();
        let truth = bent(pair, radial, [2.0, 1.0]);
        let cameras = estimate(&matched(&truth, 0.5, 0.0), None, &[0; 2]);
        let found = cameras.cameras[0].lens.terms().radial;
        assert!((found[0] - radial[0]).abs() < 0.004 && (found[1] - radial[1]).abs() < 0.004, "{found:?}");
        assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.2);
    }
}

/// Cameras with this lens, and the principal point off center.
pub(super) fn bent(cameras: Vec<Camera>, radial: [f64; 4], off: [f64; 2]) -> Vec<Camera> {
    let lens = Lens::new(LensTerms { radial, ..LensTerms::default() });
    let principal_point = [WIDTH / 2.0 + off[0], HEIGHT / 2.0 + off[1]];
    cameras.into_iter().map(|camera| Camera { lens, principal_point, ..camera }).collect()
}

pub(super) fn row(rolls: [f64; 8]) -> Vec<Camera> {
    (0..8).map(|k| camera(650.0, 20.0 * k as f64, 2.0 * (k % 3) as f64, rolls[k])).collect()
}

pub(super) const ROLLS: [f64; 8] = [3.0, -5.0, 1.0, 7.0, -2.0, 4.0, -6.0, 2.0];

/// The corners are 500 px from the middle; the lens moves them by 500 (500 / 650)^2 0.08 = 24 px.
#[test]
fn a_barrel_lens_is_found_from_the_matches_alone() {
    let truth = bent(row(ROLLS), [-0.08, 0.015, 0.0, 0.0], [6.0, -4.0]);
    let cameras = estimate(&matched(&truth, 0.3, 0.05), None, &[0; 8]);
    assert!(!cameras.per_picture_focal);
    let found = &cameras.cameras[2];
    assert!((found.focal_px / 650.0 - 1.0).abs() < 0.002, "{found:?}");
    assert!((found.principal_point[0] - WIDTH / 2.0 - 6.0).abs() < 1.0, "{found:?}");
    assert!((found.principal_point[1] - HEIGHT / 2.0 + 4.0).abs() < 1.0, "{found:?}");
    assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.25);
    for (x, y) in [(10.0, 10.0), (790.0, 300.0), (400.0, 590.0)] {
        let pixel = Vector2::new(x, y);
        let back = found.project(truth[2].bearing(pixel)).expect("in front");
        assert!((back - pixel).norm() < 1.5, "{pixel} {back}");
    }
}

#[test]
fn a_pinhole_stays_exactly_one() {
    for noise_px in [0.2, 0.5, 1.0] {
        let cameras = estimate(&matched(&row(ROLLS), noise_px, 0.1), None, &[0; 8]);
        assert!(cameras.cameras.iter().all(|camera| camera.lens.is_pinhole()), "{noise_px}");
        assert!(cameras.cameras.iter().all(|camera| camera.principal_point == [WIDTH / 2.0, HEIGHT / 2.0]));
    }
}

/// Cameras that have not settled look as if they bent; what is gone once they have is no lens.
#[test]
fn a_bend_that_does_not_stay_is_no_lens() {
    let truth = row(ROLLS);
    let pairs = matched(&truth, 0.3, 0.0);
    let priors = vec![CameraPrior::unknown(frame(), 0); 8];
    let observations = Observations::choose(&priors, &pairs.iter().collect::<Vec<_>>(), 200);
    let curves = CurveObservations::default();
    let problem = BundleAdjustment {
        priors: &priors,
        observations: &observations,
        curves: &curves,
        start_focal_px: vec![800.0; 8],
        reference: 0,
        focal_sd: vec![1.0; 8],
    };
    let unsettled = Parameters {
        focal_px: vec![900.0; 8],
        rotations: truth.iter().map(Camera::rotation).collect(),
        lenses: vec![LensState::default(); 8],
    };
    let context = StageContext::default();
    let search = LensSearch { problem: &problem, precise: &problem, kind: LensKind::Auto, context: &context };
    let found = search.find(&unsettled, &[0; 8]).expect("not cancelled");
    assert!(found.is_none(), "{:?}", found.map(|found| found.parameters.lenses[0]));
}

/// Two overlaps have no spread, but through the lens they leave nothing but noise. It moves the corners by 24 px, or
/// nothing but the middle by 7 of the photographs' 1000 px of diagonal.
#[test]
fn a_pair_and_a_triple_from_one_place_tell_their_lens() {
    for (count, k1, off) in [(2, -0.08, [0.0; 2]), (3, -0.08, [0.0; 2]), (2, -0.08, [6.0, -4.0]), (3, 0.0, [-4.0, 6.0])]
    {
        let truth = bent(row(ROLLS)[..count].to_vec(), [k1, 0.0, 0.0, 0.0], off);
        let cameras = estimate(&matched(&truth, 0.3, 0.0), None, &vec![0; count]);
        let found = &cameras.cameras[0];
        assert!((found.lens.terms().radial[0] - k1).abs() < 0.004, "{found:?}");
        assert!((found.focal_px / 650.0 - 1.0).abs() < 0.01, "{found:?}");
        let middle = [WIDTH / 2.0 + off[0], HEIGHT / 2.0 + off[1]];
        assert!((Vector2::from(found.principal_point) - Vector2::from(middle)).norm() < 1.5, "{found:?}");
    }
}

/// A middle that far off is no lens's, but what parallax makes of one.
#[test]
fn a_pair_that_is_far_off_center_tells_no_lens() {
    let truth = bent(row(ROLLS)[..2].to_vec(), [0.0; 4], [25.0, -20.0]);
    let cameras = estimate(&matched(&truth, 0.3, 0.0), None, &[0; 2]);
    assert!(cameras.cameras.iter().all(|camera| camera.lens.is_pinhole()), "{:?}", cameras.cameras[0]);
    assert!(cameras.cameras.iter().all(|camera| camera.principal_point == [WIDTH / 2.0, HEIGHT / 2.0]));
}

/// Parallax bends what a pair says as a lens would, but also otherwise: before a wall that recedes from 3 to 7 focal
/// units, from places 0.2 apart.
#[test]
fn a_pair_from_two_places_tells_no_lens() {
    let truth = row(ROLLS)[..2].to_vec();
    let context = StageContext::default();
    let mut generator = context.generator("parallax test", 0);
    let mut noise = || 0.3 * ((0..12).map(|_| generator.random::<f64>()).sum::<f64>() - 6.0);
    let mut inliers = Vec::new();
    for k in 0..400 {
        let (u, v) = ((f64::from(k) * 0.618_034).fract(), (f64::from(k) * 0.754_877).fract());
        let source = Vector2::new(u * WIDTH, v * HEIGHT);
        let point = truth[0].rotation().transpose() * truth[0].bearing(source) * (3.0 + 4.0 * u);
        let seen = truth[1].project(truth[1].rotation() * (point - Vector3::new(0.2, 0.0, 0.0)));
        let Some(target) = seen.filter(|target| frame().contains(target.x, target.y)) else { continue };
        inliers.push(PointMatch {
            in_a: [source.x + noise(), source.y + noise()],
            in_b: [target.x + noise(), target.y + noise()],
        });
    }
    let cameras = estimate(&[joined(0, 1, inliers)], None, &[0; 2]);
    assert!(cameras.cameras.iter().all(|camera| camera.lens.is_pinhole()), "{:?}", cameras.cameras[0]);
}

/// 150 degrees across, nothing told.
#[test]
fn a_fisheye_is_recognized() {
    let terms =
        LensTerms { projection: LensProjection::Equidistant, radial: [-0.015, 0.002, 0.0, 0.0], ..Default::default() };
    let truth: Vec<Camera> = (0..6)
        .map(|k| Camera { lens: Lens::new(terms), ..camera(305.0, 60.0 * k as f64, 3.0 * (k % 2) as f64, ROLLS[k]) })
        .collect();
    let cameras = estimate(&matched(&truth, 0.3, 0.0), None, &[0; 6]);
    assert!(cameras.cameras.iter().all(|camera| camera.lens.is_fisheye()), "{:?}", cameras.cameras[0]);
    assert!((cameras.cameras[0].focal_px / 305.0 - 1.0).abs() < 0.005, "{:?}", cameras.cameras[0]);
    assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.1);
}

#[test]
fn another_reference_gives_the_same_shape() {
    let truth: Vec<Camera> = (0..5).map(|k| camera(700.0, 20.0 * f64::from(k), 3.0, f64::from(k))).collect();
    let pairs = matched(&truth, 0.5, 0.05);
    let priors = vec![CameraPrior::unknown(frame(), 0); 5];
    let cameras = |reference| solved(&priors, &pairs, reference).cameras;
    // By rounding only: another start could end in another local minimum.
    assert!(worst_rotation_error(&cameras(0), &cameras(3)) < 1e-6);
}

#[test]
fn an_absurd_start_or_a_pure_shift_never_ends_the_run() {
    let shift: Vec<PointMatch> = (0..60)
        .map(|k| {
            let (x, y) = ((f64::from(k) * 0.618).fract() * 500.0, (f64::from(k) * 0.755).fract() * 600.0);
            PointMatch { in_a: [x + 300.0, y], in_b: [x, y] }
        })
        .collect();
    let truth = [camera(700.0, 0.0, 0.0, 0.0), camera(700.0, 20.0, 0.0, 0.0)];
    let mut pairs = matched(&truth, 0.0, 0.0);
    pairs[0].inliers = shift.into();
    for known in [None, Some(1e9), Some(1e-9), Some(f64::NAN)] {
        let cameras = estimate(&pairs, known, &[0; 2]);
        assert!(cameras.cameras.iter().all(|camera| camera.focal_px.is_finite() && camera.focal_px > 0.0));
        assert!(cameras.cameras.iter().all(|camera| camera.rotation().iter().all(|entry| entry.is_finite())));
    }
}

#[test]
fn a_pair_that_contradicts_the_rest_is_set_aside() {
    let truth: Vec<Camera> = (0..4).map(|k| camera(700.0, 15.0 * f64::from(k), 0.0, 0.0)).collect();
    let mut pairs = matched(&truth, 0.3, 0.0);
    let wrong = pairs.iter().position(|pair| pair.a == 0 && pair.b == 2).expect("overlap");
    for one in pairs[wrong].inliers.iter_mut() {
        one.in_b[0] += 70.0;
    }
    pairs[wrong].inliers.truncate(30);
    let cameras = estimate(&pairs, Some(700.0), &[0; 4]);
    assert_eq!(cameras.contradicting, [wrong]);
    assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.1);
    assert!(wrap_angle(cameras.pair_rms_px[wrong]) != 0.0);
}

/// Windows of a facade, each like the next: what is seen 15 degrees on is seen again.
#[test]
fn false_overlaps_do_not_drive_out_stronger_true_ones() {
    let truth: Vec<Camera> = (0..6).map(|k| camera(700.0, 15.0 * f64::from(k), 0.0, 0.0)).collect();
    let mut pairs = matched(&truth, 0.3, 0.0);
    let mut false_ones = Vec::new();
    for (a, b) in [(0, 2), (1, 3), (2, 4), (3, 5)] {
        let seen_again = camera(700.0, 15.0 * (b as f64 - 1.0), 0.0, 0.0);
        let matches = matched(&[truth[a], seen_again], 0.3, 0.0).remove(0).inliers;
        let position = pairs.iter().position(|pair| (pair.a, pair.b) == (a, b)).expect("overlap");
        pairs[position] = joined(a, b, matches.iter().take(120).copied().collect());
        false_ones.push(position);
    }
    let cameras = estimate(&pairs, None, &[0; 6]);
    assert_eq!(cameras.contradicting, false_ones);
    assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.1);
}

#[test]
fn an_overlap_that_parallax_strains_stays_one() {
    let truth: Vec<Camera> = (0..4).map(|k| camera(700.0, 15.0 * f64::from(k), 0.0, 0.0)).collect();
    let mut pairs = matched(&truth, 0.3, 0.0);
    let strained = pairs.iter().position(|pair| (pair.a, pair.b) == (0, 2)).expect("overlap");
    for one in pairs[strained].inliers.iter_mut() {
        one.in_b[0] += 20.0;
    }
    let with_needed = |needed: usize| {
        let mut pairs = pairs.clone();
        pairs[strained].needed = needed;
        estimate(&pairs, Some(700.0), &[0; 4])
    };
    let agreeing = pairs[strained].agreeing;
    let cameras = with_needed(agreeing / 2);
    assert!(cameras.contradicting.is_empty());
    assert!((cameras.pair_rms_px[strained] - 20.0).abs() < 1.0, "{:?}", cameras.pair_rms_px);
    assert!(worst_rotation_error(&truth, &cameras.cameras) < 0.1);
    assert_eq!(with_needed(agreeing * 3 / 4).contradicting, [strained]);
}

#[test]
fn a_pair_that_closes_a_full_turn_is_kept_unless_it_is_far_too_bad() {
    let truth: Vec<Camera> = (0..12).map(|k| camera(700.0, 30.0 * f64::from(k), 0.0, 0.0)).collect();
    let pairs = matched(&truth, 0.3, 0.0);
    let position = |a, b| pairs.iter().position(|pair| (pair.a, pair.b) == (a, b)).expect("overlap");
    let (closing, inner) = (position(0, 11), position(3, 4));
    assert_eq!(pairs.len(), 12);
    let limit_px = 10.0;
    let found = |closing_px: f64, inner_px: f64| {
        let mut rms = vec![1.0; pairs.len()];
        (rms[closing], rms[inner]) = (closing_px, inner_px);
        contradicting_pairs(&truth, &pairs, &rms, limit_px)
    };
    assert!(found(11.0, 1.0).is_empty());
    assert_eq!(found(21.0, 1.0), [closing]);
    // Only one can go at all; it is the worse one, and kept as well.
    assert!(found(11.0, 12.0).is_empty());
    // In an open row none is kept for that: the chain hangs on every pair but those of a short cut.
    let row: Vec<Camera> = (0..4).map(|k| camera(700.0, 15.0 * f64::from(k), 0.0, 0.0)).collect();
    let pairs = matched(&row, 0.3, 0.0);
    let short_cut = pairs.iter().position(|pair| (pair.a, pair.b) == (0, 2)).expect("overlap");
    let mut rms = vec![1.0; pairs.len()];
    rms[short_cut] = 11.0;
    assert_eq!(contradicting_pairs(&row, &pairs, &rms, limit_px), [short_cut]);
}

#[path = "told_tests.rs"]
mod told;

#[path = "edges_tests.rs"]
mod edges;
