//! Panoramas to files, row by row. A file appears complete or not at all.

mod codecs;
mod folder;
mod jpeg;
mod metadata;
mod pending;
#[cfg(test)]
mod tests;
mod tiff_metadata;

use std::path::Path;

use rayon::prelude::*;
use trueup_core::options::StageOptions;
use trueup_core::raster::RowSource;
use trueup_core::{Error, Result, StageContext};

use crate::colour::{InSrgb, is_srgb};
use crate::format::PictureFormat;

use pending::PendingFile;

pub use folder::PendingFolder;
pub use metadata::Metadata;
#[cfg(test)]
pub(crate) use tiff_metadata::OF_JPEG;

trueup_core::choice! {
    /// How finely JPEG stores colour, relative to brightness.
    pub enum ChromaSubsampling {
        /// As finely as brightness.
        Full = "4:4:4",
        /// Half as finely across.
        HalfWidth = "4:2:2",
        /// Half as finely across and down, as cameras do.
        Quarter = "4:2:0",
    }
}

trueup_core::choice! {
    /// How hard PNG compression tries. The pixels are the same.
    pub enum PngCompression {
        /// In a fraction of the time, for a file about a fifth larger.
        Fast = "fast",
        /// The usual balance.
        Balanced = "balanced",
        /// Much slower for a slightly smaller file.
        High = "high",
    }
}

trueup_core::choice! {
    /// How TIFF strips are compressed. The pixels are the same.
    pub enum TiffCompression {
        /// Not at all: largest and fastest.
        None = "none",
        /// Deflate, after differencing.
        Deflate = "deflate",
    }
}

trueup_core::choice! {
    /// What shows through where the panorama is transparent and the format cannot say so.
    pub enum Background {
        /// Black.
        Black = "black",
        /// Middle gray.
        Gray = "gray",
        /// White.
        White = "white",
    }
}

trueup_core::choice! {
    /// Which colour space panoramas are written in.
    pub enum OutputProfile {
        /// That of the photographs, whose profile is embedded.
        Keep = "keep",
        /// sRGB, for places that ignore profiles; colours it does not have are clipped.
        Srgb = "srgb",
    }
}

trueup_core::choice! {
    /// What panoramas tell of the photographs they are made of.
    pub enum MetadataKept {
        /// Camera, lens, exposure, time and place.
        Keep = "keep",
        /// All but the place.
        NoLocation = "no-location",
        /// Nothing. The colour profile and the crop of a spherical panorama, which viewers need, are written all the same.
        None = "none",
    }
}

impl Background {
    /// The value of all three channels.
    fn value(self) -> u8 {
        match self {
            Self::Black => 0,
            Self::Gray => 128,
            Self::White => 255,
        }
    }
}

trueup_core::options! {
    /// How panoramas are written. The format follows from the file's extension; WebP is always lossless.
    pub struct OutputOptions("output") {
        /// JPEG quality on the usual scale of the Independent JPEG Group.
        jpeg_quality: u8 = 92, between(1.0, 100.0), "";
        /// How finely JPEG stores colour.
        jpeg_subsampling: ChromaSubsampling = ChromaSubsampling::Quarter, Allowed::Any, "";
        /// How hard PNG compression tries.
        png_compression: PngCompression = PngCompression::Fast, Allowed::Any, "";
        /// How TIFF strips are compressed.
        tiff_compression: TiffCompression = TiffCompression::Deflate, Allowed::Any, "";
        /// What shows through transparent parts in JPEG, which has no transparency.
        background: Background = Background::Black, Allowed::Any, "";
        /// Which colour space panoramas are written in.
        profile: OutputProfile = OutputProfile::Keep, Allowed::Any, "";
        /// What panoramas tell of their photographs, in EXIF and XMP.
        metadata: MetadataKept = MetadataKept::Keep, Allowed::Any, "";
    }
}

