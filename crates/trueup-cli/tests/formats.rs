//! Depth from the first byte read to the last written, and what is written beside the panorama.

use image::{DynamicImage, ImageBuffer, Luma, Rgb};

use crate::pictures::{picture_size, street_desk};
use crate::run::{Desk, finish, trueup};

/// Level of the gradient's middle, and its change per radian of azimuth: 16 steps of 8 bits over a radian.
const MIDDLE: f64 = 30_000.0;
const SLOPE: f64 = 4_096.0;

/// A world seen by a camera turned by `azimuth`: detail above the horizon, below it a gradient finer than 8 bits.
fn view(azimuth: f64) -> ImageBuffer<Rgb<u16>, Vec<u16>> {
    const FOCAL: f64 = 420.0;
    let (width, height) = (420_u32, 320_u32);
    ImageBuffer::from_fn(width, height, |x, y| {
        let [right, down] = [f64::from(x) + 0.5 - f64::from(width) / 2.0, f64::from(y) + 0.5 - f64::from(height) / 2.0];
        let theta = (right / FOCAL).atan() + azimuth;
        let phi = (down / right.hypot(FOCAL)).atan();
        let gradient = MIDDLE + SLOPE * theta;
        // Smooth detail fades out towards the horizon.
        let detail: f64 = [23.0, 41.0, 67.0, 97.0]
            .iter()
            .zip(1..)
            .map(|(&frequency, octave)| {
                let cell = |at: f64| (at * frequency).floor();
                let (u, v) = (theta * frequency - cell(theta), phi * frequency - cell(phi));
                let corner = |i: f64, j: f64| scramble(cell(theta) + i, cell(phi) + j, octave);
                let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
                let (u, v) = (smooth(u), smooth(v));
                let upper = corner(0.0, 0.0) * (1.0 - u) + corner(1.0, 0.0) * u;
                let lower = corner(0.0, 1.0) * (1.0 - u) + corner(1.0, 1.0) * u;
                upper * (1.0 - v) + lower * v
            })
            .sum();
        let strength = (-phi * 20.0).clamp(0.0, 1.0);
        let level = (gradient + 11_000.0 * strength * detail).clamp(0.0, 65_535.0);
        Rgb([level as u16; 3])
    })
}

/// A number from -1 to 1 that looks random.
fn scramble(u: f64, v: f64, octave: i32) -> f64 {
    ((u * 12.9898 + v * 78.233 + f64::from(octave) * 37.719).sin() * 43_758.545_3).fract()
}

fn save(desk: &Desk, name: &str, picture: impl Into<DynamicImage>) {
    picture.into().save(desk.join(name)).expect("written");
}

fn sixteen(desk: &Desk, name: &str) -> ImageBuffer<image::Rgba<u16>, Vec<u16>> {
    let picture = image::open(desk.join(name)).expect("readable");
    assert!(picture.color().bytes_per_pixel() / picture.color().channel_count() == 2, "{:?}", picture.color());
    picture.to_rgba16()
}

#[test]
fn one_photograph_of_sixteen_bits_keeps_them() {
    let desk = Desk::new();
    let level = |x: u32| 20_000 + 3 * x as u16;
    save(&desk, "ramp.png", ImageBuffer::from_fn(600, 40, |x, _| Luma([level(x)])));
    for name in ["pano.tif", "pano.png"] {
        finish(trueup(desk.path(), &["stitch", "ramp.png", "-o", name])).expect_success();
        let found = sixteen(&desk, name);
        for x in 0..600 {
            assert!(found.get_pixel(x, 20)[0].abs_diff(level(x)) <= 1, "{name} at {x}: {:?}", found.get_pixel(x, 20));
        }
    }
    finish(trueup(desk.path(), &["stitch", "ramp.png", "-o", "pano.tif", "--depth", "8"])).expect_success();
    let color = image::open(desk.join("pano.tif")).expect("readable").color();
    assert_eq!(color.bits_per_pixel(), 8 * u16::from(color.channel_count()), "{color:?}");
    finish(trueup(desk.path(), &["stitch", "ramp.png", "-o", "pano.tif", "--depth", "float"])).expect_success();
    assert!(matches!(
        image::open(desk.join("pano.tif")).expect("readable"),
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)
    ));
}

