//! Kinds of TIFF that the general decoder does not read: floating point, palettes, YCbCr, gray of few bits, gray with alpha.
//!
//! # Source
//! TIFF 6.0, sections 5 (palettes), 19 (sample formats), 20 and 21 (reference values, YCbCr).

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};

use rayon::prelude::*;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, SampleFormat, Tag};
use tiff::{ColorType, TiffError, TiffResult};
use trueup_core::color::TransferCurve;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::codecs::{check_unchanged, damaged, decoding_limit};

/// Tag of the coefficients of luma.
const YCBCR_COEFFICIENTS: Tag = Tag::Unknown(529);

/// What a TIFF's first page holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TiffFacts {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Bits of a sample; of a palette's colors.
    pub(crate) bits: u16,
    pub(crate) kind: Kind,
}

/// How pixels are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// By the general decoder.
    General,
    /// Floating point samples, so many a pixel.
    Float(usize),
    /// Indices of so many bits into a palette.
    Palette(u8),
    /// Gray of 2 or 4 bits.
    SmallGray(u8),
    /// Gray and alpha.
    GrayAlpha,
    /// Brightness and two color differences.
    YCbCr,
}

/// Looks at a TIFF's first page without reading pixels.
pub(crate) fn inspect<R: BufRead + Seek>(reader: R) -> TiffResult<TiffFacts> {
    facts(&mut Decoder::new(reader)?)
}

fn facts<R: Read + Seek>(decoder: &mut Decoder<R>) -> TiffResult<TiffFacts> {
    let (width, height) = decoder.dimensions()?;
    let facts = |bits, kind| TiffFacts { width: width as usize, height: height as usize, bits, kind };
    let photometric = decoder.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation)?;
    if photometric == Some(PhotometricInterpretation::RGBPalette.to_u16()) {
        let bits = decoder.find_tag_unsigned_vec::<u8>(Tag::BitsPerSample)?.unwrap_or_default();
        return match bits[..] {
            [bits @ (1 | 2 | 4 | 8)] => Ok(facts(8, Kind::Palette(bits))),
            _ => Err(unsupported(ColorType::Palette(bits.first().copied().unwrap_or_default()))),
        };
    }
    let color = decoder.colortype()?;
    let bits = u16::from(color.bit_depth());
    let formats = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat)?.unwrap_or_default();
    let is_float = formats.first() == Some(&SampleFormat::IEEEFP.to_u16());
    if is_float {
        return match color {
            ColorType::Gray(_) => Ok(facts(bits, Kind::Float(1))),
            ColorType::RGB(_) => Ok(facts(bits, Kind::Float(3))),
            ColorType::RGBA(_) => Ok(facts(bits, Kind::Float(4))),
            ColorType::Multiband { num_samples: 2, .. } => Ok(facts(bits, Kind::Float(2))),
            other => Err(unsupported(other)),
        };
    }
    Ok(match color {
        ColorType::Gray(bits @ (2 | 4)) => facts(8, Kind::SmallGray(bits)),
        ColorType::Multiband { bit_depth: 8 | 16, num_samples: 2 } => facts(bits, Kind::GrayAlpha),
        ColorType::YCbCr(8) => {
            check_color_resolution(decoder)?;
            facts(8, Kind::YCbCr)
        }
        _ => facts(bits, Kind::General),
    })
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

