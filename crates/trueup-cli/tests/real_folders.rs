//! What cameras, telephones and other programs leave in folders.

use image::RgbImage;

use crate::pictures::{HEIGHT, WIDTH, street, street_desk, street_pixels};
use crate::run::{Desk, finish, trueup};

/// Stitches these two photographs, and gives the panorama.
#[track_caller]
fn panorama_of(desk: &Desk, photographs: [&str; 2]) -> RgbImage {
    let arguments = [&["stitch", "-o", "made.png", "--scale", "0.5"], &photographs[..]].concat();
    let run = finish(trueup(desk.path(), &arguments));
    assert!(run.expect_success().contains("photographs 2 of 2 used"), "{}", run.stdout);
    image::open(desk.join("made.png")).expect("a picture").into_rgb8()
}

/// A JPEG with a segment behind its start marker.
fn with_segment(jpeg: &[u8], marker: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(content.len() + 2).expect("a short segment").to_be_bytes();
    [&jpeg[..2], &[0xff, marker], &length, content, &jpeg[2..]].concat()
}

/// Files of several pictures (MPO: CIPA DC-007, an index in a segment and the other pictures behind the first), and
/// photographs with a video behind them, are their first picture.
#[test]
fn multi_picture_files_and_motion_photographs_are_their_photograph() {
    let desk = street_desk();
    let expected = panorama_of(&desk, ["a.jpg", "b.jpg"]);
    for (name, other, photograph) in [("a", 2, &street()[0]), ("b", 3, &street()[1])] {
        let indexed = with_segment(photograph, 0xe2, b"MPF\0MM\0*\0\0\0\x08\0\0\0\0\0\0");
        desk.put(&format!("{name}.mpo"), [&indexed[..], &street()[other]].concat());
        let video = [&b"\0\0\0\x18ftypmp42\0\0\0\0isommp42\0\0\x10\0mdat"[..], &[0x5a; 4084]].concat();
        desk.put(&format!("motion-{name}.jpg"), [&photograph[..], &video].concat());
    }
    for photographs in [["a.mpo", "b.mpo"], ["motion-a.jpg", "motion-b.jpg"]] {
        assert!(panorama_of(&desk, photographs) == expected, "{photographs:?}");
    }
}

/// A copy that was stopped before its last two bytes holds the whole photograph; one that was stopped earlier is left
/// out.
#[test]
fn a_jpeg_that_lacks_its_end_marker_alone_is_a_photograph() {
    let desk = street_desk();
    let expected = panorama_of(&desk, ["a.jpg", "b.jpg"]);
    let whole = &street()[0];
    desk.put("stopped.jpg", &whole[..whole.len() - 2]);
    assert!(panorama_of(&desk, ["stopped.jpg", "b.jpg"]) == expected);
    desk.put("cut.jpg", &whole[..whole.len() - 40]);
    let run = desk.stitch(&["cut.jpg", "b.jpg", "c.jpg"]);
    assert!(run.expect_success().contains("cut.jpg: the photograph is cut off"), "{}", run.stdout);
}

/// Frames of the pan: so many, so many pixels apart, of this size.
const FRAMES: usize = 31;
const STEP_PX: usize = 8;
const FRAME_PX: [usize; 2] = [240, 180];

/// A camera that pans over a photograph of the street.
fn put_frames(desk: &Desk) {
    std::fs::create_dir(desk.join("frames")).expect("a folder");
    for frame in 0..FRAMES {
        let picture = RgbImage::from_fn(FRAME_PX[0] as u32, FRAME_PX[1] as u32, |x, y| {
            let (x, y) = (x as usize + STEP_PX * frame, y as usize + (HEIGHT - FRAME_PX[1]) / 2);
            let at = 3 * (y * WIDTH + x);
            image::Rgb([0, 1, 2].map(|channel| street_pixels()[1][at + channel]))
        });
        picture.save(desk.join(&format!("frames/clip-{frame:04}.png"))).expect("written");
    }
}

