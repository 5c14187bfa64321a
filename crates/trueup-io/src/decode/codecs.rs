//! One function per codec, from file to stored pixels.

use std::fs::File;
use std::io::{BufReader, Read, Seek};

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use super::jpeg_scans::has_separate_subsampled_scans;
use super::tiff_kinds;
use crate::format::{PictureFormat, SUPPORTED, read_start};

/// Largest width and height a JPEG can state (ITU-T T.81 table B.2).
const JPEG_MAX_SIDE: usize = 65_535;

/// Memory a decoder may take beside its pixels, in bytes.
const DECODER_SLACK_BYTES: u64 = 64 << 20;

/// Most bytes a pixel takes in memory while it is decoded: four 32-bit samples.
const MAX_PIXEL_BYTES: u64 = 16;

/// Strict decoding: a file that is damaged is refused, never filled up with gray.
pub(crate) fn jpeg_options() -> DecoderOptions {
    DecoderOptions::default().set_strict_mode(true).set_max_width(JPEG_MAX_SIDE).set_max_height(JPEG_MAX_SIDE)
}

/// Decodes the pixels as they are stored, before orientation.
pub(crate) fn decode_stored(image: &SourceImage) -> Result<Photograph> {
    let reading = |error| Error::io("reading", &image.path, error);
    let mut file = File::open(&image.path).map_err(reading)?;
    let start = read_start(&mut file).map_err(reading)?;
    file.rewind().map_err(reading)?;
    let format = PictureFormat::of_content(&start).ok_or_else(|| {
        Error::input(&image.name, format!("it is not a {SUPPORTED} picture"), "Give the photograph again.")
    })?;
    match format {
        PictureFormat::Jpeg => {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map_err(reading)?;
            decode_jpeg(image, &bytes)
        }
        PictureFormat::Png => decode_other(image, file, ImageFormat::Png),
        PictureFormat::Tiff => match tiff_kinds::decode(image, &mut file)? {
            Some(photograph) => Ok(photograph),
            None => decode_other(image, file, ImageFormat::Tiff),
        },
        PictureFormat::WebP => decode_other(image, file, ImageFormat::WebP),
    }
}

fn decode_jpeg(image: &SourceImage, bytes: &[u8]) -> Result<Photograph> {
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), jpeg_options());
    decoder.decode_headers().map_err(|error| damaged(image, format!("{error:?}")))?;
    let (width, height) = decoder.dimensions().ok_or_else(|| damaged(image, "no frame header"))?;
    check_unchanged(image, width, height)?;
    if !has_end_of_image(bytes) {
        return Err(Error::input(
            &image.name,
            "the picture is cut off: the JPEG ends before its end-of-image marker",
            "Copy it again from the camera or leave it out.",
        ));
    }
    if has_separate_subsampled_scans(bytes) {
        return decode_separate_scans(image, bytes, width, height);
    }
    let (space, channels) = match decoder.input_colorspace() {
        Some(ColorSpace::Luma) => (ColorSpace::Luma, 1),
        _ => (ColorSpace::RGB, 3),
    };
    decoder.set_options(jpeg_options().jpeg_set_out_colorspace(space));
    let pixels = decoder.decode().map_err(|error| damaged(image, format!("{error:?}")))?;
    Ok(Photograph::Eight(Raster::from_data(width, height, channels, pixels)?))
}

/// Decodes a sequential JPEG that stores each component in a scan of its own and some at a lower resolution.
///
/// # Departures
/// zune-jpeg 0.5.15 turns these into stripes without an error (its issue 422), so that another decoder reads them.
fn decode_separate_scans(image: &SourceImage, bytes: &[u8], width: usize, height: usize) -> Result<Photograph> {
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.set_max_decoding_buffer_size(width.saturating_mul(height).saturating_mul(MAX_PIXEL_BYTES as usize));
    let pixels = decoder.decode().map_err(|error| damaged(image, error))?;
    match decoder.info().map(|info| info.pixel_format) {
        Some(jpeg_decoder::PixelFormat::RGB24) => Ok(Photograph::Eight(Raster::from_data(width, height, 3, pixels)?)),
        _ => Err(Error::input(&image.name, "its kind of pixels is not read", "Export it as an RGB JPEG.")),
    }
}