/// Decodes a TIFF of a kind that is read here; `None` if that is [`Kind::General`].
pub(super) fn decode(image: &SourceImage, file: &mut File) -> Result<Option<Photograph>> {
    let reading = |error| Error::io("reading", &image.path, error);
    let found = inspect(BufReader::new(&mut *file)).map_err(|error| damaged(image, error))?;
    file.rewind().map_err(reading)?;
    if found.kind == Kind::General {
        return Ok(None);
    }
    check_unchanged(image, found.width, found.height)?;
    if let Kind::Palette(bits) = found.kind {
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(reading)?;
        return palette(image, bytes, found, bits).map(Some);
    }
    let mut decoder = open(image, BufReader::new(file))?;
    let samples = Samples::read(image, &mut decoder, found)?;
    let (width, height) = (found.width, found.height);
    let eight = |channels, data| Ok(Photograph::Eight(Raster::from_data(width, height, channels, data)?));
    let sixteen = |channels, data| Ok(Photograph::Sixteen(Raster::from_data(width, height, channels, data)?));
    let photograph = match (found.kind, samples) {
        (Kind::Float(channels), Samples::Float(samples)) => {
            let (channels, data) = encoded(&samples, channels);
            sixteen(channels, data)
        }
        (Kind::SmallGray(bits), Samples::Eight(packed)) => {
            let step = u8::MAX / ((1 << bits) - 1);
            eight(1, unpacked(&packed, width, bits).map(|level| level * step).collect())
        }
        (Kind::GrayAlpha, Samples::Eight(samples)) => eight(4, super::codecs::spread_gray_alpha(&samples)),
        (Kind::GrayAlpha, Samples::Sixteen(samples)) => sixteen(4, super::codecs::spread_gray_alpha(&samples)),
        (Kind::YCbCr, Samples::Eight(samples)) => {
            let coefficients = decoder.get_tag_f32_vec(YCBCR_COEFFICIENTS).ok();
            eight(3, rgb_of_ycbcr(&samples, coefficients.as_deref()))
        }
        _ => Err(damaged(image, "its samples are not what its header says")),
    };
    photograph.map(Some)
}

/// A decoder that takes no more memory than the picture needs.
fn open<R: Read + Seek>(image: &SourceImage, reader: R) -> Result<Decoder<R>> {
    let bytes = usize::try_from(decoding_limit(image)).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = bytes;
    limits.intermediate_buffer_size = bytes;
    Ok(Decoder::new(reader).map_err(|error| damaged(image, error))?.with_limits(limits))
}

/// All samples of a picture, channels interleaved; bits below 8 packed.
enum Samples {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
    Float(Vec<f32>),
}

