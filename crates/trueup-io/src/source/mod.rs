//! Finds the photographs the user means and reads their headers: size, orientation, focal length, camera.

mod duplicates;
mod in_memory;
mod inputs;
mod names;
mod opened;
mod options;
mod pattern;
mod rejection;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::options::StageOptions;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result, StageContext};

use crate::formats;
use crate::metadata::exif_fields::ExifFields;
use crate::metadata::header::{self, Header};
use crate::metadata::orientation::{TagVerdict, judge_orientation};

use duplicates::Accepted;
use in_memory::in_memory_source;
use inputs::Candidate;
pub use opened::PANORAMA_OF_OTHERS;
use opened::{Named, OWN_OUTPUT, OpenedPicture, check_size, open_picture};
use rejection::Rejection;

pub use crate::formats::{names_photograph, read_extensions, readable_formats};
pub use in_memory::InMemory;
pub use inputs::natural_order;
pub use names::unique_names;
pub use options::{FrameUse, OrientationTrust, SourceOptions};

/// Shortest side in pixels that a photograph must have: the features and lines of smaller ones connect nothing.
const MIN_SIDE_PX: usize = 16;

/// What [`scan`] found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sources {
    /// The photographs, in the order of the inputs; within a folder or pattern in the natural order of names.
    pub photographs: Vec<SourceImage>,
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
    /// Stable machine-readable reason in kebab case: `file-missing`, `pattern-without-match`,
    /// `folder-without-pictures`, `folder-not-file`, `file-unreadable`, `file-empty`, `not-a-picture`,
    /// `format-unsupported`, `picture-damaged`, `picture-too-large`, `picture-too-small`, `duplicate`, `own-panorama`,
    /// `panorama-of-others`, `name-of-a-file`.
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

    /// Whether it was left out because an earlier run of this program made it.
    pub fn is_own_output(&self) -> bool {
        self.code == OWN_OUTPUT
    }
}

/// Finds the photographs that `inputs` name and reads their headers.
///
/// An input is a file, a folder (its photographs, not those of folders inside it, hidden files left out) or a pattern
/// with `*`, `?`, `[...]` and `**`. A path that exists is never read as a pattern. A file is taken for what its content
/// says, whatever its name. In folders and patterns, files that are no photographs are passed over in silence, and
/// panoramas that this program made are left out: they are of an earlier run, of the photographs beside them.
/// Everything else that cannot be used is listed in [`Sources::rejected`], and the good files beside it are used all
/// the same. Of the same file given twice, or of two files with the same bytes, the first is used.
///
/// A stale orientation tag is reported as the note [`ORIENTATION_TAG_STALE`].
///
/// # Errors
/// [`Error::Options`] for options out of range, [`Error::Cancelled`]. Never for what is in the files.
pub fn scan(inputs: &[String], options: &SourceOptions, context: &StageContext) -> Result<Sources> {
    scan_with(inputs, &InMemory::default(), options, context)
}

/// [`scan`] where an input may also be the name of a photograph in memory, which is looked for there first.
///
/// # Errors
/// As [`scan`].
pub fn scan_with(
    inputs: &[String],
    in_memory: &InMemory,
    options: &SourceOptions,
    context: &StageContext<'_>,
) -> Result<Sources> {
    scan_candidates(inputs::expand(inputs, in_memory), MIN_SIDE_PX, options, context)
}

/// [`scan`] that accepts pictures of any size from a pixel on.
pub(crate) fn scan_any_size(inputs: &[String], options: &SourceOptions, context: &StageContext<'_>) -> Result<Sources> {
    scan_candidates(inputs::expand(inputs, &InMemory::default()), 1, options, context)
}

fn scan_candidates(
    candidates: Vec<Candidate>,
    min_side_px: usize,
    options: &SourceOptions,
    context: &StageContext<'_>,
) -> Result<Sources> {
    options.check()?;
    let paths: Vec<&Path> = candidates.iter().map(Candidate::path).collect();
    let names = unique_names(&paths);

    context.progress().begin(SourceOptions::STAGE, candidates.len() as u64);
    let mut sources = Sources::default();
    let mut accepted = Accepted::default();
    for (candidate, name) in candidates.into_iter().zip(names) {
        context.check_cancelled()?;
        let path = candidate.path().to_owned();
        let number = sources.photographs.len();
        let mut examine_file = |path: PathBuf, named: Named| {
            let opened = open_picture(path, named, options, min_side_px)?;
            examine(opened, &name, number, options, &mut accepted, context)
        };
        let examined = match candidate {
            Candidate::Rejected(_, rejection) => Err(rejection),
            Candidate::File(path) => examine_file(path, Named::Itself),
            Candidate::Found(path) => examine_file(path, Named::ByItsFolder),
            Candidate::InMemory(path, photograph) => {
                check_size([photograph.width(), photograph.height()], options, min_side_px)
                    .and_then(|()| accepted.admit_in_memory(&name, &photograph))
                    .and_then(|()| in_memory_source(path, &name, &photograph))
            }
        };
        match examined {
            Ok(source) => sources.photographs.push(source),
            Err(Rejection { code, reason, hint }) => {
                sources.rejected.push(RejectedSource { path, name, code: code.to_owned(), reason, hint });
            }
        }
        context.progress().advance(SourceOptions::STAGE, 1);
    }
    context.progress().finish(SourceOptions::STAGE);
    Ok(sources)
}

