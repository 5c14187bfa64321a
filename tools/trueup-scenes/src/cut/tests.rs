//! Panoramas drawn by rule, so that every answer is known.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use tempfile::TempDir;
use trueup_core::geometry::{matrix_from_rows, rotation_about_x, rotation_about_z};
use trueup_core::raster::{Photograph, Raster};
use trueup_core::truth::{Level, LevelOrigin, Truth};
use trueup_core::{Error, Result, StageContext};

use super::*;

/// A panorama whose pixels are the mean of `value` over 3 x 3 directions each.
fn drawn(width: usize, value: impl Fn(Vector3<f64>) -> f64) -> Panorama360 {
    const SIDE: usize = 3;
    let height = width / 2;
    let place = |index: usize, sample: usize| index as f64 + (sample as f64 + 0.5) / SIDE as f64;
    let pixel = |x: usize, y: usize| {
        let samples = (0..SIDE * SIDE).map(|sample| {
            let longitude = (place(x, sample % SIDE) / width as f64 - 0.5) * TAU;
            let latitude = (place(y, sample / SIDE) / height as f64 - 0.5) * PI;
            let (sine, cosine) = longitude.sin_cos();
            value(Vector3::new(latitude.cos() * sine, latitude.sin(), latitude.cos() * cosine))
        });
        (samples.sum::<f64>() / (SIDE * SIDE) as f64).round() as u8
    };
    let data = (0..width * height).map(|index| pixel(index % width, index / width)).collect();
    let raster = Raster::from_data(width, height, 1, data).expect("matching size");
    Panorama360::new("drawn.png", Photograph::Eight(raster)).expect("twice as wide as high")
}

/// A hall of twenty upright stripes whose vertical is `down`.
fn striped(width: usize, down: Vector3<f64>) -> Panorama360 {
    let world_from_panorama = world_from_panorama(&down);
    drawn(width, |direction| {
        let world = world_from_panorama * direction;
        let stripe = (world.x.atan2(world.z) / TAU * 20.0).floor() as i64;
        if world.y.abs() > 0.7 { 120.0 } else { [60.0, 190.0][stripe.rem_euclid(2) as usize] }
    })
}

/// Linear in the direction, so that it is smooth across the back and the poles.
fn smooth(direction: Vector3<f64>) -> f64 {
    128.0 + direction.dot(&Vector3::new(60.0, 50.0, -70.0))
}

fn one_view(view: ViewSpec) -> CutSpec {
    CutSpec {
        down: Some([0.0, 1.0, 0.0]),
        width: 32,
        height: 24,
        hfov_deg: 60.0,
        views: vec![view],
        ..CutSpec::default()
    }
}

fn cut(panorama: &Panorama360, spec: &CutSpec) -> Result<(TempDir, Truth)> {
    let folder = TempDir::new().expect("a temporary folder");
    let truth = cut_set(panorama, spec, folder.path(), &StageContext::default())?;
    Ok((folder, truth))
}

fn message<T: std::fmt::Debug>(result: Result<T>) -> String {
    result.expect_err("an error").to_string()
}

#[test]
fn a_smooth_panorama_is_seamless_at_the_back_and_at_the_poles() {
    let panorama = drawn(256, smooth);
    let ring = |y: f64, x: f64, z: f64| {
        (0..90)
            .map(move |k| (f64::from(k) - 45.0) * 0.002)
            .map(move |t| Vector3::new(x + t, y, z + t / 3.0).normalize())
    };
    let back = ring(0.1, 0.0, -1.0);
    let poles = ring(1.0, 0.0, 0.0).chain(ring(-1.0, 0.0, 0.0));
    for direction in back.chain(poles).chain(ring(0.3, 1.0, 0.4)) {
        for value in panorama.color(&(direction * 3.0)) {
            assert!((f64::from(value) - smooth(direction)).abs() < 1.0, "{direction:?}: {value}");
        }
    }
}

#[test]
fn directions_of_pixel_centers_return_the_pixels() {
    let (width, height) = (16, 8);
    let data: Vec<u8> = (0..width * height).map(|index| (index * 37 % 251) as u8).collect();
    let raster = Raster::from_data(width, height, 1, data.clone()).expect("matching size");
    let panorama = Panorama360::new("pixels", Photograph::Eight(raster)).expect("2:1");
    for (index, &expected) in data.iter().enumerate() {
        let longitude = ((index % width) as f64 + 0.5 - 8.0) * TAU / 16.0;
        let latitude = ((index / width) as f64 + 0.5 - 4.0) * PI / 8.0;
        let (sine, cosine) = longitude.sin_cos();
        let direction = Vector3::new(latitude.cos() * sine, latitude.sin(), latitude.cos() * cosine);
        for value in panorama.color(&direction) {
            assert!((value - f32::from(expected)).abs() < 1e-3, "pixel {index}: {value} {expected}");
        }
    }
}

