//! Panoramas in OpenEXR: 32-bit floating point samples in blocks of rows, compressed by ZIP.
//!
//! # Source
//! "OpenEXR File Layout" and "Technical Introduction to OpenEXR" (Academy Software Foundation): header, table of
//! offsets, blocks of scan lines; the channels of a row one after the other, in the order of their names; colors
//! multiplied by alpha.

use std::io::{BufWriter, Seek, SeekFrom, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use super::MAGIC;
use crate::color::Chromaticities;
use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::OutputOptions;
use crate::encode::samples::{OutputSample, RGBA, flattened};
use crate::encode::strips::{BUFFER_BYTES, STRIP_ROWS, channels_of, for_each_strip};
use crate::format::Output;
use crate::provenance::description::SOFTWARE;

/// Version 2 of the format, and nothing of what flags stand for: lines, one part, short names, no deep data.
const VERSION: i32 = 2;

/// Rows of a block compressed by ZIP, and how the header says that.
const BLOCK_ROWS: usize = 16;
const ZIP: u8 = 3;

/// How the header says 32-bit floating point numbers.
const FLOAT: i32 = 2;

/// What is added to differences of bytes.
const DIFFERENCE_OFFSET: u8 = 128;

/// Writes linear light in sRGB's primaries, 1 for white.
pub(super) fn write(
    file: &mut dyn Output,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> Result<(), WriteFailure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let channels = channels_of(picture, options);
    let head = header(picture.width(), picture.height(), channels, metadata.exif.is_some());
    output.write_all(&head)?;
    let blocks = picture.height().div_ceil(BLOCK_ROWS);
    let mut offsets: Vec<u64> = Vec::new();
    let mut place = head.len() as u64 + (blocks * size_of::<u64>()) as u64;
    output.write_all(&vec![0; blocks * size_of::<u64>()])?;
    let mut samples = Vec::new();
    let mut first_row = 0;
    for_each_strip::<f32>(picture, STRIP_ROWS, context, &mut |strip| {
        flattened(strip, channels, f32::of(options.background), &mut samples);
        let row_samples = picture.width() * channels;
        let compressed: Vec<Vec<u8>> = samples
            .par_chunks(BLOCK_ROWS * row_samples)
            .map(|rows| compressed(planes(rows, row_samples, channels)))
            .collect::<std::io::Result<_>>()?;
        for block in compressed {
            offsets.push(place);
            output.write_all(&(first_row as i32).to_le_bytes())?;
            output.write_all(&(block.len() as i32).to_le_bytes())?;
            output.write_all(&block)?;
            place += 2 * size_of::<i32>() as u64 + block.len() as u64;
            first_row += BLOCK_ROWS;
        }
        Ok(())
    })?;
    output.seek(SeekFrom::Start(head.len() as u64))?;
    for offset in offsets {
        output.write_all(&offset.to_le_bytes())?;
    }
    output.flush()?;
    Ok(())
}

/// All before the table of offsets.
fn header(width: usize, height: usize, channels: usize, names_program: bool) -> Vec<u8> {
    let mut bytes = [&MAGIC[..], &VERSION.to_le_bytes()].concat();
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        for text in [name, kind] {
            bytes.extend_from_slice(text.as_bytes());
            bytes.push(0);
        }
        bytes.extend((value.len() as i32).to_le_bytes());
        bytes.extend_from_slice(value);
    };
    let mut list = Vec::new();
    for name in names(channels) {
        list.extend([name, 0]);
        // The kind of samples, no hint of how they are seen, and a sample for every pixel.
        list.extend([FLOAT, 0, 1, 1].into_iter().flat_map(i32::to_le_bytes));
    }
    list.push(0);
    attribute("channels", "chlist", &list);
    let Chromaticities { red, green, blue, white } = Chromaticities::SRGB;
    attribute("chromaticities", "chromaticities", &floats([red, green, blue, white].as_flattened()));
    attribute("compression", "compression", &[ZIP]);
    let window: Vec<u8> = [0, 0, width as i32 - 1, height as i32 - 1].into_iter().flat_map(i32::to_le_bytes).collect();
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &floats(&[1.0]));
    attribute("screenWindowCenter", "v2f", &floats(&[0.0, 0.0]));
    attribute("screenWindowWidth", "float", &floats(&[1.0]));
    if names_program {
        attribute("software", "string", SOFTWARE.as_bytes());
    }
    bytes.push(0);
    bytes
}

/// The names of the channels, in their order.
fn names(channels: usize) -> impl Iterator<Item = u8> {
    b"ABGR".iter().copied().skip(RGBA - channels)
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// The rows of a block as they are stored, uncompressed.
fn planes(samples: &[f32], row_samples: usize, channels: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(size_of_val(samples));
    for row in samples.chunks_exact(row_samples) {
        // From alpha, or blue, to red.
        for channel in (0..channels).rev() {
            for pixel in row.chunks_exact(channels) {
                let alpha = pixel.get(3).copied().unwrap_or(1.0);
                let sample = if channel == 3 { alpha } else { pixel[channel] * alpha };
                bytes.extend(sample.to_le_bytes());
            }
        }
    }
    bytes
}

/// Bytes in even places and then those in odd ones, as differences, deflated; as they are if that is no shorter.
fn compressed(bytes: Vec<u8>) -> std::io::Result<Vec<u8>> {
    let mut reordered: Vec<u8> = bytes.iter().step_by(2).chain(bytes.iter().skip(1).step_by(2)).copied().collect();
    for at in (1..reordered.len()).rev() {
        reordered[at] = reordered[at].wrapping_sub(reordered[at - 1]).wrapping_add(DIFFERENCE_OFFSET);
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(&reordered)?;
    let deflated = encoder.finish()?;
    Ok(if deflated.len() < bytes.len() { deflated } else { bytes })
}
