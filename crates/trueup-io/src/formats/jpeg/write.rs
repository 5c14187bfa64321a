//! JPEG in strips that are encoded in parallel.

use jpeg_encoder::{ChromaSubsamplingMethod, ColorType, Encoder, JfifWrite, SamplingFactor};
use rayon::prelude::*;
use trueup_core::StageContext;
use trueup_core::options::StageOptions;
use trueup_core::raster::RowSource;

use super::segments::with_metadata;
use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::{ChromaSubsampling, OutputOptions};
use crate::encode::samples::{OutputSample, RGBA, lay_over};
use crate::format::Output;

/// Rows of a strip: a multiple of 8 and of 16, the heights of a minimum coded unit, and few enough that the units of a
/// strip of the largest width fit the 16-bit restart interval.
const STRIP_ROWS: usize = 48;

/// Strips in memory at a time, per thread: enough that threads seldom wait for the slowest.
const STRIPS_PER_THREAD: usize = 4;

/// Writes a baseline JPEG whose restart intervals are strips of the picture.
///
/// Prediction starts afresh after a restart marker, so the coded data of a strip are the same whether it is a part of
/// the picture or a picture of its own: strips are encoded as pictures of their own, in parallel, and their coded data
/// joined by restart markers under one header.
///
/// # Source
/// ITU-T T.81 sections B.2 (headers), E.1.3 to E.1.4 (restart intervals) and F.1.2 (byte alignment of their ends).
pub(crate) fn write(
    file: &mut dyn Output,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> Result<(), WriteFailure> {
    let height = picture.height();
    let firsts: Vec<usize> = (0..height).step_by(STRIP_ROWS).collect();
    let mut strip_number = 0_usize;
    for batch in firsts.chunks(STRIPS_PER_THREAD * rayon::current_num_threads()) {
        let strips: Vec<Vec<u8>> = batch
            .par_iter()
            .map(|&first| {
                context.check_cancelled()?;
                encode_strip(picture, first, STRIP_ROWS.min(height - first), options)
            })
            .collect::<Result<_, WriteFailure>>()?;
        for strip in strips {
            let (header, coded) = split_scan(&strip).ok_or_else(malformed)?;
            if strip_number == 0 {
                file.write_all(&with_metadata(&with_height(header, height).ok_or_else(malformed)?, metadata))?;
            } else {
                file.write_all(&[0xff, RESTART_0 + ((strip_number - 1) % 8) as u8])?;
            }
            file.write_all(coded)?;
            strip_number += 1;
        }
        let rows: usize = batch.iter().map(|first| STRIP_ROWS.min(height - first)).sum();
        context.progress().advance(OutputOptions::STAGE, rows as u64);
    }
    file.write_all(&[0xff, END_OF_IMAGE])?;
    file.flush()?;
    Ok(())
}

const START_OF_FRAME_0: u8 = 0xc0;
const START_OF_SCAN: u8 = 0xda;
const END_OF_IMAGE: u8 = 0xd9;
const RESTART_0: u8 = 0xd0;

/// Encodes rows `first` to `first + rows` as a JPEG of their own.
fn encode_strip(
    picture: &dyn RowSource,
    first: usize,
    rows: usize,
    options: &OutputOptions,
) -> Result<Vec<u8>, WriteFailure> {
    let width = picture.width();
    let mut row = vec![0; width * RGBA];
    let mut rgb = vec![0; width * rows * 3];
    for (y, rgb) in rgb.chunks_exact_mut((width * 3).max(1)).enumerate() {
        picture.rgba8_row(first + y, &mut row)?;
        lay_over(&row, u8::of(options.background), rgb);
    }
    let (unit_width, unit_height) = match options.jpeg_subsampling {
        ChromaSubsampling::Full => (8, 8),
        ChromaSubsampling::HalfWidth => (16, 8),
        ChromaSubsampling::Quarter => (16, 16),
    };
    let units = width.div_ceil(unit_width) * (STRIP_ROWS / unit_height);
    let mut coded = Vec::with_capacity(rgb.len() / 6);
    let mut encoder = Encoder::new(&mut coded, options.jpeg_quality);
    set_sampling(&mut encoder, options);
    encoder.set_restart_interval(u16::try_from(units).map_err(|_| malformed())?);
    let (width, rows) = (u16::try_from(width), u16::try_from(rows));
    let (Ok(width), Ok(rows)) = (width, rows) else { return Err(malformed()) };
    encoder.encode(&rgb, width, rows, ColorType::Rgb).map_err(std::io::Error::other)?;
    Ok(coded)
}

/// Sets how finely color is stored.
pub(crate) fn set_sampling<W: JfifWrite>(encoder: &mut Encoder<W>, options: &OutputOptions) {
    encoder.set_sampling_factor(match options.jpeg_subsampling {
        ChromaSubsampling::Full => SamplingFactor::F_1_1,
        ChromaSubsampling::HalfWidth => SamplingFactor::F_2_1,
        ChromaSubsampling::Quarter => SamplingFactor::F_2_2,
    });
    encoder.set_chroma_subsampling_method(ChromaSubsamplingMethod::Average);
}

/// Splits a JPEG of one scan into its headers, the scan header included, and the coded data before the end marker.
fn split_scan(jpeg: &[u8]) -> Option<(&[u8], &[u8])> {
    let mut position = 2;
    loop {
        let &[0xff, marker, high, low] = jpeg.get(position..position + 4)? else { return None };
        position += 2 + usize::from(u16::from_be_bytes([high, low]));
        if marker == START_OF_SCAN {
            let coded_end = jpeg.len().checked_sub(2)?;
            return Some((jpeg.get(..position)?, jpeg.get(position..coded_end)?));
        }
    }
}

/// The headers of a strip with the height of the whole picture.
fn with_height(header: &[u8], height: usize) -> Option<Vec<u8>> {
    let mut header = header.to_vec();
    let mut position = 2;
    loop {
        let &[0xff, marker, high, low] = header.get(position..position + 4)? else { return None };
        if marker == START_OF_FRAME_0 {
            // Marker, length, precision; then the height.
            header.get_mut(position + 5..position + 7)?.copy_from_slice(&u16::try_from(height).ok()?.to_be_bytes());
            return Some(header);
        }
        position += 2 + usize::from(u16::from_be_bytes([high, low]));
    }
}

fn malformed() -> WriteFailure {
    WriteFailure::Io(std::io::Error::other("the JPEG encoder gave an unexpected result"))
}
