//! Photographs in other color spaces than sRGB. Expected colors were computed apart, from the primaries' published
//! chromaticities and the formulas of the curves.

use std::path::PathBuf;

use moxcms::ColorProfile;
use tempfile::TempDir;
use trueup_core::color::TransferCurve;
use trueup_core::raster::{Photograph, RowSource};
use trueup_core::source::{PhotographSource, SourceImage};
use trueup_core::{Result, StageContext};

use super::icc::is_srgb;
use super::*;
use crate::decode::FilePhotographs;
use crate::encode::{Metadata, OutputOptions, OutputProfile, write};
use crate::formats::specimens::Specimen;
use crate::source::{SourceOptions, scan};

/// The sample color of all tests.
const COLOR: [u8; 3] = [200, 100, 50];
const SIDE: u32 = 24;

fn display_p3() -> Vec<u8> {
    ColorProfile::new_display_p3().encode().expect("a profile")
}

fn adobe_rgb() -> Vec<u8> {
    ColorProfile::new_adobe_rgb().encode().expect("a profile")
}

/// A photograph of one color in a PNG, with a profile.
fn png(folder: &TempDir, name: &str, icc: Option<Vec<u8>>) -> PathBuf {
    let path = folder.path().join(name);
    // The name makes them different files: the first pixel is none of the tests'.
    let first = name.bytes().fold(0, u8::wrapping_add);
    let pixels = Specimen::eight(SIDE, SIDE, |x, y| if x + y == 0 { [first, 0, 0] } else { COLOR });
    std::fs::write(&path, pixels.png(icc)).expect("written");
    path
}

fn examine(paths: &[PathBuf]) -> Vec<SourceImage> {
    let inputs: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let sources = scan(&inputs, &SourceOptions::default(), &StageContext::default()).expect("a scan");
    assert!(sources.rejected.is_empty(), "{:?}", sources.rejected);
    sources.photographs
}

/// The photographs brought to one space, the space, and the codes of what was found.
fn survey(paths: &[PathBuf]) -> (FilePhotographs, PhotographColors, Vec<String>) {
    let sources = examine(paths);
    let context = StageContext::default();
    let colors = PhotographColors::survey(&sources, &context);
    let codes = context.findings().into_iter().map(|finding| finding.code).collect();
    (FilePhotographs::new(sources, 0).in_colors(colors.clone()), colors, codes)
}

/// A pixel on the scale of 0 to 255, and whether the photograph has 16 bits.
fn pixel(photographs: &FilePhotographs, index: usize) -> ([f64; 3], bool) {
    match photographs.photograph(index).expect("decodes") {
        Photograph::Eight(raster) => (std::array::from_fn(|c| f64::from(raster.pixel(9, 7)[c])), false),
        Photograph::Sixteen(raster) => (std::array::from_fn(|c| f64::from(raster.pixel(9, 7)[c]) / 257.0), true),
    }
}

fn assert_close(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance), "{found:?} for {expected:?}");
}

/// A finished picture of one color.
struct Plain([u8; 4]);

impl RowSource for Plain {
    fn width(&self) -> usize {
        SIDE as usize
    }
    fn height(&self) -> usize {
        SIDE as usize
    }
    fn rgba8_row(&self, _: usize, row: &mut [u8]) -> Result<()> {
        row.as_chunks_mut::<4>().0.fill(self.0);
        Ok(())
    }
    fn rgba16_row(&self, _: usize, row: &mut [u16]) -> Result<()> {
        row.as_chunks_mut::<4>().0.fill(self.0.map(|level| 257 * u16::from(level)));
        Ok(())
    }
    fn linear_row(&self, _: usize, row: &mut [f32]) -> Result<()> {
        row.as_chunks_mut::<4>().0.fill(self.0.map(|level| f32::from(level) / 255.0));
        Ok(())
    }
}

