//! Panoramas to files, row by row. A file appears complete or not at all.

mod background;
#[cfg(test)]
mod by_hand_tests;
mod codecs;
mod deep_zoom;
#[cfg(test)]
mod deep_zoom_tests;
mod expected;
mod folder;
#[cfg(test)]
mod format_tests;
mod jpeg;
mod labels;
mod limits;
mod metadata;
mod options;
mod pending;
mod pyramid;
mod samples;
#[cfg(test)]
mod tests;
mod tiff;
mod tiff_metadata;
mod unfinished;

use std::path::Path;

use rayon::prelude::*;
use trueup_core::options::StageOptions;
use trueup_core::raster::RowSource;
use trueup_core::{Error, Result, StageContext};

use crate::color::{InSrgb, is_srgb};
use crate::format::{OutputFormat, PictureFormat};

use codecs::from_tiff;
use limits::{check_sides, largest_side, output_format};
use pending::PendingFile;
pub(crate) use pending::takes_nothing;
use samples::Sample;

pub use background::Background;
pub use expected::expected_bytes;
pub use folder::PendingFolder;
pub use labels::{LabelMap, NOTHING, check_labels_place, write_labels};
pub use metadata::Metadata;
pub use options::{
    Alpha, BigTiff, ChromaSubsampling, DeepZoomFormat, Depth, LayerExtent, MetadataKept, OutputOptions, OutputProfile,
    PngCompression, TiffCompression, TiffLayout,
};
pub use tiff::{LayerPage, LayerSet, check_layers_place, write_layers};
#[cfg(test)]
pub(crate) use tiff_metadata::OF_JPEG;
pub use unfinished::abandon_unfinished;

/// Writes a panorama to `path`, in the format its extension names; returns the file's length in bytes, for Deep Zoom that
/// of all files.
///
/// `metadata` describes the picture: its color profile, which [`OutputOptions::profile`] may have it converted from, and
/// the EXIF and XMP to embed; Deep Zoom has none.
///
/// Rows are asked for in strips, in parallel on the current thread pool; only WebP needs a copy of the whole. JPEG is
/// laid over the background, the other formats keep transparency unless [`OutputOptions::background`] is a color or
/// [`OutputOptions::alpha`] says otherwise. A depth of [`Depth::Auto`] is taken for 8 bits, see
/// [`OutputOptions::with_depth_for`]. The bytes written depend on the picture and the options alone. The file is written
/// under another name in the same folder and renamed when it is complete, so that on any error nothing is left behind and
/// an existing file stays as it was.
///
/// # Errors
/// [`Error::Options`] for options out of range; [`Error::Unsupported`] for other extensions, a depth that the format has
/// not, or a transparent background where there is no transparency; [`Error::Limits`] for pictures larger than the format
/// can hold; [`Error::Input`] for an empty picture, or a folder that does not exist or takes no files; [`Error::Io`] if the
/// operating system refuses; [`Error::Cancelled`]; and what the picture returns.
pub fn write(
    path: &Path,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<u64> {
    options.check()?;
    let format = output_format(path, options)?;
    // Viewers of tiles know no profiles, and a profile describes encoded samples, not linear light.
    let without_profile = format == OutputFormat::DeepZoom || options.depth == Depth::Float;
    if let Some(icc) = profile_to_leave(metadata, options, without_profile) {
        let options = OutputOptions { profile: OutputProfile::Keep, ..options.clone() };
        return write(path, &InSrgb::new(picture, icc)?, &metadata.in_srgb(), &options, context);
    }
    check_sides(path, largest_side(format), picture.width(), picture.height())?;
    context.progress().begin(OutputOptions::STAGE, picture.height() as u64);
    let length = match format {
        OutputFormat::DeepZoom => deep_zoom::write(path, picture, options, context)?,
        OutputFormat::Picture(format) => {
            let mut pending = PendingFile::create(path)?;
            let written = match format {
                PictureFormat::Jpeg => jpeg::write(pending.file(), picture, metadata, options, context),
                PictureFormat::Png => codecs::write_png(pending.file(), picture, metadata, options, context),
                PictureFormat::Tiff => tiff::write(pending.file(), picture, metadata, options, context),
                PictureFormat::WebP => codecs::write_webp(pending.file(), picture, metadata, options, context),
            };
            written.map_err(|failure| failure.at(path))?;
            context.check_cancelled()?;
            pending.commit()?
        }
    };
    context.progress().finish(OutputOptions::STAGE);
    Ok(length)
}

/// The profile of a picture that is to be converted to sRGB.
fn profile_to_leave<'a>(metadata: &'a Metadata, options: &OutputOptions, always: bool) -> Option<&'a [u8]> {
    let leaves = always || options.profile == OutputProfile::Srgb;
    metadata.icc.as_deref().filter(|icc| leaves && !is_srgb(icc))
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
    match output_format(path, options)? {
        OutputFormat::DeepZoom => deep_zoom::check_places(path),
        OutputFormat::Picture(_) => check_place(path),
    }
}

