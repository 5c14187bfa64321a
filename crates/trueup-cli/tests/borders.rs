//! Photographs that lie inside an even border in their files, or askew in them.

use image::{GrayImage, Luma, Rgb, Rgba};
use serde_json::json;

use crate::pictures::{HEIGHT, STREET_NAMES, WIDTH, jpeg, street_desk, street_pixels};
use crate::run::{Desk, finish, trueup};

/// Pixels of white above and below, and of white at the left and at the right.
const FRAME: [usize; 2] = [40, 24];

/// The street as prints on white paper.
fn prints() -> Desk {
    let desk = street_desk();
    let [rows, columns] = FRAME;
    let (width, height) = (WIDTH + 2 * columns, HEIGHT + 2 * rows);
    for (name, rgb) in STREET_NAMES.into_iter().zip(street_pixels()) {
        let mut paper = vec![250; 3 * width * height];
        for (y, row) in rgb.chunks_exact(3 * WIDTH).enumerate() {
            let start = 3 * ((y + rows) * width + columns);
            paper[start..start + row.len()].copy_from_slice(row);
        }
        desk.put(name, jpeg(&paper, width, height));
    }
    desk
}

#[test]
fn prints_are_stitched_without_their_paper_and_composed_again() {
    let desk = prints();
    let [rows, columns] = FRAME;
    let marks = GrayImage::from_fn((WIDTH + 2 * columns) as u32, (HEIGHT + 2 * rows) as u32, |x, _| {
        Luma([u8::from(x as usize >= columns + 40) * 255])
    });
    marks.save(desk.join("mask.png")).expect("written");
    let wishes = ["--project", "pano.json", "--pto", "pano.pto", "--mask", "b.jpg=mask.png", "--scale", "0.5"];
    finish(trueup(desk.path(), &[&["stitch", "-o", "pano.png"], &STREET_NAMES[..], &wishes].concat())).expect_success();
    let project = desk.json("pano.json");
    for image in project["images"].as_array().expect("photographs") {
        assert_eq!(image["status"], "used");
        let inset = |side: &str| image["inset"][side].as_u64().expect("an inset") as usize;
        for (side, frame) in [("left", columns), ("right", columns), ("top", rows), ("bottom", rows)] {
            assert!((frame..=frame + 2).contains(&inset(side)), "{side}: {}", inset(side));
        }
        let length = |name: &str| image[name].as_u64().expect("a length") as usize;
        assert_eq!(length("width") + inset("left") + inset("right"), WIDTH + 2 * columns);
        assert_eq!(length("height") + inset("top") + inset("bottom"), HEIGHT + 2 * rows);
    }
    let told = |one: &&serde_json::Value| one["code"] == "border-left-out";
    assert_eq!(project["diagnostics"].as_array().expect("findings").iter().filter(told).count(), 4);
    assert_eq!(project["images"][1]["masks"], json!([{"path": "mask.png", "kind": "use"}]));
    let hugin = String::from_utf8(desk.read("pano.pto")).expect("text");
    assert_eq!(
        hugin.lines().filter(|line| line.starts_with("i w528 h440 ") && line.contains(" S")).count(),
        4,
        "{hugin}"
    );
    finish(trueup(desk.path(), &["compose", "pano.pto", "-o", "of-hugin.png", "--project", "of-hugin.json"]))
        .expect_success();
    let of_hugin = desk.json("of-hugin.json");
    for number in 0..4 {
        assert_eq!(of_hugin["images"][number]["inset"], project["images"][number]["inset"]);
    }
    finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.png"])).expect_success();
    assert!(desk.read("pano.png") == desk.read("again.png"), "the same panorama");
    // White paper would be all along the outline; above and below, sky and pavement are as bright.
    let panorama = image::open(desk.join("pano.png")).expect("a panorama").to_rgb8();
    let width = panorama.width();
    let is_outermost = |x: u32| x < 3 || x >= width - 3;
    let outermost: Vec<&Rgb<u8>> =
        panorama.enumerate_pixels().filter(|(x, _, _)| is_outermost(*x)).map(|(_, _, pixel)| pixel).collect();
    let white = outermost.iter().filter(|pixel| pixel.0.iter().all(|&level| level >= 230)).count();
    assert!(white * 20 < outermost.len(), "{white} of {} pixels are white", outermost.len());
}

/// The street's photographs, each turned by 3 to 4.5 degrees into black as an editor does it.
fn turned() -> Desk {
    let desk = street_desk();
    for ((name, rgb), degrees) in STREET_NAMES.into_iter().zip(street_pixels()).zip([3.0_f64, -4.0, 3.5, -4.5]) {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let mut picture = vec![0; rgb.len()];
        for (index, pixel) in picture.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let x = (index % WIDTH) as f64 + 0.5 - WIDTH as f64 / 2.0;
            let y = (index / WIDTH) as f64 + 0.5 - HEIGHT as f64 / 2.0;
            let from = [x * cosine + y * sine + WIDTH as f64 / 2.0, y * cosine - x * sine + HEIGHT as f64 / 2.0];
            if from[0] >= 0.0 && from[0] < WIDTH as f64 && from[1] >= 0.0 && from[1] < HEIGHT as f64 {
                let start = 3 * (from[1] as usize * WIDTH + from[0] as usize);
                pixel.copy_from_slice(&rgb[start..start + 3]);
            }
        }
        desk.put(name, jpeg(&picture, WIDTH, HEIGHT));
    }
    desk
}

#[test]
fn photographs_that_were_turned_are_stitched_without_what_that_left_and_composed_again() {
    let desk = turned();
    let wishes = ["--project", "pano.json", "--crop", "none"];
    finish(trueup(desk.path(), &[&["stitch", "-o", "pano.png"], &STREET_NAMES[..], &wishes].concat())).expect_success();
    let project = desk.json("pano.json");
    for image in project["images"].as_array().expect("photographs") {
        assert_eq!((&image["status"], &image["width"]), (&json!("used"), &json!(WIDTH)));
        assert!((4..=8).contains(&image["outline"].as_array().expect("a polygon").len()), "{}", image["outline"]);
    }
    let told = |one: &&serde_json::Value| one["code"] == "border-left-out";
    assert_eq!(project["diagnostics"].as_array().expect("findings").iter().filter(told).count(), 4);
    finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.png", "--crop", "none"])).expect_success();
    assert!(desk.read("pano.png") == desk.read("again.png"), "the same panorama");
    // The scene has hardly anything black, of which a photograph has a twentieth when it was turned.
    let panorama = image::open(desk.join("pano.png")).expect("a panorama").to_rgba8();
    let opaque: Vec<&Rgba<u8>> = panorama.pixels().filter(|pixel| pixel.0[3] == 255).collect();
    let is_black = |pixel: &[u8]| pixel[..3].iter().all(|&level| level < 12);
    let black = opaque.iter().filter(|pixel| is_black(&pixel.0)).count();
    let of_scene: usize =
        street_pixels().iter().map(|rgb| rgb.chunks_exact(3).filter(|rgb| is_black(rgb)).count()).sum();
    let share = black as f64 / opaque.len() as f64;
    let share_of_scene = of_scene as f64 / (4 * WIDTH * HEIGHT) as f64;
    assert!(share < share_of_scene + 0.003, "{share} instead of {share_of_scene}");
}
