//! What EXIF fields hold.

use exif::{Context, Field, In, Tag, Value};

/// The value of a field of the picture itself, not of its thumbnail.
pub(super) fn value(fields: &[Field], tag: Tag) -> Option<&Value> {
    fields.iter().find(|field| field.tag == tag && field.ifd_num == In::PRIMARY).map(|field| &field.value)
}

/// The text of a field.
pub(super) fn text(fields: &[Field], tag: Tag) -> Option<String> {
    let Value::Ascii(lines) = value(fields, tag)? else { return None };
    let text = String::from_utf8_lossy(lines.first()?).trim().to_owned();
    (!text.is_empty()).then_some(text)
}

/// Whether a field belongs to the place.
pub(super) fn is_of_place(field: &Field) -> bool {
    field.tag.context() == Context::Gps
}