#[test]
fn a_gradient_over_a_seam_has_no_bands() {
    let desk = Desk::new();
    save(&desk, "a.png", view(-0.22));
    save(&desk, "b.png", view(0.22));
    let run = finish(trueup(desk.path(), &["stitch", "a.png", "b.png", "-o", "pano.tif"]));
    assert!(run.expect_success().contains("2 of 2 used"), "{}", run.stdout);
    let panorama = sixteen(&desk, "pano.tif");
    let (width, height) = panorama.dimensions();
    let y = height * 3 / 4;
    let row: Vec<u16> = (width / 20..width - width / 20)
        .map(|x| panorama.get_pixel(x, y))
        .filter(|p| p[3] == 65_535)
        .map(|p| p[0])
        .collect();
    assert!(row.len() > 500, "{} of {width} pixels", row.len());
    let mut levels = row.clone();
    levels.sort_unstable();
    levels.dedup();
    // The row spans some 14 steps of 8 bits.
    let steps = usize::from(row[row.len() - 1] - row[0]) / 257;
    assert!((8..24).contains(&steps), "{steps} steps of 8 bits");
    assert!(levels.len() > 20 * steps, "{} levels over {steps} steps", levels.len());
    for (x, pair) in row.windows(2).enumerate() {
        let rise = i32::from(pair[1]) - i32::from(pair[0]);
        // The gradient rises by about 8 a pixel; a band of 8 bits would stand still for 30 pixels and rise by 257.
        assert!((-4..40).contains(&rise), "{rise} at {x}");
    }
}

#[test]
fn layers_and_seams_lie_on_the_panorama() {
    let desk = street_desk();
    let arguments = ["stitch", "a.jpg", "b.jpg", "c.jpg", "--scale", "0.5", "-o", "pano.png"];
    let beside = ["--layers", "layers.tif", "--seams", "seams.png"];
    finish(trueup(desk.path(), &[&arguments[..], &beside].concat())).expect_success();
    let size = picture_size(&desk.join("pano.png"));
    assert_eq!((picture_size(&desk.join("layers.tif")), picture_size(&desk.join("seams.png"))), (size, size));
    // The first page is the first photograph; where the seams show it alone, the panorama looks like it.
    let layer = image::open(desk.join("layers.tif")).expect("readable").to_rgba8();
    let panorama = image::open(desk.join("pano.png")).expect("readable").to_rgba8();
    let seams = image::open(desk.join("seams.png")).expect("readable").to_rgba8();
    assert!(seams.pixels().all(|pixel| pixel[3] == 0 || pixel[3] == 255));
    let first = *layer
        .enumerate_pixels()
        .filter(|(x, _, pixel)| pixel[3] == 255 && *x < size.0 / 8)
        .map(|(x, y, _)| seams.get_pixel(x, y))
        .next()
        .expect("the first photograph lies at an end");
    let (mut same, mut compared) = (0, 0);
    for (x, y, label) in seams.enumerate_pixels() {
        if *label == first && layer.get_pixel(x, y)[3] == 255 {
            compared += 1;
            let near = layer.get_pixel(x, y).0.iter().zip(panorama.get_pixel(x, y).0).all(|(a, b)| a.abs_diff(b) <= 24);
            same += u32::from(near);
        }
    }
    assert!(compared > 1000 && same * 10 > compared * 9, "{same} of {compared}");

    for (more, message) in [
        (&["--layers", "layers.png"][..], "End the name in .tif"),
        (&["--seams", "seams.tif"], "End the name in .png"),
        (&["--seams", "seams.png", "--set", "render.blend=feather"], "render.blend"),
        (&["--set", "output.depth=float"], "End the name in .tif"),
    ] {
        finish(trueup(desk.path(), &[&arguments[..], more].concat())).expect_failure(2, &[message]);
    }
}

#[test]
fn deep_zoom_is_a_folder_and_a_file() {
    let desk = street_desk();
    finish(trueup(desk.path(), &["stitch", "a.jpg", "b.jpg", "-o", "pano.dzi", "--set", "output.dzi_format=png"]))
        .expect_success();
    assert!(desk.files().ends_with(&["pano.dzi".to_owned(), "pano_files".to_owned()]), "{:?}", desk.files());
    assert_eq!(picture_size(&desk.join("pano_files/0/0_0.png")), (1, 1));
}

/// A panorama of photographs side by side has uncovered corners.
#[test]
fn what_is_not_covered_shows_the_background() {
    let desk = street_desk();
    let holes = |name: &str, background: &str| {
        let arguments = ["stitch", "a.jpg", "b.jpg", "-o", name, "--scale", "0.5", "--crop", "none"];
        let arguments = [&arguments[..], &["--background", background]].concat();
        finish(trueup(desk.path(), &arguments)).expect_success();
        image::open(desk.join(name)).expect("a panorama")
    };
    let transparent = holes("a.png", "transparent").to_rgba8();
    let (x, y, _) = transparent.enumerate_pixels().find(|(_, _, pixel)| pixel[3] == 0).expect("a hole");
    assert_eq!(holes("b.png", "auto").to_rgba8(), transparent);
    let orange = holes("c.png", "#f80");
    assert!(!orange.color().has_alpha());
    assert_eq!(orange.to_rgb8().get_pixel(x, y).0, [255, 136, 0]);
    let arguments = ["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--background"];
    let refused = |background: &str| finish(trueup(desk.path(), &[&arguments[..], &[background]].concat()));
    refused("transparent").expect_failure(
        2,
        &["writing pano.jpg with a transparent background is not supported", "End the name in .png, "],
    );
    refused("orange")
        .expect_failure(2, &["--background orange: ", "auto | transparent | black | gray | white | #rgb | #rrggbb"]);
}
