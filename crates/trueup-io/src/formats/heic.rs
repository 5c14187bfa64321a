//! HEIC: HEIF with pictures coded by HEVC.

use std::io::Read;

use exif::{Field, Tag};
use heic_decoder::{DecodedImage, HeifError, ImageInfo, Metadata, RgbaImage};
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::alpha::{Share, straight};
use super::decoded::{check_unchanged, damaged, eight, sixteen};
use super::foreign::has_brand;
use crate::color::profile_of_code_points;
use crate::format::{Format, HeaderError, Input, Reading, StoredPixels};
use crate::metadata::block;
use crate::metadata::exif_fields::ExifFields;

/// The declaration.
///
/// # Source
/// Brands: ISO/IEC 23008-12, annex B.4; `mif1` and `msf1` stand for HEIF whatever the coding.
pub(crate) static HEIC: Format = Format {
    name: "HEIC",
    extensions: &["heic", "heif"],
    rare_extensions: &["hif"],
    reading: Some(Reading {
        kinds: "8 to 12 bits, color and gray, whole or in tiles, with or without alpha, as telephones and cameras write it; the primary \
                picture",
        has_signature: |start| [b"hei", b"hev", b"mif", b"msf"].iter().any(|brand| has_brand(start, brand)),
        stored,
        icc,
        exif,
        whole_fields,
        pixels,
        pixel_bytes: PIXEL_BYTES,
    }),
    writing: None,
};

/// Bytes a pixel takes in memory while it is decoded: up to three planes of 32 bits, twice where tiles are put together, and
/// the samples handed out.
const PIXEL_BYTES: usize = 32;

fn contents(input: &mut Input) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Most coded pixels for one that is shown, beside a tile of them: a crop can be as small as it likes, and what is decoded for it as
/// large.
const MOST_CODED: usize = 4;
const TILE_PIXELS: usize = 1 << 20;

/// What a file says of its picture, before anything as large as that is allocated.
fn info(bytes: &[u8]) -> heic_decoder::Result<ImageInfo> {
    let info = heic_decoder::probe(bytes)?;
    let shown = info.width.saturating_mul(info.height);
    if info.coded_width.saturating_mul(info.coded_height) > shown.saturating_mul(MOST_CODED).saturating_add(TILE_PIXELS)
    {
        return Err(HeifError::LimitExceeded("the picture is a small part of what is coded"));
    }
    Ok(info)
}

fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let bytes = contents(input).map_err(HeaderError::damaged)?;
    let info = info(&bytes).map_err(|error| match error {
        HeifError::Unsupported(words) => HeaderError::Unsupported(words.to_owned()),
        other => HeaderError::damaged(other),
    })?;
    let depth = info.bit_depth_luma.max(info.bit_depth_chroma);
    let bits = if depth <= 8 { 8 } else { depth as u16 };
    Ok(StoredPixels { width: info.width, height: info.height, bits, is_float: false })
}

fn metadata(input: &mut Input) -> Option<Metadata> {
    heic_decoder::read_metadata(&contents(input).ok()?).ok()
}

/// The profile; or one made of what the file says of its primaries and its curve in numbers.
fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let metadata = metadata(input)?;
    metadata.icc_profile.or_else(|| {
        let color = metadata.color_info?;
        profile_of_code_points(color.color_primaries, color.transfer_characteristics)
    })
}

/// The pixels are turned upright as the file itself says, which outranks the orientation of EXIF (ISO/IEC 23008-12, section 6.5.10
/// and annex A.2.3).
fn exif(input: &mut Input) -> Option<ExifFields> {
    let fields = ExifFields::from_exif(&block::parsed(metadata(input)?.exif?)?);
    Some(ExifFields { orientation: None, ..fields })
}

fn whole_fields(input: &mut Input, wanted: &[Tag]) -> Option<Vec<Field>> {
    Some(block::fields_of(&block::parsed(metadata(input)?.exif?)?, wanted))
}

fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let failed = |error: HeifError| damaged(source, error);
    let bytes = contents(&mut input).map_err(|error| Error::io("reading", &source.path, error))?;
    let info = info(&bytes).map_err(failed)?;
    check_unchanged(source, info.width, info.height)?;
    let image = heic_decoder::decode(&bytes).map_err(failed)?;
    drop(bytes);
    check_unchanged(source, image.width, image.height)?;
    let is_deep = image.bit_depth_luma.max(image.bit_depth_chroma) > 8;
    match (is_deep, image.alpha.is_some()) {
        (false, false) => eight(image.width, image.height, 3, image.to_rgb8().map_err(failed)?.data),
        (true, false) => sixteen(image.width, image.height, 3, image.to_rgb16().map_err(failed)?.data),
        (false, true) => eight(image.width, image.height, 4, of_alpha(&image, DecodedImage::to_rgba8).map_err(failed)?),
        (true, true) => {
            sixteen(image.width, image.height, 4, of_alpha(&image, DecodedImage::to_rgba16).map_err(failed)?)
        }
    }
}

/// Colors and opacity, the colors straight.
fn of_alpha<S: Share>(
    image: &DecodedImage,
    convert: fn(&DecodedImage) -> heic_decoder::Result<RgbaImage<S>>,
) -> heic_decoder::Result<Vec<S>> {
    let RgbaImage { data, premultiplied, .. } = convert(image)?;
    Ok(straight(data, 4, premultiplied))
}
