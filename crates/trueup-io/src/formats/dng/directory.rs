//! The directories of a TIFF, of which those of cameras hold what no library for TIFF knows.
//!
//! # Source
//! TIFF 6.0, section 2.

use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};

/// Most values of a field that are read: offsets of strips of a row each, or a table for every number of 16 bits.
const MOST_VALUES: u64 = 1 << 17;

const ENTRY_BYTES: usize = 12;

/// Where a directory lies, and in which order its numbers' bytes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) offset: u64,
    pub(super) is_little: bool,
}

/// A directory.
#[derive(Debug)]
pub(super) struct Directory {
    is_little: bool,
    entries: BTreeMap<u16, Entry>,
}

/// A field of a directory.
#[derive(Debug)]
struct Entry {
    kind: Kind,
    count: u64,
    /// Where its values lie in the file.
    offset: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Unsigned(usize),
    Signed(usize),
    Ratio,
    SignedRatio,
    Single,
    Double,
}

impl Kind {
    fn of(code: u16) -> Option<Self> {
        Some(match code {
            // Texts and bytes without a type are read as numbers, too.
            1 | 2 | 7 => Self::Unsigned(1),
            3 => Self::Unsigned(2),
            4 | 13 => Self::Unsigned(4),
            5 => Self::Ratio,
            6 => Self::Signed(1),
            8 => Self::Signed(2),
            9 => Self::Signed(4),
            10 => Self::SignedRatio,
            11 => Self::Single,
            12 => Self::Double,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::Unsigned(bytes) | Self::Signed(bytes) => bytes,
            Self::Single => 4,
            Self::Ratio | Self::SignedRatio | Self::Double => 8,
        }
    }

    /// The value of as many bytes, the most significant first.
    fn value(self, bytes: &[u8]) -> f64 {
        let number = |bytes: &[u8]| bytes.iter().fold(0, |number: u64, &byte| number << 8 | u64::from(byte));
        let signed = |bytes: &[u8]| {
            let unused = 64 - 8 * bytes.len() as u32;
            (number(bytes) << unused) as i64 >> unused
        };
        let halves = bytes.split_at(bytes.len() / 2);
        match self {
            Self::Unsigned(_) => number(bytes) as f64,
            Self::Signed(_) => signed(bytes) as f64,
            Self::Ratio => number(halves.0) as f64 / number(halves.1) as f64,
            Self::SignedRatio => signed(halves.0) as f64 / signed(halves.1) as f64,
            Self::Single => f32::from_bits(number(bytes) as u32).into(),
            Self::Double => f64::from_bits(number(bytes)),
        }
    }
}

/// Where the first directory of a file lies; `None` if it is no TIFF, or a BigTIFF.
pub(super) fn first(input: &mut (impl Read + Seek)) -> Option<Place> {
    let mut head = [0; 8];
    input.rewind().ok()?;
    input.read_exact(&mut head).ok()?;
    let [.., a, b, c, d] = head;
    match &head[..4] {
        b"II*\0" => Some(Place { offset: u32::from_le_bytes([a, b, c, d]).into(), is_little: true }),
        b"MM\0*" => Some(Place { offset: u32::from_be_bytes([a, b, c, d]).into(), is_little: false }),
        _ => None,
    }
}

impl Directory {
    /// The directory at a place; `None` if it is not all in the file. Fields of types that TIFF has not are left out.
    pub(super) fn read(input: &mut (impl Read + Seek), place: Place) -> Option<Self> {
        let Place { offset, is_little } = place;
        let mut count = [0; 2];
        input.seek(SeekFrom::Start(offset)).ok()?;
        input.read_exact(&mut count).ok()?;
        let ordered = |bytes: &[u8]| Kind::Unsigned(0).value(&most_significant_first(bytes, is_little)) as u64;
        let mut bytes = vec![0; ordered(&count) as usize * ENTRY_BYTES];
        input.read_exact(&mut bytes).ok()?;
        let mut entries = BTreeMap::new();
        for (number, entry) in bytes.chunks_exact(ENTRY_BYTES).enumerate() {
            let Some(kind) = Kind::of(ordered(&entry[2..4]) as u16) else { continue };
            let count = ordered(&entry[4..8]);
            // Values of up to four bytes lie in the field itself.
            let offset = match count.saturating_mul(kind.bytes() as u64) {
                0..=4 => offset + 2 + (number * ENTRY_BYTES) as u64 + 8,
                _ => ordered(&entry[8..]),
            };
            entries.insert(ordered(&entry[..2]) as u16, Entry { kind, count, offset });
        }
        Some(Self { is_little, entries })
    }

    pub(super) fn has(&self, tag: u16) -> bool {
        self.entries.contains_key(&tag)
    }

    /// The values of a field; `None` if there is no such field, it is not all in the file, or of too many values.
    pub(super) fn values(&self, input: &mut (impl Read + Seek), tag: u16) -> Option<Vec<f64>> {
        let Entry { kind, count, offset } = self.entries.get(&tag)?;
        let count = Some(*count).filter(|&count| count <= MOST_VALUES)? as usize;
        let bytes = self.bytes_at(input, *offset, count * kind.bytes())?;
        let value = |bytes| kind.value(&most_significant_first(bytes, self.is_little && !kind_is_ratio(*kind)));
        let ratio = |bytes: &[u8]| {
            let (upper, lower) = bytes.split_at(4);
            let ordered = [upper, lower].map(|half| most_significant_first(half, self.is_little)).concat();
            kind.value(&ordered)
        };
        Some(
            bytes
                .chunks_exact(kind.bytes())
                .map(|bytes| if kind_is_ratio(*kind) { ratio(bytes) } else { value(bytes) })
                .collect(),
        )
    }

