//! What a JPEG XL file holds: the codestream, in one piece or in several, and EXIF.
//!
//! # Source
//! ISO/IEC 18181-2, section 9: the boxes `jxlc`, `jxlp`, `Exif` and `brob`.

use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;

use brotli_decompressor::Decompressor;

use super::CODESTREAM_START;
use crate::formats::boxes::{MediaBox, boxes};

/// Bytes before a part of the codestream: its number.
const PART_NUMBER_BYTES: u64 = 4;

/// Bytes before EXIF: where within the box the TIFF structure begins, counted from behind them.
const EXIF_OFFSET_BYTES: usize = 4;

/// Most bytes of EXIF that are read. Compressed, a file of a few bytes may claim any number.
const MOST_EXIF_BYTES: u64 = 16 << 20;

/// Bytes that the decompressor reads at a time.
const PIECE_BYTES: usize = 4096;

/// The codestream of a file, read piece by piece.
pub(super) struct Codestream<'a, R> {
    input: &'a mut R,
    /// Where what is still to be read lies, the last first.
    parts: Vec<Range<u64>>,
}

impl<'a, R: Read + Seek> Codestream<'a, R> {
    /// Finds it.
    pub(super) fn of(input: &'a mut R) -> io::Result<Self> {
        let mut start = Vec::new();
        input.rewind()?;
        input.by_ref().take(CODESTREAM_START.len() as u64).read_to_end(&mut start)?;
        if start == CODESTREAM_START {
            let end = input.seek(SeekFrom::End(0))?;
            return Ok(Self { input, parts: std::iter::once(0..end).collect() });
        }
        let part = |MediaBox { kind, content }: MediaBox| match &kind {
            b"jxlc" => Some(content),
            b"jxlp" => Some((content.start + PART_NUMBER_BYTES).min(content.end)..content.end),
            _ => None,
        };
        let mut parts: Vec<Range<u64>> = boxes(input)?.into_iter().filter_map(part).collect();
        parts.reverse();
        Ok(Self { input, parts })
    }
}

impl<R: Read + Seek> Read for Codestream<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.parts.last().is_some_and(Range::is_empty) {
            self.parts.pop();
        }
        let Some(part) = self.parts.last_mut() else { return Ok(0) };
        let most = usize::try_from(part.end - part.start).unwrap_or(usize::MAX).min(buffer.len());
        self.input.seek(SeekFrom::Start(part.start))?;
        let count = self.input.read(&mut buffer[..most])?;
        if count == 0 && most > 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        part.start += count as u64;
        Ok(count)
    }
}

/// The EXIF block of a file, from its byte order mark on; `None` if there is none, or none of a believable length.
pub(super) fn exif(input: &mut (impl Read + Seek)) -> Option<Vec<u8>> {
    let found = boxes(input).ok()?;
    for MediaBox { kind, content } in found {
        let length = content.end - content.start;
        input.seek(SeekFrom::Start(content.start)).ok()?;
        let mut content = input.by_ref().take(length);
        let block = match &kind {
            b"Exif" => within_limit(content),
            b"brob" => {
                let mut inner = [0; 4];
                content.read_exact(&mut inner).ok()?;
                if inner != *b"Exif" {
                    continue;
                }
                within_limit(Decompressor::new(content, PIECE_BYTES))
            }
            _ => continue,
        }?;
        let offset = block.first_chunk::<EXIF_OFFSET_BYTES>()?;
        let start = (u32::from_be_bytes(*offset) as usize).checked_add(EXIF_OFFSET_BYTES)?;
        return Some(block.get(start..)?.to_vec());
    }
    None
}

/// All that can be read, if it is not too much.
fn within_limit(content: impl Read) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    content.take(MOST_EXIF_BYTES + 1).read_to_end(&mut bytes).ok()?;
    (bytes.len() as u64 <= MOST_EXIF_BYTES).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn media_box(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
        [&(content.len() as u32 + 8).to_be_bytes()[..], kind, content].concat()
    }

    fn codestream(file: &[u8]) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        Codestream::of(&mut Cursor::new(file))?.read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    #[test]
    fn a_codestream_is_the_same_bare_whole_and_in_parts() {
        let bare = b"\xff\x0aabcdefgh".to_vec();
        let start = media_box(b"JXL ", b"\r\n\x87\n");
        let whole = [start.clone(), media_box(b"jxlc", &bare), media_box(b"more", b"?")].concat();
        let parts = [
            start,
            media_box(b"jxlp", b"\0\0\0\0\xff\x0aabc"),
            media_box(b"Exif", b"\0\0\0\0II*\0"),
            media_box(b"jxlp", b"\0\0\0\x01"),
            media_box(b"jxlp", b"\x80\0\0\x02defgh"),
        ]
        .concat();
        for file in [&bare, &whole, &parts] {
            assert_eq!(codestream(file).expect("a codestream"), bare);
        }
        assert_eq!(codestream(b"").expect("nothing"), b"");
    }

    /// The stream of brotli (RFC 7932, section 9) that holds these bytes uncompressed: a window of 16 bits (0), a
    /// metablock that is not the last (0), four nibbles of length (00), the length less one, uncompressed (1); then an
    /// empty last one (11).
    fn brotli(bytes: &[u8]) -> Vec<u8> {
        let head = ((bytes.len() as u32 - 1) << 4) | (1 << 20);
        [&head.to_le_bytes()[..3], bytes, &[3]].concat()
    }

    #[test]
    fn exif_is_found_compressed_and_not() {
        let plain = media_box(b"Exif", b"\0\0\0\x02??II*\0");
        let compressed = media_box(b"brob", &[b"Exif", &brotli(b"\0\0\0\0MM\0*")[..]].concat());
        let other = media_box(b"brob", &[b"xml ", &brotli(b"<x/>")[..]].concat());
        let found = |file: &[u8]| exif(&mut Cursor::new(file));
        assert_eq!(found(&[other.clone(), plain].concat()).as_deref(), Some(&b"II*\0"[..]));
        assert_eq!(found(&[other.clone(), compressed].concat()).as_deref(), Some(&b"MM\0*"[..]));
        assert_eq!(found(&other), None);
        for damaged in [&b"\xff\xff\xff\xff"[..], b"", b"\0\0"] {
            assert_eq!(found(&media_box(b"Exif", damaged)), None);
            assert_eq!(found(&media_box(b"brob", damaged)), None);
        }
    }
}
