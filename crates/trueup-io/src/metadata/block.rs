//! EXIF blocks, wherever they lie in a file.

use exif::{Exif, Field, In, Reader, Tag};

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
