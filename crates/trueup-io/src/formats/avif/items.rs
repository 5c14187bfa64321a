//! The items of a file: which there are, where their bytes lie, what is said of them, and how they refer to each other.
//!
//! Nothing is copied here; what is made of a file is in proportion to its bytes.
//!
//! # Source
//! ISO/IEC 14496-12, sections 8.11.3 (iloc), 8.11.4 (pitm), 8.11.6 (iinf), 8.11.11 (idat), 8.11.12 (iref) and 8.11.14
//! (iprp).

use std::collections::BTreeMap;
use std::ops::Range;

use crate::formats::boxes::{Fields, all_children, children};

/// Most pieces of an item; writers make one, or one for each step in which a picture gets finer.
const MOST_PIECES: u64 = 1024;

/// Bytes before what a box that has a version holds: the version, and flags.
const VERSION_BYTES: usize = 4;

/// Where `iloc` says that offsets are counted from.
const FROM_FILE: u64 = 0;
const FROM_ITEM_DATA: u64 = 1;

/// The items of a file.
#[derive(Debug, Default)]
pub(super) struct Items<'a> {
    file: &'a [u8],
    /// What is stored among the items themselves.
    item_data: &'a [u8],
    pub(super) primary: u64,
    kinds: BTreeMap<u64, [u8; 4]>,
    places: BTreeMap<u64, Place>,
    /// What is said of items, each with its kind.
    properties: Vec<([u8; 4], &'a [u8])>,
    /// Of an item, the numbers of its properties, from 1, and whether it cannot be shown without heeding them.
    associations: BTreeMap<u64, Vec<(usize, bool)>>,
    references: Vec<Reference>,
}

/// Where the bytes of an item lie.
#[derive(Debug)]
struct Place {
    counted_from: u64,
    pieces: Vec<Range<u64>>,
}

/// What an item refers to, in which sense.
#[derive(Debug)]
struct Reference {
    kind: [u8; 4],
    from: u64,
    to: Vec<u64>,
}

impl<'a> Items<'a> {
    /// Those of a file; `None` if it has no list of items that can be read.
    pub(super) fn of(file: &'a [u8]) -> Option<Self> {
        let meta = children(file, b"meta").next()?.get(VERSION_BYTES..)?;
        let mut items = Self { file, ..Self::default() };
        for (kind, content) in all_children(meta) {
            match &kind {
                b"pitm" => items.primary = primary(content)?,
                b"iinf" => items.kinds = kinds(content)?,
                b"iloc" => items.places = places(content)?,
                b"idat" => items.item_data = content,
                b"iref" => items.references = references(content)?,
                b"iprp" => {
                    items.properties = children(content, b"ipco").flat_map(all_children).collect();
                    for list in children(content, b"ipma") {
                        associate(list, &mut items.associations)?;
                    }
                }
                _ => {}
            }
        }
        Some(items)
    }

    /// What an item is.
    pub(super) fn kind(&self, item: u64) -> Option<[u8; 4]> {
        self.kinds.get(&item).copied()
    }

    /// The properties of an item in their order, each with its kind and whether the item cannot be shown without
    /// heeding it.
    pub(super) fn properties(&self, item: u64) -> impl Iterator<Item = ([u8; 4], &'a [u8], bool)> {
        let numbers = self.associations.get(&item).map(Vec::as_slice).unwrap_or_default();
        numbers.iter().filter_map(|&(number, is_essential)| {
            let (kind, content) = *self.properties.get(number.checked_sub(1)?)?;
            Some((kind, content, is_essential))
        })
    }

