//! Writing TIFF and BigTIFF: in strips, or in tiles with smaller copies; one page or several.

use std::io::{BufWriter, Seek, Write};

use tiff::encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use super::blocks::{BlockForm, Levels, failure, write_strips, write_tiles};
use super::directory::{BlockLayout, PageMetadata, PageTags, write_directory};
use super::metadata::write_directories;
use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::{BigTiff, OutputOptions, TiffCompression, TiffLayout};
use crate::encode::pyramid::level_sizes;
use crate::encode::samples::RGBA;
use crate::encode::strips::{BUFFER_BYTES, STRIP_ROWS, channels_of};
use crate::format::{Output, SideLimit};

pub(crate) use super::directory::PagePlace;

/// Pixel bytes from which a TIFF is written as BigTIFF: 32-bit offsets end at 4 GiB, and incompressible data and the
/// directory need some room beyond the pixels.
const BIG_TIFF_BYTES: u64 = 4_000_000_000;

/// Pixels from which a picture is written in tiles, unless the options say: beyond what programs that hold whole
/// pictures open without effort, viewers that read only what they show are what it is for.
const TILED_FROM_PIXELS: usize = 1 << 26;

/// The longest side of a TIFF: readers hold sizes in signed numbers of 32 bits.
pub(crate) const SIDES: SideLimit = SideLimit { largest: (1 << 31) - 1, advice: "Write a smaller panorama." };

/// Writes a TIFF of one picture.
pub(crate) fn write(
    file: &mut dyn Output,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> Result<(), WriteFailure> {
    let form = PageForm::of(picture, options);
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let is_big = form.is_big(form.pixels_in_blocks([picture.width(), picture.height()]), options);
    TiffPages::begin(&mut output, is_big)?.add(picture, metadata, form, None, context)?;
    output.flush()?;
    Ok(())
}

/// A TIFF that pages are added to.
pub(crate) enum TiffPages<'a> {
    Classic(TiffEncoder<&'a mut dyn Output, TiffKindStandard>),
    Big(TiffEncoder<&'a mut dyn Output, TiffKindBig>),
}

impl<'a> TiffPages<'a> {
    /// A file without pages, with 64-bit offsets or with 32-bit ones.
    pub(crate) fn begin(output: &'a mut dyn Output, is_big: bool) -> Result<Self, WriteFailure> {
        Ok(match is_big {
            true => Self::Big(TiffEncoder::new_big(output).map_err(failure)?),
            false => Self::Classic(TiffEncoder::new(output).map_err(failure)?),
        })
    }

    /// Writes a picture as the next page, with the pages of its smaller copies after it.
    pub(crate) fn add(
        &mut self,
        picture: &dyn RowSource,
        metadata: &Metadata,
        form: PageForm,
        place: Option<&PagePlace<'_>>,
        context: &StageContext<'_>,
    ) -> Result<(), WriteFailure> {
        match self {
            Self::Classic(encoder) => write_picture(encoder, picture, metadata, form, place, context),
            Self::Big(encoder) => write_picture(encoder, picture, metadata, form, place, context),
        }
    }
}

/// How the pages of a file are written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PageForm {
    blocks: BlockForm,
    /// Side of the tiles; `None` for strips.
    tile: Option<usize>,
    overviews: bool,
}

impl PageForm {
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

    /// Layers have alpha, and tiles unless strips are asked for: tiles in which nothing is take no room.
    pub(crate) fn of_layers(options: &OutputOptions) -> Self {
        let tile = match options.tiff_layout {
            TiffLayout::Strips => None,
            TiffLayout::Auto | TiffLayout::Tiles256 => Some(DEFAULT_TILE_PX),
            TiffLayout::Tiles512 => Some(512),
        };
        Self { overviews: false, ..Self::new(RGBA, tile, options) }
    }

    fn new(channels: usize, tile: Option<usize>, options: &OutputOptions) -> Self {
        let deflate = options.tiff_compression == TiffCompression::Deflate;
        let blocks = BlockForm { depth: options.depth, channels, deflate, background: options.background };
        Self { blocks, tile, overviews: options.tiff_overviews && tile.is_some() }
    }

    /// Pixels that the blocks of a page of this size hold: tiles reach over its borders.
    fn pixels_in_blocks(&self, size: [usize; 2]) -> u64 {
        let [width, height] = size.map(|side| side.next_multiple_of(self.tile.unwrap_or(1)) as u64);
        width.saturating_mul(height)
    }

    /// Most pixels that take room of so many layers, which have `pixels` together, on a panorama of this size;
    /// `are_whole` says that their pages are as large as that.
    pub(crate) fn pixels_of_layers(&self, pixels: u64, count: usize, whole: [usize; 2], are_whole: bool) -> u64 {
        let count = count as u64;
        let all = self.pixels_in_blocks(whole).saturating_mul(count);
        match self.tile {
            // Where nothing is, next to nothing is left of it by compression.
            _ if self.blocks.deflate => pixels,
            None if are_whole => all,
            None => pixels,
            // Empty tiles are stored once, those that a layer reaches into whole: at two of its sides, or at four if it
            // lies on the panorama.
            Some(side) => {
                let reach = side as u64 * if are_whole { 2 } else { 1 };
                let sides = whole[0] as u64 + whole[1] as u64;
                let beyond = reach.saturating_mul(sides.saturating_add(reach)).saturating_mul(count);
                all.min(pixels.saturating_add(beyond))
            }
        }
    }

    /// Whether the offsets of a file with so many pixels need 64 bits.
    pub(crate) fn is_big(&self, pixels: u64, options: &OutputOptions) -> bool {
        let pixel_bytes = self.blocks.channels as u64 * u64::from(self.blocks.depth.sample_bytes());
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
    form: PageForm,
    place: Option<&PagePlace<'_>>,
    context: &StageContext<'_>,
) -> Result<(), WriteFailure> {
    let hanging = write_directories(encoder, metadata).map_err(failure)?;
    let page = |[width, height]: [usize; 2], level, blocks| PageTags {
        width: width as u32,
        height: height as u32,
        is_reduced: level > 0,
        blocks,
        form: form.blocks,
        place: place.filter(|_| level == 0),
        metadata: (level == 0).then_some(PageMetadata { metadata, hanging: &hanging }),
    };
    // Blocks are written as they are ready, the directories that tell where they are behind them.
    let mut directory = encoder.image_directory().map_err(failure)?;
    let Some(side) = form.tile else {
        let stored = write_strips(&mut directory, picture, form.blocks, context)?;
        let size = [picture.width(), picture.height()];
        return write_directory(directory, page(size, 0, BlockLayout::Strips(STRIP_ROWS)), &stored);
    };
    let sizes = match form.overviews {
        true => level_sizes(picture.width(), picture.height(), |width, height| width.max(height) <= side),
        false => vec![[picture.width(), picture.height()]],
    };
    let levels = write_tiles(&mut directory, picture, Levels { sizes: &sizes, side }, form.blocks, context)?;
    write_directory(directory, page(sizes[0], 0, BlockLayout::Tiles(side)), &levels[0])?;
    for (level, stored) in levels.iter().enumerate().skip(1) {
        let directory = encoder.image_directory().map_err(failure)?;
        write_directory(directory, page(sizes[level], level, BlockLayout::Tiles(side)), stored)?;
    }
    Ok(())
}
