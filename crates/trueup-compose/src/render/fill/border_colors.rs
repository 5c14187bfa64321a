//! The colors of the borders of gaps: what is of another kind than most of a border is not carried into the gap.

use crate::pyramid::{PyramidPlane, color};

/// The colors of the borders of gaps, each over what lies around it; none known by default.
#[derive(Debug, Default)]
pub(super) struct BorderColors {
    means: PyramidPlane<[f32; 4]>,
    /// Log2 of the pixels per sample.
    level: u32,
}

impl BorderColors {
    /// From what is known of the borders at a level: the kind of color that is more of a wide part of the border, and
    /// by it that of ever smaller parts. Where a roof meets the sky beside a gap, the mean of both is neither.
    pub(super) fn of(known: &PyramidPlane<[f32; 4]>, level: u32) -> Self {
        /// Levels above it that the kind is sought at: samples of 64 pixels on most canvases at first, of 32 at last,
        /// which see three times as far, so that a lamp or a twig is the lesser part of what they see. From samples of
        /// 128, a sky is carried on over the clouds that lie beside the gap.
        const COARSER: [u32; 2] = [3, 2];
        let means = |plane: PyramidPlane<[f32; 4]>, levels: u32| Self {
            means: (0..levels).fold(plane, |plane, _| plane.reduced()),
            level: level + levels,
        };
        COARSER[1..].iter().fold(means(known.clone(), COARSER[0]), |wider, &coarser| {
            let mut belonging = known.clone();
            for y in belonging.rows.clone() {
                let first = belonging.columns.start;
                for (x, texel) in (first..).zip(belonging.row_mut(y)) {
                    if let Some(root) = color(*texel) {
                        let share = wider.belonging(x << level, y << level, root);
                        *texel = texel.map(|value| value * share);
                    }
                }
            }
            means(belonging, coarser)
        })
    }

    /// How much a color at a pixel of the canvas belongs to the border around it: Tukey's biweight of its distance. A
    /// lamp that ends at the border of a sky is no part of it, and is not carried on.
    pub(super) fn belonging(&self, x: usize, y: usize, root: [f32; 3]) -> f32 {
        /// Distance from which on a color is of another kind, square root of linear light: three times what clouds
        /// differ by.
        const OTHER_KIND: f32 = 0.25;
        /// What it counts all the same, where the border has no kind.
        const LEAST: f32 = 0.002;
        let (x, y) = (x >> self.level, y >> self.level);
        if !(self.means.columns.contains(&x) && self.means.rows.contains(&y)) {
            return 1.0;
        }
        let Some(mean) = color(self.means.row(y)[x - self.means.columns.start]) else { return 1.0 };
        let apart = (0..3).map(|k| (root[k] - mean[k]).abs()).fold(0.0, f32::max) / OTHER_KIND;
        if apart < 1.0 { (1.0 - apart * apart).powi(2).max(LEAST) } else { LEAST }
    }
}
