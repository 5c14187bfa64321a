//! A gap, what lies along it, and what around it may fill it.

use std::ops::Range;

use super::samples::{Samples, reach};
use crate::window::{near, widened};

/// Width of the border that what fills a gap must fit, as a share of the gap's depth, and fewest and most samples.
const BORDER: f64 = 0.25;
const BORDERS: [usize; 2] = [2, 4];

/// Most that a sample differs from one of the border that is of its kind, root of light.
const SAME_COLOR: f32 = 0.08;

/// The same of the deviation of its pixels, as a multiple and beyond it: a tree is as dark as the sky between clouds, but not as even.
const SAME_DEVIATION: f32 = 1.5;

/// The same of the mean deviation around that of the border, as a multiple of its own: a pavement is as gray as a tree's shade, but evener.
const SAME_TEXTURE: f32 = 2.0;

/// Deviations that are alike whatever their proportion: noise.
const NOISE: f32 = 0.01;

/// Half the side of the square of samples whose deviations are averaged.
const TEXTURE: usize = 2;

/// Least share of the border that is of the kind of what fills a gap: a lamp that ends at a border fills none.
const LEAST_OF_BORDER: f32 = 0.02;

/// Samples of a border that others are compared with, at most.
const MOST_KINDS: usize = 512;

/// Samples of a gap at least: in a smaller one, a smooth surface is not seen to be smooth.
const LEAST_GAP: usize = 16;

/// What a sample shows.
struct Kind {
    color: [f32; 3],
    deviation: f32,
    /// Mean deviation of the samples around it.
    texture: f32,
}

impl Kind {
    fn is_of(&self, border: &Self) -> bool {
        (0..3).all(|k| (self.color[k] - border.color[k]).abs() <= SAME_COLOR)
            && self.deviation <= SAME_DEVIATION * border.deviation + NOISE
            && border.texture <= SAME_TEXTURE * self.texture + NOISE
    }
}

/// A gap's samples and those around it, row by row.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
    /// The gap's own samples, in ascending order.
    pub(super) gap: Vec<usize>,
    /// The gap's borders: whole samples beside it, and for each one of the gap's nearest to it.
    pub(super) border: Vec<[usize; 2]>,
    /// Whether a sample may be shown in the gap.
    pub(super) usable: Vec<bool>,
    pub(super) colors: Vec<Option<[f32; 3]>>,
    /// How far above or below a place what is shown there may lie.
    pub(super) reach_down: usize,
}

impl Part {
    /// The gaps that are one each, but for small ones and those that go across the ends of a full turn, whose columns are `once`.
    pub(super) fn all(samples: &Samples, once: &Range<usize>, around: bool) -> Vec<Self> {
        let mut seen = vec![false; samples.open.len()];
        let mut parts = Vec::new();
        for start in 0..samples.open.len() {
            if !samples.open[start] || seen[start] {
                continue;
            }
            seen[start] = true;
            let mut gap = vec![start];
            let mut next = 0;
            while let Some(&at) = gap.get(next) {
                next += 1;
                for other in beside(at, samples.columns, samples.rows) {
                    if samples.open[other] && !std::mem::replace(&mut seen[other], true) {
                        gap.push(other);
                    }
                }
            }
            let across = |&at: &usize| {
                let column = at % samples.columns;
                column <= once.start >> samples.level || column > once.end >> samples.level
            };
            if gap.len() >= LEAST_GAP && !(around && gap.iter().any(across)) {
                parts.push(Self::of(samples, gap));
            }
        }
        parts
    }

