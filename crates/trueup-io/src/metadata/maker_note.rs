//! What maker notes tell.

use exif::{Context, In, Tag, Value};

use super::block;

/// How Apple's maker note begins: its name, its version, and the byte order of what follows.
const APPLE: &[u8] = b"Apple iOS\0\0\x01MM";
/// A TIFF header as long as that, whose first directory lies behind it: the offsets in the note count from the note's
/// start.
const TIFF_HEADER: &[u8; 14] = b"MM\0\x2a\0\0\0\x0e\0\0\0\0\0\0";
/// AccelerationVector.
const ACCELERATION: Tag = Tag(Context::Tiff, 0x0008);

/// The acceleration vector in Apple's maker note, in g; `None` if there is none, or it is damaged.
///
/// # Source
/// ExifTool, Apple tags, 0x0008 AccelerationVector: three signed rationals.
pub(crate) fn apple_acceleration(note: &[u8]) -> Option<[f64; 3]> {
    let directory = note.strip_prefix(APPLE)?;
    let exif = block::parsed([TIFF_HEADER, directory].concat())?;
    let Value::SRational(parts) = &exif.get_field(ACCELERATION, In::PRIMARY)?.value else { return None };
    let [x, y, z] = parts.as_slice() else { return None };
    let vector = [x, y, z].map(exif::SRational::to_f64);
    vector.iter().all(|part| part.is_finite()).then_some(vector)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Apple's maker note with this vector and a number before it, as telephones lay it out.
    fn note(vector: [(i32, i32); 3]) -> Vec<u8> {
        const ENTRIES: u16 = 2;
        // Behind the header, the number of entries, the entries of 12 bytes each, and the offset of the next directory.
        let values = (APPLE.len() + 2 + 12 * usize::from(ENTRIES) + 4) as u32;
        let mut note = APPLE.to_vec();
        note.extend(ENTRIES.to_be_bytes());
        note.extend([0, 1, 0, 9, 0, 0, 0, 1, 0, 0, 0, 14]);
        note.extend([0, 8, 0, 10, 0, 0, 0, 3]);
        note.extend(values.to_be_bytes());
        note.extend([0; 4]);
        for (numerator, denominator) in vector {
            note.extend(numerator.to_be_bytes());
            note.extend(denominator.to_be_bytes());
        }
        note
    }

    #[test]
    fn the_acceleration_of_apples_note_is_read() {
        let found = apple_acceleration(&note([(-1, 4), (-39, 40), (1, 8)]));
        assert_eq!(found, Some([-0.25, -0.975, 0.125]));
    }

    #[test]
    fn damaged_notes_tell_nothing() {
        let whole = note([(-1, 4), (-39, 40), (1, 8)]);
        for length in 0..whole.len() {
            assert_eq!(apple_acceleration(&whole[..length]), None, "{length} bytes");
        }
        assert_eq!(apple_acceleration(&note([(1, 0), (-39, 40), (1, 8)])), None);
        assert_eq!(apple_acceleration(b"Nikon\0"), None);
    }
}
