//! What a file says of its colors, without decoding its pixels.

use std::fs::File;
use std::io::{BufReader, Seek};
use std::path::Path;

use image::{ImageDecoder, ImageFormat, ImageReader};
use tiff::decoder::Decoder as TiffDecoder;
use tiff::tags::Tag as TiffTag;
use zune_jpeg::JpegDecoder;

use crate::decode::jpeg_options;
use crate::format::{PictureFormat, read_start};
use crate::metadata::{ExifFields, read_exif};

/// Memory that reading a header may take, in bytes: profiles may be compressed.
const HEADER_BYTES: u64 = 64 << 20;

/// EXIF's ColorSpace for Adobe RGB, as some cameras write it though no standard has it.
const EXIF_ADOBE_RGB: u32 = 2;
/// The interoperability index of files in Adobe RGB.
///
/// # Source
/// DCF 2.0 (JEITA CP-3461B), option file.
const INTEROPERABILITY_ADOBE_RGB: &str = "R03";

/// What a file says of its colors.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Embedded {
    /// The ICC profile's bytes.
    pub(crate) icc: Option<Vec<u8>>,
    /// EXIF names Adobe RGB; only asked where there is no profile.
    pub(crate) is_adobe_rgb: bool,
}

/// Reads it. A file that cannot be read says nothing: decoding it will tell why.
pub(crate) fn read(path: &Path) -> Embedded {
    try_read(path).unwrap_or_default()
}

fn try_read(path: &Path) -> Option<Embedded> {
    let mut file = File::open(path).ok()?;
    let format = PictureFormat::of_content(&read_start(&mut file).ok()?)?;
    let mut reader = BufReader::new(file);
    reader.rewind().ok()?;
    let icc = read_icc(&mut reader, format).filter(|icc| !icc.is_empty());
    if icc.is_some() {
        return Some(Embedded { icc, is_adobe_rgb: false });
    }
    reader.rewind().ok()?;
    let exif = read_exif(&mut reader, format).unwrap_or_default();
    Some(Embedded { icc: None, is_adobe_rgb: names_adobe_rgb(&exif) })
}

fn read_icc(reader: &mut BufReader<File>, format: PictureFormat) -> Option<Vec<u8>> {
    let format = match format {
        PictureFormat::Jpeg => {
            let mut decoder = JpegDecoder::new_with_options(reader, jpeg_options());
            decoder.decode_headers().ok()?;
            return decoder.icc_profile();
        }
        PictureFormat::Png => ImageFormat::Png,
        PictureFormat::Tiff => {
            // The picture decoder would measure the profile by the memory that the pixels take.
            let profile = TiffDecoder::new(reader).ok()?.find_tag(TiffTag::IccProfile).ok().flatten()?;
            return profile.into_u8_vec().ok();
        }
        PictureFormat::WebP => ImageFormat::WebP,
    };
    let mut picture = ImageReader::with_format(reader, format);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(HEADER_BYTES);
    picture.limits(limits);
    picture.into_decoder().ok()?.icc_profile().ok().flatten()
}

fn names_adobe_rgb(exif: &ExifFields) -> bool {
    exif.color_space == Some(EXIF_ADOBE_RGB) || exif.interoperability.as_deref() == Some(INTEROPERABILITY_ADOBE_RGB)
}
