//! What the user tells of the lens.

use trueup_core::lens::PlacedLens;

use super::*;

fn solved_by(priors: &[CameraPrior], pairs: &[PairMatches], options: &CameraOptions) -> Vec<Camera> {
    run(&CameraInput { priors, pairs, curves: &[], lines: &[], reference: 0 }, options, &StageContext::default())
        .expect("solvable")
        .cameras
}

/// Also beside what two photographs from one place tell by themselves: taken for pinholes' they are turned wrongly.
#[test]
fn a_pair_has_the_lens_that_was_told() {
    let radial = [-0.2, 0.04, 0.0, 0.0];
    let truth = bent(row(ROLLS)[..2].to_vec(), radial, [6.0, -4.0]);
    let pairs = matched(&truth, 0.3, 0.0);
    let lens = PlacedLens { terms: LensTerms { radial, ..LensTerms::default() }, center_px: [6.0, -4.0] };
    let told =
        CameraPrior { focal_px: Some(660.0), focal_told: true, lens: Some(lens), ..CameraPrior::unknown(frame(), 0) };
    let cameras = solved_by(&[told; 2], &pairs, &CameraOptions::default());
    let pinhole = CameraOptions { lens: LensKind::Pinhole, ..CameraOptions::default() };
    let straight = solved_by(&[CameraPrior::unknown(frame(), 0); 2], &pairs, &pinhole);
    for camera in &cameras {
        assert_eq!((camera.lens, camera.principal_point), (truth[0].lens, truth[0].principal_point));
        assert!((camera.focal_px / 650.0 - 1.0).abs() < 0.005, "{camera:?}");
    }
    let error = |cameras: &[Camera]| worst_rotation_error(&truth, cameras);
    assert!(
        error(&cameras) < 0.1 && error(&straight) > 2.0 * error(&cameras),
        "{} {}",
        error(&cameras),
        error(&straight)
    );
}

/// Half of 800 px at 30 degrees: 400 / tan 30 = 692.8 px; a shift tells no focal length.
#[test]
fn a_told_field_of_view_holds_where_the_matches_tell_none() {
    let mut pairs = matched(&[camera(700.0, 0.0, 0.0, 0.0), camera(700.0, 20.0, 0.0, 0.0)], 0.0, 0.0);
    for one in pairs[0].inliers.iter_mut() {
        one.in_b = [one.in_a[0] - 250.0, one.in_a[1]];
    }
    let options = CameraOptions { fov: 60.0, ..CameraOptions::default() };
    for camera in solved_by(&[CameraPrior::unknown(frame(), 0); 2], &pairs, &options) {
        assert!((camera.focal_px / 692.8).ln().abs() < 1.051_f64.ln(), "{camera:?}");
    }
}

/// The field of view is that through the whole lens: the ray at half of it falls on the border of a photograph.
#[test]
fn a_field_of_view_is_that_through_the_lens() {
    let terms = LensTerms { radial: [-0.1, 0.01, 0.0, 0.0], ..LensTerms::default() };
    let barrel = PlacedLens { terms, center_px: [0.0; 2] };
    for (fov, kind, lens) in [
        (75.0, LensKind::Auto, None),
        (75.0, LensKind::Auto, Some(barrel)),
        (75.0, LensKind::Fisheye, None),
        (170.0, LensKind::Auto, None),
    ] {
        let options = CameraOptions { fov, lens: kind, ..CameraOptions::default() };
        let prior = CameraPrior { lens, ..CameraPrior::unknown(frame(), 0) }.told_by(&options);
        let is_fisheye = options.kind_of_lens() == LensKind::Fisheye;
        let projection = if is_fisheye { LensProjection::Equidistant } else { LensProjection::Rectilinear };
        let terms = lens.map_or(LensTerms { projection, ..LensTerms::default() }, |lens| lens.terms);
        let camera = Camera { lens: Lens::new(terms), ..prior.unturned_camera(prior.focal_px.expect("told")) };
        let ray = camera.bearing(Vector2::new(WIDTH, HEIGHT / 2.0));
        let half_deg = ray.x.atan2(ray.z).to_degrees();
        assert!((half_deg - fov / 2.0).abs() < 1e-6, "{fov}: {half_deg}");
    }
}

