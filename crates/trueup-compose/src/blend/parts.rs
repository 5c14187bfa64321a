//! Which rows of the photographs a tile is made of: where memory has no room for whole ones, no others are held.

use std::collections::BTreeMap;
use std::ops::Range;

use super::tile::sampled_window;
use crate::deformed_grid::DeformedGrid;
use crate::label::Label;
use crate::layout::{Placed, Unrolled};
use crate::pyramid::tile_side;
use crate::window::{Window, common, widened};

/// The photograph of each placement: how large it is, and how much of it is held for a tile.
#[derive(Debug)]
pub(super) struct HeldPhotographs {
    /// Bytes of each as a whole.
    bytes: Vec<usize>,
    /// Rows of each.
    heights: Vec<usize>,
    /// Where each lies on the canvas, if it is held in parts.
    grids: Option<Vec<DeformedGrid>>,
}

/// Photographs, by placement, and the rows of them that are wanted.
pub(super) type WantedRows = BTreeMap<Label, Range<usize>>;

impl HeldPhotographs {
    /// Whole photographs of so many `bytes`, one for each placement.
    pub(super) fn whole(unrolled: &Unrolled<'_>, bytes: Vec<usize>) -> Self {
        let heights = unrolled.placed().iter().map(height).collect();
        Self { bytes, heights, grids: None }
    }

    /// The same in parts.
    pub(super) fn in_parts(self, unrolled: &Unrolled<'_>) -> Self {
        Self { grids: Some(unrolled.placed().iter().map(|placed| grid(placed, unrolled)).collect()), ..self }
    }

    /// Whether no more than parts of photographs are held.
    pub(super) fn is_in_parts(&self) -> bool {
        self.grids.is_some()
    }

    /// Bytes of each photograph as a whole.
    pub(super) fn bytes(&self) -> &[usize] {
        &self.bytes
    }

    /// Rows of a photograph.
    pub(super) fn height(&self, placement: usize) -> usize {
        self.heights[placement]
    }

    /// What is held of the photographs of the placements `shown`, as far as there are such, for what is sampled in a
    /// window.
    pub(super) fn wanted(&self, shown: &[Label], window: Window<'_>) -> WantedRows {
        let known = shown.iter().filter(|&&label| usize::from(label) < self.bytes.len());
        known.map(|&label| (label, self.rows(usize::from(label), window))).collect()
    }

    fn rows(&self, placement: usize, window: Window<'_>) -> Range<usize> {
        let height = self.heights[placement];
        match &self.grids {
            None => 0..height,
            Some(grids) => wanted_rows(&grids[placement], window, height),
        }
    }

    /// Bytes of what is wanted.
    pub(super) fn size(&self, wanted: &WantedRows) -> usize {
        wanted.iter().map(|(&label, rows)| self.part(usize::from(label), rows)).fold(0, usize::saturating_add)
    }

    /// Bytes of some rows of a photograph.
    pub(super) fn part(&self, placement: usize, rows: &Range<usize>) -> usize {
        part(self.bytes[placement], rows.len(), self.heights[placement])
    }
}

/// Adds what else is wanted. Of a photograph, all rows between those that are.
pub(super) fn join(wanted: &mut WantedRows, more: &WantedRows) {
    for (&label, rows) in more {
        let joined = wanted.entry(label).or_insert_with(|| rows.clone());
        *joined = joined.start.min(rows.start)..joined.end.max(rows.end);
    }
}