#[test]
fn photographs_of_one_space_are_left_as_they_are() {
    let folder = TempDir::new().expect("a folder");
    let paths = [png(&folder, "a.png", Some(display_p3())), png(&folder, "b.png", Some(display_p3()))];
    let (photographs, colors, codes) = survey(&paths);
    assert!(codes.is_empty(), "{codes:?}");
    assert_eq!(colors.icc().map(<[u8]>::len), Some(display_p3().len()));
    assert_eq!((colors.name().as_str(), colors.is_srgb()), ("Display P3", false));
    assert_eq!(*colors.transfer_curve(), TransferCurve::SRGB);
    for index in 0..2 {
        assert_eq!(pixel(&photographs, index), (COLOR.map(f64::from), false));
    }
}

#[test]
fn an_srgb_profile_and_none_are_one_space() {
    let folder = TempDir::new().expect("a folder");
    let paths = [png(&folder, "a.png", None), png(&folder, "b.png", Some(srgb_profile().to_vec()))];
    let (photographs, colors, codes) = survey(&paths);
    assert!(codes.is_empty() && colors.icc().is_none() && colors.is_srgb(), "{codes:?}");
    assert_eq!(pixel(&photographs, 1), (COLOR.map(f64::from), false));
}

#[test]
fn the_widest_gamut_takes_the_others_in() {
    let folder = TempDir::new().expect("a folder");
    let paths = [png(&folder, "plain.png", None), png(&folder, "p3.png", Some(display_p3()))];
    let (photographs, colors, codes) = survey(&paths);
    assert_eq!((colors.name().as_str(), codes), ("Display P3", vec!["color-converted".to_owned()]));
    let (converted, sixteen) = pixel(&photographs, 0);
    assert_close(converted, [187.123, 105.391, 61.976], 0.05);
    assert!(sixteen);
    assert_eq!(pixel(&photographs, 1), (COLOR.map(f64::from), false));
}

#[test]
fn adobe_rgb_has_its_own_curve() {
    let folder = TempDir::new().expect("a folder");
    let paths = [png(&folder, "plain.png", None), png(&folder, "adobe.png", Some(adobe_rgb()))];
    let (photographs, colors, _) = survey(&paths);
    let expected = TransferCurve::gamma(2.199_218_75).expect("a curve");
    assert_eq!(*colors.transfer_curve(), expected);
    assert_close(pixel(&photographs, 0).0, [177.242, 99.934, 56.123], 0.1);
}

/// A block of EXIF that names Adobe RGB.
fn exif_of_adobe_rgb() -> Vec<u8> {
    let field = exif::Field {
        tag: exif::Tag::InteroperabilityIndex,
        ifd_num: exif::In::PRIMARY,
        value: exif::Value::Ascii(vec![b"R03".to_vec()]),
    };
    let mut writer = exif::experimental::Writer::new();
    writer.push_field(&field);
    let mut block = std::io::Cursor::new(Vec::new());
    writer.write(&mut block, false).expect("a block");
    block.into_inner()
}

/// The same PNG with a chunk behind the first, the header (W3C PNG 5.3).
fn with_chunk(png: &[u8], kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    /// The signature, and the chunk IHDR.
    const BEFORE: usize = 8 + 25;
    let named = [kind, content].concat();
    let mut sum = flate2::Crc::new();
    sum.update(&named);
    let length = (content.len() as u32).to_be_bytes();
    [&png[..BEFORE], &length, &named, &sum.sum().to_be_bytes(), &png[BEFORE..]].concat()
}

/// Surveys a PNG of these bytes.
fn surveyed(png: &[u8]) -> PhotographColors {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("photograph.png");
    std::fs::write(&path, png).expect("written");
    survey(&[path]).1
}

