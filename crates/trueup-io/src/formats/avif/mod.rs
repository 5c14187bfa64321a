//! AVIF: HEIF with pictures coded by AV1.

mod av1;
mod color;
mod items;
mod read;
#[cfg(test)]
mod tests;

use super::foreign::{has_brand, has_compatible_brand};
use crate::format::{Format, Reading};

/// The declaration.
pub(crate) static AVIF: Format = Format {
    name: "AVIF",
    extensions: &["avif"],
    rare_extensions: &["avifs"],
    reading: Some(Reading {
        kinds: "8, 10 and 12 bits, color and gray, whole or in tiles, with or without alpha; the primary picture",
        has_signature: is_avif,
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

/// Whether a file that begins so is AVIF: by its own brand, or by one that stands for HEIF whatever the coding beside
/// one of AVIF.
///
/// # Source
/// AV1 Image File Format, section 6 (brands `avif`, `avis`); ISO/IEC 23008-12, annex B.4.
pub(super) fn is_avif(start: &[u8]) -> bool {
    let is_of_any_coding = [b"mif", b"msf"].iter().any(|brand| has_brand(start, brand));
    has_brand(start, b"avi") || (is_of_any_coding && has_compatible_brand(start, b"avi"))
}
