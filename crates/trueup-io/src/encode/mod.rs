//! Panoramas to files, row by row. A file appears complete or not at all.

mod codecs;
mod deep_zoom;
mod expected;
mod folder;
#[cfg(test)]
mod format_tests;
mod jpeg;
mod labels;
mod metadata;
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

use crate::colour::{InSrgb, is_srgb};
use crate::format::{OutputFormat, PictureFormat};

use codecs::from_tiff;
use pending::PendingFile;
use samples::Sample;

pub use expected::expected_bytes;
pub use folder::PendingFolder;
pub use labels::{LabelMap, NOTHING, check_labels_place, write_labels};
pub use metadata::Metadata;
pub use tiff::{LayerPage, LayerSet, check_layers_place, write_layers};
#[cfg(test)]
pub(crate) use tiff_metadata::OF_JPEG;
pub use unfinished::abandon_unfinished;

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
    /// Bits of a sample.
    pub enum Depth {
        /// 16 where a photograph has more than 8 and the format can hold them, else 8.
        Auto = "auto",
        /// 8 bits.
        Eight = "8",
        /// 16 bits: PNG and TIFF.
        Sixteen = "16",
        /// Linear light as 32-bit floating point numbers, 1 for white: TIFF.
        Float = "float",
    }
}

trueup_core::choice! {
    /// Whether pictures are written with transparency.
    pub enum Alpha {
        /// Where it is not certain that every pixel is opaque.
        Auto = "auto",
        /// Always, where the format can.
        Keep = "keep",
        /// Never: what is transparent shows the background.
        Drop = "drop",
    }
}

trueup_core::choice! {
    /// How the pixels of a TIFF are cut up.
    pub enum TiffLayout {
        /// Strips, and tiles of 256 pixels from 67 megapixels on.
        Auto = "auto",
        /// Strips of rows, which every program reads.
        Strips = "strips",
        /// Tiles of 256 pixels.
        Tiles256 = "256",
        /// Tiles of 512 pixels.
        Tiles512 = "512",
    }
}

trueup_core::choice! {
    /// Whether a TIFF has 64-bit offsets, which files beyond 4 GiB need and some programs do not read.
    pub enum BigTiff {
        /// Where its pixels could take more than 4 GB.
        Auto = "auto",
        /// Always.
        Always = "always",
    }
}

trueup_core::choice! {
    /// Format of the tiles of Deep Zoom pictures.
    pub enum DeepZoomFormat {
        /// Small; no transparency.
        Jpeg = "jpg",
        /// Lossless.
        Png = "png",
    }
}

trueup_core::choice! {
    /// How large the pages of a file of layers are.
    pub enum LayerExtent {
        /// As large as the panorama: they lie on each other in every program that opens pages.
        Canvas = "canvas",
        /// Only the photograph's bounding box, with its place: for programs that heed it (GIMP, Hugin, enblend).
        Cropped = "cropped",
    }
}

trueup_core::choice! {
    /// How TIFF strips and tiles are compressed. The pixels are the same.
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
        /// Bits of a sample. JPEG, WebP and Deep Zoom have 8.
        depth: Depth = Depth::Auto, Allowed::Any, "";
        /// Whether PNG, TIFF, WebP and Deep Zoom in PNG have transparency.
        alpha: Alpha = Alpha::Auto, Allowed::Any, "";
        /// JPEG quality on the usual scale of the Independent JPEG Group.
        jpeg_quality: u8 = 92, between(1.0, 100.0), "";
        /// How finely JPEG stores colour.
        jpeg_subsampling: ChromaSubsampling = ChromaSubsampling::Quarter, Allowed::Any, "";
        /// How hard PNG compression tries.
        png_compression: PngCompression = PngCompression::Fast, Allowed::Any, "";
        /// How TIFF strips and tiles are compressed.
        tiff_compression: TiffCompression = TiffCompression::Deflate, Allowed::Any, "";
        /// How the pixels of a TIFF are cut up.
        tiff_layout: TiffLayout = TiffLayout::Auto, Allowed::Any, "";
        /// Whether tiled TIFFs have smaller copies (overviews, pyramid) for viewers, as pages of their own.
        tiff_overviews: bool = true, Allowed::Any, "";
        /// Whether a TIFF is a BigTIFF.
        tiff_big: BigTiff = BigTiff::Auto, Allowed::Any, "";
        /// Side of Deep Zoom tiles, without what overlaps.
        dzi_tile_px: usize = 254, between(16.0, 8192.0), "px";
        /// By how much Deep Zoom tiles reach into their neighbours.
        dzi_overlap_px: usize = 1, between(0.0, 8.0), "px";
        /// Format of Deep Zoom tiles.
        dzi_format: DeepZoomFormat = DeepZoomFormat::Jpeg, Allowed::Any, "";
        /// How large the pages of a file of layers are.
        layer_extent: LayerExtent = LayerExtent::Canvas, Allowed::Any, "";
        /// What shows through transparent parts where there is no transparency, as in JPEG.
        background: Background = Background::Black, Allowed::Any, "";
        /// Which colour space panoramas are written in. Deep Zoom tiles and floating point samples are in sRGB's.
        profile: OutputProfile = OutputProfile::Keep, Allowed::Any, "";
        /// What panoramas tell of their photographs, in EXIF and XMP.
        metadata: MetadataKept = MetadataKept::Keep, Allowed::Any, "";
    }
}

