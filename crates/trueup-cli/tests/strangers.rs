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

/// Stitches four photographs, among them `stranger`, which is left out for `reason` and changes nothing.
fn is_left_out(desk: &Desk, photographs: [&str; 4], stranger: &str, reason: &str) {
    stitch(desk, &photographs, "alone.png");
    let said = stitch(desk, &[&photographs[..], &[stranger]].concat(), "among.png");
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
    is_left_out(&desk, STREET, "earlier.png", "it is a panorama of");
    // Whoever knows better names the overlaps.
    desk.put("graph.txt", "a.jpg -- earlier.png\nb.jpg -- earlier.png\n");
    let said = stitch(&desk, &["a.jpg", "b.jpg", "earlier.png", "--graph", "graph.txt"], "all.png");
    assert!(said.contains("3 of 3 used"), "{said}");
}

#[test]
fn a_reduced_copy_is_left_out() {
    let desk = street_desk();
    bare_copy(&desk, &second_photograph(), "small.png", 0.6);
    is_left_out(&desk, STREET, "small.png", "it is a smaller copy of b.jpg");
}

/// b.jpg as it was before it was compressed.
fn second_photograph() -> RgbImage {
    RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, street_pixels()[1].clone()).expect("its size")
}

#[test]
fn an_edited_copy_is_left_out() {
    let desk = street_desk();
    let mut edited = second_photograph();
    for level in edited.as_mut() {
        *level = (255.0 * (f64::from(*level) / 255.0).powf(0.9)).round() as u8;
    }
    bare_copy(&desk, &edited, "edited.png", 1.0);
    is_left_out(&desk, STREET, "edited.png", "it is b.jpg again, with other tones, compression or size");
}

/// Four pictures of parts of one that together show all of it, in the size of all: nothing but what they show tells
/// which is the panorama.
#[test]
fn a_panorama_of_a_cameras_format_is_left_out() {
    let desk = Desk::new();
    let whole = second_photograph();
    whole.save(desk.join("whole.png")).expect("written");
    let [width, height] = [whole.width(), whole.height()].map(|side| side * 5 / 8);
    let names = ["1.png", "2.png", "3.png", "4.png"];
    for (name, [right, down]) in names.into_iter().zip([[0, 0], [1, 0], [0, 1], [1, 1]]) {
        let corner = [right * (whole.width() - width), down * (whole.height() - height)];
        let part = image::imageops::crop_imm(&whole, corner[0], corner[1], width, height).to_image();
        bare_copy(&desk, &part, name, 1.6);
    }
    is_left_out(&desk, names, "whole.png", "it is a panorama of 1.png, 4.png and 2 more");
}

#[test]
fn the_same_file_under_another_name_is_left_out() {
    let desk = street_desk();
    desk.put("twin.jpg", desk.read("b.jpg"));
    is_left_out(&desk, STREET, "twin.jpg", "");
}

/// The folder that the panorama is written into is stitched again: what was made of it is no photograph of it.
#[test]
fn the_same_command_twice_writes_the_same_bytes() {
    let desk = street_desk();
    let command = ["stitch", ".", "-o", "made.jpg", "--scale", "0.5"];
    finish(trueup(desk.path(), &command)).expect_success();
    let first = desk.read("made.jpg");
    let run = finish(trueup(desk.path(), &command));
    assert!(run.expect_success().contains("made.jpg: it is a panorama that this program made"), "{}", run.stdout);
    assert!(first == desk.read("made.jpg"));
}

/// The small copy matches all over, and that is what is said, not that nothing overlaps.
#[test]
fn a_photograph_and_its_copy_alone_are_told_so() {
    let desk = street_desk();
    bare_copy(&desk, &second_photograph(), "small.png", 0.5);
    desk.stitch(&["b.jpg", "small.png"]).expect_failure(
        1,
        &["no overlapping photographs found; small.png: it is a smaller copy of b.jpg\n", "neighboring views"],
    );
}

/// Layers and seams lie beside the panorama, among the photographs: they are known by their maker and written again.
#[test]
fn what_is_written_beside_a_panorama_is_no_photograph_either() {
    let desk = street_desk();
    let outputs = ["made.jpg", "small.png", "seams.png", "layers.tif"];
    let command = [
        "stitch",
        ".",
        "-o",
        outputs[0],
        "--thumbnail",
        outputs[1],
        "--seams",
        outputs[2],
        "--layers",
        outputs[3],
        "--scale",
        "0.5",
    ];
    finish(trueup(desk.path(), &command)).expect_success();
    let first = outputs.map(|name| desk.read(name));
    let run = finish(trueup(desk.path(), &command));
    assert!(run.expect_success().contains("photographs 4 of 8 used"), "{}", run.stdout);
    assert!(first == outputs.map(|name| desk.read(name)));
    // They are none of another panorama's, either.
    let run = finish(trueup(desk.path(), &["stitch", ".", "-o", "other.jpg", "--scale", "0.5"]));
    assert!(run.expect_success().contains("photographs 4 of 8 used"), "{}", run.stdout);
    assert!(desk.read("other.jpg") == first[0]);
}
