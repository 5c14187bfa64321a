//! OpenEXR.

mod read;
mod write;

use crate::encode::options::Depth;
use crate::format::{Format, LOSSLESS_BYTES, Reading, SideLimit, Transparency, Writer, Writing};

/// How files begin.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// The declaration.
///
/// # Source
/// "OpenEXR File Layout" (Academy Software Foundation). Sides: the length of a block of 16 rows has 31 bits.
pub(crate) static OPEN_EXR: Format = Format {
    name: "OpenEXR",
    extensions: &["exr"],
    rare_extensions: &[],
    reading: Some(Reading {
        kinds: "RGB or Y, with or without alpha, 16 and 32 bits, in lines or tiles, compressed in any way but DWA and JPEG 2000; \
                the first part that has these channels",
        has_signature: |start| start.starts_with(&MAGIC),
        stored: read::stored,
        icc: read::icc,
        exif: read::exif,
        whole_fields: |_, _| None,
        pixels: read::pixels,
        reduced: None,
        pixel_bytes: |_| read::PIXEL_BYTES,
    }),
    writing: Some(Writing {
        depths: &[Depth::Float],
        transparency: Transparency::Always,
        sides: SideLimit { largest: 8_388_607, advice: "Write a smaller panorama." },
        has_profile: false,
        memory: "64 rows",
        bytes_per_pixel: |_| LOSSLESS_BYTES * size_of::<f32>() as f64,
        writer: Writer::File(write::write),
    }),
};
