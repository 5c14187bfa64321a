//! What readers of pixels share: limits, refusals, and the way from samples to a photograph.

use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

/// Memory a decoder may take beside its pixels, in bytes.
pub(crate) const DECODER_SLACK_BYTES: u64 = 64 << 20;

/// Most bytes a pixel takes in memory while it is decoded, of most formats: four 32-bit samples.
pub(crate) const MAX_PIXEL_BYTES: u64 = 16;

/// Memory that reading a header may take, in bytes: profiles may be compressed.
pub(crate) const HEADER_BYTES: usize = 64 << 20;

/// Most bytes a decoder may take for this photograph.
pub(crate) fn decoding_limit(source: &SourceImage) -> u64 {
    decoding_limit_of(source, MAX_PIXEL_BYTES)
}

/// The same where a pixel takes so many.
pub(crate) fn decoding_limit_of(source: &SourceImage, pixel_bytes: u64) -> u64 {
    let [width, height] = source.picture_size().map(|length| length as u64);
    let pixels = width.saturating_mul(height);
    pixels.saturating_mul(pixel_bytes).saturating_add(DECODER_SLACK_BYTES)
}

/// How many samples a photograph of this size has.
///
/// # Errors
/// [`Error::Input`] if they are more than a program can address.
pub(crate) fn sample_count(source: &SourceImage, width: usize, height: usize, channels: usize) -> Result<usize> {
    let samples = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(channels));
    samples.ok_or_else(|| damaged(source, "it is larger than memory can be"))
}

/// A photograph of 8-bit samples: gray, gray with alpha (which becomes RGBA), RGB or RGBA.
pub(crate) fn eight(width: usize, height: usize, channels: usize, samples: Vec<u8>) -> Result<Photograph> {
    match channels {
        2 => Ok(Photograph::Eight(Raster::from_data(width, height, 4, spread_gray_alpha(&samples))?)),
        _ => Ok(Photograph::Eight(Raster::from_data(width, height, channels, samples)?)),
    }
}

/// The same of 16-bit samples.
pub(crate) fn sixteen(width: usize, height: usize, channels: usize, samples: Vec<u16>) -> Result<Photograph> {
    match channels {
        2 => Ok(Photograph::Sixteen(Raster::from_data(width, height, 4, spread_gray_alpha(&samples))?)),
        _ => Ok(Photograph::Sixteen(Raster::from_data(width, height, channels, samples)?)),
    }
}

fn spread_gray_alpha<T: Copy>(samples: &[T]) -> Vec<T> {
    samples.as_chunks::<2>().0.iter().flat_map(|&[gray, alpha]| [gray, gray, gray, alpha]).collect()
}

/// The memory limit was judged by the size found when the file was examined, so it must still have that size.
pub(crate) fn check_unchanged(source: &SourceImage, stored_width: usize, stored_height: usize) -> Result<()> {
    let [width, height] = source.picture_size();
    let expected = match source.orientation {
        5..=8 => (height, width),
        _ => (width, height),
    };
    if (stored_width, stored_height) == expected {
        return Ok(());
    }
    Err(Error::input(
        &source.name,
        format!(
            "it now has {stored_width} x {stored_height} stored pixels, but {} x {} when it was examined",
            expected.0, expected.1
        ),
        "Do not change photographs while they are stitched; start again.",
    ))
}

/// Pixels that the codec, in its own words, cannot make sense of.
pub(crate) fn damaged(source: &SourceImage, words: impl ToString) -> Error {
    let words = words.to_string();
    let reason = format!("its pixels cannot be decoded ({})", words.trim().trim_end_matches('.'));
    Error::input(
        &source.name,
        reason,
        "The file is damaged, cut off or of an unusual kind; export it again or leave it out.",
    )
}
