//! The table of file formats, and what can be asked of all of them.
//!
//! A format is a file here with its declaration, its reader and its writer, and a row in [`FORMATS`]; `docs/formats.md`
//! has a row for it in each of its tables, which a test compares with the declarations.

pub(crate) mod alpha;
mod avif;
mod boxes;
#[cfg(test)]
mod byte_by_byte_tests;
pub(crate) mod decoded;
mod deep_zoom;
mod dng;
mod foreign;
mod heic;
mod jpeg;
mod jxl;
#[cfg(test)]
mod light_tests;
pub(crate) mod linear_light;
mod open_exr;
pub(crate) mod png;
mod radiance;
#[cfg(test)]
mod reading_tests;
#[cfg(test)]
pub(crate) mod specimens;
#[cfg(test)]
mod tests;
pub(crate) mod tiff;
mod webp;

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use crate::encode::place::is_standard_output;
use crate::format::{Foreign, Format, HeaderError, Reading, SIGNATURE_BYTES, Writing};

pub(crate) use foreign::{VIDEO, foreign_of, has_foreign_extension};

/// All formats, in the order in which messages and pages name them.
pub(crate) static FORMATS: [&Format; 11] = [
    &jpeg::JPEG,
    &png::PNG,
    &tiff::TIFF,
    &dng::DNG,
    &webp::WEBP,
    &heic::HEIC,
    &avif::AVIF,
    &jxl::JXL,
    &open_exr::OPEN_EXR,
    &radiance::RADIANCE,
    &deep_zoom::DEEP_ZOOM,
];

/// The formats that are read.
fn readable() -> impl Iterator<Item = (&'static Format, &'static Reading)> {
    FORMATS.iter().filter_map(|format| Some((*format, format.reading.as_ref()?)))
}

/// The formats that are written.
pub(crate) fn writable() -> impl Iterator<Item = (&'static Format, &'static Writing)> {
    FORMATS.iter().filter_map(|format| Some((*format, format.writing.as_ref()?)))
}

/// How to read a file that begins with `start`: the content tells, never the name.
fn reading_of(start: &[u8]) -> Option<&'static Reading> {
    readable().map(|(_, reading)| reading).find(|reading| (reading.has_signature)(start))
}

/// How to read `input`, which is left at its first byte; `None` if it is of no format that is read.
///
/// # Errors
/// If the file cannot be read.
pub(crate) fn recognize(input: &mut (impl Read + Seek)) -> std::io::Result<Option<&'static Reading>> {
    let mut reading = reading_of(&read_start(input)?);
    if reading.is_some_and(|found| tiff::TIFF.is_read_by(found)) && dng::is_digital_negative(input) {
        reading = dng::DNG.reading.as_ref();
    }
    input.rewind()?;
    Ok(reading)
}

/// What a file is that is of no format that is read, as far as its start and its header tell.
pub(crate) fn foreign_file(path: &Path) -> Option<&'static Foreign> {
    // Looked at before it is opened: opening a named pipe would wait for its writer.
    let mut input = BufReader::new(if path.is_file() { File::open(path).ok()? } else { return None });
    match recognize(&mut input).ok()? {
        Some(reading) => match reading.stored(&mut input) {
            Err(HeaderError::Foreign(foreign)) => Some(foreign),
            _ => None,
        },
        None => foreign_of(&read_start(&mut input).ok()?),
    }
}

/// What [`reading_of`] needs to see of a file, or all of a shorter one.
pub(crate) fn read_start(file: &mut impl Read) -> std::io::Result<Vec<u8>> {
    let mut start = Vec::with_capacity(SIGNATURE_BYTES);
    file.take(SIGNATURE_BYTES as u64).read_to_end(&mut start)?;
    Ok(start)
}

/// How to write what the extension of `path` names, in any case. Standard output, which has none, gets PNG: without
/// loss, with transparency, and read by every program.
pub(crate) fn writing_of(path: &Path) -> Option<&'static Writing> {
    if path.extension().is_none() && is_standard_output(path) {
        return png::PNG.writing.as_ref();
    }
    writable().find(|(format, _)| format.names(path)).map(|(_, writing)| writing)
}

/// Whether the extension of `path` names a photograph, in a format that is read or in another.
pub fn names_photograph(path: &Path) -> bool {
    readable().any(|(format, _)| format.names(path)) || has_foreign_extension(path)
}

/// The formats that are read, for messages: "JPEG, PNG, TIFF or WebP".
pub fn readable_formats() -> String {
    alternatives(readable().map(|(format, _)| format.name.to_owned()))
}

/// The extensions of photographs that are read, with their dots: ".jpg".
pub fn read_extensions() -> Vec<String> {
    let extensions = readable().flat_map(|(format, _)| format.extensions.iter().chain(format.rare_extensions));
    extensions.map(|extension| format!(".{extension}")).collect()
}

/// The extensions to propose of the formats that `which` accepts, for messages: ".png or .tif".
pub(crate) fn extensions(which: impl Fn(&Writing) -> bool) -> String {
    alternatives(
        writable().filter(|(_, writing)| which(writing)).map(|(format, _)| format!(".{}", format.extensions[0])),
    )
}

/// All extensions of files that are written, for messages: ".jpg, .png or .tif".
pub fn written_extensions() -> String {
    alternatives(writable().flat_map(|(format, _)| format.extensions).map(|extension| format!(".{extension}")))
}

/// "a, b or c".
fn alternatives(names: impl Iterator<Item = String>) -> String {
    let mut names: Vec<String> = names.collect();
    let last = names.pop().unwrap_or_default();
    if names.is_empty() { last } else { format!("{} or {last}", names.join(", ")) }
}
