//! Files that other programs made, and what a file that was cut off says.
//!
//! Those in `files` were made by cjxl 0.7 and heif-enc 1.15 of [`level`]; `rotated.heic` has a property that turns it,
//! `turned.jxl` was a JPEG with an orientation. What djxl and heif-convert of the same versions made of those with loss
//! lies beside them, as PNG. Those in OpenEXR were made by its own library, OpenEXR 3.5, of the light of [`level`];
//! `tiles.exr` has the alpha of [`opacity`].

use tempfile::TempDir;
use trueup_core::StageContext;
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;

use crate::color::PhotographColors;
use crate::decode::photograph;
use crate::metadata::header::{open, read_fields};
use crate::source::{SourceOptions, Sources, scan};

pub(super) const WIDTH: usize = 24;
pub(super) const HEIGHT: usize = 18;

/// The level of channel `c` at column x and row y.
pub(super) fn level(x: usize, y: usize, c: usize) -> u8 {
    [40 + 3 * x, 60 + 4 * y, 200 - 2 * x - 2 * y][c] as u8
}

/// The opacity at column x.
pub(super) fn opacity(x: usize) -> u8 {
    5 * x as u8 + 100
}

pub(super) fn scanned(bytes: &[u8]) -> (TempDir, Sources) {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join("photograph");
    std::fs::write(&path, bytes).expect("a file");
    let sources = scan(&[path.display().to_string()], &SourceOptions::default(), &StageContext::default());
    (folder, sources.expect("a scan"))
}

pub(super) fn read(bytes: &[u8]) -> (TempDir, SourceImage, Photograph) {
    let (folder, mut sources) = scanned(bytes);
    assert!(sources.rejected.is_empty(), "{:?}", sources.rejected);
    let source = sources.photographs.remove(0);
    let decoded = photograph(&source).expect("a photograph");
    (folder, source, decoded)
}

/// A level of 8 bits, or between two of them; a gray is its own red, green and blue.
pub(super) fn level_at(decoded: &Photograph, x: usize, y: usize, c: usize) -> f64 {
    let c = c.min(decoded.channels() - 1);
    match decoded {
        Photograph::Eight(raster) => f64::from(raster.pixel(x, y)[c]),
        Photograph::Sixteen(raster) => f64::from(raster.pixel(x, y)[c]) / 257.0,
    }
}

/// Largest difference from what is expected, in levels of 8 bits.
pub(super) fn difference(decoded: &Photograph, expected: impl Fn(usize, usize, usize) -> f64) -> f64 {
    let places = (0..decoded.height()).flat_map(|y| (0..decoded.width()).map(move |x| (x, y)));
    let samples = places.flat_map(|(x, y)| (0..decoded.channels().min(3)).map(move |c| (x, y, c)));
    samples.map(|(x, y, c)| (level_at(decoded, x, y, c) - expected(x, y, c)).abs()).fold(0.0, f64::max)
}

macro_rules! file {
    ($name:expr) => {
        &include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/formats/files/", $name))[..]
    };
}
pub(super) use file;

/// The file, samples of a pixel, bits, and most levels of difference.
#[test]
fn pictures_without_loss_are_what_they_were_made_of() {
    let cases: [(&[u8], usize, u16, f64); 6] = [
        (file!("rgb.jxl"), 3, 8, 0.0),
        (file!("rgb16.jxl"), 3, 16, 3.0 / 257.0),
        (file!("rgba.jxl"), 4, 8, 0.0),
        (file!("gray.jxl"), 1, 8, 0.0),
        (file!("float.jxl"), 3, 16, 0.05),
        // Without loss but for the way from RGB to luma and color differences of 8 bits, and back.
        (file!("lossless.heic"), 3, 8, 1.0),
    ];
    for (number, (bytes, channels, bits, most)) in cases.into_iter().enumerate() {
        let (_folder, source, decoded) = read(bytes);
        assert_eq!((source.width, source.height), (WIDTH, HEIGHT), "{number}");
        assert_eq!((decoded.channels(), decoded.sample_bits()), (channels, bits), "{number}");
        // Gray is the red of the others.
        let found = difference(&decoded, |x, y, c| f64::from(level(x, y, c)));
        assert!(found <= most + 1e-9, "{number}: {found}");
    }
}

/// The file, and what the program that made it reads from it.
struct Pair {
    file: &'static [u8],
    elsewhere: &'static [u8],
}

macro_rules! pair {
    ($name:literal) => {
        Pair { file: file!($name), elsewhere: include_bytes!(concat!("files/", $name, ".png")) }
    };
}

