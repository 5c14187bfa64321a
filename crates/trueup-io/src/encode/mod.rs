//! Panoramas to files, row by row. A file appears complete or not at all.

pub(crate) mod background;
#[cfg(test)]
mod by_hand_tests;
#[cfg(test)]
mod deep_zoom_tests;
mod destination;
mod expected;
pub(crate) mod failure;
pub(crate) mod folder;
#[cfg(test)]
mod format_tests;
mod labels;
mod layers;
pub(crate) mod metadata;
pub(crate) mod options;
pub(crate) mod pending;
pub(crate) mod place;
pub(crate) mod pyramid;
pub(crate) mod samples;
mod stale;
pub(crate) mod strips;
#[cfg(test)]
mod tests;
mod unfinished;

use std::path::Path;

use trueup_core::options::StageOptions;
use trueup_core::raster::RowSource;
use trueup_core::{Error, Result, StageContext};

use crate::color::InSrgb;
use crate::format::Writer;

use destination::{check_sides, writing_to};
use pending::{Durability, PendingFile};

pub use crate::formats::written_extensions;
pub use background::Background;
pub use expected::expected_bytes;
pub use folder::PendingFolder;
pub use labels::{LabelMap, NOTHING, check_labels_place, write_labels};
pub use layers::{LayerPage, LayerSet, check_layers_place, write_layers};
pub use metadata::Metadata;
pub use options::{
    Alpha, BigTiff, ChromaSubsampling, DeepZoomFormat, Depth, LayerExtent, MetadataKept, OutputOptions, OutputProfile,
    PngCompression, TiffCompression, TiffLayout,
};
pub use pending::{check_name, check_place};
pub use place::{is_standard_output, passes_through, same_place};
pub use stale::clear_parts;
pub use unfinished::{abandon_unfinished, abandon_unfinished_soon};

/// Writes a panorama to `path`, in the format its extension names; returns the file's length in bytes, for Deep Zoom
/// that of all files.
///
/// `metadata` describes the picture: its color profile, which [`OutputOptions::profile`] may have it converted from,
/// and the EXIF and XMP to embed; Deep Zoom has none.
///
/// Rows are asked for in strips, in parallel on the current thread pool; only WebP needs a copy of the whole. JPEG is
/// laid over the background, the other formats keep transparency unless [`OutputOptions::background`] is a color or
/// [`OutputOptions::alpha`] says otherwise. A depth of [`Depth::Auto`] is taken for 8 bits, see
/// [`OutputOptions::with_depth_for`]. The bytes written depend on the picture and the options alone. The file is
/// written under another name in the same folder and renamed when it is complete, so that on any error nothing is left
/// behind and an existing file stays as it was.
///
/// # Errors
/// [`Error::Options`] for options out of range; [`Error::Unsupported`] for other extensions, a depth that the format
/// has not, or a transparent background where there is no transparency; [`Error::Limits`] for pictures larger than the
/// format can hold; [`Error::Input`] for an empty picture, or a folder that does not exist or takes no files;
/// [`Error::Io`] if the operating system refuses; [`Error::Cancelled`]; and what the picture returns.
pub fn write(
    path: &Path,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<u64> {
    options.check()?;
    let writing = writing_to(path, options)?;
    // A profile describes encoded samples, not linear light.
    let without_profile = !writing.has_profile || options.depth == Depth::Float;
    if let Some(icc) = metadata.profile_to_leave(options, without_profile) {
        let options = OutputOptions { profile: OutputProfile::Keep, ..options.clone() };
        return write(path, &InSrgb::new(picture, icc)?, &metadata.in_srgb(), &options, context);
    }
    check_sides(path, writing.sides, picture.width(), picture.height())?;
    context.progress().begin(OutputOptions::STAGE, picture.height() as u64);
    let length = match writing.writer {
        Writer::Files { write, .. } => write(path, picture, options, context)?,
        Writer::File(write) => {
            let mut pending = PendingFile::create(path)?;
            write(pending.file(), picture, metadata, options, context)
                .map_err(|failure| failure.at(&pending.place()))?;
            context.check_cancelled()?;
            pending.commit()?
        }
    };
    context.progress().finish(OutputOptions::STAGE);
    Ok(length)
}

/// Checks that a panorama could be written to `path`, before the long work that makes one: the extension names a format
/// that has the depth and the background asked for, the folder exists and takes files, and `path` is no folder itself.
/// Nothing is left behind.
///
/// # Errors
/// As [`write()`].
pub fn check_writable(path: &Path, options: &OutputOptions) -> Result<()> {
    // Before its extension is missed, of which folders have none.
    pending::refuse_folder(path)?;
    check_name(path)?;
    match writing_to(path, options)?.writer {
        Writer::Files { check_places, .. } => check_places(path),
        Writer::File(_) => check_place(path),
    }
}

/// Checks that the extension of `path` names a format that has the depth and the background asked for, wherever it
/// lies.
///
/// # Errors
/// [`Error::Unsupported`].
pub fn check_format(path: &Path, options: &OutputOptions) -> Result<()> {
    writing_to(path, options).map(drop)
}

/// Checks that the format that the extension of `path` names can hold a panorama of `size` pixels (width, height).
///
/// # Errors
/// [`Error::Limits`] with the sides; [`Error::Input`] for an empty picture; those of [`check_format`].
pub fn check_size(path: &Path, [width, height]: [usize; 2], options: &OutputOptions) -> Result<()> {
    check_sides(path, writing_to(path, options)?.sides, width, height)
}

/// Writes a file that appears complete or not at all, also where the computer loses power; for reports and project
/// files.
///
/// # Errors
/// [`Error::Input`] if the folder does not exist or takes no files, [`Error::Io`] if the operating system refuses.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_bytes(path, bytes, Durability::Whole)
}

/// The same without waiting for the disk: a computer that loses power may leave the file empty or half. For what is
/// looked through when it is read, and can be made again.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_regained(path: &Path, bytes: &[u8]) -> Result<()> {
    write_bytes(path, bytes, Durability::Regained)
}

fn write_bytes(path: &Path, bytes: &[u8], durability: Durability) -> Result<()> {
    let mut pending = PendingFile::create(path)?.with_durability(durability);
    std::io::Write::write_all(pending.file(), bytes).map_err(|error| Error::io("writing", &pending.place(), error))?;
    pending.commit().map(drop)
}
