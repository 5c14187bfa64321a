//! Steps aside over whole photographs, as even as they can be while places that overlaps share come to meet.
//!
//! What overlaps ask of two photographs is how far apart they are, not which of them gives way, nor what their other
//! parts do. A photograph that gives way in an overlap alone bends there, and lines with it. Here the freedom is spent
//! on evenness: steps that grow evenly keep every straight line straight, and go on where a photograph is alone.
//!
//! # Source
//! F. L. Bookstein, "Principal warps: thin-plate splines and the decomposition of deformations" (1989), for the bending
//! energy; here of two photographs at once, of which only the difference is known.

use nalgebra::{Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;

use super::by_cameras::carried;
use super::complex::product;
use super::metric::Metric;
use super::normal_equations::{CarriedVertex, NormalEquations, WeightedVertex, solved_grids};
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

/// Cells of a lattice along a photograph's longer side for which the weights are; where there are fewer, and larger
/// ones, second differences weigh as much less as they are larger, and so do leans.
pub(crate) const LATTICE_CELLS: f64 = 16.0;
/// Weight of the bending energy beside that of a meeting, per pixel of second difference from cell to cell of the
/// lattice: what an overlap's difference changes within a cell or two is left to who draws overlaps together. Between 1
/// and 4 long lines of the facades that were looked at bend alike.
const BENDING: f64 = 2.0;
/// Weight of every vertex's pull to where its camera sees it: felt within half a photograph of an overlap, where
/// corrections so come to an end.
const REST: f64 = 0.06;
/// Weight of the lean of what is vertical, in pixels a cell, where photographs overlap: what is level may follow the
/// neighbor's. Chosen on four photographed pairs: without it two stand askew by 0.3 and 0.5 degrees more; with 4 and
/// more, lines bend as if photographs gave way in the overlap alone.
const LEAN: f64 = 1.0;
/// The same where a photograph is alone, and nothing asks it to lean: corrections that would stand it askew end beside
/// the overlap, and go on as a shift. Chosen on pair-school, whose verticals lean by 0.26 degrees with 8 in place of
/// 0.63 with 1, while its long lines bend a tenth less; 15 and 30 gain little more.
const LEAN_ALONE: f64 = 8.0;
/// Distance from the overlap at which a photograph is alone, in its longer sides.
const ALONE: f64 = 0.15;
/// Times the equations are solved; the photographs' maps into each other are linear to a hundredth of a pixel over the
/// steps that are left after the first.
const ROUNDS: usize = 2;

/// By how many of its own pixels each vertex of every photograph's lattice steps aside: lattices with the steps as
/// targets, bilinear between the vertices. `None` if there is nothing to step aside for.
///
/// `lattices` are even and undeformed, over the photographs in the pixels of `cameras`.
pub(crate) fn smooth_steps(cameras: &[Camera], lattices: &[GridMesh], meetings: &[Meeting]) -> Option<Vec<GridMesh>> {
    if meetings.is_empty() {
        return None;
    }
    let still = |grid: &GridMesh| GridMesh { target: vec![[0.0; 2]; grid.len()], ..grid.clone() };
    let mut steps: Vec<GridMesh> = lattices.iter().map(still).collect();
    let asides = asides(lattices, meetings);
    let mut solver = MeshSolver::default();
    for _ in 0..ROUNDS {
        let mut equations = shape_energy(cameras, lattices, &asides);
        for meeting in meetings {
            add_meeting(meeting, cameras, &steps, &mut equations);
        }
        let solution = solver.solve(equations)?;
        if !solution.coordinates.iter().all(|coordinate| coordinate.is_finite()) {
            return None;
        }
        steps = solved_grids(lattices, &solution.coordinates);
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

/// How far every vertex of every lattice lies from the nearest one that meets another photograph, in the photograph's
/// longer sides.
fn asides(lattices: &[GridMesh], meetings: &[Meeting]) -> Vec<Vec<f64>> {
    let mut met: Vec<Vec<bool>> = lattices.iter().map(|lattice| vec![false; lattice.len()]).collect();
    meetings.iter().for_each(|meeting| met[meeting.from[0]][meeting.from[1]] = true);
    let of_lattice = |(lattice, met): (&GridMesh, &Vec<bool>)| {
        let places: Vec<Vector2<f64>> =
            (0..lattice.len()).filter(|&vertex| met[vertex]).map(|vertex| lattice.source(vertex)).collect();
        let side = lattice.width.max(lattice.height);
        let aside = |vertex: usize| {
            let own = lattice.source(vertex);
            let nearest = places.iter().map(|place| (place - own).norm_squared()).fold(f64::INFINITY, f64::min);
            nearest.sqrt() / side
        };
        (0..lattice.len()).map(aside).collect()
    };
    lattices.iter().zip(&met).map(of_lattice).collect()
}

/// What keeps steps even and small, and what is upright upright; `asides` are those of [`asides`]. The cameras' world
/// is the level one.
fn shape_energy(cameras: &[Camera], lattices: &[GridMesh], asides: &[Vec<f64>]) -> NormalEquations {
    let mut equations = NormalEquations::new(lattices);
    for (photograph, lattice) in lattices.iter().enumerate() {
        let (rows, columns) = (lattice.rows, lattice.columns);
        let coarseness = coarseness(lattice);
        let bending = BENDING / (coarseness * coarseness);
        let mut add = |members: &[(usize, f64)]| {
            let members: Vec<(usize, Vector2<f64>)> =
                members.iter().map(|&(vertex, factor)| (vertex, Vector2::new(factor, 0.0))).collect();
            equations.add_inside(photograph, &members, Vector2::zeros());
        };
        for vertex in 0..lattice.len() {
            let (row, column) = (vertex / columns, vertex % columns);
            add(&[(vertex, REST)]);
            let along =
                |step: usize| [(vertex, bending), (vertex + step, -2.0 * bending), (vertex + 2 * step, bending)];
            if column + 2 < columns {
                add(&along(1));
            }
            if row + 2 < rows {
                add(&along(columns));
            }
            if column + 1 < columns && row + 1 < rows {
                // Twice the square of the mixed derivative.
                let twist = std::f64::consts::SQRT_2 * bending;
                add(&[
                    (vertex, twist),
                    (vertex + 1, -twist),
                    (vertex + columns, -twist),
                    (vertex + columns + 1, twist),
                ]);
            }
        }
        add_leans(photograph, &cameras[photograph], lattice, &asides[photograph], &mut equations);
    }
    equations
}

/// How many times as large as usual a lattice's cells are, 1 where they are hardly larger: what is rounded to whole
/// cells makes no difference.
fn coarseness(lattice: &GridMesh) -> f64 {
    const ROUNDING: f64 = 1.1;
    let coarseness = lattice.cell_width() * LATTICE_CELLS / lattice.width.max(lattice.height);
    if coarseness > ROUNDING { coarseness } else { 1.0 }
}

/// What keeps the scene's verticals as they stand: at every vertex, how far what lies a cell further down steps across
/// the vertical beside it.
fn add_leans(photograph: usize, camera: &Camera, lattice: &GridMesh, asides: &[f64], equations: &mut NormalEquations) {
    let cell = [lattice.cell_width(), lattice.cell_height()];
    let coarseness = coarseness(lattice);
    for (vertex, aside) in asides.iter().enumerate() {
        let Some(down) = down_at(camera, lattice.source(vertex)) else { continue };
        // Differences to the neighbors to the right and below; on the border to those before.
        let (row, column) = (vertex / lattice.columns, vertex % lattice.columns);
        let right = if column + 1 < lattice.columns { vertex } else { vertex - 1 };
        let below = if row + 1 < lattice.rows { vertex } else { vertex - lattice.columns };
        let side = 0.5 * (cell[0] + cell[1]);
        let [along_x, along_y] = [down.x * side / cell[0], down.y * side / cell[1]];
        let members = [(right + 1, along_x), (right, -along_x), (below + lattice.columns, along_y), (below, -along_y)];
        let members = members.map(|(vertex, weight)| WeightedVertex { photograph, vertex, weight });
        let across = Vector2::new(-down.y, down.x);
        let share = (aside / ALONE).clamp(0.0, 1.0);
        let lean = (LEAN + (LEAN_ALONE - LEAN) * share * share * (3.0 - 2.0 * share)) / coarseness;
        equations.add_sum(&members, Metric::along(across, lean * lean), Vector2::zeros());
    }
}

/// The direction, of unit length, in which a pixel moves when what it shows moves down; `None` near a pole of the level
/// world.
fn down_at(camera: &Camera, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
    /// Radians, and the sine of the angle to a pole (15 degrees) within which there is no vertical to speak of.
    const STEP: f64 = 1e-4;
    const NEAREST: f64 = 0.26;
    let direction = camera.world_direction(pixel);
    if direction.x.hypot(direction.z) < NEAREST {
        return None;
    }
    let lower = camera.project(camera.rotation() * (direction + Vector3::y() * STEP))?;
    (lower - pixel).try_normalize(f64::MIN_POSITIVE)
}

#[cfg(test)]
#[path = "smooth_steps_tests.rs"]
mod tests;
