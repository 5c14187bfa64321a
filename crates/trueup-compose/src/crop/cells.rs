//! The panorama in cells: as much of it as deciding about its frame takes.

use rayon::prelude::*;
use trueup_core::Result;
use trueup_core::raster::{LUMA, RowSource};

use crate::coverage::Coverage;

/// Cells at most: a thing of half a hundredth of the panorama's longer side is one or more of them, and the search among
/// all rectangles takes a fraction of a second.
const MOST_CELLS: usize = 1 << 16;

/// Rows of pixels that are read of a row of cells, at most: enough for means of one level in noise.
const ROWS_READ: usize = 4;

/// The panorama, reduced.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cells {
    /// Panorama pixels a side.
    pub(super) side: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Whether photographs cover all of a cell.
    pub(super) covered: Vec<bool>,
    /// Mean red, green and blue of what is covered, levels as encoded (0 to 255).
    pub(super) colors: Vec<[f32; 3]>,
    /// Standard deviation of the luma within a cell, levels.
    pub(super) deviations: Vec<f32>,
    /// Whether the last column lies beside the first.
    pub(super) around: bool,
}

/// Sums over the pixels of a cell.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f32,
    colors: [f32; 3],
    luma: f32,
    luma_squared: f32,
}

impl Cells {
    /// Reads the panorama; `around` if it is a full turn.
    ///
    /// # Errors
    /// Those of reading its rows.
    pub(super) fn of(picture: &dyn RowSource, coverage: &Coverage, around: bool) -> Result<Self> {
        let (width, height) = (picture.width(), picture.height());
        let side = (1..).find(|side| width.div_ceil(*side) * height.div_ceil(*side) <= MOST_CELLS).unwrap_or(1);
        let (columns, rows) = (width.div_ceil(side), height.div_ceil(side));
        let length = |index: usize, whole: usize| ((index + 1) * side).min(whole) - index * side;
        let full = |at: usize| length(at % columns, width) * length(at / columns, height);
        let covered = coverage.in_cells(side).iter().enumerate().map(|(at, &count)| count == full(at)).collect();
        let sums: Vec<Vec<Sums>> = (0..rows)
            .into_par_iter()
            .map(|row| {
                let top = row * side;
                let high = length(row, height);
                let lines = high.min(ROWS_READ);
                let mut sums = vec![Sums::default(); columns];
                let mut pixels = vec![0; 4 * width];
                for line in 0..lines {
                    picture.rgba8_row(top + (2 * line + 1) * high / (2 * lines), &mut pixels)?;
                    for (sums, pixels) in sums.iter_mut().zip(pixels.chunks(4 * side)) {
                        pixels.chunks_exact(4).filter(|pixel| pixel[3] == u8::MAX).for_each(|pixel| sums.add(pixel));
                    }
                }
                Ok(sums)
            })
            .collect::<Result<_>>()?;
        let sums = || sums.iter().flatten();
        let colors = sums().map(|one| one.colors.map(|sum| sum / one.count.max(1.0))).collect();
        let deviations = sums().map(Sums::deviation).collect();
        Ok(Self { side, columns, rows, covered, colors, deviations, around })
    }

    /// The largest difference of a channel between two cells, levels.
    pub(super) fn contrast(&self, a: usize, b: usize) -> f32 {
        let (a, b) = (self.colors[a], self.colors[b]);
        (0..3).map(|channel| (a[channel] - b[channel]).abs()).fold(0.0, f32::max)
    }
}

impl Sums {
    fn add(&mut self, pixel: &[u8]) {
        let mut luma = 0.0;
        for ((sum, &level), share) in self.colors.iter_mut().zip(pixel).zip(LUMA) {
            *sum += f32::from(level);
            luma += share * f32::from(level);
        }
        self.count += 1.0;
        self.luma += luma;
        self.luma_squared += luma * luma;
    }

    fn deviation(&self) -> f32 {
        let count = self.count.max(1.0);
        let mean = self.luma / count;
        (self.luma_squared / count - mean * mean).max(0.0).sqrt()
    }
}
