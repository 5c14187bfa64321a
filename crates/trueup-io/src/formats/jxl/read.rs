//! Photographs in JPEG XL.
//!
//! The decoder sees the codestream alone, which is cut out of its boxes here: compressed boxes could be of any size.

use std::io::{Read, Seek};

use exif::{Field, Tag};
use jxl_oxide::color::{ColourEncoding, ColourSpace, TransferFunction};
use jxl_oxide::image::BitDepth;
use jxl_oxide::{
    AllocTracker, EnumColourEncoding, FrameBufferSample, ImageStream, InitializeResult, JxlImage, RenderingIntent,
};
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::container::{self, Codestream};
use crate::format::{HeaderError, Input, StoredPixels};
use crate::formats::alpha::straight;
use crate::formats::decoded::{DECODER_SLACK_BYTES, check_unchanged, damaged, eight, sample_count, sixteen};
use crate::formats::linear_light::encoded;
use crate::metadata::block;
use crate::metadata::exif_fields::ExifFields;

/// Bytes a pixel takes in memory while it is decoded: four channels of 32 bits, the same again while they are filtered,
/// and half as much of coefficients and of what is handed out.
pub(super) const PIXEL_BYTES: usize = 48;

/// Bytes that are read at a time.
const PIECE_BYTES: usize = 64 << 10;

/// Most bytes of a codestream in which its header must be, with its color profile.
const MOST_HEADER_BYTES: usize = 4 << 20;

/// What a decoder that found no more to read has to say.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A picture of which the header was read, and what behind it was read with it.
struct Opened<'a> {
    image: JxlImage,
    pieces: Pieces<'a>,
}

/// Reads a header.
fn open(input: &mut Input, limit: usize) -> std::result::Result<Opened<'_>, Failure> {
    let mut pieces = Pieces { codestream: Codestream::of(input)?, left: Vec::new(), read: 0 };
    let mut waiting = JxlImage::builder().alloc_tracker(AllocTracker::with_limit(limit)).build_uninit();
    while pieces.read < MOST_HEADER_BYTES {
        if !pieces.next(|piece| waiting.feed_bytes(piece))? {
            return Err("it ends within its header".into());
        }
        waiting = match waiting.try_init()? {
            InitializeResult::NeedMoreData(waiting) => waiting,
            InitializeResult::Initialized(mut image) => {
                in_readable_form(&mut image)?;
                return Ok(Opened { image, pieces });
            }
        };
    }
    Err("its header is too long".into())
}

/// A codestream on its way into the decoder, which need not take all that it is given at once.
struct Pieces<'a> {
    codestream: Codestream<'a, Input>,
    left: Vec<u8>,
    /// Bytes in all.
    read: usize,
}

impl Pieces<'_> {
    /// Hands over the next piece; whether there was one.
    fn next(
        &mut self,
        feed: impl FnOnce(&[u8]) -> std::result::Result<usize, Failure>,
    ) -> std::result::Result<bool, Failure> {
        let count = self.codestream.by_ref().take(PIECE_BYTES as u64).read_to_end(&mut self.left)?;
        self.read += count;
        let taken = feed(&self.left)?;
        self.left.drain(..taken.min(self.left.len()));
        Ok(count > 0)
    }
}

/// Has floating point samples handed out as linear light in sRGB's primaries, as those of other formats are.
fn in_readable_form(image: &mut JxlImage) -> std::result::Result<(), Failure> {
    if is_float(image) {
        if matches!(image.image_header().metadata.colour_encoding, ColourEncoding::IccProfile(_)) {
            return Err("floating point samples in a color space of their own".into());
        }
        image.request_color_encoding(EnumColourEncoding::srgb_linear(RenderingIntent::Relative));
    }
    if image.pixel_format().has_black() {
        return Err("CMYK".into());
    }
    Ok(())
}

fn is_float(image: &JxlImage) -> bool {
    matches!(image.image_header().metadata.bit_depth, BitDepth::FloatSample { .. })
}

fn bits(image: &JxlImage) -> u16 {
    let bits = image.image_header().metadata.bit_depth.bits_per_sample();
    if bits <= 8 { 8 } else { bits as u16 }
}

pub(super) fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let image = open(input, DECODER_SLACK_BYTES as usize).map_err(HeaderError::damaged)?.image;
    let (width, height) = (image.width() as usize, image.height() as usize);
    Ok(StoredPixels { width, height, bits: bits(&image), is_float: is_float(&image) })
}

/// The profile of the samples as they are handed out; of floating point samples none, they are sRGB's by then.
pub(super) fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let image = open(input, DECODER_SLACK_BYTES as usize).ok()?.image;
    let is_needed = match &image.image_header().metadata.colour_encoding {
        ColourEncoding::Enum(encoding) => !encoding.is_srgb() && has_profile(encoding),
        ColourEncoding::IccProfile(_) => true,
    };
    (!is_float(&image) && is_needed).then(|| image.rendered_icc())
}

/// Whether the decoder knows a profile for a color encoding that is named; it panics at others.
fn has_profile(encoding: &EnumColourEncoding) -> bool {
    let has_curve = match encoding.tf {
        TransferFunction::Unknown => false,
        TransferFunction::Gamma { g, .. } => g > 0,
        _ => true,
    };
    has_curve && matches!(encoding.colour_space, ColourSpace::Rgb | ColourSpace::Grey)
}

