//! The deformed grid of one picture: what every warp model yields and the renderer and the metrics consume.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

/// A grid over one picture and where its vertices go in the panorama.
///
/// `rows` x `columns` vertices, row-major (index = row * columns + column). Inside a cell the warp is bilinear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GridMesh {
    /// Number of vertex rows, at least 2.
    pub rows: usize,
    /// Number of vertex columns, at least 2.
    pub columns: usize,
    /// Width of the picture in the pixels of `source`.
    pub width: f64,
    /// Height of the picture in the pixels of `source`.
    pub height: f64,
    /// Vertices in the panorama, row-major.
    pub target: Vec<[f64; 2]>,
}

impl GridMesh {
    /// An undeformed grid over a `width` x `height` picture with cells of at most `cell_px` on a side.
    pub fn regular(width: f64, height: f64, cell_px: f64) -> Self {
        let columns = (width / cell_px).ceil().max(1.0) as usize + 1;
        let rows = (height / cell_px).ceil().max(1.0) as usize + 1;
        let mut mesh = Self { rows, columns, width, height, target: Vec::new() };
        mesh.target = (0..rows * columns).map(|index| mesh.source(index).into()).collect();
        mesh
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.rows * self.columns
    }

    /// Whether the grid has no vertices (never true of a grid made by [`Self::regular`]).
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Width of a cell in source pixels.
    pub fn cell_width(&self) -> f64 {
        self.width / (self.columns - 1) as f64
    }

    /// Height of a cell in source pixels.
    pub fn cell_height(&self) -> f64 {
        self.height / (self.rows - 1) as f64
    }

    /// Position of a vertex in the picture.
    pub fn source(&self, index: usize) -> Vector2<f64> {
        let (row, column) = (index / self.columns, index % self.columns);
        Vector2::new(
            self.width * column as f64 / (self.columns - 1) as f64,
            self.height * row as f64 / (self.rows - 1) as f64,
        )
    }

    /// The four vertices around a point of the picture (top left, top right, bottom right, bottom left) and their
    /// bilinear weights. Points outside the picture use the nearest cell and extrapolate.
    pub fn bilinear(&self, point: Vector2<f64>) -> ([usize; 4], [f64; 4]) {
        let gx = point.x / self.cell_width();
        let gy = point.y / self.cell_height();
        let column = (gx.max(0.0) as usize).min(self.columns - 2);
        let row = (gy.max(0.0) as usize).min(self.rows - 2);
        let (u, v) = (gx - column as f64, gy - row as f64);
        let first = row * self.columns + column;
        (
            [first, first + 1, first + self.columns + 1, first + self.columns],
            [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v],
        )
    }

    /// Where a point of the picture goes in the panorama (the paper's phi_i).
    pub fn warp(&self, point: Vector2<f64>) -> Vector2<f64> {
        let (corners, weights) = self.bilinear(point);
        corners
            .iter()
            .zip(weights)
            .fold(Vector2::zeros(), |sum, (&corner, weight)| sum + Vector2::from(self.target[corner]) * weight)
    }

    /// How the place in the panorama changes with the pixel: the columns are its derivatives by x and y, those of the cell
    /// that [`Self::bilinear`] uses.
    pub fn derivative(&self, point: Vector2<f64>) -> Matrix2<f64> {
        let ([a, b, c, d], _) = self.bilinear(point);
        let origin = self.source(a);
        let [a, b, c, d] = [a, b, c, d].map(|vertex| Vector2::from(self.target[vertex]));
        let cell = Vector2::new(self.cell_width(), self.cell_height());
        let (u, v) = ((point.x - origin.x) / cell.x, (point.y - origin.y) / cell.y);
        let along_x = ((b - a) * (1.0 - v) + (c - d) * v) / cell.x;
        let along_y = ((d - a) * (1.0 - u) + (c - b) * u) / cell.y;
        Matrix2::from_columns(&[along_x, along_y])
    }

    /// The pixel that goes to `place`, by Newton's method from the pixel `start`; `None` if it is not found, which is
    /// usual far outside the picture. The pixel may lie outside.
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

    /// Smallest and largest target coordinates.
    pub fn bounds(&self) -> (Vector2<f64>, Vector2<f64>) {
        let start = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        self.target.iter().fold(start, |(low, high), &vertex| {
            let vertex = Vector2::from(vertex);
            (low.inf(&vertex), high.sup(&vertex))
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn regular_grid_of_the_working_size_has_the_published_vertex_count() {
        let mesh = GridMesh::regular(800.0, 600.0, 40.0);
        assert_eq!((mesh.columns, mesh.rows, mesh.len()), (21, 16, 336));
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

    proptest! {
        #[test]
        fn an_undeformed_mesh_is_the_identity(x in 0.0..801.5_f64, y in 0.0..599.25_f64) {
            let mesh = GridMesh::regular(801.5, 599.25, 40.0);
            let warped = mesh.warp(Vector2::new(x, y));
            prop_assert!((warped - Vector2::new(x, y)).norm() < 1e-9);
        }
    }
}
