//! Brackets of exposures, and light that is brighter than white.

use image::{DynamicImage, ImageBuffer, Rgba};
use jpeg_encoder::{ColorType, Encoder};

use crate::pictures::{HEIGHT, STREET_NAMES, WIDTH, street_pixels};
use crate::run::{Desk, finish, trueup};

/// The light of a level (IEC 61966-2-1, equation 6).
fn light(level: u8) -> f32 {
    let encoded = f32::from(level) / 255.0;
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The level of light, 255 for white and what is brighter.
fn level(light: f32) -> u8 {
    let encoded = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded + 0.5).clamp(0.0, 255.0) as u8
}

/// The street's light, eight times that of its pictures where it is bright: what is white there has no light of its
/// own.
fn street_light(number: usize) -> Vec<f32> {
    let brighter = |light: f32| light / (1.125 - light);
    street_pixels()[number].iter().map(|&one| brighter(light(one))).collect()
}

/// Puts three exposures of the first two photographs of the street into a folder, the first as it is and the others
/// with a quarter and four times the light.
fn put_brackets(desk: &Desk) {
    for number in 0..2 {
        for (place, factor) in [1.0, 0.25, 4.0].into_iter().enumerate() {
            let levels: Vec<u8> = street_light(number).iter().map(|one| level(factor * one)).collect();
            let mut bytes = Vec::new();
            let mut encoder = Encoder::new(&mut bytes, 98);
            encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_1_1);
            encoder.encode(&levels, WIDTH as u16, HEIGHT as u16, ColorType::Rgb).expect("encodable");
            desk.put(&format!("{number}{place}.jpg"), bytes);
        }
    }
}

/// A picture of light with alpha.
type Lights = ImageBuffer<Rgba<f32>, Vec<f32>>;

fn open_exr(desk: &Desk, name: &str) -> Lights {
    let picture = exr::prelude::read_first_rgba_layer_from_file(
        desk.join(name),
        |size, _| Lights::new(size.width() as u32, size.height() as u32),
        |picture, place, (red, green, blue, alpha): (f32, f32, f32, f32)| {
            picture.put_pixel(place.x() as u32, place.y() as u32, Rgba([red, green, blue, alpha]));
        },
    );
    picture.expect("readable").layer_data.channel_data.pixels
}

/// Means of luminance over squares of 16 pixels that are covered wholly, with the squares' places.
fn means(picture: &Lights) -> Vec<((u32, u32), f32)> {
    const SIDE: u32 = 16;
    let (across, down) = (picture.width() / SIDE, picture.height() / SIDE);
    let squares = (0..down).flat_map(|y| (0..across).map(move |x| (x, y)));
    let mean = |(x, y): (u32, u32)| {
        let pixels = (0..SIDE * SIDE).map(|k| picture.get_pixel(SIDE * x + k % SIDE, SIDE * y + k / SIDE));
        let all: Option<Vec<f32>> =
            pixels.map(|&Rgba([r, g, b, a])| (a >= 1.0).then_some(0.2126 * r + 0.7152 * g + 0.0722 * b)).collect();
        Some(((x, y), all?.iter().sum::<f32>() / (SIDE * SIDE) as f32))
    };
    squares.filter_map(mean).collect()
}

#[test]
fn a_bracket_becomes_a_picture_or_light_as_the_panorama_is_written() {
    let desk = Desk::new();
    put_brackets(&desk);
    let all = ["00.jpg", "01.jpg", "02.jpg", "10.jpg", "11.jpg", "12.jpg"];
    let stitch = |more: &[&str]| finish(trueup(desk.path(), &[&["stitch"], &all[..], more].concat()));
    let run = stitch(&["-o", "pano.png", "--project", "picture.json"]);
    let told = run.expect_success();
    assert!(told.contains("2 of 2 used") && told.contains("2 of 3 exposures each, fused"), "{told}");
    let picture = desk.json("picture.json");
    assert!(picture.get("light").is_none());
    assert_eq!(picture["images"][0]["stack"].as_array().map(Vec::len), Some(2));
    assert!(image::open(desk.join("pano.png")).is_ok());

    let run = stitch(&["-o", "pano.exr", "--project", "light.json", "--crop", "none"]);
    assert!(run.expect_success().contains("2 of 3 exposures each, merged to light"), "{}", run.stdout);
    let range = desk.json("light.json")["light"].clone();
    assert!(range["peak"].as_f64() >= Some(4.0), "{range}");
    // In a picture, nothing would be brighter than white.
    let found = open_exr(&desk, "pano.exr");
    let most = means(&found).into_iter().map(|(_, mean)| mean).fold(0.0, f32::max);
    assert!(f64::from(most) > 4.0 * range["white"].as_f64().expect("a number"), "{most} {range}");
    // The same light from the record, and its picture.
    let compose = |name: &str| finish(trueup(desk.path(), &["compose", "light.json", "-o", name]));
    compose("again.exr").expect_success();
    assert_eq!(desk.read("again.exr"), desk.read("pano.exr"));
    compose("again.png").expect_success();
    let shown = image::open(desk.join("again.png")).expect("readable").to_rgb8();
    assert!(shown.pixels().any(|pixel| pixel.0[1] > 100), "all of it is dark");
}

