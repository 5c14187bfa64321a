//! A full turn from photographs to file: its ends meet in every front and however it is composed.

use std::sync::OnceLock;

use image::{GrayImage, Luma};
use trueup_scenes::{LightQuality, LitScene, Quality, RigOptions, RoomStyle, SceneKind, SceneOptions, render, rig};

use crate::pictures::jpeg;
use crate::run::{Desk, finish, trueup};

const WIDTH: usize = 360;
const HEIGHT: usize = 270;
const COUNT: usize = 10;

/// Photographs of a room all the way round, as JPEG files.
pub(crate) fn photographs() -> &'static [Vec<u8>] {
    static FILES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    FILES.get_or_init(|| {
        let (kind, style, light) = (SceneKind::Room, RoomStyle::Library, LightQuality::Fast);
        let scene = LitScene::new(&SceneOptions { kind, style, seed: 103, light }).expect("a valid scene");
        let options = RigOptions {
            pictures: COUNT,
            width: WIDTH,
            height: HEIGHT,
            hfov_deg: 65.0,
            yaw_step_deg: 360.0 / COUNT as f64,
            roll_sd_deg: 3.0,
            translation_fraction: 0.0,
            ..RigOptions::default()
        };
        let cameras = rig(&options, &scene.viewpoint()).expect("valid options");
        let pictures = cameras.iter().map(|camera| render(&scene, camera, Quality::Preview));
        pictures.map(|picture| jpeg(picture.data(), WIDTH, HEIGHT)).collect()
    })
}

fn desk() -> Desk {
    let desk = Desk::new();
    std::fs::create_dir(desk.join("room")).expect("made");
    for (number, bytes) in photographs().iter().enumerate() {
        desk.put(&format!("room/{number}.jpg"), bytes);
    }
    desk
}

/// A panorama's luma, and the mean difference of its columns `left` and `right`.
fn difference(desk: &Desk, name: &str, pairs: impl Iterator<Item = (u32, u32)>) -> f64 {
    let picture = image::open(desk.join(name)).expect("a panorama").to_rgba8();
    let mut differences = Vec::new();
    for (left, right) in pairs {
        for y in 0..picture.height() {
            let (a, b) =
                (picture.get_pixel(left % picture.width(), y).0, picture.get_pixel(right % picture.width(), y).0);
            if a[3] == 255 && b[3] == 255 {
                differences.extend((0..3).map(|channel| f64::from(a[channel].abs_diff(b[channel]))));
            }
        }
    }
    assert!(!differences.is_empty());
    differences.iter().sum::<f64>() / differences.len() as f64
}

/// The last column beside the first differs no more than neighbors do elsewhere.
fn assert_ends_meet(desk: &Desk, name: &str) {
    let (width, _) = image::image_dimensions(desk.join(name)).expect("a panorama");
    let across = difference(desk, name, [(width - 1, 0)].into_iter());
    let elsewhere = difference(desk, name, (0..width - 1).map(|x| (x, x + 1)));
    assert!(across < 1.5 * elsewhere + 1.0, "{name}: {across:.2} across the ends, {elsewhere:.2} elsewhere");
}

#[test]
fn the_ends_meet_however_it_is_composed() {
    let desk = desk();
    let stitch = |name: &str, more: &[&str]| {
        let arguments = [&["stitch", "room", "-o", name, "--project", "pano.json", "--require-all"], more].concat();
        finish(trueup(desk.path(), &arguments))
    };
    let run = stitch("pano.png", &["--threads", "1"]);
    assert!(run.expect_success().contains("a full turn: the ends meet"), "{}", run.stdout);
    let one_thread = desk.read("pano.png");
    assert_ends_meet(&desk, "pano.png");
    stitch("pano.png", &["--threads", "3"]).expect_success();
    assert!(desk.read("pano.png") == one_thread, "three threads give another panorama");
    let project = desk.json("pano.json");
    assert_eq!(project["canvas"]["full_turn"], true);
    finish(trueup(desk.path(), &["evaluate", "pano.json"])).expect_success();

    let compose = |name: &str, more: &[&str]| {
        let arguments = [&["compose", "pano.json", "-o", name], more].concat();
        finish(trueup(desk.path(), &arguments)).expect_success();
    };
    compose("again.png", &[]);
    assert!(desk.read("again.png") == one_thread, "its project gives another panorama");
    for blend in ["none", "feather", "average"] {
        compose("other.png", &["--set", &format!("render.blend={blend}"), "--fill", "0.1"]);
        assert_ends_meet(&desk, "other.png");
    }
    compose("rows.png", &["--crop", "rectangle"]);
    let (width, height) = image::image_dimensions(desk.join("rows.png")).expect("a panorama");
    assert_eq!(u64::from(width), project["canvas"]["width"].as_u64().expect("a width"));
    assert!(u64::from(height) < project["crop"]["canvas_height"].as_u64().expect("a height"));
    assert_ends_meet(&desk, "rows.png");

    // Each photograph's left third is not to be seen: most of each is shown by its neighbor, across the ends as well.
    let third = WIDTH as u32 / 3;
    let mask = GrayImage::from_fn(WIDTH as u32, HEIGHT as u32, |x, _| Luma([u8::from(x >= third) * 255]));
    mask.save(desk.join("mask.png")).expect("written");
    let masks: Vec<String> = (0..COUNT).map(|number| format!("{number}.jpg=mask.png")).collect();
    let masks: Vec<&str> = masks.iter().flat_map(|mask| ["--mask", mask]).collect();
    compose("masked.png", &masks);
    assert!(desk.read("masked.png") != one_thread);
    assert_ends_meet(&desk, "masked.png");
}

#[test]
fn a_projected_turn_is_the_whole_sphere_around() {
    let desk = desk();
    let project = |name: &str, more: &[&str]| {
        let arguments = [&["stitch", "room", "-o", name, "--projection", "equirectangular"], more].concat();
        finish(trueup(desk.path(), &arguments)).expect_success();
    };
    project("pano.png", &["--threads", "1", "--project", "pano.json"]);
    assert_ends_meet(&desk, "pano.png");
    let one_thread = desk.read("pano.png");
    project("pano.png", &["--threads", "3"]);
    assert!(desk.read("pano.png") == one_thread, "three threads give another panorama");
    let sphere = &desk.json("pano.json")["projection"]["sphere"];
    let (width, height) = image::image_dimensions(desk.join("pano.png")).expect("a panorama");
    assert_eq!((sphere["full_width"].as_u64(), sphere["left"].as_u64()), (Some(u64::from(width)), Some(0)), "{sphere}");
    assert!(sphere["full_height"].as_u64().is_some_and(|full| full >= u64::from(height)), "{sphere}");
    finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.png"])).expect_success();
    assert!(desk.read("again.png") == one_thread, "its project gives another panorama");
    let wrong = trueup(desk.path(), &["compose", "pano.json", "-o", "again.png", "--fov", "400", "--pitch", "x"]);
    finish(wrong).expect_failure(2, &["projection.fov", "--pitch x"]);
    assert!(desk.read("again.png") == one_thread, "a refusal leaves what is there");
}