impl Samples {
    fn read<R: Read + Seek>(image: &SourceImage, decoder: &mut Decoder<R>, found: TiffFacts) -> Result<Self> {
        let mut buffer = DecodingResult::U8(Vec::new());
        let layout = decoder.read_image_to_buffer(&mut buffer).map_err(|error| damaged(image, error))?;
        let pixels = found.width * found.height;
        let planes = layout.planes;
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
            _ => return Err(damaged(image, "its samples are not what its header says")),
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

/// Linear light as 16-bit samples of sRGB, 1 for white; what is brighter is white, NaN is black. Gray with alpha becomes
/// RGBA. Returns the number of channels, too.
fn encoded(samples: &[f32], channels: usize) -> (usize, Vec<u16>) {
    let full = f64::from(u16::MAX);
    let level = |&light: &f32| (TransferCurve::SRGB.encoded(f64::from(light)) * full).round() as u16;
    let alpha = |share: f32| (f64::from(share).clamp(0.0, 1.0) * full).round() as u16;
    match channels {
        2 => {
            let pixels = samples.as_chunks::<2>().0.par_iter();
            let rgba = |&[gray, share]: &[f32; 2]| {
                let gray = level(&gray);
                [gray, gray, gray, alpha(share)]
            };
            (4, pixels.flat_map_iter(rgba).collect())
        }
        4 => {
            let pixels = samples.as_chunks::<4>().0.par_iter();
            (4, pixels.flat_map_iter(|[r, g, b, share]| [level(r), level(g), level(b), alpha(*share)]).collect())
        }
        _ => (channels, samples.par_iter().map(level).collect()),
    }
}

/// Samples of `bits` bits, the first in the highest bits; every row begins with a byte of its own.
fn unpacked(packed: &[u8], width: usize, bits: u8) -> impl Iterator<Item = u8> + '_ {
    let per_byte = usize::from(8 / bits);
    let mask = u8::MAX >> (8 - bits);
    packed.chunks_exact(width.div_ceil(per_byte)).flat_map(move |row| {
        (0..width).map(move |x| row[x / per_byte] >> (8 - bits as usize * (x % per_byte + 1)) & mask)
    })
}

/// Full-range YCbCr of 8 bits as RGB; the coefficients of luma are those of the file or Rec. 601's.
fn rgb_of_ycbcr(samples: &[u8], coefficients: Option<&[f32]>) -> Vec<u8> {
    let [red, green, blue] = match coefficients {
        Some(&[red, green, blue]) if green > 0.0 => [red, green, blue],
        _ => trueup_core::raster::LUMA,
    };
    let rgb = |&[y, cb, cr]: &[u8; 3]| {
        let (y, cb, cr) = (f32::from(y), f32::from(cb) - 128.0, f32::from(cr) - 128.0);
        let r = y + cr * (2.0 - 2.0 * red);
        let b = y + cb * (2.0 - 2.0 * blue);
        let g = (y - blue * b - red * r) / green;
        // The addition rounds; the conversion truncates and saturates.
        [r, g, b].map(|value| (value + 0.5) as u8)
    };
    samples.as_chunks::<3>().0.iter().flat_map(rgb).collect()
}

/// Indices into a palette. The decoder reads no palettes; told that the indices are gray, it reads those.
fn palette(image: &SourceImage, mut bytes: Vec<u8>, found: TiffFacts, bits: u8) -> Result<Photograph> {
    let failed = |error: TiffError| damaged(image, error);
    let colors = Decoder::new(Cursor::new(&bytes)).and_then(|mut decoder| decoder.get_tag_u16_vec(Tag::ColorMap));
    let colors = colors.map_err(failed)?;
    let count = 1_usize << bits;
    if colors.len() != 3 * count || call_gray(&mut bytes).is_none() {
        return Err(damaged(image, "its palette is not as long as it must be"));
    }
    let mut decoder = open(image, Cursor::new(&bytes))?;
    let Samples::Eight(packed) = Samples::read(image, &mut decoder, found)? else {
        return Err(damaged(image, "its samples are not what its header says"));
    };
    // Colors have 16 bits; some programs write 8.
    let small = colors.iter().all(|&color| color <= u16::from(u8::MAX));
    let eight = |color: u16| if small { color as u8 } else { ((u32::from(color) + 128) / 257) as u8 };
    let rgb = |index: u8| [0, count, 2 * count].map(|first| eight(colors[first + usize::from(index)]));
    let data = match bits {
        8 => packed.iter().flat_map(|&index| rgb(index)).collect(),
        _ => unpacked(&packed, found.width, bits).flat_map(rgb).collect(),
    };
    Ok(Photograph::Eight(Raster::from_data(found.width, found.height, 3, data)?))
}

/// Sets the photometric interpretation of the first directory of a TIFF to gray; `None` if it has none.
fn call_gray(bytes: &mut [u8]) -> Option<()> {
    let little = bytes.first() == Some(&b'I');
    let number = |bytes: &[u8], at: usize, length: usize| -> Option<usize> {
        let bytes = bytes.get(at..at.checked_add(length)?)?;
        let fold = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        let value = if little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) };
        usize::try_from(value).ok()
    };
    let is_big = number(bytes, 2, 2)? == 43;
    let (start, count_bytes, entry_bytes) =
        if is_big { (number(bytes, 8, 8)?, 8, 20) } else { (number(bytes, 4, 4)?, 2, 12) };
    let count = number(bytes, start, count_bytes)?;
    let wanted = usize::from(Tag::PhotometricInterpretation.to_u16());
    for index in 0..count {
        let entry = start.checked_add(count_bytes)?.checked_add(index.checked_mul(entry_bytes)?)?;
        if number(bytes, entry, 2)? == wanted {
            // The value is the entry's last part, a short in its first bytes.
            let value = entry + if is_big { 12 } else { 8 };
            let gray = PhotometricInterpretation::BlackIsZero.to_u16();
            let gray = if little { gray.to_le_bytes() } else { gray.to_be_bytes() };
            bytes.get_mut(value..value + 2)?.copy_from_slice(&gray);
            return Some(());
        }
    }
    None
}

#[cfg(test)]
#[path = "tiff_kinds_tests.rs"]
mod tests;
