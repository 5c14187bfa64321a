//! A deformed grid seen from the canvas: which cell covers a canvas pixel, and where in the photograph it looks.
//!
//! Cells are filled row by row from the crossings of their straight edges with the line through the pixel centers. A
//! crossing is computed from the edge's two vertices in an order that does not depend on the cell, so two cells that
//! share an edge meet at exactly the same pixel: inside a grid without folds every pixel belongs to exactly one cell
//! (the left and top edges belong to a cell, the right and bottom ones to its neighbor).

use std::ops::Range;

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use crate::simd::{InverseBilinear, Positions, invert_row};
use crate::window::common;

/// Marks a canvas pixel that no cell covers.
pub(crate) const NO_CELL: u32 = u32::MAX;

/// Largest number of photograph pixels that one canvas pixel is taken to span, per axis; beyond it a cell is as good
/// as folded, and its filter stays affordable.
pub(crate) const MAX_FOOTPRINT_PX: f64 = 4096.0;

/// One cell of the grid.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    /// Top left, top right, bottom right, bottom left in canvas pixels.
    corners: [Vector2<f64>; 4],
    /// Top left corner in the photograph, in pixels.
    source: [f64; 2],
    /// Width and height in the photograph, in pixels.
    source_size: [f64; 2],
    /// Photograph pixels, along its x and its y axis, spanned by one canvas pixel at the middle of the cell.
    pub(crate) footprint: [f64; 2],
    /// Whether a canvas pixel of the cell may be cut by the photograph's border.
    pub(crate) near_border: bool,
    /// Lowest and highest x of the corners.
    x_range: [f64; 2],
    /// Lowest and highest y of the corners.
    y_range: [f64; 2],
}

/// The grid of one photograph, ready to be asked row by row.
#[derive(Debug, Clone)]
pub(crate) struct DeformedGrid {
    /// Row-major; where cells overlap (folds) the later one covers.
    pub(crate) cells: Vec<Cell>,
    /// Size of the photograph in pixels.
    pub(crate) size: [f64; 2],
    /// Rows of the canvas that may be covered.
    pub(crate) rows: Range<usize>,
    /// Columns of the canvas that may be covered.
    pub(crate) columns: Range<usize>,
}

/// A stretch of one canvas row covered by one cell.
#[derive(Debug, Clone)]
pub(crate) struct CellRun {
    /// Index of the cell.
    pub(crate) cell: usize,
    /// Columns of the canvas.
    pub(crate) columns: Range<usize>,
}

/// How many of a grid's triangles (TL, TR, BR) and (TL, BR, BL) are folded: signed area not above zero.
pub(crate) fn count_folded_triangles(mesh: &GridMesh) -> usize {
    let vertex = |index: usize| Vector2::from(mesh.target[index]);
    (0..(mesh.rows - 1) * (mesh.columns - 1))
        .map(|cell| {
            let first = cell / (mesh.columns - 1) * mesh.columns + cell % (mesh.columns - 1);
            let top_left = vertex(first);
            let to_bottom_right = vertex(first + mesh.columns + 1) - top_left;
            let upper = (vertex(first + 1) - top_left).perp(&to_bottom_right);
            let lower = to_bottom_right.perp(&(vertex(first + mesh.columns) - top_left));
            usize::from(upper <= 0.0) + usize::from(lower <= 0.0)
        })
        .sum()
}

