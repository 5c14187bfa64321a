//! The labelling of the canvas, at any pixel of it.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::neighbors::neighbors;
use crate::coverage::Rectangle;
use crate::label::{Label, NOBODY};
use crate::small_views::{PARTLY, SmallView, WHOLLY};

/// Which photograph the panorama shows where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Seams {
    width: usize,
    height: usize,
    /// Columns of a turn on a cylinder, its width; 0 on a plane.
    turn: usize,
    labels: Vec<Label>,
    /// For each photograph the pixels that no photograph covers wholly and that this one covers in part.
    partial: Vec<Vec<u32>>,
}

impl Seams {
    pub(super) fn new(labels: Vec<Label>, views: &[SmallView], [width, height]: [usize; 2], turn: usize) -> Self {
        let mut whole = vec![false; labels.len()];
        whole.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, whole)| {
            for view in views.iter().filter(|view| view.rows.contains(&y)) {
                let columns = view.columns.len();
                let pixels = &view.pixels[(y - view.rows.start) * columns..][..columns];
                for (x, pixel) in view.columns.clone().zip(pixels) {
                    whole[if x < width { x } else { x - width }] |= pixel[3] & WHOLLY != 0;
                }
            }
        });
        let partial = views
            .par_iter()
            .map(|view| {
                let touched = |(index, pixel): (usize, &[u8; 4])| {
                    let at = index_of(view, index, width);
                    (pixel[3] & PARTLY != 0 && !whole[at]).then_some(at as u32)
                };
                let mut partial: Vec<u32> = view.pixels.iter().enumerate().filter_map(touched).collect();
                partial.sort_unstable();
                partial
            })
            .collect();
        let mut seams = Self { width, height, turn, labels, partial };
        seams.fill_rim();
        seams
    }

    /// Everything shows photograph 0.
    pub fn of_one(width: usize, height: usize) -> Self {
        Self { width, height, turn: 0, labels: vec![0; width * height], partial: vec![Vec::new()] }
    }

    /// Whether they are seams between so many photographs on a canvas of `size` pixels, that of the small views.
    pub(crate) fn fit(&self, photographs: usize, size: [usize; 2], around: bool) -> bool {
        let Self { width, height, turn, labels, partial } = self;
        let is_known = |&label: &Label| label == NOBODY || usize::from(label) < photographs;
        [*width, *height] == size
            && *turn == if around { *width } else { 0 }
            && width.checked_mul(*height) == Some(labels.len())
            && labels.iter().all(is_known)
            && partial.len() == photographs
            && partial.iter().flatten().all(|&at| (at as usize) < labels.len())
    }

    /// Width of the canvas the seams were found on.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height of the canvas the seams were found on.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Labels of the canvas the seams were found on, row by row; [`NOBODY`] where nothing is.
    pub fn labels(&self) -> &[Label] {
        &self.labels
    }

    /// Gives uncovered pixels beside covered ones a label, so that the finer canvas has one wherever it is covered.
    fn fill_rim(&mut self) {
        // Coverage of a pixel of this canvas is judged at its middle; a finer canvas may reach one pixel further.
        const RINGS: usize = 2;
        for _ in 0..RINGS {
            let (width, height, turn) = (self.width, self.height, self.turn);
            let before = self.labels.clone();
            let old = before.as_slice();
            self.labels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, labels)| {
                for (x, label) in labels.iter_mut().enumerate().filter(|(_, label)| **label == NOBODY) {
                    let near = (y.saturating_sub(1)..(y + 2).min(height))
                        .flat_map(|v| neighbors(x, width, turn).map(move |u| old[v * width + u]));
                    // NOBODY is the largest label.
                    *label = near.min().unwrap_or(NOBODY);
                }
            });
        }
    }

    /// Label of the point (x, y), in pixels of this canvas: that of the four pixels around it with the most weight.
    /// On a cylinder x lies in the first turn.
    fn at(&self, x: f64, y: f64) -> Label {
        let place = self.place(x, y);
        let corners = self.corners(place.pixel);
        same(corners).unwrap_or_else(|| prevailing(corners, place.beyond))
    }

    /// Where a point lies between the middles of four pixels.
    #[inline]
    fn place(&self, x: f64, y: f64) -> Place {
        let before_first = self.turn > 0 && x < 0.5;
        let x = if before_first { x + self.width as f64 } else { x };
        let (x, y) = ((x - 0.5).max(0.0), (y - 0.5).max(0.0));
        let pixel = [(x as usize).min(self.width - 1), (y as usize).min(self.height - 1)];
        Place { pixel, beyond: [(x - pixel[0] as f64).min(1.0), (y - pixel[1] as f64).min(1.0)] }
    }

    /// Labels of a pixel and those right, below, and right below of it.
    #[inline]
    fn corners(&self, [left, top]: [usize; 2]) -> [Label; 4] {
        let beyond_last = self.turn > 0 && left + 1 == self.width;
        let right = if beyond_last { 0 } else { (left + 1).min(self.width - 1) };
        let bottom = (top + 1).min(self.height - 1);
        let label = |x: usize, y: usize| self.labels[y * self.width + x];
        [label(left, top), label(right, top), label(left, bottom), label(right, bottom)]
    }

    /// Labels of the points of row `v`, in pixels of this canvas, that lie `across` beside each other: `u` says where
    /// those of `columns` are. Replaces `out`.
    fn along(&self, columns: &Range<usize>, u: impl Fn(usize) -> f64, across: f64, v: f64, out: &mut Vec<Label>) {
        out.clear();
        let mut x = columns.start;
        while x < columns.end {
            let place = self.place(u(x), v);
            let corners = self.corners(place.pixel);
            let Some(label) = same(corners) else {
                out.push(prevailing(corners, place.beyond));
                x += 1;
                continue;
            };
            // As far as both rows of pixels have this label, all points between them have it.
            let first = place.pixel[0];
            let last = self.place(u(columns.end - 1), v).pixel[0].max(first);
            let mut beyond = first + 1;
            while beyond <= last && same(self.corners([beyond, place.pixel[1]])) == Some(label) {
                beyond += 1;
            }
            let more = ((beyond as f64 - first as f64 - place.beyond[0]) / across) as usize;
            let mut end = x.saturating_add(more).clamp(x + 1, columns.end);
            while end > x + 1 && !(first..beyond).contains(&self.place(u(end - 1), v).pixel[0]) {
                end -= 1;
            }
            out.resize(out.len() + end - x, label);
            x = end;
        }
    }

    /// Labels of the pixels `columns` of row `y` of a canvas of `full` pixels (width, height), replacing `out`;
    /// [`NOBODY`] where nothing is.
    pub fn row(&self, y: usize, columns: &Range<usize>, full: [usize; 2], out: &mut Vec<Label>) {
        let (across, down) = (self.width as f64 / full[0] as f64, self.height as f64 / full[1] as f64);
        let v = (y as f64 + 0.5) * down;
        self.along(columns, |x| (x as f64 + 0.5) * across, across, v, out);
    }

    /// Labels of the points `columns` of row `y` of a cylinder of `full` points (around, down), of which the first lies
    /// `lead` points left of the first turn.
    pub(crate) fn row_around(&self, y: usize, columns: &Range<usize>, lead: f64, full: [f64; 2], out: &mut Vec<Label>) {
        let (across, down) = (self.width as f64 / full[0], self.height as f64 / full[1]);
        let v = (y as f64 + 0.5) * down;
        // The remainder is exact, so that every turn gives the same.
        self.along(columns, |x| (x as f64 + 0.5 - lead).rem_euclid(full[0]) * across, across, v, out);
    }

    /// Labels of all pixels of a part of a canvas of `full` pixels (width, height), row by row.
    pub fn on_canvas(&self, part: &Rectangle, full: [usize; 2]) -> Vec<Label> {
        let mut row = Vec::new();
        let mut labels = Vec::with_capacity(part.area());
        for y in part.rows.clone() {
            self.row(y, &part.columns, full, &mut row);
            labels.extend_from_slice(&row);
        }
        labels
    }

    /// Labels of `width` x `height` places, evenly over a part of a canvas of `full` pixels (width, height), row by
    /// row.
    pub fn on_places(&self, part: &Rectangle, full: [usize; 2], [width, height]: [usize; 2]) -> Vec<Label> {
        let (across, down) = (self.width as f64 / full[0] as f64, self.height as f64 / full[1] as f64);
        let along = |range: &Range<usize>, place: usize, places: usize| {
            range.start as f64 + (place as f64 + 0.5) / places as f64 * range.len() as f64
        };
        let row = |y: usize| {
            let v = along(&part.rows, y, height) * down;
            (0..width).map(move |x| self.at(along(&part.columns, x, width) * across, v))
        };
        (0..height).flat_map(row).collect()
    }

    /// The photographs that a box of a canvas of `full` pixels (width, height) may show, in order; on a
    /// cylinder columns may run into any further turn.
    pub(crate) fn shown_in(&self, columns: &Range<usize>, rows: &Range<usize>, full: [usize; 2]) -> Vec<Label> {
        let low = |at: usize, of: usize, full: usize| (at * of / full).saturating_sub(1);
        let high = |at: usize, of: usize, full: usize| (at * of / full + 2).min(of);
        let rows = low(rows.start, self.height, full[1])..high(rows.end, self.height, full[1]);
        let mut found: Vec<Label> = Vec::new();
        for columns in self.in_first_turn(columns, full[0]).iter().filter(|columns| !columns.is_empty()) {
            let columns = low(columns.start, self.width, full[0])..high(columns.end, self.width, full[0]);
            self.add_shown_in(&columns, &rows, &mut found);
        }
        found.sort_unstable();
        found
    }

    /// The columns of the first turn that are meant by `columns`, in one part or two, the second empty if there is
    /// none. Where they meet an end, a pixel of the other end is among them.
    fn in_first_turn(&self, columns: &Range<usize>, full: usize) -> [Range<usize>; 2] {
        if self.turn == 0 {
            return [columns.clone(), 0..0];
        }
        // A pixel of the small canvas more on both sides: labels are read between pixels.
        let reach = full.div_ceil(self.width) + 1;
        let (start, length) = (columns.start + full - reach % full, columns.len() + 2 * reach);
        if length >= full {
            return [0..full, 0..0];
        }
        let start = start % full;
        let end = start + length;
        if end <= full { [start..end, 0..0] } else { [start..full, 0..end - full] }
    }

    /// Adds the photographs that a box of this canvas may show to those `found`.
    fn add_shown_in(&self, columns: &Range<usize>, rows: &Range<usize>, found: &mut Vec<Label>) {
        for y in rows.clone() {
            for same in self.labels[y * self.width..][columns.clone()].chunk_by(|a, b| a == b) {
                if same[0] != NOBODY && !found.contains(&same[0]) {
                    found.push(same[0]);
                }
            }
        }
        for (label, partial) in self.partial.iter().enumerate() {
            let first = partial.partition_point(|&at| (at as usize) < rows.start * self.width);
            let inside = partial[first..]
                .iter()
                .take_while(|&&at| (at as usize) < rows.end * self.width)
                .any(|&at| columns.contains(&(at as usize % self.width)));
            if inside && !found.contains(&(label as Label)) {
                found.push(label as Label);
            }
        }
    }
}

/// A pixel, and how far beyond its middle a point lies along x and y, 0 to 1.
struct Place {
    pixel: [usize; 2],
    beyond: [f64; 2],
}

/// The label that all four pixels have, if they do.
#[inline]
fn same(corners: [Label; 4]) -> Option<Label> {
    corners.iter().all(|&one| one == corners[0]).then_some(corners[0])
}

/// Of the labels of four pixels that with the most weight at a point between their middles.
fn prevailing(corners: [Label; 4], [u, v]: [f64; 2]) -> Label {
    let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
    let mut best = (NOBODY, -1.0);
    for &candidate in corners.iter().filter(|&&one| one != NOBODY) {
        let weight: f64 =
            corners.iter().zip(weights).filter(|(one, _)| **one == candidate).map(|(_, weight)| weight).sum();
        // Ties go to the lower label, whatever their order.
        if weight > best.1 || weight == best.1 && candidate < best.0 {
            best = (candidate, weight);
        }
    }
    best.0
}

fn index_of(view: &SmallView, index: usize, width: usize) -> usize {
    let columns = view.columns.len();
    let x = view.columns.start + index % columns;
    (view.rows.start + index / columns) * width + if x < width { x } else { x - width }
}
