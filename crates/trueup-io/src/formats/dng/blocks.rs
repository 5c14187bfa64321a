//! The numbers of strips and tiles.
//!
//! # Source
//! TIFF 6.0, sections 2 (bits are packed from the most significant on), 3 and 15; of lossless JPEG, ITU-T T.81, annexes B and H, and DNG,
//! chapter 2, "Compression": a block's numbers follow each other, whatever JPEG takes for its columns and components.

use jpeg_decoder::Decoder;

/// The marker of a lossless frame, and of entropy-coded data (ITU-T T.81, table B.1).
const LOSSLESS_FRAME: u8 = 0xc3;
const SCAN: u8 = 0xda;
/// Other frames.
const FRAMES: std::ops::RangeInclusive<u8> = 0xc0..=0xcf;
/// Among these, tables (DHT), extensions (JPG) and conditions (DAC).
const NO_FRAMES: [u8; 3] = [0xc4, 0xc8, 0xcc];

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

/// The `count` numbers of a lossless JPEG.
///
/// # Errors
/// What the decoder says; or that it is not of so many numbers, which is found before they are decoded.
pub(super) fn of_jpeg(bytes: &[u8], count: usize) -> Result<Vec<u16>, String> {
    let found = frame_numbers(bytes).ok_or("its JPEG is not lossless, or has no frame")?;
    if found != count {
        return Err(format!("a block of {count} numbers has {found}"));
    }
    let decoded = Decoder::new(bytes).decode().map_err(|error| error.to_string())?;
    let numbers: Vec<u16> = match decoded.len() {
        length if length == count => decoded.into_iter().map(u16::from).collect(),
        _ => decoded.as_chunks::<2>().0.iter().map(|&pair| u16::from_ne_bytes(pair)).collect(),
    };
    if numbers.len() != count {
        return Err(format!("a block of {count} numbers has {}", numbers.len()));
    }
    Ok(numbers)
}

/// How many numbers the frame of a lossless JPEG states: columns, rows and components.
fn frame_numbers(bytes: &[u8]) -> Option<usize> {
    let mut rest = bytes.strip_prefix(&[0xff, 0xd8])?;
    loop {
        let [0xff, marker, length @ ..] = rest.get(..4)? else { return None };
        let length = usize::from(u16::from_be_bytes(length.try_into().ok()?));
        let segment = rest.get(4..2 + length)?;
        match *marker {
            LOSSLESS_FRAME => {
                let [_precision, heights @ .., components] = segment.first_chunk::<6>()?;
                let [height, width] = [[heights[0], heights[1]], [heights[2], heights[3]]].map(u16::from_be_bytes);
                return usize::from(height).checked_mul(width.into())?.checked_mul((*components).into());
            }
            SCAN => return None,
            marker if FRAMES.contains(&marker) && !NO_FRAMES.contains(&marker) => return None,
            _ => rest = &rest[2 + length..],
        }
    }
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

    #[test]
    fn a_jpeg_says_how_much_it_holds_before_it_is_decoded() {
        let frame =
            |marker: u8| [0xff, 0xd8, 0xff, 0xc4, 0, 3, 9, 0xff, marker, 0, 11, 14, 0x10, 0, 0x20, 0, 2, 1, 0, 2, 0];
        assert_eq!(frame_numbers(&frame(0xc3)), Some(0x1000 * 0x2000 * 2));
        assert_eq!(frame_numbers(&frame(0xc0)), None);
        assert_eq!(frame_numbers(&frame(0xda)), None);
        assert!(of_jpeg(&frame(0xc3), 64).is_err_and(|words| words.contains("a block of 64 numbers has 67108864")));
        for end in 0..frame(0xc3).len() {
            assert!(of_jpeg(&frame(0xc3)[..end], 64).is_err());
        }
    }
}
