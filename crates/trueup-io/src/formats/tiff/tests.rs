//! TIFFs of unusual kinds, written tag by tag.

use std::io::Cursor;

use moxcms::{ColorProfile, ToneReprCurve};
use tempfile::TempDir;
use tiff::encoder::{TiffEncoder, TiffValue};
use tiff::tags::Tag;
use trueup_core::color::TransferCurve;
use trueup_core::raster::Photograph;
use trueup_core::source::{PhotographSource, SourceImage};
use trueup_core::{Error, StageContext};

use crate::color::PhotographColors;
use crate::decode::{FilePhotographs, photograph, sample_bits};
use crate::source::{SourceOptions, scan};

const SIDE: usize = 16;

/// Tags that set a kind apart.
#[derive(Default)]
struct Form<'a> {
    photometric: u16,
    bits: &'a [u16],
    format: Option<u16>,
    palette: Option<&'a [u16]>,
    sampling: Option<[u16; 2]>,
    icc: Option<&'a [u8]>,
    extra: Option<u16>,
    is_planar: bool,
    is_big: bool,
}

fn tiff<T: TiffValue + ?Sized>(form: &Form<'_>, strips: &[&T]) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    macro_rules! written {
        ($encoder:expr) => {{
            let mut encoder = $encoder.expect("a header");
            let mut directory = encoder.image_directory().expect("a directory");
            let mut offsets = Vec::new();
            let mut lengths = Vec::new();
            for strip in strips {
                offsets.push(directory.write_data(*strip).expect("written") as u32);
                lengths.push(strip.bytes() as u32);
            }
            directory.write_tag(Tag::ImageWidth, SIDE as u32).expect("written");
            directory.write_tag(Tag::ImageLength, SIDE as u32).expect("written");
            directory.write_tag(Tag::RowsPerStrip, SIDE as u32).expect("written");
            directory.write_tag(Tag::StripOffsets, &offsets[..]).expect("written");
            directory.write_tag(Tag::StripByteCounts, &lengths[..]).expect("written");
            directory.write_tag(Tag::BitsPerSample, form.bits).expect("written");
            directory.write_tag(Tag::SamplesPerPixel, form.bits.len() as u16).expect("written");
            directory.write_tag(Tag::Compression, 1_u16).expect("written");
            directory.write_tag(Tag::PhotometricInterpretation, form.photometric).expect("written");
            if let Some(format) = form.format {
                directory.write_tag(Tag::SampleFormat, &vec![format; form.bits.len()][..]).expect("written");
            }
            if let Some(palette) = form.palette {
                directory.write_tag(Tag::ColorMap, palette).expect("written");
            }
            if let Some(sampling) = form.sampling {
                directory.write_tag(Tag::ChromaSubsampling, &sampling[..]).expect("written");
            }
            if let Some(icc) = form.icc {
                directory.write_tag(Tag::IccProfile, icc).expect("written");
            }
            if let Some(extra) = form.extra {
                directory.write_tag(Tag::ExtraSamples, extra).expect("written");
            }
            if form.is_planar {
                directory.write_tag(Tag::PlanarConfiguration, 2_u16).expect("written");
            }
            directory.finish().expect("written");
        }};
    }
    match form.is_big {
        true => written!(TiffEncoder::new_big(&mut bytes)),
        false => written!(TiffEncoder::new(&mut bytes)),
    }
    bytes.into_inner()
}

fn examined(folder: &TempDir, bytes: &[u8]) -> Result<SourceImage, String> {
    let path = folder.path().join("picture.tif");
    std::fs::write(&path, bytes).expect("writing a test file");
    let inputs = [path.display().to_string()];
    let mut sources = scan(&inputs, &SourceOptions::default(), &StageContext::default()).expect("a scan");
    match sources.rejected.pop() {
        Some(rejected) => Err(rejected.reason),
        None => Ok(sources.photographs.remove(0)),
    }
}

fn decoded(bytes: &[u8]) -> Photograph {
    let folder = TempDir::new().expect("a temporary folder");
    photograph(&examined(&folder, bytes).expect("accepted")).expect("decoded")
}

fn eight(photograph: &Photograph) -> &trueup_core::raster::Raster<u8> {
    match photograph {
        Photograph::Eight(raster) => raster,
        Photograph::Sixteen(_) => panic!("8 bits"),
    }
}

fn sixteen(photograph: &Photograph) -> &trueup_core::raster::Raster<u16> {
    match photograph {
        Photograph::Sixteen(raster) => raster,
        Photograph::Eight(_) => panic!("16 bits"),
    }
}

/// 16-bit sRGB of 0.25, 0.5 and 1 (IEC 61966-2-1, equation 9): 0.537099, 0.735357, 1.
const ENCODED: [u16; 3] = [35_199, 48_192, 65_535];

