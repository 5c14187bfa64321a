//! Cells of a deformed grid, one after the other.

use nalgebra::{Matrix2, Vector2};
use trueup_core::mesh::GridMesh;

/// The cell of a grid that was looked into last, as the polynomial that its bilinear map is: walks of small steps
/// seldom leave it.
pub(super) struct LastCell<'a> {
    grid: &'a GridMesh,
    /// The cell's first vertex.
    pub(super) first: usize,
    /// Its corner in the photograph, and the reciprocal of its size.
    origin: Vector2<f64>,
    per_pixel: Vector2<f64>,
    /// The place of the first vertex, what is added along the rows and the columns, and what both together add, per
    /// cell.
    corner: Vector2<f64>,
    along: [Vector2<f64>; 2],
    twist: Vector2<f64>,
}

impl<'a> LastCell<'a> {
    /// The cell around a pixel; outside the photograph the nearest, which then is continued.
    pub(super) fn new(grid: &'a GridMesh, pixel: Vector2<f64>) -> Self {
        let (corners, _) = grid.bilinear(pixel);
        let [a, b, c, d] = corners.map(|vertex| Vector2::from(grid.target[vertex]));
        let origin = grid.source(corners[0]);
        Self {
            grid,
            first: corners[0],
            origin,
            per_pixel: (grid.source(corners[2]) - origin).map(f64::recip),
            corner: a,
            along: [b - a, d - a],
            twist: c - b + a - d,
        }
    }

    /// Goes to the cell around a pixel; gives where in it that is, 0 to 1 along both axes.
    pub(super) fn enter(&mut self, pixel: Vector2<f64>) -> Vector2<f64> {
        let within = self.within(pixel);
        if within.x >= 0.0 && within.x < 1.0 && within.y >= 0.0 && within.y < 1.0 {
            return within;
        }
        *self = Self::new(self.grid, pixel);
        self.within(pixel)
    }

    fn within(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        (pixel - self.origin).component_mul(&self.per_pixel)
    }

    /// Where the place `within` the cell goes in the panorama.
    pub(super) fn warp(&self, within: Vector2<f64>) -> Vector2<f64> {
        self.corner + self.along[0] * within.x + (self.along[1] + self.twist * within.x) * within.y
    }

    /// How the place in the panorama changes with the pixel: the columns are its derivatives by x and y.
    pub(super) fn derivative(&self, within: Vector2<f64>) -> Matrix2<f64> {
        Matrix2::from_columns(&[
            (self.along[0] + self.twist * within.y) * self.per_pixel.x,
            (self.along[1] + self.twist * within.x) * self.per_pixel.y,
        ])
    }
}

/// The pixels of a photograph that lie at places which follow one another in the panorama.
pub(super) struct PixelWalk<'a> {
    cell: LastCell<'a>,
    last: Option<Step>,
}

/// A pixel that was found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// The pixel.
    pub(super) pixel: Vector2<f64>,
    /// How pixels change with the place in the panorama, there.
    pub(super) pixel_from_place: Matrix2<f64>,
    /// Where the pixel goes.
    place: Vector2<f64>,
}

impl<'a> PixelWalk<'a> {
    /// Over the photograph of a deformed grid.
    pub(super) fn new(grid: &'a GridMesh) -> Self {
        Self { cell: LastCell::new(grid, Vector2::zeros()), last: None }
    }

    /// Forgets where it is.
    pub(super) fn stop(&mut self) {
        self.last = None;
    }

    /// The pixel that goes to `place`, by Newton's method from the last one or, where there is none, from what `start`
    /// gives; `None` if it is not found, which is usual far outside the photograph. The pixel may lie outside.
    pub(super) fn to(&mut self, place: Vector2<f64>, start: impl FnOnce() -> Option<Vector2<f64>>) -> Option<Step> {
        /// Steps; each squares the error once it is in the right cell.
        const STEPS: usize = 12;
        /// Distance in the panorama that counts as met.
        const MET_PX: f64 = 1e-3;
        let mut pixel = match self.last.take() {
            Some(last) => last.pixel + last.pixel_from_place * (place - last.place),
            None => start()?,
        };
        for _ in 0..STEPS {
            if !(pixel.x.is_finite() && pixel.y.is_finite()) {
                return None;
            }
            let within = self.cell.enter(pixel);
            let here = self.cell.warp(within);
            let pixel_from_place = inverse(&self.cell.derivative(within))?;
            let miss = place - here;
            if miss.norm_squared() <= MET_PX * MET_PX {
                let step = Step { pixel, pixel_from_place, place: here };
                self.last = Some(step);
                return Some(step);
            }
            pixel += pixel_from_place * miss;
        }
        None
    }
}

/// The inverse of a matrix; `None` if it has none.
pub(super) fn inverse(matrix: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let determinant = matrix.determinant();
    let adjugate = Matrix2::new(matrix.m22, -matrix.m12, -matrix.m21, matrix.m11);
    (determinant.is_finite() && determinant != 0.0).then(|| adjugate * determinant.recip())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every vertex somewhere of its own.
    fn bent() -> GridMesh {
        let mut grid = GridMesh::regular(200.0, 120.0, 40.0);
        for vertex in 0..grid.len() {
            let source = grid.source(vertex);
            let aside = Vector2::new((0.05 * source.y).sin(), (0.04 * source.x).cos()) * 5.0;
            grid.target[vertex] = (source * 1.1 + aside).into();
        }
        grid
    }

    #[test]
    fn a_cell_maps_as_its_grid_does() {
        let grid = bent();
        let mut cell = LastCell::new(&grid, Vector2::zeros());
        for pixel in [[3.0, 5.0], [37.0, 11.0], [41.0, 11.0], [199.0, 119.5], [-4.0, 60.0], [210.0, 130.0]] {
            let pixel = Vector2::from(pixel);
            let within = cell.enter(pixel);
            assert_eq!(cell.first, grid.bilinear(pixel).0[0]);
            assert!((cell.warp(within) - grid.warp(pixel)).norm() < 1e-10, "{pixel}");
            assert!((cell.derivative(within) - grid.derivative(pixel)).norm() < 1e-12, "{pixel}");
        }
    }

    #[test]
    fn a_walk_finds_what_goes_to_each_place() {
        let grid = bent();
        let mut walk = PixelWalk::new(&grid);
        for x in 0..66 {
            let wanted = Vector2::new(1.0 + 3.0 * f64::from(x), 55.0);
            // The first start is off; those after it are not asked for.
            let found = walk.to(grid.warp(wanted), || (x == 0).then(|| wanted + Vector2::new(6.0, -4.0)));
            let found = found.expect("inside");
            assert!((found.pixel - wanted).norm() < 2e-3, "{x}: {}", found.pixel);
            let inverse = grid.derivative(found.pixel).try_inverse().expect("not folded");
            assert!((found.pixel_from_place - inverse).norm() < 1e-9);
        }
        walk.stop();
        assert!(walk.to(grid.warp(Vector2::new(9.0, 9.0)), || None).is_none());
        assert!(walk.to(Vector2::new(f64::NAN, 0.0), || Some(Vector2::zeros())).is_none());
    }

    #[test]
    fn a_matrix_without_inverse_has_none() {
        assert_eq!(inverse(&Matrix2::new(1.0, 2.0, 2.0, 4.0)), None);
        assert_eq!(inverse(&Matrix2::repeat(f64::NAN)), None);
        let found = inverse(&Matrix2::new(2.0, 1.0, 1.0, 1.0)).expect("one");
        assert!((found - Matrix2::new(1.0, -1.0, -1.0, 2.0)).norm() < 1e-12);
    }
}
