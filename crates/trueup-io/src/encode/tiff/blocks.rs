//! The pixels of a TIFF: strips or tiles, compressed in parallel.

use std::io::{Seek, Write};

use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use tiff::encoder::{DirectoryEncoder, TiffKind};
use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use super::STRIP_ROWS;
use crate::encode::pyramid::{Pyramid, TileRow, Tiling};
use crate::encode::samples::{Sample, flattened};
use crate::encode::{Background, Failure, RGBA, for_each_strip, from_tiff};

/// Tiles that are compressed side by side, per thread, before they are written: enough that threads seldom wait.
const TILES_PER_THREAD: usize = 8;

/// How pixels become bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockForm {
    /// Samples of a pixel: 4, or 3 without alpha.
    pub(super) channels: usize,
    /// Whether they are compressed.
    pub(super) deflate: bool,
    /// What shows through where alpha is left out.
    pub(super) background: Background,
}

/// Where the blocks of a page are in the file.
#[derive(Debug, Default)]
pub(super) struct Stored {
    pub(super) offsets: Vec<u64>,
    pub(super) lengths: Vec<u64>,
}

impl Stored {
    fn add(&mut self, (offset, length): (u64, u64)) {
        self.offsets.push(offset);
        self.lengths.push(length);
    }
}

/// Writes a picture in strips of [`STRIP_ROWS`] rows.
pub(super) fn write_strips<S: Sample, W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    picture: &dyn RowSource,
    form: BlockForm,
    context: &StageContext,
) -> Result<Stored, Failure> {
    let row = picture.width() * RGBA;
    let mut stored = Stored::default();
    // As many strips at a time as can be compressed side by side.
    let batch_rows = STRIP_ROWS * rayon::current_num_threads();
    for_each_strip::<S>(picture, batch_rows, context, |batch| {
        let strips = batch.par_chunks(STRIP_ROWS * row).map(|strip| {
            let rows = strip.len() / row;
            coded(strip.chunks_exact(row), [picture.width(), rows], form)
        });
        for strip in strips.collect::<std::io::Result<Vec<_>>>()? {
            stored.add(write_block(directory, &strip)?);
        }
        Ok(())
    })?;
    Ok(stored)
}

/// Writes a picture and its smaller copies in tiles as they become ready; returns where the tiles of each level are, row by
/// row. Tiles in which nothing is, where there is alpha to say so, are stored once.
pub(super) fn write_tiles<S: Sample, W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    picture: &dyn RowSource,
    sizes: &[[usize; 2]],
    side: usize,
    form: BlockForm,
    context: &StageContext,
) -> Result<Vec<Stored>, Failure> {
    let tiling = Tiling { side, overlap: 0 };
    let mut pyramid = Pyramid::<S>::new(sizes, tiling);
    let mut levels: Vec<Stored> = sizes.iter().map(|_| Stored::default()).collect();
    let mut empty: Option<(u64, u64)> = None;
    let columns: Vec<usize> = (0..tiling.count(picture.width())).collect();
    for_each_strip::<S>(picture, STRIP_ROWS.min(side), context, |rows| {
        pyramid.push(rows, &mut |tiles| {
            for some in columns[..tiling.count(tiles.width)].chunks(TILES_PER_THREAD * rayon::current_num_threads()) {
                context.check_cancelled()?;
                let made = some.par_iter().map(|&column| tile(&tiles, column, tiling, form));
                for tile in made.collect::<std::io::Result<Vec<_>>>()? {
                    let block = match (tile, empty) {
                        (Some(tile), _) => write_block(directory, &tile)?,
                        (None, Some(block)) => block,
                        (None, None) => {
                            let nothing = vec![S::default(); side * RGBA];
                            let tile = coded(std::iter::repeat_n(&nothing[..], side), [side, side], form)?;
                            *empty.insert(write_block(directory, &tile)?)
                        }
                    };
                    levels[tiles.level].add(block);
                }
            }
            Ok(())
        })
    })?;
    Ok(levels)
}

/// One tile, coded; `None` if it is wholly transparent.
fn tile<S: Sample>(
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

fn write_block<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    bytes: &[u8],
) -> Result<(u64, u64), Failure> {
    Ok((directory.write_data(bytes).map_err(from_tiff)?, bytes.len() as u64))
}

/// Rows of RGBA as the bytes of a block of `width` x `height` pixels; what the rows do not fill is 0. Deflated, each pixel
/// is the difference from the one to its left.
///
/// # Source
/// TIFF 6.0 sections 14 (horizontal differencing) and 15 (tiles); Adobe Photoshop TIFF Technical Notes (deflate: a zlib
/// stream).
fn coded<'a, S: Sample>(
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
