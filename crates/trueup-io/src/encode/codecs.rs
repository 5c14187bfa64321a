//! PNG, TIFF and WebP.

use std::io::{BufWriter, Seek, Write};

use png::{
    BitDepth, ColorType as PngColorType, Compression, Encoder as PngEncoder, EncodingError, SrgbRenderingIntent,
};
use tiff::TiffError;
use tiff::encoder::colortype::RGBA8;
use tiff::encoder::{Compression as TiffMethod, DeflateLevel, Predictor, TiffEncoder, TiffKind};
use tiff::tags::Tag;
use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use super::{Failure, OutputOptions, PngCompression, RGBA, TiffCompression, for_each_strip};

/// Rows made at a time.
const STRIP_ROWS: usize = 64;

/// Bytes collected before the operating system is called.
const BUFFER_BYTES: usize = 1 << 20;

/// Pixel bytes from which a TIFF is written as BigTIFF: 32-bit offsets end at 4 GiB, and incompressible data and the
/// directory need some room beyond the pixels.
const BIG_TIFF_BYTES: usize = 4_000_000_000;

/// ExtraSamples: alpha that is not multiplied into the colours (TIFF 6.0 section 18).
const UNASSOCIATED_ALPHA: u16 = 2;

/// Writes an 8-bit RGBA PNG.
pub(super) fn write_png(
    file: &mut impl Write,
    picture: &dyn RowSource,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let mut encoder = PngEncoder::new(&mut output, picture.width() as u32, picture.height() as u32);
    encoder.set_color(PngColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
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

/// Writes an 8-bit RGBA TIFF in strips, with the horizontal predictor where it is compressed.
pub(super) fn write_tiff(
    file: &mut (impl Write + Seek),
    picture: &dyn RowSource,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    if picture.width() * picture.height() * RGBA > BIG_TIFF_BYTES {
        let encoder = TiffEncoder::new_big(&mut output).map_err(from_tiff)?;
        write_tiff_strips(encoder, picture, options, context)?;
    } else {
        let encoder = TiffEncoder::new(&mut output).map_err(from_tiff)?;
        write_tiff_strips(encoder, picture, options, context)?;
    }
    output.flush()?;
    Ok(())
}

fn write_tiff_strips<W: Write + Seek, K: TiffKind>(
    encoder: TiffEncoder<W, K>,
    picture: &dyn RowSource,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let (method, predictor) = match options.tiff_compression {
        TiffCompression::None => (TiffMethod::Uncompressed, Predictor::None),
        TiffCompression::Lzw => (TiffMethod::Lzw, Predictor::Horizontal),
        TiffCompression::Deflate => (TiffMethod::Deflate(DeflateLevel::Fast), Predictor::Horizontal),
    };
    let mut encoder = encoder.with_compression(method).with_predictor(predictor);
    let (width, height) = (picture.width() as u32, picture.height() as u32);
    let mut image = encoder.new_image::<RGBA8>(width, height).map_err(from_tiff)?;
    image.rows_per_strip(STRIP_ROWS as u32).map_err(from_tiff)?;
    image.encoder().write_tag(Tag::ExtraSamples, &[UNASSOCIATED_ALPHA][..]).map_err(from_tiff)?;
    for_each_strip(picture, STRIP_ROWS, context, |strip| image.write_strip(strip).map_err(from_tiff))?;
    image.finish().map_err(from_tiff)
}

/// Writes a lossless RGBA WebP; its encoder wants the whole picture at once.
pub(super) fn write_webp(
    file: &mut impl Write,
    picture: &dyn RowSource,
    context: &StageContext,
) -> Result<(), Failure> {
    let mut pixels = Vec::with_capacity(picture.width() * picture.height() * RGBA);
    for_each_strip(picture, STRIP_ROWS, context, |strip| {
        pixels.extend_from_slice(strip);
        Ok(())
    })?;
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let encoder = image_webp::WebPEncoder::new(&mut output);
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
