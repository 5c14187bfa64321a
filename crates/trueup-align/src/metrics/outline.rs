//! Cells and the deformed border of a grid.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

/// Where a vertex goes.
pub(super) fn target(mesh: &GridMesh, vertex: usize) -> Vector2<f64> {
    Vector2::from(mesh.target[vertex])
}

/// Whether a cell's target is convex and not turned over: each corner turns clockwise on the screen.
pub(super) fn is_sound(mesh: &GridMesh, cell: [usize; 4]) -> bool {
    let corners = cell.map(|vertex| target(mesh, vertex));
    (0..4).all(|k| {
        let (one, two) = (corners[(k + 1) % 4] - corners[k], corners[(k + 2) % 4] - corners[(k + 1) % 4]);
        one.perp(&two) > 0.0
    })
}

/// The number of cells of a grid that are folded: turned over, crossed, bent inwards or collapsed. Cells that are not
/// there (NaN) are not folded.
pub fn folded_cells(mesh: &GridMesh) -> usize {
    mesh.whole_cells().filter(|&cell| !is_sound(mesh, cell)).count()
}

/// The grid without the vertices (NaN) of its torn cells: around a pole, one that reaches over more than half of a
/// `turn` of the panorama joins what lies a turn apart. Without a turn, the grid as it is.
pub fn without_torn_cells(mesh: &GridMesh, turn: Option<f64>) -> GridMesh {
    let mut whole = mesh.clone();
    let Some(turn) = turn else { return whole };
    for cell in mesh.whole_cells() {
        let (low, high) = cell.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &corner| {
            (low.min(mesh.target[corner][0]), high.max(mesh.target[corner][0]))
        });
        if high - low > 0.5 * turn {
            cell.iter().for_each(|&corner| whole.target[corner] = [f64::NAN; 2]);
        }
    }
    whole
}

/// Whether the boxes of two photographs overlap in the panorama, on a full turn of `period` across its ends, too.
pub fn may_overlap(a: &GridMesh, b: &GridMesh, period: Option<f64>) -> bool {
    let ((low_a, high_a), (low_b, high_b)) = (a.bounds(), b.bounds());
    let turns = period.map_or(vec![0.0], |period| vec![-period, 0.0, period]);
    // A comparison with NaN is false.
    let meet = |by: f64| low_a.x < high_b.x + by && low_b.x + by < high_a.x && low_a.y < high_b.y && low_b.y < high_a.y;
    turns.into_iter().any(meet)
}

/// The deformed border of a photograph, a closed polygon without the vertices that are not defined, ready to be asked
/// for many points.
#[derive(Debug)]
pub(super) struct Outline {
    ring: Vec<Vector2<f64>>,
    low: Vector2<f64>,
    high: Vector2<f64>,
    /// For each of equal strips from top to bottom, the edges that touch it, as numbers of their first corners.
    strips: Vec<Vec<usize>>,
}

impl Outline {
    pub(super) fn new(mesh: &GridMesh) -> Self {
        let (rows, columns) = (mesh.rows, mesh.columns);
        let top = 0..columns;
        let right = (1..rows).map(|row| row * columns + columns - 1);
        let bottom = (0..columns - 1).rev().map(|column| (rows - 1) * columns + column);
        let left = (1..rows - 1).rev().map(|row| row * columns);
        let ring = top.chain(right).chain(bottom).chain(left);
        let ring: Vec<_> = ring.filter(|&vertex| mesh.is_defined(vertex)).map(|vertex| target(mesh, vertex)).collect();
        let start = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        let (low, high) = ring.iter().fold(start, |(low, high), corner| (low.inf(corner), high.sup(corner)));
        let mut outline = Self { strips: vec![Vec::new(); ring.len()], ring, low, high };
        for edge in 0..outline.ring.len() {
            let (from, to) = outline.edge(edge);
            for strip in outline.strip_of(from.y.min(to.y))..=outline.strip_of(from.y.max(to.y)) {
                outline.strips[strip].push(edge);
            }
        }
        outline
    }

    fn edge(&self, edge: usize) -> (Vector2<f64>, Vector2<f64>) {
        (self.ring[edge], self.ring[(edge + 1) % self.ring.len()])
    }

    /// The strip of a height; the cast saturates, and an outline without height has one strip in use.
    fn strip_of(&self, y: f64) -> usize {
        let share = (y - self.low.y) / (self.high.y - self.low.y);
        ((share * self.strips.len() as f64) as usize).min(self.strips.len() - 1)
    }