    /// The only value of a field, or the first.
    pub(super) fn value(&self, input: &mut (impl Read + Seek), tag: u16) -> Option<f64> {
        self.values(input, tag)?.first().copied()
    }

    /// A field that has bytes of its own make.
    pub(super) fn bytes(&self, input: &mut (impl Read + Seek), tag: u16, most: usize) -> Option<Vec<u8>> {
        let Entry { kind, count, offset } = self.entries.get(&tag)?;
        let length =
            usize::try_from(count.saturating_mul(kind.bytes() as u64)).ok().filter(|&length| length <= most)?;
        self.bytes_at(input, *offset, length)
    }

    /// The directories that a field points to, at most so many.
    pub(super) fn below(&self, input: &mut (impl Read + Seek), tag: u16, most: usize) -> Vec<Self> {
        let offsets = self.values(input, tag).unwrap_or_default();
        let place = |offset: f64| Place { offset: offset as u64, is_little: self.is_little };
        offsets.into_iter().take(most).filter_map(|offset| Self::read(input, place(offset))).collect()
    }

    pub(super) fn is_little(&self) -> bool {
        self.is_little
    }

    fn bytes_at(&self, input: &mut (impl Read + Seek), offset: u64, length: usize) -> Option<Vec<u8>> {
        input.seek(SeekFrom::Start(offset)).ok()?;
        let mut bytes = Vec::new();
        input.take(length as u64).read_to_end(&mut bytes).ok()?;
        (bytes.len() == length).then_some(bytes)
    }
}

fn kind_is_ratio(kind: Kind) -> bool {
    matches!(kind, Kind::Ratio | Kind::SignedRatio)
}

fn most_significant_first(bytes: &[u8], is_little: bool) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if is_little {
        bytes.reverse();
    }
    bytes
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// A field of a directory: tag, type, number, and four bytes.
    type Field = (u16, u16, u32, [u8; 4]);

    fn file(is_little: bool, fields: &[Field], behind: &[u8]) -> Cursor<Vec<u8>> {
        let ordered = |bytes: &[u8]| most_significant_first(bytes, is_little);
        let mut bytes = if is_little { b"II*\0\x08\0\0\0".to_vec() } else { b"MM\0*\0\0\0\x08".to_vec() };
        bytes.extend(ordered(&(fields.len() as u16).to_be_bytes()));
        for (tag, kind, count, value) in fields {
            bytes.extend(
                [ordered(&tag.to_be_bytes()), ordered(&kind.to_be_bytes()), ordered(&count.to_be_bytes())].concat(),
            );
            bytes.extend(value);
        }
        bytes.extend([0; 4]);
        bytes.extend(behind);
        Cursor::new(bytes)
    }

    fn directory(input: &mut Cursor<Vec<u8>>) -> Directory {
        let place = first(input).expect("a TIFF");
        Directory::read(input, place).expect("a directory")
    }

    #[test]
    fn numbers_of_both_orders_and_every_type_are_read() {
        // Behind a head of 8 bytes, three fields and 6 bytes around them.
        let offset = 8 + 2 + 3 * 12 + 4_u32;
        for is_little in [true, false] {
            let ordered = |bytes: &[u8]| most_significant_first(bytes, is_little);
            let short = [ordered(&7_u16.to_be_bytes()), vec![0; 2]].concat();
            let ratios = [&(-3_i32).to_be_bytes(), &4_i32.to_be_bytes()].map(|half| ordered(half)).concat();
            let double = ordered(&0.1_f64.to_be_bytes());
            let four = |bytes: Vec<u8>| -> [u8; 4] { bytes.try_into().expect("four bytes") };
            let fields = [
                (256, 3, 1, four(short)),
                (300, 10, 1, four(ordered(&offset.to_be_bytes()))),
                (301, 12, 1, four(ordered(&(offset + 8).to_be_bytes()))),
            ];
            let mut input = file(is_little, &fields, &[ratios, double].concat());
            let directory = directory(&mut input);
            assert_eq!(directory.value(&mut input, 256), Some(7.0));
            assert_eq!(directory.value(&mut input, 300), Some(-0.75));
            assert_eq!(directory.value(&mut input, 301), Some(0.1));
            assert!(directory.has(300) && !directory.has(302) && directory.value(&mut input, 302).is_none());
        }
    }

    #[test]
    fn what_is_not_in_the_file_is_no_value() {
        let far = [(300, 4, 2, [0xff; 4]), (301, 4, u32::MAX, [8, 0, 0, 0]), (302, 99, 1, [0; 4])];
        let mut input = file(true, &far, &[]);
        let directory = directory(&mut input);
        for tag in [300, 301, 302] {
            assert_eq!(directory.values(&mut input, tag), None, "{tag}");
        }
        assert!(directory.below(&mut input, 300, 8).is_empty());
        assert_eq!(first(&mut Cursor::new(b"II+\0\x08\0\0\0")), None);
        for end in 0..20 {
            let cut = input.get_ref()[..end].to_vec();
            let place = first(&mut Cursor::new(cut.clone()));
            assert!(place.and_then(|place| Directory::read(&mut Cursor::new(cut), place)).is_none());
        }
    }
}
