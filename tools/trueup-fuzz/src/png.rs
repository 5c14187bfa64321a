//! Checksums of PNG.

use flate2::Crc;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Makes the checksum of every whole chunk right, if `bytes` begin as a PNG does.
///
/// # Source
/// PNG, third edition, sections 5.2 to 5.5: length, type, data, and the checksum over type and data.
pub fn mend_checksums(bytes: &mut [u8]) {
    if !bytes.starts_with(SIGNATURE) {
        return;
    }
    let mut rest = &mut bytes[SIGNATURE.len()..];
    while let Some((length, _)) = rest.split_first_chunk::<4>() {
        let end = (u32::from_be_bytes(*length) as usize).saturating_add(8);
        if rest.len() < end.saturating_add(4) {
            return;
        }
        let (chunk, after) = rest.split_at_mut(end);
        let mut checksum = Crc::new();
        checksum.update(&chunk[4..]);
        let (place, next) = after.split_at_mut(4);
        place.copy_from_slice(&checksum.sum().to_be_bytes());
        rest = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_standard() {
        // The chunk that ends every PNG; its checksum is printed in many places.
        let whole = [SIGNATURE, b"\0\0\0\0IEND\xae\x42\x60\x82"].concat();
        let mut broken = whole.clone();
        broken[16..].fill(0);
        mend_checksums(&mut broken);
        assert_eq!(broken, whole);
        mend_checksums(&mut broken[..13]);
        mend_checksums(&mut []);
    }
}
