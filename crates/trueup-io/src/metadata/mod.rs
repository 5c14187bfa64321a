//! What a file's header and EXIF say about a photograph, without decoding its pixels.

pub(crate) mod block;
pub(crate) mod exif_fields;
mod focal;
pub(crate) mod header;
pub(crate) mod orientation;
pub(crate) mod tiff_fields;
