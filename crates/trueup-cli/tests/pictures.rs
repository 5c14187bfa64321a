//! Photographs for the tests, all made here: a rendered street, noise, and files that are broken in known ways.

use std::path::Path;
use std::sync::OnceLock;

use jpeg_encoder::{ColorType, Encoder};
use trueup_scenes::{
    LightQuality, LitScene, PosedCamera, Quality, RigOptions, SceneKind, SceneOptions, render, rig, truth_of,
};

use crate::run::Desk;

/// Size of the rendered photographs.
pub(crate) const WIDTH: usize = 480;
/// Size of the rendered photographs.
pub(crate) const HEIGHT: usize = 360;

/// Four overlapping photographs of a street, from left to right, as JPEG files.
pub(crate) fn street() -> &'static [Vec<u8>] {
    static FILES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    FILES.get_or_init(|| street_pixels().iter().map(|rgb| jpeg(rgb, WIDTH, HEIGHT)).collect())
}

/// The RGB pixels of [`street`].
pub(crate) fn street_pixels() -> &'static [Vec<u8>] {
    static PIXELS: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    PIXELS.get_or_init(|| photograph_scene(STREET.0, STREET.1, STREET_NAMES.len()))
}

/// Three overlapping photographs of a room, as JPEG files.
pub(crate) fn room() -> &'static [Vec<u8>] {
    static FILES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    FILES.get_or_init(|| photograph_scene(SceneKind::Room, 3, 3).iter().map(|rgb| jpeg(rgb, WIDTH, HEIGHT)).collect())
}

fn photograph_scene(kind: SceneKind, seed: u64, count: usize) -> Vec<Vec<u8>> {
    let scene = LitScene::new(&SceneOptions { kind, seed, light: LightQuality::Fast, ..SceneOptions::default() })
        .expect("a valid scene");
    let cameras = cameras(&scene, seed, count);
    cameras.iter().map(|camera| render(&scene, camera, Quality::Preview).data().to_vec()).collect()
}

fn cameras(scene: &LitScene, seed: u64, count: usize) -> Vec<PosedCamera> {
    let options = RigOptions { seed, pictures: count, width: WIDTH, height: HEIGHT, ..RigOptions::default() };
    rig(&options, &scene.viewpoint()).expect("valid options")
}

/// The truth of the street's photographs, as JSON.
pub(crate) fn street_truth() -> String {
    let (kind, seed) = STREET;
    let scene = LitScene::new(&SceneOptions { kind, seed, light: LightQuality::Fast, ..SceneOptions::default() })
        .expect("a valid scene");
    let cameras = cameras(&scene, seed, STREET_NAMES.len());
    let images = cameras.iter().zip(STREET_NAMES).map(|(camera, name)| truth_of(camera, name.to_owned())).collect();
    serde_json::to_string(&trueup::Truth { source: "a street".to_owned(), images, level: None }).expect("serializable")
}

/// Kind and seed of the street.
const STREET: (SceneKind, u64) = (SceneKind::Street, 7);

/// Puts the street's photographs into a folder, as `a.jpg`, `b.jpg`, `c.jpg`, `d.jpg`.
pub(crate) fn put_street(desk: &Desk) {
    for (name, bytes) in STREET_NAMES.iter().zip(street()) {
        desk.put(name, bytes);
    }
}

/// The names that [`put_street`] gives.
pub(crate) const STREET_NAMES: [&str; 4] = ["a.jpg", "b.jpg", "c.jpg", "d.jpg"];

/// A folder with the street's photographs.
pub(crate) fn street_desk() -> Desk {
    let desk = Desk::new();
    put_street(&desk);
    desk
}

/// RGB pixels as a JPEG file.
pub(crate) fn jpeg(rgb: &[u8], width: usize, height: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    let side = |length: usize| u16::try_from(length).expect("a small picture");
    Encoder::new(&mut bytes, 95).encode(rgb, side(width), side(height), ColorType::Rgb).expect("encodable");
    bytes
}

/// A picture of one color.
pub(crate) fn plain(width: usize, height: usize, value: u8) -> Vec<u8> {
    jpeg(&vec![value; width * height * 3], width, height)
}

