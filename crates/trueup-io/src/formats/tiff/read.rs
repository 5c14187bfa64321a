//! Photographs in TIFF.

use std::io::{Read, Seek};

use exif::{Field, Tag as ExifTag};
use tiff::tags::{ExtraSamples, Tag};
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::convert::{rgb_of_cmyk, rgb_of_ycbcr, unpacked};
use super::page::{FirstPage, PixelKind};
use super::palette;
use super::raw::{failure, is_raw};
use super::samples::{Samples, TiffDecoder, decoder, not_as_stated, open};
use crate::color::profile_of_light;
use crate::format::{HeaderError, Input, PLAIN_PIXEL_BYTES, StoredPixels};
use crate::formats::alpha::straight;
use crate::formats::decoded::{check_unchanged, damaged, eight, sixteen};
use crate::formats::foreign::RAW;
use crate::formats::linear_light::encoded;
use crate::metadata::exif_fields::ExifFields;
use crate::metadata::tiff_fields;

/// Tag of the coefficients of luma.
const YCBCR_COEFFICIENTS: Tag = Tag::Unknown(529);

pub(super) fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let mut decoder = decoder(input).map_err(failure)?;
    if is_raw(&mut decoder) {
        return Err(HeaderError::Foreign(&RAW));
    }
    let FirstPage { width, height, bits, kind } = FirstPage::of(&mut decoder).map_err(failure)?;
    Ok(StoredPixels { width, height, bits, is_float: matches!(kind, PixelKind::Float(_)) })
}

/// The profile; of floating point samples, which are light, one of its primaries with the curve that they are handed
/// out in.
pub(super) fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let mut decoder = decoder(input).ok()?;
    let profile = decoder.find_tag(Tag::IccProfile).ok().flatten()?.into_u8_vec().ok()?;
    if is_light(&mut decoder) { profile_of_light(profile) } else { Some(profile) }
}

fn is_light(decoder: &mut TiffDecoder<'_>) -> bool {
    FirstPage::of(decoder).is_ok_and(|page| matches!(page.kind, PixelKind::Float(_)))
}

/// The EXIF library would read the whole file, pixels and all. A color space in EXIF has a curve, and light has not.
pub(super) fn exif(input: &mut Input) -> Option<ExifFields> {
    let mut decoder = decoder(input).ok()?;
    let fields = ExifFields::from_tiff(&mut decoder)?;
    Some(if is_light(&mut decoder) { fields.without_color_space() } else { fields })
}

pub(super) fn whole_fields(input: &mut Input, wanted: &[ExifTag]) -> Option<Vec<Field>> {
    tiff_fields::read(&mut decoder(input).ok()?, wanted)
}

pub(super) fn pixel_bytes(input: &mut Input) -> usize {
    let page = decoder(input).and_then(|mut decoder| FirstPage::of(&mut decoder));
    page.map_or(PLAIN_PIXEL_BYTES, |page| page.pixel_bytes())
}

/// Whether colors are stored multiplied by their opacity.
///
/// # Source
/// TIFF 6.0, section 18.
fn has_associated_alpha(decoder: &mut TiffDecoder<'_>) -> bool {
    let extra = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples).ok().flatten().unwrap_or_default();
    extra.first() == Some(&ExtraSamples::AssociatedAlpha.to_u16())
}

/// Decodes the first page.
pub(super) fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let reading = |error| Error::io("reading", &source.path, error);
    let page = decoder(&mut input).and_then(|mut decoder| FirstPage::of(&mut decoder));
    let page = page.map_err(|error| damaged(source, error))?;
    input.rewind().map_err(reading)?;
    let FirstPage { width, height, .. } = page;
    check_unchanged(source, width, height)?;
    if let PixelKind::Palette(bits) = page.kind {
        let mut bytes = Vec::new();
        input.read_to_end(&mut bytes).map_err(reading)?;
        return palette::decode(source, bytes, page, bits);
    }
    if page.kind == PixelKind::Wide {
        return Err(Error::input(
            &source.name,
            "its kind of pixels is not read",
            "Export it with 8 or 16 bits a sample.",
        ));
    }
    let mut decoder = open(source, page, &mut input)?;
    let samples = Samples::read(source, &mut decoder, page)?;
    let is_premultiplied = has_associated_alpha(&mut decoder);
    match (page.kind, samples) {
        (PixelKind::Plain(channels), Samples::Eight(samples)) if samples.len() == width * height * channels => {
            eight(width, height, channels, straight(samples, channels, is_premultiplied))
        }
        (PixelKind::Plain(channels), Samples::Sixteen(samples)) if samples.len() == width * height * channels => {
            sixteen(width, height, channels, straight(samples, channels, is_premultiplied))
        }
        (PixelKind::Bitmap, Samples::Eight(packed)) => {
            eight(width, height, 1, unpacked(&packed, width, 1).map(|bit| bit * u8::MAX).collect())
        }
        (PixelKind::Cmyk, Samples::Eight(samples)) => {
            eight(width, height, 3, rgb_of_cmyk(&samples, u8::MAX.into(), |value| value as u8))
        }
        (PixelKind::Cmyk, Samples::Sixteen(samples)) => {
            sixteen(width, height, 3, rgb_of_cmyk(&samples, u16::MAX.into(), |value| value as u16))
        }
        (PixelKind::Float(channels), Samples::Float(samples)) => {
            let samples = straight(samples, channels, is_premultiplied);
            sixteen(width, height, channels, encoded(&samples, channels, source.light))
        }
        (PixelKind::SmallGray(bits), Samples::Eight(packed)) => {
            let step = u8::MAX / ((1 << bits) - 1);
            eight(width, height, 1, unpacked(&packed, width, bits).map(|level| level * step).collect())
        }
        (PixelKind::YCbCr, Samples::Eight(samples)) => {
            let coefficients = decoder.get_tag_f32_vec(YCBCR_COEFFICIENTS).ok();
            eight(width, height, 3, rgb_of_ycbcr(&samples, coefficients.as_deref()))
        }
        _ => Err(not_as_stated(source)),
    }
}
