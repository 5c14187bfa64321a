//! Photographs in Radiance's form.

use std::io::{BufRead, Read};

use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::pixel::{light, read_row};
use super::{FORMAT, SOFTWARE_KEY, STARTS};
use crate::format::{HeaderError, Input, StoredPixels};
use crate::formats::decoded::{check_unchanged, damaged, sixteen};
use crate::formats::linear_light::encoded;
use crate::metadata::exif_fields::ExifFields;

/// Bytes a pixel takes in memory while it is read: three samples of 16 bits, which grow in a vector.
pub(super) const PIXEL_BYTES: usize = 12;

/// Most bytes of a header: each of its lines is a command that someone may have typed.
const MOST_HEADER_BYTES: u64 = 1 << 20;

/// What tells how samples were made of light; below 1, as ImageMagick writes it, they are those of a curve.
const GAMMA_KEY: &str = "GAMMA=";

/// Bits that a shared exponent and mantissa make of a sample, as told of floating point samples.
const BITS: u16 = 32;

/// What the lines before the pixels say.
#[derive(Debug, Clone, PartialEq, Default)]
struct Header {
    width: usize,
    height: usize,
    /// How the pixels are to be turned, as EXIF says it.
    orientation: u32,
    software: Option<String>,
}

/// Reads a header; the input is left at the first pixel.
fn header(input: &mut Input) -> std::result::Result<Header, HeaderError> {
    let mut lines = input.take(MOST_HEADER_BYTES);
    let mut line = || -> std::result::Result<String, HeaderError> {
        let mut bytes = Vec::new();
        lines.read_until(b'\n', &mut bytes).map_err(HeaderError::damaged)?;
        match bytes.pop() {
            Some(b'\n') => Ok(String::from_utf8_lossy(&bytes).trim_end_matches('\r').to_owned()),
            _ => Err(HeaderError::damaged("it ends within its header")),
        }
    };
    let first = line()?;
    if !STARTS.iter().any(|start| first.as_bytes().starts_with(start)) {
        return Err(HeaderError::damaged("no first line"));
    }
    let mut header = Header::default();
    loop {
        let text = line()?;
        if text.is_empty() {
            break;
        }
        if let Some(software) = text.strip_prefix(SOFTWARE_KEY) {
            header.software = Some(software.trim().to_owned());
        }
        if text
            .strip_prefix(GAMMA_KEY)
            .and_then(|gamma| gamma.trim().parse().ok())
            .is_some_and(|gamma: f64| gamma < 1.0)
        {
            return Err(HeaderError::Unsupported(format!("samples that are no light, by its line {text}")));
        }
        if text.starts_with("FORMAT=") && text != FORMAT {
            return Err(HeaderError::Unsupported(format!("{text} instead of {FORMAT}")));
        }
    }
    let resolution = line()?;
    let (orientation, height, width) = resolution_of(&resolution)?;
    Ok(Header { width, height, orientation, ..header })
}

/// Turn, height and width by the line before the pixels.
fn resolution_of(line: &str) -> std::result::Result<(u32, usize, usize), HeaderError> {
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let [first, height, second, width] = words[..] else { return Err(HeaderError::damaged("no resolution")) };
    // Rows from the top, columns from the left; either may run the other way (EXIF 3.0, section 4.6.5.1).
    let orientation = match (first, second) {
        ("-Y", "+X") => 1,
        ("-Y", "-X") => 2,
        ("+Y", "-X") => 3,
        ("+Y", "+X") => 4,
        _ => return Err(HeaderError::Unsupported(format!("pixels in the order {first} {second}"))),
    };
    let length = |word: &str| word.parse().ok().filter(|&length: &usize| length > 0);
    match (length(height), length(width)) {
        (Some(height), Some(width)) => Ok((orientation, height, width)),
        _ => Err(HeaderError::damaged("no resolution")),
    }
}

pub(super) fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let Header { width, height, .. } = header(input)?;
    Ok(StoredPixels { width, height, bits: BITS, is_float: true })
}

pub(super) fn exif(input: &mut Input) -> Option<ExifFields> {
    let Header { orientation, software, .. } = header(input).ok()?;
    Some(ExifFields { orientation: Some(orientation), software, ..ExifFields::default() })
}

/// Decodes the pixels as they are stored.
///
/// # Departures
/// EXPOSURE, by which pixels were multiplied to be looked at, stays with them: undone, the white of a photograph would
/// not be 1. Primaries are taken for sRGB's, which programs write whatever the header says.
pub(super) fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let Header { width, height, .. } = header(&mut input).map_err(|error| damaged(source, error.words()))?;
    check_unchanged(source, width, height)?;
    // Grows with what is read: a header may claim any size.
    let mut samples: Vec<u16> = Vec::new();
    let mut row = Vec::new();
    for _ in 0..height {
        read_row(&mut input, width, &mut row).map_err(|error| match error.kind() {
            std::io::ErrorKind::UnexpectedEof => cut_off(source),
            _ => damaged(source, error),
        })?;
        let lights: Vec<f32> = row.iter().flat_map(|&pixel| light(pixel)).collect();
        samples.extend(encoded(&lights, 3, source.light));
    }
    sixteen(width, height, 3, samples)
}

fn cut_off(source: &SourceImage) -> Error {
    Error::input(
        &source.name,
        "the photograph is cut off: the file ends before its last row",
        "Copy it again or leave it out.",
    )
}
