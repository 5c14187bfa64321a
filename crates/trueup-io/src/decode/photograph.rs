//! Whole photographs.

use std::fs::File;
use std::io::{BufReader, Seek};

use trueup_core::memory::check_room;
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::orientation::upright;
use crate::format::{Input, PLAIN_PIXEL_BYTES, Reading};
use crate::formats;
use crate::metadata::header;

/// Decodes a photograph in full size, upright, without what lies beside it in its file.
///
/// Gray stays one channel; gray with alpha becomes RGBA; alpha that is full everywhere is left out; palettes, CMYK and
/// one-bit photographs become RGB or gray; 16 bits a sample stay 16; floating point is taken for linear light, 1 for
/// white, and becomes 16 bits of sRGB, what is brighter than white becoming white; with [`SourceImage::light`], 16 bits
/// of that, in which it stays.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, [`Error::Input`] if its pixels are damaged or incomplete (no missing part
/// is tolerated), of an unsupported kind, or no longer of the size that was found when it was examined;
/// [`Error::Limits`] if the memory is not to be had.
pub fn photograph(source: &SourceImage) -> Result<Photograph> {
    let picture = match stored(source)? {
        Photograph::Eight(raster) => Photograph::Eight(upright(raster, source.orientation)),
        Photograph::Sixteen(raster) => Photograph::Sixteen(upright(raster, source.orientation)),
    };
    // Full alpha says nothing, and kernels would have to weigh colors by it.
    Ok(source.inset.cut(picture)?.without_full_alpha())
}

/// Bits of a sample in a photograph's file: 8 or 16, for floating point 16, 32 or 64.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, [`Error::Input`] if its header no longer can.
pub fn sample_bits(source: &SourceImage) -> Result<u16> {
    let file = File::open(&source.path).map_err(|error| Error::io("reading", &source.path, error))?;
    header::sample_bits(file).ok_or_else(|| {
        Error::input(
            &source.name,
            "its header can no longer be read",
            "Do not change photographs while they are stitched; start again.",
        )
    })
}

/// Most bytes that decoding one of these takes beyond twice four channels of 8 bits, which every decoder takes:
/// decoders of some formats hold several planes of 32 bits. A file that cannot be read counts for nothing.
pub fn decoding_surplus(sources: &[SourceImage]) -> usize {
    let surplus = |source: &SourceImage| {
        let pixel_bytes = header::open(&source.path).map_or(0, |(mut input, format)| format.pixel_bytes(&mut input));
        let [width, height] = source.picture_size();
        let pixels = width.saturating_mul(height);
        pixels.saturating_mul(pixel_bytes.saturating_sub(PLAIN_PIXEL_BYTES))
    };
    sources.iter().map(surplus).max().unwrap_or(0)
}

/// Decodes the pixels as they are stored, before orientation.
fn stored(source: &SourceImage) -> Result<Photograph> {
    let (format, input) = opened(source)?;
    format.pixels(source, input)
}

/// The same, made smaller by the decoder where it can do that, but of at least so many columns and rows once it is
/// upright.
pub(super) fn stored_of_at_least(source: &SourceImage, [width, height]: [usize; 2]) -> Result<Photograph> {
    let (format, input) = opened(source)?;
    let least = if source.orientation >= 5 { [height, width] } else { [width, height] };
    format.reduced(source, input, least)
}

/// A photograph's file with how it is read; there is room for its pixels.
fn opened(source: &SourceImage) -> Result<(&'static Reading, Input)> {
    let reading = |error| Error::io("reading", &source.path, error);
    let mut input = BufReader::new(File::open(&source.path).map_err(reading)?);
    let format = formats::recognize(&mut input).map_err(reading)?.ok_or_else(|| {
        let reason = format!("it is not a {} picture", formats::readable_formats());
        Error::input(&source.name, reason, "Give the photograph again.")
    })?;
    let [width, height] = source.picture_size();
    let room = width.saturating_mul(height).saturating_mul(format.pixel_bytes(&mut input));
    check_room(format_args!("decoding {}", source.name), room)?;
    input.rewind().map_err(reading)?;
    Ok((format, input))
}
