//! Masks: what is ignored is not seen, what is kept is.

use image::{GrayImage, Luma, Rgba, RgbaImage};

use crate::pictures::{HEIGHT, STREET_NAMES, WIDTH, jpeg, street_desk, street_pixels};
use crate::run::{Desk, finish, trueup};

/// Columns of `b.jpg` that are spoilt.
const SPOILT: usize = WIDTH / 2;

/// The street, with the left half of `b.jpg` red: `a.jpg` shows most of that place, too.
fn spoilt() -> Desk {
    let desk = street_desk();
    let mut rgb = street_pixels()[1].clone();
    for pixel in rgb.chunks_exact_mut(3).enumerate().filter(|(at, _)| at % WIDTH < SPOILT).map(|(_, pixel)| pixel) {
        pixel.copy_from_slice(&[255, 0, 0]);
    }
    desk.put("b.jpg", jpeg(&rgb, WIDTH, HEIGHT));
    let mask = GrayImage::from_fn(WIDTH as u32, HEIGHT as u32, |x, _| Luma([u8::from(x as usize >= SPOILT) * 255]));
    mask.save(desk.join("mask.png")).expect("written");
    desk
}

/// Stitches the street to `pano.png`.
fn stitch(desk: &Desk, more: &[&str]) {
    let arguments = [&["stitch", "-o", "pano.png", "--scale", "0.5"], &STREET_NAMES[..], more].concat();
    finish(trueup(desk.path(), &arguments)).expect_success();
}

/// Share of the pixels of a panorama that are red.
fn redness(desk: &Desk, name: &str) -> f64 {
    let picture = image::open(desk.join(name)).expect("a panorama").to_rgb8();
    let red = picture.pixels().filter(|pixel| pixel[0] > 150 && pixel[1] < 60 && pixel[2] < 60).count();
    red as f64 / picture.pixels().len() as f64
}

/// By how much red exceeds the mean of green and blue, levels, the mean over a panorama.
fn tint(desk: &Desk, name: &str) -> f64 {
    let picture = image::open(desk.join(name)).expect("a panorama").to_rgb8();
    let excess = |[r, g, b]: [u8; 3]| f64::from(r) - 0.5 * (f64::from(g) + f64::from(b));
    picture.pixels().map(|pixel| excess(pixel.0)).sum::<f64>() / picture.pixels().len() as f64
}

#[test]
fn what_is_ignored_is_not_seen_by_any_blend() {
    let desk = spoilt();
    stitch(&desk, &["--mask", "b.jpg=mask.png", "--project", "pano.json"]);
    let record = &desk.json("pano.json")["images"][1]["masks"];
    assert_eq!(*record, serde_json::json!([{"path": "mask.png", "kind": "use"}]));
    let red_with = |blend: &str| {
        let set = format!("render.blend={blend}");
        finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.png", "--set", &set])).expect_success();
        redness(&desk, "again.png")
    };
    // Slivers that no other photograph covers are shown all the same; uncut, they are all that is red.
    let masked = red_with("none");
    assert!(masked < 0.03, "{masked}");
    for blend in ["multiband", "feather", "average"] {
        let red = red_with(blend);
        assert!(red < masked + 0.005, "{blend}: {red} against {masked}");
    }
    // The whole photograph is used again: another mask stands in place of the recorded one.
    GrayImage::from_pixel(WIDTH as u32, HEIGHT as u32, Luma([255])).save(desk.join("all.png")).expect("written");
    // In a plain mean its red part tints what it lies on.
    let tint_with = |mask: &str| {
        let of_b = format!("b.jpg={mask}");
        let arguments = ["compose", "pano.json", "-o", "red.png", "--set", "render.blend=average", "--mask", &of_b];
        finish(trueup(desk.path(), &arguments)).expect_success();
        tint(&desk, "red.png")
    };
    let (masked, shown) = (tint_with("mask.png"), tint_with("all.png"));
    assert!(shown > masked + 2.0, "{shown} against {masked}");
    std::fs::remove_file(desk.join("mask.png")).expect("removed");
    finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.png"]))
        .expect_failure(1, &["mask.png: this mask of b.jpg is not there"]);
}

