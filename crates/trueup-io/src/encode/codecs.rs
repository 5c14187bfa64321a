//! PNG, TIFF and WebP.

use std::borrow::Cow;
use std::io::{BufWriter, Seek, Write};

use flate2::write::ZlibEncoder;
use png::{
    BitDepth, ColorType as PngColorType, Compression, Encoder as PngEncoder, EncodingError, SrgbRenderingIntent,
};
use rayon::prelude::*;
use tiff::TiffError;
use tiff::encoder::{DirectoryEncoder, TiffEncoder, TiffKind};
use tiff::tags::{CompressionMethod, ExtraSamples, PhotometricInterpretation, PlanarConfiguration, Predictor, Tag};
use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use super::{Failure, Metadata, OutputOptions, PngCompression, RGBA, TiffCompression, for_each_strip, tiff_metadata};

/// Rows made at a time.
const STRIP_ROWS: usize = 64;

/// Bytes collected before the operating system is called.
const BUFFER_BYTES: usize = 1 << 20;

/// Pixel bytes from which a TIFF is written as BigTIFF: 32-bit offsets end at 4 GiB, and incompressible data and the
/// directory need some room beyond the pixels.
const BIG_TIFF_BYTES: usize = 4_000_000_000;

/// Writes an 8-bit RGBA PNG.
pub(super) fn write_png(
    file: &mut impl Write,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let info = metadata.png_info(picture.width() as u32, picture.height() as u32);
    let mut encoder = PngEncoder::with_info(&mut output, info).map_err(from_png)?;
    if metadata.icc.is_none() {
        encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    }
    encoder.set_color(PngColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(match options.png_compression {
        PngCompression::Fast => Compression::Fast,
        PngCompression::Balanced => Compression::Balanced,
        PngCompression::High => Compression::High,
    });
    let mut writer = encoder.write_header().map_err(from_png)?;
    let mut stream = writer.stream_writer_with_size(BUFFER_BYTES).map_err(from_png)?;
    for_each_strip(picture, STRIP_ROWS, context, |strip| Ok(stream.write_all(strip)?))?;
    stream.finish().map_err(from_png)?;
    writer.finish().map_err(from_png)?;
    output.flush()?;
    Ok(())
}

/// Writes an 8-bit RGBA TIFF in strips, which are compressed in parallel.
///
/// The directory is written field by field: the image writer of the `tiff` crate compresses whole pictures only.
pub(super) fn write_tiff(
    file: &mut (impl Write + Seek),
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    if picture.width() * picture.height() * RGBA > BIG_TIFF_BYTES {
        let encoder = TiffEncoder::new_big(&mut output).map_err(from_tiff)?;
        write_tiff_directory(encoder, picture, metadata, options, context)?;
    } else {
        let encoder = TiffEncoder::new(&mut output).map_err(from_tiff)?;
        write_tiff_directory(encoder, picture, metadata, options, context)?;
    }
    output.flush()?;
    Ok(())
}

fn write_tiff_directory<W: Write + Seek, K: TiffKind>(
    mut encoder: TiffEncoder<W, K>,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let hanging = tiff_metadata::write_directories(&mut encoder, metadata).map_err(from_tiff)?;
    let mut directory = encoder.image_directory().map_err(from_tiff)?;
    let deflate = options.tiff_compression == TiffCompression::Deflate;
    let row_bytes = picture.width() * RGBA;
    let (mut offsets, mut lengths) = (Vec::new(), Vec::new());
    // As many strips at a time as can be compressed side by side.
    let batch_rows = STRIP_ROWS * rayon::current_num_threads();
    for_each_strip(picture, batch_rows, context, |batch| {
        let strips = batch.par_chunks(STRIP_ROWS * row_bytes);
        let strips: std::io::Result<Vec<Cow<[u8]>>> = strips
            .map(|strip| if deflate { deflated(strip, row_bytes).map(Cow::Owned) } else { Ok(strip.into()) })
            .collect();
        for strip in strips? {
            offsets.push(directory.write_data(&*strip).map_err(from_tiff)?);
            lengths.push(strip.len() as u64);
        }
        Ok(())
    })?;

    let method = if deflate { CompressionMethod::Deflate } else { CompressionMethod::None };
    let predictor = if deflate { Predictor::Horizontal } else { Predictor::None };
    let sizes = [
        (Tag::ImageWidth, picture.width() as u32),
        (Tag::ImageLength, picture.height() as u32),
        (Tag::RowsPerStrip, STRIP_ROWS as u32),
    ];
    for (tag, size) in sizes {
        directory.write_tag(tag, size).map_err(from_tiff)?;
    }
    let codes = [
        (Tag::Compression, method.to_u16()),
        (Tag::Predictor, predictor.to_u16()),
        (Tag::PhotometricInterpretation, PhotometricInterpretation::RGB.to_u16()),
        (Tag::SamplesPerPixel, RGBA as u16),
        (Tag::PlanarConfiguration, PlanarConfiguration::Chunky.to_u16()),
        (Tag::ExtraSamples, ExtraSamples::UnassociatedAlpha.to_u16()),
    ];
    for (tag, code) in codes {
        directory.write_tag(tag, code).map_err(from_tiff)?;
    }
    directory.write_tag(Tag::BitsPerSample, &[8_u16; RGBA][..]).map_err(from_tiff)?;
    write_tiff_offsets(&mut directory, Tag::StripOffsets, &offsets)?;
    write_tiff_offsets(&mut directory, Tag::StripByteCounts, &lengths)?;
    tiff_metadata::write_tags(&mut directory, metadata, &hanging).map_err(from_tiff)?;
    directory.finish().map_err(from_tiff)
}

/// Writes offsets or lengths in 32 bits where they fit, as classic TIFF demands, else in 64.
fn write_tiff_offsets<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    tag: Tag,
    values: &[u64],
) -> Result<(), Failure> {
    let short: Result<Vec<u32>, _> = values.iter().map(|&value| u32::try_from(value)).collect();
    match short {
        Ok(values) => directory.write_tag(tag, &values[..]),
        Err(_) => directory.write_tag(tag, values),
    }
    .map_err(from_tiff)
}