    /// The first property of this kind that an item has.
    pub(super) fn property(&self, item: u64, wanted: &[u8; 4]) -> Option<&'a [u8]> {
        self.properties(item).find(|(kind, ..)| kind == wanted).map(|(_, content, _)| content)
    }

    /// What an item refers to in this sense; nothing if to none.
    pub(super) fn referred_by(&self, from: u64, wanted: &[u8; 4]) -> &[u64] {
        let found = self.references.iter().find(|one| one.kind == *wanted && one.from == from);
        found.map(|one| one.to.as_slice()).unwrap_or_default()
    }

    /// The items that refer to an item in this sense.
    pub(super) fn referring_to(&self, to: u64, wanted: &[u8; 4]) -> impl Iterator<Item = u64> {
        self.references.iter().filter(move |one| one.kind == *wanted && one.to.contains(&to)).map(|one| one.from)
    }

    /// The bytes of an item, put together from its pieces; `None` if they are not in the file, or more than the file.
    pub(super) fn bytes(&self, item: u64) -> Option<Vec<u8>> {
        let place = self.places.get(&item)?;
        let source = match place.counted_from {
            FROM_FILE => self.file,
            FROM_ITEM_DATA => self.item_data,
            _ => return None,
        };
        let mut bytes = Vec::new();
        for piece in &place.pieces {
            let start = usize::try_from(piece.start).ok()?;
            let end = if piece.is_empty() { source.len() } else { usize::try_from(piece.end).ok()? };
            let piece = source.get(start..end)?;
            if piece.len() > self.file.len().saturating_sub(bytes.len()) {
                return None;
            }
            bytes.extend_from_slice(piece);
        }
        Some(bytes)
    }
}

/// The version of a box, its flags, and what follows.
fn versioned(content: &[u8]) -> Option<(u64, u64, Fields<'_>)> {
    let mut fields = Fields(content);
    Some((fields.number(1)?, fields.number(3)?, fields))
}

/// Bytes of a number that grew from 16 to 32 bits with this version.
fn number_bytes(version: u64, grown_in: u64) -> usize {
    if version < grown_in { 2 } else { 4 }
}

fn primary(content: &[u8]) -> Option<u64> {
    let (version, _, mut fields) = versioned(content)?;
    fields.number(number_bytes(version, 1))
}

fn kinds(content: &[u8]) -> Option<BTreeMap<u64, [u8; 4]>> {
    let (version, _, mut fields) = versioned(content)?;
    fields.number(number_bytes(version, 1))?;
    let kind = |entry| -> Option<(u64, [u8; 4])> {
        let (version, _, mut fields) = versioned(entry)?;
        let item = fields.number(number_bytes(version, 3))?;
        fields.number(2)?;
        Some((item, (fields.number(4)? as u32).to_be_bytes()))
    };
    Some(children(fields.0, b"infe").filter_map(kind).collect())
}

fn places(content: &[u8]) -> Option<BTreeMap<u64, Place>> {
    let (version, _, mut fields) = versioned(content)?;
    let sizes = fields.number(2)? as usize;
    let [offset_bytes, length_bytes, base_bytes, index_bytes] = [12, 8, 4, 0].map(|shift| sizes >> shift & 15);
    let has_origin = matches!(version, 1 | 2);
    let index_bytes = if has_origin { index_bytes } else { 0 };
    if [offset_bytes, length_bytes, base_bytes, index_bytes].iter().any(|bytes| ![0, 4, 8].contains(bytes)) {
        return None;
    }
    let count = fields.number(number_bytes(version, 2))?;
    let mut places = BTreeMap::new();
    for _ in 0..count {
        let item = fields.number(number_bytes(version, 2))?;
        let counted_from = if has_origin { fields.number(2)? & 15 } else { FROM_FILE };
        fields.number(2)?;
        let base = fields.number(base_bytes)?;
        let count = fields.number(2)?;
        // Pieces without fields of their own would be all the same, and cost the file nothing.
        if count > MOST_PIECES || (count > 1 && offset_bytes + length_bytes == 0) {
            return None;
        }
        let mut pieces = Vec::new();
        for _ in 0..count {
            fields.number(index_bytes)?;
            let start = base.checked_add(fields.number(offset_bytes)?)?;
            // A length of 0 is that up to the end.
            pieces.push(start..start.checked_add(fields.number(length_bytes)?)?);
        }
        places.insert(item, Place { counted_from, pieces });
    }
    Some(places)
}

fn associate(content: &[u8], associations: &mut BTreeMap<u64, Vec<(usize, bool)>>) -> Option<()> {
    let (version, flags, mut fields) = versioned(content)?;
    let index_bytes = if flags & 1 == 0 { 1 } else { 2 };
    let essential = 1 << (8 * index_bytes - 1);
    for _ in 0..fields.number(4)? {
        let item = fields.number(number_bytes(version, 1))?;
        let own: &mut Vec<(usize, bool)> = associations.entry(item).or_default();
        for _ in 0..fields.number(1)? {
            let index = fields.number(index_bytes)?;
            own.push(((index & (essential - 1)) as usize, index & essential != 0));
        }
    }
    Some(())
}