/// Of a folder with the frames of a video those that are needed are used, unless all are wanted or spoken of.
#[test]
fn of_a_folder_of_frames_those_that_are_needed_are_used() {
    let desk = Desk::new();
    put_frames(&desk);
    let stitch = |more: &[&str]| {
        let run = finish(trueup(
            desk.path(),
            &[&["stitch", "frames", "-o", "pano.jpg", "--project", "p.json"], more].concat(),
        ));
        run.expect_success();
        desk.json("p.json")["images"].as_array().expect("images").len()
    };
    let used = stitch(&[]);
    assert!((3..=6).contains(&used), "{used} frames");
    let findings = desk.json("p.json")["diagnostics"].clone();
    let told = findings.as_array().expect("findings").iter().find(|one| one["code"] == "frames-passed-over");
    let told = told.expect("said")["message"].as_str().expect("words").to_owned();
    assert_eq!(
        told,
        format!("they are {FRAMES} frames of a video, numbered in order, of which {used} are needed and used")
    );
    finish(trueup(desk.path(), &["compose", "p.json", "-o", "again.jpg"])).expect_success();
    assert!(desk.read("again.jpg") == desk.read("pano.jpg"), "composed again from the same frames");
    assert_eq!(stitch(&["--set", "source.frames=all"]), FRAMES);
    assert_eq!(stitch(&["--require-all"]), FRAMES);
}

/// A TIFF of the sensor's own samples, as makers write them beside their DNGs: no part of it is a picture.
fn camera_raw() -> Vec<u8> {
    let digital_negative = include_bytes!("../../trueup-io/src/formats/files/packed.dng");
    // What makes a Digital Negative of it is the tag of its version (50706, DNG 1.7), renamed to one that nobody knows.
    let mut raw = digital_negative.to_vec();
    let (version, unknown) = (0xc612_u16.to_le_bytes(), 0xfd12_u16.to_le_bytes());
    let at = raw.windows(4).position(|bytes| bytes[..2] == version && bytes[2..] == [1, 0]).expect("a version");
    raw[at..at + 2].copy_from_slice(&unknown);
    raw
}

/// A program called `dcraw_emu` that writes what its last argument has beside it, or complains.
#[cfg(unix)]
fn put_developer(desk: &Desk) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::create_dir(desk.join("bin")).expect("a folder");
    desk.put("bin/dcraw_emu", "#!/bin/sh\nfor raw; do :; done\n[ -e \"$raw.made\" ] || { echo \"no such camera\" >&2; exit 0; }\nexec cat \"$raw.made\"\n");
    std::fs::set_permissions(desk.join("bin/dcraw_emu"), std::fs::Permissions::from_mode(0o755)).expect("own file");
}

/// Camera raw is developed by the program that is installed, kept beside the panorama, and told; where there is none,
/// or it cannot, it is left out as what it is.
#[cfg(unix)]
#[test]
fn camera_raw_is_developed_by_a_program_that_is_installed() {
    let desk = Desk::new();
    put_developer(&desk);
    std::fs::create_dir(desk.join("raw")).expect("a folder");
    for (name, photograph) in ["a", "b"].iter().zip(street_pixels()) {
        let path = desk.join(&format!("raw/{name}.nef"));
        std::fs::write(&path, camera_raw()).expect("written");
        let made = RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, photograph.clone()).expect("a picture");
        made.save_with_format(desk.join(&format!("raw/{name}.nef.made")), image::ImageFormat::Tiff).expect("written");
    }
    // Beside a photograph of its own name it is not developed; nor what the program does not know.
    desk.put("raw/c.jpg", &street()[2]);
    desk.put("raw/c.nef", camera_raw());
    desk.put("raw/d.nef", camera_raw());
    let path = format!("{}:{}", desk.join("bin").display(), std::env::var("PATH").unwrap_or_default());
    let stitch = |photographs: &str, path: &str| {
        let arguments = ["stitch", photographs, "-o", "pano.jpg", "--project", "p.json", "--scale", "0.5"];
        let mut command = trueup(desk.path(), &arguments);
        command.env("PATH", path);
        finish(command)
    };
    for _ in 0..2 {
        let run = stitch("raw", &path);
        let said = run.expect_success();
        assert!(said.contains("photographs 3 of 5 used"), "{said}");
        assert!(
            said.contains("raw/d.nef: it is a camera raw photograph, and dcraw_emu cannot develop it (no such camera)"),
            "{said}"
        );
        assert!(said.contains("2 camera raw photographs were developed by dcraw_emu"), "{said}");
        let made = std::fs::read_dir(desk.join("pano-developed")).expect("a folder");
        assert_eq!(
            made.filter(|one| !one.as_ref().expect("readable").path().ends_with(".made-by-trueup.json")).count(),
            2
        );
    }
    finish(trueup(desk.path(), &["compose", "p.json", "-o", "again.jpg"])).expect_success();
    assert!(desk.read("again.jpg") == desk.read("pano.jpg"), "composed again from what was developed");
    stitch("raw/a.nef", "").expect_failure(1, &["a.nef: it is a camera raw photograph", "darktable-cli"]);
    desk.put("pano-developed/letter.txt", "Dear diary");
    stitch("raw", &path)
        .expect_failure(1, &["pano-developed: what is made for the panorama belongs there", "letter.txt"]);
}
