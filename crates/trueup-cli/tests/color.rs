//! Photographs in other color spaces, from file to file.

use std::path::Path;
use std::sync::OnceLock;

use image::codecs::png::PngEncoder;
use image::{ImageDecoder, ImageEncoder, ImageReader, RgbImage};

use crate::pictures::{HEIGHT, WIDTH, street_pixels};
use crate::run::{Desk, finish, trueup};

/// Display P3 has the curve of sRGB and other primaries.
fn display_p3() -> &'static [u8] {
    static PROFILE: OnceLock<Vec<u8>> = OnceLock::new();
    PROFILE.get_or_init(|| moxcms::ColorProfile::new_display_p3().encode().expect("a profile"))
}

/// The street's photographs as PNG files `a.png`, `b.png`, ... with a profile.
fn put_street(desk: &Desk, icc: Option<&[u8]>) {
    for (pixels, name) in street_pixels().iter().zip('a'..) {
        let picture = RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, pixels.clone()).expect("RGB");
        let path = desk.join(&format!("{name}.png"));
        let mut encoder = PngEncoder::new(std::fs::File::create(&path).expect("a file"));
        if let Some(icc) = icc {
            encoder.set_icc_profile(icc.to_vec()).expect("PNG holds profiles");
        }
        picture.write_with_encoder(encoder).expect("written");
    }
}

#[track_caller]
fn stitch(desk: &Desk, output: &str, arguments: &[&str]) {
    finish(trueup(desk.path(), &[&["stitch", "-o", output], arguments].concat())).expect_success();
}

/// Pixels and profile of a file.
fn read(path: &Path) -> (image::RgbaImage, Option<Vec<u8>>) {
    let mut decoder = ImageReader::open(path).expect("a file").into_decoder().expect("a picture");
    let icc = decoder.icc_profile().expect("readable");
    (image::DynamicImage::from_decoder(decoder).expect("a picture").into_rgba8(), icc)
}

#[test]
fn a_wide_gamut_passes_through_unchanged() {
    let (plain, wide) = (Desk::new(), Desk::new());
    put_street(&plain, None);
    put_street(&wide, Some(display_p3()));
    for format in ["png", "tif"] {
        let output = format!("pano.{format}");
        for desk in [&plain, &wide] {
            stitch(desk, &output, &["a.png", "b.png", "c.png", "--scale", "0.5"]);
        }
        let (untagged, _) = read(&plain.join(&output));
        let (tagged, icc) = read(&wide.join(&output));
        // The same numbers by the same curve: only what they mean differs.
        assert!(untagged == tagged, "{format}: the profile changed numbers");
        assert_eq!(icc.as_deref(), Some(display_p3()), "{format}");
    }
}

/// Primaries that no picture has would make every photograph beside this one unlike it: the profile is not believed,
/// and all are used.
#[test]
fn an_absurd_profile_costs_no_photograph() {
    let desk = Desk::new();
    put_street(&desk, Some(display_p3()));
    let mut absurd = display_p3().to_vec();
    let green = (0..).map(|tag| 132 + 12 * tag).find(|&at| &absurd[at..at + 4] == b"gXYZ").expect("a matrix");
    let place = u32::from_be_bytes([0, 1, 2, 3].map(|byte| absurd[green + 4 + byte])) as usize;
    // Behind the type's name: X, Y and Z with 16 bits before and after the point (ICC.1:2022, 10.31).
    for (value, at) in [i32::MAX, i32::MIN, 1 << 16].into_iter().zip((place + 8..).step_by(4)) {
        absurd[at..at + 4].copy_from_slice(&value.to_be_bytes());
    }
    let other = Desk::new();
    put_street(&other, Some(&absurd));
    std::fs::copy(other.join("b.png"), desk.join("b.png")).expect("copied");
    let run = desk.stitch(&["a.png", "b.png", "c.png"]);
    let said = run.expect_success();
    assert!(said.contains("photographs 3 of 3 used"), "{said}");
    assert!(said.contains("b.png: its ICC profile cannot be used") && !said.contains("curve"), "{said}");
}

#[test]
fn one_photograph_comes_back_within_a_level() {
    let desk = Desk::new();
    put_street(&desk, Some(display_p3()));
    for format in ["png", "tif"] {
        let output = format!("pano.{format}");
        stitch(&desk, &output, &["a.png"]);
        let ((found, icc), (given, _)) = (read(&desk.join(&output)), read(&desk.join("a.png")));
        assert_eq!(icc.as_deref(), Some(display_p3()), "{format}");
        assert_eq!(found.dimensions(), given.dimensions());
        let worst = found.as_raw().iter().zip(given.as_raw()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(1), "{format}: {worst:?}");
    }
}

#[test]
fn a_hugin_project_names_every_photograph() {
    let desk = Desk::new();
    put_street(&desk, None);
    stitch(&desk, "pano.png", &["a.png", "b.png", "c.png", "--pto", "pano.pto", "--scale", "0.2"]);
    let text = String::from_utf8(desk.read("pano.pto")).expect("UTF-8");
    let images: Vec<&str> = text.lines().filter(|line| line.starts_with("i ")).collect();
    assert_eq!(images.len(), 3);
    for (line, name) in images.iter().zip(["a.png", "b.png", "c.png"]) {
        assert!(line.ends_with(&format!("n\"{name}\"")), "{line}");
    }
    // The street is photographed from left to right by a camera that is held level but for a few degrees.
    let angle = |line: &str, letter: char| -> f64 {
        let word = line.split(' ').find(|word| word.starts_with(letter)).expect("an angle");
        word[1..].parse().expect("a number")
    };
    assert!(images.windows(2).all(|pair| angle(pair[0], 'y') < angle(pair[1], 'y')), "{text}");
    assert!(images.iter().all(|line| angle(line, 'p').abs() < 20.0 && angle(line, 'r').abs() < 20.0), "{text}");
    assert!(text.lines().any(|line| line.starts_with("p f2 ")) && text.ends_with("v\n"), "{text}");
}