/// A single stack is merged in the frame of its reference: its light is known there.
#[test]
fn merged_light_is_that_of_the_scene() {
    let desk = Desk::new();
    put_brackets(&desk);
    let run =
        finish(trueup(desk.path(), &["stitch", "00.jpg", "01.jpg", "02.jpg", "-o", "pano.exr", "--project", "p.json"]));
    assert!(run.stdout.contains("one of 3 exposures, merged to light"), "{}{}", run.stdout, run.stderr);
    let found = open_exr(&desk, "pano.exr");
    assert_eq!((found.width() as usize, found.height() as usize), (WIDTH, HEIGHT));
    let light = street_light(0);
    let truth = ImageBuffer::from_fn(found.width(), found.height(), |x, y| {
        let at = 3 * (y as usize * WIDTH + x as usize);
        let pixel = &light[at..at + 3];
        Rgba([pixel[0], pixel[1], pixel[2], 1.0])
    });
    let known: Vec<f32> = means(&found)
        .iter()
        .zip(means(&truth))
        // Four times white is the most that any exposure tells.
        .filter(|(_, (_, light))| *light < 3.0 && *light > 0.01)
        .map(|((_, found), (_, light))| found / light)
        .collect();
    let mut sorted = known.clone();
    sorted.sort_by(f32::total_cmp);
    // In units of one of the exposures: all factors are the same.
    let factor = sorted[sorted.len() / 2];
    let mut off: Vec<f32> = known.iter().map(|one| (one / factor - 1.0).abs()).collect();
    off.sort_by(f32::total_cmp);
    assert!(known.len() > 300 && off[off.len() / 2] < 0.01, "{} {}", known.len(), off[off.len() / 2]);
    assert!(off[off.len() * 95 / 100] < 0.03, "{}", off[off.len() * 95 / 100]);
}

/// Photographs whose light is a hundred times and more that of a picture are stitched, and their light comes out.
#[test]
fn light_above_white_is_stitched_and_kept() {
    const UNIT: f32 = 300.0;
    let desk = Desk::new();
    let names: Vec<String> = STREET_NAMES.iter().map(|name| name.replace("jpg", "exr")).collect();
    for (number, name) in names.iter().enumerate() {
        let lights: Vec<f32> = street_light(number).iter().map(|light| UNIT * light).collect();
        let pixel = |x: usize, y: usize| {
            let at = 3 * (y * WIDTH + x);
            (lights[at], lights[at + 1], lights[at + 2])
        };
        exr::prelude::write_rgb_file(desk.join(name), WIDTH, HEIGHT, pixel).expect("written");
    }
    let inputs: Vec<&str> = names.iter().map(String::as_str).collect();
    let stitch = |more: &[&str]| finish(trueup(desk.path(), &[&["stitch"], &inputs[..], more].concat()));
    let told = stitch(&["-o", "pano.exr", "--project", "pano.json"]).expect_success().to_owned();
    assert!(told.contains("4 of 4 used"), "{told}");
    let project = desk.json("pano.json");
    let codes: Vec<&str> =
        project["diagnostics"].as_array().expect("a list").iter().filter_map(|one| one["code"].as_str()).collect();
    assert!(codes.contains(&"light-kept"), "{codes:?}");
    let light = means(&open_exr(&desk, "pano.exr"));
    let most = light.iter().map(|(_, mean)| *mean).fold(0.0, f32::max);
    // The brightest of the street is eight times white.
    let truth = street_light(1).iter().fold(0.0_f32, |most, &one| most.max(one)) * UNIT;
    assert!(most > 0.3 * truth && most < 1.1 * truth, "{most} of {truth}");
    stitch(&["-o", "pano.tif", "--depth", "float"]).expect_success();
    let deep = image::open(desk.join("pano.tif")).expect("readable");
    assert!(matches!(deep, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)), "{:?}", deep.color());
    for ((_, one), (_, other)) in light.iter().zip(means(&deep.to_rgba32f())) {
        assert!((one / other - 1.0).abs() < 1e-4, "{one} {other}");
    }
    stitch(&["-o", "pano.png"]).expect_success();
    let picture = image::open(desk.join("pano.png")).expect("readable").to_rgb8();
    let bright = picture.pixels().filter(|pixel| pixel.0[1] > 20 && pixel.0[1] < 250).count();
    assert!(bright * 10 > 8 * picture.pixels().len(), "{bright} of {}", picture.pixels().len());
}
