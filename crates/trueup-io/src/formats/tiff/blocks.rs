//! The pixels of a TIFF: strips or tiles, compressed in parallel.

use std::io::{Seek, Write};

use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use tiff::TiffError;
use tiff::encoder::{DirectoryEncoder, TiffKind};
use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use crate::encode::background::Background;
use crate::encode::failure::WriteFailure;
use crate::encode::options::Depth;
use crate::encode::pyramid::{TilePyramid, TileRow, Tiling};
use crate::encode::samples::{OutputSample, RGBA, flattened};
use crate::encode::strips::{STRIP_ROWS, for_each_strip};

/// Tiles that are compressed side by side, per thread, before they are written: enough that threads seldom wait.
const TILES_PER_THREAD: usize = 8;

/// How pixels become bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockForm {
    pub(super) depth: Depth,
    /// Samples of a pixel: 4, or 3 without alpha.
    pub(super) channels: usize,
    /// Whether they are compressed.
    pub(super) deflate: bool,
    /// What shows through where alpha is left out.
    pub(super) background: Background,
}

/// Where a block is in the file, in bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct WrittenBlock {
    offset: u64,
    length: u64,
}

/// Where the blocks of a page are in the file, in bytes.
#[derive(Debug, Default)]
pub(super) struct StoredBlocks {
    pub(super) offsets: Vec<u64>,
    pub(super) lengths: Vec<u64>,
}

impl StoredBlocks {
    fn add(&mut self, block: WrittenBlock) {
        self.offsets.push(block.offset);
        self.lengths.push(block.length);
    }
}

/// A file that takes blocks, one behind the other.
pub(super) trait BlockSink {
    /// Writes a block; tells where.
    fn write_block(&mut self, bytes: &[u8]) -> Result<WrittenBlock, WriteFailure>;
}

impl<W: Write + Seek, K: TiffKind> BlockSink for DirectoryEncoder<'_, W, K> {
    fn write_block(&mut self, bytes: &[u8]) -> Result<WrittenBlock, WriteFailure> {
        Ok(WrittenBlock { offset: self.write_data(bytes).map_err(failure)?, length: bytes.len() as u64 })
    }
}

/// Why a TIFF could not be written.
pub(super) fn failure(error: TiffError) -> WriteFailure {
    match error {
        TiffError::IoError(error) => WriteFailure::Io(error),
        other => WriteFailure::Io(std::io::Error::other(other)),
    }
}

/// Writes a picture in strips of [`STRIP_ROWS`] rows.
pub(super) fn write_strips(
    sink: &mut dyn BlockSink,
    picture: &dyn RowSource,
    form: BlockForm,
    context: &StageContext<'_>,
) -> Result<StoredBlocks, WriteFailure> {
    match form.depth {
        Depth::Auto | Depth::Eight => strips_of::<u8>(sink, picture, form, context),
        Depth::Sixteen => strips_of::<u16>(sink, picture, form, context),
        Depth::Float => strips_of::<f32>(sink, picture, form, context),
    }
}

/// Writes a picture and its smaller copies in tiles as they become ready; returns where the tiles of each level are,
/// row by row. Tiles in which nothing is, where there is alpha to say so, are stored once.
pub(super) fn write_tiles(
    sink: &mut dyn BlockSink,
    picture: &dyn RowSource,
    levels: Levels<'_>,
    form: BlockForm,
    context: &StageContext<'_>,
) -> Result<Vec<StoredBlocks>, WriteFailure> {
    match form.depth {
        Depth::Auto | Depth::Eight => tiles_of::<u8>(sink, picture, levels, form, context),
        Depth::Sixteen => tiles_of::<u16>(sink, picture, levels, form, context),
        Depth::Float => tiles_of::<f32>(sink, picture, levels, form, context),
    }
}

/// A picture and its smaller copies, cut into tiles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Levels<'a> {
    /// Width and height of the picture and of each copy.
    pub(super) sizes: &'a [[usize; 2]],
    /// Side of the tiles, in pixels.
    pub(super) side: usize,
}

