//! What a file says of its colors, without decoding its pixels.

use std::io::Seek;
use std::path::Path;

use crate::metadata::exif_fields::ExifFields;
use crate::metadata::header::open;

/// EXIF's ColorSpace for Adobe RGB, as some cameras write it though no standard has it.
const EXIF_ADOBE_RGB: u32 = 2;
/// The interoperability index of files in Adobe RGB.
///
/// # Source
/// DCF 2.0 (JEITA CP-3461B), option file.
const INTEROPERABILITY_ADOBE_RGB: &str = "R03";

/// What a file says of its colors.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Embedded {
    /// The ICC profile's bytes.
    pub(crate) icc: Option<Vec<u8>>,
    /// EXIF names Adobe RGB; only asked where there is no profile.
    pub(crate) is_adobe_rgb: bool,
}

/// Reads it. A file that cannot be read says nothing: decoding it will tell why.
pub(crate) fn read(path: &Path) -> Embedded {
    try_read(path).unwrap_or_default()
}

fn try_read(path: &Path) -> Option<Embedded> {
    let (mut input, format) = open(path)?;
    let icc = format.icc(&mut input).filter(|icc| !icc.is_empty());
    if icc.is_some() {
        return Some(Embedded { icc, is_adobe_rgb: false });
    }
    input.rewind().ok()?;
    let exif = format.exif(&mut input).unwrap_or_default();
    Some(Embedded { icc: None, is_adobe_rgb: names_adobe_rgb(&exif) })
}

fn names_adobe_rgb(exif: &ExifFields) -> bool {
    exif.color_space == Some(EXIF_ADOBE_RGB) || exif.interoperability.as_deref() == Some(INTEROPERABILITY_ADOBE_RGB)
}
