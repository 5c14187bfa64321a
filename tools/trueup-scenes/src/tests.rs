//! What must hold of the crate as a whole.

use std::sync::OnceLock;

use trueup_core::StageContext;

use crate::bvh::Hierarchy;
use crate::material::{Pattern, SurfaceMaterial};
use crate::render::depth_map;
use crate::scene::unlit::UnlitScene;
use crate::solid::{Solid, SolidShape};
use crate::study::study_set;
use crate::*;

fn scene(kind: SceneKind) -> LitScene {
    let options = SceneOptions { kind, light: LightQuality::Fast, ..SceneOptions::default() };
    LitScene::new(&options).expect("valid options")
}

fn room() -> &'static LitScene {
    static ROOM: OnceLock<LitScene> = OnceLock::new();
    ROOM.get_or_init(|| scene(SceneKind::Room))
}

/// The room with a small self-luminous ball in it: a target whose picture can be found exactly.
fn room_with_marker(center: [f64; 3], radius_m: f64) -> LitScene {
    let mut scene = room().clone();
    let UnlitScene { solids, materials, hierarchy, .. } = &mut scene.unlit;
    materials.push(SurfaceMaterial::new(Pattern::Paint, 1.0, [0xff_0000; 3]).emitting(1e3));
    solids.push(Solid {
        shape: SolidShape::Ellipsoid,
        center: nalgebra::Vector3::from(center),
        half: nalgebra::Vector3::repeat(radius_m),
        world_from_body: None,
        faces: [materials.len() - 1; 6],
        texture_center: nalgebra::Vector3::zeros(),
        seed: 0,
    });
    *hierarchy = Hierarchy::new(solids);
    scene
}

fn small_rig(translation_fraction: f64) -> Vec<PosedCamera> {
    let options = RigOptions { width: 96, height: 72, translation_fraction, ..RigOptions::default() };
    rig(&options, &room().viewpoint()).expect("valid options")
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(work)
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    for kind in [SceneKind::Room, SceneKind::Nature] {
        let work = || {
            let scene = scene(kind);
            let cameras = rig(&RigOptions { width: 96, height: 72, ..RigOptions::default() }, &scene.viewpoint());
            render(&scene, &cameras.expect("valid options")[1], Quality::Preview)
        };
        assert_eq!(on_threads(1, work), on_threads(2, work));
    }
}

#[test]
fn every_kind_of_scene_fills_its_picture() {
    for kind in [SceneKind::Room, SceneKind::Street, SceneKind::Nature] {
        let scene = scene(kind);
        let cameras = rig(&RigOptions { width: 80, height: 60, ..RigOptions::default() }, &scene.viewpoint());
        let picture = render(&scene, &cameras.expect("valid options")[2], Quality::Preview);
        let values: Vec<f64> = picture.data().iter().map(|&value| f64::from(value)).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
        assert!((40.0..220.0).contains(&mean) && deviation > 20.0, "{kind:?}: mean {mean}, deviation {deviation}");
    }
}

/// A red-hot ball is rendered in a rolled, lifted, turned camera; the centroid of what it adds to the picture must be
/// where the camera model says.
#[test]
fn a_marker_shows_where_the_camera_projects_it() {
    let mut options = RigOptions { width: 320, height: 240, noise: 0.0, roll_sd_deg: 8.0, ..RigOptions::default() };
    options.translation_fraction = 0.05;
    let posed = rig(&options, &room().viewpoint()).expect("valid options")[3];
    let (pixel_x, pixel_y, distance) = (101.3, 83.7, 0.8);
    let direction = posed.camera.world_direction(nalgebra::Vector2::new(pixel_x, pixel_y));
    let marker: [f64; 3] = (nalgebra::Vector3::from(posed.center) + direction * distance).into();
    let projected = posed.project(marker).expect("in front");
    assert!((projected[0] - pixel_x).abs() < 1e-9 && (projected[1] - pixel_y).abs() < 1e-9);

    let marked = room_with_marker(marker, 0.01);
    let before = render(room(), &posed, Quality::Standard);
    let after = render(&marked, &posed, Quality::Standard);
    let (mut sum, mut x_sum, mut y_sum) = (0.0, 0.0, 0.0);
    for y in 71..97 {
        for x in 88..115 {
            // Whatever it covers, bright or dark, gains red and loses green. Its shadow loses both; its image in
            // polished wood lies further off.
            let (old, new) = (before.pixel(x, y), after.pixel(x, y));
            let weight = f64::from(u8::from(new[0] > old[0] && new[1] < old[1]));
            sum += weight;
            x_sum += weight * (x as f64 + 0.5);
            y_sum += weight * (y as f64 + 0.5);
        }
    }
    assert!(sum > 0.0);
    let (x, y) = (x_sum / sum, y_sum / sum);
    assert!((x - pixel_x).abs() < 0.3 && (y - pixel_y).abs() < 0.3, "({x}, {y})");
}

