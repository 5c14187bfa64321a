//! Finds the photographs the user means and reads their headers: size, orientation, focal length, camera.

mod duplicates;
mod inputs;
mod names;
mod rejection;
#[cfg(test)]
mod tests;

use std::fs::File;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::options::StageOptions;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result, StageContext};

use crate::format::{HeaderError, Reading};
use crate::formats;
use crate::metadata::header::{Header, read_header};
use crate::metadata::orientation::{TagVerdict, judge_orientation};

use duplicates::Accepted;
use inputs::Candidate;
use rejection::Rejection;

pub use inputs::natural_order;
pub use names::unique_names;

/// The largest file that is opened. Files are read into memory to be decoded; no photograph is this large.
const MAX_FILE_BYTES: u64 = 4 << 30;

/// Shortest side in pixels that a photograph must have: the features and lines of smaller ones connect nothing.
const MIN_SIDE_PX: usize = 16;

trueup_core::choice! {
    /// When the EXIF orientation tag is applied.
    pub enum OrientationTrust {
        /// Unless the stored size shows that the pixels were turned already.
        Auto = "auto",
        /// Whenever the tag is present.
        Always = "always",
        /// Pixels are taken as they are stored.
        Never = "never",
    }
}

trueup_core::options! {
    /// Which files are accepted as photographs.
    pub struct SourceOptions("source") {
        /// Largest photograph that is accepted; larger ones are rejected by their header, before memory is taken. Raise it if
        /// a photograph is truly so large; lower it to protect a server.
        max_megapixels: f64 = 300.0, between(0.001, 10_000.0), "megapixels";
        /// When the EXIF orientation tag is applied. Choose always or never if photographs lie on their side.
        trust_orientation: OrientationTrust = OrientationTrust::Auto, Allowed::Any, "", basic;
    }
}

/// What [`scan`] found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sources {
    /// The photographs, in the order of the inputs; within a folder or pattern in the natural order of names.
    pub images: Vec<SourceImage>,
    /// Everything that was asked for and cannot be used, in the same order.
    pub rejected: Vec<RejectedSource>,
}

/// An input that cannot be used, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RejectedSource {
    /// The file, folder or pattern as the user named it.
    pub path: PathBuf,
    /// Short name for messages, unique among the inputs.
    pub name: String,
    /// Stable machine-readable reason in kebab case: `file-missing`, `pattern-without-match`, `folder-without-pictures`,
    /// `folder-not-file`, `file-unreadable`, `file-empty`, `not-a-picture`, `format-unsupported`, `picture-damaged`,
    /// `picture-too-large`, `picture-too-small`, `duplicate`.
    pub code: String,
    /// Why it cannot be used, without a closing full stop.
    pub reason: String,
    /// What the user can do about it, a whole sentence.
    pub hint: String,
}

impl RejectedSource {
    /// The rejection as an error, for callers who cannot go on without this input.
    pub fn to_error(&self) -> Error {
        Error::input(&self.name, &self.reason, &self.hint)
    }
}

/// Finds the photographs that `inputs` name and reads their headers.
///
/// An input is a file, a folder (its pictures, not those of folders inside it, hidden files left out) or a pattern with
/// `*`, `?`, `[...]` and `**`. A path that exists is never read as a pattern. A file is taken for what its content says,
/// whatever its name. In folders and patterns, files that are no photographs are passed over in silence; everything
/// else that cannot be used is listed in [`Sources::rejected`], and the good files beside it are used all the same.
/// Of the same file given twice, or of two files with the same bytes, the first is used.
///
/// A stale orientation tag is reported as the note `orientation-tag-stale`.
///
/// # Errors
/// [`Error::Options`] for options out of range, [`Error::Cancelled`]. Never for what is in the files.
pub fn scan(inputs: &[String], options: &SourceOptions, context: &StageContext) -> Result<Sources> {
    scan_from_side(MIN_SIDE_PX, inputs, options, context)
}

/// [`scan`] that accepts pictures of any size from a pixel on.
pub(crate) fn scan_any_size(inputs: &[String], options: &SourceOptions, context: &StageContext<'_>) -> Result<Sources> {
    scan_from_side(1, inputs, options, context)
}

fn scan_from_side(
    min_side_px: usize,
    inputs: &[String],
    options: &SourceOptions,
    context: &StageContext<'_>,
) -> Result<Sources> {
    options.check()?;
    let candidates = inputs::expand(inputs);
    let paths: Vec<&Path> = candidates.iter().map(Candidate::path).collect();
    let names = unique_names(&paths);

    context.progress().begin(SourceOptions::STAGE, candidates.len() as u64);
    let mut sources = Sources::default();
    let mut accepted = Accepted::default();
    for (candidate, name) in candidates.into_iter().zip(names) {
        context.check_cancelled()?;
        let path = candidate.path().to_owned();
        let number = sources.images.len();
        let examined = open_candidate(candidate, options, min_side_px)
            .and_then(|opened| examine(opened, &name, number, options, &mut accepted, context));
        match examined {
            Ok(image) => sources.images.push(image),
            Err(Rejection { code, reason, hint }) => {
                sources.rejected.push(RejectedSource { path, name, code: code.to_owned(), reason, hint });
            }
        }
        context.progress().advance(SourceOptions::STAGE, 1);
    }
    context.progress().finish(SourceOptions::STAGE);
    Ok(sources)
}