/// Whether an end-of-image marker follows the first scan header. The thumbnail's own marker lies before that, in EXIF;
/// within a scan every 0xff of the data is followed by 0 or by a restart marker; and further pictures or maker data may
/// follow the end.
///
/// # Source
/// ITU-T T.81 B.1.1.2 to B.1.1.5.
fn has_end_of_image(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    const END_OF_IMAGE: u8 = 0xd9;
    let mut rest = bytes.get(2..).unwrap_or_default();
    while let [0xff, marker, after @ ..] = rest {
        match *marker {
            START_OF_SCAN => return after.windows(2).any(|pair| pair == [0xff, END_OF_IMAGE]),
            // Fill bytes may precede a marker; these markers stand alone.
            0xff => rest = &rest[1..],
            0x01 | 0xd0..=0xd8 => rest = after,
            _ => {
                let [high, low, ..] = after else { return false };
                rest = after.get(usize::from(u16::from_be_bytes([*high, *low]))..).unwrap_or_default();
            }
        }
    }
    // Bytes between segments that are no markers: the decoder judges them.
    bytes.windows(2).any(|pair| pair == [0xff, END_OF_IMAGE])
}

fn decode_other(image: &SourceImage, file: File, format: ImageFormat) -> Result<Photograph> {
    let mut reader = ImageReader::with_format(BufReader::new(file), format);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(decoding_limit(image));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|error| damaged(image, error))?;
    let (width, height) = decoder.dimensions();
    check_unchanged(image, width as usize, height as usize)?;
    let picture = DynamicImage::from_decoder(decoder).map_err(|error| damaged(image, error))?;
    to_photograph(image, picture)
}

/// Most bytes a decoder may take for this picture.
pub(super) fn decoding_limit(image: &SourceImage) -> u64 {
    let pixels = (image.width as u64).saturating_mul(image.height as u64);
    pixels.saturating_mul(MAX_PIXEL_BYTES).saturating_add(DECODER_SLACK_BYTES)
}

/// Sorts the kinds of pixels the `image` crate knows into ours.
fn to_photograph(image: &SourceImage, picture: DynamicImage) -> Result<Photograph> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let eight = |channels, data| Ok(Photograph::Eight(Raster::from_data(width, height, channels, data)?));
    let sixteen = |channels, data| Ok(Photograph::Sixteen(Raster::from_data(width, height, channels, data)?));
    match picture {
        DynamicImage::ImageLuma8(buffer) => eight(1, buffer.into_raw()),
        DynamicImage::ImageRgb8(buffer) => eight(3, buffer.into_raw()),
        DynamicImage::ImageRgba8(buffer) => eight(4, buffer.into_raw()),
        DynamicImage::ImageLumaA8(buffer) => eight(4, spread_gray_alpha(&buffer.into_raw())),
        DynamicImage::ImageLuma16(buffer) => sixteen(1, buffer.into_raw()),
        DynamicImage::ImageRgb16(buffer) => sixteen(3, buffer.into_raw()),
        DynamicImage::ImageRgba16(buffer) => sixteen(4, buffer.into_raw()),
        DynamicImage::ImageLumaA16(buffer) => sixteen(4, spread_gray_alpha(&buffer.into_raw())),
        _ => Err(Error::input(&image.name, "its kind of pixels is not read", "Export it with 8 or 16 bits a sample.")),
    }
}

pub(super) fn spread_gray_alpha<T: Copy>(samples: &[T]) -> Vec<T> {
    samples.as_chunks::<2>().0.iter().flat_map(|&[gray, alpha]| [gray, gray, gray, alpha]).collect()
}

/// The memory limit was judged by the size found when the file was examined, so it must still have that size.
pub(super) fn check_unchanged(image: &SourceImage, stored_width: usize, stored_height: usize) -> Result<()> {
    let expected = match image.orientation {
        5..=8 => (image.height, image.width),
        _ => (image.width, image.height),
    };
    if (stored_width, stored_height) == expected {
        return Ok(());
    }
    Err(Error::input(
        &image.name,
        format!(
            "it now has {stored_width} x {stored_height} stored pixels, but {} x {} when it was examined",
            expected.0, expected.1
        ),
        "Do not change photographs while they are stitched; start again.",
    ))
}

pub(super) fn damaged(image: &SourceImage, words: impl ToString) -> Error {
    let words = words.to_string();
    let reason = format!("its pixels cannot be decoded ({})", words.trim().trim_end_matches('.'));
    Error::input(
        &image.name,
        reason,
        "The file is damaged, cut off or of an unusual kind; export it again or leave it out.",
    )
}
