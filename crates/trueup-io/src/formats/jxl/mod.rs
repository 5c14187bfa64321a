//! JPEG XL.

mod container;
mod read;

use crate::format::{Format, Reading};

/// How a bare codestream, and how a file of boxes begins.
///
/// # Source
/// ISO/IEC 18181-1, annex D (the signature of the codestream); ISO/IEC 18181-2, section 9.1.
const CODESTREAM_START: [u8; 2] = [0xff, 0x0a];
const CONTAINER_START: &[u8] = b"\0\0\0\x0cJXL \r\n\x87\n";

/// The declaration.
pub(crate) static JXL: Format = Format {
    name: "JPEG XL",
    extensions: &["jxl"],
    rare_extensions: &[],
    reading: Some(Reading {
        kinds: "lossy and lossless, 1 to 16 bits and floating point, gray and RGB, with or without alpha; the first picture of an \
                animation",
        has_signature: |start| start.starts_with(&CODESTREAM_START) || start.starts_with(CONTAINER_START),
        stored: read::stored,
        icc: read::icc,
        exif: read::exif,
        whole_fields: read::whole_fields,
        pixels: read::pixels,
        reduced: None,
        pixel_bytes: |_| read::PIXEL_BYTES,
    }),
    writing: None,
};
