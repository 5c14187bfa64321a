//! Whether to believe the EXIF orientation tag.

/// What became of a file's orientation tag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TagVerdict {
    /// Applied as it stands; 1 where the tag is absent or meaningless.
    Applied(u8),
    /// A quarter turn that the stored pixels have already undergone.
    Stale,
}

/// Judges an orientation tag by the size of the stored pixels.
///
/// Tags 5 to 8 turn the photograph by a quarter. Sensors are wider than tall and cameras store what the sensor sees, so
/// a true quarter turn is found on pixels stored wider than tall, and makes a portrait of them. Pixels stored taller
/// than wide were turned by a program that left the tag behind; to obey it would lay an upright photograph on its side.
///
/// PixelXDimension and PixelYDimension are no evidence: programs write the displayed size there with tag and pixels
/// both unturned, and leave the sensor's size there after turning pixels. Tags 2 to 4 keep the sides, so no size
/// contradicts them; nor does a square.
pub(crate) fn judge_orientation(tag: Option<u32>, stored_width: usize, stored_height: usize) -> TagVerdict {
    match tag {
        Some(5..=8) if stored_height > stored_width => TagVerdict::Stale,
        Some(tag @ 1..=8) => TagVerdict::Applied(tag as u8),
        _ => TagVerdict::Applied(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_turns_of_portrait_pixels_are_stale() {
        for tag in 5..=8 {
            assert_eq!(judge_orientation(Some(tag), 540, 720), TagVerdict::Stale);
            assert_eq!(judge_orientation(Some(tag), 720, 540), TagVerdict::Applied(tag as u8));
            assert_eq!(judge_orientation(Some(tag), 600, 600), TagVerdict::Applied(tag as u8));
        }
        for tag in 1..=4 {
            assert_eq!(judge_orientation(Some(tag), 540, 720), TagVerdict::Applied(tag as u8));
        }
    }

    #[test]
    fn meaningless_tags_count_as_upright() {
        for tag in [None, Some(0), Some(9), Some(u32::MAX)] {
            assert_eq!(judge_orientation(tag, 720, 540), TagVerdict::Applied(1));
        }
    }
}