    /// Whether a point between `low` and `high` may lie inside once it is moved by `shift`: no point does if not.
    pub(super) fn may_hold(&self, (low, high): (Vector2<f64>, Vector2<f64>), shift: Vector2<f64>) -> bool {
        let meets =
            |axis: usize| low[axis] + shift[axis] <= self.high[axis] && self.low[axis] <= high[axis] + shift[axis];
        meets(0) && meets(1)
    }

    /// Whether a point lies inside, by the even-odd rule.
    pub(super) fn contains(&self, point: Vector2<f64>) -> bool {
        let beyond = |axis: usize| !(self.low[axis]..=self.high[axis]).contains(&point[axis]);
        if beyond(0) || beyond(1) {
            return false;
        }
        let crossed = self.strips[self.strip_of(point.y)].iter().filter(|&&edge| {
            let (from, to) = self.edge(edge);
            (from.y > point.y) != (to.y > point.y)
                && point.x < from.x + (point.y - from.y) * ((to.x - from.x) / (to.y - from.y))
        });
        crossed.count() % 2 == 1
    }

    /// The area inside, by the shoelace formula, at least 0.
    pub(super) fn area(&self) -> f64 {
        let twice: f64 = (0..self.ring.len()).map(|edge| self.edge(edge)).map(|(from, to)| from.perp(&to)).sum();
        0.5 * twice.abs()
    }
}

#[cfg(test)]
mod tests {
    use geo::{Contains, LineString, Point, Polygon};
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn boxes_meet_across_the_ends_of_a_turn() {
        let mut b = GridMesh::regular(100.0, 80.0, 20.0);
        let a = b.clone();
        b.target.iter_mut().for_each(|vertex| vertex[0] += 950.0);
        assert!(may_overlap(&a, &b, Some(1000.0)) && may_overlap(&b, &a, Some(1000.0)));
        assert!(!may_overlap(&a, &b, None) && may_overlap(&a, &a, None));
    }

    #[test]
    fn the_area_of_a_sheared_photograph_is_its_own() {
        let mut mesh = GridMesh::regular(40.0, 30.0, 10.0);
        for vertex in &mut mesh.target {
            vertex[0] += 3.0 * vertex[1] - 500.0;
        }
        assert!((Outline::new(&mesh).area() - 1200.0).abs() < 1e-9);
    }

    #[test]
    fn only_the_cells_around_a_misplaced_vertex_are_folded() {
        let mut mesh = GridMesh::regular(50.0, 50.0, 10.0);
        assert_eq!(folded_cells(&mesh), 0);
        // Vertex (2, 2) goes beyond the diagonal of the cell to its lower right, which becomes concave; then out of it,
        // which turns that cell over and crosses its two neighbors.
        mesh.target[2 * 6 + 2] = [27.0, 27.0];
        assert_eq!(folded_cells(&mesh), 1);
        mesh.target[2 * 6 + 2] = [45.0, 45.0];
        assert_eq!(folded_cells(&mesh), 3);
    }

    /// Two columns of a grid of 5 x 5 cells lie a turn of 60 to the left: the five cells between them and the others
    /// are torn, and with their twelve vertices their neighbors on both sides go, which leaves the outer columns.
    #[test]
    fn torn_cells_are_taken_away() {
        let mut mesh = GridMesh::regular(50.0, 50.0, 10.0);
        (0..mesh.len()).filter(|vertex| vertex % 6 > 3).for_each(|vertex| mesh.target[vertex][0] -= 60.0);
        assert_eq!(without_torn_cells(&mesh, None), mesh);
        let whole = without_torn_cells(&mesh, Some(60.0));
        assert_eq!((whole.whole_cells().count(), folded_cells(&whole)), (10, 0));
        assert_eq!((0..whole.len()).filter(|&vertex| !whole.is_defined(vertex)).count(), 12);
    }

    proptest! {
        #[test]
        fn inside_agrees_with_a_polygon_library(
            shift in proptest::collection::vec(-4.0..4.0_f64, 40), x in -5.0..45.0_f64, y in -5.0..35.0_f64,
        ) {
            let mut mesh = GridMesh::regular(40.0, 30.0, 10.0);
            for (vertex, shift) in mesh.target.iter_mut().zip(shift.chunks(2)) {
                *vertex = [vertex[0] + shift[0], vertex[1] + shift[1]];
            }
            let outline = Outline::new(&mesh);
            let ring: Vec<(f64, f64)> = outline.ring.iter().map(|corner| (corner.x, corner.y)).collect();
            let polygon = Polygon::new(LineString::from(ring), Vec::new());
            prop_assert_eq!(outline.contains(Vector2::new(x, y)), polygon.contains(&Point::new(x, y)));
        }
    }
}
