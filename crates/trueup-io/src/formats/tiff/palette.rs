//! TIFFs with a palette.

use std::io::Cursor;

use tiff::TiffError;
use tiff::tags::{PhotometricInterpretation, Tag};
use trueup_core::Result;
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;

use super::convert::unpacked;
use super::page::FirstPage;
use super::samples::{Samples, not_as_stated, open};
use crate::formats::decoded::{damaged, eight};

/// Indices into a palette. The decoder reads no palettes; told that the indices are gray, it reads those.
pub(super) fn decode(source: &SourceImage, mut bytes: Vec<u8>, page: FirstPage, bits: u8) -> Result<Photograph> {
    let failed = |error: TiffError| damaged(source, error);
    let colors = open(source, page, &mut Cursor::new(&bytes))?.get_tag_u16_vec(Tag::ColorMap).map_err(failed)?;
    let count = 1_usize << bits;
    if colors.len() != 3 * count || call_gray(&mut bytes).is_none() {
        return Err(damaged(source, "its palette is not as long as it must be"));
    }
    let mut input = Cursor::new(&bytes);
    let mut decoder = open(source, page, &mut input)?;
    let Samples::Eight(packed) = Samples::read(source, &mut decoder, page)? else {
        return Err(not_as_stated(source));
    };
    // Colors have 16 bits; some programs write 8.
    let small = colors.iter().all(|&color| color <= u16::from(u8::MAX));
    let level = |color: u16| if small { color as u8 } else { ((u32::from(color) + 128) / 257) as u8 };
    let rgb = |index: u8| [0, count, 2 * count].map(|first| level(colors[first + usize::from(index)]));
    let data = match bits {
        8 => packed.iter().flat_map(|&index| rgb(index)).collect(),
        _ => unpacked(&packed, page.width, bits).flat_map(rgb).collect(),
    };
    eight(page.width, page.height, 3, data)
}

/// Sets the photometric interpretation of the first directory of a TIFF to gray; `None` if it has none.
fn call_gray(bytes: &mut [u8]) -> Option<()> {
    let little = bytes.first() == Some(&b'I');
    let number = |bytes: &[u8], at: usize, length: usize| -> Option<usize> {
        let bytes = bytes.get(at..at.checked_add(length)?)?;
        let fold = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        let value = if little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) };
        usize::try_from(value).ok()
    };
    let is_big = number(bytes, 2, 2)? == 43;
    let (start, count_bytes, entry_bytes) =
        if is_big { (number(bytes, 8, 8)?, 8, 20) } else { (number(bytes, 4, 4)?, 2, 12) };
    let count = number(bytes, start, count_bytes)?;
    let wanted = usize::from(Tag::PhotometricInterpretation.to_u16());
    for index in 0..count {
        let entry = start.checked_add(count_bytes)?.checked_add(index.checked_mul(entry_bytes)?)?;
        if number(bytes, entry, 2)? == wanted {
            // The value is the entry's last part, a short in its first bytes.
            let value = entry + if is_big { 12 } else { 8 };
            let gray = PhotometricInterpretation::BlackIsZero.to_u16();
            let gray = if little { gray.to_le_bytes() } else { gray.to_be_bytes() };
            bytes.get_mut(value..value + 2)?.copy_from_slice(&gray);
            return Some(());
        }
    }
    None
}
