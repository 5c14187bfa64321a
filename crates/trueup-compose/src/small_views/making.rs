//! A photograph made small for the search of the seams.

use std::sync::Arc;

use trueup_core::mask::{Mask, Masks};

use super::sampling::SAMPLING;
use super::view::{CLIPPED, IGNORED, KEPT, PARTLY, SmallPixel, SmallView, WHOLLY};
use crate::ignored::in_mask;
use crate::layout::columns_around;
use crate::transfer_curve::EncodeRoots;
use crate::warped::{RowSink, SamplingMemory, WarpedPhotograph};
use crate::weights::WHOLE;
use crate::window::Window;

/// Level of the camera's own values (0 to 255) from which on a channel counts as saturated.
const SATURATED: f32 = 252.0;

/// A photograph as the search for seams sees it; `period` is the width of the small canvas if it is a cylinder.
/// `view_levels` are those of [`Encoding::view_levels`](crate::transfer_curve::Encoding::view_levels).
pub(super) fn small_view(
    warped: &WarpedPhotograph<'_>,
    masks: &Masks,
    period: Option<usize>,
    view_levels: Option<&EncodeRoots>,
) -> SmallView {
    let (all, rows) = (warped.columns(), warped.rows());
    let columns = all.start..all.end.min(all.start + period.unwrap_or(all.len()));
    let window = Window { columns: &columns, rows: &rows };
    let pixels = Vec::with_capacity(columns.len() * rows.len());
    let mut making = SmallRows { view_levels, clipped: vec![false; columns.len()], pixels };
    warped.sample_rows(window, &SAMPLING, &mut SamplingMemory::default(), &mut making);
    let mut pixels = making.pixels;
    mark(&mut pixels, window, warped, masks);
    let (columns, turned) = columns_around(columns, period);
    if turned > 0 {
        pixels.chunks_exact_mut(columns.len()).for_each(|row| row.rotate_right(turned));
    }
    SmallView { columns, rows, pixels }
}

/// Makes a small view's pixels of rows as they come.
struct SmallRows<'a> {
    view_levels: Option<&'a EncodeRoots>,
    /// Which of the row's pixels are clipped.
    clipped: Vec<bool>,
    pixels: Vec<SmallPixel>,
}

impl RowSink for SmallRows<'_> {
    fn own(&mut self, first: usize, samples: &[[f32; 4]]) {
        for (clipped, sample) in self.clipped[first..].iter_mut().zip(samples) {
            *clipped = sample[..3].iter().any(|&level| level >= SATURATED);
        }
    }

    fn row(&mut self, _number: usize, row: &mut [[f32; 4]]) {
        let view_levels = self.view_levels;
        let pixel = |(&[r, g, b, share], clipped): (&[f32; 4], &mut bool)| {
            let clipped = std::mem::take(clipped);
            // The casts saturate.
            let level = |root: f32| match view_levels {
                Some(levels) => levels.level((root * f32::from(u16::MAX) + 0.5) as u16),
                None => (root * 255.0 + 0.5) as u8,
            };
            let flags = (u8::from(share > 0.0) * PARTLY)
                | (u8::from(share >= WHOLE) * WHOLLY)
                | (u8::from(clipped && share > 0.0) * CLIPPED);
            [level(r), level(g), level(b), flags]
        };
        self.pixels.extend(row.iter().zip(&mut self.clipped).map(pixel));
    }
}

/// Adds what the photographer marked to the pixels of a window.
fn mark(pixels: &mut [SmallPixel], window: Window<'_>, warped: &WarpedPhotograph<'_>, masks: &Masks) {
    if masks.ignored.is_none() && masks.kept.is_none() {
        return;
    }
    let Window { columns, rows } = window;
    let size = warped.grid().size;
    warped.grid().each_place(columns, rows, |[x, y], place, footprint| {
        let flags = &mut pixels[(y - rows.start) * columns.len() + x - columns.start][3];
        if *flags & PARTLY == 0 {
            return;
        }
        let ignored = |mask: &Arc<Mask>| mask.any_within(in_mask(mask, place, size), in_mask(mask, footprint, size));
        let kept = |mask: &Arc<Mask>| mask.contains(in_mask(mask, place, size));
        *flags |= u8::from(masks.ignored.as_ref().is_some_and(ignored)) * IGNORED;
        *flags |= u8::from(masks.kept.as_ref().is_some_and(kept)) * KEPT;
    });
}
