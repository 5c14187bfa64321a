//! Copies of photographs whose metadata claim a focal length.

use std::fs;
use std::path::Path;

use trueup::{Error, Result};

use super::ready::{ReadySet, TRUTH_FILE};

/// Copies a set into `folder`; its photographs' EXIF claim `factor` times their true focal length.
pub(super) fn write(original: &ReadySet, factor: f64, folder: &Path) -> Result<()> {
    let truth = original.truth.as_ref().ok_or_else(|| {
        Error::input(folder.display(), "the original's focal lengths are not known", "Take a set with its truth.json.")
    })?;
    let images = &truth.images;
    for (photograph, truth) in original.photographs.iter().zip(images) {
        let source = Path::new(photograph);
        let bytes = fs::read(source).map_err(|error| Error::io("reading", source, error))?;
        let claimed =
            with_exif(&bytes, &focal_exif(factor * truth.focal_px, truth.width, truth.height)).ok_or_else(|| {
                Error::input(photograph, "it is no JPEG file", "Give the set as JPEG files, or leave --sets out.")
            })?;
        let target = folder.join(&truth.file);
        fs::write(&target, claimed).map_err(|error| Error::io("writing", &target, error))?;
    }
    let target = folder.join(TRUTH_FILE);
    let text = serde_json::to_string_pretty(truth)
        .map_err(|error| Error::io("writing", &target, std::io::Error::other(error)))?;
    fs::write(&target, text).map_err(|error| Error::io("writing", &target, error))
}

/// A JPEG file with an EXIF segment put right behind its start marker; `None` for other files.
fn with_exif(jpeg: &[u8], exif: &[u8]) -> Option<Vec<u8>> {
    const START: [u8; 2] = [0xff, 0xd8];
    const APPLICATION_1: [u8; 2] = [0xff, 0xe1];
    let rest = jpeg.strip_prefix(&START)?;
    let length = u16::try_from(2 + EXIF_HEADER.len() + exif.len()).ok()?;
    let parts: [&[u8]; 6] = [&START, &APPLICATION_1, &length.to_be_bytes(), EXIF_HEADER, exif, rest];
    Some(parts.concat())
}

const EXIF_HEADER: &[u8] = b"Exif\0\0";

/// The TIFF structure of an EXIF block (EXIF 3.0, section 4.6): the focal length on a sensor 36 mm wide, the
/// photograph's size, the sensor's resolution.
fn focal_exif(focal_px: f64, width: usize, height: usize) -> Vec<u8> {
    const SENSOR_MM: f64 = 36.0;
    /// Denominator of the rationals: numbers to a ten-thousandth.
    const DENOMINATOR: u32 = 10_000;
    const MILLIMETRE: u16 = 4;
    const SHORT: u16 = 3;
    const LONG: u16 = 4;
    const RATIONAL: u16 = 5;
    /// Directory 0 has one entry and starts at 8, the EXIF directory with its five follows, then the rationals.
    const EXIF_AT: u32 = 8 + 2 + 12 + 4;
    const VALUES_AT: u32 = EXIF_AT + 2 + 5 * 12 + 4;
    let pixels_per_mm = width as f64 / SENSOR_MM;
    let rational = |value: f64| ((value * f64::from(DENOMINATOR)).round() as u32, DENOMINATOR);
    let mut bytes = b"II*\0".to_vec();
    let entry = |bytes: &mut Vec<u8>, tag: u16, kind: u16, value: u32| {
        bytes.extend(tag.to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    };
    bytes.extend(8_u32.to_le_bytes());
    bytes.extend(1_u16.to_le_bytes());
    entry(&mut bytes, 0x8769, LONG, EXIF_AT);
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(5_u16.to_le_bytes());
    entry(&mut bytes, 0x920a, RATIONAL, VALUES_AT);
    entry(&mut bytes, 0xa002, LONG, width as u32);
    entry(&mut bytes, 0xa003, LONG, height as u32);
    entry(&mut bytes, 0xa20e, RATIONAL, VALUES_AT + 8);
    entry(&mut bytes, 0xa210, SHORT, u32::from(MILLIMETRE));
    bytes.extend(0_u32.to_le_bytes());
    for (numerator, denominator) in [rational(focal_px / pixels_per_mm), rational(pixels_per_mm)] {
        bytes.extend(numerator.to_le_bytes());
        bytes.extend(denominator.to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup::StageContext;
    use trueup_scenes::{LightQuality, LitScene, Quality, RigOptions, SceneOptions, SetOutput, rig, write_set};

    #[test]
    fn the_stitcher_believes_the_claim() {
        let folder = tempfile::tempdir().expect("folder");
        let scene =
            LitScene::new(&SceneOptions { light: LightQuality::Fast, ..SceneOptions::default() }).expect("scene");
        let options = RigOptions { pictures: 1, width: 160, height: 120, ..RigOptions::default() };
        let cameras = rig(&options, &scene.viewpoint()).expect("cameras");
        let context = StageContext::default();
        let output = SetOutput { quality: Quality::Preview, depth: false };
        write_set(&folder.path().join("true"), "test", &scene, &cameras, output, &context).expect("set");
        let original = super::super::ready::ready(&folder.path().join("true")).expect("truth");
        let claimed = folder.path().join("claimed");
        fs::create_dir(&claimed).expect("folder");
        write(&original, 1.1, &claimed).expect("copy");
        let sources =
            trueup_io::source::scan(&[claimed.join("00.jpg").display().to_string()], &Default::default(), &context);
        let prior = sources.expect("readable").photographs[0].focal_prior.expect("a focal length");
        let truth = original.truth.expect("rendered");
        assert!((prior.focal_px / truth.images[0].focal_px - 1.1).abs() < 1e-4);
    }
}
