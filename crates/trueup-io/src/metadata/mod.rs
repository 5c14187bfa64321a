//! What a file's header and EXIF say about a photograph, without decoding its pixels.

pub(crate) mod block;
pub(crate) mod embedded;
pub(crate) mod exif_fields;
pub(crate) mod focal;
pub(crate) mod gravity;
pub(crate) mod header;
pub(crate) mod maker_note;
pub(crate) mod orientation;
pub(crate) mod pose;
pub(crate) mod tiff_fields;
