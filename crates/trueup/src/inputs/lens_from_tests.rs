use trueup_core::lens::LensTerms;

use super::*;

fn image(width: usize, height: usize, orientation: u8) -> SourceImage {
    SourceImage { orientation, ..SourceImage::unknown("a.jpg", "a.jpg", [width, height]) }
}

fn known(focal: f64) -> KnownLens {
    let terms = LensTerms { radial: [-0.1, 0.02, 0.0, 0.0], tangential: [1e-3, 2e-3], ..LensTerms::default() };
    KnownLens { shape: 1.5, camera: None, focal, lens: PlacedLens { terms, center_px: [0.01, 0.002] } }
}

/// By hand: a picture of 600 x 400 held upright by a quarter turn clockwise has what lay right of the middle below it,
/// and what lay below it to the left.
#[test]
fn a_lens_turns_with_the_photograph_and_grows_with_it() {
    let mut upright = image(400, 600, 6);
    known(0.8).tell(&mut upright);
    let told = upright.lens.expect("told");
    assert_eq!(upright.focal_prior, Some(FocalPrior { focal_px: 480.0, source: FocalSource::Project }));
    assert!((told.center_px[0] + 1.2).abs() < 1e-12 && (told.center_px[1] - 6.0).abs() < 1e-12, "{told:?}");
    // (p2, p1) = (2e-3, 1e-3) becomes (-1e-3, 2e-3).
    assert_eq!(told.terms.tangential, [2e-3, -1e-3]);
    assert_eq!(told.terms.radial, [-0.1, 0.02, 0.0, 0.0]);
    let mut somehow = image(400, 600, 1);
    known(0.8).tell(&mut somehow);
    let told = somehow.lens.expect("told");
    assert_eq!((told.center_px, told.terms.tangential), ([0.0; 2], [0.0; 2]));
}

/// The turned lens sends a turned ray to the turned place, whatever the turn.
#[test]
fn a_turned_lens_sees_what_the_lens_saw() {
    use nalgebra::{Vector2, Vector3};
    use trueup_core::lens::Lens;
    let lens = known(1.0).lens;
    for quarters in 0..4_u8 {
        let turned = lens.turned(quarters);
        for (x, y) in [(0.3, 0.1), (-0.5, 0.4), (0.2, -0.6)] {
            let about = |[x, y]: [f64; 2]| (0..quarters).fold([x, y], |[x, y], _| [-y, x]);
            let place = Lens::new(lens.terms).place(Vector3::new(x, y, 1.0)).expect("in front");
            let [turned_x, turned_y] = about([x, y]);
            let found = Lens::new(turned.terms).place(Vector3::new(turned_x, turned_y, 1.0)).expect("in front");
            assert!((found - Vector2::from(about(place.into()))).norm() < 1e-12, "{quarters}");
        }
    }
}

#[test]
fn a_lens_is_for_its_shape_its_camera_and_its_setting() {
    let lenses = [known(0.8), known(0.81), known(1.6)];
    assert!(lens_for(&lenses, &image(400, 300, 1)).is_err(), "another shape");
    assert_eq!(lens_for(&lenses[..2], &image(300, 200, 1)), Ok(&lenses[1]));
    assert!(lens_for(&lenses, &image(300, 200, 1)).is_err(), "two settings");
    let stated = |focal_px| SourceImage {
        focal_prior: Some(FocalPrior { focal_px, source: FocalSource::Equivalent35mm }),
        ..image(300, 200, 1)
    };
    assert_eq!(lens_for(&lenses, &stated(470.0)), Ok(&lenses[2]));
    assert!(lens_for(&lenses, &stated(350.0)).is_err(), "a setting that is not among them");
    let mine = [KnownLens { camera: Some("Mine".to_owned()), ..known(0.8) }];
    let other = SourceImage { camera_model: Some("Other".to_owned()), ..image(300, 200, 1) };
    assert!(lens_for(&mine, &other).is_err() && lens_for(&mine, &image(300, 200, 1)).is_ok());
}

#[test]
fn a_photograph_in_place_of_a_project_is_refused_in_words() {
    let desk = tempfile::tempdir().expect("a folder");
    let file = desk.path().join("photo.jpg");
    std::fs::write(&file, [0xff, 0xd8, 0xff]).expect("written");
    let message = tell_lenses(&file, &mut [], &StageContext::default()).expect_err("no project").to_string();
    assert!(message.contains("photo.jpg: it is no text in UTF-8 ("), "{message}");
}