/// Pixels of views in six directions are the values of the directions they look at, with the gain.
#[test]
fn the_middle_of_a_view_looks_where_its_angles_say() {
    let panorama = drawn(512, smooth);
    let axes = [
        (0.0, 0.0, Vector3::z()),
        (90.0, 0.0, Vector3::x()),
        (180.0, 0.0, -Vector3::z()),
        (-90.0, 0.0, -Vector3::x()),
        (0.0, 90.0, -Vector3::y()),
        (0.0, -90.0, Vector3::y()),
    ];
    for (yaw, pitch, axis) in axes {
        let spec = CutSpec { width: 33, height: 25, ..one_view(ViewSpec { yaw, pitch, ..ViewSpec::default() }) };
        let view = spec.camera_of(&spec.views[0]);
        let picture = view.take(&panorama, 2, |_| view::to_bytes, &StageContext::default()).expect("a view");
        let middle = f64::from(picture.pixel(16, 12)[0]);
        assert!((middle - smooth(axis)).abs() < 1.5, "yaw {yaw}, pitch {pitch}: {middle}, not {}", smooth(axis));
    }
}

/// A vertical that leans to the right of the panorama by two degrees shows so ahead, and towards the viewer at the
/// right.
#[test]
fn the_truth_refers_to_the_scenes_vertical() {
    let two_degrees = 2.0_f64.to_radians();
    let down = [3.0 * two_degrees.sin(), 3.0 * two_degrees.cos(), 0.0];
    let views = [0.0, 90.0].map(|yaw| ViewSpec { yaw, ..ViewSpec::default() });
    let spec = CutSpec { down: Some(down), views: views.to_vec(), ..one_view(views[0]) };
    let (folder, truth) = cut(&drawn(64, smooth), &spec).expect("a set");
    assert!((truth.images[0].gamma_deg - 2.0).abs() < 1e-12);
    assert!(truth.images[1].gamma_deg.abs() < 1e-12);
    let seen = truth.images[1].camera_from_world() * Vector3::y();
    assert!((seen - Vector3::new(0.0, two_degrees.cos(), two_degrees.sin())).norm() < 1e-12);
    // 16 / tan 30 degrees.
    assert!((truth.images[0].focal_px - 27.712_812_921_102_035).abs() < 1e-9);
    assert_eq!(truth.level.as_ref().map(|level| level.origin), Some(LevelOrigin::Given));
    let text = std::fs::read_to_string(folder.path().join("truth.json")).expect("a truth file");
    let stored: Truth = serde_json::from_str(&text).expect("valid truth");
    stored.check("truth.json").expect("sound truth");
    let turn = stored.images[1].camera_from_world() - truth.images[1].camera_from_world();
    assert!(stored.images.len() == 2 && turn.norm() < 1e-12);
    assert!(folder.path().join("01.jpg").is_file());
}

#[test]
fn the_world_turns_the_shortest_way() {
    let down = rotation_about_x(0.02) * rotation_about_z(-0.03) * Vector3::y();
    let turn = world_from_panorama(&(down * 7.0));
    assert!((turn * down - Vector3::y()).norm() < 1e-14);
    // The axis of the shortest turn is level, and stays.
    let axis = Vector3::y().cross(&down);
    assert!((turn * axis - axis).norm() < 1e-14);
    assert_eq!(
        world_from_panorama(&Vector3::y()),
        matrix_from_rows(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    );
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let panorama = drawn(128, smooth);
    let spec = one_view(ViewSpec { gain: 1.1, noise: 4.0, ..ViewSpec::default() });
    let on_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let (folder, _) = pool.install(|| cut(&panorama, &spec)).expect("a set");
        std::fs::read(folder.path().join("00.jpg")).expect("a picture")
    };
    assert_eq!(on_threads(1), on_threads(2));
}

