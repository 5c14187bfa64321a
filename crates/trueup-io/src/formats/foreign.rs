//! Formats that are not read, known to be told apart from files that are no pictures.

use std::path::Path;

use crate::format::lower_extension;

/// Name extensions of photographs in formats this program does not read. In a folder such files are named in a
/// rejection, while files that are no photographs at all are passed over in silence.
const FOREIGN_EXTENSIONS: [&str; 21] = [
    "heic", "heif", "avif", "jxl", "jp2", "gif", "bmp", "exr", "hdr", "cr2", "cr3", "nef", "arw", "orf", "rw2", "raf",
    "pef", "srw", "dng", "psd", "tga",
];

/// Whether the extension of `path` names a photograph in a format that is not read.
pub(crate) fn has_foreign_extension(path: &Path) -> bool {
    lower_extension(path).is_some_and(|extension| FOREIGN_EXTENSIONS.contains(&extension.as_str()))
}

/// What a file that is no supported picture seems to be, for messages; `None` when its first bytes tell nothing.
pub(crate) fn describe_foreign_content(start: &[u8]) -> Option<&'static str> {
    match start {
        [b'G', b'I', b'F', b'8', ..] => Some("a GIF picture"),
        [b'B', b'M', ..] => Some("a BMP picture"),
        [b'8', b'B', b'P', b'S', ..] => Some("a Photoshop document"),
        [b'%', b'P', b'D', b'F', ..] => Some("a PDF document"),
        [0xff, 0x0a, ..] => Some("a JPEG XL picture"),
        [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', ..] => Some("an AVIF picture"),
        [_, _, _, _, b'f', b't', b'y', b'p', b'h' | b'm', ..] => Some("a HEIC picture"),
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => Some("a video"),
        _ => None,
    }
}
