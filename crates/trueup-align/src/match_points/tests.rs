//! Carried vertices against cameras and planes that are known.

use nalgebra::Matrix3;
use trueup_core::camera::Camera;
use trueup_core::geometry::rotation_about_y;
use trueup_core::matches::{PairVerdict, PointMatch, PointMatches};

use super::*;

fn rotating(cameras: &[Camera]) -> Cameras {
    Cameras {
        cameras: cameras.to_vec(),
        per_picture_focal: false,
        pair_rms_px: Vec::new(),
        contradicting: Vec::new(),
        flat_scene: None,
    }
}

fn example() -> (Vec<WorkingFrame>, Vec<Camera>, PairMatches) {
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let cameras = vec![
        Camera::new(700.0, 800.0, 600.0, &Matrix3::identity()),
        Camera::new(700.0, 800.0, 600.0, &rotation_about_y(0.35).transpose()),
    ];
    let mut inliers = Vec::new();
    for k in 0..900 {
        let source = Vector2::new((f64::from(k) * 0.618).fract() * 800.0, (f64::from(k) * 0.755).fract() * 600.0);
        let target = cameras[0].transfer(&cameras[1], source).expect("in front");
        if frame.contains(target.x, target.y) {
            inliers.push(PointMatch { in_a: source.into(), in_b: target.into() });
        }
    }
    let points = |of: fn(&PointMatch) -> [f64; 2]| -> Vec<Vector2<f64>> {
        inliers.iter().map(|one| Vector2::from(of(one))).collect()
    };
    let homography = Homography::fit(&points(|one| one.in_a), &points(|one| one.in_b), None).expect("regular");
    let pair = PairMatches {
        a: 0,
        b: 1,
        putative: inliers.len(),
        elsewhere: PointMatches::default(),
        in_overlap: inliers.len(),
        agreeing: inliers.len(),
        needed: 15,
        verdict: PairVerdict::Joined,
        b_from_a: Some(homography.to_rows()),
        inliers: inliers.into(),
    };
    (vec![frame, frame], cameras, pair)
}

#[test]
fn both_models_carry_vertices_to_their_true_place() {
    let (frames, cameras, pair) = example();
    let grids = vec![GridMesh::regular(800.0, 600.0, 40.0); 2];
    for model in [TransferModel::CameraResidual, TransferModel::MovingDlt] {
        let options = MatchPointOptions { model };
        let context = StageContext::default();
        let warps = run(&frames, &grids, &rotating(&cameras), std::slice::from_ref(&pair), &options, &context)
            .expect("not cancelled");
        assert_eq!((warps[0].from, warps[0].to, warps[1].from, warps[1].to), (0, 1, 1, 0));
        for warp in &warps {
            let carried = warp.vertices.iter().flatten().count();
            assert!(carried > 100, "{model:?}: only {carried} vertices in the overlap");
            let placed = warp.vertices.iter().enumerate().filter_map(|(vertex, place)| Some((vertex, (*place)?)));
            for (vertex, place) in placed {
                let truth = cameras[warp.from].transfer(&cameras[warp.to], grids[0].source(vertex));
                let error = (truth.expect("in front") - Vector2::from(place)).norm();
                assert!(error < 1e-5, "{model:?}: vertex {vertex} is off by {error} px");
            }
        }
    }
}

/// Where a pair's matches are in its first and in its second photograph.
fn ends(pair: &PairMatches) -> (Vec<Vector2<f64>>, Vec<Vector2<f64>>) {
    pair.inliers.iter().map(|one| (Vector2::from(one.in_a), Vector2::from(one.in_b))).unzip()
}

/// How far the vertices of the example's first photograph are carried from where the cameras alone would, with the
/// model that is the default.
fn beyond_cameras(pair: PairMatches) -> Vec<Vector2<f64>> {
    let (frames, cameras, _) = example();
    let grids = vec![GridMesh::regular(800.0, 600.0, 40.0); 2];
    let options = MatchPointOptions::default();
    let warps =
        run(&frames, &grids, &rotating(&cameras), &[pair], &options, &StageContext::default()).expect("not cancelled");
    let carried = warps[0].vertices.iter().enumerate();
    let found: Vec<Vector2<f64>> = carried
        .filter_map(|(vertex, place)| {
            let by_cameras = cameras[0].transfer(&cameras[1], grids[0].source(vertex)).expect("in front");
            Some(Vector2::from((*place)?) - by_cameras)
        })
        .collect();
    assert!(found.len() > 100, "only {} vertices in the overlap", found.len());
    found
}

/// Parallax of a plane at which few matches are: all deviate alike, and vertices must follow wholly. The correction of
/// the cameras by itself, drawn to none with the strength of half a match, keeps 0.3 px and more of it.
#[test]
fn vertices_follow_the_few_matches_of_a_plane_that_the_cameras_miss() {
    const SHIFT: Vector2<f64> = Vector2::new(6.0, 2.0);
    let (_, cameras, mut pair) = example();
    pair.inliers = pair.inliers.iter().copied().step_by(9).collect();
    for one in pair.inliers.iter_mut() {
        one.in_b = (Vector2::from(one.in_b) + SHIFT).into();
    }
    let (source, target) = ends(&pair);
    pair.b_from_a = Homography::fit(&source, &target, None).map(|homography| homography.to_rows());
    let corrected = CameraResidual::new(CameraTransfer::Rotating(&cameras[0], &cameras[1]), &source, &target);
    let corner = corrected.at(source[0]).expect("near") - cameras[0].transfer(&cameras[1], source[0]).expect("near");
    assert!((corner - SHIFT).norm() > 0.1, "the correction alone reaches {corner}");
    for deviation in beyond_cameras(pair) {
        assert!((deviation - SHIFT).norm() < 1e-4, "{deviation}");
    }
}

