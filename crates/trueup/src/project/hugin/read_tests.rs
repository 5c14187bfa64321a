use super::*;

fn project(image: &str) -> Result<HuginProject> {
    HuginProject::parse(&format!("p f2 w3600 h1800 v360 n\"TIFF\"\ni w800 h600 {image} n\"a.jpg\"\n"), "a.pto")
}

/// By hand: 400 / tan 30 = 692.82 px; 800 px over 2 radians are 400 px.
#[test]
fn focal_lengths_are_those_of_the_field_of_view() {
    let focal = |image: &str| project(image).expect("a project").images[0].focal_px;
    assert!((focal("f0 v60") - 692.820_323).abs() < 1e-6);
    assert!((focal(&format!("f3 v{}", 2.0_f64.to_degrees())) - 400.0).abs() < 1e-9);
    let HuginProject { images, projection, px_per_radian, .. } = project("f0 v60 y90 p-30 r5").expect("a project");
    assert_eq!((projection, images[0].lens), (Some(Projection::Equirectangular), None));
    assert!((px_per_radian.expect("told") - 3600.0 / std::f64::consts::TAU).abs() < 1e-9);
    assert!((images[0].attitude[1] + PI / 6.0).abs() < 1e-12);
}

/// Hugin's formula is computed here by hand: r is in units of 300 px, half the shorter side.
#[test]
fn lenses_bend_as_hugins() {
    for (image, projection) in [
        ("f0 v62 a0.004 b-0.03 c0.002 d5 e-3", LensProjection::Rectilinear),
        ("f0 v95 a0 b-0.05 c0", LensProjection::Rectilinear),
        ("f3 v140 a0 b-0.02 c0", LensProjection::Equidistant),
    ] {
        let image = project(image).expect("a project").images.remove(0);
        let lens = image.lens.expect("a lens");
        assert_eq!(lens.terms.projection, projection);
        let of = |name: &str| match (image.lens.map(|lens| lens.center_px), name) {
            (Some([5.0, -3.0]), "f") => 400.0 / 31_f64.to_radians().tan(),
            (_, "f") if projection == LensProjection::Rectilinear => 400.0 / 47.5_f64.to_radians().tan(),
            _ => 800.0 / 140_f64.to_radians(),
        };
        let terms = match lens.center_px {
            [5.0, -3.0] => [0.004, -0.03, 0.002],
            _ if projection == LensProjection::Rectilinear => [0.0, -0.05, 0.0],
            _ => [0.0, -0.02, 0.0],
        };
        for step in 1..=10 {
            let alone = 0.05 * f64::from(step);
            let r = of("f") * alone / 300.0;
            let [a, b, c] = terms;
            let by_hugin = 300.0 * r * (a * r.powi(3) + b * r * r + c * r + 1.0 - a - b - c);
            let ray = match projection {
                LensProjection::Rectilinear => nalgebra::Vector3::new(alone, 0.0, 1.0),
                LensProjection::Equidistant => nalgebra::Vector3::new(alone.sin(), 0.0, alone.cos()),
            };
            let found = Lens::new(lens.terms).place(ray).expect("in front").x * image.focal_px;
            assert!((found - by_hugin).abs() < 0.1, "{projection:?} {alone}: {found} {by_hugin}");
        }
    }
}

/// Hugin's order is left, right, top, bottom; a circle may reach beyond the picture.
#[test]
fn what_is_cropped_is_left_out() {
    let inset = |image: &str| project(image).expect("a project").images[0].inset.sides();
    assert_eq!(inset("f0 v60 S10,780,30,560"), [10, 30, 20, 40]);
    assert_eq!(inset("f2 v180 S-20,820,-100,700"), [0; 4]);
    assert!(project("f0 v60 S500,400,0,600").expect_err("nothing").to_string().contains("its crop (S) leaves nothing"));
}

#[test]
fn what_is_not_read_is_named() {
    let refused = |image: &str| project(image).expect_err("refused").to_string();
    assert!(refused("f4 v60").contains("a.jpg in a.pto: lenses of type 4"));
    assert!(refused("f0 v60 TrX0.1").contains("its camera moved"));
    assert!(refused("f0 v60 g0.1").contains("sheared"));
    assert!(refused("f0 v180").contains("180 degrees is no field of view"));
    assert!(refused("f0").contains("0 degrees is no field of view"));
    assert!(refused("f0 v60 b-0.9").contains("its lens (a, b, c) is none"));
    assert!(refused("f0 v60 d4000").contains("its center (d, e)"));
}
