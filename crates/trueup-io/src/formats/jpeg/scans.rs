//! How a JPEG lays out its components.

const START_OF_FRAME_BASELINE: u8 = 0xc0;
const START_OF_FRAME_EXTENDED: u8 = 0xc1;
const START_OF_SCAN: u8 = 0xda;
const END_OF_IMAGE: u8 = 0xd9;

/// The segments of a JPEG up to its first scan header, which is the last: each marker, and what follows its length as
/// far as the file goes. Bytes between segments that are no markers are passed over, as decoders do.
///
/// # Source
/// ITU-T T.81 B.1.1 (markers and segments).
fn segments(bytes: &[u8]) -> impl Iterator<Item = (u8, &[u8])> {
    let mut rest = bytes.get(2..);
    std::iter::from_fn(move || {
        loop {
            match rest? {
                // These markers stand alone.
                [0xff, 0x01 | 0xd0..=0xd8, after @ ..] => rest = Some(after),
                // Fill bytes may precede a marker, and 0 makes none.
                [0xff, marker, after @ ..] if !matches!(*marker, 0 | 0xff) => {
                    let [high, low, body @ ..] = after else { return None };
                    rest = after.get(usize::from(u16::from_be_bytes([*high, *low]))..);
                    rest = rest.filter(|_| *marker != START_OF_SCAN);
                    return Some((*marker, body));
                }
                [_, after @ ..] => rest = Some(after),
                [] => return None,
            }
        }
    })
}

/// Where the end-of-image marker is that follows the first scan header; `None` without one. The thumbnail's own marker
/// lies before that, in EXIF; within a scan every 0xff of the data is followed by 0 or by a restart marker; and further
/// pictures or maker data may follow the end.
///
/// # Source
/// ITU-T T.81 B.1.1.2 to B.1.1.5.
pub(super) fn end_of_image(bytes: &[u8]) -> Option<usize> {
    let (_, scan) = segments(bytes).find(|&(marker, _)| marker == START_OF_SCAN)?;
    let place = scan.windows(2).position(|pair| pair == [0xff, END_OF_IMAGE])?;
    Some(bytes.len() - scan.len() + place)
}

/// Whether a sequential JPEG has components of different resolution and not all of them in its first scan.
///
/// # Source
/// ITU-T T.81 B.2.2 (frame header), B.2.3 (scan header).
pub(super) fn has_separate_subsampled_scans(bytes: &[u8]) -> bool {
    let mut frame_components: Option<usize> = None;
    for (marker, body) in segments(bytes) {
        match marker {
            START_OF_FRAME_BASELINE | START_OF_FRAME_EXTENDED => frame_components = subsampled_components(body),
            START_OF_SCAN => return body.first().is_some_and(|&count| frame_components > Some(usize::from(count))),
            _ => {}
        }
    }
    false
}

/// Whether a JPEG is sequential with all of its components in one scan.
///
/// # Source
/// As of [`has_separate_subsampled_scans`].
pub(super) fn is_one_scan(bytes: &[u8]) -> bool {
    let mut frame_components = None;
    for (marker, body) in segments(bytes) {
        match marker {
            START_OF_FRAME_BASELINE | START_OF_FRAME_EXTENDED => frame_components = body.get(5),
            START_OF_SCAN => return frame_components.is_some() && body.first() == frame_components,
            _ => {}
        }
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
