//! Steps aside over whole photographs, as even as they can be while places that overlaps share come to meet.
//!
//! What overlaps ask of two photographs is how far apart they are, not which of them gives way, nor what their other parts
//! do. A photograph that gives way in an overlap alone bends there, and lines with it. Here the freedom is spent on evenness:
//! steps that grow evenly keep every straight line straight, and go on where a photograph is alone.
//!
//! # Source
//! F. L. Bookstein, "Principal warps: thin-plate splines and the decomposition of deformations" (1989), for the bending
//! energy; here of two photographs at once, of which only the difference is known.

use nalgebra::Vector2;
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;

use super::by_cameras::carried;
use super::complex::product;
use super::normal_equations::{CarriedVertex, NormalEquations};
use super::solver::MeshSolver;

/// A vertex of one photograph's lattice and the place in another that shows the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Meeting {
    /// The photograph and the vertex of its lattice.
    pub from: [usize; 2],
    /// The other photograph.
    pub to: usize,
    /// The place in it, in its pixels.
    pub place: Vector2<f64>,
    /// Which share of the way to each other the two are to go, 0 to 1.
    pub share: f64,
}

/// Weight of the bending energy beside that of a meeting: what a difference changes within two cells of the lattice is left
/// to who draws the overlaps together.
const BENDING: f64 = 2.0;
/// Weight of every vertex's pull to where its camera sees it: felt within half a photograph of an overlap, so that corrections
/// end there and photographs stay as upright as their cameras say.
const REST: f64 = 0.03;
/// Times the equations are solved; the photographs' maps into each other are linear to a hundredth of a pixel over the steps
/// that are left after the first.
const ROUNDS: usize = 2;

/// By how many of its own pixels each vertex of every photograph's lattice steps aside: lattices with the steps as targets,
/// bilinear between the vertices. `None` if there is nothing to step aside for.
///
/// `lattices` are even and undeformed, over the photographs in the pixels of `cameras`.
pub(crate) fn smooth_steps(cameras: &[Camera], lattices: &[GridMesh], meetings: &[Meeting]) -> Option<Vec<GridMesh>> {
    if meetings.is_empty() {
        return None;
    }
    let still = |grid: &GridMesh| GridMesh { target: vec![[0.0; 2]; grid.len()], ..grid.clone() };
    let mut steps: Vec<GridMesh> = lattices.iter().map(still).collect();
    let shape = shape_energy(lattices);
    let mut solver = MeshSolver::default();
    for _ in 0..ROUNDS {
        let mut equations = shape.clone();
        for meeting in meetings {
            add_meeting(meeting, cameras, &steps, &mut equations);
        }
        let solution = solver.solve(&equations)?;
        if !solution.coordinates.iter().all(|coordinate| coordinate.is_finite()) {
            return None;
        }
        steps = equations.meshes(lattices, &solution.coordinates);
    }
    Some(steps)
}

fn add_meeting(meeting: &Meeting, cameras: &[Camera], steps: &[GridMesh], equations: &mut NormalEquations) {
    let Meeting { from: [from, vertex], to, place, share } = *meeting;
    let aside = steps[to].warp(place);
    let (here, there) = (&cameras[from], &cameras[to]);
    let Some(undrawn) = there.transfer(here, place) else { return };
    let Some(drawn) = carried(there, here, place + aside) else { return };
    let (corners, shares) = steps[to].bilinear(place);
    let members: [(usize, f64); 4] = std::array::from_fn(|k| (corners[k], shares[k]));
    let own = steps[from].source(vertex);
    equations.add_carried(&CarriedVertex {
        from: [from, vertex],
        to,
        members: &members,
        factor: drawn.factor,
        // The other's step, linear around the one it has; and the share of what lies between the two by their cameras.
        value: drawn.place - undrawn - product(drawn.factor, aside) + (undrawn - own) * share,
        squared_weight: share,
    });
}

/// What keeps steps even, and small.
fn shape_energy(lattices: &[GridMesh]) -> NormalEquations {
    let mut equations = NormalEquations::new(lattices);
    for (photograph, lattice) in lattices.iter().enumerate() {
        let (rows, columns) = (lattice.rows, lattice.columns);
        let mut add = |members: &[(usize, f64)]| {
            let members: Vec<(usize, Vector2<f64>)> =
                members.iter().map(|&(vertex, factor)| (vertex, Vector2::new(factor, 0.0))).collect();
            equations.add_inside(photograph, &members, Vector2::zeros());
        };
        for vertex in 0..lattice.len() {
            let (row, column) = (vertex / columns, vertex % columns);
            add(&[(vertex, REST)]);
            let along = |step: usize| [(vertex, BENDING), (vertex + step, -2.0 * BENDING), (vertex + 2 * step, BENDING)];
            if column + 2 < columns {
                add(&along(1));
            }
            if row + 2 < rows {
                add(&along(columns));
            }
            if column + 1 < columns && row + 1 < rows {
                // Twice the square of the mixed derivative.
                let twist = std::f64::consts::SQRT_2 * BENDING;
                add(&[
                    (vertex, twist),
                    (vertex + 1, -twist),
                    (vertex + columns, -twist),
                    (vertex + columns + 1, twist),
                ]);
            }
        }
    }
    equations
}
