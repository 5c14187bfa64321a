//! Photographs: headers, EXIF, profiles, pixels, and the same file as a mask.

use std::path::{Path, PathBuf};

use moxcms::ColorProfile;
use trueup_core::raster::RowSource;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};
use trueup_io::color::PhotographColors;
use trueup_io::decode::{FilePhotographs, mask, small};
use trueup_io::encode::{Depth, Metadata, MetadataKept, OutputOptions, write};
use trueup_io::fuzzing::read_color_profile;
use trueup_io::provenance::{PanoramaDescription, describe};
use trueup_io::source::{SourceOptions, scan};

use super::blocks;
use super::work::Work;

/// Side of the pictures that are changed, in pixels: little more than photographs must have, so that many are read in a
/// second.
pub(super) const SIDE: usize = 20;

/// Largest picture that is decoded, in megapixels: headers claim any size.
const MOST_MEGAPIXELS: f64 = 1.0;

/// Pixels of a picture made small: fewer than the seeds have, so that decoders make them smaller.
const SMALL_PIXELS: f64 = 30.0;

/// A picture of many colors.
struct Colors;

impl Colors {
    fn level(x: usize, y: usize, channel: usize) -> u8 {
        [x * 13, y * 11, x * y, 255][channel].min(255) as u8
    }
}

impl RowSource for Colors {
    fn width(&self) -> usize {
        SIDE
    }

    fn height(&self) -> usize {
        SIDE
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        row.iter_mut().enumerate().for_each(|(at, sample)| *sample = Self::level(at / 4, y, at % 4));
        Ok(())
    }

    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        row.iter_mut().enumerate().for_each(|(at, sample)| *sample = u16::from(Self::level(at / 4, y, at % 4)) * 257);
        Ok(())
    }

    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        row.iter_mut().enumerate().for_each(|(at, sample)| *sample = f32::from(Self::level(at / 4, y, at % 4)) / 255.0);
        Ok(())
    }
}

/// Small pictures in a format, by their extension: with all the metadata it holds, at every depth it has.
pub(super) fn seeds(extension: &str) -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder for the seeds");
    let path = folder.path().join("seed").with_extension(extension);
    let icc = ColorProfile::new_display_p3().encode().ok();
    let full = Metadata { exif: Some(blocks::exif()), icc, xmp: Some(blocks::POSES.to_owned()) };
    let mut seeds = Vec::new();
    for (depth, metadata) in
        [(Depth::Auto, &full), (Depth::Sixteen, &full), (Depth::Float, &full), (Depth::Eight, &Metadata::default())]
    {
        let options = OutputOptions { depth, ..OutputOptions::default() };
        // Formats have some of the depths.
        if write(&path, &Colors, metadata, &options, &StageContext::default()).is_ok() {
            seeds.extend(std::fs::read(&path).ok());
        }
    }
    seeds
}

/// Files of a format that is not written, from the tests of its reader.
macro_rules! files {
    ($($name:literal),+) => {
        [$(&include_bytes!(concat!("../../../../crates/trueup-io/src/formats/files/", $name))[..]),+]
    };
}

/// Pictures in tiles and whole, with alpha, EXIF, a turn and colors in numbers.
pub(super) fn heic() -> Vec<Vec<u8>> {
    let files =
        files!("lossless.heic", "yuv420.heic", "alpha.heic", "deep.heic", "gray.heic", "rotated.heic", "p3.heic");
    files.map(<[u8]>::to_vec).into()
}

/// Mosaics, of packed bits and of lossless JPEG.
pub(super) fn digital_negatives() -> Vec<Vec<u8>> {
    files!("lossless.dng", "packed.dng").map(<[u8]>::to_vec).into()
}

/// Pictures in tiles and whole, of every depth, with alpha, EXIF, a turn and colors in numbers.
pub(super) fn avif() -> Vec<Vec<u8>> {
    let files = files!(
        "lossless.avif",
        "yuv420.avif",
        "alpha.avif",
        "deep10.avif",
        "deep12.avif",
        "gray.avif",
        "grid.avif",
        "premultiplied.avif",
        "turned.avif",
        "p3.avif",
        "ycgco.avif"
    );
    files.map(<[u8]>::to_vec).into()
}