#[test]
fn a_tilted_panoramas_level_is_recovered() {
    let check = |down: Vector3<f64>, level: &Level| {
        let error_deg = down.cross(&Vector3::from(level.down)).norm().asin().to_degrees();
        assert_eq!(level.origin, LevelOrigin::Measured, "{level:?}");
        assert!(error_deg < 0.05, "off by {error_deg} degrees: {level:?}");
    };
    let down = rotation_about_x(0.03) * rotation_about_z(0.02) * Vector3::y();
    let level = measure_level(&striped(1024, down), &LevelOptions::default(), &StageContext::default());
    check(down, &level.expect("a level"));
    // A spec that does not say where the vertical points has it measured.
    let down = rotation_about_x(-0.045) * Vector3::y();
    let spec = CutSpec { down: None, ..one_view(ViewSpec::default()) };
    let truth = cut(&striped(1024, down), &spec).expect("a set").1;
    check(down, truth.level.as_ref().expect("a level"));
}

/// The level is not believed where there is nothing to measure, nor where half of the scene leans.
#[test]
fn an_uncertain_level_is_refused() {
    let measure = |panorama: &Panorama360| {
        measure_level(panorama, &LevelOptions::default(), &StageContext::default()).expect("an answer")
    };
    let empty = measure(&drawn(512, smooth));
    assert_eq!((empty.origin, empty.down), (LevelOrigin::Panorama, [0.0, 1.0, 0.0]));
    assert!(empty.reason.is_some());

    let (left, right) = (rotation_about_z(0.03) * Vector3::y(), rotation_about_z(-0.03) * Vector3::y());
    let turns = [left, right].map(|down| world_from_panorama(&down));
    // Columns of views alternate every 30 degrees, the first one ahead: odd ones see another vertical.
    let torn = measure(&drawn(1024, |direction| {
        let column = (direction.x.atan2(direction.z) / TAU * 12.0).round() as i64;
        let world = turns[column.rem_euclid(2) as usize] * direction;
        let stripe = (world.x.atan2(world.z) / TAU * 60.0).floor() as i64;
        [60.0, 190.0][stripe.rem_euclid(2) as usize]
    }));
    assert_eq!((torn.origin, torn.down), (LevelOrigin::Panorama, [0.0, 1.0, 0.0]));
    assert!(torn.reason.as_ref().is_some_and(|reason| reason.contains("halves")), "{torn:?}");
}

#[test]
fn panoramas_of_another_shape_are_refused_with_their_size() {
    let shape = |width, height| Panorama360::new("wide.jpg", Photograph::Eight(Raster::new(width, height, 3)));
    assert!(shape(64, 32).is_ok() && shape(63, 32).is_ok() && shape(65, 32).is_ok());
    for (width, height) in [(66, 32), (62, 32), (32, 64), (0, 0)] {
        let text = message(shape(width, height));
        assert!(text.contains(&format!("{width} x {height} px")) && text.contains("twice as wide as high"), "{text}");
    }
}

#[test]
fn missing_files_and_empty_folders_are_named() {
    let folder = TempDir::new().expect("a temporary folder");
    let read =
        |path: &std::path::Path| message(Panorama360::read(&path.display().to_string(), &StageContext::default()));
    assert!(read(folder.path()).contains("holds no"));
    let missing = read(&folder.path().join("none.jpg"));
    assert!(missing.contains("none.jpg") && missing.contains("no such file"), "{missing}");
    assert!(matches!(CutSpec::read(&folder.path().join("none.json")), Err(Error::Io { .. })));
}

#[test]
fn every_number_of_a_spec_is_checked() {
    let check = |spec: CutSpec| spec.check("spec.json").map_or_else(|error| error.to_string(), |()| String::new());
    let view = |view: ViewSpec| check(one_view(view));
    let plain = ViewSpec::default();
    assert_eq!(view(plain), "");
    assert!(view(ViewSpec { yaw: f64::NAN, ..plain }).contains("views[0]: yaw is NaN"));
    assert!(view(ViewSpec { pitch: 91.0, ..plain }).contains("pitch is 91"));
    assert!(view(ViewSpec { roll: f64::INFINITY, ..plain }).contains("roll"));
    assert!(view(ViewSpec { hfov_deg: Some(4.9), ..plain }).contains("from 5 to 150"));
    assert!(view(ViewSpec { hfov_deg: Some(150.1), ..plain }).contains("from 5 to 150"));
    assert!(view(ViewSpec { width: Some(0), ..plain }).contains("0 x 24"));
    assert!(view(ViewSpec { height: Some(16_385), ..plain }).contains("32 x 16385"));
    assert!(view(ViewSpec { gain: 0.0, ..plain }).contains("gain"));
    assert!(view(ViewSpec { noise: -1.0, ..plain }).contains("noise"));
    assert!(check(CutSpec { views: Vec::new(), ..one_view(plain) }).contains("no views"));
    assert!(check(CutSpec { down: Some([0.0; 3]), ..one_view(plain) }).contains("below the panorama's horizon"));
    assert!(check(CutSpec { down: Some([0.0, f64::NAN, 0.0]), ..one_view(plain) }).contains("down"));
    let level = Some(Level::plain(LevelOrigin::Measured, [0.1, 0.99, 0.0]));
    assert!(check(CutSpec { level: level.clone(), ..one_view(plain) }).contains("same direction"));
    assert!(check(CutSpec { level, down: None, ..one_view(plain) }).contains("no down"));
}