/// Checks that the extension of `path` names a format that has the depth and the background asked for, wherever it lies.
///
/// # Errors
/// [`Error::Unsupported`].
pub fn check_format(path: &Path, options: &OutputOptions) -> Result<()> {
    output_format(path, options).map(drop)
}

/// Checks that a file of any kind could be written to `path`: the folder exists and takes files, and `path` is no folder
/// itself. Nothing is left behind.
///
/// # Errors
/// As [`write_atomically`].
pub fn check_place(path: &Path) -> Result<()> {
    PendingFile::create(path).map(drop)
}

/// Writes a file that appears complete or not at all; for reports and project files.
///
/// # Errors
/// [`Error::Input`] if the folder does not exist or takes no files, [`Error::Io`] if the operating system refuses.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut pending = PendingFile::create(path)?;
    std::io::Write::write_all(pending.file(), bytes).map_err(|error| Error::io("writing", path, error))?;
    pending.commit().map(drop)
}

/// Samples of a pixel in the file: 4, or 3 without alpha.
fn channels_of(picture: &dyn RowSource, options: &OutputOptions) -> usize {
    let opaque = options.alpha == Alpha::Auto && picture.is_opaque();
    RGBA - usize::from(opaque || !options.background.keeps(options.alpha))
}

/// Samples of an RGBA pixel.
const RGBA: usize = 4;

/// Why a codec stopped, before it is tied to the file.
#[derive(Debug)]
enum Failure {
    /// The picture could not hand out its rows, or the work is cancelled.
    Picture(Error),
    Io(std::io::Error),
}

impl Failure {
    fn at(self, path: &Path) -> Error {
        match self {
            Self::Picture(error) => error,
            Self::Io(error) => Error::io("writing", path, error),
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Picture(error)
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// Hands the picture to `consume` from top to bottom, in strips of at most `rows` rows of RGBA; the rows of a strip are
/// made in parallel. Stops when the work is cancelled and reports progress.
fn for_each_strip<S: Sample>(
    picture: &dyn RowSource,
    rows: usize,
    context: &StageContext,
    mut consume: impl FnMut(&[S]) -> std::result::Result<(), Failure>,
) -> std::result::Result<(), Failure> {
    let row_samples = picture.width() * RGBA;
    let mut strip = vec![S::default(); row_samples * rows.min(picture.height())];
    for first in (0..picture.height()).step_by(rows.max(1)) {
        context.check_cancelled()?;
        let count = rows.min(picture.height() - first);
        let strip = &mut strip[..count * row_samples];
        strip
            .par_chunks_exact_mut(row_samples)
            .enumerate()
            .try_for_each(|(row, pixels)| S::row(picture, first + row, pixels))?;
        consume(strip)?;
        context.progress().advance(OutputOptions::STAGE, count as u64);
    }
    Ok(())
}