#[test]
fn exif_is_not_asked_where_a_png_says_that_it_is_srgb() {
    let plain = Specimen::eight(SIDE, SIDE, |_, _| COLOR).png(None);
    let camera = with_chunk(&plain, b"eXIf", &exif_of_adobe_rgb());
    assert!(!surveyed(&camera).is_srgb());
    assert!(surveyed(&with_chunk(&camera, b"sRGB", &[0])).is_srgb());
    assert!(surveyed(&with_chunk(&camera, b"cICP", &[1, 13, 0, 1])).is_srgb());
}

/// Code points of Display P3 are 12 and 13, of sRGB 1 and 13, unspecified ones 2 (ITU-T H.273, tables 2 and 3).
#[test]
fn code_points_of_a_png_count_before_its_profile() {
    let of = |icc: Option<Vec<u8>>, points: [u8; 4]| {
        let plain = Specimen::eight(SIDE, SIDE, |_, _| COLOR).png(icc);
        surveyed(&with_chunk(&plain, b"cICP", &points)).name()
    };
    assert_eq!(of(None, [12, 13, 0, 1]), "primaries 12, transfer 13 of H.273");
    assert_eq!(of(Some(adobe_rgb()), [12, 13, 0, 1]), "primaries 12, transfer 13 of H.273");
    assert_eq!(of(Some(display_p3()), [1, 13, 0, 1]), "sRGB");
    for unknown in [[2, 2, 0, 1], [200, 13, 0, 1]] {
        assert_eq!(of(Some(display_p3()), unknown), "Display P3", "{unknown:?}");
    }
}

#[test]
fn exif_names_adobe_rgb_where_there_is_no_profile() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("camera.jpg");
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, 95);
    encoder.add_app_segment(1, [b"Exif\0\0", exif_of_adobe_rgb().as_slice()].concat()).expect("a segment");
    let pixels = COLOR.repeat((SIDE * SIDE) as usize);
    encoder.encode(&pixels, SIDE as u16, SIDE as u16, jpeg_encoder::ColorType::Rgb).expect("encoded");
    std::fs::write(&path, bytes).expect("written");
    let (_, colors, codes) = survey(&[path]);
    assert!(codes.is_empty(), "{codes:?}");
    let icc = colors.icc().expect("a profile to embed");
    let icc::Understood::Space(space) = icc::understand(icc) else { panic!("a space") };
    assert!(space.is_same(&icc::RgbSpace::adobe_rgb()));
}

#[test]
fn damaged_and_foreign_profiles_are_told_and_passed_over() {
    let folder = TempDir::new().expect("a folder");
    let mut cut = display_p3();
    cut.truncate(200);
    let mut falling = ColorProfile::new_display_p3();
    falling.green_trc = Some(moxcms::ToneReprCurve::Lut(vec![65535, 30000, 0]));
    let mut cmyk = display_p3();
    cmyk[16..20].copy_from_slice(b"CMYK");
    let cases = [
        (b"no profile at all".to_vec(), "color-profile-damaged"),
        (cut, "color-profile-damaged"),
        (falling.encode().expect("a profile"), "color-profile-damaged"),
        (cmyk, "color-profile-ignored"),
    ];
    for (index, (icc, code)) in cases.into_iter().enumerate() {
        let (photographs, colors, codes) = survey(&[png(&folder, &format!("{index}.png"), Some(icc))]);
        assert_eq!(codes, [code], "{index}");
        assert!(colors.icc().is_none());
        assert_eq!(pixel(&photographs, 0), (COLOR.map(f64::from), false));
    }
}

#[test]
fn gray_photographs_keep_their_light() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("gray.png");
    let icc = ColorProfile::new_gray_with_gamma(1.8).encode().expect("a profile");
    std::fs::write(&path, Specimen::eight(SIDE, SIDE, |_, _| [100]).png(Some(icc))).expect("written");
    let (photographs, colors, _) = survey(&[path]);
    assert!(colors.is_srgb());
    let Photograph::Sixteen(raster) = photographs.photograph(0).expect("decodes") else { panic!("8 bits") };
    assert!((f64::from(raster.pixel(3, 3)[0]) / 257.0 - 119.293).abs() < 0.1, "{:?}", raster.pixel(3, 3));
}