/// The pixels are turned upright with the codestream's own orientation, which outranks that of EXIF (ISO/IEC 18181-2,
/// section 9.6). What colors are it always says itself, too.
pub(super) fn exif(input: &mut Input) -> Option<ExifFields> {
    let fields = ExifFields::from_exif(&block::parsed(container::exif(input)?)?);
    Some(fields.turned_already().without_color_space())
}

pub(super) fn whole_fields(input: &mut Input, wanted: &[Tag]) -> Option<Vec<Field>> {
    Some(block::fields_of(&block::parsed(container::exif(input)?)?, wanted))
}

/// Decodes the first picture.
pub(super) fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    input.rewind().map_err(|error| Error::io("reading", &source.path, error))?;
    let [width, height] = source.picture_size();
    let pixels = width.saturating_mul(height);
    let limit = pixels.saturating_mul(PIXEL_BYTES).saturating_add(DECODER_SLACK_BYTES as usize);
    let Opened { mut image, mut pieces } = open(&mut input, limit).map_err(|error| damaged(source, error))?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    check_unchanged(source, width, height)?;
    while !image.is_loading_done()
        && pieces.next(|piece| image.feed_bytes(piece)).map_err(|error| damaged(source, error))?
    {}
    if !image.is_loading_done() || image.num_loaded_keyframes() == 0 {
        return Err(Error::input(
            &source.name,
            "the photograph is cut off: the JPEG XL ends before its last frame does",
            "Copy it again from the camera or leave it out.",
        ));
    }
    let frame = image.render_frame(0).map_err(|error| damaged(source, error))?;
    let mut stream = frame.stream();
    let channels = stream.channels() as usize;
    let is_premultiplied =
        image.image_header().metadata.ec_info.iter().any(|extra| extra.alpha_associated() == Some(true));
    if is_float(&image) {
        let samples: Vec<f32> = samples(source, &mut stream)?;
        return sixteen(
            width,
            height,
            channels,
            encoded(&straight(samples, channels, is_premultiplied), channels, source.light),
        );
    }
    if bits(&image) > 8 {
        let samples: Vec<u16> = samples(source, &mut stream)?;
        return sixteen(width, height, channels, straight(samples, channels, is_premultiplied));
    }
    let samples: Vec<u8> = samples(source, &mut stream)?;
    eight(width, height, channels, straight(samples, channels, is_premultiplied))
}

/// All samples of a picture, channels interleaved.
fn samples<S: FrameBufferSample + Copy + Default>(
    source: &SourceImage,
    stream: &mut ImageStream<'_>,
) -> Result<Vec<S>> {
    let (width, height, channels) = (stream.width() as usize, stream.height() as usize, stream.channels() as usize);
    check_unchanged(source, width, height)?;
    let mut samples = vec![S::default(); sample_count(source, width, height, channels)?];
    let written = stream.write_to_buffer(&mut samples);
    if written == samples.len() && (1..=4).contains(&channels) {
        return Ok(samples);
    }
    Err(damaged(source, "its samples are not what its header says"))
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::{BufReader, Write};

    use super::*;

    /// A file whose header names no curve: its decoder panicked when it was asked for a profile.
    #[test]
    fn a_color_encoding_without_a_curve_has_no_profile() {
        #[rustfmt::skip]
        const WITHOUT_CURVE: [u8; 99] = [
            0xff, 0x0a, 0x88, 0x30, 0xb0, 0xa0, 0x08, 0x10, 0x08, 0x08, 0x10, 0x00, 0x54, 0x01, 0x4b, 0x38, 0x40, 0x36, 0x77, 0x05,
            0x5b, 0x07, 0x6d, 0xfa, 0xb0, 0x21, 0xa1, 0x9e, 0x83, 0xd7, 0x54, 0x90, 0x60, 0x41, 0x05, 0x15, 0x1c, 0xd1, 0x58, 0x4c,
            0x33, 0x30, 0xcd, 0xcd, 0x4e, 0xa8, 0x2f, 0x5e, 0x8c, 0x31, 0xe6, 0x4c, 0x01, 0xa4, 0x02, 0x19, 0x63, 0x6c, 0x54, 0x18,
            0xc3, 0x2b, 0x01, 0xc0, 0x00, 0x42, 0x20, 0x01, 0x44, 0x01, 0x03, 0x80, 0x69, 0x01, 0x74, 0x46, 0x00, 0x85, 0xd3, 0x48,
            0x1c, 0xc0, 0x61, 0x70, 0x0f, 0x6a, 0x9d, 0xf7, 0x09, 0x41, 0x1f, 0x03, 0xb9, 0x2a, 0x62, 0x0d, 0x06, 0xa1, 0x13,
        ];
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(&WITHOUT_CURVE).expect("written");
        let mut input = BufReader::new(File::open(file.path()).expect("opened"));
        assert!(stored(&mut input).is_ok(), "the header is read");
        assert_eq!(icc(&mut input), None);
    }
}
