//! Parts of photographs that their photographer does not want, where another photograph can be shown instead.

use std::sync::Arc;

use rayon::prelude::*;
use trueup_core::mask::{Mask, Masks};
use trueup_core::source::PhotographSource;

use crate::deformed_grid::DeformedGrid;
use crate::layout::CanvasLayout;

/// Where some photograph covers the canvas with a part that is not ignored, on a small canvas.
#[derive(Debug)]
pub(crate) struct ShownElsewhere {
    width: usize,
    height: usize,
    wholly: Vec<bool>,
}

impl ShownElsewhere {
    /// Looks at all photographs of `layout` on a canvas of `size` pixels; `None` if none of them has ignored parts.
    pub(crate) fn find(layout: &CanvasLayout, photographs: &dyn PhotographSource, size: [usize; 2]) -> Option<Self> {
        let masks: Vec<Masks> = layout.placed.iter().map(|placed| photographs.masks(placed.photograph)).collect();
        if masks.iter().all(|masks| masks.ignored.is_none()) {
            return None;
        }
        let [width, height] = size;
        let mut any = vec![false; width * height];
        for (placed, masks) in layout.placed.iter().zip(&masks) {
            let mut mesh = placed.mesh.clone();
            for vertex in &mut mesh.target {
                vertex[0] *= width as f64 / layout.width as f64;
                vertex[1] *= height as f64 / layout.height as f64;
            }
            let grid = DeformedGrid::new(&mesh, 1.0, false, width, height);
            any.par_chunks_mut(width * ROWS).enumerate().for_each(|(band, any)| {
                let rows = band * ROWS..band * ROWS + any.len() / width;
                grid.each_place(&(0..width), &rows, |[x, y], place, footprint| {
                    let ignored = masks.ignored.as_ref().is_some_and(|mask| mask.any_within(place, footprint));
                    any[(y - rows.start) * width + x] |= !ignored;
                });
            });
        }
        // The border of what is covered runs through the pixels along it.
        let at = |x: usize, y: usize| any[y * width + x];
        let inside = |x: usize, y: usize| {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            (y.saturating_sub(1)..=(y + 1).min(height - 1)).all(|y| (left..=right).all(|x| at(x, y)))
        };
        let wholly = (0..width * height).map(|index| inside(index % width, index / width)).collect();
        Some(Self { width, height, wholly })
    }

    /// Whether the place (x, y), in shares of the canvas's width and height, is covered.
    fn at(&self, [x, y]: [f64; 2]) -> bool {
        // The casts saturate.
        let (column, row) = ((x * self.width as f64) as usize, (y * self.height as f64) as usize);
        self.wholly[row.min(self.height - 1) * self.width + column.min(self.width - 1)]
    }
}

/// Rows of the small canvas looked at by one task.
const ROWS: usize = 16;

/// What of one photograph is not to be seen on a canvas.
#[derive(Debug, Clone)]
pub(crate) struct IgnoredPart {
    ignored: Arc<Mask>,
    covered: Arc<ShownElsewhere>,
    /// Shares of the canvas per pixel.
    share_per_px: [f64; 2],
}

impl IgnoredPart {
    /// The parts ignored by `masks`, where `covered`, on a canvas of `size` pixels; `None` without any.
    pub(crate) fn new(masks: &Masks, covered: Option<&Arc<ShownElsewhere>>, size: [usize; 2]) -> Option<Self> {
        let share_per_px = size.map(|length| 1.0 / length as f64);
        Some(Self { ignored: masks.ignored.clone()?, covered: covered?.clone(), share_per_px })
    }

    /// Whether the place of the photograph of size `size` that is shown at the canvas pixel (x, y) is not to be seen.
    pub(crate) fn hides(&self, place: [f64; 2], size: [f64; 2], [x, y]: [usize; 2]) -> bool {
        let [per_x, per_y] = self.share_per_px;
        self.ignored.contains(in_mask(&self.ignored, place, size))
            && self.covered.at([(x as f64 + 0.5) * per_x, (y as f64 + 0.5) * per_y])
    }
}

/// The place in a mask of a place in its photograph, which may be reduced to `size`.
pub(crate) fn in_mask(mask: &Mask, [x, y]: [f64; 2], size: [f64; 2]) -> [f64; 2] {
    [x * mask.width() as f64 / size[0], y * mask.height() as f64 / size[1]]
}
