//! The headers of photographs, of any format.

use std::fs::File;
use std::io::{BufReader, Seek};
use std::path::Path;

use exif::{Field, Tag};
use trueup_core::source::{FocalPrior, RecordedGravity};

use super::exif_fields::ExifFields;
use super::focal::focal_prior;
use super::gravity::{PixelOrder, recorded_gravity};
use crate::format::{HeaderError, Input, Reading, StoredPixels};
use crate::formats;

/// Size and EXIF facts of a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    /// The pixels as they are stored, before orientation.
    pub(crate) stored: StoredPixels,
    /// EXIF fields; all empty where the file has none or they cannot be read.
    pub(crate) exif: ExifFields,
}

impl Header {
    /// The focal length that EXIF tells, in pixels of this photograph.
    pub(crate) fn focal_prior(&self) -> Option<FocalPrior> {
        focal_prior(&self.exif, self.stored.width as f64, self.stored.height as f64)
    }

    /// Which way the camera recorded as down, in the picture as it is shown: the file states orientation `stated`, and
    /// `applied` is what it is decoded with, 1 to 8 each.
    pub(crate) fn gravity(&self, stated: u8, applied: u8) -> Option<RecordedGravity> {
        let stored = [self.stored.width, self.stored.height];
        recorded_gravity(&self.exif, PixelOrder { stored, stated, applied })
    }
}

/// Reads size and EXIF of `file`, which is in `format`. Damaged EXIF counts as absent.
///
/// # Errors
/// When the header cannot be read or tells of a kind of picture that is not.
pub(crate) fn read_header(file: File, format: &Reading) -> Result<Header, HeaderError> {
    let mut input = BufReader::new(file);
    input.rewind().map_err(HeaderError::damaged)?;
    let stored = format.stored(&mut input)?;
    let exif = input.rewind().ok().and_then(|_| format.exif(&mut input)).unwrap_or_default();
    Ok(Header { stored, exif })
}

/// Bits of a sample of a picture file; `None` where the header cannot be read.
pub(crate) fn sample_bits(file: File) -> Option<u16> {
    let mut input = BufReader::new(file);
    let format = formats::recognize(&mut input).ok()??;
    format.stored(&mut input).ok().map(|stored| stored.bits)
}

/// The file at `path` at its first byte, and how to read it; `None` if it cannot be read or is in no format that is.
pub(crate) fn open(path: &Path) -> Option<(Input, &'static Reading)> {
    let mut input = BufReader::new(File::open(path).ok()?);
    let format = formats::recognize(&mut input).ok()??;
    Some((input, format))
}

/// The EXIF fields of these tags that a file has, of the picture itself. A file that cannot be read has none; damaged
/// fields are left out.
pub(crate) fn read_fields(path: &Path, wanted: &[Tag]) -> Vec<Field> {
    let fields = open(path).and_then(|(mut input, format)| format.whole_fields(&mut input, wanted));
    fields.unwrap_or_default()
}