/// The files that `inputs` name, as [`scan`] finds them, without a look into any: photographs and what is none.
pub fn files(inputs: &[String]) -> Vec<PathBuf> {
    let file = |candidate| match candidate {
        Candidate::File(path) => Some(path),
        Candidate::Rejected(..) => None,
    };
    inputs::expand(inputs).into_iter().filter_map(file).collect()
}

/// A candidate whose header was read, and whose size is accepted.
struct OpenedPicture {
    path: PathBuf,
    /// Bytes of the file.
    length: u64,
    header: Header,
}

/// Reads a candidate's header.
fn open_candidate(
    candidate: Candidate,
    options: &SourceOptions,
    min_side_px: usize,
) -> std::result::Result<OpenedPicture, Rejection> {
    let path = match candidate {
        Candidate::Rejected(_, rejection) => return Err(rejection),
        Candidate::File(path) => path,
    };
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
    })?;
    check_size(&header, options, min_side_px)?;
    Ok(OpenedPicture { path, length, header })
}

/// Decides over one picture, which is to be photograph `number`.
fn examine(
    opened: OpenedPicture,
    name: &str,
    number: usize,
    options: &SourceOptions,
    accepted: &mut Accepted,
    context: &StageContext<'_>,
) -> std::result::Result<SourceImage, Rejection> {
    let OpenedPicture { path, length, header } = opened;
    let stored = header.stored;
    if stored.is_float {
        context.report(Diagnostic::note(
            "floating-point",
            Subject::Photograph(number),
            "its samples are floating point numbers, taken for linear light with 1 for white; what is brighter is white",
            "If it looks wrong, export it with 16 bits a sample.",
        ));
    }
    accepted.admit(&path, name, length)?;

    let tag = header.exif.orientation;
    let verdict = match options.trust_orientation {
        OrientationTrust::Auto => judge_orientation(tag, stored.width, stored.height),
        OrientationTrust::Always => TagVerdict::Applied(tag.and_then(|tag| u8::try_from(tag).ok()).unwrap_or(1)),
        OrientationTrust::Never => TagVerdict::Applied(1),
    };
    let orientation = match verdict {
        TagVerdict::Applied(tag) if (1..=8).contains(&tag) => tag,
        TagVerdict::Applied(_) => 1,
        TagVerdict::Stale => {
            context.report(stale_tag_note(number, &header));
            1
        }
    };
    let (width, height) = match orientation {
        5..=8 => (stored.height, stored.width),
        _ => (stored.width, stored.height),
    };
    let focal_prior = header.focal_prior();
    let camera_model = header.exif.camera_model();
    Ok(SourceImage { path, name: name.to_owned(), width, height, orientation, focal_prior, camera_model })
}

fn stale_tag_note(number: usize, header: &Header) -> Diagnostic {
    let tag = header.exif.orientation.unwrap_or(1);
    Diagnostic::note(
        "orientation-tag-stale",
        Subject::Photograph(number),
        format!(
            "the EXIF orientation tag ({tag}, a quarter turn) was not applied: the pixels are stored upright already, \
             {} x {}",
            header.stored.width, header.stored.height
        ),
        "If the photograph now lies on its side, set source.trust_orientation to always.",
    )
}

/// Opens a file; tells its length in bytes.
fn open(path: &Path) -> std::result::Result<(File, u64), Rejection> {
    let unreadable = |error: std::io::Error| {
        Rejection::new("file-unreadable", format!("it cannot be read ({error})"), "Check the file and its permissions.")
    };
    // Looked at before it is opened: opening a named pipe would wait for its writer.
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(Rejection::new(
            "folder-not-file",
            "it is a folder, not a picture",
            "Give the folder itself to use the pictures in it.",
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
fn recognize(file: &mut File, length: u64) -> std::result::Result<&'static Reading, Rejection> {
    if length == 0 {
        return Err(Rejection::new(
            "file-empty",
            "the file is empty (0 bytes)",
            "Copy it again from the camera or leave it out.",
        ));
    }
    let start = formats::read_start(file).map_err(|error| {
        Rejection::new("file-unreadable", format!("it cannot be read ({error})"), "Check the file and its permissions.")
    })?;
    if let Some(format) = formats::reading_of(&start) {
        return Ok(format);
    }
    let readable = formats::readable_names();
    Err(match formats::describe_foreign_content(&start) {
        Some(what) => Rejection::new(
            "format-unsupported",
            format!("it is {what}, a format that is not read"),
            format!("Convert it to {readable}."),
        ),
        None => Rejection::new(
            "not-a-picture",
            format!("its content is not a {readable} picture, whatever its name says"),
            format!("Give photographs in {readable}."),
        ),
    })
}

fn check_size(header: &Header, options: &SourceOptions, min_side_px: usize) -> std::result::Result<(), Rejection> {
    let (width, height) = (header.stored.width, header.stored.height);
    let megapixels = width as f64 * height as f64 / 1e6;
    if megapixels > options.max_megapixels {
        return Err(Rejection::new(
            "picture-too-large",
            format!(
                "{width} x {height} px are {megapixels:.0} megapixels, at most {} are accepted",
                options.max_megapixels
            ),
            "Export a smaller copy, or raise source.max_megapixels if the picture is truly this large.",
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