fn strips_of<S: OutputSample>(
    sink: &mut dyn BlockSink,
    picture: &dyn RowSource,
    form: BlockForm,
    context: &StageContext<'_>,
) -> Result<StoredBlocks, WriteFailure> {
    let row = picture.width() * RGBA;
    let mut stored = StoredBlocks::default();
    // As many strips at a time as can be compressed side by side.
    let batch_rows = STRIP_ROWS * rayon::current_num_threads();
    for_each_strip::<S>(picture, batch_rows, context, &mut |batch| {
        let strips: Vec<&[S]> = batch.chunks(STRIP_ROWS * row).collect();
        let coded = make_all(strips.len(), &|index| {
            let rows = strips[index].len() / row;
            coded(strips[index].chunks_exact(row), [picture.width(), rows], form).map(Some)
        })?;
        for strip in coded.iter().flatten() {
            stored.add(sink.write_block(strip)?);
        }
        Ok(())
    })?;
    Ok(stored)
}

fn tiles_of<S: OutputSample>(
    sink: &mut dyn BlockSink,
    picture: &dyn RowSource,
    levels: Levels<'_>,
    form: BlockForm,
    context: &StageContext<'_>,
) -> Result<Vec<StoredBlocks>, WriteFailure> {
    let Levels { sizes, side } = levels;
    let tiling = Tiling { side, overlap: 0 };
    let mut pyramid = TilePyramid::<S>::new(sizes, tiling);
    let mut stored: Vec<StoredBlocks> = sizes.iter().map(|_| StoredBlocks::default()).collect();
    let mut empty: Option<WrittenBlock> = None;
    let columns: Vec<usize> = (0..tiling.count(picture.width())).collect();
    for_each_strip::<S>(picture, STRIP_ROWS.min(side), context, &mut |rows| {
        pyramid.push(rows, &mut |tiles| {
            for some in columns[..tiling.count(tiles.width)].chunks(TILES_PER_THREAD * rayon::current_num_threads()) {
                context.check_cancelled()?;
                let made = make_all(some.len(), &|index| tile(&tiles, some[index], tiling, form))?;
                for tile in made {
                    let block = match (tile, empty) {
                        (Some(tile), _) => sink.write_block(&tile)?,
                        (None, Some(block)) => block,
                        (None, None) => {
                            let nothing = vec![S::default(); side * RGBA];
                            let tile = coded(std::iter::repeat_n(&nothing[..], side), [side, side], form)?;
                            *empty.insert(sink.write_block(&tile)?)
                        }
                    };
                    stored[tiles.level].add(block);
                }
            }
            Ok(())
        })
    })?;
    Ok(stored)
}

/// Makes `count` blocks side by side, in their order.
fn make_all(
    count: usize,
    make: &(dyn Fn(usize) -> std::io::Result<Option<Vec<u8>>> + Sync),
) -> std::io::Result<Vec<Option<Vec<u8>>>> {
    (0..count).into_par_iter().map(make).collect()
}

/// One tile, coded; `None` if it is wholly transparent.
fn tile<S: OutputSample>(
    tiles: &TileRow<'_, S>,
    column: usize,
    tiling: Tiling,
    form: BlockForm,
) -> std::io::Result<Option<Vec<u8>>> {
    let columns = tiling.span(column, tiles.width);
    let is_transparent = |row: &[S]| row.as_chunks::<RGBA>().0.iter().all(|pixel| *pixel == [S::default(); RGBA]);
    if form.channels == RGBA && tiles.columns(columns.clone()).all(is_transparent) {
        return Ok(None);
    }
    coded(tiles.columns(columns), [tiling.side, tiling.side], form).map(Some)
}

/// Rows of RGBA as the bytes of a block of `width` x `height` pixels; what the rows do not fill is 0. Deflated, each
/// pixel is the difference from the one to its left.
///
/// # Source
/// TIFF 6.0 sections 14 (horizontal differencing) and 15 (tiles); Adobe Photoshop TIFF Technical Notes (deflate: a zlib
/// stream).
fn coded<'a, S: OutputSample>(
    rows: impl Iterator<Item = &'a [S]>,
    [width, height]: [usize; 2],
    form: BlockForm,
) -> std::io::Result<Vec<u8>> {
    let background = S::of(form.background);
    let row_bytes = width * form.channels * size_of::<S>();
    let (mut samples, mut bytes) = (Vec::new(), Vec::with_capacity(row_bytes * height));
    for row in rows {
        flattened(row, form.channels, background, &mut samples);
        samples.resize(width * form.channels, S::default());
        match form.deflate {
            true => S::append_differences(&samples, form.channels, &mut bytes),
            false => S::append(&samples, &mut bytes),
        }
    }
    bytes.resize(row_bytes * height, 0);
    if !form.deflate {
        return Ok(bytes);
    }
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(bytes.len() / 2), flate2::Compression::fast());
    encoder.write_all(&bytes)?;
    encoder.finish()
}
