//! Where the canvas is kept: in memory, or in a scratch file.

mod blocks;
mod pixel;

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;
use trueup_core::Result;

use crate::coverage::Rectangle;

pub(crate) use blocks::CanvasBlocks;
pub(crate) use pixel::{Pixel, RootPixel, SumPixel, read_pixels, to_bytes};

/// A canvas, row-major in memory.
#[derive(Debug)]
pub(crate) enum PixelStore<P> {
    Memory { width: usize, pixels: Vec<P> },
    Scratch(CanvasBlocks<P>),
}

/// A part of a canvas, row by row.
#[derive(Debug)]
pub(crate) struct Block<'a, P> {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
    pub(crate) pixels: &'a [P],
}

impl<P> Block<'_, P> {
    /// Whether it is one of the tiles of this `side`, on a canvas of this size, that have something in common with a
    /// part of it.
    pub(crate) fn is_tile_of(&self, part: &Rectangle, side: usize, canvas: [usize; 2]) -> bool {
        let is_one = |range: &Range<usize>, part: &Range<usize>, length: usize| {
            range.start.is_multiple_of(side)
                && range.start < part.end
                && range.end == (range.start.saturating_add(side)).min(length)
                && range.end > part.start
        };
        is_one(&self.columns, &part.columns, canvas[0])
            && is_one(&self.rows, &part.rows, canvas[1])
            && self.columns.len() * self.rows.len() == self.pixels.len()
    }

    /// The pixels of row `y` of the canvas.
    fn row(&self, y: usize) -> &[P] {
        let width = self.columns.len();
        &self.pixels[(y - self.rows.start) * width..][..width]
    }
}

impl<P: Pixel> PixelStore<P> {
    /// Zeros in memory.
    pub(crate) fn in_memory([width, height]: [usize; 2]) -> Self {
        Self::of_pixels(width, vec![P::default(); width * height])
    }

    /// Row-major pixels.
    pub(crate) fn of_pixels(width: usize, pixels: Vec<P>) -> Self {
        Self::Memory { width, pixels }
    }

    /// Sets blocks that do not overlap; in a scratch file, each one of its blocks.
    pub(crate) fn put(&mut self, blocks: &[Block<P>]) -> Result<()> {
        match self {
            Self::Memory { width, pixels } => {
                let rows =
                    blocks.iter().map(|block| block.rows.clone()).reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
                let Some(rows) = rows.filter(|_| *width > 0) else { return Ok(()) };
                pixels[rows.start * *width..rows.end * *width].par_chunks_mut(*width).zip(rows).for_each(|(row, y)| {
                    for block in blocks.iter().filter(|block| block.rows.contains(&y)) {
                        row[block.columns.clone()].copy_from_slice(block.row(y));
                    }
                });
                Ok(())
            }
            Self::Scratch(own) => blocks.par_iter().try_for_each(|block| own.put(block)),
        }
    }

    /// The rows of tiles of the canvas, so that all of them can be set at the same time; `None` if it is not in memory.
    /// Tiles do not overlap, and those that have a row in common have all their rows in common.
    pub(crate) fn tiles_mut(&mut self, tiles: &[Rectangle]) -> Option<Vec<Vec<&mut [P]>>> {
        let Self::Memory { width, pixels } = self else { return None };
        let mut in_order: Vec<usize> = (0..tiles.len()).collect();
        in_order.sort_unstable_by_key(|&tile| (tiles[tile].rows.start, tiles[tile].columns.start));
        let mut all: Vec<Vec<&mut [P]>> = tiles.iter().map(|tile| Vec::with_capacity(tile.rows.len())).collect();
        let mut canvas = pixels.chunks_exact_mut((*width).max(1));
        let mut next = 0;
        for strip in in_order.chunk_by(|&one, &other| tiles[one].rows == tiles[other].rows) {
            let rows = &tiles[strip[0]].rows;
            for row in canvas.by_ref().skip(rows.start.checked_sub(next)?).take(rows.len()) {
                let (mut rest, mut first) = (row, 0);
                for &tile in strip {
                    let columns = &tiles[tile].columns;
                    let (_, own) = rest.split_at_mut_checked(columns.start.checked_sub(first)?)?;
                    let (own, right) = own.split_at_mut_checked(columns.len())?;
                    all[tile].push(own);
                    (rest, first) = (right, columns.end);
                }
            }
            next = rows.end;
        }
        Some(all)
    }

    /// The block `columns` x `rows`, row by row.
    pub(crate) fn window(&self, columns: &Range<usize>, rows: &Range<usize>) -> Result<Vec<P>> {
        let mut window = Vec::with_capacity(columns.len() * rows.len());
        for y in rows.clone() {
            match self {
                Self::Memory { width, pixels } => window.extend_from_slice(&pixels[y * width..][columns.clone()]),
                Self::Scratch(blocks) => blocks.stretch(columns, y, &mut window)?,
            }
        }
        Ok(window)
    }