/// Pictures in every compression, in lines and in tiles, and those that trueup writes.
pub(super) fn open_exr() -> Vec<Vec<u8>> {
    let files = files!("piz.exr", "pxr24.exr", "b44.exr", "rle.exr", "tiles.exr", "gray.exr");
    seeds("exr").into_iter().chain(files.map(<[u8]>::to_vec)).collect()
}

/// Pictures with and without loss, of whole numbers and not, bare and in boxes.
pub(super) fn jpeg_xl() -> Vec<Vec<u8>> {
    let files = files!("rgb.jxl", "rgb16.jxl", "rgba.jxl", "gray.jxl", "lossy.jxl", "float.jxl", "turned.jxl");
    files.map(<[u8]>::to_vec).into()
}

/// Profiles of every kind that is read.
pub(super) fn profiles() -> Vec<Vec<u8>> {
    let all = [
        ColorProfile::new_display_p3(),
        ColorProfile::new_srgb(),
        ColorProfile::new_gray_with_gamma(2.2),
        ColorProfile::new_bt2020_pq(),
    ];
    all.iter().filter_map(|profile| profile.encode().ok()).collect()
}

/// Masks: two levels, as people paint them, and with alpha.
pub(super) fn masks() -> Vec<Vec<u8>> {
    seeds("png")
}

/// The path of a photograph of this name, [`SIDE`] pixels a side; written where there is none.
pub(super) fn photograph(work: &Work, name: &str) -> PathBuf {
    let path = work.path().join(name);
    if !path.exists() {
        let written = write(&path, &Colors, &Metadata::default(), &OutputOptions::default(), &StageContext::default());
        written.unwrap_or_else(|error| panic!("{error}"));
    }
    path
}

/// Reads a picture as the mask of a photograph of its size, if it has the one of the pictures here.
pub(super) fn read_mask(work: &Work, input: &[u8]) {
    let context = StageContext::default();
    let options = SourceOptions { max_megapixels: MOST_MEGAPIXELS, ..SourceOptions::default() };
    let Ok(sources) = scan(&[photograph(work, "beside.png").display().to_string()], &options, &context) else { return };
    let Some(source) = sources.photographs.first() else { panic!("the photograph is read") };
    if let Ok(found) = mask(&work.file("mask.png", input), source, &options, &context) {
        assert_eq!(
            (found.width(), found.height()),
            (source.width, source.height),
            "a mask is as large as its photograph"
        );
    }
}

/// Reads a photograph in every way there is.
pub(super) fn read(work: &Work, input: &[u8]) {
    read_file(&work.file("photograph.jpg", input));
}

/// Reads a photograph with this profile.
pub(super) fn read_profile(work: &Work, input: &[u8]) {
    read_color_profile(input);
    let path = work.file("profile.png", &[]);
    let metadata = Metadata { icc: Some(input.to_vec()), ..Metadata::default() };
    // Files with profiles that cannot be are not written.
    if write(&path, &Colors, &metadata, &OutputOptions::default(), &StageContext::default()).is_ok() {
        read_file(&path);
    }
}

fn read_file(path: &Path) {
    let context = StageContext::default();
    let options = SourceOptions { max_megapixels: MOST_MEGAPIXELS, ..SourceOptions::default() };
    let Ok(sources) = scan(&[path.display().to_string()], &options, &context) else { return };
    let Some(source) = sources.photographs.first() else { return };
    let colors = PhotographColors::survey(&sources.photographs, &context);
    let files = FilePhotographs::new(sources.photographs.clone(), 0).in_colors(colors);
    let size = (source.width, source.height);
    if let Ok(photograph) = files.photograph(0) {
        assert_eq!((photograph.width(), photograph.height()), size, "a photograph is as large as its header says");
    }
    let _ = mask(path, source, &options, &context);
    let _ = small(source, SMALL_PIXELS);
    let description = PanoramaDescription {
        photographs: &[path],
        reference: 0,
        yaws: &[Some(0.3)],
        width: size.0,
        height: size.1,
        is_srgb: true,
        spherical: None,
        pose_deg: [0.0; 2],
    };
    describe(&description, MetadataKept::Keep);
}
