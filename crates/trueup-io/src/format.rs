//! Which picture format a file holds, told by its first bytes, never by its name.

use std::io::Read;
use std::path::Path;

/// The formats that are read and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PictureFormat {
    Jpeg,
    Png,
    Tiff,
    WebP,
}

/// What a panorama is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutputFormat {
    /// One file in a format that is read, too.
    Picture(PictureFormat),
    /// A folder of tiles and a file that describes it.
    DeepZoom,
}

impl OutputFormat {
    /// The format that the extension of `path` names, in any case.
    pub(crate) fn of_extension(path: &Path) -> Option<Self> {
        match lower_extension(path)?.as_str() {
            "dzi" => Some(Self::DeepZoom),
            _ => PictureFormat::of_extension(path).map(Self::Picture),
        }
    }
}

/// How many bytes [`PictureFormat::of_content`] needs to see.
const SIGNATURE_BYTES: usize = 16;

/// What [`PictureFormat::of_content`] needs to see of a file, or all of a shorter one.
pub(crate) fn read_start(file: &mut impl Read) -> std::io::Result<Vec<u8>> {
    let mut start = Vec::with_capacity(SIGNATURE_BYTES);
    file.take(SIGNATURE_BYTES as u64).read_to_end(&mut start)?;
    Ok(start)
}

/// The supported formats, for messages.
pub(crate) const SUPPORTED: &str = "JPEG, PNG, TIFF or WebP";

/// Name extensions of photographs in formats this program does not read. In a folder such files are named in a
/// rejection, while files that are no photographs at all are passed over in silence.
const FOREIGN_EXTENSIONS: [&str; 21] = [
    "heic", "heif", "avif", "jxl", "jp2", "gif", "bmp", "exr", "hdr", "cr2", "cr3", "nef", "arw", "orf", "rw2", "raf",
    "pef", "srw", "dng", "psd", "tga",
];

impl PictureFormat {
    /// The format whose signature `start`, the file's [`read_start`], carries.
    ///
    /// # Source
    /// JPEG: ITU-T T.81 B.1.1.3 (SOI and the next marker). PNG: W3C PNG 5.2. TIFF 6.0 section 2 and BigTIFF.
    /// WebP: RFC 9649 2.4.
    pub(crate) fn of_content(start: &[u8]) -> Option<Self> {
        let is_webp = start.starts_with(b"RIFF") && start.get(8..12) == Some(b"WEBP");
        match start {
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Some(Self::Tiff),
            _ if is_webp => Some(Self::WebP),
            _ => None,
        }
    }

    /// The format that the extension of `path` names, in any case.
    pub(crate) fn of_extension(path: &Path) -> Option<Self> {
        match lower_extension(path)?.as_str() {
            "jpg" | "jpeg" | "jpe" | "jfif" => Some(Self::Jpeg),
            "png" => Some(Self::Png),
            "tif" | "tiff" => Some(Self::Tiff),
            "webp" => Some(Self::WebP),
            _ => None,
        }
    }
}

/// Whether the extension of `path` names a photograph in a format that is not read.
pub(crate) fn has_foreign_extension(path: &Path) -> bool {
    lower_extension(path).is_some_and(|extension| FOREIGN_EXTENSIONS.contains(&extension.as_str()))
}

fn lower_extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides_not_the_name() {
        assert_eq!(PictureFormat::of_content(b"\xff\xd8\xff\xe0rest"), Some(PictureFormat::Jpeg));
        assert_eq!(PictureFormat::of_content(b"RIFF\x00\x00\x00\x00WEBPVP8 "), Some(PictureFormat::WebP));
        assert_eq!(PictureFormat::of_content(b"RIFF\x00\x00\x00\x00WAVEfmt "), None);
        assert_eq!(PictureFormat::of_content(b"MM\x00*"), Some(PictureFormat::Tiff));
        assert_eq!(PictureFormat::of_content(b""), None);
    }

    #[test]
    fn extensions_are_read_in_any_case() {
        assert_eq!(PictureFormat::of_extension(Path::new("a/B.JpEg")), Some(PictureFormat::Jpeg));
        assert_eq!(PictureFormat::of_extension(Path::new("a.txt")), None);
        assert!(has_foreign_extension(Path::new("IMG_1.HEIC")));
    }
}
