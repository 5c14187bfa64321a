//! WebP.

use std::io::{BufWriter, Write};

use image_webp::{ColorType, DecodingError, WebPDecoder, WebPEncoder};
use trueup_core::raster::{Photograph, RowSource};
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};

use super::decoded::{check_unchanged, damaged, eight, sample_count};
use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::{Depth, OutputOptions};
use crate::encode::samples::{OutputSample, RGBA, flattened};
use crate::encode::strips::{BUFFER_BYTES, STRIP_ROWS, channels_of, for_each_strip};
use crate::format::{
    Format, HeaderError, Input, LOSSLESS_BYTES, Output, PLAIN_PIXEL_BYTES, Reading, SideLimit, StoredPixels,
    Transparency, Writer, Writing,
};
use crate::metadata::embedded;

/// The declaration.
///
/// # Source
/// Signature: RFC 9649 2.4. Sides: 14 bits, of which the common decoders take one less, RFC 9649 and libwebp.
pub(crate) static WEBP: Format = Format {
    name: "WebP",
    extensions: &["webp"],
    rare_extensions: &[],
    reading: Some(Reading {
        kinds: "lossy and lossless",
        has_signature: |start| start.starts_with(b"RIFF") && start.get(8..12) == Some(b"WEBP"),
        stored,
        icc: |input| WebPDecoder::new(input).ok()?.icc_profile().ok().flatten(),
        exif: embedded::read_exif,
        whole_fields: embedded::read_fields,
        pixels,
        reduced: None,
        pixel_bytes: PLAIN_PIXEL_BYTES,
    }),
    writing: Some(Writing {
        depths: &[Depth::Eight],
        transparency: Transparency::Always,
        sides: SideLimit { largest: 16_383, advice: "Write .jpg, .tif or .png instead, or a smaller panorama." },
        has_profile: true,
        memory: "the whole picture",
        bytes_per_pixel: |_| LOSSLESS_BYTES,
        writer: Writer::File(write),
    }),
};

fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let decoder = WebPDecoder::new(input).map_err(HeaderError::damaged)?;
    let (width, height) = decoder.dimensions();
    Ok(StoredPixels { width: width as usize, height: height as usize, bits: 8, is_float: false })
}

fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let failed = |error: DecodingError| damaged(source, error);
    let mut decoder = WebPDecoder::new(&mut input).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_unchanged(source, width, height)?;
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let mut samples = vec![0; sample_count(source, width, height, channels)?];
    decoder.read_image(&mut samples).map_err(failed)?;
    eight(width, height, channels, samples)
}

/// Writes a lossless WebP; its encoder wants the whole picture at once.
pub(super) fn write(
    file: &mut dyn Output,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> std::result::Result<(), WriteFailure> {
    let channels = channels_of(picture, options);
    let mut pixels = Vec::with_capacity(picture.width() * picture.height() * channels);
    let mut samples = Vec::new();
    for_each_strip::<u8>(picture, STRIP_ROWS, context, &mut |strip| {
        flattened(strip, channels, u8::of(options.background), &mut samples);
        pixels.extend_from_slice(&samples);
        Ok(())
    })?;
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let mut encoder = WebPEncoder::new(&mut output);
    encoder.set_icc_profile(metadata.profile().to_vec());
    if let Some(exif) = &metadata.exif {
        encoder.set_exif_metadata(exif.clone());
    }
    if let Some(xmp) = &metadata.xmp {
        encoder.set_xmp_metadata(xmp.clone().into_bytes());
    }
    let color = if channels == RGBA { ColorType::Rgba8 } else { ColorType::Rgb8 };
    encoder.encode(&pixels, picture.width() as u32, picture.height() as u32, color).map_err(std::io::Error::other)?;
    output.flush()?;
    Ok(())
}
