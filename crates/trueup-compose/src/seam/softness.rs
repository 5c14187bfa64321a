//! Where a photograph shows less detail than another one that shows the same.

use std::ops::Range;

use rayon::prelude::*;

use crate::small_views::{CLIPPED, SmallPixel, SmallView, WHOLLY, luma};

/// Side of the squares of a view that detail is averaged in, pixels: wide enough for things that the photographs place
/// a few pixels apart.
const CELL_PX: usize = 8;

/// Detail that noise and rounding alone may make, gray levels: a view's pixel is a mean of at least four of the
/// photograph's, whose noise of one level, and the rounding's of 0.3, reach 2 to 3 levels in [`laplacian`].
const NOISE: f64 = 3.0;

/// Share of the detail that may be missing for other reasons than focus: another lens's corner, another resampling.
const TOLERANCE: f64 = 0.3;

/// Largest difference of a channel's mean, gray levels, at which two photographs are taken to show the same: exposures
/// are evened out to a few levels, and a thing that stands in one of them only stands out by more.
const SAME: f64 = 12.0;

/// The detail of a view, cell by cell.
struct Detail {
    columns: usize,
    /// `None` where less than half of a cell's surroundings tells.
    cells: Vec<Option<CellDetail>>,
}

/// What a cell and those around it show.
#[derive(Clone, Copy)]
struct CellDetail {
    /// Mean of [`laplacian`], gray levels.
    detail: f64,
    /// Mean color, gray levels.
    mean: [f64; 3],
}

/// What a view lacks of the detail that the sharpest photograph of the same thing has.
pub(super) struct Softness {
    columns: Range<usize>,
    rows: Range<usize>,
    /// Share of the detail that is missing, in 255ths, cell by cell; 0 up to [`TOLERANCE`].
    missing: Vec<u8>,
}

impl Softness {
    /// Of every view, beside all that meet it; `turn` as for [`SmallView::index_around`].
    ///
    /// Detail is the mean size of the Laplacian, the measure of focus of Nayar and Nakagawa, "Shape from focus",
    /// PAMI 1994. It is compared only where photographs agree in what is left of them without it.
    pub(super) fn of(views: &[SmallView], turn: usize) -> Vec<Self> {
        let details: Vec<Detail> = views.par_iter().map(Detail::of).collect();
        (0..views.len()).into_par_iter().map(|own| Self::beside(views, &details, own, turn)).collect()
    }

    fn beside(views: &[SmallView], details: &[Detail], own: usize, turn: usize) -> Self {
        let view = &views[own];
        let others: Vec<usize> =
            (0..views.len()).filter(|&other| other != own && view.meets(&views[other], turn)).collect();
        let missing = |(cell, detail): (usize, &Option<CellDetail>)| {
            let Some(detail) = detail else { return 0 };
            let across = details[own].columns;
            let x = middle(&view.columns, cell % across);
            let y = middle(&view.rows, cell / across);
            let canvas = if turn > 0 { x % turn } else { x };
            let of_same = |&other: &usize| {
                let shown = details[other].at(&views[other], canvas, y, turn)?;
                (0..3).all(|c| (shown.mean[c] - detail.mean[c]).abs() <= SAME).then_some(shown.detail)
            };
            let best = others.iter().filter_map(of_same).fold(detail.detail, f64::max);
            let missing = 1.0 - (detail.detail + NOISE) / (best + NOISE);
            if missing > TOLERANCE { (missing * 255.0).round() as u8 } else { 0 }
        };
        let missing = details[own].cells.iter().enumerate().map(missing).collect();
        Self { columns: view.columns.clone(), rows: view.rows.clone(), missing }
    }

    /// The share that is missing, in 255ths, at a pixel of the canvas that was halved so often; in the view's own
    /// columns, which may run into the next turn.
    pub(super) fn at(&self, [x, y]: [usize; 2], halvings: u32) -> u8 {
        let cell = |range: &Range<usize>, at: usize| {
            let middle = (at << halvings) + (1 << halvings) / 2;
            middle.saturating_sub(range.start).min(range.len().saturating_sub(1)) / CELL_PX
        };
        let index = cell(&self.rows, y) * self.columns.len().div_ceil(CELL_PX) + cell(&self.columns, x);
        self.missing.get(index).copied().unwrap_or(0)
    }
}

/// The canvas pixel in the middle of a cell of a view's range.
fn middle(range: &Range<usize>, cell: usize) -> usize {
    (range.start + cell * CELL_PX + CELL_PX / 2).min(range.end - 1)
}

