//! Pictures among the photographs that are none.

use image::RgbImage;
use image::imageops::FilterType;

use crate::pictures::{HEIGHT, WIDTH, street_desk, street_pixels};
use crate::run::{Desk, finish, trueup};

const STREET: [&str; 4] = ["a.jpg", "b.jpg", "c.jpg", "d.jpg"];

/// `picture`, `scale` times as large, as a PNG file without a word of where it is from.
fn bare_copy(desk: &Desk, picture: &RgbImage, to: &str, scale: f64) {
    let side = |side: u32| (f64::from(side) * scale).round() as u32;
    let (width, height) = (side(picture.width()), side(picture.height()));
    image::imageops::resize(picture, width, height, FilterType::Triangle).save(desk.join(to)).expect("written");
}

/// Stitches these photographs to a PNG file of this name; what was said.
fn stitch(desk: &Desk, photographs: &[&str], output: &str) -> String {
    let arguments = [&["stitch", "--scale", "0.5", "-o", output], photographs].concat();
    finish(trueup(desk.path(), &arguments)).expect_success().to_owned()
}

/// Stitches the desk's photographs, among them `stranger`, which is left out for `reason` and changes nothing.
fn is_left_out(desk: &Desk, stranger: &str, reason: &str) {
    stitch(desk, &STREET, "alone.png");
    let said = stitch(desk, &[&STREET[..], &[stranger]].concat(), "among.png");
    assert!(said.contains("4 of 5 used"), "{said}");
    assert!(said.contains(&format!("{stranger}: {reason}")), "{said}");
    assert!(image::open(desk.join("alone.png")).expect("one") == image::open(desk.join("among.png")).expect("other"));
}

#[test]
fn a_panorama_made_of_the_photographs_is_left_out() {
    let desk = street_desk();
    stitch(&desk, &[&STREET[..], &["--projection", "cylindrical"]].concat(), "made.png");
    let made = image::open(desk.join("made.png")).expect("a picture").to_rgb8();
    bare_copy(&desk, &made, "earlier.png", 1.0);
    is_left_out(&desk, "earlier.png", "it is a panorama of");
    // Whoever knows better names the overlaps.
    desk.put("graph.txt", "a.jpg -- earlier.png\nb.jpg -- earlier.png\n");
    let said = stitch(&desk, &["a.jpg", "b.jpg", "earlier.png", "--graph", "graph.txt"], "all.png");
    assert!(said.contains("3 of 3 used"), "{said}");
}

#[test]
fn a_reduced_copy_is_left_out() {
    let desk = street_desk();
    let pixels = street_pixels()[1].clone();
    let photograph = RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, pixels).expect("its size");
    bare_copy(&desk, &photograph, "small.png", 0.6);
    is_left_out(&desk, "small.png", "it is a smaller copy of b.jpg");
}
