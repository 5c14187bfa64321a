//! Texts that cannot be, kept from the decoder: it would take memory for them, or print a line when they are too long
//! for it.
//!
//! # Source
//! TIFF 6.0, section 2 ("readers should skip over fields containing an unexpected field type"), and BigTIFF.

use std::io::{self, Read, Seek, SeekFrom};

/// What a decoder reads from.
pub(super) trait TiffInput: Read + Seek {}

impl<R: Read + Seek> TiffInput for R {}

/// Longest text that is read, in bytes; longer ones count as absent.
const MOST_TEXT_BYTES: u64 = 1 << 20;

/// Directories that are looked into, and most fields of one: as many as can be read of a picture here.
const MOST_DIRECTORIES: usize = 32;
const MOST_FIELDS: u64 = 1 << 12;

/// The type of texts, those of numbers that tell where a directory is, and one that is no type.
const TEXT: u64 = 2;
const POINTERS: [u64; 4] = [4, 13, 16, 18];
const NO_TYPE: u8 = 0xff;

/// Tags of directories below another: SubIFDs, and those of EXIF and place (EXIF 3.0, section 4.6.3).
const BELOW: [u64; 3] = [330, 34_665, 34_853];

/// A file in which texts that cannot be are of a type that is none.
pub(super) struct WithoutAbsurdTexts<'a> {
    input: &'a mut dyn TiffInput,
    place: u64,
    /// Where the two bytes of the types of such fields lie.
    hidden: Vec<u64>,
}

impl<'a> WithoutAbsurdTexts<'a> {
    /// Looks for them, and goes back to the start. What cannot be read is left to the decoder.
    pub(super) fn of(input: &'a mut dyn TiffInput) -> io::Result<Self> {
        let length = input.seek(SeekFrom::End(0))?;
        let mut hidden = Vec::new();
        if let Some(mut walk) = Walk::of(input) {
            let mut next = 0;
            while let Some(&directory) = walk.directories.get(next).filter(|_| next < MOST_DIRECTORIES) {
                walk.look(directory, MOST_TEXT_BYTES.min(length), &mut hidden);
                next += 1;
            }
        }
        input.rewind()?;
        Ok(Self { input, place: 0, hidden })
    }
}

impl Read for WithoutAbsurdTexts<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.input.read(buffer)?;
        for byte in self.hidden.iter().flat_map(|&place| [place, place + 1]) {
            let at = byte.checked_sub(self.place).and_then(|at| usize::try_from(at).ok());
            if let Some(byte) = at.and_then(|at| buffer[..count].get_mut(at)) {
                *byte = NO_TYPE;
            }
        }
        self.place += count as u64;
        Ok(count)
    }
}

impl Seek for WithoutAbsurdTexts<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.place = self.input.seek(to)?;
        Ok(self.place)
    }
}

/// A way through the directories of a file.
struct Walk<'a> {
    input: &'a mut dyn TiffInput,
    is_little: bool,
    is_big: bool,
    directories: Vec<u64>,
}

impl<'a> Walk<'a> {
    fn of(input: &'a mut dyn TiffInput) -> Option<Self> {
        let mut start = [0; 4];
        input.rewind().ok()?;
        input.read_exact(&mut start).ok()?;
        let (is_little, is_big) = match start {
            [b'I', b'I', version, 0] => (true, version == 43),
            [b'M', b'M', 0, version] => (false, version == 43),
            _ => return None,
        };
        let mut walk = Self { input, is_little, is_big, directories: Vec::new() };
        let first = if is_big { walk.number_at(8, 8)? } else { walk.number_at(4, 4)? };
        walk.directories.push(first);
        Some(walk)
    }

    fn number_at(&mut self, place: u64, bytes: usize) -> Option<u64> {
        let mut found = [0; 8];
        self.input.seek(SeekFrom::Start(place)).ok()?;
        self.input.read_exact(&mut found[..bytes]).ok()?;
        Some(self.number(&found[..bytes]))
    }

    fn number(&self, bytes: &[u8]) -> u64 {
        let join = |number: u64, &byte: &u8| number << 8 | u64::from(byte);
        if self.is_little { bytes.iter().rev().fold(0, join) } else { bytes.iter().fold(0, join) }
    }

