//! The EXIF block that a picture file holds.

use exif::{Exif, Field, In, Reader, Tag};

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

/// The fields of these tags that a block has, of the picture itself.
pub(crate) fn fields_of(exif: &Exif, wanted: &[Tag]) -> Vec<Field> {
    wanted.iter().filter_map(|&tag| exif.get_field(tag, In::PRIMARY)).cloned().collect()
}

/// As much of a block as can be read, from its byte order mark on.
pub(crate) fn parsed(block: Vec<u8>) -> Option<Exif> {
    let mut reader = Reader::new();
    reader.continue_on_error(true);
    reader.read_raw(block).or_else(|error| error.distill_partial_result(|_| {})).ok()
}

/// As much of the block of a JPEG, PNG or WebP as can be read.
fn read(input: &mut Input) -> Option<Exif> {
    let mut reader = Reader::new();
    reader.continue_on_error(true);
    let exif = reader.read_from_container(input);
    exif.or_else(|error| error.distill_partial_result(|_| {})).ok()
}