fn references(content: &[u8]) -> Option<Vec<Reference>> {
    let (version, _, fields) = versioned(content)?;
    let number_bytes = number_bytes(version, 1);
    let reference = |(kind, content)| {
        let mut fields = Fields(content);
        let from = fields.number(number_bytes)?;
        let count = fields.number(2)?;
        let to: Option<Vec<u64>> = (0..count).map(|_| fields.number(number_bytes)).collect();
        Some(Reference { kind, from, to: to? })
    };
    Some(all_children(fields.0).filter_map(reference).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn media_box(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
        [&(content.len() as u32 + 8).to_be_bytes()[..], kind, content].concat()
    }

    /// A file whose item 7 has these pieces, each of an offset and a length, counted from the file or from the items'
    /// own data.
    fn file(counted_from: u8, pieces: &[[u32; 2]]) -> Vec<u8> {
        let mut list = vec![1, 0, 0, 0, 0x44, 0, 0, 1, 0, 7, 0, counted_from, 0, 0];
        list.extend((pieces.len() as u16).to_be_bytes());
        list.extend(pieces.iter().flatten().flat_map(|number| number.to_be_bytes()));
        let entry = media_box(b"infe", b"\x02\0\0\0\0\x07\0\0av01name\0");
        let properties = media_box(b"ipco", &[media_box(b"ispe", b"size"), media_box(b"av1C", b"form")].concat());
        let associated = media_box(b"ipma", &[0, 0, 0, 0, 0, 0, 0, 1, 0, 7, 3, 0x82, 0x01, 9]);
        let boxes = [
            vec![0; 4],
            media_box(b"pitm", &[0, 0, 0, 0, 0, 7]),
            media_box(b"iinf", &[&[0, 0, 0, 0, 0, 1][..], &entry].concat()),
            media_box(b"iloc", &list),
            media_box(b"idat", b"0123456789"),
            media_box(b"iref", &[&[0; 4][..], &media_box(b"auxl", &[0, 8, 0, 1, 0, 7])].concat()),
            media_box(b"iprp", &[properties, associated].concat()),
        ];
        [media_box(b"ftyp", b"avif"), media_box(b"meta", &boxes.concat())].concat()
    }

    #[test]
    fn items_are_found_with_what_is_said_of_them() {
        let bytes = file(1, &[[2, 3], [8, 1]]);
        let items = Items::of(&bytes).expect("items");
        assert_eq!((items.primary, items.kind(7), items.kind(8)), (7, Some(*b"av01"), None));
        assert_eq!(items.bytes(7).as_deref(), Some(&b"2348"[..]));
        let properties: Vec<_> = items.properties(7).collect();
        // The third leads nowhere.
        assert_eq!(properties, [(*b"av1C", &b"form"[..], true), (*b"ispe", &b"size"[..], false)]);
        assert_eq!(items.property(7, b"ispe"), Some(&b"size"[..]));
        assert_eq!(items.referring_to(7, b"auxl").collect::<Vec<_>>(), [8]);
        assert_eq!((items.referred_by(8, b"auxl"), items.referred_by(7, b"auxl")), (&[7][..], &[][..]));
        assert_eq!(Items::of(&file(0, &[[4, 4]])).and_then(|items| items.bytes(7)).as_deref(), Some(&b"ftyp"[..]));
        assert_eq!(Items::of(&file(1, &[[7, 0]])).and_then(|items| items.bytes(7)).as_deref(), Some(&b"789"[..]));
    }

    #[test]
    fn no_item_is_more_than_its_file() {
        for (counted_from, pieces) in
            [(1, &[[2, 9]][..]), (1, &[[11, 1]]), (1, &[[u32::MAX, u32::MAX]]), (0, &[[0, 200]; 60])]
        {
            assert_eq!(Items::of(&file(counted_from, pieces)).expect("items").bytes(7), None, "{pieces:?}");
        }
        assert!(Items::of(&file(1, &[[0, 1]; MOST_PIECES as usize + 1])).is_none());
    }

    #[test]
    fn what_is_cut_off_is_no_list_or_a_shorter_one() {
        let whole = file(1, &[[2, 3], [8, 1]]);
        for end in 0..whole.len() {
            // Nothing to be said, but no panic.
            let _ = Items::of(&whole[..end]).and_then(|items| items.bytes(7));
        }
        assert!(Items::of(b"").is_none());
    }
}
