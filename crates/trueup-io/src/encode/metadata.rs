//! What a file says of its picture beside the pixels, and how the formats hold it.

use std::borrow::Cow;

use crate::color::srgb_profile;

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

/// Longest content of a JPEG segment: its length has 16 bits and counts itself.
const SEGMENT_BYTES: usize = 65_533;
const APP1: u8 = 0xe1;
const APP2: u8 = 0xe2;
const APP0: u8 = 0xe0;
/// How segments tell what they hold.
///
/// # Source
/// EXIF 3.0, section 4.7.2; XMP specification part 3, section 1.1.3; ICC.1:2022, annex B.4.
const EXIF_SEGMENT: &[u8] = b"Exif\0\0";
const XMP_SEGMENT: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";
const ICC_SEGMENT: &[u8] = b"ICC_PROFILE\0";

impl Metadata {
    /// The profile to embed where a format cannot say sRGB otherwise.
    pub(super) fn profile(&self) -> &[u8] {
        self.icc.as_deref().unwrap_or_else(|| srgb_profile())
    }

    /// The metadata of the same picture brought to sRGB.
    pub(super) fn in_srgb(&self) -> Self {
        Self { icc: None, ..self.clone() }
    }

    /// A JPEG's headers with the metadata behind the start marker and the JFIF segment. What no segment can hold is left
    /// out: EXIF or XMP of 64 KiB.
    pub(super) fn jpeg_headers<'a>(&self, header: &'a [u8]) -> Cow<'a, [u8]> {
        let mut place = 2;
        if let Some(&[0xff, APP0, high, low]) = header.get(2..6) {
            place += 2 + usize::from(u16::from_be_bytes([high, low]));
        }
        let Some((before, after)) = header.split_at_checked(place) else { return header.into() };
        let mut out = before.to_vec();
        let mut segment = |marker: u8, parts: &[&[u8]]| {
            let bytes: usize = parts.iter().map(|part| part.len()).sum();
            if bytes <= SEGMENT_BYTES {
                out.extend([0xff, marker]);
                out.extend((bytes as u16 + 2).to_be_bytes());
                parts.iter().for_each(|part| out.extend_from_slice(part));
            }
        };
        if let Some(exif) = &self.exif {
            segment(APP1, &[EXIF_SEGMENT, exif]);
        }
        if let Some(xmp) = &self.xmp {
            segment(APP1, &[XMP_SEGMENT, xmp.as_bytes()]);
        }
        let chunks: Vec<&[u8]> = self.profile().chunks(SEGMENT_BYTES - ICC_SEGMENT.len() - 2).collect();
        // Chunks are counted in a byte each; a profile of 16 MB is no photograph's.
        if let Ok(count) = u8::try_from(chunks.len()) {
            for (number, chunk) in (1..=count).zip(chunks) {
                segment(APP2, &[ICC_SEGMENT, &[number, count], chunk]);
            }
        }
        out.extend_from_slice(after);
        out.into()
    }

    /// The headers of a PNG; without a profile, the caller marks it as sRGB.
    pub(super) fn png_info(&self, width: u32, height: u32) -> png::Info<'_> {
        let mut info = png::Info::with_size(width, height);
        info.icc_profile = self.icc.as_ref().map(|icc| icc.into());
        info.exif_metadata = self.exif.as_ref().map(|exif| exif.into());
        if let Some(xmp) = &self.xmp {
            info.utf8_text.push(png::text_metadata::ITXtChunk::new(PNG_XMP, xmp.as_str()));
        }
        info
    }

    /// Into a WebP.
    pub(super) fn tell_webp<W: std::io::Write>(&self, encoder: &mut image_webp::WebPEncoder<W>) {
        encoder.set_icc_profile(self.profile().to_vec());
        if let Some(exif) = &self.exif {
            encoder.set_exif_metadata(exif.clone());
        }
        if let Some(xmp) = &self.xmp {
            encoder.set_xmp_metadata(xmp.clone().into_bytes());
        }
    }
}

/// Keyword of the text chunk that holds XMP (XMP specification part 3, section 1.1.5).
const PNG_XMP: &str = "XML:com.adobe.xmp";
