//! Pictures among the photographs that are none.

use image::imageops::FilterType;

use crate::pictures::street_desk;
use crate::run::Desk;

/// The picture `from`, `scale` times as large, as a PNG file without a word of where it is from.
fn bare_copy(desk: &Desk, from: &str, to: &str, scale: f64) {
    let picture = image::open(desk.join(from)).expect("a picture").to_rgb8();
    let side = |side: u32| (f64::from(side) * scale).round() as u32;
    let (width, height) = (side(picture.width()), side(picture.height()));
    image::imageops::resize(&picture, width, height, FilterType::Triangle).save(desk.join(to)).expect("written");
}

/// Stitches the desk's photographs, among them `stranger`, which is left out for `reason` and changes nothing.
fn is_left_out(desk: &Desk, stranger: &str, reason: &str) {
    let photographs = ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "-o", "alone.png"];
    desk.stitch(&photographs).expect_success();
    let run = desk.stitch(&["a.jpg", "b.jpg", "c.jpg", "d.jpg", stranger, "-o", "among.png"]);
    let said = run.expect_success();
    assert!(said.contains("4 of 5 used"), "{said}");
    assert!(said.contains(&format!("{stranger}: {reason}")), "{said}");
    assert!(image::open(desk.join("alone.png")).expect("one") == image::open(desk.join("among.png")).expect("other"));
}

#[test]
fn a_panorama_made_of_the_photographs_is_left_out() {
    let desk = street_desk();
    desk.stitch(&["a.jpg", "b.jpg", "c.jpg", "d.jpg", "--projection", "cylindrical", "-o", "made.png"])
        .expect_success();
    bare_copy(&desk, "made.png", "earlier.png", 0.8);
    is_left_out(&desk, "earlier.png", "it is a panorama that shows all of");
    // Whoever knows better names the overlaps.
    desk.put("graph.txt", "a.jpg earlier.png\nb.jpg earlier.png\n");
    let run = desk.stitch(&["a.jpg", "b.jpg", "earlier.png", "--graph", "graph.txt", "-o", "all.png"]);
    assert!(run.expect_success().contains("3 of 3 used"));
}

#[test]
fn a_reduced_copy_is_left_out() {
    let desk = street_desk();
    bare_copy(&desk, "b.jpg", "small.png", 0.6);
    is_left_out(&desk, "small.png", "it is a smaller copy of b.jpg");
}
