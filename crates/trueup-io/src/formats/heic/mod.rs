//! HEIC: HEIF with pictures coded by HEVC.

mod container;
mod read;

use super::avif::is_avif;
use super::foreign::has_brand;
use crate::format::{Format, Reading};

/// The declaration.
///
/// # Source
/// Brands: ISO/IEC 23008-12, annex B.4; `mif1` and `msf1` stand for HEIF whatever the coding.
pub(crate) static HEIC: Format = Format {
    name: "HEIC",
    extensions: &["heic", "heif"],
    rare_extensions: &["hif"],
    reading: Some(Reading {
        kinds: "8 to 12 bits, color and gray, whole or in tiles, with or without alpha, as telephones and cameras write it; the primary \
                picture",
        has_signature: |start| {
            !is_avif(start) && [b"hei", b"hev", b"mif", b"msf"].iter().any(|brand| has_brand(start, brand))
        },
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
