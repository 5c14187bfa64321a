//! The deformed grid of one photograph: what every warp model yields and the renderer and the metrics consume.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

use crate::geometry::{roll_from_down, wrap_angle};

/// A grid over one photograph and where its vertices go in the panorama.
///
/// `rows` x `columns` vertices, row-major (index = row * columns + column). Inside a cell the warp is bilinear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GridMesh {
    /// Number of vertex rows, at least 2.
    pub rows: usize,
    /// Number of vertex columns, at least 2.
    pub columns: usize,
    /// Width of the photograph in the pixels of `source`.
    pub width: f64,
    /// Height of the photograph in the pixels of `source`.
    pub height: f64,
    /// Vertices in the panorama, row-major. A vertex outside what a projection can show is NaN on both axes; cells that
    /// touch one are not there.
    pub target: Vec<[f64; 2]>,
    /// Where the columns and rows of vertices lie; `None`: evenly over the photograph.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lines: Option<GridLines>,
}

/// Where the columns and rows of a grid's vertices lie in the photograph, as shares of its width and height: each
/// ascending from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GridLines {
    /// A share of the width for every column of vertices.
    pub columns: Vec<f64>,
    /// A share of the height for every row of vertices.
    pub rows: Vec<f64>,
}

impl GridLines {
    /// `columns` and `rows` lines of vertices, evenly spread.
    pub fn even(columns: usize, rows: usize) -> Self {
        let even = |count: usize| (0..count).map(|line| line as f64 / (count - 1) as f64).collect();
        Self { columns: even(columns), rows: even(rows) }
    }
}

impl GridMesh {
    /// An undeformed grid over a `width` x `height` photograph with cells of at most `cell_px` on a side.
    pub fn regular(width: f64, height: f64, cell_px: f64) -> Self {
        let columns = (width / cell_px).ceil().max(1.0) as usize + 1;
        let rows = (height / cell_px).ceil().max(1.0) as usize + 1;
        let mut mesh = Self { rows, columns, width, height, target: Vec::new(), lines: None };
        mesh.target = (0..rows * columns).map(|index| mesh.source(index).into()).collect();
        mesh
    }

    /// The grid with every vertex moved `by` so much in the panorama.
    pub fn moved_by(&self, by: Vector2<f64>) -> Self {
        let target = self.target.iter().map(|place| [place[0] + by.x, place[1] + by.y]).collect();
        Self { target, ..self.clone() }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.rows * self.columns
    }

    /// Whether the grid has no vertices (never true of a grid made by [`Self::regular`]).
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Width of a cell in source pixels; the mean where the columns are not even.
    pub fn cell_width(&self) -> f64 {
        self.width / (self.columns - 1) as f64
    }

    /// Height of a cell in source pixels; the mean where the rows are not even.
    pub fn cell_height(&self) -> f64 {
        self.height / (self.rows - 1) as f64
    }

    /// Position of a vertex in the photograph.
    pub fn source(&self, index: usize) -> Vector2<f64> {
        let (row, column) = (index / self.columns, index % self.columns);
        match &self.lines {
            None => Vector2::new(
                self.width * column as f64 / (self.columns - 1) as f64,
                self.height * row as f64 / (self.rows - 1) as f64,
            ),
            Some(lines) => Vector2::new(self.width * lines.columns[column], self.height * lines.rows[row]),
        }
    }

    /// Whether a vertex is defined.
    pub fn is_defined(&self, vertex: usize) -> bool {
        self.target[vertex].iter().all(|coordinate| coordinate.is_finite())
    }