#[test]
fn one_channel_of_floating_point_is_gray_light() {
    let light: Vec<f32> = (0..SIDE * SIDE).map(|at| [0.25, 0.5, 1.0, f32::NAN][at % 4]).collect();
    let form = Form { photometric: 1, bits: &[32], format: Some(3), ..Form::default() };
    let photograph = decoded(&tiff(&form, &[&light[..]]));
    assert_eq!(photograph.channels(), 1);
    assert_eq!(sixteen(&photograph).row(0)[..4], [ENCODED[0], ENCODED[1], ENCODED[2], 0]);

    let double: Vec<f64> = light.iter().map(|&value| f64::from(value)).collect();
    let form = Form { bits: &[64], ..form };
    assert_eq!(sixteen(&decoded(&tiff(&form, &[&double[..]]))).row(0)[..2], ENCODED[..2]);

    // Half precision: 0.25 is 0x3400, 0.5 is 0x3800, 1 is 0x3c00.
    let half: Vec<u16> = (0..SIDE * SIDE).map(|at| [0x3400, 0x3800, 0x3c00][at % 3]).collect();
    let form = Form { bits: &[16], ..form };
    let bytes = tiff(&form, &[&half[..]]);
    assert_eq!(sixteen(&decoded(&bytes)).row(0)[..3], ENCODED);
    let folder = TempDir::new().expect("a temporary folder");
    assert_eq!(sample_bits(&examined(&folder, &bytes).expect("accepted")).expect("a header"), 16);
}

/// Samples are handed out with sRGB's curve: that of the profile is no longer theirs.
#[test]
fn light_is_in_the_primaries_of_its_profile_alone() {
    let linear = |mut profile: ColorProfile| {
        let curve = Some(ToneReprCurve::Lut(Vec::new()));
        (profile.red_trc, profile.green_trc, profile.blue_trc) = (curve.clone(), curve.clone(), curve);
        profile.encode().expect("a profile")
    };
    let light = [0.25_f32, 0.5, 1.0].repeat(SIDE * SIDE);
    for (profile, is_srgb) in [(ColorProfile::new_srgb(), true), (ColorProfile::new_display_p3(), false)] {
        let icc = linear(profile);
        let form = Form { photometric: 2, bits: &[32; 3], format: Some(3), icc: Some(&icc), ..Form::default() };
        let folder = TempDir::new().expect("a temporary folder");
        let source = examined(&folder, &tiff(&form, &[&light[..]])).expect("accepted");
        let colors = PhotographColors::survey(std::slice::from_ref(&source), &StageContext::default());
        assert_eq!(colors.is_srgb(), is_srgb, "{}", colors.name());
        assert!(colors.transfer_curve().is_same(&TransferCurve::SRGB), "{:?}", colors.transfer_curve());
        let photographs = FilePhotographs::new(vec![source], 0).in_colors(colors);
        assert_eq!(sixteen(&photographs.photograph(0).expect("decoded")).pixel(3, 5), ENCODED);
    }
}

#[test]
fn planes_of_floating_point_become_pixels() {
    let plane = |light: f32| vec![light; SIDE * SIDE];
    let form = Form { photometric: 2, bits: &[32; 3], format: Some(3), is_planar: true, ..Form::default() };
    let [r, g, b] = [plane(0.25), plane(0.5), plane(2.0)];
    let photograph = decoded(&tiff(&form, &[&r[..], &g[..], &b[..]]));
    assert_eq!(sixteen(&photograph).pixel(7, 9), ENCODED);
}

#[test]
fn palettes_are_looked_up() {
    for is_big in [false, true] {
        for scale in [1_u16, 257] {
            let palette: Vec<u16> = (0..3 * 256).map(|at| (at % 256 / (1 + at / 256)) as u16 * scale).collect();
            let form = Form { photometric: 3, bits: &[8], palette: Some(&palette), is_big, ..Form::default() };
            let indices: Vec<u8> = (0..SIDE * SIDE).map(|at| at as u8).collect();
            let photograph = decoded(&tiff(&form, &[&indices[..]]));
            assert_eq!(eight(&photograph).pixel(9, 3), [57, 28, 19]);
        }
    }
    // Four bits: two indices a byte, the first in the upper half.
    let palette: Vec<u16> = (0..48).map(|at| at * 1285).collect();
    let form = Form { photometric: 3, bits: &[4], palette: Some(&palette), ..Form::default() };
    let photograph = decoded(&tiff(&form, &[&[0x4f_u8; SIDE * SIDE / 2][..]]));
    assert_eq!(eight(&photograph).row(5)[..6], [20, 100, 180, 75, 155, 235]);

    let folder = TempDir::new().expect("a temporary folder");
    let short = tiff(&Form { palette: Some(&palette[..30]), ..form }, &[&[0_u8; SIDE * SIDE / 2][..]]);
    let source = examined(&folder, &short).expect("its header is well");
    assert!(photograph_error(&source).contains("palette"), "{}", photograph_error(&source));
}

