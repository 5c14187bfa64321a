//! The panorama in cells before it is composed: what the small views show along the seams, and at the border of what is
//! covered the photographs themselves.

use rayon::prelude::*;

use super::ahead::{BorderDeviations, CellsAhead};
use super::cells::{CellGrid, Cells, Sums};
use crate::label::{Label, NOBODY};
use crate::seam::Seams;
use crate::small_views::{SmallView, WHOLLY};
use crate::transfer_curve::Encoding;

impl CellsAhead {
    /// What the photographs show of the cells along the seams; `border` is one for each of the views.
    pub(crate) fn cut(self, views: &[SmallView], border: &[BorderDeviations], seams: &Seams) -> CutCells {
        let CellGrid { side, columns, rows, canvas } = self.grid;
        let [width, height] = [seams.width(), seams.height()];
        let turn = if self.around { width } else { 0 };
        // Pixels of the small canvas belong to the cell in which their middles lie.
        let pixels = |cell: usize, axis: usize, small: usize| {
            let first = |cell: usize| ((cell * side) as f64 / canvas[axis] as f64 * small as f64 - 0.5).ceil();
            // The casts saturate.
            (first(cell) as usize).min(small)..(first(cell + 1) as usize).min(small)
        };
        let parts_of = |cell: usize| {
            let mut shown: Vec<(Label, Sums)> = Vec::new();
            for y in pixels(cell / columns, 1, height) {
                for x in pixels(cell % columns, 0, width) {
                    let label = seams.labels()[y * width + x];
                    if label != NOBODY
                        && let view = &views[usize::from(label)]
                        && let Some(index) = view.index_around(x, y, turn)
                        && let [r, g, b, flags] = view.pixels[index]
                        && flags & WHOLLY != 0
                    {
                        let at = shown.iter().position(|(one, _)| *one == label).unwrap_or_else(|| {
                            shown.push((label, Sums::default()));
                            shown.len() - 1
                        });
                        shown[at].1.add([r, g, b].map(f32::from));
                    }
                }
            }
            let part = |(label, sums): (Label, Sums)| {
                let border = &border[usize::from(label)];
                let deviation = match border.binary_search_by_key(&cell, |(cell, _)| *cell) {
                    Ok(found) => border[found].1,
                    Err(_) => sums.deviation(),
                };
                CutPart { cell, label, pixels: sums.count() as f32, level: sums.color(), deviation }
            };
            shown.into_iter().map(part).collect::<Vec<_>>()
        };
        let parts = (0..columns * rows).into_par_iter().flat_map_iter(parts_of).collect();
        CutCells { ahead: self, parts }
    }
}

/// What a photograph shows of a cell.
#[derive(Debug, Clone, Copy)]
struct CutPart {
    cell: usize,
    label: Label,
    /// How many pixels of the small views it is.
    pixels: f32,
    /// As in a small view.
    level: [f32; 3],
    /// Standard deviation of the luma, levels.
    deviation: f32,
}

/// The cells of a canvas, cut along the seams.
#[derive(Debug)]
pub(crate) struct CutCells {
    ahead: CellsAhead,
    /// In order of the cells.
    parts: Vec<CutPart>,
}

impl CutCells {
    /// For each part the photograph, and the cell's middle in pixels from the canvas's corner.
    pub(crate) fn places(&self) -> Vec<(Label, [f64; 2])> {
        let grid = &self.ahead.grid;
        let middle = |index: usize, axis: usize| {
            let pixels = grid.pixels(index, axis);
            0.5 * (pixels.start + pixels.end) as f64
        };
        let place =
            |part: &CutPart| (part.label, [middle(part.cell % grid.columns, 0), middle(part.cell / grid.columns, 1)]);
        self.parts.iter().map(place).collect()
    }

    /// The cells as they will be when blending makes these `changes` of [`Self::places`]. Steps at seams, which
    /// blending takes away, count as no deviation. Cells between the pixels of the small views, as narrow ones at the
    /// canvas's end may be, are like those beside them.
    pub(crate) fn blended(self, changes: &[[f32; 3]], encoding: &Encoding) -> Cells {
        const WHITE: f32 = 255.0;
        let CellGrid { side, columns, rows, .. } = self.ahead.grid;
        let encode = encoding.linear16();
        let mut pixels = vec![0.0_f32; columns * rows];
        let mut colors = vec![[0.0_f32; 3]; columns * rows];
        let mut variances = vec![0.0_f32; columns * rows];
        for (part, change) in self.parts.iter().zip(changes) {
            pixels[part.cell] += part.pixels;
            variances[part.cell] += part.pixels * part.deviation * part.deviation;
            for ((sum, level), change) in colors[part.cell].iter_mut().zip(part.level).zip(change) {
                let root = (encoding.root_of_view(level / WHITE) + change).max(0.0);
                *sum +=
                    part.pixels * f32::from(encode.level(encoding.light_of_root(root))) * (WHITE / f32::from(u16::MAX));
            }
        }
        for ((pixels, color), variance) in pixels.iter().zip(&mut colors).zip(&mut variances) {
            *color = color.map(|sum| sum / pixels.max(1.0));
            *variance /= pixels.max(1.0);
        }
        let deviations = variances.into_iter().map(f32::sqrt).collect();
        let CellsAhead { covered, around, .. } = self.ahead;
        let is_seen = pixels.into_iter().map(|pixels| pixels > 0.0).collect();
        Cells { side, columns, rows, covered, colors, deviations, around }.with_unseen(is_seen)
    }
}
