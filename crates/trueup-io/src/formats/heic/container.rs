//! Whether a file's boxes tell to copy more than the file holds.
//!
//! An item is put together from pieces of the file, a picture from items, and nothing in the format keeps them from
//! being the same piece over and over: a file of some kilobytes could stand for any number of gigabytes.
//!
//! # Source
//! ISO/IEC 14496-12, sections 8.11.3 (iloc), 8.11.12 (iref) and 8.11.14 (ipco); ISO/IEC 23008-12, section 6.6.2.3
//! (grids).

use std::collections::BTreeMap;

use heic_decoder::{HeifError, Result};

use crate::formats::boxes::{Fields, children};

/// Most bytes that the pieces of one picture may have together for one of the file. Writers share none, or a few flat
/// tiles.
const MOST_COPIES: u64 = 4;

/// What is added to that: parameters of many small tiles.
const FREE_BYTES: u64 = 1 << 20;

/// Refuses a file in which they do.
///
/// What the decoder could not read either is passed over here: it says so in its words.
pub(super) fn check_copies(file: &[u8]) -> Result<()> {
    let most = (file.len() as u64).saturating_mul(MOST_COPIES).saturating_add(FREE_BYTES);
    for meta in children(file, b"meta") {
        let meta = meta.get(4..).unwrap_or_default();
        let mut lengths = BTreeMap::new();
        for list in children(meta, b"iloc") {
            read_lengths(list, &mut lengths);
        }
        let configurations = children(meta, b"iprp").flat_map(|properties| children(properties, b"ipco"));
        let largest = configurations.flat_map(|list| children(list, b"hvcC")).map(<[u8]>::len).max().unwrap_or(0);
        let single = lengths.values().copied().max().unwrap_or(0);
        let grids = children(meta, b"iref").map(|list| most_of_grids(list, &lengths, largest as u64));
        if grids.fold(single, u64::max) > most {
            return Err(HeifError::LimitExceeded("its pieces are more than the file"));
        }
    }
    Ok(())
}

/// An item of a file.
struct Item {
    number: u64,
    /// Bytes of its pieces together.
    length: u64,
}

/// How the entries of a list of places are made up.
struct PlaceLayout {
    version: u64,
    /// Bytes of their fields.
    offset_bytes: usize,
    length_bytes: usize,
    base_bytes: usize,
    index_bytes: usize,
}

impl PlaceLayout {
    fn number_bytes(&self) -> usize {
        if self.version < 2 { 2 } else { 4 }
    }

    fn has_index(&self) -> bool {
        matches!(self.version, 1 | 2)
    }

    /// The next entry.
    fn item(&self, fields: &mut Fields<'_>) -> Option<Item> {
        let number = fields.number(self.number_bytes())?;
        if self.has_index() {
            fields.number(2)?;
        }
        fields.number(2)?;
        fields.number(self.base_bytes)?;
        let pieces = fields.number(2)?;
        // Pieces without fields of their own would be all the same, and cost the file nothing: there can be any number
        // of them.
        if pieces > 1 && self.offset_bytes + self.length_bytes == 0 {
            return Some(Item { number, length: u64::MAX });
        }
        let mut length = 0_u64;
        for _ in 0..pieces {
            fields.number(self.index_bytes)?;
            fields.number(self.offset_bytes)?;
            length = length.saturating_add(fields.number(self.length_bytes)?);
        }
        Some(Item { number, length })
    }
}

/// Notes the length of every item that a list of places tells.
fn read_lengths(list: &[u8], lengths: &mut BTreeMap<u64, u64>) {
    let mut fields = Fields(list);
    let mut items = || -> Option<()> {
        let version = fields.number(1)?;
        fields.number(3)?;
        let sizes = fields.number(2)? as usize;
        let mut layout = PlaceLayout {
            version,
            offset_bytes: sizes >> 12 & 15,
            length_bytes: sizes >> 8 & 15,
            base_bytes: sizes >> 4 & 15,
            index_bytes: sizes & 15,
        };
        if !layout.has_index() {
            layout.index_bytes = 0;
        }
        for _ in 0..fields.number(layout.number_bytes())? {
            let Item { number, length } = layout.item(&mut fields)?;
            let known = lengths.entry(number).or_default();
            *known = length.max(*known);
        }
        Some(())
    };
    // What is cut off names no more items.
    items();
}