/// Bytes of the rows that one tile is made of, at most, of photographs of so many `bytes`, one for each of the layout
/// that was unrolled.
pub(super) fn most_of_a_tile(unrolled: &Unrolled<'_>, first_level: u32, bytes: &[usize]) -> usize {
    let [width, height] = unrolled.finished();
    let side = tile_side(first_level);
    let across = width.div_ceil(side);
    let mut of_tiles = vec![0_usize; across * height.div_ceil(side)];
    for (placement, placed) in unrolled.placed().iter().enumerate() {
        let grid = grid(placed, unrolled);
        let (all, rows) = (bytes[unrolled.original(placement)], self::height(placed));
        // The placement's own tiles, and those that it is sampled for beyond its border.
        let lead = unrolled.lead();
        let finished = common(&widened(&grid.columns, side, lead + width), &(lead..lead + width));
        let tiles_across =
            (finished.start.saturating_sub(lead)) / side..finished.end.saturating_sub(lead).div_ceil(side);
        let tiles_down = grid.rows.start.saturating_sub(side) / side..(grid.rows.end + side).min(height).div_ceil(side);
        for y in tiles_down {
            for x in tiles_across.clone() {
                let columns = lead + x * side..(lead + (x + 1) * side).min(lead + width);
                let down = y * side..((y + 1) * side).min(height);
                let (columns, down) = sampled_window([&columns, &down], first_level, unrolled);
                let window = Window { columns: &columns, rows: &down };
                of_tiles[y * across + x] += part(all, wanted_rows(&grid, window, rows).len(), rows);
            }
        }
    }
    of_tiles.into_iter().max().unwrap_or(0)
}

/// Bytes of some of a photograph's rows.
fn part(bytes: usize, rows: usize, height: usize) -> usize {
    (bytes / height.max(1)).saturating_add(1).saturating_mul(rows).min(bytes)
}

/// Rows of a placement's photograph.
fn height(placed: &Placed) -> usize {
    // The cast saturates.
    placed.mesh.height.round() as usize
}

fn grid(placed: &Placed, unrolled: &Unrolled<'_>) -> DeformedGrid {
    let [width, height] = unrolled.canvas();
    DeformedGrid::new(&placed.mesh, 1.0, true, width, height)
}

/// The rows of a photograph that are held for a window. One that is shown beside the window only is asked for all the
/// same.
fn wanted_rows(grid: &DeformedGrid, window: Window<'_>, height: usize) -> Range<usize> {
    sampled_rows(grid, window, height).unwrap_or(0..height.min(1))
}

/// The rows of a photograph of so many that are read where it is sampled in a window; `None` if none is.
///
/// A photograph may be made smaller before it is sampled, by no more than the canvas shows it smaller: rows of its own
/// that one row of the canvas spans are as many as those that one smaller row is made of.
fn sampled_rows(grid: &DeformedGrid, window: Window<'_>, height: usize) -> Option<Range<usize>> {
    let (columns, rows) = (common(window.columns, &grid.columns), common(window.rows, &grid.rows));
    if columns.is_empty() || rows.is_empty() {
        return None;
    }
    let mut cells = Vec::new();
    grid.cells_in_window(&columns, &rows, &mut cells);
    let read = cells.iter().map(|&cell| {
        let cell = &grid.cells[cell as usize];
        let [top, bottom] = cell.source_rows();
        let reach = REACH * cell.footprint[1].max(1.0);
        [top - reach, bottom + reach]
    });
    let [top, bottom] = read.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?;
    // The casts saturate.
    let end = (bottom.ceil() as usize).clamp(1, height.max(1));
    Some((top.floor() as usize).min(end - 1)..end)
}

