//! What a file says of its picture beside the pixels.

use super::options::{OutputOptions, OutputProfile};
use crate::color::icc::{is_srgb, srgb_profile};

/// EXIF, color profile and XMP to be written into a file. Without a profile the picture is in sRGB, and is marked so.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Metadata {
    /// An EXIF block: a TIFF structure from its byte order mark on.
    pub exif: Option<Vec<u8>>,
    /// The ICC profile of the picture's samples; `None` for sRGB.
    pub icc: Option<Vec<u8>>,
    /// An XMP packet.
    pub xmp: Option<String>,
}

impl Metadata {
    /// The profile to embed where a format cannot say sRGB otherwise.
    pub(crate) fn profile(&self) -> &[u8] {
        self.icc.as_deref().unwrap_or_else(|| srgb_profile())
    }

    /// The metadata of the same picture brought to sRGB.
    pub(crate) fn in_srgb(&self) -> Self {
        Self { icc: None, ..self.clone() }
    }

    /// The profile of a picture that is to be converted to sRGB: where the options say so, or `always`.
    pub(crate) fn profile_to_leave(&self, options: &OutputOptions, always: bool) -> Option<&[u8]> {
        let leaves = always || options.profile == OutputProfile::Srgb;
        self.icc.as_deref().filter(|icc| leaves && !is_srgb(icc))
    }
}
