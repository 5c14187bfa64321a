//! All samples of a TIFF's first page.

use tiff::TiffResult;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::page::{FirstPage, PixelKind};
use super::texts::{TiffInput, WithoutAbsurdTexts};
use crate::formats::decoded::{MAX_PIXEL_BYTES, damaged, decoding_limit_of};

/// A decoder of a file as it can be read.
pub(super) type TiffDecoder<'a> = Decoder<WithoutAbsurdTexts<'a>>;

/// A decoder.
pub(super) fn decoder(input: &mut dyn TiffInput) -> TiffResult<TiffDecoder<'_>> {
    Decoder::new(WithoutAbsurdTexts::of(input)?)
}

/// A decoder that takes no more memory than the photograph needs, whose first page is `page`.
pub(super) fn open<'a>(source: &SourceImage, page: FirstPage, input: &'a mut dyn TiffInput) -> Result<TiffDecoder<'a>> {
    let bytes = usize::try_from(limit(source, page)).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = bytes;
    limits.intermediate_buffer_size = bytes;
    Ok(decoder(input).map_err(|error| damaged(source, error))?.with_limits(limits))
}

/// Most bytes that the decoder may take; four numbers of 64 bits take twice as much as other formats have.
fn limit(source: &SourceImage, page: FirstPage) -> u64 {
    decoding_limit_of(source, MAX_PIXEL_BYTES.max(page.decoded_pixel_bytes() as u64))
}

/// All samples of a photograph, channels interleaved; bits below 8 packed.
pub(super) enum Samples {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
    Float(Vec<f32>),
}

impl Samples {
    /// Reads them.
    ///
    /// # Errors
    /// If they are damaged, incomplete or of a kind that no page has.
    pub(super) fn read(source: &SourceImage, decoder: &mut TiffDecoder<'_>, page: FirstPage) -> Result<Self> {
        let mut buffer = DecodingResult::U8(Vec::new());
        let layout = decoder.read_image_to_buffer(&mut buffer).map_err(|error| damaged(source, error))?;
        let pixels = page.width * page.height;
        let planes = layout.planes;
        if planes > 1 && page.kind == PixelKind::Cmyk {
            return Err(damaged(source, "CMYK in planes is not read"));
        }
        Ok(match buffer {
            DecodingResult::U8(samples) => Self::Eight(interleaved(samples, pixels, planes)),
            DecodingResult::U16(samples) => Self::Sixteen(interleaved(samples, pixels, planes)),
            DecodingResult::F16(samples) => {
                Self::Float(interleaved(samples.into_iter().map(f32::from).collect(), pixels, planes))
            }
            DecodingResult::F32(samples) => Self::Float(interleaved(samples, pixels, planes)),
            DecodingResult::F64(samples) => {
                Self::Float(interleaved(samples.into_iter().map(|value| value as f32).collect(), pixels, planes))
            }
            _ => return Err(not_as_stated(source)),
        })
    }
}

/// Planes of one channel each, one after the other, as pixels.
fn interleaved<T: Copy>(samples: Vec<T>, pixels: usize, planes: usize) -> Vec<T> {
    if planes < 2 || samples.len() < planes * pixels {
        return samples;
    }
    (0..pixels).flat_map(|at| (0..planes).map(move |plane| plane * pixels + at)).map(|at| samples[at]).collect()
}

/// The samples are of another kind or number than the header says.
pub(super) fn not_as_stated(source: &SourceImage) -> Error {
    damaged(source, "its samples are not what its header says")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_of_64_bits_a_sample_are_within_the_limit() {
        let [width, height] = [6000, 4000];
        let source = SourceImage::unknown("photograph", "photograph", [width, height]);
        let limit = |bits, kind| limit(&source, FirstPage { width, height, bits, kind });
        let pixels = (width * height) as u64;
        assert!(limit(64, PixelKind::Float(3)) >= 24 * pixels);
        assert!(limit(64, PixelKind::Float(4)) >= 32 * pixels);
        assert!(limit(8, PixelKind::Plain(3)) < 20 * pixels);
    }
}
