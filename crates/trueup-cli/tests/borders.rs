//! Photographs that lie inside an even border in their files.

use image::{GrayImage, Luma, Rgb};
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
