//! The boxes that files of the ISO base media family are made of.
//!
//! # Source
//! ISO/IEC 14496-12, section 4.2: 32 bits of length, four letters of kind, and 64 bits of length where the 32 say 1. A
//! length of 0 is that up to the end of the file.

use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;

use trueup_core::memory::check_room;

use crate::format::Input;

/// Boxes that are looked at; pictures have a few dozen.
const MOST_BOXES: usize = 4096;

/// All of a file, of which decoders of its boxes take no less; `purpose` is what memory is asked for, for messages.
///
/// # Errors
/// If there is no room for it, or it cannot be read.
pub(super) fn contents(input: &mut Input, purpose: &'static str) -> io::Result<Vec<u8>> {
    let length = usize::try_from(input.get_ref().metadata()?.len()).unwrap_or(usize::MAX);
    check_room(purpose, length).map_err(|error| io::Error::other(error.to_string()))?;
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// One box.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MediaBox {
    pub(super) kind: [u8; 4],
    /// Where its content lies in the file.
    pub(super) content: Range<u64>,
}

/// The boxes that a file is made of, in order.
///
/// # Errors
/// If the file cannot be read, or a box reaches beyond its end.
pub(super) fn boxes(input: &mut (impl Read + Seek)) -> io::Result<Vec<MediaBox>> {
    let end = input.seek(SeekFrom::End(0))?;
    let mut found = Vec::new();
    let mut place = 0;
    while place < end {
        if found.len() == MOST_BOXES {
            return Err(damaged("it has too many boxes"));
        }
        input.seek(SeekFrom::Start(place))?;
        let one = read_box(input, place, end)?;
        place = one.content.end;
        found.push(one);
    }
    Ok(found)
}

fn read_box(input: &mut impl Read, place: u64, end: u64) -> io::Result<MediaBox> {
    let mut head = [0; 8];
    input.read_exact(&mut head)?;
    let [a, b, c, d, kind @ ..] = head;
    let (length, head_bytes) = match u32::from_be_bytes([a, b, c, d]) {
        0 => (end - place, 8),
        1 => {
            let mut long = [0; 8];
            input.read_exact(&mut long)?;
            (u64::from_be_bytes(long), 16)
        }
        length => (u64::from(length), 8),
    };
    let content_end = place.checked_add(length).filter(|&content_end| length >= head_bytes && content_end <= end);
    let content_end = content_end.ok_or_else(|| damaged("a box reaches beyond its end"))?;
    Ok(MediaBox { kind, content: place + head_bytes..content_end })
}

/// The contents of the boxes of this kind among those that follow each other in `bytes`, up to the first that is none.
pub(super) fn children<'a>(bytes: &'a [u8], wanted: &'static [u8; 4]) -> impl Iterator<Item = &'a [u8]> {
    all_children(bytes).filter(move |(kind, _)| kind == wanted).map(|(_, content)| content)
}

/// The kinds and contents of the boxes that follow each other in `bytes`, up to the first that is none.
pub(super) fn all_children(bytes: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = bytes;
    std::iter::from_fn(move || next_box(&mut rest))
}

fn next_box<'a>(rest: &mut &'a [u8]) -> Option<([u8; 4], &'a [u8])> {
    let bytes: &'a [u8] = rest;
    let mut reader = Fields(bytes);
    let short = reader.number(4)?;
    let kind = (reader.number(4)? as u32).to_be_bytes();
    let length = match short {
        0 => bytes.len() as u64,
        1 => reader.number(8)?,
        length => length,
    };
    let head = bytes.len() - reader.0.len();
    let end = usize::try_from(length).unwrap_or(usize::MAX).min(bytes.len());
    let content = bytes.get(head..end)?;
    *rest = &bytes[end..];
    Some((kind, content))
}

/// Fields of a box that are still to be read.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl Fields<'_> {
    /// A number of so many bytes, at most 8; none are 0.
    pub(super) fn number(&mut self, bytes: usize) -> Option<u64> {
        let (field, rest) = self.0.split_at_checked(bytes)?;
        self.0 = rest;
        Some(field.iter().fold(0, |number, &byte| number << 8 | u64::from(byte)))
    }
}

fn damaged(words: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, words)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn all_three_ways_to_say_a_length_are_understood() {
        let mut bytes = b"\0\0\0\x0aabcd12".to_vec();
        bytes.extend(b"\0\0\0\x01long\0\0\0\0\0\0\0\x13345");
        bytes.extend(b"\0\0\0\0rest6789");
        let found = boxes(&mut Cursor::new(&bytes)).expect("three boxes");
        let content: Vec<&[u8]> =
            found.iter().map(|one| &bytes[one.content.start as usize..one.content.end as usize]).collect();
        assert_eq!(content, [&b"12"[..], b"345", b"6789"]);
        assert_eq!(found.iter().map(|one| one.kind).collect::<Vec<_>>(), [*b"abcd", *b"long", *b"rest"]);
    }

    #[test]
    fn lengths_that_cannot_be_are_refused() {
        for bytes in
            [&b"\0\0\0\x07abcd"[..], b"\0\0\0\x09abcd", b"\0\0\0\x01abcd\xff\xff\xff\xff\xff\xff\xff\xff", b"\0\0\0"]
        {
            assert!(boxes(&mut Cursor::new(bytes)).is_err(), "{bytes:?}");
        }
        assert!(boxes(&mut Cursor::new(b"\0\0\0\x08abcd".repeat(MOST_BOXES + 1))).is_err());
        assert!(boxes(&mut Cursor::new(b"")).expect("nothing").is_empty());
    }
}