/// The files that `inputs` name, as [`scan_with`] finds them, photographs and what is none; without a look into any but
/// those of folders and patterns, of which panoramas that this program made are left out.
pub fn files(inputs: &[String], in_memory: &InMemory) -> Vec<PathBuf> {
    let file = |candidate| match candidate {
        Candidate::File(path) => Some(path),
        Candidate::Found(path) => Some(path).filter(|path| !is_own_output(path)),
        Candidate::InMemory(..) | Candidate::Rejected(..) => None,
    };
    inputs::expand(inputs, in_memory).into_iter().filter_map(file).collect()
}

/// The files of camera raw that `input` names, in their order: itself, or those of a folder or pattern; of these not
/// such as lie beside a photograph of the same name, as cameras write both.
pub fn raw_files(input: &str) -> Vec<PathBuf> {
    let is_raw = |path: &Path| formats::foreign_file(path).is_some_and(|foreign| foreign.is_raw);
    let candidates = inputs::expand_one(input);
    let stem = |path: &Path| path.with_extension("").to_string_lossy().to_lowercase();
    let photographs: BTreeSet<String> =
        candidates.iter().map(Candidate::path).filter(|path| is_readable(path)).map(stem).collect();
    let raw = |candidate: &Candidate| match candidate {
        Candidate::File(path) => Some(path.clone()).filter(|path| is_raw(path)),
        Candidate::Found(path) if photographs.contains(&stem(path)) => None,
        Candidate::Found(path) => Some(path.clone()).filter(|path| is_raw(path)),
        Candidate::InMemory(..) | Candidate::Rejected(..) => None,
    };
    candidates.iter().filter_map(raw).collect()
}

/// Whether what a file is called and what it says is a photograph in a format that is read.
fn is_readable(path: &Path) -> bool {
    names_photograph(path) && path.is_file() && formats::foreign_file(path).is_none() && header::open(path).is_some()
}

/// Whether the file at `path` says that this program made it: a panorama, its layers or its seams.
pub fn is_own_output(path: &Path) -> bool {
    exif_of(path).is_some_and(|exif| exif.is_by_this_program())
}

/// Whether the file at `path` says that it is a panorama, whoever made it: [`scan`] leaves it out where its folder is
/// named.
pub fn is_marked_panorama(path: &Path) -> bool {
    exif_of(path).is_some_and(|exif| exif.is_by_this_program() || exif.is_panorama_of_others())
}

fn exif_of(path: &Path) -> Option<ExifFields> {
    // Looked at before it is opened: opening a named pipe would wait for its writer.
    let opened = if path.is_file() { header::open(path) } else { None };
    opened.and_then(|(mut input, format)| format.exif(&mut input))
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
            "its samples are floating point numbers, taken for linear light",
            "If it looks wrong, export it with 16 bits a sample.",
        ));
    }
    accepted.admit(&path, name, length)?;

    let tag = header.exif.orientation;
    let stated = tag.and_then(|tag| u8::try_from(tag).ok()).filter(|tag| (1..=8).contains(tag)).unwrap_or(1);
    let verdict = match options.trust_orientation {
        OrientationTrust::Auto => judge_orientation(tag, stored.width, stored.height),
        OrientationTrust::Always => TagVerdict::Applied(stated),
        OrientationTrust::Never => TagVerdict::Applied(1),
    };
    let orientation = match verdict {
        TagVerdict::Applied(tag) => tag,
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
    let gravity = header.gravity(stated, orientation);
    let camera_model = header.exif.camera_model();
    let Header { exif, .. } = header;
    let exposure = exif.exposure();
    let focal_mm = exif.focal_mm.filter(|focal_mm| focal_mm.is_finite() && *focal_mm > 0.0);
    Ok(SourceImage {
        orientation,
        focal_prior,
        camera_model,
        lens_model: exif.lens_model,
        focal_mm,
        exposure,
        gravity,
        is_float: stored.is_float,
        ..SourceImage::unknown(path, name, [width, height])
    })
}

/// The code of photographs whose orientation tag was not applied.
pub const ORIENTATION_TAG_STALE: &str = "orientation-tag-stale";

fn stale_tag_note(number: usize, header: &Header) -> Diagnostic {
    let tag = header.exif.orientation.unwrap_or(1);
    Diagnostic::note(
        ORIENTATION_TAG_STALE,
        Subject::Photograph(number),
        format!(
            "the EXIF orientation tag ({tag}, a quarter turn) was not applied: the pixels are stored upright already, \
             {} x {}",
            header.stored.width, header.stored.height
        ),
        "If the photograph now lies on its side, set source.trust_orientation to always.",
    )
}
