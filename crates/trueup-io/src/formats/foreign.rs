//! Formats that are not read, known to be told apart from files that are no pictures, and what converts them.

use std::path::Path;

use crate::format::{Foreign, lower_extension};

/// What of the pixels is not stored as colors, or not first in the file: camera raw in the form of a TIFF.
///
/// Its signature is a TIFF's; what tells them apart is found by [`super::tiff`].
pub(crate) static RAW: Foreign = Foreign {
    what: "a camera raw photograph, or another file that begins with a small copy",
    extensions: &["nef", "nrw", "arw", "srf", "sr2", "pef", "srw", "erf", "3fr", "iiq", "rwl", "kdc", "dcr"],
    has_signature: |_| false,
    command: "darktable-cli photo.nef photo.tif",
    is_raw: true,
};

/// What [`crate::video`] takes frames out of, where it is named itself.
pub(crate) static VIDEO: Foreign = Foreign {
    what: "a video",
    extensions: &[],
    has_signature: |start| {
        let is_avi = start.starts_with(b"RIFF") && start.get(8..12) == Some(b"AVI ");
        is_avi || start.get(4..8) == Some(b"ftyp") || start.starts_with(&[0x1a, 0x45, 0xdf, 0xa3])
    },
    command: "ffmpeg -i clip.mp4 -vf fps=2 frame-%03d.png",
    is_raw: false,
};

/// The formats, the more special before the more general.
///
/// # Source
/// ISO/IEC 14496-12 and 23008-12 (boxes and their brands), ISO/IEC 15444-1 annex I (JPEG 2000); of camera raw, LibRaw's
/// identification of makers.
static FOREIGN: [&Foreign; 13] = [
    &RAW,
    &Foreign {
        what: "a camera raw photograph of Canon (CR2)",
        extensions: &["cr2"],
        has_signature: is_cr2,
        command: "darktable-cli photo.cr2 photo.tif",
        is_raw: true,
    },
    &Foreign {
        what: "a camera raw photograph of Canon (CR3)",
        extensions: &["cr3"],
        has_signature: |start| has_brand(start, b"crx"),
        command: "darktable-cli photo.cr3 photo.tif",
        is_raw: true,
    },
    &Foreign {
        what: "a camera raw photograph of Fujifilm (RAF)",
        extensions: &["raf"],
        has_signature: |start| start.starts_with(b"FUJIFILMCCD-RAW"),
        command: "darktable-cli photo.raf photo.tif",
        is_raw: true,
    },
    &Foreign {
        what: "a camera raw photograph of Olympus (ORF)",
        extensions: &["orf"],
        has_signature: |start| [b"IIRO", b"IIRS", b"MMOR"].iter().any(|signature| start.starts_with(*signature)),
        command: "darktable-cli photo.orf photo.tif",
        is_raw: true,
    },
    &Foreign {
        what: "a camera raw photograph of Panasonic (RW2)",
        extensions: &["rw2"],
        has_signature: |start| start.starts_with(b"IIU\0"),
        command: "darktable-cli photo.rw2 photo.tif",
        is_raw: true,
    },
    &VIDEO,
    &Foreign {
        what: "a JPEG 2000 picture",
        extensions: &["jp2", "j2k", "jpx"],
        has_signature: |start| {
            start.starts_with(b"\0\0\0\x0cjP  \r\n\x87\n") || start.starts_with(&[0xff, 0x4f, 0xff, 0x51])
        },
        command: "magick photo.jp2 photo.tif",
        is_raw: false,
    },
    &Foreign {
        what: "a GIF picture",
        extensions: &["gif"],
        has_signature: |start| start.starts_with(b"GIF8"),
        command: "magick photo.gif photo.png",
        is_raw: false,
    },
    &Foreign {
        what: "a BMP picture",
        extensions: &["bmp"],
        has_signature: |start| start.starts_with(b"BM"),
        command: "magick photo.bmp photo.png",
        is_raw: false,
    },
    &Foreign {
        what: "a Photoshop document",
        extensions: &["psd", "psb"],
        has_signature: |start| start.starts_with(b"8BPS"),
        command: "magick 'photo.psd[0]' photo.tif",
        is_raw: false,
    },
    &Foreign {
        what: "a PDF document",
        extensions: &[],
        has_signature: |start| start.starts_with(b"%PDF"),
        command: "pdftoppm -png pages.pdf page",
        is_raw: false,
    },
    // Without a signature of its own.
    &Foreign {
        what: "a Targa picture",
        extensions: &["tga"],
        has_signature: |_| false,
        command: "magick photo.tga photo.png",
        is_raw: false,
    },
];

/// Whether a box of the kind `ftyp` names a brand that begins so.
pub(super) fn has_brand(start: &[u8], brand: &[u8; 3]) -> bool {
    start.get(4..8) == Some(b"ftyp") && start.get(8..11) == Some(brand)
}

/// Whether a box of the kind `ftyp` that begins a file names, beside its brand, a compatible one that begins so, as far
/// as can be seen.
///
/// # Source
/// ISO/IEC 14496-12, section 4.3: the brand, its version, and compatible brands up to the end of the box.
pub(super) fn has_compatible_brand(start: &[u8], brand: &[u8; 3]) -> bool {
    let Some((length, _)) = start.split_first_chunk().filter(|_| start.get(4..8) == Some(b"ftyp")) else {
        return false;
    };
    let end = (u32::from_be_bytes(*length) as usize).min(start.len());
    let compatible = start.get(16..end).unwrap_or_default();
    compatible.as_chunks::<4>().0.iter().any(|found| found.starts_with(brand))
}

/// Whether a file that begins so, as a TIFF does, is camera raw of Canon, whose first picture is a reduced copy.
pub(crate) fn is_cr2(start: &[u8]) -> bool {
    start.starts_with(b"II*\0") && start.get(8..10) == Some(b"CR")
}

/// Whether the extension of `path` names a photograph in a format that is not read.
pub(crate) fn has_foreign_extension(path: &Path) -> bool {
    lower_extension(path)
        .is_some_and(|extension| FOREIGN.iter().any(|foreign| foreign.extensions.contains(&extension.as_str())))
}

/// What a file that is no supported picture seems to be; `None` when its first bytes tell nothing.
pub(crate) fn foreign_of(start: &[u8]) -> Option<&'static Foreign> {
    FOREIGN.iter().find(|foreign| (foreign.has_signature)(start)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_read_is_told_by_its_first_bytes() {
        for (start, what) in [
            (&b"II*\0\x10\0\0\0CR\x02\0"[..], "a camera raw photograph of Canon (CR2)"),
            (b"\0\0\0\x18ftypcrx \0\0\0\x01", "a camera raw photograph of Canon (CR3)"),
            (b"FUJIFILMCCD-RAW 0201", "a camera raw photograph of Fujifilm (RAF)"),
            (b"IIRO\x08\0\0\0", "a camera raw photograph of Olympus (ORF)"),
            (b"IIU\0\x08\0\0\0", "a camera raw photograph of Panasonic (RW2)"),
            (b"\0\0\0\x20ftypisom\0\0\x02\0", "a video"),
            (b"\0\0\0\x20ftypmp42\0\0\x02\0", "a video"),
            (b"RIFF\x10\0\0\0AVI LIST", "a video"),
            (b"\0\0\0\x0cjP  \r\n\x87\n", "a JPEG 2000 picture"),
            (b"GIF89a", "a GIF picture"),
        ] {
            assert_eq!(foreign_of(start).map(|foreign| foreign.what), Some(what));
        }
        assert!(foreign_of(b"to be or not to be").is_none() && foreign_of(b"").is_none());
    }
}