/// A picture full of detail that is found in no picture of another seed: patches of random brightness in many sizes.
pub(crate) fn noise(seed: u64, width: usize, height: usize) -> Vec<u8> {
    let mut gray = vec![128.0_f64; width * height];
    for (octave, patch) in [64, 32, 16, 8, 4].into_iter().enumerate() {
        for y in 0..height {
            for x in 0..width {
                let cell = (seed << 40) ^ ((octave as u64) << 32) ^ ((y / patch) << 16 | (x / patch)) as u64;
                gray[y * width + x] += 50.0 * (scramble(cell) - 0.5);
            }
        }
    }
    let rgb: Vec<u8> = gray.iter().flat_map(|&value| [value.clamp(0.0, 255.0) as u8; 3]).collect();
    jpeg(&rgb, width, height)
}

/// A number in 0..1 that looks random: the output function of SplitMix64.
pub(crate) fn scramble(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A JPEG file whose header claims another size.
pub(crate) fn claiming(bytes: &[u8], width: u16, height: u16) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    // Start of frame, baseline: FF C0, length (2), precision (1), height (2), width (2).
    let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).expect("a baseline JPEG");
    bytes[frame + 5..frame + 7].copy_from_slice(&height.to_be_bytes());
    bytes[frame + 7..frame + 9].copy_from_slice(&width.to_be_bytes());
    bytes
}

/// A JPEG file with EXIF: the focal length in millimeters as a fraction, and its 35 mm equivalent.
pub(crate) fn with_focal_length(bytes: &[u8], millimeters: [u32; 2], equivalent: u16) -> Vec<u8> {
    const HEADER: [u8; 8] = *b"II\x2a\0\x08\0\0\0";
    let mut tiff = HEADER.to_vec();
    let entry = |tiff: &mut Vec<u8>, tag: u16, kind: u16, value: u32| {
        tiff.extend(tag.to_le_bytes());
        tiff.extend(kind.to_le_bytes());
        tiff.extend(1_u32.to_le_bytes());
        tiff.extend(value.to_le_bytes());
    };
    // First directory at 8: one entry, the pointer to the EXIF directory behind it (8 + 2 + 12 + 4 = 26).
    tiff.extend(1_u16.to_le_bytes());
    entry(&mut tiff, 0x8769, 4, 26);
    tiff.extend(0_u32.to_le_bytes());
    // EXIF directory: two entries; the fraction lies behind it (26 + 2 + 24 + 4 = 56).
    tiff.extend(2_u16.to_le_bytes());
    entry(&mut tiff, 0x920a, 5, 56);
    entry(&mut tiff, 0xa405, 3, u32::from(equivalent));
    tiff.extend(0_u32.to_le_bytes());
    tiff.extend(millimeters[0].to_le_bytes());
    tiff.extend(millimeters[1].to_le_bytes());

    let length = u16::try_from(2 + 6 + tiff.len()).expect("short metadata");
    let segment = [&[0xff, 0xe1], &length.to_be_bytes()[..], b"Exif\0\0", &tiff].concat();
    [&bytes[..2], &segment, &bytes[2..]].concat()
}

/// Width and height of a PNG, TIFF or WebP file.
pub(crate) fn picture_size(path: &Path) -> (u32, u32) {
    image::image_dimensions(path).expect("a readable picture")
}

/// A small picture of 64 x 48 px as the first of a TIFF that says it is a Digital Negative and that the first is a
/// copy.
pub(crate) fn digital_negative() -> Vec<u8> {
    const FIRST_DIRECTORY: u32 = 8;
    let (width, height): (u32, u32) = (64, 48);
    let bytes_of_pixels = width * height;
    // Tag, type (1 byte, 3 short, 4 long), number (TIFF 6.0 section 2); the pixels lie behind the directory.
    let entries = 11_u16;
    let pixels = FIRST_DIRECTORY + 2 + 12 * u32::from(entries) + 4;
    let fields: [(u16, u16, u32, u32); 11] = [
        (254, 4, 1, 1),
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 1, 8),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, 1, pixels),
        (277, 3, 1, 1),
        (278, 4, 1, height),
        (279, 4, 1, bytes_of_pixels),
        (50706, 1, 4, 0x0000_0401),
    ];
    let mut bytes = b"II*\0".to_vec();
    bytes.extend(FIRST_DIRECTORY.to_le_bytes());
    bytes.extend(entries.to_le_bytes());
    for (tag, kind, count, value) in fields {
        bytes.extend(tag.to_le_bytes().into_iter().chain(kind.to_le_bytes()));
        bytes.extend(count.to_le_bytes().into_iter().chain(value.to_le_bytes()));
    }
    bytes.extend([0; 4]);
    bytes.extend((0..bytes_of_pixels).map(|pixel| (pixel * 7) as u8));
    bytes
}