    /// Sets pixels of row `y` that were put before.
    pub(crate) fn set(&mut self, columns: &Range<usize>, y: usize, row: &[P]) -> Result<()> {
        match self {
            Self::Memory { width, pixels } => {
                pixels[y * *width..][columns.clone()].copy_from_slice(row);
                Ok(())
            }
            Self::Scratch(blocks) => blocks.set(columns, y, row),
        }
    }

    /// Row `y`.
    pub(crate) fn row(&self, y: usize) -> Result<Cow<'_, [P]>> {
        match self {
            Self::Memory { width, pixels } => Ok(Cow::Borrowed(&pixels[y * width..][..*width])),
            Self::Scratch(blocks) => blocks.row(y).map(Cow::Owned),
        }
    }

    /// Whether no pixel of a part lets anything show through; if it cannot be read, that is not known, and false.
    pub(crate) fn is_opaque(&self, part: &Rectangle) -> bool {
        match self {
            Self::Scratch(blocks) if blocks.is_opaque() => true,
            _ => part
                .rows
                .clone()
                .into_par_iter()
                .all(|y| self.row(y).is_ok_and(|row| row[part.columns.clone()].iter().all(P::is_opaque))),
        }
    }

    /// Pixel (x, y).
    pub(crate) fn pixel(&self, x: usize, y: usize) -> Result<P> {
        match self {
            Self::Memory { width, pixels } => Ok(pixels[y * width + x]),
            Self::Scratch(blocks) => blocks.pixel(x, y),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use trueup_core::scratch::ScratchFile;

    use super::*;
    use crate::test_photographs::RamDisk;

    #[test]
    fn a_canvas_in_a_file_is_the_canvas() {
        for size in [[1, 1], [7, 300], [301, 65], [64, 64]] {
            for side in [[16, 16], [64, 32], [size[0], 16]] {
                let pixel = |x: usize, y: usize| [x as u16, y as u16, (x * 7 + y * 13) as u16, u16::MAX];
                let offset = 24;
                let file: Arc<dyn ScratchFile> = Arc::new(RamDisk::default());
                let mut store = PixelStore::Scratch(CanvasBlocks::new(file, offset, size, side));
                for top in (0..size[1]).step_by(side[1]) {
                    for left in (0..size[0]).step_by(side[0]) {
                        let (columns, rows) = (left..(left + side[0]).min(size[0]), top..(top + side[1]).min(size[1]));
                        let pixels: Vec<[u16; 4]> =
                            rows.clone().flat_map(|y| columns.clone().map(move |x| pixel(x, y))).collect();
                        store.put(&[Block { columns, rows, pixels: &pixels }]).expect("room");
                    }
                }
                (0..size[1]).into_par_iter().for_each(|y| {
                    let row = store.row(y).expect("written");
                    assert!(row.iter().enumerate().all(|(x, got)| *got == pixel(x, y)), "{size:?} {side:?} row {y}");
                });
                let last = [size[0] - 1, size[1] - 1];
                assert_eq!(store.pixel(last[0], last[1]).expect("written"), pixel(last[0], last[1]));
            }
        }
    }

    #[test]
    fn tiles_are_set_in_their_places() {
        let mut store = PixelStore::in_memory([7, 5]);
        let tile = |columns, rows| Rectangle { columns, rows };
        let tiles = [tile(3..5, 3..5), tile(4..7, 0..2), tile(0..3, 0..2)];
        let mut rows = store.tiles_mut(&tiles).expect("in memory");
        for (tile, rows) in (1..).zip(&mut rows) {
            rows.iter_mut().for_each(|row| row.fill([tile; 4]));
        }
        for (y, expected) in ["333 222", "333 222", "       ", "   11  ", "   11  "].into_iter().enumerate() {
            let row = store.row(y).expect("in memory");
            let found: String =
                row.iter().map(|pixel: &RootPixel| [' ', '1', '2', '3'][usize::from(pixel[0])]).collect();
            assert_eq!(found, expected, "row {y}");
        }
        assert!(store.tiles_mut(&[tile(0..4, 0..2), tile(3..5, 0..2)]).is_none());
        assert!(store.tiles_mut(&[tile(0..4, 0..2), tile(5..7, 1..3)]).is_none());
    }

    #[test]
    fn floating_point_keeps_its_bits() {
        let pixels = [[0.1_f32, -0.0, f32::MIN_POSITIVE, 3e38], [f32::INFINITY, 1.0, 1e-45, 7.0]];
        let back: Vec<[f32; 4]> = to_bytes(&pixels).chunks_exact(16).map(Pixel::read).collect();
        assert_eq!(
            back.as_flattened().iter().map(|one| one.to_bits()).collect::<Vec<_>>(),
            pixels.as_flattened().iter().map(|one| one.to_bits()).collect::<Vec<_>>()
        );
    }
}