/// Deflates rows of RGBA, each pixel as its difference from the pixel to its left.
///
/// # Source
/// TIFF 6.0 section 14 (horizontal differencing); Adobe Photoshop TIFF Technical Notes (deflate: a zlib stream).
fn deflated(strip: &[u8], row_bytes: usize) -> std::io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(strip.len() / 2), flate2::Compression::fast());
    let mut differences = vec![0; row_bytes];
    for row in strip.chunks_exact(row_bytes) {
        let (first, rest) = row.split_at(RGBA);
        differences[..RGBA].copy_from_slice(first);
        for (difference, (value, left)) in differences[RGBA..].iter_mut().zip(rest.iter().zip(row)) {
            *difference = value.wrapping_sub(*left);
        }
        encoder.write_all(&differences)?;
    }
    encoder.finish()
}

/// Writes a lossless RGBA WebP; its encoder wants the whole picture at once.
pub(super) fn write_webp(
    file: &mut impl Write,
    picture: &dyn RowSource,
    metadata: &Metadata,
    context: &StageContext,
) -> Result<(), Failure> {
    let mut pixels = Vec::with_capacity(picture.width() * picture.height() * RGBA);
    for_each_strip(picture, STRIP_ROWS, context, |strip| {
        pixels.extend_from_slice(strip);
        Ok(())
    })?;
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let mut encoder = image_webp::WebPEncoder::new(&mut output);
    metadata.tell_webp(&mut encoder);
    encoder
        .encode(&pixels, picture.width() as u32, picture.height() as u32, image_webp::ColorType::Rgba8)
        .map_err(std::io::Error::other)?;
    output.flush()?;
    Ok(())
}

fn from_png(error: EncodingError) -> Failure {
    match error {
        EncodingError::IoError(error) => Failure::Io(error),
        other => Failure::Io(std::io::Error::other(other)),
    }
}

fn from_tiff(error: TiffError) -> Failure {
    match error {
        TiffError::IoError(error) => Failure::Io(error),
        other => Failure::Io(std::io::Error::other(other)),
    }
}
