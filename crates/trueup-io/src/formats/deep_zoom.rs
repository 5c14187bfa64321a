//! Deep Zoom: a folder of tiles of all sizes, and a small file that describes it.
//!
//! # Source
//! Microsoft, "Deep Zoom File Format Overview" (2011): level 0 is one pixel, every level twice the one before, the last
//! is the picture.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use jpeg_encoder::{ColorType as JpegColorType, Encoder as JpegEncoder};
use png::{BitDepth, ColorType as PngColorType, Encoder as PngEncoder};
use rayon::prelude::*;
use trueup_core::raster::RowSource;
use trueup_core::{Error, Result, StageContext};

use super::jpeg::write::set_sampling;
use super::png::{compression, failure};
use crate::encode::failure::WriteFailure;
use crate::encode::folder::PendingFolder;
use crate::encode::options::{DeepZoomFormat, Depth, OutputOptions};
use crate::encode::pending::{PendingFile, check_place};
use crate::encode::pyramid::{TilePyramid, TileRow, Tiling, level_sizes};
use crate::encode::samples::{OutputSample, RGBA, flattened};
use crate::encode::strips::{STRIP_ROWS, channels_of, for_each_strip};
use crate::format::{Format, LOSSLESS_BYTES, LOSSY_BYTES, SideLimit, Transparency, Writer, Writing};

/// The declaration. Sizes are of 32 bits, of which programs take half. Viewers of tiles know no profiles.
pub(crate) static DEEP_ZOOM: Format = Format {
    name: "Deep Zoom",
    extensions: &["dzi"],
    rare_extensions: &[],
    reading: None,
    writing: Some(Writing {
        depths: &[Depth::Eight],
        transparency: Transparency::With {
            has: |options| options.dzi_format == DeepZoomFormat::Png,
            case: "with PNG tiles",
            advice: "Set output.dzi_format to png",
        },
        sides: SideLimit { largest: (1 << 31) - 1, advice: "Write a smaller panorama." },
        has_profile: false,
        memory: "twice one row of tiles",
        bytes_per_pixel: |options| match options.dzi_format {
            DeepZoomFormat::Jpeg => LOSSY_BYTES,
            DeepZoomFormat::Png => LOSSLESS_BYTES,
        },
        writer: Writer::Files { write, check_places },
    }),
};

/// Writes NAME.dzi and the folder NAME_files; returns the bytes of all files together.
///
/// Both are made under other names and renamed when they are complete, the folder first: what the .dzi file describes
/// is there. An older folder of tiles is replaced.
fn write(path: &Path, picture: &dyn RowSource, options: &OutputOptions, context: &StageContext<'_>) -> Result<u64> {
    let mut description = PendingFile::create(path)?;
    let folder = tiles_folder(path);
    check_replaceable(&folder)?;
    let pending = PendingFolder::create(&folder)?;
    let bytes = write_tiles(pending.path(), picture, options, context).map_err(|failure| failure.at(&folder))?;
    let text = description_of(picture, options);
    description.file().write_all(text.as_bytes()).map_err(|error| Error::io("writing", path, error))?;
    context.check_cancelled()?;
    pending.commit()?;
    Ok(bytes + description.commit()?)
}

/// Checks that [`write`] could put its files in their places.
fn check_places(path: &Path) -> Result<()> {
    check_place(path)?;
    let folder = tiles_folder(path);
    check_replaceable(&folder)?;
    PendingFolder::create(&folder).map(drop)
}

/// `a/pano.dzi` has its tiles in `a/pano_files`.
fn tiles_folder(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push("_files");
    path.with_file_name(name)
}

/// Refuses to replace a folder that holds anything but the tiles of a Deep Zoom picture.
fn check_replaceable(folder: &Path) -> Result<()> {
    let reading = |error| Error::io("reading", folder, error);
    if !folder.is_dir() {
        // A file of that name is refused where the folder is made.
        return Ok(());
    }
    for level in std::fs::read_dir(folder).map_err(reading)? {
        let level = level.map_err(reading)?;
        let is_number = level.file_name().to_str().is_some_and(|name| name.parse::<u32>().is_ok());
        if !is_number || !level.path().is_dir() {
            return Err(foreign(folder, &level.path()));
        }
        for tile in std::fs::read_dir(level.path()).map_err(reading)? {
            let tile = tile.map_err(reading)?.path();
            if !is_tile(&tile) {
                return Err(foreign(folder, &tile));
            }
        }
    }
    Ok(())
}

