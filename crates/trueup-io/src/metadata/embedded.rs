//! The EXIF block that a JPEG, PNG or WebP file holds.

use exif::{Exif, Field, Reader, Tag};

use super::block::fields_of;
use super::exif_fields::ExifFields;
use crate::format::Input;

/// The fields that measurement uses.
pub(crate) fn read_exif(input: &mut Input) -> Option<ExifFields> {
    read(input).map(|exif| ExifFields::from_exif(&exif))
}

/// The fields of these tags, of the picture itself.
pub(crate) fn read_fields(input: &mut Input, wanted: &[Tag]) -> Option<Vec<Field>> {
    Some(fields_of(&read(input)?, wanted))
}

/// As much of the block as can be read.
fn read(input: &mut Input) -> Option<Exif> {
    let mut reader = Reader::new();
    reader.continue_on_error(true);
    let exif = reader.read_from_container(input);
    exif.or_else(|error| error.distill_partial_result(|_| {})).ok()
}