#[test]
fn what_is_kept_is_shown() {
    let desk = spoilt();
    // Transparent but for the spoilt part.
    let keep = RgbaImage::from_fn(WIDTH as u32, HEIGHT as u32, |x, _| {
        Rgba([255, 255, 255, u8::from((x as usize) < SPOILT) * 255])
    });
    keep.save(desk.join("keep.png")).expect("written");
    stitch(&desk, &["--mask", "b.jpg=mask.png"]);
    let ignored = redness(&desk, "pano.png");
    stitch(&desk, &["--keep", "b.jpg=keep.png"]);
    let kept = redness(&desk, "pano.png");
    assert!(kept > 0.08 && kept > ignored + 0.05, "{kept} against {ignored}");
}

#[test]
fn masks_that_fit_no_photograph_are_refused() {
    let desk = street_desk();
    GrayImage::new(48, 36).save(desk.join("small.png")).expect("written");
    let refused = |mask: &str, status: i32, part: &str| {
        desk.stitch(&["a.jpg", "b.jpg", "--mask", mask]).expect_failure(status, &[part]);
    };
    refused("b.jpg=small.png", 1, "small.png: the mask has 48 x 36 px, the photograph b.jpg has 480 x 360 px");
    refused("q.jpg=small.png", 1, "q.jpg: no photograph of this name was given, so nothing of it can be masked");
    refused("b.jpg=none.png", 1, "none.png: there is no such file");
    refused("b.jpg", 2, "--mask b.jpg: it is not of the form NAME=FILE");
    assert_eq!(desk.files(), ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "small.png"]);
}

#[test]
fn masks_that_leave_nothing_or_mark_what_is_left_out_are_told() {
    let desk = street_desk();
    GrayImage::new(WIDTH as u32, HEIGHT as u32).save(desk.join("black.png")).expect("written");
    desk.stitch(&["a.jpg", "b.jpg", "--mask", "b.jpg=black.png"]).expect_failure(
        1,
        &["no overlapping photographs found; the mask of b.jpg ignores all of it", "White is used of a mask"],
    );
    RgbaImage::new(WIDTH as u32, HEIGHT as u32).save(desk.join("clear.png")).expect("written");
    desk.stitch(&["a.jpg", "clear.png"])
        .expect_failure(1, &["no overlapping photographs found; all of clear.png is black or transparent"]);
    // A mask of one that overlaps none of the others.
    let noise: Vec<u8> = (0..WIDTH * HEIGHT * 3).map(|at| (at * at / 7 % 251) as u8).collect();
    desk.put("noise.jpg", jpeg(&noise, WIDTH, HEIGHT));
    GrayImage::from_pixel(WIDTH as u32, HEIGHT as u32, Luma([255])).save(desk.join("all.png")).expect("written");
    let run = desk.stitch(&[&STREET_NAMES[..], &["noise.jpg", "--mask", "noise.jpg=all.png"]].concat());
    let said = run.expect_success();
    assert!(
        said.contains("warning     noise.jpg: there is a mask of it, but the photograph itself is left out"),
        "{said}"
    );
}

/// Photographs of one name in two folders.
#[test]
fn a_name_of_several_photographs_is_refused_wherever_one_is_named() {
    let desk = street_desk();
    for (from, folder) in [("a.jpg", "d1"), ("b.jpg", "d2")] {
        std::fs::create_dir(desk.join(folder)).expect("made");
        std::fs::rename(desk.join(from), desk.join(folder).join("x.jpg")).expect("moved");
    }
    GrayImage::from_pixel(WIDTH as u32, HEIGHT as u32, Luma([255])).save(desk.join("all.png")).expect("written");
    for more in [["--mask", "x.jpg=all.png"], ["--keep", "x.jpg=all.png"], ["--reference", "x.jpg"]] {
        let arguments = [&["d1/x.jpg", "d2/x.jpg", "c.jpg"][..], &more[..]].concat();
        desk.stitch(&arguments).expect_failure(1, &["x.jpg: it may be any of d1/x.jpg, d2/x.jpg", "the folder before"]);
    }
    let run = desk.stitch(&["d1/x.jpg", "d2/x.jpg", "c.jpg", "--reference", "d2/x.jpg"]);
    assert!(run.expect_success().contains("the reference is d2/x.jpg"), "{}", run.stdout);
}
