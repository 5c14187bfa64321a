//! What a file's header and EXIF say about a photograph, without decoding its pixels.

pub(crate) mod block;
pub(crate) mod exif_fields;
mod focal;
mod gravity;
pub(crate) mod header;
mod maker_note;
pub(crate) mod orientation;
pub(crate) mod pose;
pub(crate) mod tiff_fields;
