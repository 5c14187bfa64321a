//! Digital Negatives: what a sensor measured, in the form of a TIFF, developed here.
//!
//! # Source
//! Adobe Digital Negative (DNG) Specification 1.7.1.0; chapters and tags are named where they are heeded.

mod blocks;
mod color;
mod corrections;
mod described;
mod directory;
mod lossless_jpeg;
mod mosaic;
mod read;
#[cfg(test)]
mod tests;

use std::io::{Read, Seek};

use crate::format::{Format, Reading};
use directory::{Directory, first};

/// The declaration. No first bytes tell a Digital Negative from a TIFF: [`is_digital_negative`] does.
pub(crate) static DNG: Format = Format {
    name: "DNG",
    extensions: &["dng"],
    rare_extensions: &[],
    reading: Some(Reading {
        kinds: "Bayer's mosaic or three colors a pixel, 8 to 16 bits, uncompressed or by lossless JPEG, in strips or tiles; developed to \
                16 bits of sRGB",
        has_signature: |_| false,
        stored: read::stored,
        icc: |_| None,
        exif: read::exif,
        whole_fields: read::whole_fields,
        pixels: read::pixels,
        reduced: None,
        pixel_bytes: |_| read::PIXEL_BYTES,
    }),
    writing: None,
};

/// Tag that every Digital Negative has in its first directory (chapter 4, "DNGVersion").
const DNG_VERSION: u16 = 50706;

/// Whether a file is one.
pub(super) fn is_digital_negative(input: &mut (impl Read + Seek)) -> bool {
    first(input).and_then(|place| Directory::read(input, place)).is_some_and(|directory| directory.has(DNG_VERSION))
}
