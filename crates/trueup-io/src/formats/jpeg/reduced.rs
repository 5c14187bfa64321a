//! Photographs in JPEG made smaller as they are decoded: by eight, four or two along each side.

use std::io::Read;

use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::read;
use crate::format::Input;
use crate::formats::decoded::{check_unchanged, damaged, decoding_limit};

/// Decodes the pixels as they are stored, of at least `least` columns and rows.
///
/// # Source
/// Of each block of 8 x 8 samples, only the 1, 4 or 16 lowest frequencies are transformed back: the discrete cosine
/// transform of that size, which is nearly the mean of the samples under a pixel.
///
/// # Departures
/// zune-jpeg, which reads whole photographs, has no such transforms. What jpeg-decoder does not make colors of (CMYK,
/// 12 bits), zune-jpeg decodes whole.
pub(super) fn pixels(source: &SourceImage, mut input: Input, least: [usize; 2]) -> Result<Photograph> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(|error| Error::io("reading", &source.path, error))?;
    match reduced(source, &bytes, least)? {
        Some(photograph) => Ok(photograph),
        None => read::decode(source, &bytes),
    }
}

fn reduced(source: &SourceImage, bytes: &[u8], least: [usize; 2]) -> Result<Option<Photograph>> {
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.set_max_decoding_buffer_size(usize::try_from(decoding_limit(source)).unwrap_or(usize::MAX));
    let broken = |error: jpeg_decoder::Error| damaged(source, error);
    decoder.read_info().map_err(broken)?;
    let stored = decoder.info().ok_or_else(|| damaged(source, "no frame header"))?;
    let channels = match stored.pixel_format {
        jpeg_decoder::PixelFormat::RGB24 => 3,
        jpeg_decoder::PixelFormat::L8 => 1,
        _ => return Ok(None),
    };
    check_unchanged(source, stored.width.into(), stored.height.into())?;
    // Beyond what a JPEG can have, all of it is wanted.
    let [columns, rows] = least.map(|side| u16::try_from(side).unwrap_or(u16::MAX));
    let (width, height) = decoder.scale(columns, rows).map_err(broken)?;
    let samples = decoder.decode().map_err(broken)?;
    Ok(Some(Photograph::Eight(Raster::from_data(width.into(), height.into(), channels, samples)?)))
}