impl DeformedGrid {
    /// The grid with its targets multiplied by `canvas_from_mesh`, clipped to a canvas of `width` x `height` pixels.
    ///
    /// With `rim`, a ring of cells extrapolated beyond the photograph's border is added, wide enough for the canvas
    /// pixels that the border cuts.
    pub(crate) fn new(mesh: &GridMesh, canvas_from_mesh: f64, rim: bool, width: usize, height: usize) -> Self {
        let mut columns: Vec<f64> = (0..mesh.columns).map(|column| mesh.source(column).x).collect();
        let mut rows: Vec<f64> = (0..mesh.rows).map(|row| mesh.source(row * mesh.columns).y).collect();
        if rim {
            let [margin_x, margin_y] = rim_width(mesh, canvas_from_mesh);
            columns.insert(0, -margin_x);
            columns.push(mesh.width + margin_x);
            rows.insert(0, -margin_y);
            rows.push(mesh.height + margin_y);
        }
        // A vertex of the mesh is taken as it is: beside one that is not defined, interpolation would lose it.
        let ring = usize::from(rim);
        let place = |row: usize, column: usize| {
            let own = (row.wrapping_sub(ring), column.wrapping_sub(ring));
            let place = match own.0 < mesh.rows && own.1 < mesh.columns {
                true => Vector2::from(mesh.target[own.0 * mesh.columns + own.1]),
                false => mesh.warp(Vector2::new(columns[column], rows[row])),
            };
            place * canvas_from_mesh
        };
        let target: Vec<Vector2<f64>> =
            (0..rows.len() * columns.len()).map(|index| place(index / columns.len(), index % columns.len())).collect();
        let size = [mesh.width, mesh.height];
        let mut cells = Vec::with_capacity((rows.len() - 1) * (columns.len() - 1));
        for (row, y) in rows.windows(2).enumerate() {
            for (column, x) in columns.windows(2).enumerate() {
                let first = row * columns.len() + column;
                let corners =
                    [first, first + 1, first + columns.len() + 1, first + columns.len()].map(|index| target[index]);
                if corners.iter().any(|corner| corner.x.is_nan()) {
                    continue;
                }
                cells.push(Cell::new(corners, [x[0], y[0]], [x[1] - x[0], y[1] - y[0]], size));
            }
        }
        let cells_within = |axis: fn(&Cell) -> [f64; 2]| {
            cells
                .iter()
                .map(axis)
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], range| [low.min(range[0]), high.max(range[1])])
        };
        let ([left, right], [top, bottom]) = (cells_within(|cell| cell.x_range), cells_within(|cell| cell.y_range));
        Self {
            cells,
            size,
            rows: first_center_from(top, height)..first_center_from(bottom, height),
            columns: first_center_from(left, width)..first_center_from(right, width),
        }
    }

    /// Indices of the cells that may cover a pixel of `rows`, in order.
    pub(crate) fn cells_in_rows(&self, rows: &Range<usize>, indices: &mut Vec<u32>) {
        self.cells_in_window(&self.columns, rows, indices);
    }

    /// Indices of the cells that may cover a pixel of `columns` and `rows`, in order.
    pub(crate) fn cells_in_window(&self, columns: &Range<usize>, rows: &Range<usize>, indices: &mut Vec<u32>) {
        indices.clear();
        let meets =
            |range: [f64; 2], pixels: &Range<usize>| range[0] < pixels.end as f64 && range[1] > pixels.start as f64;
        indices.extend(
            (0_u32..)
                .zip(&self.cells)
                .filter(|(_, cell)| meets(cell.y_range, rows) && meets(cell.x_range, columns))
                .map(|(index, _)| index),
        );
    }

    /// The runs of canvas row `y` in order of columns, from `candidates` (see [`Self::cells_in_rows`]). No column is in
    /// two runs. `owner` is scratch space.
    pub(crate) fn runs(&self, y: usize, candidates: &[u32], owner: &mut Vec<u32>, runs: &mut Vec<CellRun>) {
        self.runs_within(y, &self.columns, candidates, owner, runs);
    }

    /// [`Self::runs`] cut to `columns`, a part of [`Self::columns`].
    pub(crate) fn runs_within(
        &self,
        y: usize,
        columns: &Range<usize>,
        candidates: &[u32],
        owner: &mut Vec<u32>,
        runs: &mut Vec<CellRun>,
    ) {
        runs.clear();
        let center_y = y as f64 + 0.5;
        for &index in candidates {
            let cell = &self.cells[index as usize];
            if cell.y_range[0] > center_y || cell.y_range[1] <= center_y {
                continue;
            }
            let (crossings, count) = cell.crossings(center_y);
            for pair in crossings[..count].chunks_exact(2) {
                let first = first_center_from(pair[0], columns.end).max(columns.start);
                let end = first_center_from(pair[1], columns.end);
                if first < end {
                    runs.push(CellRun { cell: index as usize, columns: first..end });
                }
            }
        }
        runs.sort_unstable_by_key(|run| (run.columns.start, run.cell));
        if runs.windows(2).any(|pair| pair[0].columns.end > pair[1].columns.start) {
            // Where the grid folds, cells cover each other in their order.
            runs.sort_unstable_by_key(|run| run.cell);
            painted(columns, owner, runs);
        }
    }

    /// Where the line y = `line` lies within the grid: disjoint ascending stretches that do not touch, from
    /// `candidates` (see [`Self::cells_in_rows`]).
    pub(crate) fn covered_along(&self, line: f64, candidates: &[u32]) -> Vec<[f64; 2]> {
        /// Cells that share an edge meet at the same crossing; this allows for edges that only nearly coincide.
        const TOUCHING_PX: f64 = 1e-6;
        let mut stretches = Vec::new();
        for &index in candidates {
            let cell = &self.cells[index as usize];
            if cell.y_range[0] <= line && line < cell.y_range[1] {
                let (crossings, count) = cell.crossings(line);
                stretches.extend(crossings[..count].chunks_exact(2).map(|pair| [pair[0], pair[1]]));
            }
        }
        stretches.sort_unstable_by(|one: &[f64; 2], other| one[0].total_cmp(&other[0]));
        let mut joined: Vec<[f64; 2]> = Vec::new();
        for stretch in stretches {
            match joined.last_mut() {
                Some(last) if stretch[0] <= last[1] + TOUCHING_PX => last[1] = last[1].max(stretch[1]),
                _ => joined.push(stretch),
            }
        }
        joined
    }
}

