//! Photographs in JPEG.

use std::io::{Read, Seek};

use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};
use zune_core::bytestream::{ZByteIoError, ZCursor};
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;

use super::scans::{end_of_image, has_separate_subsampled_scans, is_one_scan};
use super::watched::{Watch, WatchedBytes};
use crate::format::{HeaderError, Input, StoredPixels};
use crate::formats::decoded::{MAX_PIXEL_BYTES, check_unchanged, damaged};
use crate::metadata::embedded;
use crate::metadata::exif_fields::ExifFields;
use crate::metadata::pose::stated_pose;

/// Largest width and height a JPEG can state (ITU-T T.81 table B.2).
const JPEG_MAX_SIDE: usize = 65_535;

/// Headers as cameras and editors write them: some leave bytes between segments that are no markers, which harms no
/// pixel.
fn header_options() -> DecoderOptions {
    DecoderOptions::default().set_strict_mode(false).set_max_width(JPEG_MAX_SIDE).set_max_height(JPEG_MAX_SIDE)
}

/// Strict decoding of what follows the headers: pixels that are damaged are refused, never filled up with gray.
fn pixel_options() -> DecoderOptions {
    header_options().set_strict_mode(true)
}

/// What the header states of the pixels.
pub(super) fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let mut decoder = JpegDecoder::new_with_options(input, header_options());
    decoder.decode_headers().map_err(|error| HeaderError::Damaged(words(&error)))?;
    let (width, height) = decoder.dimensions().ok_or_else(|| HeaderError::damaged("no frame header"))?;
    Ok(StoredPixels { width, height, bits: 8, is_float: false })
}

/// The ICC profile.
pub(super) fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let mut decoder = JpegDecoder::new_with_options(input, header_options());
    decoder.decode_headers().ok()?;
    decoder.icc_profile()
}

/// The fields of the EXIF block, and what the XMP packet beside it states of how the camera was held.
pub(super) fn exif(input: &mut Input) -> Option<ExifFields> {
    let fields = embedded::read_exif(input);
    let pose = input.rewind().ok().and_then(|()| xmp(input)).and_then(|packet| stated_pose(&packet));
    match (fields, pose) {
        (None, None) => None,
        (fields, pose) => Some(ExifFields { pose, ..fields.unwrap_or_default() }),
    }
}

/// The XMP packet.
fn xmp(input: &mut Input) -> Option<Vec<u8>> {
    let mut decoder = JpegDecoder::new_with_options(input, header_options());
    decoder.decode_headers().ok()?;
    decoder.xmp().cloned()
}

/// Decodes the pixels as they are stored.
pub(super) fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(|error| Error::io("reading", &source.path, error))?;
    decode(source, &bytes)
}

pub(super) fn decode(source: &SourceImage, bytes: &[u8]) -> Result<Photograph> {
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), header_options());
    decoder.decode_headers().map_err(|error| undecodable(source, &error))?;
    let (width, height) = decoder.dimensions().ok_or_else(|| damaged(source, "no frame header"))?;
    check_unchanged(source, width, height)?;
    let Some(end) = end_of_image(bytes) else {
        return whole_without_end(source, bytes).ok_or_else(|| {
            Error::input(
                &source.name,
                "the photograph is cut off: the JPEG ends before its end-of-image marker",
                COPY_AGAIN,
            )
        });
    };
    if has_separate_subsampled_scans(bytes) {
        return decode_separate_scans(source, bytes, width, height);
    }
    // Scans of several end at markers that decoders look for.
    let (coded, behind) = if is_one_scan(bytes) { (&bytes[..end], &BEYOND[..]) } else { (bytes, &[][..]) };
    decode_followed(source, coded, behind)
}

/// What people can do of a file that was damaged on its way.
const COPY_AGAIN: &str = "Copy it again from the camera or leave it out.";

/// What is decoded where data end too soon: more bytes than decoders hold ahead, then the end-of-image marker.
const BEYOND: [u8; 66] = {
    let mut bytes = [0x55; 66];
    bytes[64] = 0xff;
    bytes[65] = 0xd9;
    bytes
};