#[test]
fn spec_files_deny_unknown_fields() {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join("spec.json");
    let read = |text: &str| {
        std::fs::write(&path, text).expect("writing a test file");
        CutSpec::read(&path)
    };
    let spec = read(r#"{"width": 8, "height": 6, "hfov_deg": 60, "views": [{"yaw": 1}]}"#).expect("a spec");
    assert_eq!((spec.down, spec.views[0]), (None, ViewSpec { yaw: 1.0, ..ViewSpec::default() }));
    let unknown = message(read(r#"{"width": 8, "height": 6, "hfov_deg": 60, "views": [{"yaw": 1, "jaw": 2}]}"#));
    assert!(unknown.contains("spec.json") && unknown.contains("jaw"), "{unknown}");
    let empty = message(read(r#"{"width": 8, "height": 6, "hfov_deg": 60, "views": []}"#));
    assert!(empty.contains("no views"), "{empty}");
}

#[test]
fn kinds_have_the_geometry_they_claim() {
    let raster = Raster::<u8>::new(4096, 2048, 1);
    let panorama = Panorama360::new("place.jpg", Photograph::Eight(raster)).expect("2:1");
    let level = Level::plain(LevelOrigin::Measured, [0.0, 1.0, 0.0]);
    let options = SpecOptions { yaw_deg: 30.0, ..SpecOptions::default() };
    let still = SpecOptions { aim_sd_deg: 0.0, roll_sd_deg: 0.0, gain_sd: 0.0, ..options.clone() };
    let make = |word: &str, options: &SpecOptions| {
        let kind: SpecKind = word.parse().expect("a kind");
        assert_eq!(kind.to_string(), word);
        make_spec(&panorama, kind, &level, options).expect("a spec")
    };
    // 4096 / 360 * 62 * 1.05 = 740.7 px: 46 steps of 16; three quarters are 34.5 steps, to the even 34.
    let row = make("row", &still);
    assert_eq!((row.width, row.height, row.pano.as_deref()), (736, 544, Some("place")));
    let aims = |spec: &CutSpec| spec.views.iter().map(|view| (view.yaw, view.pitch)).collect::<Vec<_>>();
    assert_eq!((row.views.len(), aims(&row)[0], aims(&row)[8]), (9, (-60.0, 0.0), (132.0, 0.0)));
    assert_eq!(aims(&make("tilt", &still))[5], (90.0, 22.0));
    let grid = aims(&make("grid", &still));
    assert_eq!((grid.len(), grid[0], grid[7], grid[20]), (21, (-42.0, -20.0), (-42.0, 2.0), (114.0, 24.0)));
    assert_eq!((make("full", &still).views.len(), aims(&make("full", &still))[15]), (16, (367.5, 0.0)));
    assert_eq!(aims(&make("few", &still)), [(30.0, 0.0), (56.0, 0.0), (82.0, 0.0)]);
    // Longer sets extend shorter ones, and elevations share their draws.
    assert_eq!(make("few5", &options).views[..2], make("few2", &options).views);
    let [level_row, lifted_row] = ["pitch0", "pitch40"].map(|word| make(word, &options).views);
    assert_eq!((level_row.len(), lifted_row.len()), (6, 6));
    for (low, high) in level_row.iter().zip(&lifted_row) {
        assert!((high.pitch - low.pitch - 40.0).abs() < 2e-3 && (low.yaw, low.roll) == (high.yaw, high.roll));
    }
    assert_eq!(SpecKind::of_word("pitch").expect("a sweep").len(), 4);
    for word in ["", "rows", "few1", "few14", "pitch61", "pitch-61", "pitchx"] {
        assert!(SpecKind::of_word(word).is_err(), "{word}");
    }
    let other = make_spec(&panorama, SpecKind::Row, &level, &SpecOptions { seed: 2, ..options.clone() });
    assert_ne!(other.expect("a spec").views, make("row", &options).views);
}