    /// The corners (top left, top right, bottom right, bottom left) of every cell whose corners are all defined,
    /// row-major.
    pub fn whole_cells(&self) -> impl Iterator<Item = [usize; 4]> + '_ {
        let cells = (self.rows.max(1) - 1) * (self.columns.max(1) - 1);
        (0..cells)
            .map(|cell| {
                let first = cell / (self.columns - 1) * self.columns + cell % (self.columns - 1);
                [first, first + 1, first + self.columns + 1, first + self.columns]
            })
            .filter(|corners| corners.iter().all(|&corner| self.is_defined(corner)))
    }

    /// The cell along one axis that holds the share `at` of the photograph, and the share of the cell that lies before
    /// it.
    fn within(lines: &[f64], at: f64) -> (usize, f64) {
        let cell = lines.partition_point(|&line| line <= at).clamp(1, lines.len() - 1) - 1;
        (cell, (at - lines[cell]) / (lines[cell + 1] - lines[cell]))
    }

    /// The four vertices around a point of the photograph (top left, top right, bottom right, bottom left) and their
    /// bilinear weights. Points outside the photograph use the nearest cell and extrapolate.
    pub fn bilinear(&self, point: Vector2<f64>) -> ([usize; 4], [f64; 4]) {
        let ((column, u), (row, v)) = match &self.lines {
            None => {
                let gx = point.x / self.cell_width();
                let gy = point.y / self.cell_height();
                let column = (gx.max(0.0) as usize).min(self.columns - 2);
                let row = (gy.max(0.0) as usize).min(self.rows - 2);
                ((column, gx - column as f64), (row, gy - row as f64))
            }
            Some(lines) => {
                (Self::within(&lines.columns, point.x / self.width), Self::within(&lines.rows, point.y / self.height))
            }
        };
        let first = row * self.columns + column;
        (
            [first, first + 1, first + self.columns + 1, first + self.columns],
            [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v],
        )
    }

    /// Where a point of the photograph goes in the panorama (the paper's phi_i).
    pub fn warp(&self, point: Vector2<f64>) -> Vector2<f64> {
        let (corners, weights) = self.bilinear(point);
        corners
            .iter()
            .zip(weights)
            .fold(Vector2::zeros(), |sum, (&corner, weight)| sum + Vector2::from(self.target[corner]) * weight)
    }

    /// How the place in the panorama changes with the pixel: the columns are its derivatives by x and y, those of the
    /// cell that [`Self::bilinear`] uses.
    pub fn derivative(&self, point: Vector2<f64>) -> Matrix2<f64> {
        let ([a, b, c, d], _) = self.bilinear(point);
        let origin = self.source(a);
        let cell = self.source(c) - origin;
        let [a, b, c, d] = [a, b, c, d].map(|vertex| Vector2::from(self.target[vertex]));
        let (u, v) = ((point.x - origin.x) / cell.x, (point.y - origin.y) / cell.y);
        let along_x = ((b - a) * (1.0 - v) + (c - d) * v) / cell.x;
        let along_y = ((d - a) * (1.0 - u) + (c - b) * u) / cell.y;
        Matrix2::from_columns(&[along_x, along_y])
    }

    /// Clockwise angle from down to where the direction that the clockwise turn `gamma` stands upright points, in the
    /// middle of the photograph as it lies in the panorama; radians, in [-pi, pi). NaN where the middle has no place.
    ///
    /// By central differences over the cells around the middle vertex, or across the middle cell where there is none,
    /// in both directions: a panorama may stretch the two differently, and then the direction of the columns says
    /// nothing of another one.
    pub fn lean_in_the_middle(&self, gamma: f64) -> f64 {
        // The vertices nearest to the middle, before and behind it, and those that differences are taken between.
        let nearest = |count: usize| [(count.saturating_sub(1)) / 2, count / 2];
        let around = |count: usize| match nearest(count) {
            [before, behind] if before == behind => {
                [before.saturating_sub(1), (behind + 1).min(count.saturating_sub(1))]
            }
            apart => apart,
        };
        let step = |from: usize, to: usize| {
            let length = (self.source(to) - self.source(from)).norm();
            (Vector2::from(self.target[to]) - Vector2::from(self.target[from])) / length
        };
        let ([left, right], [above, below]) = (around(self.columns), around(self.rows));
        let [along_row, other_row] =
            nearest(self.rows).map(|row| step(row * self.columns + left, row * self.columns + right));
        let [along_column, other_column] =
            nearest(self.columns).map(|column| step(above * self.columns + column, below * self.columns + column));
        let (along_row, along_column) = ((along_row + other_row) / 2.0, (along_column + other_column) / 2.0);
        let down = along_row * gamma.sin() + along_column * gamma.cos();
        // What points down in the scene points to `down`: turned by the angle that takes (0, 1) there.
        wrap_angle(-roll_from_down(&down.push(0.0)))
    }

    /// The pixel that goes to `place`, by Newton's method from the pixel `start`; `None` if it is not found, which is
    /// usual far outside the photograph. The pixel may lie outside.
    pub fn source_of(&self, place: Vector2<f64>, start: Vector2<f64>) -> Option<Vector2<f64>> {
        /// Steps; each squares the error once it is in the right cell.
        const STEPS: usize = 12;
        /// Distance in the panorama that counts as met.
        const MET_PX: f64 = 1e-3;
        let mut pixel = start;
        for _ in 0..STEPS {
            let miss = place - self.warp(pixel);
            if miss.norm_squared() <= MET_PX * MET_PX {
                return Some(pixel);
            }
            pixel += self.derivative(pixel).try_inverse()? * miss;
            if !(pixel.x.is_finite() && pixel.y.is_finite()) {
                return None;
            }
        }
        None
    }

    /// Smallest and largest target coordinates of the vertices that are defined; infinite and reversed where none is.
    pub fn bounds(&self) -> (Vector2<f64>, Vector2<f64>) {
        let start = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        self.target.iter().filter(|vertex| vertex.iter().all(|coordinate| !coordinate.is_nan())).fold(
            start,
            |(low, high), &vertex| {
                let vertex = Vector2::from(vertex);
                (low.inf(&vertex), high.sup(&vertex))
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation2;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn regular_grid_of_the_working_size_has_the_published_vertex_count() {
        let mesh = GridMesh::regular(800.0, 600.0, 40.0);
        assert_eq!((mesh.columns, mesh.rows, mesh.len()), (21, 16, 336));
    }

    /// A photograph that is turned clockwise.
    fn turned(angle: f64) -> GridMesh {
        let mut mesh = GridMesh::regular(400.0, 300.0, 40.0);
        mesh.target = (0..mesh.len()).map(|vertex| (Rotation2::new(angle) * mesh.source(vertex)).into()).collect();
        mesh
    }

    #[test]
    fn a_turned_photograph_has_its_turn() {
        for angle in [-3.0, -0.4, 0.0, 0.7, 2.9] {
            assert!((turned(angle).lean_in_the_middle(0.0) - angle).abs() < 1e-12);
        }
    }

    /// Of 400 x 300 px in cells of about 40, with an even and an odd number of them: turned more and more to the right,
    /// by nothing in the middle.
    #[test]
    fn the_middle_is_in_the_middle_however_many_cells_there_are() {
        for cells in [(10, 7), (9, 8), (9, 7), (10, 8)] {
            let mut mesh = GridMesh::regular(40.0 * f64::from(cells.0), 40.0 * f64::from(cells.1), 40.0);
            let middle = Vector2::new(mesh.width, mesh.height) / 2.0;
            let fanned = |source: Vector2<f64>| {
                let (aside, below) = ((source.x - middle.x) / 500.0, source.y - middle.y);
                [source.x + aside * below, source.y]
            };
            mesh.target = (0..mesh.len()).map(|vertex| fanned(mesh.source(vertex))).collect();
            assert!(mesh.lean_in_the_middle(0.0).abs() < 1e-12, "{cells:?}: {}", mesh.lean_in_the_middle(0.0));
        }
    }

    /// Near a pole of an equirectangular panorama, rows are drawn longer than columns: a rolled photograph whose
    /// verticals stand upright there has columns that lean by more than its roll.
    #[test]
    fn verticals_stand_upright_however_much_rows_are_stretched() {
        let gamma = 0.2_f64;
        let mut mesh = turned(gamma);
        mesh.target.iter_mut().for_each(|point| point[0] *= 3.0);
        assert!(mesh.lean_in_the_middle(gamma).abs() < 1e-12);
        // A vertical that is off by a tenth of a radian is drawn off by three times its tangent.
        let expected = (3.0 * 0.1_f64.tan()).atan();
        assert!((mesh.lean_in_the_middle(gamma - 0.1) - expected).abs() < 1e-12);
    }

    /// A smooth bend: the derivative agrees with differences, and the inverse with the warp, from a start a cell away.
    #[test]
    fn derivative_and_inverse_belong_to_the_warp() {
        let mut mesh = GridMesh::regular(400.0, 300.0, 40.0);
        for vertex in &mut mesh.target {
            let [x, y] = *vertex;
            *vertex = [1.1 * x - 0.2 * y + 2e-4 * x * y, 0.2 * x + 0.9 * y + 1e-4 * x * x];
        }
        for k in 0..50 {
            let point = Vector2::new((f64::from(k) * 0.618).fract() * 400.0, (f64::from(k) * 0.755).fract() * 300.0);
            let step = 1e-6;
            let derivative = mesh.derivative(point);
            for (axis, offset) in [Vector2::new(step, 0.0), Vector2::new(0.0, step)].iter().enumerate() {
                let difference = (mesh.warp(point + offset) - mesh.warp(point)) / step;
                assert!((difference - derivative.column(axis)).norm() < 1e-6);
            }
            let found = mesh.source_of(mesh.warp(point), point + Vector2::new(35.0, -40.0)).expect("invertible");
            assert!((found - point).norm() < 2e-3, "{found} instead of {point}");
        }
        assert_eq!(mesh.source_of(Vector2::repeat(f64::NAN), Vector2::zeros()), None);
    }

    /// Lines at thirds of the unit square over 30 x 12 pixels: (14, 3) lies two tenths into the middle column, and 3 of
    /// 4 rows' pixels into the first row. A vertex that is not defined takes its four cells away.
    #[test]
    fn uneven_lines_and_undefined_vertices() {
        let lines = GridLines { columns: vec![0.0, 0.4, 0.9, 1.0], rows: vec![0.0, 1.0 / 3.0, 1.0] };
        let mut mesh = GridMesh { rows: 3, columns: 4, width: 30.0, height: 12.0, target: vec![], lines: Some(lines) };
        mesh.target = (0..mesh.len()).map(|vertex| mesh.source(vertex).into()).collect();
        let (corners, shares) = mesh.bilinear(Vector2::new(15.0, 3.0));
        assert_eq!(corners, [1, 2, 6, 5]);
        for (share, expected) in shares.iter().zip([0.8 * 0.25, 0.2 * 0.25, 0.2 * 0.75, 0.8 * 0.75]) {
            assert!((share - expected).abs() < 1e-12);
        }
        assert!((mesh.derivative(Vector2::new(29.0, 11.0)) - Matrix2::identity()).norm() < 1e-12);
        assert_eq!(mesh.whole_cells().count(), 6);
        mesh.target[5] = [f64::NAN; 2];
        assert_eq!(mesh.whole_cells().collect::<Vec<_>>(), [[2, 3, 7, 6], [6, 7, 11, 10]]);
        assert_eq!(mesh.bounds(), (Vector2::zeros(), Vector2::new(30.0, 12.0)));
    }

    proptest! {
        #[test]
        fn an_undeformed_mesh_is_the_identity(x in 0.0..801.5_f64, y in 0.0..599.25_f64) {
            let mesh = GridMesh::regular(801.5, 599.25, 40.0);
            let warped = mesh.warp(Vector2::new(x, y));
            prop_assert!((warped - Vector2::new(x, y)).norm() < 1e-9);
        }
    }
}