/// Decodes `coded` as if `behind` followed.
///
/// Where bytes were lost or replaced, codes after them are most often decodable as others, and what tells is that data
/// are left over or missing in the end.
///
/// # Departures
/// Strict decoding of zune-jpeg 0.5.15 accepts both.
fn decode_followed(source: &SourceImage, coded: &[u8], behind: &[u8]) -> Result<Photograph> {
    let watch = Watch::default();
    let mut decoder = JpegDecoder::new_with_options(WatchedBytes::new(coded, behind, &watch), header_options());
    decoder.decode_headers().map_err(|error| undecodable(source, &error))?;
    watch.restart();
    let (width, height) = decoder.dimensions().ok_or_else(|| damaged(source, "no frame header"))?;
    let (space, channels) = match decoder.input_colorspace() {
        Some(ColorSpace::Luma) => (ColorSpace::Luma, 1),
        _ => (ColorSpace::RGB, 3),
    };
    decoder.set_options(pixel_options().jpeg_set_out_colorspace(space));
    let pixels = decoder.decode().map_err(|error| undecodable(source, &error))?;
    let broken =
        |reason: &str| Err(Error::input(&source.name, format!("the photograph is damaged: {reason}"), COPY_AGAIN));
    if watch.has_passed_data() {
        return broken("its data go on where its pixels are complete");
    }
    if behind == BEYOND && watch.has_decoded_beyond(coded.len()) {
        return broken("its data end before its pixels do");
    }
    Ok(Photograph::Eight(Raster::from_data(width, height, channels, pixels)?))
}

/// Why the pixels of a photograph cannot be decoded.
fn undecodable(source: &SourceImage, error: &DecodeErrors) -> Error {
    damaged(source, words(error))
}

/// The decoder's own words in one line.
fn words(error: &DecodeErrors) -> String {
    match error {
        DecodeErrors::ExhaustedData | DecodeErrors::IoErrors(ZByteIoError::NotEnoughBytes(..)) => {
            "the file ends within it".to_owned()
        }
        other => format!("{other:?}").split_whitespace().collect::<Vec<_>>().join(" "),
    }
}

/// A JPEG that lacks nothing but its end-of-image marker, as programs leave it that are stopped while they write;
/// `None` if pixels are missing.
///
/// Whatever follows the last coded block of a picture changes none of its pixels; where blocks are missing, it stands
/// for them. Of progressive pictures it cannot be told in this way whether a scan that refines all pixels is missing.
///
/// # Source
/// ITU-T T.81 F.2.2 (decoding of a block takes the bits that its codes tell, and no more).
fn whole_without_end(source: &SourceImage, bytes: &[u8]) -> Option<Photograph> {
    /// What may follow, of which no two begin alike for more than a bit.
    const CONTINUATIONS: [u8; 3] = [0x00, 0x55, 0xaa];
    /// Bytes of it: more than a block has.
    const CONTINUED_BYTES: usize = 1024;
    /// Zeros that no coded picture ends in, but a file does whose room on the disk was taken before it was written.
    const EMPTY: [u8; 16] = [0; 16];
    // It may be half of the marker.
    let coded = bytes.strip_suffix(&[0xff]).unwrap_or(bytes);
    if !is_one_scan(bytes) || coded.ends_with(&EMPTY) {
        return None;
    }
    let continued = |byte: u8| {
        let behind = [&[byte; CONTINUED_BYTES][..], &[0xff, 0xd9]].concat();
        decode_followed(source, coded, &behind).ok()
    };
    let [first, others @ ..] = CONTINUATIONS;
    let photograph = continued(first)?;
    others.into_iter().all(|byte| continued(byte).as_ref() == Some(&photograph)).then_some(photograph)
}

/// Decodes a sequential JPEG that stores each component in a scan of its own and some at a lower resolution.
///
/// # Departures
/// zune-jpeg 0.5.15 turns these into stripes without an error (its issue 422), so that another decoder reads them.
fn decode_separate_scans(source: &SourceImage, bytes: &[u8], width: usize, height: usize) -> Result<Photograph> {
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.set_max_decoding_buffer_size(width.saturating_mul(height).saturating_mul(MAX_PIXEL_BYTES as usize));
    let pixels = decoder.decode().map_err(|error| damaged(source, error))?;
    match decoder.info().map(|info| info.pixel_format) {
        Some(jpeg_decoder::PixelFormat::RGB24) => Ok(Photograph::Eight(Raster::from_data(width, height, 3, pixels)?)),
        _ => Err(Error::input(&source.name, "its kind of pixels is not read", "Export it as an RGB JPEG.")),
    }
}
