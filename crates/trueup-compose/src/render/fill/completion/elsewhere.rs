//! The pixels that a tile is filled from.

use std::ops::Range;

use trueup_core::Result;

use super::super::{Canvas, FillTile, Shade};
use super::Completion;
use crate::store::PixelStore;
use crate::window::common;

/// What is shown elsewhere, for one tile.
pub(in super::super) struct Elsewhere<'a, P> {
    completion: &'a Completion,
    windows: Vec<Source<P>>,
}

/// What lies at one offset from the tile; columns and rows are those of the canvas.
struct Source<P> {
    offset: [isize; 2],
    columns: Range<usize>,
    rows: Range<usize>,
    pixels: Vec<P>,
}

impl<'a, P: Shade> Elsewhere<'a, P> {
    /// Reads it; `None` if the tile is filled with the smooth surface alone.
    pub(in super::super) fn read(
        canvas: &Canvas<'_>,
        store: &PixelStore<P>,
        tile: &FillTile,
        completion: &'a Completion,
    ) -> Result<Option<Self>> {
        let Some(offsets) = completion.offsets_within(&tile.columns, &tile.rows) else { return Ok(None) };
        let source = |offset: [isize; 2]| -> Result<Source<P>> {
            let moved = |range: &Range<usize>, by: isize| {
                range.start.saturating_add_signed(by)..range.end.saturating_add_signed(by)
            };
            let columns = common(&moved(&tile.columns, offset[0]), &(canvas.lead..canvas.lead + canvas.width));
            let rows = common(&moved(&tile.rows, offset[1]), &(0..canvas.height));
            let pixels = match columns.is_empty() || rows.is_empty() {
                true => Vec::new(),
                false => store.window(&(columns.start - canvas.lead..columns.end - canvas.lead), &rows)?,
            };
            Ok(Source { offset, columns, rows, pixels })
        };
        let windows = offsets.into_iter().map(source).collect::<Result<_>>()?;
        Ok(Some(Self { completion, windows }))
    }

    /// The color at a pixel of the canvas, roots of light, of which `smooth` is that of the surface.
    pub(in super::super) fn over(&self, [x, y]: [usize; 2], smooth: [f32; 3]) -> [f32; 3] {
        let share = self.completion.share_at([x, y]);
        if share <= 0.0 {
            return smooth;
        }
        let mut sum = [0.0; 3];
        for (at, weight) in self.completion.around([x, y]) {
            let there = self
                .completion
                .offset(at)
                .and_then(|offset| self.windows.iter().find(|source| source.offset == offset)?.root([x, y]));
            let (color, added) = (there.unwrap_or(smooth), self.completion.added[at]);
            (0..3).for_each(|k| sum[k] += weight * (color[k] + added[k]));
        }
        [0, 1, 2].map(|k| smooth[k] + share * (sum[k] - smooth[k]))
    }
}

impl<P: Shade> Source<P> {
    fn root(&self, [x, y]: [usize; 2]) -> Option<[f32; 3]> {
        let column = x.checked_add_signed(self.offset[0]).filter(|column| self.columns.contains(column))?;
        let row = y.checked_add_signed(self.offset[1]).filter(|row| self.rows.contains(row))?;
        let at = (row - self.rows.start) * self.columns.len() + column - self.columns.start;
        let [r, g, b, share] = self.pixels.get(at)?.root();
        (share > 0.0).then_some([r, g, b])
    }
}