/// Whether a file is named COLUMN_ROW.EXTENSION.
fn is_tile(path: &Path) -> bool {
    let is_number = |text: &str| text.parse::<u32>().is_ok();
    let stem = path.file_stem().and_then(|stem| stem.to_str()).and_then(|stem| stem.split_once('_'));
    let extension = path.extension().and_then(|extension| extension.to_str());
    stem.is_some_and(|(column, row)| is_number(column) && is_number(row))
        && extension.is_some_and(|extension| ["jpg", "jpeg", "png", "webp"].contains(&extension))
}

fn foreign(folder: &Path, found: &Path) -> Error {
    Error::input(
        folder.display(),
        format!("the folder of the tiles exists and holds something else, {}", found.display()),
        "Give the panorama another name, or move that folder away.",
    )
}

fn description_of(picture: &dyn RowSource, options: &OutputOptions) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <Image xmlns=\"http://schemas.microsoft.com/deepzoom/2008\" Format=\"{}\" Overlap=\"{}\" TileSize=\"{}\">\n  \
         <Size Width=\"{}\" Height=\"{}\"/>\n\
         </Image>\n",
        extension(options),
        options.dzi_overlap_px,
        options.dzi_tile_px,
        picture.width(),
        picture.height()
    )
}

/// How the tiles' names end.
fn extension(options: &OutputOptions) -> &'static str {
    match options.dzi_format {
        DeepZoomFormat::Jpeg => "jpg",
        DeepZoomFormat::Png => "png",
    }
}

/// Writes the tiles of all levels below `folder`; returns their bytes.
fn write_tiles(
    folder: &Path,
    picture: &dyn RowSource,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> std::result::Result<u64, WriteFailure> {
    let tiling = Tiling { side: options.dzi_tile_px, overlap: options.dzi_overlap_px };
    let sizes = level_sizes(picture.width(), picture.height(), |_, _| false);
    let folders: Vec<PathBuf> =
        (0..sizes.len()).map(|level| folder.join((sizes.len() - 1 - level).to_string())).collect();
    for folder in &folders {
        std::fs::create_dir(folder)?;
    }
    let channels = match options.dzi_format {
        DeepZoomFormat::Jpeg => 3,
        DeepZoomFormat::Png => channels_of(picture, options),
    };
    let written = AtomicU64::new(0);
    let mut pyramid = TilePyramid::<u8>::new(&sizes, tiling);
    for_each_strip::<u8>(picture, STRIP_ROWS, context, &mut |rows| {
        pyramid.push(rows, &mut |tiles| {
            (0..tiling.count(tiles.width)).into_par_iter().try_for_each(|column| {
                context.check_cancelled()?;
                let coded = tile(&tiles, column, tiling, channels, options)?;
                let name = format!("{column}_{}.{}", tiles.index, extension(options));
                std::fs::write(folders[tiles.level].join(name), &coded)?;
                written.fetch_add(coded.len() as u64, Ordering::Relaxed);
                Ok(())
            })
        })
    })?;
    Ok(written.into_inner())
}

/// One tile as a file.
fn tile(
    tiles: &TileRow<'_, u8>,
    column: usize,
    tiling: Tiling,
    channels: usize,
    options: &OutputOptions,
) -> std::result::Result<Vec<u8>, WriteFailure> {
    let columns = tiling.span(column, tiles.width);
    let background = u8::of(options.background);
    let (mut samples, mut row) = (Vec::new(), Vec::new());
    for rgba in tiles.columns(columns.clone()) {
        flattened(rgba, channels, background, &mut row);
        samples.extend_from_slice(&row);
    }
    // Tiles are at most 8192 + 2 * 8 pixels wide, so that the sizes fit 16 bits.
    let (width, height) = (columns.len() as u16, (samples.len() / channels / columns.len()) as u16);
    let mut coded = Vec::with_capacity(samples.len() / 4);
    match options.dzi_format {
        DeepZoomFormat::Jpeg => {
            let mut encoder = JpegEncoder::new(&mut coded, options.jpeg_quality);
            set_sampling(&mut encoder, options);
            encoder.encode(&samples, width, height, JpegColorType::Rgb).map_err(std::io::Error::other)?;
        }
        DeepZoomFormat::Png => {
            let mut encoder = PngEncoder::new(&mut coded as &mut dyn Write, u32::from(width), u32::from(height));
            encoder.set_color(if channels == RGBA { PngColorType::Rgba } else { PngColorType::Rgb });
            encoder.set_depth(BitDepth::Eight);
            encoder.set_compression(compression(options));
            let mut writer = encoder.write_header().map_err(failure)?;
            writer.write_image_data(&samples).map_err(failure)?;
            writer.finish().map_err(failure)?;
        }
    }
    Ok(coded)
}