/// Rows on either side of a place that its sample is made of, for each row that a pixel of the canvas spans: two that
/// the kernel reaches, which is widened where it averages, two more that the photograph's smaller rows are made of, and
/// as many again to round.
const REACH: f64 = 8.0;

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use proptest::prelude::*;
    use trueup_core::color::TransferCurve;
    use trueup_core::mesh::GridMesh;
    use trueup_core::raster::{Photograph, Raster};

    use super::*;
    use crate::light::{Correction, PhotographLight};
    use crate::render_options::Interpolation;
    use crate::test_photographs::noise;
    use crate::warped::{Resampling, SamplingMemory, WarpedPhotograph};

    fn photograph(size: [usize; 2], channels: usize, is_deep: bool) -> Photograph {
        let raster = noise(size[0], size[1], channels);
        if !is_deep {
            return Photograph::Eight(raster);
        }
        let data = raster.into_data().into_iter().map(|level| 257 * u16::from(level)).collect();
        Photograph::Sixteen(Raster::from_data(size[0], size[1], channels, data).expect("as many samples"))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// Turned, bent, enlarged or made smaller by up to eight times, a photograph is sampled alike in a window,
        /// whether all of it is there or the rows for the window.
        #[test]
        fn rows_for_a_window_are_all_that_is_sampled_there(
            scale in -3.0..1.0_f64,
            angle in -0.6..0.6_f64,
            bend in -2e-4..2e-4_f64,
            corner in prop::array::uniform2(0_usize..300),
            (channels, is_deep) in (prop::sample::select(vec![1_usize, 3, 4]), any::<bool>()),
            is_linear in any::<bool>(),
        ) {
            let size = [260_usize, 400];
            let (scale, (sine, cosine)) = (scale.exp2(), angle.sin_cos());
            let mut mesh = GridMesh::regular(size[0] as f64, size[1] as f64, 40.0);
            mesh.target = (0..mesh.len())
                .map(|vertex| {
                    let from = mesh.source(vertex);
                    let [x, y] = [from.x - 130.0, from.y - 200.0 + bend * from.x * from.y];
                    [scale * (cosine * x - sine * y) + 200.0, scale * (sine * x + cosine * y) + 200.0]
                })
                .collect();
            let interpolation = if is_linear { Interpolation::Bilinear } else { Interpolation::Bicubic };
            let (resampling, canvas) = (Resampling::of(interpolation), [400, 400]);
            let correction = Correction::uniform(1.0);
            let warped = || {
                let light = PhotographLight { curve: &TransferCurve::SRGB, correction: &correction, local: None };
                let photograph = Cow::Owned(photograph(size, channels, is_deep));
                WarpedPhotograph::new(photograph, &mesh, canvas, light, &resampling)
            };
            let (columns, rows) = (corner[0]..corner[0] + 60, corner[1]..corner[1] + 60);
            let window = Window { columns: &columns, rows: &rows };
            let grid = DeformedGrid::new(&mesh, 1.0, true, canvas[0], canvas[1]);
            let held = sampled_rows(&grid, window, size[1]);
            let sampled = |photograph: WarpedPhotograph<'_>| {
                let mut out = vec![[0.0; 4]; 60 * 60];
                photograph.sample(window, &mut out, &resampling, &mut SamplingMemory::default());
                out.into_iter().map(|pixel| pixel.map(f32::to_bits)).collect::<Vec<_>>()
            };
            let whole = sampled(warped());
            match held {
                None => prop_assert!(whole.iter().all(|pixel| *pixel == [0; 4])),
                Some(rows) => {
                    prop_assert!(rows.end <= size[1] && rows.start < rows.end);
                    let part = warped().with_rows_only(&rows);
                    prop_assert!(part.photograph().0.bytes() <= photograph(size, channels, is_deep).bytes());
                    prop_assert!(sampled(part) == whole);
                }
            }
        }
    }

    /// Of a photograph that is drawn as large as it is, a tile of 128 pixels wants itself, 32 pixels beside it, and the
    /// cells that these lie in.
    #[test]
    fn a_tile_wants_few_rows() {
        let mesh = GridMesh::regular(400.0, 3000.0, 40.0);
        let grid = DeformedGrid::new(&mesh, 1.0, true, 400, 3000);
        let window = |rows: Range<usize>| sampled_rows(&grid, Window { columns: &(0..400), rows: &rows }, 3000);
        // Cells of 40 pixels, and 8 rows more.
        assert_eq!(window(1000..1192), Some(992..1208));
        assert_eq!((window(0..10), window(2990..3000)), (Some(0..48), Some(2952..3000)));
        let beside = sampled_rows(&grid, Window { columns: &(500..600), rows: &(0..100) }, 3000);
        assert_eq!(beside, None);
    }
}
