//! What the first page of a TIFF holds, told without reading pixels.
//!
//! # Source
//! TIFF 6.0, sections 5 (palettes), 16 (CMYK), 19 (sample formats), 20 and 21 (reference values, YCbCr).

use std::io::{Read, Seek};

use tiff::decoder::Decoder;
use tiff::tags::{CompressionMethod, PhotometricInterpretation, SampleFormat, Tag};
use tiff::{ColorType, TiffError, TiffResult};

use crate::format::PLAIN_PIXEL_BYTES;

/// What a TIFF's first page holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FirstPage {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Bits of a sample; of a palette's colors; 8 where it has fewer.
    pub(super) bits: u16,
    pub(super) kind: PixelKind,
}

/// How pixels are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PixelKind {
    /// Gray, gray with alpha, RGB or RGBA of 8 or 16 bits, so many samples a pixel.
    Plain(usize),
    /// Black and white, a bit a pixel.
    Bitmap,
    /// Cyan, magenta, yellow and black.
    Cmyk,
    /// Whole numbers of 32 bits: known, and not read.
    Wide,
    /// Floating point samples, so many a pixel.
    Float(usize),
    /// Indices of so many bits into a palette.
    Palette(u8),
    /// Gray of 2 or 4 bits.
    SmallGray(u8),
    /// Brightness and two color differences.
    YCbCr,
}

impl FirstPage {
    /// Bytes of a pixel as the decoder hands it out.
    pub(super) fn decoded_pixel_bytes(&self) -> usize {
        let samples = match self.kind {
            PixelKind::Plain(samples) | PixelKind::Float(samples) => samples,
            PixelKind::Cmyk | PixelKind::Wide => 4,
            PixelKind::YCbCr => 3,
            PixelKind::Bitmap | PixelKind::Palette(_) | PixelKind::SmallGray(_) => 1,
        };
        samples * usize::from(self.bits / 8)
    }

    /// Bytes of a pixel on its way into memory.
    pub(super) fn pixel_bytes(&self) -> usize {
        let beside = match self.kind {
            // Numbers of 32 bits are made of the others, and samples of 16 bits of these; planes are put together in as
            // much room.
            PixelKind::Float(samples) => samples * size_of::<f32>(),
            PixelKind::Cmyk => 3 * usize::from(self.bits / 8),
            _ => 0,
        };
        PLAIN_PIXEL_BYTES.max(self.decoded_pixel_bytes() + beside)
    }

    /// Looks at the first page of a file.
    pub(super) fn of<R: Read + Seek>(decoder: &mut Decoder<R>) -> TiffResult<Self> {
        let (width, height) = decoder.dimensions()?;
        let page = |bits, kind| Self { width: width as usize, height: height as usize, bits, kind };
        let photometric = decoder.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation)?;
        if photometric == Some(PhotometricInterpretation::RGBPalette.to_u16()) {
            let bits = decoder.find_tag_unsigned_vec::<u8>(Tag::BitsPerSample)?.unwrap_or_default();
            return match bits[..] {
                [bits @ (1 | 2 | 4 | 8)] => Ok(page(8, PixelKind::Palette(bits))),
                _ => Err(unsupported(ColorType::Palette(bits.first().copied().unwrap_or_default()))),
            };
        }
        let color = decoder.colortype()?;
        let bits = u16::from(color.bit_depth());
        let formats = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat)?.unwrap_or_default();
        if formats.first() == Some(&SampleFormat::IEEEFP.to_u16()) {
            return match color {
                ColorType::Gray(_) => Ok(page(bits, PixelKind::Float(1))),
                ColorType::RGB(_) => Ok(page(bits, PixelKind::Float(3))),
                ColorType::RGBA(_) => Ok(page(bits, PixelKind::Float(4))),
                ColorType::Multiband { num_samples: 2, .. } => Ok(page(bits, PixelKind::Float(2))),
                other => Err(unsupported(other)),
            };
        }
        match color {
            ColorType::Gray(bits @ (2 | 4)) => return Ok(page(8, PixelKind::SmallGray(bits))),
            ColorType::Multiband { bit_depth: 8 | 16, num_samples: 2 } => return Ok(page(bits, PixelKind::Plain(2))),
            ColorType::YCbCr(8) => {
                check_color_resolution(decoder)?;
                return Ok(page(8, PixelKind::YCbCr));
            }
            _ => {}
        }
        // Samples without a format are whole numbers; those with one must say so.
        let are_whole = formats.iter().all(|format| *format == SampleFormat::Uint.to_u16());
        if !are_whole || (bits > 16 && !formats.is_empty()) {
            return Err(unsupported(color));
        }
        Ok(match color {
            ColorType::Gray(1) => page(8, PixelKind::Bitmap),
            ColorType::Gray(8 | 16) => page(bits, PixelKind::Plain(1)),
            ColorType::GrayA(8 | 16) => page(bits, PixelKind::Plain(2)),
            ColorType::RGB(8 | 16) => page(bits, PixelKind::Plain(3)),
            ColorType::RGBA(8 | 16) => page(bits, PixelKind::Plain(4)),
            ColorType::CMYK(8 | 16) => page(bits, PixelKind::Cmyk),
            ColorType::RGB(32) | ColorType::RGBA(32) => page(bits, PixelKind::Wide),
            other => return Err(unsupported(other)),
        })
    }
}

/// Refuses color differences stored at a lower resolution, unless within JPEG.
fn check_color_resolution<R: Read + Seek>(decoder: &mut Decoder<R>) -> TiffResult<()> {
    let compression = decoder.find_tag_unsigned::<u16>(Tag::Compression)?;
    let sampling = decoder.find_tag_unsigned_vec::<u16>(Tag::ChromaSubsampling)?;
    if compression == Some(CompressionMethod::ModernJPEG.to_u16()) || sampling == Some(vec![1, 1]) {
        return Ok(());
    }
    Err(TiffError::UnsupportedError(tiff::TiffUnsupportedError::ChromaSubsampling))
}

fn unsupported(color: ColorType) -> TiffError {
    TiffError::UnsupportedError(tiff::TiffUnsupportedError::UnsupportedColorType(color))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floating_point_takes_its_room_and_that_of_what_is_made_of_it() {
        let bytes = |bits, kind| FirstPage { width: 3, height: 2, bits, kind }.pixel_bytes();
        assert_eq!(bytes(32, PixelKind::Float(3)), 3 * (4 + 4));
        assert_eq!(bytes(64, PixelKind::Float(4)), 4 * (8 + 4));
        assert_eq!(bytes(16, PixelKind::Float(1)), PLAIN_PIXEL_BYTES);
        assert_eq!(bytes(16, PixelKind::Cmyk), 4 * 2 + 3 * 2);
        for plain in [PixelKind::Plain(4), PixelKind::Plain(1), PixelKind::YCbCr, PixelKind::Palette(8)] {
            assert_eq!(bytes(8, plain), PLAIN_PIXEL_BYTES, "{plain:?}");
        }
        assert_eq!(bytes(16, PixelKind::Plain(4)), PLAIN_PIXEL_BYTES);
    }
}
