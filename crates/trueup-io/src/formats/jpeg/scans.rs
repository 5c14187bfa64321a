//! How a JPEG lays out its components.

const START_OF_FRAME_BASELINE: u8 = 0xc0;
const START_OF_FRAME_EXTENDED: u8 = 0xc1;
const START_OF_SCAN: u8 = 0xda;

/// Whether a sequential JPEG has components of different resolution and not all of them in its first scan.
///
/// # Source
/// ITU-T T.81 B.1.1 (markers and segments), B.2.2 (frame header), B.2.3 (scan header).
pub(super) fn has_separate_subsampled_scans(bytes: &[u8]) -> bool {
    let mut frame_components: Option<usize> = None;
    let mut rest = bytes.get(2..).unwrap_or_default();
    while let [0xff, marker, after @ ..] = rest {
        // Fill bytes may precede a marker; these markers stand alone.
        match *marker {
            0xff => {
                rest = &rest[1..];
                continue;
            }
            0x01 | 0xd0..=0xd8 => {
                rest = after;
                continue;
            }
            _ => {}
        }
        let [high, low, body @ ..] = after else { return false };
        match *marker {
            START_OF_FRAME_BASELINE | START_OF_FRAME_EXTENDED => frame_components = subsampled_components(body),
            START_OF_SCAN => return body.first().is_some_and(|&count| frame_components > Some(usize::from(count))),
            _ => {}
        }
        rest = after.get(usize::from(u16::from_be_bytes([*high, *low]))..).unwrap_or_default();
    }
    false
}

/// Number of components of a frame if they differ in resolution: precision (1 byte), height (2), width (2), count (1),
/// then 3 bytes each, of which the second has the sampling factors.
fn subsampled_components(frame: &[u8]) -> Option<usize> {
    let count = usize::from(*frame.get(5)?);
    let mut factors = frame.get(6..6 + 3 * count)?.chunks_exact(3).map(|component| component[1]);
    let first = factors.next()?;
    factors.any(|other| other != first).then_some(count)
}
