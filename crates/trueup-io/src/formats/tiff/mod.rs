//! TIFF and BigTIFF.

mod blocks;
mod convert;
mod directory;
pub(crate) mod metadata;
mod page;
mod palette;
mod raw;
mod read;
mod samples;
#[cfg(test)]
mod tests;
mod texts;
pub(crate) mod write;

use super::foreign::is_cr2;
use crate::encode::options::{Depth, TiffCompression};
use crate::format::{Format, LOSSLESS_BYTES, Reading, Transparency, Writer, Writing};

/// The declaration.
///
/// # Source
/// Signature: TIFF 6.0 section 2, and BigTIFF.
pub(crate) static TIFF: Format = Format {
    name: "TIFF",
    extensions: &["tif", "tiff"],
    rare_extensions: &[],
    reading: Some(Reading {
        kinds: "classic and BigTIFF, 8 and 16 bits, gray, RGB, CMYK, with or without alpha; palettes; YCbCr (color differences at \
                reduced resolution within JPEG compression only); gray of 1, 2 or 4 bits; floating point of 16, 32 or 64 \
                bits; in strips, tiles or planes; the first page",
        has_signature: |start| {
            matches!(start, [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..]) && !is_cr2(start)
        },
        stored: read::stored,
        icc: read::icc,
        exif: read::exif,
        whole_fields: read::whole_fields,
        pixels: read::pixels,
        reduced: None,
        pixel_bytes: read::pixel_bytes,
    }),
    writing: Some(Writing {
        depths: &[Depth::Eight, Depth::Sixteen, Depth::Float],
        transparency: Transparency::Always,
        sides: write::SIDES,
        has_profile: true,
        memory: "strips: 64 rows a thread; tiles: twice one row of tiles",
        bytes_per_pixel: |options| {
            let sample_bytes = f64::from(options.depth.sample_bytes());
            match options.tiff_compression {
                TiffCompression::None => COLORS * sample_bytes,
                TiffCompression::Deflate => LOSSLESS_BYTES * sample_bytes,
            }
        },
        writer: Writer::File(write::write),
    }),
};

/// Channels of a pixel without transparency.
const COLORS: f64 = 3.0;
