//! The parts of a canvas that no photograph covers: which of them are filled.

use std::ops::Range;

use crate::coverage::{Coverage, Rectangle};
use crate::distance::border_distances;
use crate::flood;
use crate::layout::CanvasLayout;
use crate::window::{common, near};

/// What no photograph covers of a canvas, told apart into gaps, which may be filled, and voids.
#[derive(Debug, Clone)]
pub struct Gaps {
    coverage: Coverage,
    size: [usize; 2],
    extent: Extent,
    around: bool,
    radius: f64,
}

/// What of that is a gap.
#[derive(Debug, Clone)]
enum Extent {
    Small(SmallGaps),
    Within(Rectangle),
}

/// A map of small gaps, in cells.
#[derive(Debug, Clone)]
struct SmallGaps {
    /// Canvas pixels to the nearest void, at the middles of cells; not above 0 in one.
    margin: Vec<f32>,
    columns: usize,
    /// Canvas pixels per cell.
    cell: usize,
    /// Columns of cells that repeat the other end of a full turn, on either side.
    lead: usize,
}

/// Largest distance from all photographs, as a share of a photograph's side, of gaps that are filled for a whole frame
/// ([`crate::crop`]): a smooth sky or wall goes on as far as another photograph would have shown it.
pub(crate) const FRAME_REACH: f64 = 1.0;

/// Cells of the small canvas on which voids are sought, at most: their outline is smooth between them.
const MOST_CELLS: usize = 1 << 20;

/// Radii around the middle of a disc that are void: with sqrt(2), corners that a disc does not fill are no gaps either;
/// the rest is what chamfer distances are off.
const CORNER: f32 = 1.5;

/// [`border_distances`] counts in thirds of a pixel.
const THIRDS: f32 = 3.0;

impl Gaps {
    /// All that is not covered of a rectangle of the canvas.
    pub fn within(layout: &CanvasLayout, coverage: Coverage, rectangle: Rectangle) -> Self {
        let size = [layout.width, layout.height];
        let is_turn = layout.period.is_some() && rectangle.columns == (0..layout.width);
        let radius = 0.5 * deepest(&coverage, &rectangle, is_turn);
        Self { coverage, size, extent: Extent::Within(rectangle), around: layout.period.is_some(), radius }
    }

    /// The small gaps of a canvas; `fill` is a radius in photographs' sides, see
    /// [`CanvasOptions::fill`](crate::layout::CanvasOptions).
    ///
    /// A void is all that a disc of this radius reaches which lies wholly in what is not covered, with the corners
    /// beside it, and all that lies farther than twice the radius from every photograph; a gap is the rest. So notches,
    /// slits and ragged or wavy borders up to twice as wide as the radius are gaps, whatever they are joined to. Discs
    /// do not reach out of the canvas: a strip along its border is as wide as it is.
    pub fn find(layout: &CanvasLayout, coverage: Coverage, fill: f64) -> Self {
        let (width, height) = (layout.width, layout.height);
        let radius = fill * layout.photograph_side();
        let cell = (1..).find(|cell| width.div_ceil(*cell) * height.div_ceil(*cell) <= MOST_CELLS).unwrap_or(1);
        // The casts saturate; no gap is wider than the canvas.
        let reach = ((2.0 * radius / cell as f64).ceil() as usize + 1).min(width.max(height).div_ceil(cell));
        // Discs whose middles lie beyond an end of a full turn reach back over it.
        let lead = if layout.period.is_some() { reach.min(width / cell) } else { 0 };
        let (columns, rows) = (width.div_ceil(cell) + 2 * lead, height.div_ceil(cell));
        let turn = width.div_ceil(cell);
        let middle = |index: usize, length: usize| (index * cell + cell / 2).min(length - 1);
        let uncovered: Vec<bool> = (0..columns * rows)
            .map(|at| {
                let column = (at % columns + turn - lead) % turn;
                !coverage.holds(middle(column, width), middle(at / columns, height))
            })
            .collect();
        // What lies beyond the canvas is no border of anything: it is neither a void nor covered.
        let padded = |from: &dyn Fn(usize) -> bool| {
            let grown = columns + 2 * reach;
            let mut elsewhere = vec![true; grown * (rows + 2 * reach)];
            for at in 0..columns * rows {
                elsewhere[(at / columns + reach) * grown + at % columns + reach] = !from(at);
            }
            let distances = border_distances(&elsewhere, grown);
            let own =
                (0..rows).flat_map(move |row| (row + reach) * grown + reach..(row + reach) * grown + reach + columns);
            own.map(|at| distances[at] as f32 * (cell as f32 / THIRDS)).collect::<Vec<f32>>()
        };
        let depths = border_distances(&uncovered, columns);
        let is_middle = |at: usize| f64::from(depths[at] as f32 * (cell as f32 / THIRDS)) > radius;
        let (from_void, from_photographs) = (padded(&is_middle), padded(&|at| !uncovered[at]));
        let radius_px = radius as f32;
        let margin = from_void.iter().zip(&from_photographs);
        let margin =
            margin.map(|(void, photographs)| (void - CORNER * radius_px).min(2.0 * radius_px - photographs)).collect();
        let extent = Extent::Small(SmallGaps { margin, columns, cell, lead });
        Self { coverage, size: [width, height], extent, around: layout.period.is_some(), radius }
    }