impl OutputOptions {
    /// These options with the depth decided: [`Depth::Auto`] becomes 16 where `photograph_bits`, the most bits a sample of
    /// the photographs has, is above 8 and the format of `path` can hold it, else 8.
    pub fn with_depth_for(&self, path: &Path, photograph_bits: u16) -> Self {
        let deep = photograph_bits > 8
            && matches!(
                OutputFormat::of_extension(path),
                Some(OutputFormat::Picture(PictureFormat::Png | PictureFormat::Tiff))
            );
        let depth = match self.depth {
            Depth::Auto if deep => Depth::Sixteen,
            Depth::Auto => Depth::Eight,
            chosen => chosen,
        };
        Self { depth, ..self.clone() }
    }
}

/// Writes a panorama to `path`, in the format its extension names; returns the file's length in bytes, for Deep Zoom that
/// of all files.
///
/// `metadata` describes the picture: its colour profile, which [`OutputOptions::profile`] may have it converted from, and
/// the EXIF and XMP to embed; Deep Zoom has none.
///
/// Rows are asked for in strips, in parallel on the current thread pool; only WebP needs a copy of the whole. JPEG is
/// laid over the background, the other formats keep transparency unless [`OutputOptions::alpha`] says otherwise. A depth
/// of [`Depth::Auto`] is taken for 8 bits, see [`OutputOptions::with_depth_for`]. The bytes written depend on the picture
/// and the options alone. The file is written under another name in the same folder and renamed when it is complete, so
/// that on any error nothing is left behind and an existing file stays as it was.
///
/// # Errors
/// [`Error::Options`] for options out of range; [`Error::Unsupported`] for other extensions, or a depth that the format
/// has not; [`Error::Limits`] for pictures larger than the format can hold; [`Error::Input`] for an empty picture or a
/// folder that does not exist; [`Error::Io`] if the operating system refuses; [`Error::Cancelled`]; and what the picture
/// returns.
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
/// that has the depth asked for, the folder exists and takes files, and `path` is no folder itself. Nothing is left
/// behind.
///
/// # Errors
/// As [`write()`].
pub fn check_writable(path: &Path, options: &OutputOptions) -> Result<()> {
    match output_format(path, options)? {
        OutputFormat::DeepZoom => deep_zoom::check_places(path),
        OutputFormat::Picture(_) => check_place(path),
    }
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

fn output_format(path: &Path, options: &OutputOptions) -> Result<OutputFormat> {
    let format = OutputFormat::of_extension(path).ok_or_else(|| {
        let what = match path.extension() {
            Some(extension) => format!("writing {} as .{}", path.display(), extension.to_string_lossy()),
            None => format!("writing {} without an extension", path.display()),
        };
        Error::Unsupported { what, hint: "End the name in .jpg, .jpeg, .png, .tif, .tiff, .webp or .dzi.".to_owned() }
    })?;
    let (what, has) = match options.depth {
        Depth::Auto | Depth::Eight => return Ok(format),
        Depth::Sixteen => ("16 bits a sample", &[PictureFormat::Png, PictureFormat::Tiff][..]),
        Depth::Float => ("floating point samples", &[PictureFormat::Tiff][..]),
    };
    match format {
        OutputFormat::Picture(picture) if has.contains(&picture) => Ok(format),
        _ => Err(Error::Unsupported {
            what: format!("writing {} with {what}", path.display()),
            hint: match options.depth {
                Depth::Float => "End the name in .tif, or leave output.depth at auto.",
                _ => "End the name in .png or .tif, or leave output.depth at auto.",
            }
            .to_owned(),
        }),
    }
}

/// The longest side that a format can hold, and what to do about a longer one.
///
/// # Source
/// JPEG: 16-bit sizes, ITU-T T.81 B.2.2. PNG: 31-bit sizes, W3C PNG 11.2.1. WebP: 14-bit sizes, of which the common
/// decoders take one less, RFC 9649 and libwebp. Deep Zoom: 32-bit sizes, of which programs take half.
fn largest_side(format: OutputFormat) -> (usize, &'static str) {
    const SIGNED: usize = (1 << 31) - 1;
    match format {
        OutputFormat::Picture(PictureFormat::Jpeg) => {
            (65_535, "Write .tif, .dzi or .png instead, or a smaller panorama.")
        }
        OutputFormat::Picture(PictureFormat::WebP) => {
            (16_383, "Write .jpg, .tif or .png instead, or a smaller panorama.")
        }
        OutputFormat::Picture(PictureFormat::Png) | OutputFormat::DeepZoom => (SIGNED, "Write a smaller panorama."),
        OutputFormat::Picture(PictureFormat::Tiff) => (tiff::MAX_SIDE, "Write a smaller panorama."),
    }
}

/// Refuses what a format cannot hold.
fn check_sides(path: &Path, (largest, instead): (usize, &str), width: usize, height: usize) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(Error::input(path.display(), "the panorama is empty", "There is nothing to write."));
    }
    // Rows and tiles are held in the widest samples, 32-bit floating point numbers.
    let bytes = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(RGBA * size_of::<f32>()));
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

/// Samples of a pixel in the file: 4, or 3 without alpha.
fn channels_of(picture: &dyn RowSource, options: &OutputOptions) -> usize {
    match options.alpha {
        Alpha::Keep => RGBA,
        Alpha::Drop => RGBA - 1,
        Alpha::Auto => RGBA - usize::from(picture.is_opaque()),
    }
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
