//! The panorama around gaps, reduced.

use std::ops::Range;

use rayon::prelude::*;
use trueup_core::{Result, StageContext};

use super::super::{Canvas, Shade};
use crate::store::PixelStore;
use crate::window::widened;

/// Samples of what is composed, at most: what is filled is looked for among so many, and only around gaps.
const MOST_SAMPLES: usize = 1 << 15;

/// How far beside a gap lies what may fill it, as a multiple of its depth.
const REACH: f64 = 4.0;

/// Samples beside a gap, at least; and above and below it, beyond its depth.
const LEAST_REACH: usize = 16;

/// Rows of samples that are read at once; a number of threads must not show in the panorama.
const ROWS_AT_ONCE: usize = 32;

/// Samples beside a gap, and above and below it, among which what fills it is looked for, by its `depth`: the samples
/// from its border to its middle. What lies at another height is another thing.
pub(super) fn reach(depth: f64) -> [usize; 2] {
    [((REACH * depth) as usize).max(LEAST_REACH), depth as usize + LEAST_REACH]
}

/// Distance of two colors, roots of light; the largest there is where one is not known.
pub(super) fn difference(one: Option<[f32; 3]>, other: Option<[f32; 3]>) -> f32 {
    const UNKNOWN: f32 = 1.732_050_8;
    one.zip(other).map_or(UNKNOWN, |(one, other)| (0..3).map(|k| (one[k] - other[k]).powi(2)).sum::<f32>().sqrt())
}

/// Means of squares of pixels around gaps. Sample i lies on the middle of pixel `i << level` of the canvas.
#[derive(Debug)]
pub(super) struct Samples {
    /// Log2 of the pixels per sample.
    pub(super) level: u32,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Mean square roots of light of what is covered.
    pub(super) colors: Vec<Option<[f32; 3]>>,
    /// Share of the pixels of a sample that is covered.
    pub(super) shares: Vec<f32>,
    /// Deviations of the pixels of a sample from their mean, square roots of light.
    pub(super) deviations: Vec<f32>,
    /// Whether a gap takes part in the pixels that lie nearer to this sample than to those beside it, or between it and
    /// these.
    pub(super) open: Vec<bool>,
    /// Whether all of these pixels are covered.
    pub(super) whole: Vec<bool>,
    /// Samples beside gaps, and above and below them, up to which they are known.
    pub(super) reach: [usize; 2],
}

/// Sums over pixels.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f32,
    colors: [f32; 3],
    squares: f32,
}

impl Samples {
    /// Reads what lies around the gaps of a canvas.
    ///
    /// # Errors
    /// Those of reading; [`trueup_core::Error::Cancelled`].
    pub(super) fn of<P: Shade>(canvas: &Canvas<'_>, store: &PixelStore<P>, context: &StageContext) -> Result<Self> {
        let composed = canvas.gaps.composed();
        let area = |level: u32| composed.columns.len().div_ceil(1 << level) * composed.rows.len().div_ceil(1 << level);
        let level = (1..usize::BITS).find(|&level| area(level) <= MOST_SAMPLES).unwrap_or(1);
        let size = [canvas.lead + canvas.width, canvas.height].map(|length| (length >> level) + 2);
        let [columns, rows] = size;
        let depth = 2.0 * canvas.gaps.radius();
        let mut samples = Self {
            level,
            columns,
            rows,
            colors: vec![None; columns * rows],
            shares: vec![0.0; columns * rows],
            deviations: vec![0.0; columns * rows],
            open: vec![false; columns * rows],
            whole: vec![false; columns * rows],
            reach: reach(depth / f64::from(1 << level)),
        };
        samples.find_open(canvas);
        samples.find_whole(canvas);
        samples.read(canvas, store, context)?;
        Ok(samples)
    }

    /// The samples of a box, row by row.
    pub(super) fn within(&self, columns: &Range<usize>, rows: &Range<usize>) -> impl Iterator<Item = usize> {
        let (width, columns) = (self.columns, columns.clone());
        rows.clone().flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }

    /// Marks samples beside stretches of pixels of a row.
    fn mark(marks: &mut [bool], columns: usize, level: u32, stretch: &Range<usize>, y: usize) {
        if !stretch.is_empty() {
            for row in [y >> level, (y >> level) + 1] {
                marks[row * columns..][stretch.start >> level..((stretch.end - 1) >> level) + 2].fill(true);
            }
        }
    }

    fn find_open(&mut self, canvas: &Canvas<'_>) {
        for y in 0..canvas.height {
            for stretch in canvas.gaps.within_row(0..canvas.width, y) {
                let stretch = stretch.start + canvas.lead..stretch.end + canvas.lead;
                Self::mark(&mut self.open, self.columns, self.level, &stretch, y);
            }
        }
    }

