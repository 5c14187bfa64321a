//! A gap, what lies along it, and what around it may fill it.

use std::ops::Range;

use rayon::prelude::*;

use super::samples::{Samples, reach};
use super::{kinds, roughness};
use crate::flood;
use crate::window::widened;

/// Width of the border that what fills a gap must fit, as a share of the gap's depth, and fewest and most samples.
const BORDER: f64 = 0.25;
const BORDERS: [usize; 2] = [2, 4];

/// Samples of a gap at least: in a smaller one, a smooth surface is not seen to be smooth.
const LEAST_GAP: usize = 16;

/// A gap's samples and those around it, row by row.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
    /// The gap's own samples, in ascending order.
    pub(super) gap: Vec<usize>,
    /// The gap's borders: whole samples beside it, and for each one of the gap's nearest to it.
    pub(super) border: Vec<[usize; 2]>,
    /// How much the border beside each sample of the gap differs from place to place; see [`roughness`].
    pub(super) rough: Vec<f32>,
    /// Whether a sample may be shown in the gap.
    pub(super) usable: Vec<bool>,
    pub(super) colors: Vec<Option<[f32; 3]>>,
    /// How far above or below a place what is shown there may lie.
    pub(super) reach_down: usize,
}

impl Part {
    /// The gaps that are one each, but for small ones, those whose border a smooth surface goes on, and those that go
    /// across the ends of a full turn, whose columns are `once`.
    pub(super) fn all(samples: &Samples, once: &Range<usize>, around: bool) -> Vec<Self> {
        let mut is_open = samples.open.clone();
        let mut gaps = Vec::new();
        for start in 0..is_open.len() {
            if !std::mem::take(&mut is_open[start]) {
                continue;
            }
            let mut gap = vec![start];
            let mut next = 0;
            while let Some(&at) = gap.get(next) {
                next += 1;
                let further = beside(at, samples.columns, samples.rows);
                gap.extend(further.filter(|&other| std::mem::take(&mut is_open[other])));
            }
            let across = |&at: &usize| {
                let column = at % samples.columns;
                column <= once.start >> samples.level || column > once.end >> samples.level
            };
            if gap.len() >= LEAST_GAP && !(around && gap.iter().any(across)) {
                gaps.push(gap);
            }
        }
        gaps.into_par_iter().filter_map(|gap| Self::of(samples, gap)).collect()
    }

    /// `None` if the border is even.
    fn of(samples: &Samples, gap: Vec<usize>) -> Option<Self> {
        let hull = |places: &dyn Fn(&usize) -> usize| {
            let (first, last) = gap.iter().map(places).fold((usize::MAX, 0), |(a, b), at| (a.min(at), b.max(at)));
            first..last + 1
        };
        let depth = depth(&gap, samples);
        let [beside, reach_down] = reach(depth as f64);
        let columns = widened(&hull(&|at| at % samples.columns), beside, samples.columns);
        let rows = widened(&hull(&|at| at / samples.columns), reach_down, samples.rows);
        let own =
            |at: usize| (at / samples.columns - rows.start) * columns.len() + at % samples.columns - columns.start;
        let mut gap: Vec<usize> = gap.into_iter().map(own).collect();
        gap.sort_unstable();
        let colors: Vec<_> = samples.within(&columns, &rows).map(|at| samples.colors[at]).collect();
        let is_whole: Vec<bool> =
            samples.within(&columns, &rows).map(|at| samples.whole[at] && samples.colors[at].is_some()).collect();
        let wide = ((BORDER * depth as f64) as usize).clamp(BORDERS[0], BORDERS[1]);
        let border = border(&gap, [columns.len(), rows.len()], wide, &is_whole);
        let mut part = Self { columns, rows, gap, border, rough: Vec::new(), usable: Vec::new(), colors, reach_down };
        part.rough = roughness::of(&part);
        if part.rough.iter().all(|&rough| rough == 0.0) {
            return None;
        }
        part.usable = kinds::usable(&part, samples, &is_whole);
        Some(part)
    }

    pub(super) fn width(&self) -> usize {
        self.columns.len()
    }

    /// Which samples are the gap's own.
    pub(super) fn is_gap(&self) -> Vec<bool> {
        self.are(self.gap.iter().copied())
    }

    /// Which samples are the gap's borders.
    pub(super) fn is_border(&self) -> Vec<bool> {
        self.are(self.border.iter().map(|&[at, _]| at))
    }

    fn are(&self, samples: impl Iterator<Item = usize>) -> Vec<bool> {
        let mut are = vec![false; self.colors.len()];
        samples.for_each(|at| are[at] = true);
        are
    }

    /// The square of the distance of two samples.
    pub(super) fn distance_squared(&self, one: usize, other: usize) -> usize {
        let width = self.width();
        (one % width).abs_diff(other % width).pow(2) + (one / width).abs_diff(other / width).pow(2)
    }

    /// The sample that lies at an offset from one; `None` outside.
    pub(super) fn moved(&self, at: usize, [across, down]: [isize; 2]) -> Option<usize> {
        let x = (at % self.width()).checked_add_signed(across).filter(|&x| x < self.width())?;
        let y = (at / self.width()).checked_add_signed(down).filter(|&y| y < self.rows.len())?;
        Some(y * self.width() + x)
    }

    /// [`Self::moved`], where it may be shown in the gap.
    pub(super) fn source(&self, at: usize, offset: [isize; 2]) -> Option<usize> {
        self.moved(at, offset).filter(|&source| self.usable[source])
    }
}

/// The four samples beside one.
pub(super) fn beside(at: usize, columns: usize, rows: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (at % columns, at / columns);
    let left = (x > 0).then(|| at - 1);
    let right = (x + 1 < columns).then_some(at + 1);
    let above = (y > 0).then(|| at - columns);
    let below = (y + 1 < rows).then_some(at + columns);
    [left, right, above, below].into_iter().flatten()
}

/// Steps from what is not open to the sample of a gap that is farthest from it.
fn depth(gap: &[usize], samples: &Samples) -> usize {
    let beside = |at: usize| beside(at, samples.columns, samples.rows);
    let outer = gap.iter().copied().filter(|&at| beside(at).any(|other| !samples.open[other]));
    let mut is_reached: Vec<bool> = samples.open.iter().map(|&open| !open).collect();
    flood::rounds(outer.collect(), &mut is_reached, beside)
}

/// See [`Part::border`].
fn border(gap: &[usize], [columns, rows]: [usize; 2], wide: usize, is_whole: &[bool]) -> Vec<[usize; 2]> {
    let mut reached = vec![false; columns * rows];
    gap.iter().for_each(|&at| reached[at] = true);
    let mut front: Vec<[usize; 2]> = gap.iter().map(|&at| [at, at]).collect();
    let mut border = Vec::new();
    for _ in 0..wide {
        let mut next = Vec::new();
        for &[at, nearest] in &front {
            for other in beside(at, columns, rows) {
                if is_whole[other] && !std::mem::replace(&mut reached[other], true) {
                    next.push([other, nearest]);
                }
            }
        }
        border.extend(&next);
        front = next;
    }
    border
}
