//! The bytes of an entry: a mark, the checksum of the content, the content.

/// The first bytes of every entry; the digit is that of this layout.
const MARK: &[u8] = b"trueup cache 1\n";

/// The bytes of an entry with this content.
pub(crate) fn with_checksum(content: &[u8]) -> Vec<u8> {
    [MARK, blake3::hash(content).as_bytes(), content].concat()
}

/// The content of an entry; `None` if it is none, or damaged.
pub(crate) fn content(entry: &[u8]) -> Option<&[u8]> {
    let (checksum, content) = entry.strip_prefix(MARK)?.split_at_checked(blake3::OUT_LEN)?;
    (blake3::hash(content).as_bytes() == checksum).then_some(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_cut_or_changed_is_no_entry() {
        let entry = with_checksum(b"seventeen letters");
        assert_eq!(content(&entry), Some(&b"seventeen letters"[..]));
        for length in 0..entry.len() {
            assert_eq!(content(&entry[..length]), None, "cut to {length}");
        }
        for position in 0..entry.len() {
            let mut flipped = entry.clone();
            flipped[position] ^= 0x10;
            assert_eq!(content(&flipped), None, "flipped at {position}");
        }
    }
}