#[test]
fn told_pinholes_bend_nothing_and_told_fisheyes_are_fisheyes() {
    let barrel = bent(row(ROLLS), [-0.08, 0.015, 0.0, 0.0], [0.0; 2]);
    let options = CameraOptions { lens: LensKind::Pinhole, ..CameraOptions::default() };
    let cameras = solved_by(&[CameraPrior::unknown(frame(), 0); 8], &matched(&barrel, 0.3, 0.0), &options);
    assert!(cameras.iter().all(|camera| camera.lens.is_pinhole()));

    // Two photographs of 100 degrees would pass for pinholes.
    let terms = LensTerms { projection: LensProjection::Equidistant, ..LensTerms::default() };
    let fisheye = |yaw| Camera { lens: Lens::new(terms), ..camera(458.4, yaw, 0.0, 2.0) };
    let truth = [fisheye(0.0), fisheye(40.0)];
    let options = CameraOptions { lens: LensKind::Fisheye, fov: 100.0, ..CameraOptions::default() };
    let cameras = solved_by(&[CameraPrior::unknown(frame(), 0); 2], &matched(&truth, 0.3, 0.0), &options);
    assert!(cameras.iter().all(|camera| camera.lens.is_fisheye()));
    assert!((cameras[0].focal_px / 458.4 - 1.0).abs() < 0.01, "{cameras:?}");
    assert!(worst_rotation_error(&truth, &cameras) < 0.1);
}

/// Photographs of which one's lens is told and the other's is not share none.
#[test]
fn a_lens_is_looked_for_where_none_was_told() {
    let truth = bent(row(ROLLS), [-0.08, 0.015, 0.0, 0.0], [0.0; 2]);
    let told = CameraPrior {
        lens: Some(PlacedLens { terms: truth[0].lens.terms(), center_px: [0.0; 2] }),
        ..CameraPrior::unknown(frame(), 0)
    };
    let mut priors = vec![CameraPrior::unknown(frame(), 0); 8];
    priors[3] = told;
    let cameras = solved_by(&priors, &matched(&truth, 0.3, 0.0), &CameraOptions::default());
    assert_eq!(cameras[3].lens, truth[3].lens);
    assert!(!cameras[0].lens.is_pinhole() && cameras[0].lens != cameras[3].lens);
    assert!(worst_rotation_error(&truth, &cameras) < 0.25);
}

/// By hand: 90 degrees across a pinhole's longer side are a focal length of half of it, and no pinhole sees half a
/// turn.
#[test]
fn a_told_field_of_view_and_a_told_focal_length_do_not_forget_each_other() {
    let of_project = CameraPrior { focal_px: Some(660.0), focal_told: true, ..CameraPrior::unknown(frame(), 0) };
    let recorded = CameraPrior { focal_told: false, ..of_project };
    let told = |prior: CameraPrior, fov: f64| {
        let told = prior.told_by(&CameraOptions { fov, lens: LensKind::Pinhole, ..CameraOptions::default() });
        (told.focal_px.map(f64::round), told.focal_told)
    };
    let half = 0.5 * of_project.longer();
    for (prior, fov, expected) in [
        (of_project, 0.0, (Some(660.0), true)),
        (of_project, 90.0, (Some(half), true)),
        (of_project, 200.0, (Some(660.0), true)),
        (recorded, 0.0, (Some(660.0), false)),
        (recorded, 90.0, (Some(half), true)),
        (recorded, 200.0, (Some(660.0), false)),
    ] {
        assert_eq!(told(prior, fov), expected, "{fov} degrees, told before: {}", prior.focal_told);
    }
}
