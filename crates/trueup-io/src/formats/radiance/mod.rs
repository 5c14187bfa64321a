//! Radiance's pictures: linear light with an exponent that red, green and blue share.

mod pixel;
mod read;
#[cfg(test)]
mod tests;
mod write;

use crate::encode::options::Depth;
use crate::format::{Format, LOSSLESS_BYTES, Reading, SideLimit, Transparency, Writer, Writing};

/// How files begin, by Radiance itself and by others.
const STARTS: [&[u8]; 2] = [b"#?RADIANCE", b"#?RGBE"];

/// The line that says how pixels are stored.
const FORMAT: &str = "FORMAT=32-bit_rle_rgbe";

/// What names the program that made a file.
const SOFTWARE_KEY: &str = "SOFTWARE=";

/// The declaration.
///
/// # Source
/// G. Ward, Real Pixels (Graphics Gems II, 1991), and "Radiance File Formats" (filefmts, Lawrence Berkeley National
/// Laboratory). Sides: the resolution is text; rows beyond 32,767 pixels are not compressed.
pub(crate) static RADIANCE: Format = Format {
    name: "Radiance",
    extensions: &["hdr"],
    rare_extensions: &["rgbe"],
    reading: Some(Reading {
        kinds: "RGBE, compressed or not, in rows",
        has_signature: |start| STARTS.iter().any(|signature| start.starts_with(signature)),
        stored: read::stored,
        icc: |_| None,
        exif: read::exif,
        whole_fields: |_, _| None,
        pixels: read::pixels,
        reduced: None,
        pixel_bytes: |_| read::PIXEL_BYTES,
    }),
    writing: Some(Writing {
        depths: &[Depth::Float],
        transparency: Transparency::Never,
        sides: SideLimit { largest: (1 << 31) - 1, advice: "Write a smaller panorama." },
        has_profile: false,
        memory: "64 rows",
        bytes_per_pixel: |_| LOSSLESS_BYTES * pixel::BYTES as f64,
        writer: Writer::File(write::write),
    }),
};
