//! Camera raw in the form of a TIFF: the first page is a small copy, or its samples are those of the sensor.
//!
//! # Source
//! TIFF/EP (ISO 12234-2) 5.1.2, and Adobe Digital Negative 1.7, chapter 3, for samples of the sensor: their
//! interpretations are none that TIFF 6.0 has.

use std::io::{Read, Seek};

use tiff::decoder::Decoder;
use tiff::tags::Tag;
use tiff::{TiffError, TiffFormatError, TiffResult, TiffUnsupportedError};

use crate::format::HeaderError;
use crate::formats::foreign::RAW;

/// Tag that every Digital Negative has in its first directory.
///
/// # Source
/// Adobe Digital Negative 1.7, chapter 4, "DNGVersion".
const DNG_VERSION: Tag = Tag::Unknown(50706);

/// NewSubfileType's bit for "a reduced-resolution version of another image in this TIFF file" (TIFF 6.0 section 8).
const REDUCED: u32 = 1;

/// Sub-directories that are looked into: raw files have up to five.
const LOOKED_INTO: usize = 8;

/// Why a first page cannot be made sense of.
pub(super) fn failure(error: TiffError) -> HeaderError {
    match error {
        // Samples of the sensor; or no strips and no tiles, as where a small copy is kept as a JPEG of its own.
        TiffError::UnsupportedError(TiffUnsupportedError::UnknownInterpretation)
        | TiffError::FormatError(TiffFormatError::StripTileTagConflict) => HeaderError::Foreign(&RAW),
        TiffError::UnsupportedError(unsupported) => HeaderError::Unsupported(unsupported.to_string()),
        other => HeaderError::damaged(other),
    }
}

/// Whether the first page is not the photograph: a sub-image is never taken for it.
pub(super) fn is_raw<R: Read + Seek>(decoder: &mut Decoder<R>) -> bool {
    let mut number = |tag| decoder.find_tag(tag).ok().flatten().and_then(|value| value.into_u32().ok());
    let is_reduced = number(Tag::NewSubfileType).is_some_and(|kind| kind & REDUCED != 0);
    is_reduced
        || decoder.find_tag(DNG_VERSION).is_ok_and(|version| version.is_some())
        || hides_larger_picture(decoder).unwrap_or(false)
}

/// Whether a directory below the first page's holds a larger picture that is not said to be a copy of another one.
fn hides_larger_picture<R: Read + Seek>(decoder: &mut Decoder<R>) -> TiffResult<bool> {
    let (width, height) = decoder.dimensions()?;
    let Some(below) = decoder.find_tag(Tag::SubIfd)? else { return Ok(false) };
    for pointer in below.into_ifd_vec()?.into_iter().take(LOOKED_INTO) {
        let Ok(directory) = decoder.read_directory(pointer) else { continue };
        let mut tags = decoder.read_directory_tags(&directory);
        let mut number = |tag| tags.find_tag(tag).ok().flatten().and_then(|value| value.into_u32().ok());
        let size = (number(Tag::ImageWidth), number(Tag::ImageLength));
        let is_reduced = number(Tag::NewSubfileType).is_some_and(|kind| kind & REDUCED != 0);
        if let (Some(inner_width), Some(inner_height)) = size
            && !is_reduced
            && inner_width > width
            && inner_height > height
        {
            return Ok(true);
        }
    }
    Ok(false)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    const WIDTH: u16 = 256;
    const LENGTH: u16 = 257;
    const NEW_SUBFILE_TYPE: u16 = 254;
    const PHOTOMETRIC: u16 = 262;
    const STRIP_OFFSETS: u16 = 273;
    const STRIP_BYTE_COUNTS: u16 = 279;
    const SUB_DIRECTORIES: u16 = 330;
    /// Where the first directory is, and how long each is made.
    const START: u32 = 8;
    const DIRECTORY_BYTES: usize = 128;

    /// A TIFF of a first directory and those it points to, each with entries of a tag and a number (TIFF 6.0 section
    /// 2).
    fn file(first: &[(u16, u32)], below: &[&[(u16, u32)]]) -> Decoder<Cursor<Vec<u8>>> {
        Decoder::new(bytes(first, below)).expect("a directory")
    }

    fn bytes(first: &[(u16, u32)], below: &[&[(u16, u32)]]) -> Cursor<Vec<u8>> {
        let place = |number: usize| START + (number * DIRECTORY_BYTES) as u32;
        let mut first = first.to_vec();
        first.extend((!below.is_empty()).then(|| (SUB_DIRECTORIES, place(1))));
        let mut bytes = b"II*\0".to_vec();
        bytes.extend(START.to_le_bytes());
        for (number, entries) in std::iter::once(&first[..]).chain(below.iter().copied()).enumerate() {
            let mut sorted = entries.to_vec();
            sorted.sort_unstable();
            bytes.extend((sorted.len() as u16).to_le_bytes());
            for (tag, value) in sorted {
                // One number of 32 bits.
                bytes.extend(tag.to_le_bytes().into_iter().chain([4, 0, 1, 0, 0, 0]).chain(value.to_le_bytes()));
            }
            bytes.resize(place(number + 1) as usize, 0);
        }
        Cursor::new(bytes)
    }

    const SMALL: [(u16, u32); 5] =
        [(WIDTH, 256), (LENGTH, 171), (PHOTOMETRIC, 1), (STRIP_OFFSETS, 8), (STRIP_BYTE_COUNTS, 4)];
    const LARGE: [(u16, u32); 5] =
        [(WIDTH, 6000), (LENGTH, 4000), (PHOTOMETRIC, 32803), (STRIP_OFFSETS, 8), (STRIP_BYTE_COUNTS, 4)];

    #[test]
    fn a_sub_image_is_never_taken_for_the_photograph() {
        let with = |tag: u16, value: u32| [&SMALL[..], &[(tag, value)]].concat();
        assert!(!is_raw(&mut file(&SMALL, &[])), "a plain picture");
        assert!(is_raw(&mut file(&with(NEW_SUBFILE_TYPE, 1), &[])), "a reduced copy");
        assert!(is_raw(&mut file(&with(50706, 0x0104), &[])), "a Digital Negative");
        assert!(is_raw(&mut file(&SMALL, &[&LARGE])), "a larger picture below");
        for (what, first) in [("samples of the sensor", &LARGE[..]), ("a copy kept elsewhere", &SMALL[..3])] {
            let error = Decoder::new(bytes(first, &[])).expect_err("nothing that can be decoded");
            assert!(matches!(failure(error), HeaderError::Foreign(_)), "{what}");
        }
    }

    #[test]
    fn smaller_copies_below_the_photograph_do_no_harm() {
        let copy = [(WIDTH, 128), (LENGTH, 85), (NEW_SUBFILE_TYPE, 1)];
        assert!(!is_raw(&mut file(&SMALL, &[&copy])));
        // A copy may be larger than the page if it says what it is; pointers may lead nowhere.
        assert!(!is_raw(&mut file(&SMALL, &[&[(WIDTH, 9000), (LENGTH, 9000), (NEW_SUBFILE_TYPE, 1)]])));
        assert!(!is_raw(&mut file(&[&SMALL[..], &[(SUB_DIRECTORIES, u32::MAX)]].concat(), &[])));
    }
}