    /// Width and height of the canvas, pixels.
    pub(crate) fn canvas(&self) -> [usize; 2] {
        self.size
    }

    /// The stretches of `columns` in row `y` that some photograph covers wholly, in ascending order.
    pub(crate) fn covered(&self, columns: Range<usize>, y: usize) -> impl Iterator<Item = Range<usize>> {
        self.coverage.covered(columns, y)
    }

    /// The stretches of `columns` in row `y` that no photograph covers, or none wholly, in ascending order; some are
    /// empty.
    pub(crate) fn uncovered(&self, columns: Range<usize>, y: usize) -> impl Iterator<Item = Range<usize>> {
        self.coverage.uncovered(columns, y)
    }

    /// What of the canvas is composed in any case where these gaps are filled.
    pub(crate) fn composed(&self) -> Rectangle {
        match &self.extent {
            Extent::Small(_) => Rectangle::whole(self.size),
            Extent::Within(rectangle) => rectangle.clone(),
        }
    }

    /// Whether a pixel, if no photograph covers it, is part of a gap.
    pub(crate) fn is_gap(&self, x: usize, y: usize) -> bool {
        match &self.extent {
            Extent::Small(gaps) => gaps.holds(x, y),
            Extent::Within(rectangle) => rectangle.columns.contains(&x) && rectangle.rows.contains(&y),
        }
    }

    /// Whether any pixel of a box is part of a gap.
    pub(crate) fn any_within(&self, columns: &Range<usize>, rows: &Range<usize>) -> bool {
        let (columns, rows) = match &self.extent {
            Extent::Small(_) => (columns.clone(), rows.clone()),
            Extent::Within(rectangle) => (common(columns, &rectangle.columns), common(rows, &rectangle.rows)),
        };
        rows.into_iter().any(|y| self.within_row(columns.clone(), y).next().is_some())
    }

    /// The stretches of `columns` in row `y` that are part of a gap, in ascending order.
    pub(crate) fn within_row(&self, columns: Range<usize>, y: usize) -> impl Iterator<Item = Range<usize>> {
        // Of a rectangle all that is not covered is, which need not be asked pixel by pixel.
        let (columns, small) = match &self.extent {
            Extent::Small(gaps) => (columns, Some(gaps)),
            Extent::Within(rectangle) if rectangle.rows.contains(&y) => (common(&columns, &rectangle.columns), None),
            Extent::Within(_) => (columns.start..columns.start, None),
        };
        let parts = move |stretch: Range<usize>| {
            let mut next = stretch.start;
            std::iter::from_fn(move || {
                let Some(gaps) = small else {
                    let all = next..stretch.end;
                    next = stretch.end;
                    return (!all.is_empty()).then_some(all);
                };
                let first = (next..stretch.end).find(|&x| gaps.holds(x, y))?;
                next = (first..stretch.end).find(|&x| !gaps.holds(x, y)).unwrap_or(stretch.end);
                Some(first..next)
            })
        };
        self.coverage.uncovered(columns, y).flat_map(parts)
    }

    /// The coverage as it is when the gaps are filled.
    pub fn filled_coverage(&self) -> Coverage {
        self.coverage.with(|x, y| self.is_gap(x, y))
    }

    /// The column after column `x`; after the last one of a full turn, the first.
    pub(crate) fn next_column(&self, x: usize) -> usize {
        if self.around && x + 1 == self.size[0] { 0 } else { x + 1 }
    }

    /// Whether the canvas goes all the way round.
    pub(crate) fn is_around(&self) -> bool {
        self.around
    }

    /// Half of the width of the widest gap, pixels.
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }
}

/// Pixels, at most, from what is not covered of a rectangle to what is; 0 if nothing is covered. `is_turn` if its last
/// column lies beside the first.
fn deepest(coverage: &Coverage, rectangle: &Rectangle, is_turn: bool) -> f64 {
    /// Cells that the rectangle is looked at in, at most: a distance need not be exact.
    const CELLS: usize = 1 << 14;
    /// Steps across corners are longer.
    const DIAGONAL: f64 = std::f64::consts::SQRT_2;
    let [width, height] = rectangle.size();
    let cell = (1..).find(|cell| width.div_ceil(*cell) * height.div_ceil(*cell) <= CELLS).unwrap_or(1);
    let (columns, rows) = (width.div_ceil(cell), height.div_ceil(cell));
    let middle = |index: usize, range: &Range<usize>| (range.start + index * cell + cell / 2).min(range.end - 1);
    let is_covered =
        |at: &usize| coverage.holds(middle(at % columns, &rectangle.columns), middle(at / columns, &rectangle.rows));
    let around = |at: usize| {
        let (x, y) = (at % columns, at / columns);
        near(y, 1, rows, false).flat_map(move |v| near(x, 1, columns, is_turn).map(move |u| v * columns + u))
    };
    let covered = (0..columns * rows).filter(is_covered).collect();
    let steps = flood::rounds(covered, &mut vec![false; columns * rows], around);
    steps as f64 * DIAGONAL * cell as f64
}