/// A common deviation of 0.35 px on each axis is a quarter of 0.7 px squared: the correction has three quarters of
/// the say, and in its own quarter moving DLT follows what the correction falls short of.
#[test]
fn a_smaller_parallax_is_followed_in_part() {
    const SHIFT: Vector2<f64> = Vector2::new(0.35, 0.35);
    let (_, cameras, mut pair) = example();
    for one in pair.inliers.iter_mut() {
        one.in_b = (Vector2::from(one.in_b) + SHIFT).into();
    }
    let (source, target) = ends(&pair);
    let homography = Homography::fit(&source, &target, None).expect("regular");
    pair.b_from_a = Some(homography.to_rows());
    let corrected = CameraResidual::new(CameraTransfer::Rotating(&cameras[0], &cameras[1]), &source, &target);
    let grid = GridMesh::regular(800.0, 600.0, 40.0);
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let expected: Vec<Vector2<f64>> = (0..grid.len())
        .filter_map(|vertex| {
            let by_cameras = cameras[0].transfer(&cameras[1], grid.source(vertex))?;
            let correction = corrected.at(grid.source(vertex))? - by_cameras;
            let mean = correction * 0.75 + SHIFT * 0.25;
            frame.contains(by_cameras.x + mean.x, by_cameras.y + mean.y).then_some(mean)
        })
        .collect();
    let found = beyond_cameras(pair);
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        // The standard error takes some hundredths off the share.
        assert!((found - expected).norm() < 0.05 * (SHIFT - expected).norm() + 1e-6, "{found} for {expected}");
    }
}

/// Photographs taken from one point: the noise of their matches is not parallax, and the places are exactly those of
/// the corrected cameras.
#[test]
fn noise_of_matches_is_no_parallax() {
    let (frames, cameras, mut pair) = example();
    for (k, one) in pair.inliers.iter_mut().enumerate() {
        // Looks independent from match to match, up to 0.8 px on each axis.
        let noise = |salt: f64| ((k as f64 * 12.9898 + salt).sin() * 43_758.545).fract() * 0.8;
        one.in_b = [one.in_b[0] + noise(0.0), one.in_b[1] + noise(78.233)];
    }
    let (source, target) = ends(&pair);
    let corrected = CameraResidual::new(CameraTransfer::Rotating(&cameras[0], &cameras[1]), &source, &target);
    let grids = vec![GridMesh::regular(800.0, 600.0, 40.0); 2];
    let options = MatchPointOptions::default();
    let run = |pair: &PairMatches| {
        run(&frames, &grids, &rotating(&cameras), std::slice::from_ref(pair), &options, &StageContext::default())
    };
    let warps = run(&pair).expect("not cancelled");
    for (vertex, place) in warps[0].vertices.iter().enumerate() {
        if let Some(place) = place {
            assert_eq!(corrected.at(grids[0].source(vertex)), Some(Vector2::from(*place)));
        }
    }
}

/// A pair that is verified on rays has no homography; parallax is then met by the corrected cameras alone.
#[test]
fn without_a_homography_the_cameras_carry() {
    let (_, _, mut pair) = example();
    for one in pair.inliers.iter_mut() {
        one.in_b[0] += 6.0;
    }
    pair.b_from_a = None;
    for deviation in beyond_cameras(pair) {
        assert!((deviation - Vector2::new(6.0, 0.0)).norm() < 1.0, "{deviation}");
    }
}

/// With matches on the left alone, vertices on the right are carried by cameras that are right; where the cameras are
/// wrong, nothing tells where they belong.
#[test]
fn under_parallax_vertices_far_from_all_matches_are_not_carried() {
    let (frames, cameras, pair) = example();
    let grids = vec![GridMesh::regular(800.0, 600.0, 40.0); 2];
    let far_carried = |shift: f64| {
        let mut pair = pair.clone();
        pair.inliers = pair.inliers.iter().copied().filter(|one| one.in_a[0] < 450.0).collect();
        pair.inliers.iter_mut().for_each(|one| one.in_b[0] += shift);
        let (source, target) = ends(&pair);
        pair.b_from_a = Homography::fit(&source, &target, None).map(|homography| homography.to_rows());
        let options = MatchPointOptions::default();
        let warps = run(&frames, &grids, &rotating(&cameras), &[pair], &options, &StageContext::default());
        let warps = warps.expect("not cancelled");
        let far = |&vertex: &usize| grids[0].source(vertex).x > 750.0;
        (0..grids[0].len()).filter(far).filter(|&vertex| warps[0].vertices[vertex].is_some()).count()
    };
    // 300 px and more from some 200 matches: each counts for 0.016 and less.
    assert_eq!(far_carried(8.0), 0);
    assert!(far_carried(0.0) > 10);
}
