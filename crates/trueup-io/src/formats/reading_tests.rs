//! Files that other programs made, and what a file that was cut off says.
//!
//! Those in `files` were made by cjxl 0.7 and heif-enc 1.15 of [`level`]; `rotated.heic` has a property that turns it, `turned.jxl` was
//! a JPEG with an orientation. What djxl and heif-convert of the same versions made of those with loss lies beside them, as PNG. Those in
//! OpenEXR were made by its own library, OpenEXR 3.5, of the light of [`level`]; `tiles.exr` has the alpha of [`opacity`].

use std::io::Cursor;

use exr::prelude::{Encoding, Image, SpecificChannels, WritableImage, f16};
use tempfile::TempDir;
use trueup_core::raster::{Photograph, RowSource};
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};

use crate::color::PhotographColors;
use crate::decode::photograph;
use crate::encode::{Depth, Metadata, OutputOptions, write};
use crate::metadata::header::{open, read_fields};
use crate::source::{SourceOptions, Sources, scan};

const WIDTH: usize = 24;
const HEIGHT: usize = 18;

/// The level of channel `c` at column x and row y.
fn level(x: usize, y: usize, c: usize) -> u8 {
    [40 + 3 * x, 60 + 4 * y, 200 - 2 * x - 2 * y][c] as u8
}

/// The opacity at column x.
fn opacity(x: usize) -> u8 {
    5 * x as u8 + 100
}

fn scanned(bytes: &[u8]) -> (TempDir, Sources) {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join("photograph");
    std::fs::write(&path, bytes).expect("a file");
    let sources = scan(&[path.display().to_string()], &SourceOptions::default(), &StageContext::default());
    (folder, sources.expect("a scan"))
}

fn read(bytes: &[u8]) -> (TempDir, SourceImage, Photograph) {
    let (folder, mut sources) = scanned(bytes);
    assert!(sources.rejected.is_empty(), "{:?}", sources.rejected);
    let source = sources.photographs.remove(0);
    let decoded = photograph(&source).expect("a photograph");
    (folder, source, decoded)
}

/// A level of 8 bits, or between two of them; a gray is its own red, green and blue.
fn level_at(decoded: &Photograph, x: usize, y: usize, c: usize) -> f64 {
    let c = c.min(decoded.channels() - 1);
    match decoded {
        Photograph::Eight(raster) => f64::from(raster.pixel(x, y)[c]),
        Photograph::Sixteen(raster) => f64::from(raster.pixel(x, y)[c]) / 257.0,
    }
}

/// Largest difference from what is expected, in levels of 8 bits.
fn difference(decoded: &Photograph, expected: impl Fn(usize, usize, usize) -> f64) -> f64 {
    let places = (0..decoded.height()).flat_map(|y| (0..decoded.width()).map(move |x| (x, y)));
    let samples = places.flat_map(|(x, y)| (0..decoded.channels().min(3)).map(move |c| (x, y, c)));
    samples.map(|(x, y, c)| (level_at(decoded, x, y, c) - expected(x, y, c)).abs()).fold(0.0, f64::max)
}

macro_rules! file {
    ($name:literal) => {
        &include_bytes!(concat!("files/", $name))[..]
    };
}

