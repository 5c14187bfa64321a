//! The numbers of strips and tiles that are not compressed.
//!
//! # Source
//! TIFF 6.0, sections 2 (bits are packed from the most significant on), 3 and 15.

/// `count` numbers of so many bits each, rows beginning at a byte.
pub(super) fn unpacked(
    bytes: &[u8],
    bits: usize,
    row_numbers: usize,
    is_little: bool,
    count: usize,
) -> Option<Vec<u16>> {
    let mut numbers = Vec::with_capacity(count);
    let row_bytes = (row_numbers * bits).div_ceil(8);
    for row in bytes.chunks_exact(row_bytes.max(1)).take(count.div_ceil(row_numbers.max(1))) {
        match bits {
            8 => numbers.extend(row.iter().map(|&byte| u16::from(byte))),
            16 => {
                let ordered = if is_little { u16::from_le_bytes } else { u16::from_be_bytes };
                numbers.extend(row.as_chunks::<2>().0.iter().map(|&pair| ordered(pair)));
            }
            _ => numbers.extend((0..row_numbers).map(|number| packed(row, number * bits, bits))),
        }
    }
    (numbers.len() >= count).then(|| {
        numbers.truncate(count);
        numbers
    })
}

/// The number of so many bits, at most 16, from a bit on.
fn packed(bytes: &[u8], start: usize, bits: usize) -> u16 {
    let byte = |place: usize| u32::from(bytes.get(place).copied().unwrap_or(0));
    let first = start / 8;
    let three = byte(first) << 16 | byte(first + 1) << 8 | byte(first + 2);
    let below = 24 - start % 8 - bits;
    (three >> below & ((1 << bits) - 1)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_unpacked() {
        assert_eq!(unpacked(&[1, 2, 3, 4], 8, 2, true, 4), Some(vec![1, 2, 3, 4]));
        assert_eq!(unpacked(&[1, 2, 3, 4], 16, 2, true, 2), Some(vec![0x201, 0x403]));
        assert_eq!(unpacked(&[1, 2, 3, 4], 16, 2, false, 2), Some(vec![0x102, 0x304]));
        assert_eq!(unpacked(&[0xab, 0xcd, 0xef], 12, 2, true, 2), Some(vec![0xabc, 0xdef]));
        // Three numbers of 10 bits: 11 1111 1111, 00 0000 0001, 10 0000 0000, and two bits to the end of the row.
        assert_eq!(unpacked(&[0xff, 0xc0, 0x18, 0x00], 10, 3, true, 3), Some(vec![1023, 1, 512]));
        // 14 bits across three bytes: 00 0000 0000 0001, 11 1111 1111 1111.
        assert_eq!(unpacked(&[0x00, 0x07, 0xff, 0xf0], 14, 2, false, 2), Some(vec![1, 0x3fff]));
        assert_eq!(unpacked(&[1, 2, 3], 16, 2, true, 2), None);
    }
}
