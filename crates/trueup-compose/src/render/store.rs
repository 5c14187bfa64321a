//! Where the canvas is kept: in memory, or in a scratch file.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;
use trueup_core::Result;
use trueup_core::scratch::ScratchFile;

use crate::weights::alpha;

/// What a canvas consists of.
pub(crate) trait Pixel: Copy + Default + Send + Sync {
    /// Bytes of a pixel in a file.
    const BYTES: usize;
    /// Writes the pixel, little-endian.
    fn write(self, bytes: &mut [u8]);
    /// Reads what [`Self::write`] wrote.
    fn read(bytes: &[u8]) -> Self;
    /// Whether nothing shows through.
    fn is_opaque(&self) -> bool;
}

macro_rules! pixels {
    ($($sample:ty, $opaque:expr);*) => {$(
        impl Pixel for [$sample; 4] {
            const BYTES: usize = size_of::<Self>();

            #[inline(always)]
            fn write(self, bytes: &mut [u8]) {
                for (bytes, sample) in bytes.chunks_exact_mut(size_of::<$sample>()).zip(self) {
                    bytes.copy_from_slice(&sample.to_le_bytes());
                }
            }

            #[inline(always)]
            fn read(bytes: &[u8]) -> Self {
                let mut samples = bytes.chunks_exact(size_of::<$sample>()).map(|bytes| {
                    let mut own = [0; size_of::<$sample>()];
                    own.copy_from_slice(bytes);
                    <$sample>::from_le_bytes(own)
                });
                std::array::from_fn(|_| samples.next().unwrap_or_default())
            }

            fn is_opaque(&self) -> bool {
                $opaque(self[3])
            }
        }
    )*};
}
pixels!(u16, |opacity| opacity == u16::MAX; f32, |sum| alpha(sum) >= 1.0);

/// Pixels as bytes.
pub(crate) fn to_bytes<P: Pixel>(pixels: &[P]) -> Vec<u8> {
    let mut bytes = vec![0; pixels.len() * P::BYTES];
    for (pixel, bytes) in pixels.iter().zip(bytes.chunks_exact_mut(P::BYTES)) {
        pixel.write(bytes);
    }
    bytes
}

/// Reads `count` pixels from a file.
pub(crate) fn read_pixels<P: Pixel>(file: &dyn ScratchFile, offset: u64, count: usize) -> Result<Vec<P>> {
    let mut bytes = vec![0; count * P::BYTES];
    file.read_at(&mut bytes, offset)?;
    Ok(bytes.chunks_exact(P::BYTES).map(P::read).collect())
}

/// How many pixels let something show through.
fn translucent<P: Pixel>(pixels: &[P]) -> usize {
    pixels.iter().filter(|pixel| !pixel.is_opaque()).count()
}

/// A canvas, row-major in memory.
#[derive(Debug)]
pub(crate) enum Store<P> {
    Memory { width: usize, pixels: Vec<P> },
    Scratch(Blocks<P>),
}

impl<P: Pixel> Store<P> {
    /// Zeros in memory.
    pub(crate) fn in_memory([width, height]: [usize; 2]) -> Self {
        Self::of_pixels(width, vec![P::default(); width * height])
    }

    /// Row-major pixels.
    pub(crate) fn of_pixels(width: usize, pixels: Vec<P>) -> Self {
        Self::Memory { width, pixels }
    }

    /// Sets the block `columns` x `rows`; in a scratch file, one of its blocks.
    pub(crate) fn put(&mut self, columns: &Range<usize>, rows: &Range<usize>, block: &[P]) -> Result<()> {
        match self {
            Self::Memory { width, pixels } => {
                for (y, row) in rows.clone().zip(block.chunks_exact(columns.len().max(1))) {
                    pixels[y * *width..][columns.clone()].copy_from_slice(row);
                }
                Ok(())
            }
            Self::Scratch(blocks) => blocks.put(columns, rows, block),
        }
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

    /// Whether no pixel lets anything show through.
    pub(crate) fn is_opaque(&self) -> bool {
        match self {
            Self::Memory { pixels, .. } => pixels.par_iter().all(P::is_opaque),
            Self::Scratch(blocks) => blocks.translucent.load(Ordering::Relaxed) == 0,
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

/// Memory for rows that were read at once: neighboring rows are asked for next.
const BANDS_BYTES: usize = 64 << 20;

/// Rows read at once: as many as make reads of every block worth a disk's while.
const BAND_ROWS: usize = 32;

/// A canvas in a scratch file: blocks of `side` columns and rows (those at the ends are smaller), the rows of blocks from top
/// to bottom, their blocks from left to right, each row-major.
#[derive(Debug)]
pub(crate) struct Blocks<P> {
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

impl<P: Pixel> Blocks<P> {
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
    pub(crate) fn put(&self, columns: &Range<usize>, rows: &Range<usize>, block: &[P]) -> Result<()> {
        debug_assert!(columns.start.is_multiple_of(self.side[0]) && rows.start.is_multiple_of(self.side[1]));
        debug_assert_eq!(columns.len(), self.side[0].min(self.size[0] - columns.start));
        debug_assert_eq!(rows.len(), self.side[1].min(self.size[1] - rows.start));
        self.translucent.fetch_add(translucent(block), Ordering::Relaxed);
        let (at, _) = self.place(columns.start, rows.start);
        self.file.write_at(&to_bytes(block), at)
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

    fn stretch(&self, columns: &Range<usize>, y: usize, out: &mut Vec<P>) -> Result<()> {
        for (_, count, at) in self.stretches(columns, y) {
            out.extend(read_pixels::<P>(self.file.as_ref(), at, count)?);
        }
        Ok(())
    }

    fn set(&mut self, columns: &Range<usize>, y: usize, row: &[P]) -> Result<()> {
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

    fn pixel(&self, x: usize, y: usize) -> Result<P> {
        let (at, _) = self.place(x, y);
        Ok(read_pixels(self.file.as_ref(), at, 1)?.first().copied().unwrap_or_default())
    }

    fn row(&self, y: usize) -> Result<Vec<P>> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::test_pictures::RamDisk;

    #[test]
    fn a_canvas_in_a_file_is_the_canvas() {
        for size in [[1, 1], [7, 300], [301, 65], [64, 64]] {
            for side in [[16, 16], [64, 32], [size[0], 16]] {
                let pixel = |x: usize, y: usize| [x as u16, y as u16, (x * 7 + y * 13) as u16, u16::MAX];
                let offset = 24;
                let file: Arc<dyn ScratchFile> = Arc::new(RamDisk::default());
                let mut store = Store::Scratch(Blocks::new(file, offset, size, side));
                for top in (0..size[1]).step_by(side[1]) {
                    for left in (0..size[0]).step_by(side[0]) {
                        let (columns, rows) = (left..(left + side[0]).min(size[0]), top..(top + side[1]).min(size[1]));
                        let block: Vec<[u16; 4]> =
                            rows.clone().flat_map(|y| columns.clone().map(move |x| pixel(x, y))).collect();
                        store.put(&columns, &rows, &block).expect("room");
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
    fn floating_point_keeps_its_bits() {
        let pixels = [[0.1_f32, -0.0, f32::MIN_POSITIVE, 3e38], [f32::INFINITY, 1.0, 1e-45, 7.0]];
        let back: Vec<[f32; 4]> = to_bytes(&pixels).chunks_exact(16).map(Pixel::read).collect();
        assert_eq!(
            back.as_flattened().iter().map(|one| one.to_bits()).collect::<Vec<_>>(),
            pixels.as_flattened().iter().map(|one| one.to_bits()).collect::<Vec<_>>()
        );
    }
}