impl SmallGaps {
    fn holds(&self, x: usize, y: usize) -> bool {
        let rows = self.margin.len() / self.columns.max(1);
        let place = |pixel: usize, lead: usize, cells: usize| {
            let at = ((pixel as f64 + 0.5) / self.cell as f64 + lead as f64 - 0.5).clamp(0.0, (cells - 1) as f64);
            (at as usize, (at as usize + 1).min(cells - 1), at.fract() as f32)
        };
        if rows == 0 {
            return false;
        }
        let (left, right, along) = place(x, self.lead, self.columns);
        let (top, bottom, down) = place(y, 0, rows);
        let at = |column: usize, row: usize| self.margin[row * self.columns + column];
        let upper = at(left, top) + along * (at(right, top) - at(left, top));
        let lower = at(left, bottom) + along * (at(right, bottom) - at(left, bottom));
        upper + down * (lower - upper) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::mesh::GridMesh;

    use super::*;
    use crate::layout::Placed;

    /// Photographs of 100 x 60 pixels with their top left corners at `places`.
    fn layout(width: usize, height: usize, places: &[[f64; 2]], period: Option<usize>) -> CanvasLayout {
        let placed = places.iter().enumerate().map(|(photograph, [left, top])| {
            let mut mesh = GridMesh::regular(100.0, 60.0, 10.0);
            mesh.target.iter_mut().for_each(|vertex| *vertex = [vertex[0] + left, vertex[1] + top]);
            Placed { photograph, mesh }
        });
        CanvasLayout { width, height, canvas_from_target: 1.0, origin: [0.0; 2], placed: placed.collect(), period }
    }

    fn gaps(layout: &CanvasLayout, radius: f64) -> Gaps {
        let gaps = Gaps::find(layout, Coverage::of(layout), radius / 60.0);
        assert!((gaps.radius() - radius).abs() < 1e-12);
        gaps
    }

    #[test]
    fn strips_along_the_border_are_gaps_up_to_twice_the_radius() {
        // Two steps: strips of 10 rows above the second photograph and below the first.
        let steps = layout(190, 70, &[[0.0, 0.0], [90.0, 10.0]], None);
        let all = gaps(&steps, 6.0);
        assert!(all.is_gap(0, 69) && all.is_gap(150, 0));
        assert_eq!(all.filled_coverage().area(), 190 * 70);
        // A disc of radius 4 has room in them; what is left are the ends of the strips.
        let few = gaps(&steps, 4.0);
        assert!(!few.is_gap(50, 65) && !few.is_gap(150, 5));
        assert!(few.filled_coverage().area() < 190 * 70 - 1500);
    }

    #[test]
    fn slits_are_gaps_and_what_is_far_from_photographs_is_none() {
        // A slit of 6 columns between two photographs, and an empty half below.
        let slit = layout(206, 160, &[[0.0, 0.0], [106.0, 0.0]], None);
        let gaps = gaps(&slit, 5.0);
        assert!((0..55).all(|y| gaps.is_gap(103, y)));
        assert!(!gaps.is_gap(30, 120) && !gaps.is_gap(103, 100) && !gaps.is_gap(0, 159) && !gaps.is_gap(205, 159));
        let filled = gaps.filled_coverage();
        assert!(filled.holds(103, 20) && !filled.holds(30, 120));
    }

    /// On a full turn the strip above the photographs goes on across the ends, and so do discs.
    #[test]
    fn a_full_turn_has_no_ends() {
        let places = [[-50.0, 30.0], [40.0, 30.0], [110.0, 30.0]];
        let around = gaps(&layout(200, 90, &places, Some(200)), 12.0);
        let within = (0..200).all(|x| around.is_gap(x, 5) == around.is_gap((x + 77) % 200, 5));
        assert!(within && !around.is_gap(0, 5));
        assert!(gaps(&layout(200, 90, &places, Some(200)), 16.0).is_gap(199, 5));
    }

    /// A hole across the cut of a full turn is as wide as it is anywhere else.
    #[test]
    fn a_hole_across_the_cut_is_one() {
        let radius = |lefts: [f64; 2]| {
            // Two photographs of 100 columns beside each other on 250: 50 columns are empty.
            let layout = layout(250, 60, &lefts.map(|left| [left, 0.0]), Some(250));
            Gaps::within(&layout, Coverage::of(&layout), Rectangle::whole([250, 60])).radius()
        };
        assert_eq!(radius([0.0, 100.0]), radius([25.0, 125.0]));
    }

    #[test]
    fn a_canvas_without_gaps_has_none_to_fill() {
        let whole = layout(100, 60, &[[0.0, 0.0]], None);
        assert_eq!(gaps(&whole, 30.0).filled_coverage().area(), 6000);
    }
}