impl DeformedGrid {
    /// Tells `found` of every canvas pixel in `columns` and `rows` that a cell covers: (x, y), the place in the
    /// photograph that its center shows, and the pixel's size there.
    pub(crate) fn each_place(
        &self,
        columns: &Range<usize>,
        rows: &Range<usize>,
        mut found: impl FnMut([usize; 2], [f64; 2], [f64; 2]),
    ) {
        let (columns, rows) = (common(columns, &self.columns), common(rows, &self.rows));
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let (mut candidates, mut owner, mut runs) = (Vec::new(), Vec::new(), Vec::<CellRun>::new());
        let mut positions = Positions::default();
        self.cells_in_window(&columns, &rows, &mut candidates);
        for y in rows {
            self.runs_within(y, &columns, &candidates, &mut owner, &mut runs);
            for run in &runs {
                let cell = &self.cells[run.cell];
                positions.resize(run.columns.len());
                invert_row(&cell.inverse_along_row(y), run.columns.start, &mut positions);
                for (index, x) in run.columns.clone().enumerate() {
                    found([x, y], positions.place(index), cell.footprint);
                }
            }
        }
    }
}

impl Cell {
    fn new(corners: [Vector2<f64>; 4], source: [f64; 2], source_size: [f64; 2], size: [f64; 2]) -> Self {
        let [top_left, top_right, bottom_right, bottom_left] = corners;
        // Derivatives of the target by the cell's own coordinates u, v in [0, 1], at the middle of the cell.
        let along_u = 0.5 * (top_right - top_left + bottom_right - bottom_left);
        let along_v = 0.5 * (bottom_left - top_left + bottom_right - top_right);
        let jacobian = along_u.perp(&along_v).abs();
        let footprint = [source_size[0] * along_v.norm(), source_size[1] * along_u.norm()].map(|length| {
            let ratio = length / jacobian;
            if ratio.is_finite() { ratio.min(MAX_FOOTPRINT_PX) } else { MAX_FOOTPRINT_PX }
        });
        let near_border = (0..2).any(|axis| {
            let far = size[axis] - (source[axis] + source_size[axis]);
            source[axis].min(far) < footprint[axis]
        });
        let range = |values: [f64; 4]| {
            let (low, high) = (values.into_iter().reduce(f64::min), values.into_iter().reduce(f64::max));
            [low.unwrap_or(f64::INFINITY), high.unwrap_or(f64::NEG_INFINITY)]
        };
        let (x_range, y_range) = (range(corners.map(|corner| corner.x)), range(corners.map(|corner| corner.y)));
        Self { corners, source, source_size, footprint, near_border, x_range, y_range }
    }