/// The pair, samples of a pixel, bits, and most levels of difference: none but where that program rounds otherwise, or
/// fills 10 bits up to 16 with zeros.
#[test]
fn pictures_with_loss_are_what_other_programs_make_of_them() {
    let cases: [(Pair, usize, u16, f64); 5] = [
        (pair!("lossy.jxl"), 3, 8, 1.0),
        (pair!("alpha.heic"), 4, 8, 0.0),
        (pair!("deep.heic"), 3, 16, 0.5),
        (pair!("gray.heic"), 3, 8, 0.0),
        (pair!("p3.heic"), 3, 8, 0.0),
    ];
    for (number, (pair, channels, bits, most)) in cases.into_iter().enumerate() {
        let (_folder, _, decoded) = read(pair.file);
        let (_folder, _, expected) = read(pair.elsewhere);
        assert_eq!((decoded.width(), decoded.height()), (WIDTH, HEIGHT), "{number}");
        assert_eq!((decoded.channels(), decoded.sample_bits()), (channels, bits), "{number}");
        let found = difference(&decoded, |x, y, c| level_at(&expected, x, y, c));
        assert!(found <= most, "{number}: {found}");
    }
}

/// Color differences at half the resolution, which are interpolated here and repeated there.
#[test]
fn colors_of_reduced_resolution_are_no_further_off_than_elsewhere() {
    let (_folder, _, decoded) = read(file!("yuv420.heic"));
    let (_folder, _, other) = read(file!("yuv420.heic.png"));
    let off = |picture: &Photograph| difference(picture, |x, y, c| f64::from(level(x, y, c)));
    assert!(off(&decoded) <= off(&other) && off(&other) <= 6.0, "{} {}", off(&decoded), off(&other));
}

#[test]
fn opacity_is_kept() {
    for (bytes, most) in [(file!("rgba.jxl"), 0), (file!("alpha.heic"), 3)] {
        let Photograph::Eight(raster) = read(bytes).2 else { panic!("16 bit") };
        for x in 0..WIDTH {
            assert!(raster.pixel(x, 7)[3].abs_diff(opacity(x)) <= most);
        }
    }
}

/// The orientation in EXIF, a quarter turn clockwise, says the same once more in the one, and in the other something
/// else.
#[test]
fn what_the_codec_says_of_orientation_counts() {
    // A quarter turn clockwise, and one anticlockwise: the first pixel was the first of the last row, or the last of
    // the first.
    type Place = fn(usize, usize) -> [usize; 2];
    let turned: Place = |x, y| [y, HEIGHT - 1 - x];
    let rotated: Place = |x, y| [WIDTH - 1 - y, x];
    for (pair, place) in [(pair!("turned.jxl"), turned), (pair!("rotated.heic"), rotated)] {
        let (_folder, source, decoded) = read(pair.file);
        let (_folder, _, expected) = read(pair.elsewhere);
        assert_eq!((source.width, source.height, source.orientation), (HEIGHT, WIDTH, 1));
        let (mut input, reading) = open(&source.path).expect("a file");
        let fields = reading.exif(&mut input).expect("EXIF");
        assert_eq!((fields.orientation, fields.turned_by), (None, Some(6)));
        let found = difference(&decoded, |x, y, c| level_at(&expected, x, y, c));
        assert!(found == 0.0, "{found}");
        // Twice compressed with loss; a wrong turn would be 50 levels and more.
        let found = difference(&decoded, |x, y, c| {
            let [x, y] = place(x, y);
            f64::from(level(x, y, c))
        });
        assert!(found <= 10.0, "{found}");
    }
}

#[test]
fn exif_is_read() {
    for bytes in [file!("turned.jxl"), file!("rotated.heic")] {
        let (_folder, source, _) = read(bytes);
        // 24 mm on film: of the diagonal of 30 pixels, 24 / 43.27.
        let focal = source.focal_prior.expect("a focal length").focal_px;
        assert!((focal - 30.0 * 24.0 / 43.266_615).abs() < 1e-6, "{focal}");
        assert_eq!(read_fields(&source.path, &[exif::Tag::FocalLengthIn35mmFilm]).len(), 1);
    }
}

#[test]
fn color_spaces_are_named() {
    let space = |bytes: &[u8]| {
        let (_folder, source, _) = read(bytes);
        let (mut input, reading) = open(&source.path).expect("a file");
        let icc = reading.icc(&mut input);
        (PhotographColors::survey(&[source], &StageContext::default()).name(), icc.is_some())
    };
    for bytes in [file!("rgb.jxl"), file!("lossy.jxl"), file!("float.jxl"), file!("lossless.heic")] {
        assert_eq!(space(bytes), ("sRGB".to_owned(), false));
    }
    assert_eq!(space(file!("p3.heic")), ("primaries 12, transfer 13 of H.273".to_owned(), true));
}

