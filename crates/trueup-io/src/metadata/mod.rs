//! What a file's header and EXIF say about a photograph, without decoding its pixels.

mod all_fields;
mod exif_fields;
mod focal;
mod orientation;

use std::fs::File;
use std::io::{BufRead, BufReader, Seek};

use image::{ImageDecoder, ImageError, ImageFormat, ImageReader};
use tiff::TiffError;
use tiff::decoder::Decoder as TiffDecoder;
use trueup_core::source::FocalPrior;
use zune_jpeg::JpegDecoder;

use crate::decode::{TiffKind, inspect_tiff, jpeg_options};
use crate::format::{PictureFormat, read_start};

pub(crate) use all_fields::read_fields;
pub(crate) use exif_fields::ExifFields;
pub(crate) use focal::focal_prior;
pub(crate) use orientation::{TagVerdict, judge_orientation};

/// Size and EXIF facts of a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    /// Width of the stored pixels, before orientation.
    pub(crate) stored_width: usize,
    /// Height of the stored pixels, before orientation.
    pub(crate) stored_height: usize,
    /// Whether samples are floating point numbers.
    pub(crate) is_float: bool,
    /// EXIF fields; all empty where the file has none or they cannot be read.
    pub(crate) exif: ExifFields,
}

impl Header {
    /// The focal length that EXIF tells, in pixels of this picture.
    pub(crate) fn focal_prior(&self) -> Option<FocalPrior> {
        focal_prior(&self.exif, self.stored_width as f64, self.stored_height as f64)
    }
}

/// Why a header gives no picture; the codec's words.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum HeaderError {
    /// The header contradicts its format.
    Damaged(String),
    /// The picture is well formed, but of a kind that is not read.
    Unsupported(String),
}

/// Reads size and EXIF of `file`, which holds a picture in `format`. Damaged EXIF counts as absent.
///
/// # Errors
/// When the header cannot be read or tells of a kind of picture that is not.
pub(crate) fn read_header(file: &File, format: PictureFormat) -> Result<Header, HeaderError> {
    let mut reader = BufReader::new(file);
    reader.rewind().map_err(|error| HeaderError::Damaged(error.to_string()))?;
    let Stored { width: stored_width, height: stored_height, is_float, .. } = stored(&mut reader, format)?;
    let exif = reader.rewind().ok().and_then(|_| read_exif(&mut reader, format)).unwrap_or_default();
    Ok(Header { stored_width, stored_height, is_float, exif })
}

/// Bits of a sample of a picture file; `None` where the header cannot be read.
pub(crate) fn sample_bits(file: &File) -> Option<u16> {
    let mut reader = BufReader::new(file);
    let format = PictureFormat::of_content(&read_start(&mut reader).ok()?)?;
    reader.rewind().ok()?;
    stored(&mut reader, format).ok().map(|stored| stored.bits)
}

/// What the header states of the pixels.
struct Stored {
    width: usize,
    height: usize,
    bits: u16,
    is_float: bool,
}

fn stored<R: BufRead + Seek>(reader: &mut R, format: PictureFormat) -> Result<Stored, HeaderError> {
    let format = match format {
        PictureFormat::Jpeg => {
            let mut decoder = JpegDecoder::new_with_options(reader, jpeg_options());
            decoder.decode_headers().map_err(|error| HeaderError::Damaged(format!("{error:?}")))?;
            let (width, height) =
                decoder.dimensions().ok_or_else(|| HeaderError::Damaged("no frame header".to_owned()))?;
            return Ok(Stored { width, height, bits: 8, is_float: false });
        }
        PictureFormat::Png => ImageFormat::Png,
        PictureFormat::Tiff => {
            let facts = inspect_tiff(&mut *reader).map_err(|error| match error {
                TiffError::UnsupportedError(unsupported) => HeaderError::Unsupported(unsupported.to_string()),
                other => HeaderError::Damaged(other.to_string()),
            })?;
            let is_float = matches!(facts.kind, TiffKind::Float(_));
            if facts.kind != TiffKind::General {
                return Ok(Stored { width: facts.width, height: facts.height, bits: facts.bits, is_float });
            }
            reader.rewind().map_err(|error| HeaderError::Damaged(error.to_string()))?;
            ImageFormat::Tiff
        }
        PictureFormat::WebP => ImageFormat::WebP,
    };
    let mut picture = ImageReader::with_format(reader, format);
    // Sizes are judged by the caller, whose limit is an option.
    picture.no_limits();
    let decoder = picture.into_decoder().map_err(|error| match error {
        ImageError::Unsupported(unsupported) => HeaderError::Unsupported(unsupported.to_string()),
        other => HeaderError::Damaged(other.to_string()),
    })?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let bits = color.bits_per_pixel() / u16::from(color.channel_count());
    Ok(Stored { width: width as usize, height: height as usize, bits, is_float: false })
}

/// The EXIF fields of a file. Damaged EXIF counts as absent.
pub(crate) fn read_exif<R: BufRead + Seek>(reader: &mut R, format: PictureFormat) -> Option<ExifFields> {
    if format == PictureFormat::Tiff {
        // The EXIF library would read the whole file, pixels and all.
        return ExifFields::from_tiff(&mut TiffDecoder::new(reader).ok()?);
    }
    read_exif_block(reader).map(|exif| ExifFields::from_exif(&exif))
}

/// The EXIF block of a JPEG, PNG or WebP, as much of it as can be read.
fn read_exif_block<R: BufRead + Seek>(reader: &mut R) -> Option<exif::Exif> {
    let mut exif_reader = exif::Reader::new();
    exif_reader.continue_on_error(true);
    let exif = exif_reader.read_from_container(reader);
    exif.or_else(|error| error.distill_partial_result(|_| {})).ok()
}
