//! A whole sphere, zenith and nadir among its photographs: no mesh lies flat over it, so the cameras draw it.

use image::GenericImageView;
use trueup_scenes::{
    LightQuality, LitScene, PosedCamera, Quality, RoomStyle, SceneKind, SceneOptions, camera_from_world, render,
};

use crate::pictures::jpeg;
use crate::run::{Desk, finish, trueup};

const WIDTH: usize = 360;
const HEIGHT: usize = 300;

/// Three rows, the zenith and the nadir, around where the photographer stands, a little off level each.
fn cameras(eye: [f64; 3]) -> Vec<PosedCamera> {
    let row = |pitch: f64, count: usize| (0..count).map(move |k| (360.0 / count as f64 * k as f64, pitch));
    let looks = row(0.0, 7).chain(row(52.0, 6)).chain(row(-52.0, 6)).chain([(20.0, 88.0), (-40.0, -89.0)]);
    let posed = |(k, (yaw, pitch)): (usize, (f64, f64))| {
        let mut posed = PosedCamera::level(eye, 0.0, WIDTH, HEIGHT, 84.0);
        posed.camera.set_rotation(&camera_from_world(yaw, pitch, [1.5, -2.0, 0.5][k % 3]));
        posed
    };
    looks.enumerate().map(posed).collect()
}

/// A folder with the photographs, as `room/00.jpg` and so on, and their cameras.
fn photographed() -> (Desk, Vec<PosedCamera>) {
    let (kind, style, light) = (SceneKind::Room, RoomStyle::Library, LightQuality::Fast);
    let scene = LitScene::new(&SceneOptions { kind, style, seed: 103, light }).expect("a valid scene");
    let cameras = cameras(scene.viewpoint().eye);
    let desk = Desk::new();
    std::fs::create_dir(desk.join("room")).expect("made");
    for (k, camera) in cameras.iter().enumerate() {
        let picture = render(&scene, camera, Quality::Preview);
        desk.put(&format!("room/{k:02}.jpg"), jpeg(picture.data(), WIDTH, HEIGHT));
    }
    (desk, cameras)
}

#[test]
fn a_sphere_is_whole_and_upright() {
    let (desk, cameras) = photographed();
    let stitch = ["stitch", "room", "-o", "pano.png", "--project", "pano.json", "--require-all", "--threads", "1"];
    let run = finish(trueup(desk.path(), &stitch));
    let told = run.expect_success();
    assert!(told.contains("drawn by the cameras instead") && told.contains("look at a pole"), "{told}");

    let picture = image::open(desk.join("pano.png")).expect("a panorama");
    let (width, height) = picture.dimensions();
    assert_eq!(width, 2 * height);
    for row in [0, 1, height / 2, height - 2, height - 1] {
        let open = (0..width).filter(|&column| picture.get_pixel(column, row).0[3] < 255).count();
        assert!(open < width as usize / 100, "{open} pixels of row {row} are open");
    }
    let project = desk.json("pano.json");
    let sphere = &project["projection"]["sphere"];
    let whole = ["full_width", "full_height", "left", "top"].map(|name| sphere[name].as_u64().expect("a length"));
    assert_eq!(whole, [u64::from(width), u64::from(height), 0, 0]);

    // Down by the recorded cameras and by the true ones, each in its photograph.
    let images = project["images"].as_array().expect("photographs");
    for (image, posed) in images.iter().zip(&cameras) {
        let down = posed.camera.rotation().column(1).into_owned();
        let recorded = |row: usize| image["upright_rotation"][row][1].as_f64().expect("a rotation");
        let cosine: f64 = (0..3).map(|row| recorded(row) * down[row]).sum();
        let off = cosine.clamp(-1.0, 1.0).acos().to_degrees();
        assert!(off < 0.5, "{} is off by {off} degrees", image["path"]);
    }

    finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.png"])).expect_success();
    assert!(desk.read("again.png") == desk.read("pano.png"), "its project gives another panorama");
}
