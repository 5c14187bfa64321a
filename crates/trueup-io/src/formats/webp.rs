//! WebP.

use std::io::{BufWriter, Write};

use image_webp::{ColorType, DecodingError, WebPDecoder, WebPEncoder};
use trueup_core::raster::{Photograph, RowSource};
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};

use super::decoded::{HEADER_BYTES, check_unchanged, damaged, eight, sample_count};
use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::{Depth, OutputOptions};
use crate::encode::samples::{OutputSample, RGBA, flattened};
use crate::encode::strips::{BUFFER_BYTES, STRIP_ROWS, channels_of, for_each_strip};
use crate::format::{
    Format, HeaderError, Input, LOSSLESS_BYTES, Output, PLAIN_PIXEL_BYTES, Reading, SideLimit, StoredPixels,
    Transparency, Writer, Writing,
};
use crate::metadata::embedded;

/// The declaration.
///
/// # Source
/// Signature: RFC 9649 2.4. Sides: 14 bits, of which the common decoders take one less, RFC 9649 and libwebp.
pub(crate) static WEBP: Format = Format {
    name: "WebP",
    extensions: &["webp"],
    rare_extensions: &[],
    reading: Some(Reading {
        kinds: "lossy and lossless",
        has_signature: |start| start.starts_with(b"RIFF") && start.get(8..12) == Some(b"WEBP"),
        stored,
        icc,
        exif: embedded::read_exif,
        whole_fields: embedded::read_fields,
        pixels,
        reduced: None,
        pixel_bytes: |_| PLAIN_PIXEL_BYTES,
    }),
    writing: Some(Writing {
        depths: &[Depth::Eight],
        transparency: Transparency::Always,
        sides: SideLimit { largest: 16_383, advice: "Write .jpg, .tif or .png instead, or a smaller panorama." },
        has_profile: true,
        memory: "the whole picture",
        bytes_per_pixel: |_| LOSSLESS_BYTES,
        writer: Writer::File(write),
    }),
};

fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let decoder = WebPDecoder::new(input).map_err(HeaderError::damaged)?;
    let (width, height) = decoder.dimensions();
    Ok(StoredPixels { width: width as usize, height: height as usize, bits: 8, is_float: false })
}

/// The profile, if it is no longer than a header may be: room for it is made before it is read.
fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let mut decoder = WebPDecoder::new(input).ok()?;
    decoder.set_memory_limit(HEADER_BYTES);
    decoder.icc_profile().ok().flatten()
}

fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let failed = |error: DecodingError| damaged(source, error);
    let mut decoder = WebPDecoder::new(&mut input).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_unchanged(source, width, height)?;
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let mut samples = vec![0; sample_count(source, width, height, channels)?];
    decoder.read_image(&mut samples).map_err(failed)?;
    eight(width, height, channels, samples)
}

/// Writes a lossless WebP; its encoder wants the whole picture at once.
pub(super) fn write(
    file: &mut dyn Output,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> std::result::Result<(), WriteFailure> {
    let channels = channels_of(picture, options);
    let mut pixels = Vec::with_capacity(picture.width() * picture.height() * channels);
    let mut samples = Vec::new();
    for_each_strip::<u8>(picture, STRIP_ROWS, context, &mut |strip| {
        flattened(strip, channels, u8::of(options.background), &mut samples);
        pixels.extend_from_slice(&samples);
        Ok(())
    })?;
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let mut encoder = WebPEncoder::new(&mut output);
    encoder.set_icc_profile(metadata.profile().to_vec());
    if let Some(exif) = &metadata.exif {
        encoder.set_exif_metadata(exif.clone());
    }
    if let Some(xmp) = &metadata.xmp {
        encoder.set_xmp_metadata(xmp.clone().into_bytes());
    }
    let color = if channels == RGBA { ColorType::Rgba8 } else { ColorType::Rgb8 };
    encoder.encode(&pixels, picture.width() as u32, picture.height() as u32, color).map_err(std::io::Error::other)?;
    output.flush()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::{BufReader, Seek, SeekFrom};

    use super::*;

    /// A file of which only the beginning takes room on the disk.
    #[test]
    fn a_profile_is_no_longer_than_a_header_may_be() {
        let of_length = |length: usize| {
            let mut file = tempfile::tempfile().expect("a file");
            // What the whole is long, an extended header of 24 x 18 pixels with a profile (RFC 9649 2.7), and the
            // profile.
            let head = [
                &b"RIFF"[..],
                &(length as u32 + 30).to_le_bytes(),
                b"WEBPVP8X\x0a\0\0\0\x20\0\0\0\x17\0\0\x11\0\0ICCP",
                &(length as u32).to_le_bytes(),
            ];
            file.write_all(&head.concat()).expect("written");
            let profile_end = head.concat().len() + length;
            file.set_len(profile_end as u64).expect("as long");
            file.seek(SeekFrom::Start(profile_end as u64)).expect("its end");
            // A lossless picture, of which nothing but the header is looked at.
            file.write_all(b"VP8L\x06\0\0\0\x2f\x17\x40\x04\0\0").expect("written");
            file.rewind().expect("its start");
            icc(&mut BufReader::new(file)).map(|icc| icc.len())
        };
        assert_eq!(of_length(400), Some(400));
        assert_eq!(of_length(HEADER_BYTES + 2), None);
    }
}