fn photograph_error(source: &SourceImage) -> String {
    photograph(source).expect_err("damaged").to_string()
}

#[test]
fn color_differences_become_colors() {
    let form = Form { photometric: 6, bits: &[8; 3], sampling: Some([1, 1]), ..Form::default() };
    // Rec. 601: 0.299 R + 0.587 G + 0.114 B, (B - Y) / 1.772 + 128, (R - Y) / 1.402 + 128 of 200, 100, 50.
    let samples: Vec<u8> = [124, 86, 182].repeat(SIDE * SIDE);
    let photograph = decoded(&tiff(&form, &[&samples[..]]));
    for (value, expected) in eight(&photograph).pixel(3, 3).iter().zip([200_u8, 100, 50]) {
        assert!(value.abs_diff(expected) <= 1, "{value} {expected}");
    }
    let folder = TempDir::new().expect("a temporary folder");
    let reduced = tiff(&Form { sampling: Some([2, 2]), ..form }, &[&samples[..]]);
    assert!(examined(&folder, &reduced).expect_err("refused").contains("ubsampl"));
}

#[test]
fn few_bits_and_alpha_of_gray_are_spread() {
    let form = Form { photometric: 1, bits: &[2], ..Form::default() };
    let photograph = decoded(&tiff(&form, &[&[0b00_01_10_11_u8; SIDE * SIDE / 4][..]]));
    assert_eq!(eight(&photograph).row(2)[..4], [0, 85, 170, 255]);

    let form = Form { photometric: 1, bits: &[16, 16], ..Form::default() };
    let samples: Vec<u16> = [300, 65_534].repeat(SIDE * SIDE);
    assert_eq!(sixteen(&decoded(&tiff(&form, &[&samples[..]]))).pixel(1, 1), [300, 300, 300, 65_534]);
}

/// ExtraSamples says 1 of colors multiplied by alpha, and 2 of such that are not (TIFF 6.0, section 18).
#[test]
fn colors_multiplied_by_alpha_are_divided_by_it() {
    let pixels = SIDE * SIDE;
    for (extra, expected) in [(1, [100, 50, 255, 51]), (2, [20, 10, 51, 51])] {
        let form = Form { photometric: 2, bits: &[8; 4], extra: Some(extra), ..Form::default() };
        let samples = [20_u8, 10, 51, 51].repeat(pixels);
        assert_eq!(eight(&decoded(&tiff(&form, &[&samples[..]]))).pixel(3, 5), expected);
    }
    let form = Form { photometric: 2, bits: &[16; 4], extra: Some(1), ..Form::default() };
    let samples = [2000_u16, 1000, 13_107, 13_107].repeat(pixels);
    assert_eq!(sixteen(&decoded(&tiff(&form, &[&samples[..]]))).pixel(3, 5), [10_000, 5000, 65_535, 13_107]);
    let form = Form { photometric: 1, bits: &[8, 8], ..form };
    assert_eq!(eight(&decoded(&tiff(&form, &[&[20_u8, 51].repeat(pixels)[..]]))).pixel(3, 5), [100, 100, 100, 51]);
    let form = Form { photometric: 2, bits: &[32; 4], format: Some(3), ..form };
    let light = [0.125_f32, 0.25, 0.5, 0.5].repeat(pixels);
    let [quarter, half, white] = ENCODED;
    assert_eq!(sixteen(&decoded(&tiff(&form, &[&light[..]]))).pixel(3, 5), [quarter, half, white, 32_768]);
}

#[test]
fn damaged_files_of_these_kinds_are_refused() {
    let palette: Vec<u16> = (0..768).collect();
    let form = Form { photometric: 3, bits: &[8], palette: Some(&palette), ..Form::default() };
    let whole = tiff(&form, &[&[7_u8; SIDE * SIDE][..]]);
    let folder = TempDir::new().expect("a temporary folder");
    let source = examined(&folder, &whole).expect("accepted");
    photograph(&source).expect("decoded");
    // The directory lies behind the pixels: cut files are found out when they are decoded after they were examined.
    for length in (0..whole.len()).step_by(7) {
        std::fs::write(&source.path, &whole[..length]).expect("our own file");
        assert!(matches!(photograph(&source), Err(Error::Input { .. })), "cut to {length} of {}", whole.len());
    }
}