/// Bytes of the largest picture that is put together from others, each with parameters of so many bytes.
fn most_of_grids(list: &[u8], lengths: &BTreeMap<u64, u64>, parameter_bytes: u64) -> u64 {
    let (Some(version), Some(references)) = (list.first(), list.get(4..)) else { return 0 };
    let number_bytes = if *version == 0 { 2 } else { 4 };
    let mut most = 0;
    for content in children(references, b"dimg") {
        let mut fields = Fields(content);
        while let (Some(_), Some(count)) = (fields.number(number_bytes), fields.number(2)) {
            let tiles = (0..count).map_while(|_| fields.number(number_bytes));
            let bytes = |tile| lengths.get(&tile).copied().unwrap_or(0).saturating_add(parameter_bytes);
            most = tiles.map(bytes).fold(0, u64::saturating_add).max(most);
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    fn media_box(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
        [&(content.len() as u32 + 8).to_be_bytes()[..], kind, content].concat()
    }

    /// A file of 1000 bytes of pixels, one item with as many pieces of all of them, and a grid that has this as so many
    /// tiles.
    fn file(pieces: u16, tiles: u16) -> Vec<u8> {
        let mut places = vec![0, 0, 0, 0, 0x44, 0, 0, 1, 0, 7, 0, 0];
        places.extend(pieces.to_be_bytes());
        places.extend([0, 0, 0, 9, 0, 0, 3, 0xe8].repeat(usize::from(pieces)));
        let grid = [&[0, 8][..], &tiles.to_be_bytes(), &[0, 7].repeat(usize::from(tiles))].concat();
        let references = [vec![0; 4], media_box(b"cdsc", b"?"), media_box(b"dimg", &grid)].concat();
        let properties = media_box(b"ipco", &[media_box(b"ispe", b"?"), media_box(b"hvcC", &[0; 90])].concat());
        let boxes =
            [vec![0; 4], media_box(b"iloc", &places), media_box(b"iprp", &properties), media_box(b"iref", &references)];
        [media_box(b"ftyp", b"heic"), media_box(b"meta", &boxes.concat()), media_box(b"mdat", &[0; 1000])].concat()
    }

    #[test]
    fn what_is_copied_is_in_proportion_to_the_file() {
        assert!(check_copies(&file(1, 1)).is_ok());
        assert!(check_copies(&file(3, 48)).is_ok());
        // Each of them once and again stands for more than a file of 11 kB or 85 kB and a megabyte.
        assert!(check_copies(&file(1, 2000)).is_err());
        assert!(check_copies(&file(10_000, 1)).is_err());
    }

    /// Ten bytes an entry, each with 65,535 pieces: such a file of ten megabytes would take hours.
    #[test]
    fn pieces_that_cost_the_file_nothing_are_refused() {
        let listed = |pieces: u16| {
            let entry = [&[0, 7, 0, 0][..], &pieces.to_be_bytes()].concat();
            let places = [&[0, 0, 0, 0, 0, 0, 0, 3][..], &entry.repeat(3)].concat();
            let boxes = [vec![0; 4], media_box(b"iloc", &places)].concat();
            [media_box(b"ftyp", b"heic"), media_box(b"meta", &boxes)].concat()
        };
        assert!(check_copies(&listed(1)).is_ok());
        assert!(check_copies(&listed(u16::MAX)).is_err());
    }

    #[test]
    fn what_is_cut_off_is_left_to_the_decoder() {
        let whole = file(10_000, 3);
        for end in (0..whole.len()).step_by(997) {
            // Nothing to be said, but no panic.
            let _ = check_copies(&whole[..end]);
        }
        assert!(check_copies(b"").is_ok());
        assert!(check_copies(b"\0\0\0\x01meta\xff\xff\xff\xff\xff\xff\xff\xff").is_ok());
        assert!(check_copies(b"\0\0\0\0meta\0\0\0\0\0\0\0\x04iloc").is_ok());
    }
}