    fn of(samples: &Samples, gap: Vec<usize>) -> Self {
        let hull = |places: &dyn Fn(&usize) -> usize| {
            let (first, last) = gap.iter().map(places).fold((usize::MAX, 0), |(a, b), at| (a.min(at), b.max(at)));
            first..last + 1
        };
        let depth = depth(&gap, samples.columns, samples.rows, |at| samples.open[at]);
        let [beside, reach_down] = reach(depth as f64);
        let columns = widened(&hull(&|at| at % samples.columns), beside, samples.columns);
        let rows = widened(&hull(&|at| at / samples.columns), reach_down, samples.rows);
        let width = columns.len();
        let own = |at: usize| (at / samples.columns - rows.start) * width + at % samples.columns - columns.start;
        let mut gap: Vec<usize> = gap.into_iter().map(own).collect();
        gap.sort_unstable();
        let on_canvas = |at: usize| (at / width + rows.start) * samples.columns + at % width + columns.start;
        let count = width * rows.len();
        let colors: Vec<Option<[f32; 3]>> = (0..count).map(|at| samples.colors[on_canvas(at)]).collect();
        let is_whole = |at: usize| samples.whole[on_canvas(at)] && colors[at].is_some();
        let wide = ((BORDER * depth as f64) as usize).clamp(BORDERS[0], BORDERS[1]);
        let border = border(&gap, width, rows.len(), wide, is_whole);
        let deviations: Vec<f32> = (0..count).map(|at| samples.deviations[on_canvas(at)]).collect();
        let square = |at: usize, reach: usize| {
            let (x, y) = (at % width, at / width);
            near(y, reach, rows.len(), false)
                .flat_map(move |y| near(x, reach, width, false).map(move |x| y * width + x))
        };
        let texture = |at: usize| {
            let known = square(at, TEXTURE).filter(|&other| is_whole(other));
            let (sum, count) = known.fold((0.0, 0.0_f32), |(sum, count), other| (sum + deviations[other], count + 1.0));
            sum / count.max(1.0)
        };
        let kind = |at: usize| colors[at].map(|color| Kind { color, deviation: deviations[at], texture: texture(at) });
        let step = border.len().div_ceil(MOST_KINDS).max(1);
        let kinds: Vec<Kind> = border.iter().step_by(step).filter_map(|&[at, _]| kind(at)).collect();
        let least = (LEAST_OF_BORDER * kinds.len() as f32).max(1.0) as usize;
        let is_of_kind = |at: usize| {
            let own = kind(at).filter(|_| is_whole(at));
            own.is_some_and(|own| kinds.iter().filter(|border| own.is_of(border)).take(least).count() == least)
        };
        let of_kind: Vec<bool> = (0..count).map(is_of_kind).collect();
        let usable = (0..count).map(|at| square(at, 1).all(|other| of_kind[other])).collect();
        Self { columns, rows, gap, border, usable, colors, reach_down }
    }

    pub(super) fn width(&self) -> usize {
        self.columns.len()
    }

    /// Which samples are the gap's own.
    pub(super) fn is_gap(&self) -> Vec<bool> {
        let mut is_gap = vec![false; self.usable.len()];
        self.gap.iter().for_each(|&at| is_gap[at] = true);
        is_gap
    }

    /// Which samples are the gap's borders.
    pub(super) fn is_border(&self) -> Vec<bool> {
        let mut is_border = vec![false; self.usable.len()];
        self.border.iter().for_each(|&[at, _]| is_border[at] = true);
        is_border
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
fn depth(gap: &[usize], columns: usize, rows: usize, is_open: impl Fn(usize) -> bool) -> usize {
    let mut reached = vec![false; columns * rows];
    let outer = |&at: &usize| beside(at, columns, rows).any(|other| !is_open(other));
    let mut front: Vec<usize> = gap.iter().copied().filter(outer).collect();
    front.iter().for_each(|&at| reached[at] = true);
    let mut steps = 0;
    while !front.is_empty() {
        steps += 1;
        let further = front.iter().flat_map(|&at| beside(at, columns, rows));
        front = further.filter(|&at| is_open(at) && !std::mem::replace(&mut reached[at], true)).collect();
    }
    steps
}

/// See [`Part::border`].
fn border(
    gap: &[usize],
    columns: usize,
    rows: usize,
    wide: usize,
    is_whole: impl Fn(usize) -> bool,
) -> Vec<[usize; 2]> {
    let mut reached = vec![false; columns * rows];
    gap.iter().for_each(|&at| reached[at] = true);
    let mut front: Vec<[usize; 2]> = gap.iter().map(|&at| [at, at]).collect();
    let mut border = Vec::new();
    for _ in 0..wide {
        let mut next = Vec::new();
        for &[at, nearest] in &front {
            for other in beside(at, columns, rows) {
                if is_whole(other) && !std::mem::replace(&mut reached[other], true) {
                    next.push([other, nearest]);
                }
            }
        }
        border.extend(&next);
        front = next;
    }
    border
}