/// A camera that looks straight ahead, rolled clockwise by 10 degrees, sees the vertical lean: the world's down has
/// camera coordinates (sin 10, cos 10, 0), worked out by hand, so the angle is +10 degrees.
#[test]
fn the_vertical_angle_has_the_sign_of_the_roll() {
    let mut posed = PosedCamera::level([0.0, -1.5, 0.0], 0.0, 64, 48, 60.0);
    assert!(posed.vertical_angle().abs() < 1e-12);
    posed.camera.set_rotation(&camera_from_world(0.0, 0.0, 10.0));
    assert!((posed.vertical_angle().to_degrees() - 10.0).abs() < 1e-9);
    // The foot of a plumb line then lies to the right of its top in the picture.
    let (top, foot) = (posed.project([0.0, -2.0, 4.0]).expect("seen"), posed.project([0.0, -1.0, 4.0]).expect("seen"));
    assert!(foot[0] > top[0] && foot[1] > top[1]);
}

#[test]
fn yaw_turns_right_and_pitch_looks_up() {
    let mut posed = PosedCamera::level([0.0; 3], 90.0, 64, 48, 60.0);
    assert!((posed.project([5.0, 0.0, 0.0]).expect("ahead")[0] - 32.0).abs() < 1e-9);
    posed.camera.set_rotation(&camera_from_world(0.0, 30.0, 0.0));
    let above = posed.project([0.0, -1.0, 3.0_f64.sqrt()]).expect("ahead");
    assert!((above[1] - 24.0).abs() < 1e-9);
}

#[test]
fn without_translation_all_cameras_share_one_center() {
    let still = small_rig(0.0);
    assert!(still.iter().all(|posed| posed.center == room().viewpoint().eye));
    let wandering = small_rig(0.05);
    let reach = 0.05 * room().viewpoint().depth_m;
    let distances = wandering
        .iter()
        .map(|posed| (nalgebra::Vector3::from(posed.center) - nalgebra::Vector3::from(room().viewpoint().eye)).norm());
    assert!(distances.clone().all(|distance| distance <= reach) && distances.fold(0.0, f64::max) > 0.2 * reach);
    // The rest of the rig is the same.
    assert_eq!(still[2].camera, wandering[2].camera);
}

#[test]
fn depth_agrees_with_parallel_projection() {
    let posed = small_rig(0.0)[0];
    let depths = depth_map(room(), &posed);
    assert!(depths.data().iter().all(|&depth| depth > 0.1));
    // A marker nearer than everything else takes the place of what was there.
    let pixel = nalgebra::Vector2::new(48.5, 36.5);
    let direction = posed.camera.world_direction(pixel);
    let center = nalgebra::Vector3::from(posed.center) + direction * 0.5;
    let marked = room_with_marker(center.into(), 0.1);
    let along = direction.dot(&(posed.camera.rotation().transpose() * nalgebra::Vector3::z()));
    let expected = 0.4 * along;
    assert!((f64::from(depth_map(&marked, &posed).pixel(48, 36)[0]) - expected).abs() < 1e-5);
}