    /// Where the cell's outline crosses the line y = `center_y`, from left to right: an even number of places.
    fn crossings(&self, center_y: f64) -> ([f64; 4], usize) {
        let mut found = [f64::INFINITY; 4];
        let mut count = 0;
        for corner in 0..4 {
            let (from, to) = (self.corners[corner], self.corners[(corner + 1) % 4]);
            // The same order of vertices for both cells of an edge, so that both compute the same bits.
            let (upper, lower) = if (from.y, from.x) <= (to.y, to.x) { (from, to) } else { (to, from) };
            if upper.y <= center_y && center_y < lower.y {
                found[count] = upper.x + (center_y - upper.y) * ((lower.x - upper.x) / (lower.y - upper.y));
                count += 1;
            }
        }
        found[..count].sort_unstable_by(f64::total_cmp);
        (found, count)
    }

    /// The rows of the photograph between which the cell lies: its top and its bottom.
    pub(crate) fn source_rows(&self) -> [f64; 2] {
        [self.source[1], self.source[1] + self.source_size[1]]
    }

    /// The inverse of the cell's bilinear map along canvas row `y`.
    pub(crate) fn inverse_along_row(&self, y: usize) -> InverseBilinear {
        InverseBilinear::new(self.corners.map(Into::into), self.source, self.source_size, y as f64 + 0.5)
    }
}

/// Cuts `runs` to what the later ones leave of them in `columns`. `owner` is scratch space.
fn painted(columns: &Range<usize>, owner: &mut Vec<u32>, runs: &mut Vec<CellRun>) {
    let start = columns.start;
    owner.clear();
    owner.resize(columns.len(), NO_CELL);
    for run in runs.drain(..) {
        owner[run.columns.start - start..run.columns.end - start].fill(run.cell as u32);
    }
    let mut column = start;
    for same in owner.chunk_by(|left, right| left == right) {
        if same[0] != NO_CELL {
            runs.push(CellRun { cell: same[0] as usize, columns: column..column + same.len() });
        }
        column += same.len();
    }
}

/// Index of the first pixel whose center is not left of (or above) `position`, within 0 to `limit`.
fn first_center_from(position: f64, limit: usize) -> usize {
    // The cast saturates.
    ((position - 0.5).ceil().max(0.0) as usize).min(limit)
}

/// Width of the extrapolated ring in photograph pixels along x and y: a little more than one canvas pixel.
fn rim_width(mesh: &GridMesh, canvas_from_mesh: f64) -> [f64; 2] {
    const CANVAS_PX: f64 = 1.25;
    let mut widest = [0.0_f64; 2];
    for row in 0..mesh.rows - 1 {
        for column in 0..mesh.columns - 1 {
            let outer = row == 0 || column == 0 || row + 2 == mesh.rows || column + 2 == mesh.columns;
            if outer {
                let first = row * mesh.columns + column;
                let vertices = [first, first + 1, first + mesh.columns + 1, first + mesh.columns];
                if !vertices.iter().all(|&vertex| mesh.is_defined(vertex)) {
                    continue;
                }
                let corners = vertices.map(|vertex| Vector2::from(mesh.target[vertex]) * canvas_from_mesh);
                let step = mesh.source(vertices[2]) - mesh.source(first);
                let cell = Cell::new(corners, [0.0; 2], step.into(), step.into());
                for (widest, footprint) in widest.iter_mut().zip(cell.footprint) {
                    *widest = widest.max(footprint);
                }
            }
        }
    }
    // A nearly collapsed border cell must not drag the ring across the canvas.
    [(CANVAS_PX * widest[0]).min(mesh.width), (CANVAS_PX * widest[1]).min(mesh.height)]
}
