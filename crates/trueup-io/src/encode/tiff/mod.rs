//! TIFF and BigTIFF: in strips, or in tiles with smaller copies; one page or several.

mod blocks;
mod directory;
mod layers;

use std::io::{BufWriter, Seek, Write};

use tiff::encoder::{TiffEncoder, TiffKind};
use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use super::pyramid::level_sizes;
use super::samples::Sample;
use super::tiff_metadata::write_directories;
use super::{BigTiff, Depth, Failure, Metadata, OutputOptions, TiffCompression, TiffLayout, channels_of, from_tiff};
use blocks::{BlockForm, write_strips, write_tiles};
use directory::{Blocks, Page, Place, write_directory};

#[cfg(test)]
pub(super) use layers::write_pages;
pub use layers::{LayerPage, LayerSet, check_layers_place, write_layers};

/// Bytes collected before the operating system is called.
const BUFFER_BYTES: usize = 1 << 20;

/// Pixel bytes from which a TIFF is written as BigTIFF: 32-bit offsets end at 4 GiB, and incompressible data and the
/// directory need some room beyond the pixels.
const BIG_TIFF_BYTES: u64 = 4_000_000_000;

/// Pixels from which a picture is written in tiles, unless the options say: beyond what programs that hold whole pictures
/// open without effort, viewers that read only what they show are what it is for.
const TILED_FROM_PIXELS: usize = 1 << 26;

/// Longest side of a picture: readers hold sizes in signed numbers of 32 bits.
pub(super) const MAX_SIDE: usize = (1 << 31) - 1;

/// Rows of a strip, and rows that are made at a time.
const STRIP_ROWS: usize = 64;

/// Writes a TIFF.
pub(super) fn write(
    file: &mut (impl Write + Seek),
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<(), Failure> {
    let form = Form::of(picture, options);
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    if form.is_big(picture.width() as u64 * picture.height() as u64, options) {
        let mut encoder = TiffEncoder::new_big(&mut output).map_err(from_tiff)?;
        write_picture(&mut encoder, picture, metadata, form, None, context)?;
    } else {
        let mut encoder = TiffEncoder::new(&mut output).map_err(from_tiff)?;
        write_picture(&mut encoder, picture, metadata, form, None, context)?;
    }
    output.flush()?;
    Ok(())
}

/// How the pages of a file are written.
#[derive(Debug, Clone, Copy)]
struct Form {
    blocks: BlockForm,
    depth: Depth,
    /// Side of the tiles; `None` for strips.
    tile: Option<usize>,
    overviews: bool,
}

impl Form {
    fn of(picture: &dyn RowSource, options: &OutputOptions) -> Self {
        let is_large = picture.width().saturating_mul(picture.height()) >= TILED_FROM_PIXELS;
        let tile = match options.tiff_layout {
            TiffLayout::Auto if is_large => Some(DEFAULT_TILE_PX),
            TiffLayout::Auto | TiffLayout::Strips => None,
            TiffLayout::Tiles256 => Some(256),
            TiffLayout::Tiles512 => Some(512),
        };
        Self::new(channels_of(picture, options), tile, options)
    }

    fn new(channels: usize, tile: Option<usize>, options: &OutputOptions) -> Self {
        let deflate = options.tiff_compression == TiffCompression::Deflate;
        let blocks = BlockForm { channels, deflate, background: options.background };
        Self { blocks, depth: options.depth, tile, overviews: options.tiff_overviews && tile.is_some() }
    }

    /// Whether the offsets of a file with so many pixels need 64 bits.
    fn is_big(&self, pixels: u64, options: &OutputOptions) -> bool {
        let pixel_bytes = self.blocks.channels as u64 * u64::from(self.depth.sample_bytes());
        let bytes = pixels.saturating_mul(pixel_bytes);
        // All smaller copies together take a third more.
        let bytes = if self.overviews { bytes.saturating_add(bytes / 3) } else { bytes };
        options.tiff_big == BigTiff::Always || bytes > BIG_TIFF_BYTES
    }
}

/// Side of the tiles where the options do not say.
const DEFAULT_TILE_PX: usize = 256;

/// Writes a picture as the next page, with the pages of its smaller copies after it.
fn write_picture<W: Write + Seek, K: TiffKind>(
    encoder: &mut TiffEncoder<W, K>,
    picture: &dyn RowSource,
    metadata: &Metadata,
    form: Form,
    place: Option<&Place<'_>>,
    context: &StageContext,
) -> Result<(), Failure> {
    match form.depth {
        Depth::Auto | Depth::Eight => write_samples::<u8, W, K>(encoder, picture, metadata, form, place, context),
        Depth::Sixteen => write_samples::<u16, W, K>(encoder, picture, metadata, form, place, context),
        Depth::Float => write_samples::<f32, W, K>(encoder, picture, metadata, form, place, context),
    }
}

fn write_samples<S: Sample, W: Write + Seek, K: TiffKind>(
    encoder: &mut TiffEncoder<W, K>,
    picture: &dyn RowSource,
    metadata: &Metadata,
    form: Form,
    place: Option<&Place<'_>>,
    context: &StageContext,
) -> Result<(), Failure> {
    let hanging = write_directories(encoder, metadata).map_err(from_tiff)?;
    let page = |[width, height]: [usize; 2], level, blocks| Page {
        width: width as u32,
        height: height as u32,
        is_reduced: level > 0,
        blocks,
        form: form.blocks,
        place: place.filter(|_| level == 0),
        metadata: (level == 0).then_some((metadata, &hanging)),
    };
    // Blocks are written as they are ready, the directories that tell where they are behind them.
    let mut directory = encoder.image_directory().map_err(from_tiff)?;
    let Some(side) = form.tile else {
        let stored = write_strips::<S, W, K>(&mut directory, picture, form.blocks, context)?;
        let size = [picture.width(), picture.height()];
        return write_directory::<S, W, K>(directory, page(size, 0, Blocks::Strips(STRIP_ROWS)), &stored);
    };
    let sizes = match form.overviews {
        true => level_sizes(picture.width(), picture.height(), |width, height| width.max(height) <= side),
        false => vec![[picture.width(), picture.height()]],
    };
    let levels = write_tiles::<S, W, K>(&mut directory, picture, &sizes, side, form.blocks, context)?;
    write_directory::<S, W, K>(directory, page(sizes[0], 0, Blocks::Tiles(side)), &levels[0])?;
    for (level, stored) in levels.iter().enumerate().skip(1) {
        let directory = encoder.image_directory().map_err(from_tiff)?;
        write_directory::<S, W, K>(directory, page(sizes[level], level, Blocks::Tiles(side)), stored)?;
    }
    Ok(())
}