/// The same file with another number in place of its only field of EXIF's own directory: ColorSpace, Adobe RGB by the
/// number of cameras.
fn in_adobe_rgb(whole: &[u8], is_big_endian: bool) -> Vec<u8> {
    // FocalLengthIn35mmFilm is 0xa405, ColorSpace 0xa001; a short, one of it.
    let [from, to]: [&[u8]; 2] = match is_big_endian {
        true => [b"\xa4\x05\0\x03\0\0\0\x01\0\x18", b"\xa0\x01\0\x03\0\0\0\x01\0\x02"],
        false => [b"\x05\xa4\x03\0\x01\0\0\0\x18\0", b"\x01\xa0\x03\0\x01\0\0\0\x02\0"],
    };
    let at = whole.windows(from.len()).position(|window| window == from).expect("the field");
    [&whole[..at], to, &whole[at + from.len()..]].concat()
}

#[test]
fn files_that_name_their_colors_are_not_overruled_by_exif() {
    let name = |bytes: &[u8]| {
        let (_folder, source, _) = read(bytes);
        PhotographColors::survey(&[source], &StageContext::default()).name()
    };
    assert_eq!(name(&in_adobe_rgb(file!("turned.avif"), true)), "sRGB", "named in numbers");
    assert_eq!(name(&in_adobe_rgb(file!("rotated.heic"), false)), "Adobe RGB 1998", "named nowhere else");
    let media_box = |kind: &[u8], content: &[u8]| [&(content.len() as u32 + 8).to_be_bytes(), kind, content].concat();
    // A directory of one entry, ColorSpace in EXIF's own, which begins at byte 26.
    let exif = b"\0\0\0\0II*\0\x08\0\0\0\x01\0\x69\x87\x04\0\x01\0\0\0\x1a\0\0\0\0\0\0\0\x01\0\x01\xa0\x03\0\x01\0\0\0\x02\0\0\0\0\0\0\0";
    let boxes =
        [media_box(b"JXL ", b"\r\n\x87\n"), media_box(b"Exif", exif), media_box(b"jxlc", file!("rgb.jxl"))].concat();
    assert_eq!(name(&boxes), "sRGB", "always named");
}

/// A tile of 1203 x 1203 pixels of which 24 x 18 are shown: what is decoded for them is not what the picture's size
/// says.
#[test]
fn what_is_coded_is_in_proportion_to_what_is_shown() {
    let (_folder, sources) = scanned(file!("part.heic"));
    let reasons: Vec<&str> = sources.rejected.iter().map(|rejected| rejected.reason.as_str()).collect();
    assert!(matches!(reasons[..], [reason] if reason.contains("small part of what is coded")), "{reasons:?}");
}

/// Wherever it ends, a file is refused with a reason, and never taken for whole.
pub(super) fn check_cut_off(whole: &[u8]) {
    let step = (whole.len() / 40).max(1);
    for cut in (0..whole.len()).step_by(step) {
        let (_folder, sources) = scanned(&whole[..cut]);
        match sources.photographs.first() {
            None => assert_eq!(sources.rejected.len(), 1),
            Some(source) => {
                let error = photograph(source).expect_err("cut off").to_string();
                assert!(error.contains("cut off") || error.contains("cannot be decoded"), "{cut}: {error}");
            }
        }
    }
}

#[test]
fn files_that_are_cut_off_are_refused() {
    for whole in [file!("rgb.jxl"), file!("turned.jxl"), file!("yuv420.heic"), file!("alpha.heic")] {
        check_cut_off(whole);
    }
}

/// Some cameras and editors leave them; other programs read such files.
#[test]
fn bytes_between_the_segments_of_a_jpeg_harm_nothing() {
    /// Of a marker that is none, and beyond what the decoder takes as fill bytes.
    const STRAY: [u8; 7] = [0, 0, 0xff, 0, 0x12, 0, 0];
    /// The start-of-image marker, and the JFIF segment behind it.
    const BEFORE: usize = 2 + 2 + 16;
    /// Of what was cut off: some of the pixels, of whose bytes there are a hundred behind tables of six hundred.
    const LACKING: usize = 30;
    let samples: Vec<u8> =
        (0..WIDTH * HEIGHT).flat_map(|at| [0, 1, 2].map(|c| level(at % WIDTH, at / WIDTH, c))).collect();
    for progressive in [false, true] {
        let mut bytes = Vec::new();
        let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, 90);
        encoder.set_progressive(progressive);
        encoder.encode(&samples, WIDTH as u16, HEIGHT as u16, jpeg_encoder::ColorType::Rgb).expect("to memory");
        let (_kept, _, plain) = read(&bytes);
        let (_kept, _, padded) = read(&[&bytes[..BEFORE], &STRAY, &bytes[BEFORE..]].concat());
        assert_eq!(padded, plain, "progressive: {progressive}");
        // What lacks its end is still told.
        let cut = [&bytes[..BEFORE], &STRAY, &bytes[BEFORE..bytes.len() - LACKING]].concat();
        let (_kept, mut sources) = scanned(&cut);
        let said = photograph(&sources.photographs.remove(0)).expect_err("cut off").to_string();
        assert!(said.contains("cut off"), "{said}");
    }
}
