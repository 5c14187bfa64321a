//! JPEG.

mod read;
mod reduced;
mod scans;
mod segments;
mod watched;
pub(super) mod write;

use crate::encode::options::Depth;
use crate::format::{Format, LOSSY_BYTES, PLAIN_PIXEL_BYTES, Reading, SideLimit, Transparency, Writer, Writing};
use crate::metadata::embedded;

/// The declaration.
///
/// # Source
/// Signature: ITU-T T.81 B.1.1.3 (the start marker and the next). Sides: 16 bits, B.2.2.
pub(crate) static JPEG: Format = Format {
    name: "JPEG",
    extensions: &["jpg", "jpeg"],
    rare_extensions: &["jpe", "jfif", "mpo"],
    reading: Some(Reading {
        kinds: "baseline and progressive, gray and color; the first picture of a multi-picture file (MPO), the photograph of a motion \
                photograph",
        has_signature: |start| start.starts_with(&[0xff, 0xd8, 0xff]),
        stored: read::stored,
        icc: read::icc,
        exif: read::exif,
        whole_fields: embedded::read_fields,
        pixels: read::pixels,
        reduced: Some(reduced::pixels),
        pixel_bytes: |_| PLAIN_PIXEL_BYTES,
    }),
    writing: Some(Writing {
        depths: &[Depth::Eight],
        transparency: Transparency::Never,
        sides: SideLimit { largest: 65_535, advice: "Write .tif, .dzi or .png instead, or a smaller panorama." },
        has_profile: true,
        memory: "a few strips of 48 rows",
        bytes_per_pixel: |_| LOSSY_BYTES,
        writer: Writer::File(write::write),
    }),
};