impl Detail {
    fn of(view: &SmallView) -> Self {
        let (columns, rows) = (view.columns.len().div_ceil(CELL_PX), view.rows.len().div_ceil(CELL_PX));
        let mut sums = vec![Sums::default(); columns * rows];
        let (width, height) = (view.columns.len(), view.rows.len());
        // Brightness in 256ths of a level; below 0 where it tells nothing.
        let brightness = |y: usize, row: &mut Vec<i32>| {
            row.clear();
            let pixels = &view.pixels[y * width..(y + 1) * width];
            row.extend(pixels.iter().map(|pixel| if tells(pixel) { luma(pixel) as i32 } else { -1 }));
        };
        let mut window: [Vec<i32>; 3] = Default::default();
        (0..height.min(2)).for_each(|y| brightness(y, &mut window[y + 1]));
        for y in 1..height.saturating_sub(1) {
            window.rotate_left(1);
            brightness(y + 1, &mut window[2]);
            let [above, own, below] = &window;
            let pixels = &view.pixels[y * width..(y + 1) * width];
            for (cell, sums) in sums[y / CELL_PX * columns..][..columns].iter_mut().enumerate() {
                let across = (cell * CELL_PX).max(1)..((cell + 1) * CELL_PX).min(width - 1);
                if across.is_empty() {
                    continue;
                }
                let mut sum = Sums::default();
                let beside = own[across.start - 1..across.end + 1].windows(3);
                let over = above[across.clone()].iter().zip(&below[across.clone()]);
                for ((beside, (&above, &below)), pixel) in beside.zip(over).zip(&pixels[across]) {
                    let (own, around) = (beside[1], [beside[0], beside[2], above, below]);
                    if around.into_iter().fold(own, i32::min) >= 0 {
                        sum.add(pixel, laplacian(own, around));
                    }
                }
                sums.join(&sum);
            }
        }
        let cell = |index: usize| {
            let near = |at: usize, length: usize| at.saturating_sub(1)..(at + 2).min(length);
            let mut around = Sums::default();
            for row in near(index / columns, rows) {
                near(index % columns, columns).for_each(|column| around.join(&sums[row * columns + column]));
            }
            around.detail()
        };
        Self { columns, cells: (0..columns * rows).map(cell).collect() }
    }

    /// What the view shows at a pixel of the canvas.
    fn at(&self, view: &SmallView, x: usize, y: usize, turn: usize) -> Option<CellDetail> {
        let index = view.index_around(x, y, turn)?;
        let (x, y) = (index % view.columns.len(), index / view.columns.len());
        self.cells[y / CELL_PX * self.columns + x / CELL_PX]
    }
}

/// Sums over pixels.
#[derive(Clone, Default)]
struct Sums {
    pixels: u32,
    laplacians: u64,
    colors: [u32; 3],
}

impl Sums {
    fn add(&mut self, pixel: &SmallPixel, laplacian: u32) {
        self.pixels += 1;
        self.laplacians += u64::from(laplacian);
        (0..3).for_each(|c| self.colors[c] += u32::from(pixel[c]));
    }

    fn join(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.laplacians += other.laplacians;
        (0..3).for_each(|c| self.colors[c] += other.colors[c]);
    }

    fn detail(&self) -> Option<CellDetail> {
        /// Of a cell and the eight around it, half.
        const FEWEST: u32 = (9 * CELL_PX * CELL_PX / 2) as u32;
        let count = f64::from(self.pixels);
        (self.pixels >= FEWEST).then(|| CellDetail {
            detail: self.laplacians as f64 / (256.0 * count),
            mean: self.colors.map(|sum| f64::from(sum) / count),
        })
    }
}

/// Whether a pixel's level is the scene's.
fn tells(pixel: &SmallPixel) -> bool {
    pixel[3] & (WHOLLY | CLIPPED) == WHOLLY
}

/// Size of the Laplacian of the brightness, in 256ths of a level.
fn laplacian(own: i32, around: [i32; 4]) -> u32 {
    (4 * own).abs_diff(around.into_iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small_views::PARTLY;

    fn view(columns: Range<usize>, level: impl Fn(usize, usize) -> u8) -> SmallView {
        let rows = 0..48;
        let pixel = |index: usize| {
            let level = level(columns.start + index % columns.len(), index / columns.len());
            [level, level, level, PARTLY | WHOLLY]
        };
        let pixels = (0..columns.len() * rows.len()).map(pixel).collect();
        SmallView { columns, rows, pixels }
    }

    /// Columns of 90 and 110 levels in turn: a Laplacian of 40. Half of that contrast has 20.
    fn stripes(x: usize, contrast: u8) -> u8 {
        if x.is_multiple_of(2) { 100 - contrast } else { 100 + contrast }
    }

    #[test]
    fn what_is_softer_lacks_the_share_of_the_detail() {
        let sharp = view(0..80, |x, _| stripes(x, 10));
        let soft = view(40..120, |x, _| stripes(x, 5));
        let softness = Softness::of(&[sharp, soft], 0);
        // 1 - (20 + 3) / (40 + 3), where both show it; the sharp one lacks nothing, nor what one alone shows.
        assert_eq!(softness[1].at([60, 24], 0), (255.0_f64 * 20.0 / 43.0).round() as u8);
        assert_eq!(softness[0].at([60, 24], 0), 0);
        assert_eq!(softness[1].at([110, 24], 0), 0);
        // The same place on a canvas that was halved twice.
        assert_eq!(softness[1].at([15, 6], 2), softness[1].at([60, 24], 0));
    }

    #[test]
    fn noise_is_no_detail_and_other_things_are_not_compared() {
        let plain = view(0..80, |_, _| 100);
        let noisy = view(40..120, |x, _| if x % 4 == 0 { 101 } else { 100 });
        let brighter = view(40..120, |x, _| stripes(x, 10) + 20);
        for other in [noisy, brighter] {
            let softness = Softness::of(&[plain.clone(), other], 0);
            assert!(softness.iter().all(|one| one.missing.iter().all(|&missing| missing == 0)));
        }
    }

    #[test]
    fn a_turn_is_looked_at_across_its_end() {
        // The second view lies in columns 100 to 140 of a turn of 120, which are its first 20 as well.
        let soft = view(0..60, |x, _| stripes(x, 5));
        let sharp = view(100..140, |x, _| stripes(x, 10));
        let softness = Softness::of(&[soft, sharp], 120);
        assert!(softness[0].at([8, 24], 0) > 0);
        assert_eq!(softness[0].at([50, 24], 0), 0);
    }
}
