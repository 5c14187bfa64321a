//! Candidates looked into: a file, its format, its header and its size.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::options::SourceOptions;
use super::rejection::Rejection;
use crate::format::{Foreign, HeaderError, Reading};
use crate::formats;
use crate::metadata::header::{Header, read_header};

/// The largest file that is opened. Files are read into memory to be decoded; no photograph is this large.
const MAX_FILE_BYTES: u64 = 4 << 30;

/// The code of panoramas among the photographs of a folder, and of their layers and seams.
pub(super) const OWN_OUTPUT: &str = "own-panorama";

/// The code of panoramas that something else made, by what the file says or by what it shows.
pub const PANORAMA_OF_OTHERS: &str = "panorama-of-others";

/// What people can do who want a panorama among the photographs. Beside those that it shows, it would be left out by
/// what it shows.
const NAME_ITSELF: &str = "If it is to be stitched all the same, name the file itself, and beside what it was made of its overlaps in a --graph file.";

/// A picture whose header was read, and whose size is accepted.
pub(super) struct OpenedPicture {
    pub(super) path: PathBuf,
    /// Bytes of the file.
    pub(super) length: u64,
    pub(super) header: Header,
}

/// How the user named a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Named {
    /// By its own path.
    Itself,
    /// By a folder or pattern that it was found in.
    ByItsFolder,
}

/// Reads a file's header.
pub(super) fn open_picture(
    path: PathBuf,
    named: Named,
    options: &SourceOptions,
    min_side_px: usize,
) -> Result<OpenedPicture, Rejection> {
    let (mut file, length) = open(&path)?;
    let format = recognize(&mut file, length)?;
    let header = read_header(file, format).map_err(|error| match error {
        HeaderError::Damaged(words) => Rejection::new(
            "picture-damaged",
            format!("its header cannot be read ({words})"),
            "Export it again or leave it out.",
        ),
        HeaderError::Unsupported(words) => Rejection::new(
            "format-unsupported",
            format!("it is of a kind that is not read ({words})"),
            "Export it as gray or RGB with 8 or 16 bits a sample.",
        ),
        HeaderError::Foreign(foreign) => not_read(foreign),
    })?;
    if let Some(what) = header.exif.own_output().filter(|_| named == Named::ByItsFolder) {
        return Err(Rejection::new(OWN_OUTPUT, what, NAME_ITSELF));
    }
    if named == Named::ByItsFolder && header.exif.is_panorama_of_others() {
        return Err(Rejection::new(PANORAMA_OF_OTHERS, "it says that it is a panorama, not a photograph", NAME_ITSELF));
    }
    check_size([header.stored.width, header.stored.height], options, min_side_px)?;
    Ok(OpenedPicture { path, length, header })
}

/// Opens a file; tells its length in bytes.
fn open(path: &Path) -> Result<(File, u64), Rejection> {
    let unreadable = |error: std::io::Error| {
        Rejection::new("file-unreadable", format!("it cannot be read ({error})"), "Check the file and its permissions.")
    };
    // Looked at before it is opened: opening a named pipe would wait for its writer.
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(Rejection::new(
            "folder-not-file",
            "it is a folder, not a photograph",
            "Give the folder itself to use the photographs in it.",
        ));
    }
    if !metadata.is_file() {
        return Err(Rejection::new("file-unreadable", "it is not a regular file", "Give a picture file."));
    }
    let length = metadata.len();
    if length > MAX_FILE_BYTES {
        let gibibytes = length as f64 / (1_u64 << 30) as f64;
        return Err(Rejection::new(
            "picture-too-large",
            format!("the file has {gibibytes:.1} GiB, at most {} are read", MAX_FILE_BYTES >> 30),
            "Export a smaller copy of it.",
        ));
    }
    Ok((File::open(path).map_err(unreadable)?, length))
}

/// Tells the format by the file's first bytes.
fn recognize(file: &mut File, length: u64) -> Result<&'static Reading, Rejection> {
    if length == 0 {
        return Err(Rejection::new(
            "file-empty",
            "the file is empty (0 bytes)",
            "Copy it again from the camera or leave it out.",
        ));
    }
    let unreadable = |error: std::io::Error| {
        Rejection::new("file-unreadable", format!("it cannot be read ({error})"), "Check the file and its permissions.")
    };
    if let Some(format) = formats::recognize(file).map_err(unreadable)? {
        return Ok(format);
    }
    let start = formats::read_start(file).map_err(unreadable)?;
    let readable = formats::readable_formats();
    Err(match formats::foreign_of(&start) {
        Some(foreign) => not_read(foreign),
        None => Rejection::new(
            "not-a-picture",
            format!("its content is not a {readable} picture, whatever its name says"),
            format!("Give photographs in {readable}."),
        ),
    })
}

/// Why a photograph of another format is left out, and what makes one of it that is not.
fn not_read(foreign: &Foreign) -> Rejection {
    let readable = formats::readable_formats();
    Rejection::new(
        "format-unsupported",
        format!("it is {}, a format that is not read", foreign.what),
        format!("Convert it to {readable}, for example with `{}`.", foreign.command),
    )
}

/// Refuses pictures with too many pixels or too few.
pub(super) fn check_size(
    [width, height]: [usize; 2],
    options: &SourceOptions,
    min_side_px: usize,
) -> Result<(), Rejection> {
    let megapixels = width as f64 * height as f64 / 1e6;
    if megapixels > options.max_megapixels {
        // As many decimals as tell a small picture from nothing.
        let decimals = if megapixels < 10.0 { 2 } else { 0 };
        return Err(Rejection::new(
            "picture-too-large",
            format!(
                "{width} x {height} px are {megapixels:.decimals$} megapixels, at most {} are accepted",
                options.max_megapixels
            ),
            "Export a smaller copy, or raise source.max_megapixels if the photograph is truly this large.",
        ));
    }
    if width.min(height) < min_side_px {
        return Err(Rejection::new(
            "picture-too-small",
            format!("{width} x {height} px are too few to stitch, each side needs {min_side_px}"),
            "Give the photograph in its original size.",
        ));
    }
    Ok(())
}