    fn find_whole(&mut self, canvas: &Canvas<'_>) {
        let composed = canvas.gaps.composed();
        let mut lacking = vec![false; self.whole.len()];
        for y in composed.rows.clone() {
            for stretch in canvas.gaps.uncovered(composed.columns.clone(), y) {
                let stretch = stretch.start + canvas.lead..stretch.end + canvas.lead;
                Self::mark(&mut lacking, self.columns, self.level, &stretch, y);
            }
        }
        let inside = |range: &Range<usize>, lead: usize| {
            ((range.start + lead) >> self.level) + 2..((range.end + lead) >> self.level)
        };
        let columns = inside(&composed.columns, canvas.lead);
        for row in inside(&composed.rows, 0) {
            for at in columns.clone().map(|column| row * self.columns + column) {
                self.whole[at] = !lacking[at];
            }
        }
    }

    /// The columns of samples that are read of every row of them.
    fn around_gaps(&self) -> Vec<Range<usize>> {
        let hull = |open: &[bool]| match (open.iter().position(|&open| open), open.iter().rposition(|&open| open)) {
            (Some(first), Some(last)) => first..last + 1,
            _ => 0..0,
        };
        let hulls: Vec<Range<usize>> = self.open.chunks_exact(self.columns).map(hull).collect();
        let around = |row: usize| {
            let near = hulls[widened(&(row..row + 1), self.reach[1], self.rows)].iter().filter(|hull| !hull.is_empty());
            let hull = near.cloned().reduce(|one, other| one.start.min(other.start)..one.end.max(other.end));
            hull.map_or(0..0, |hull| widened(&hull, self.reach[0], self.columns))
        };
        (0..self.rows).map(around).collect()
    }

    fn read<P: Shade>(&mut self, canvas: &Canvas<'_>, store: &PixelStore<P>, context: &StageContext) -> Result<()> {
        let composed = canvas.gaps.composed();
        let around = self.around_gaps();
        let (level, half) = (self.level, (1 << self.level) / 2);
        // The pixels of a sample are as many before its own as after it.
        let pixels = |samples: &Range<usize>, lead: usize, part: &Range<usize>| {
            let pixel = |sample: usize| (sample << level).saturating_sub(half + lead).clamp(part.start, part.end);
            pixel(samples.start)..pixel(samples.end)
        };
        let row_of_samples = |row: usize| -> Result<Vec<Sums>> {
            let columns = &around[row];
            let mut sums = vec![Sums::default(); columns.len()];
            let own = pixels(columns, canvas.lead, &composed.columns);
            if own.is_empty() {
                return Ok(sums);
            }
            for y in pixels(&(row..row + 1), 0, &composed.rows) {
                let read = store.window(&own, &(y..y + 1))?;
                for x in canvas.gaps.covered(own.clone(), y).flatten() {
                    let [r, g, b, share] = read[x - own.start].root();
                    if share > 0.0 {
                        sums[((x + canvas.lead + half) >> level) - columns.start].add([r, g, b]);
                    }
                }
            }
            Ok(sums)
        };
        for first in (0..self.rows).step_by(ROWS_AT_ONCE) {
            context.check_cancelled()?;
            let rows = first..(first + ROWS_AT_ONCE).min(self.rows);
            let read: Vec<Vec<Sums>> = rows.clone().into_par_iter().map(row_of_samples).collect::<Result<_>>()?;
            for (row, sums) in rows.zip(read) {
                let high = pixels(&(row..row + 1), 0, &composed.rows).len();
                for (column, sums) in around[row].clone().zip(sums) {
                    let wide = pixels(&(column..column + 1), canvas.lead, &composed.columns).len();
                    let at = row * self.columns + column;
                    self.colors[at] = sums.color();
                    self.shares[at] = sums.count / (wide * high).max(1) as f32;
                    self.deviations[at] = sums.deviation();
                }
            }
        }
        Ok(())
    }
}

impl Sums {
    fn add(&mut self, root: [f32; 3]) {
        self.count += 1.0;
        for (sum, value) in self.colors.iter_mut().zip(root) {
            *sum += value;
            self.squares += value * value;
        }
    }

    fn color(&self) -> Option<[f32; 3]> {
        (self.count > 0.0).then(|| self.colors.map(|sum| sum / self.count))
    }

    fn deviation(&self) -> f32 {
        let squares = self.color().map_or(0.0, |color| color.iter().map(|mean| mean * mean).sum::<f32>());
        (self.squares / self.count.max(1.0) - squares).max(0.0).sqrt()
    }
}