    /// Notes the texts of a directory that are longer than `most`, and the directories it points to.
    fn look(&mut self, directory: u64, most: u64, hidden: &mut Vec<u64>) -> Option<()> {
        let (count_bytes, field_bytes, number_bytes) = if self.is_big { (8, 20, 8) } else { (2, 12, 4) };
        let count = self.number_at(directory, count_bytes)?.min(MOST_FIELDS);
        let start = directory.checked_add(count_bytes as u64)?;
        let mut fields = Vec::new();
        self.input.seek(SeekFrom::Start(start)).ok()?;
        self.input.take(count * field_bytes).read_to_end(&mut fields).ok()?;
        for (at, field) in fields.chunks_exact(field_bytes as usize).enumerate() {
            let (tag, kind) = (self.number(&field[..2]), self.number(&field[2..4]));
            let (count, value) = (self.number(&field[4..4 + number_bytes]), &field[4 + number_bytes..]);
            if kind == TEXT && count > most {
                hidden.push(start + at as u64 * field_bytes + 2);
            } else if BELOW.contains(&tag) && POINTERS.contains(&kind) {
                let pointer_bytes = if kind >= 16 { 8 } else { 4 };
                if count.saturating_mul(pointer_bytes) <= number_bytes as u64 {
                    let all = value.chunks_exact(pointer_bytes as usize).take(count as usize);
                    let all: Vec<u64> = all.map(|pointer| self.number(pointer)).collect();
                    self.directories.extend(all);
                } else {
                    let list = self.number(value);
                    for one in 0..count.min(MOST_DIRECTORIES as u64) {
                        let pointer = self.number_at(list.checked_add(one * pointer_bytes)?, pointer_bytes as usize)?;
                        self.directories.push(pointer);
                    }
                }
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// A TIFF of a directory whose field points to a second one; each has a text of `count` bytes.
    fn file(is_big: bool, count: u64) -> Vec<u8> {
        let mut bytes =
            if is_big { b"II\x2b\0\x08\0\0\0\x10\0\0\0\0\0\0\0".to_vec() } else { b"II*\0\x08\0\0\0".to_vec() };
        let number = |value: u64| value.to_le_bytes()[..if is_big { 8 } else { 4 }].to_vec();
        let field = |tag: u16, kind: u16, count: u64, value: u64| {
            [tag.to_le_bytes().to_vec(), kind.to_le_bytes().to_vec(), number(count), number(value)].concat()
        };
        let fields = |fields: &[Vec<u8>]| {
            let count = (fields.len() as u64).to_le_bytes()[..if is_big { 8 } else { 2 }].to_vec();
            [count, fields.concat(), number(0)].concat()
        };
        let text = || field(305, 2, count, 0);
        let second = bytes.len() + fields(&[text(), text()]).len();
        bytes.extend(fields(&[text(), field(34_665, 4, 1, second as u64)]));
        bytes.extend(fields(&[text()]));
        bytes
    }

    #[test]
    fn texts_that_cannot_be_are_of_no_type() {
        for is_big in [false, true] {
            for (count, hidden) in [(20, 0), (1 << 31, 2), (u64::from(u32::MAX), 2)] {
                let bytes = file(is_big, count);
                let mut input = Cursor::new(&bytes);
                let mut mended = WithoutAbsurdTexts::of(&mut input).expect("readable");
                assert_eq!(mended.hidden.len(), hidden, "{is_big} {count}");
                let mut whole = Vec::new();
                mended.read_to_end(&mut whole).expect("readable");
                let changed: Vec<usize> = (0..bytes.len()).filter(|&at| whole[at] != bytes[at]).collect();
                assert!(changed.len() == 2 * hidden && changed.iter().all(|&at| whole[at] == NO_TYPE));
                // The same byte by byte, from anywhere.
                for &at in &changed {
                    let mut byte = [0];
                    mended.seek(SeekFrom::Start(at as u64)).expect("a place");
                    mended.read_exact(&mut byte).expect("readable");
                    assert_eq!(byte, [NO_TYPE]);
                }
            }
        }
    }

    #[test]
    fn directories_that_lead_in_circles_or_nowhere_are_left_to_the_decoder() {
        let mut circle = file(false, 1 << 31);
        let pointer = 8 + 2 + 12 + 8;
        circle[pointer..pointer + 4].copy_from_slice(&8_u32.to_le_bytes());
        let whole = file(true, 1 << 31);
        for bytes in (0..whole.len()).map(|end| whole[..end].to_vec()).chain([circle]) {
            let mut input = Cursor::new(&bytes);
            let mut mended = WithoutAbsurdTexts::of(&mut input).expect("readable");
            assert_eq!(mended.read_to_end(&mut Vec::new()).expect("readable"), bytes.len());
        }
    }
}