#[test]
fn truth_is_written_as_the_readers_expect_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let cameras = small_rig(0.01);
    let context = StageContext::default();
    let output = SetOutput { quality: Quality::Preview, depth: false };
    let truth = write_set(folder.path(), "room 1", room(), &cameras[..2], output, &context).expect("written");
    let text = std::fs::read_to_string(folder.path().join("truth.json")).expect("there");
    assert_eq!(
        serde_json::from_str::<trueup_core::truth::Truth>(&text).expect("parses").images.len(),
        truth.images.len()
    );
    let value: serde_json::Value = serde_json::from_str(&text).expect("parses");
    let image = &value["images"][1];
    assert_eq!(image["file"], "01.jpg");
    assert_eq!((&image["width"], &image["height"]), (&96.into(), &72.into()));
    // Reading decimal numbers may cost the last digit.
    let entry = image["R"][2][1].as_f64().expect("a number");
    assert!((entry - cameras[1].camera.camera_from_world[2][1]).abs() < 1e-12);
    let row = |k: usize| image["R"][k][1].as_f64().expect("a number");
    let gamma = row(0).atan2(row(1)).to_degrees();
    assert!((image["gamma_deg"].as_f64().expect("a number") - gamma).abs() < 1e-9);
    let jpeg = std::fs::read(folder.path().join("01.jpg")).expect("there");
    assert_eq!(jpeg[..3], [0xff, 0xd8, 0xff]);
    // One scan, as cameras write it: within entropy-coded data the marker cannot occur.
    assert_eq!(jpeg.windows(2).filter(|marker| marker == &[0xff, 0xda]).count(), 1);
}

#[test]
fn bad_options_are_listed_and_odd_sizes_are_sane() {
    let bad = RigOptions { pictures: 0, hfov_deg: f64::NAN, ..RigOptions::default() };
    let error = rig(&bad, &room().viewpoint()).expect_err("two bad options").to_string();
    assert!(error.contains("rig.pictures") && error.contains("rig.hfov_deg"));
    let eye = room().viewpoint().eye;
    assert_eq!(render(room(), &PosedCamera::level(eye, 0.0, 1, 1, 60.0), Quality::Standard).data().len(), 3);
    assert!(render(room(), &PosedCamera::level(eye, 0.0, 0, 4, 60.0), Quality::Preview).data().is_empty());
}

#[test]
fn the_study_has_twelve_sets_of_5_to_72_pictures() {
    assert!(study_set(0).is_none() && study_set(13).is_none());
    for number in 1..=12 {
        let (scene, options) = study_set(number).expect("a set");
        assert_eq!(scene.kind == SceneKind::Room, number <= 6);
        assert!((5..=72).contains(&options.pictures));
        assert_eq!(rig(&options, &room().viewpoint()).expect("valid options").len(), options.pictures);
    }
}

/// One sample where nothing ends must come closer to nine everywhere than one everywhere does.
#[test]
fn adaptive_sampling_comes_close_to_many_samples() {
    let mut posed = small_rig(0.0)[2];
    posed.noise = 0.0;
    let error = |quality| {
        let (picture, fine) = (render(room(), &posed, quality), render(room(), &posed, Quality::Fine));
        let differences = picture.data().iter().zip(fine.data()).map(|(&a, &b)| f64::from(a.abs_diff(b)));
        differences.sum::<f64>() / picture.data().len() as f64
    };
    let (rough, adaptive) = (error(Quality::Preview), error(Quality::Standard));
    assert!(adaptive < 0.6 * rough && adaptive < 4.0, "{adaptive} against {rough}");
}

/// Bodies stand upright at five different turns at least, where a quarter turn counts as none.
#[test]
fn a_turned_room_keeps_its_vertical_and_gives_up_its_horizontals() {
    let scene = UnlitScene::new(&SceneOptions { kind: SceneKind::TurnedRoom, ..SceneOptions::default() });
    let scene = scene.expect("valid options");
    let mut quarter_turns = std::collections::BTreeSet::new();
    for rotation in scene.solids.iter().filter_map(|solid| solid.world_from_body) {
        if (rotation[(1, 1)] - 1.0).abs() < 1e-9 {
            let yaw = rotation[(0, 2)].atan2(rotation[(2, 2)]).to_degrees().rem_euclid(90.0);
            quarter_turns.insert((10.0 * yaw) as i64);
        }
    }
    assert!(quarter_turns.len() >= 5, "{quarter_turns:?}");
}