/// Gray with alpha is decoded to four channels.
#[test]
fn gray_with_alpha_keeps_its_light_and_colors_beside_a_gray_profile_theirs() {
    let folder = TempDir::new().expect("a folder");
    let icc = || ColorProfile::new_gray_with_gamma(1.8).encode().expect("a profile");
    let path = folder.path().join("gray.png");
    std::fs::write(&path, Specimen::eight(SIDE, SIDE, |_, _| [100, 51]).png(Some(icc()))).expect("written");
    let (photographs, ..) = survey(&[path]);
    let Photograph::Sixteen(raster) = photographs.photograph(0).expect("decodes") else { panic!("8 bits") };
    assert_close(pixel(&photographs, 0).0, [119.293; 3], 0.1);
    assert_eq!(raster.pixel(3, 3)[3], 51 * 257);
    let (photographs, ..) = survey(&[png(&folder, "colors.png", Some(icc()))]);
    assert_eq!(pixel(&photographs, 0), (COLOR.map(f64::from), false));
}

#[test]
fn every_format_gives_back_the_profile_and_the_colors() {
    let folder = TempDir::new().expect("a folder");
    let metadata = Metadata { icc: Some(display_p3()), ..Metadata::default() };
    let options = OutputOptions { jpeg_quality: 100, ..OutputOptions::default() };
    let picture = Plain([COLOR[0], COLOR[1], COLOR[2], 255]);
    for name in ["p.jpg", "p.png", "p.tif", "p.webp"] {
        let path = folder.path().join(name);
        write(&path, &picture, &metadata, &options, &StageContext::default()).expect("written");
        assert_eq!(embedded::read(&path).icc.as_deref(), metadata.icc.as_deref(), "{name}");
        let (photographs, colors, _) = survey(&[path]);
        assert_eq!(colors.name(), "Display P3", "{name}");
        assert_close(pixel(&photographs, 0).0, COLOR.map(f64::from), 1.0);
    }
}

#[test]
fn untagged_pictures_are_marked_as_srgb() {
    let folder = TempDir::new().expect("a folder");
    for name in ["p.jpg", "p.tif", "p.webp"] {
        let path = folder.path().join(name);
        write(&path, &Plain([9; 4]), &Metadata::default(), &OutputOptions::default(), &StageContext::default())
            .expect("written");
        assert!(is_srgb(&embedded::read(&path).icc.expect("a profile")), "{name}");
    }
}

#[test]
fn a_panorama_is_brought_to_srgb_on_request() {
    let folder = TempDir::new().expect("a folder");
    let metadata = Metadata { icc: Some(display_p3()), ..Metadata::default() };
    let options = OutputOptions { profile: OutputProfile::Srgb, ..OutputOptions::default() };
    let path = folder.path().join("web.png");
    write(&path, &Plain([200, 100, 50, 255]), &metadata, &options, &StageContext::default()).expect("written");
    let (photographs, colors, _) = survey(&[path]);
    assert!(colors.icc().is_none());
    let Photograph::Eight(raster) = photographs.photograph(0).expect("decodes") else { panic!("16 bits") };
    assert_eq!(raster.pixel(5, 5), [215, 93, 31], "alpha that is full everywhere is left out");
}

#[test]
fn the_built_in_profiles_are_always_the_same_bytes_and_what_they_say() {
    assert!(is_srgb(srgb_profile()));
    // The date is fixed; everything else follows from the numbers.
    assert_eq!(&srgb_profile()[24..30], [0x07, 0xd0, 0, 1, 0, 1]);
    assert!(srgb_profile().len() < 1000, "{}", srgb_profile().len());
    assert!(!is_srgb(&display_p3()) && !is_srgb(&adobe_rgb()) && !is_srgb(b""));
}
