//! PNG and WebP.

use std::io::{BufWriter, Write};

use png::{
    BitDepth, ColorType as PngColorType, Compression, Encoder as PngEncoder, EncodingError, SrgbRenderingIntent,
};
use tiff::TiffError;
use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use super::samples::{Sample, flattened};
use super::{Depth, Failure, Metadata, OutputOptions, PngCompression, RGBA, channels_of, for_each_strip};

/// Rows made at a time.
const STRIP_ROWS: usize = 64;

/// Bytes collected before the operating system is called.
const BUFFER_BYTES: usize = 1 << 20;

/// Writes a PNG of 8 or 16 bits.
pub(super) fn write_png(
    file: &mut impl Write,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let channels = channels_of(picture, options);
    let info = metadata.png_info(picture.width() as u32, picture.height() as u32);
    let mut encoder = PngEncoder::with_info(&mut output, info).map_err(from_png)?;
    encoder.set_color(if channels == RGBA { PngColorType::Rgba } else { PngColorType::Rgb });
    let sixteen = options.depth == Depth::Sixteen;
    encoder.set_depth(if sixteen { BitDepth::Sixteen } else { BitDepth::Eight });
    if metadata.icc.is_none() {
        encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    }
    encoder.set_compression(png_compression(options));
    let mut writer = encoder.write_header().map_err(from_png)?;
    let mut stream = writer.stream_writer_with_size(BUFFER_BYTES).map_err(from_png)?;
    if sixteen {
        let mut samples = Vec::new();
        for_each_strip::<u16>(picture, STRIP_ROWS, context, |strip| {
            flattened(strip, channels, u16::of(options.background), &mut samples);
            let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_be_bytes()).collect();
            Ok(stream.write_all(&bytes)?)
        })?;
    } else {
        let mut samples = Vec::new();
        for_each_strip::<u8>(picture, STRIP_ROWS, context, |strip| {
            flattened(strip, channels, u8::of(options.background), &mut samples);
            Ok(stream.write_all(&samples)?)
        })?;
    }
    stream.finish().map_err(from_png)?;
    writer.finish().map_err(from_png)?;
    output.flush()?;
    Ok(())
}

/// How hard a PNG is compressed.
pub(super) fn png_compression(options: &OutputOptions) -> Compression {
    match options.png_compression {
        PngCompression::Fast => Compression::Fast,
        PngCompression::Balanced => Compression::Balanced,
        PngCompression::High => Compression::High,
    }
}

/// Writes a lossless WebP; its encoder wants the whole picture at once.
pub(super) fn write_webp(
    file: &mut impl Write,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let channels = channels_of(picture, options);
    let mut pixels = Vec::with_capacity(picture.width() * picture.height() * channels);
    let mut samples = Vec::new();
    for_each_strip::<u8>(picture, STRIP_ROWS, context, |strip| {
        flattened(strip, channels, u8::of(options.background), &mut samples);
        pixels.extend_from_slice(&samples);
        Ok(())
    })?;
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let mut encoder = image_webp::WebPEncoder::new(&mut output);
    metadata.tell_webp(&mut encoder);
    let color = if channels == RGBA { image_webp::ColorType::Rgba8 } else { image_webp::ColorType::Rgb8 };
    encoder.encode(&pixels, picture.width() as u32, picture.height() as u32, color).map_err(std::io::Error::other)?;
    output.flush()?;
    Ok(())
}

pub(super) fn from_png(error: EncodingError) -> Failure {
    match error {
        EncodingError::IoError(error) => Failure::Io(error),
        other => Failure::Io(std::io::Error::other(other)),
    }
}

pub(super) fn from_tiff(error: TiffError) -> Failure {
    match error {
        TiffError::IoError(error) => Failure::Io(error),
        other => Failure::Io(std::io::Error::other(other)),
    }
}
