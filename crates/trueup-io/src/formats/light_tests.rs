//! OpenEXR and Radiance: what is written comes back, and files of other programs are read.

use std::io::Cursor;

use exr::prelude::{Encoding, Image, SpecificChannels, WritableImage, f16};
use tempfile::TempDir;
use trueup_core::raster::{Photograph, RowSource};
use trueup_core::{Result, StageContext};

use super::reading_tests::{HEIGHT, WIDTH, check_cut_off, difference, file, level, level_at, opacity, read, scanned};
use crate::encode::{Depth, Metadata, OutputOptions, write};

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

/// Half a level of 16 bits where the curve is steepest, and half a part in 128: a mantissa of the brightest light, 1,
/// has 7 bits.
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

#[test]
fn files_in_linear_light_that_are_cut_off_are_refused() {
    for whole in [file!("tiles.exr"), &written("a.exr", false), &written("a.hdr", false)] {
        check_cut_off(whole);
    }
}

/// ImageMagick writes samples of sRGB's curve, and says so.
#[test]
fn samples_that_are_no_light_are_refused() {
    let whole = written("a.hdr", false);
    let told = |line: &[u8]| [b"#?RADIANCE\n", line, &whole[b"#?RADIANCE\n".len()..]].concat();
    assert_eq!(scanned(&told(b"GAMMA=0.454545\n")).1.rejected.len(), 1);
    assert_eq!(scanned(&told(b"GAMMA=1.0\n")).1.photographs.len(), 1);
}