/// The file, samples of a pixel, bits, and most levels of difference.
#[test]
fn pictures_without_loss_are_what_they_were_made_of() {
    let cases: [(&[u8], usize, u16, f64); 6] = [
        (file!("rgb.jxl"), 3, 8, 0.0),
        (file!("rgb16.jxl"), 3, 16, 3.0 / 257.0),
        (file!("rgba.jxl"), 4, 8, 0.0),
        (file!("gray.jxl"), 1, 8, 0.0),
        (file!("float.jxl"), 3, 16, 0.05),
        (file!("lossless.heic"), 3, 8, 0.0),
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

/// What rounding makes of colors that are computed in whole numbers, as other programs do.
const ROUNDED: f64 = 1.0;

/// The file, what the program that made it reads from it, samples of a pixel, bits, and most levels of difference.
#[test]
fn pictures_with_loss_are_what_other_programs_make_of_them() {
    let cases: [(&[u8], &[u8], usize, u16, f64); 6] = [
        (file!("lossy.jxl"), file!("lossy.jxl.png"), 3, 8, ROUNDED),
        (file!("yuv420.heic"), file!("yuv420.heic.png"), 3, 8, ROUNDED),
        (file!("alpha.heic"), file!("alpha.heic.png"), 4, 8, ROUNDED),
        (file!("deep.heic"), file!("deep.heic.png"), 3, 16, ROUNDED),
        (file!("gray.heic"), file!("gray.heic.png"), 3, 8, ROUNDED),
        (file!("p3.heic"), file!("p3.heic.png"), 3, 8, ROUNDED),
    ];
    for (number, (bytes, other, channels, bits, most)) in cases.into_iter().enumerate() {
        let (_folder, _, decoded) = read(bytes);
        let (_folder, _, expected) = read(other);
        assert_eq!((decoded.width(), decoded.height()), (WIDTH, HEIGHT), "{number}");
        assert_eq!((decoded.channels(), decoded.sample_bits()), (channels, bits), "{number}");
        let found = difference(&decoded, |x, y, c| level_at(&expected, x, y, c));
        assert!(found <= most, "{number}: {found}");
    }
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

/// The orientation in EXIF, a quarter turn clockwise, says the same once more in the one, and in the other something else.
#[test]
fn what_the_codec_says_of_orientation_counts() {
    // A quarter turn clockwise, and one anticlockwise: the first pixel was the first of the last row, or the last of the first.
    let (turned, rotated): (fn(usize, usize) -> [usize; 2], fn(usize, usize) -> [usize; 2]) =
        (|x, y| [y, HEIGHT - 1 - x], |x, y| [WIDTH - 1 - y, x]);
    let cases: [(&[u8], &[u8], _); 2] = [
        (file!("turned.jxl"), file!("turned.jxl.png"), turned),
        (file!("rotated.heic"), file!("rotated.heic.png"), rotated),
    ];
    for (bytes, other, place) in cases {
        let (_folder, source, decoded) = read(bytes);
        let (_folder, _, expected) = read(other);
        assert_eq!((source.width, source.height, source.orientation), (HEIGHT, WIDTH, 1));
        let found = difference(&decoded, |x, y, c| level_at(&expected, x, y, c));
        assert!(found <= ROUNDED, "{found}");
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

/// Linear light of any size.
struct Lights {
    hole: bool,
}

impl Lights {
    fn light(x: usize, y: usize, c: usize) -> f32 {
        [x as f32 / WIDTH as f32, y as f32 / HEIGHT as f32, 1.0 / (1 + x * y) as f32][c]
    }
}

impl RowSource for Lights {
    fn width(&self) -> usize {
        WIDTH
    }
    fn height(&self) -> usize {
        HEIGHT
    }
    fn is_opaque(&self) -> bool {
        !self.hole
    }
    fn rgba8_row(&self, _: usize, _: &mut [u8]) -> Result<()> {
        panic!("floating point was asked for")
    }
    fn rgba16_row(&self, _: usize, _: &mut [u16]) -> Result<()> {
        panic!("floating point was asked for")
    }
    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        for (x, pixel) in row.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let alpha = if self.hole && x < 4 { x as f32 / 4.0 } else { 1.0 };
            *pixel = [Self::light(x, y, 0), Self::light(x, y, 1), Self::light(x, y, 2), alpha];
        }
        Ok(())
    }
}

fn written(name: &str, hole: bool) -> Vec<u8> {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join(name);
    let options = OutputOptions::default().with_depth_for(&path, 8);
    assert_eq!(options.depth, Depth::Float);
    write(&path, &Lights { hole }, &Metadata::default(), &options, &StageContext::default()).expect("written");
    std::fs::read(&path).expect("a file")
}

/// What a sample of sRGB's curve means as light (IEC 61966-2-1, equation 6).
fn light_of(sample: u16) -> f64 {
    let encoded = f64::from(sample) / 65535.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Half a level of 16 bits where the curve is steepest, and half a part in 128: a mantissa of the brightest light, 1, has 7 bits.
const FINE: f64 = 0.5 * 2.3 / 65535.0;
const COARSE: f64 = 0.5 / 128.0 + FINE;

#[test]
fn panoramas_in_linear_light_come_back() {
    for (name, hole, channels, most) in
        [("a.exr", false, 3, FINE), ("a.exr", true, 4, FINE), ("a.hdr", false, 3, COARSE), ("a.hdr", true, 3, COARSE)]
    {
        let (_folder, source, decoded) = read(&written(name, hole));
        assert_eq!((source.width, source.height, decoded.channels()), (WIDTH, HEIGHT, channels), "{name}");
        let Photograph::Sixteen(raster) = decoded else { panic!("8 bit") };
        for (x, y, c) in (5..WIDTH).flat_map(|x| (0..HEIGHT).flat_map(move |y| (0..3).map(move |c| (x, y, c)))) {
            let found = light_of(raster.pixel(x, y)[c]);
            assert!((found - f64::from(Lights::light(x, y, c))).abs() <= most, "{name} {x} {y} {c}: {found}");
        }
        if channels == 4 {
            assert_eq!(raster.pixel(1, 9)[3], 16384);
            assert_eq!(raster.pixel(0, 9), [0; 4], "no color where nothing is");
            let found = i32::from(raster.pixel(2, 9)[1]) - i32::from(raster.pixel(9, 9)[1]);
            assert!(found.abs() <= 1, "colors are straight: {found}");
        }
    }
}

/// What another writer makes of the same: half as many bits, and every compression it has.
#[test]
fn exr_files_of_another_writer_are_read() {
    for encoding in
        [Encoding::UNCOMPRESSED, Encoding::FAST_LOSSLESS, Encoding::SMALL_LOSSLESS, Encoding::SMALL_FAST_LOSSLESS]
    {
        let light = |place: exr::math::Vec2<usize>| [0, 1, 2].map(|c| Lights::light(place.x(), place.y(), c));
        let channels = SpecificChannels::rgb(|place| {
            let [red, green, blue] = light(place).map(f16::from_f32);
            (red, green, blue)
        });
        let attributes = exr::prelude::LayerAttributes::named("photograph");
        let layer = exr::prelude::Layer::new((WIDTH, HEIGHT), attributes, encoding, channels);
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("to memory");
        let (_folder, _, decoded) = read(&bytes.into_inner());
        let Photograph::Sixteen(raster) = decoded else { panic!("8 bit") };
        // 0.5 is 48192 of 65535 by sRGB's curve.
        assert_eq!((raster.pixel(12, 9)[0], raster.pixel(12, 9)[1]), (48_192, 48_192), "{encoding:?}");
    }
}

/// Samples of half as many bits, whose share of rounding is a twentieth of a level, in every compression; B44 has loss.
#[test]
fn exr_files_of_its_own_library_are_read() {
    let cases: [(&[u8], usize, f64); 6] = [
        (file!("piz.exr"), 3, 0.1),
        (file!("pxr24.exr"), 3, 0.1),
        (file!("rle.exr"), 3, 0.1),
        (file!("b44.exr"), 3, 2.0),
        (file!("tiles.exr"), 4, 0.2),
        (file!("gray.exr"), 1, 0.1),
    ];
    for (number, (bytes, channels, most)) in cases.into_iter().enumerate() {
        let (_folder, source, decoded) = read(bytes);
        assert_eq!((source.width, source.height), (WIDTH, HEIGHT), "{number}");
        assert_eq!((decoded.channels(), decoded.sample_bits()), (channels, 16), "{number}");
        let found = difference(&decoded, |x, y, c| f64::from(level(x, y, c)));
        assert!(found <= most, "{number}: {found}");
        if channels == 4 {
            assert!((0..WIDTH).all(|x| (level_at(&decoded, x, 5, 3) - f64::from(opacity(x))).abs() < 0.1));
        }
    }
}

#[test]
fn our_exr_is_read_by_another_reader() {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .pedantic();
    use exr::prelude::{ReadChannels, ReadLayers};
    let image = image.from_buffered(Cursor::new(written("a.exr", true))).expect("an image");
    let names: Vec<String> = image.layer_data.channel_data.list.iter().map(|one| one.name.to_string()).collect();
    assert_eq!(names, ["A", "B", "G", "R"]);
    let red: Vec<f32> = image.layer_data.channel_data.list[3].sample_data.values_as_f32().collect();
    assert_eq!(red[9 * WIDTH + 12], 0.5);
    assert_eq!(red[9 * WIDTH + 2], 0.5 * Lights::light(2, 9, 0), "multiplied by alpha");
}

/// Wherever it ends, a file is refused with a reason, and never taken for whole.
#[test]
fn files_that_are_cut_off_are_refused() {
    let (exr, hdr) = (written("a.exr", false), written("a.hdr", false));
    for whole in [
        file!("rgb.jxl"),
        file!("turned.jxl"),
        file!("yuv420.heic"),
        file!("alpha.heic"),
        file!("tiles.exr"),
        exr.as_slice(),
        hdr.as_slice(),
    ] {
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
}
