//! The segments of a JPEG that hold metadata.

use std::borrow::Cow;

use crate::encode::metadata::Metadata;

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

/// A JPEG's headers with the metadata behind the start marker and the JFIF segment. What no segment can hold is left
/// out: EXIF or XMP of 64 KiB.
pub(super) fn with_metadata<'a>(header: &'a [u8], metadata: &Metadata) -> Cow<'a, [u8]> {
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
    if let Some(exif) = &metadata.exif {
        segment(APP1, &[EXIF_SEGMENT, exif]);
    }
    if let Some(xmp) = &metadata.xmp {
        segment(APP1, &[XMP_SEGMENT, xmp.as_bytes()]);
    }
    let chunks: Vec<&[u8]> = metadata.profile().chunks(SEGMENT_BYTES - ICC_SEGMENT.len() - 2).collect();
    // Chunks are counted in a byte each; a profile of 16 MB is no photograph's.
    if let Ok(count) = u8::try_from(chunks.len()) {
        for (number, chunk) in (1..=count).zip(chunks) {
            segment(APP2, &[ICC_SEGMENT, &[number, count], chunk]);
        }
    }
    out.extend_from_slice(after);
    out.into()
}
