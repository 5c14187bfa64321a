//! A canvas in a scratch file.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use trueup_core::Result;
use trueup_core::scratch::ScratchFile;

use super::Block;
use super::pixel::{Pixel, read_pixels, to_bytes, translucent};

/// Memory for rows that were read at once: neighboring rows are asked for next.
const BANDS_BYTES: usize = 64 << 20;

/// Rows read at once: as many as make reads of every block worth a disk's while.
const BAND_ROWS: usize = 32;

/// A canvas in a scratch file: blocks of `side` columns and rows (those at the ends are smaller), the rows of blocks
/// from top to bottom, their blocks from left to right, each row-major.
#[derive(Debug)]
pub(crate) struct CanvasBlocks<P> {
    file: Arc<dyn ScratchFile>,
    offset: u64,
    size: [usize; 2],
    side: [usize; 2],
    /// Pixels put so far that let something show through.
    translucent: AtomicUsize,
    band_rows: usize,
    most_bands: usize,
    bands: Mutex<VecDeque<(usize, Band<P>)>>,
}

/// Some rows, once they are read.
type Band<P> = Arc<Mutex<Option<Vec<P>>>>;

impl<P: Pixel> CanvasBlocks<P> {
    /// A canvas of `size` from `offset` on, in blocks of `side`.
    pub(crate) fn new(file: Arc<dyn ScratchFile>, offset: u64, size: [usize; 2], side: [usize; 2]) -> Self {
        // Every thread may be at rows of its own.
        let wanted = rayon::current_num_threads() + 2;
        let row_bytes = (size[0] * P::BYTES).max(1);
        let band_rows = (BANDS_BYTES / wanted / row_bytes).clamp(1, BAND_ROWS);
        let most_bands = (BANDS_BYTES / (row_bytes * band_rows)).clamp(2, wanted);
        Self {
            file,
            offset,
            size,
            side,
            translucent: AtomicUsize::new(0),
            band_rows,
            most_bands,
            bands: Mutex::default(),
        }
    }

    /// Where pixel (x, y) is in the file, and how many columns its block has.
    fn place(&self, x: usize, y: usize) -> (u64, usize) {
        let (left, top) = (x / self.side[0] * self.side[0], y / self.side[1] * self.side[1]);
        let columns = self.side[0].min(self.size[0] - left);
        let rows = self.side[1].min(self.size[1] - top);
        let before = top * self.size[0] + left * rows + (y - top) * columns + (x - left);
        (self.offset + before as u64 * P::BYTES as u64, columns)
    }

    /// Writes one block; different ones may be written at once.
    pub(super) fn put(&self, Block { columns, rows, pixels }: &Block<'_, P>) -> Result<()> {
        debug_assert!(columns.start.is_multiple_of(self.side[0]) && rows.start.is_multiple_of(self.side[1]));
        debug_assert_eq!(columns.len(), self.side[0].min(self.size[0] - columns.start));
        debug_assert_eq!(rows.len(), self.side[1].min(self.size[1] - rows.start));
        self.translucent.fetch_add(translucent(pixels), Ordering::Relaxed);
        let (at, _) = self.place(columns.start, rows.start);
        self.file.write_at(&to_bytes(pixels), at)
    }

    /// The stretches of row `y` that lie in one block each: first column, length, and place in the file.
    fn stretches(&self, columns: &Range<usize>, y: usize) -> impl Iterator<Item = (usize, usize, u64)> {
        let (mut next, end) = (columns.start, columns.end);
        std::iter::from_fn(move || {
            let first = next;
            next = ((first / self.side[0] + 1) * self.side[0]).min(end);
            (first < end).then(|| (first, next - first, self.place(first, y).0))
        })
    }

    /// Appends those pixels of row `y` to `out`.
    pub(super) fn stretch(&self, columns: &Range<usize>, y: usize, out: &mut Vec<P>) -> Result<()> {
        for (_, count, at) in self.stretches(columns, y) {
            out.extend(read_pixels::<P>(self.file.as_ref(), at, count)?);
        }
        Ok(())
    }

    /// Sets pixels of row `y` that were put before.
    pub(super) fn set(&mut self, columns: &Range<usize>, y: usize, row: &[P]) -> Result<()> {
        let mut old = Vec::with_capacity(columns.len());
        self.stretch(columns, y, &mut old)?;
        let others = self.translucent.load(Ordering::Relaxed) - translucent(&old);
        self.translucent.store(others + translucent(row), Ordering::Relaxed);
        self.bands.lock().unwrap_or_else(PoisonError::into_inner).clear();
        for (first, count, at) in self.stretches(columns, y) {
            self.file.write_at(&to_bytes(&row[first - columns.start..][..count]), at)?;
        }
        Ok(())
    }

    /// Pixel (x, y).
    pub(super) fn pixel(&self, x: usize, y: usize) -> Result<P> {
        let (at, _) = self.place(x, y);
        Ok(read_pixels(self.file.as_ref(), at, 1)?.first().copied().unwrap_or_default())
    }

    /// Row `y`; those beside it are read with it.
    pub(super) fn row(&self, y: usize) -> Result<Vec<P>> {
        let number = y / self.band_rows;
        let band = {
            let mut bands = self.bands.lock().unwrap_or_else(PoisonError::into_inner);
            match bands.iter().position(|(one, _)| *one == number).and_then(|at| bands.remove(at)) {
                Some(found) => bands.push_front(found),
                None => {
                    bands.truncate(self.most_bands - 1);
                    bands.push_front((number, Band::default()));
                }
            }
            bands[0].1.clone()
        };
        // Other bands can be had while this one is read.
        let mut band = band.lock().unwrap_or_else(PoisonError::into_inner);
        let rows = match &*band {
            Some(rows) => rows,
            None => band.insert(self.read_band(number * self.band_rows)?),
        };
        Ok(rows[(y - number * self.band_rows) * self.size[0]..][..self.size[0]].to_vec())
    }

    /// Whether no pixel put so far lets anything show through.
    pub(super) fn is_opaque(&self) -> bool {
        self.translucent.load(Ordering::Relaxed) == 0
    }

    fn read_band(&self, first: usize) -> Result<Vec<P>> {
        let [width, height] = self.size;
        let end = (first + self.band_rows).min(height);
        let mut band = vec![P::default(); width * (end - first)];
        for left in (0..width).step_by(self.side[0]) {
            let mut y = first;
            while y < end {
                // What follows in the file up to the end of the block, or of the band.
                let rows = ((y / self.side[1] + 1) * self.side[1]).min(end) - y;
                let (at, columns) = self.place(left, y);
                let part: Vec<P> = read_pixels(self.file.as_ref(), at, rows * columns)?;
                for (row, part) in part.chunks_exact(columns).enumerate() {
                    band[(y - first + row) * width + left..][..columns].copy_from_slice(part);
                }
                y += rows;
            }
        }
        Ok(band)
    }
}