/// Writes a panorama to `path`, in the format its extension names; returns the file's length in bytes.
///
/// `metadata` describes the picture: its colour profile, which [`OutputOptions::profile`] may have it converted from, and
/// the EXIF and XMP to embed.
///
/// Rows are asked for in strips, in parallel on the current thread pool; only WebP needs a copy of the whole. JPEG is
/// laid over the background, the other formats keep transparency. The bytes written depend on the picture and the
/// options alone. The file is written under another name in the same folder and renamed when it is complete, so that
/// on any error nothing is left behind and an existing file stays as it was.
///
/// # Errors
/// [`Error::Options`] for options out of range; [`Error::Unsupported`] for other extensions; [`Error::Limits`] for
/// pictures larger than the format can hold; [`Error::Input`] for an empty picture or a folder that does not exist;
/// [`Error::Io`] if the operating system refuses; [`Error::Cancelled`].
pub fn write(
    path: &Path,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<u64> {
    options.check()?;
    if let (OutputProfile::Srgb, Some(icc)) = (options.profile, &metadata.icc)
        && !is_srgb(icc)
    {
        let options = OutputOptions { profile: OutputProfile::Keep, ..options.clone() };
        return write(path, &InSrgb::new(picture, icc)?, &metadata.in_srgb(), &options, context);
    }
    let format = output_format(path)?;
    check_size(path, format, picture.width(), picture.height())?;
    let mut pending = PendingFile::create(path)?;
    context.progress().begin(OutputOptions::STAGE, picture.height() as u64);
    let written = match format {
        PictureFormat::Jpeg => jpeg::write(pending.file(), picture, metadata, options, context),
        PictureFormat::Png => codecs::write_png(pending.file(), picture, metadata, options, context),
        PictureFormat::Tiff => codecs::write_tiff(pending.file(), picture, metadata, options, context),
        PictureFormat::WebP => codecs::write_webp(pending.file(), picture, metadata, context),
    };
    context.progress().finish(OutputOptions::STAGE);
    written.map_err(|failure| failure.at(path))?;
    context.check_cancelled()?;
    pending.commit()
}

/// Checks that a panorama could be written to `path`, before the long work that makes one: the extension names a format,
/// the folder exists and takes files, and `path` is no folder itself. Nothing is left behind.
///
/// # Errors
/// As [`write()`].
pub fn check_writable(path: &Path) -> Result<()> {
    output_format(path)?;
    check_place(path)
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
/// [`Error::Input`] if the folder does not exist, [`Error::Io`] if the operating system refuses.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut pending = PendingFile::create(path)?;
    std::io::Write::write_all(pending.file(), bytes).map_err(|error| Error::io("writing", path, error))?;
    pending.commit().map(drop)
}

fn output_format(path: &Path) -> Result<PictureFormat> {
    PictureFormat::of_extension(path).ok_or_else(|| {
        let what = match path.extension() {
            Some(extension) => format!("writing {} as .{}", path.display(), extension.to_string_lossy()),
            None => format!("writing {} without an extension", path.display()),
        };
        Error::Unsupported { what, hint: "End the name in .jpg, .jpeg, .png, .tif, .tiff or .webp.".to_owned() }
    })
}

/// Refuses what a format cannot hold.
///
/// # Source
/// JPEG: 16-bit sizes, ITU-T T.81 B.2.2. PNG: 31-bit sizes, W3C PNG 11.2.1. WebP: 14-bit sizes, of which the common
/// decoders take one less, RFC 9649 and libwebp.
fn check_size(path: &Path, format: PictureFormat, width: usize, height: usize) -> Result<()> {
    let (largest, instead) = match format {
        PictureFormat::Jpeg => (65_535, "Write .tif or .png instead, or a smaller panorama."),
        PictureFormat::WebP => (16_383, "Write .jpg, .tif or .png instead, or a smaller panorama."),
        PictureFormat::Png | PictureFormat::Tiff => ((1 << 31) - 1, "Write a smaller panorama."),
    };
    if width == 0 || height == 0 {
        return Err(Error::input(path.display(), "the panorama is empty", "There is nothing to write."));
    }
    let bytes = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(RGBA));
    if width.max(height) > largest || bytes.is_none() {
        return Err(Error::Limits {
            subject: path.display().to_string(),
            needed: format!("{width} x {height} px"),
            allowed: format!("{largest} px per side"),
            hint: instead.to_owned(),
        });
    }
    Ok(())
}

/// Bytes of an RGBA pixel.
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
fn for_each_strip(
    picture: &dyn RowSource,
    rows: usize,
    context: &StageContext,
    mut consume: impl FnMut(&[u8]) -> std::result::Result<(), Failure>,
) -> std::result::Result<(), Failure> {
    let row_bytes = picture.width() * RGBA;
    let mut strip = vec![0; row_bytes * rows.min(picture.height())];
    for first in (0..picture.height()).step_by(rows.max(1)) {
        context.check_cancelled()?;
        let count = rows.min(picture.height() - first);
        let strip = &mut strip[..count * row_bytes];
        strip
            .par_chunks_exact_mut(row_bytes)
            .enumerate()
            .try_for_each(|(row, pixels)| picture.rgba8_row(first + row, pixels))?;
        consume(strip)?;
        context.progress().advance(OutputOptions::STAGE, count as u64);
    }
    Ok(())
}
