//! The deformed grids of all pictures: one sparse least-squares problem.
//!
//! Energies, one file each: alignment of the overlaps (`alignment`), and of the grid's edges (`similarity`) local
//! similarity and agreement with the similarity prior. Unknown are the vertices of all grids in the panorama.
//!
//! # Source
//! Chen and Chuang (2016), section 3; VPG section IV with its global similarity.

mod alignment;
mod base;
mod closure;
mod complex;
mod evidence;
mod line_alignment;
mod normal_equations;
mod photometric;
mod refinement;
mod similarity;
mod solver;
mod structure;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result, StageContext};

use crate::match_points::OverlapWarp;
pub use alignment::{AlignmentEnergy, MatchPoint};
pub(crate) use base::is_moderate;
pub use base::{Base, BaseShape, bases, turn_length};
pub use closure::Closure;
pub use line_alignment::{LineAlignmentInput, LineAlignmentOptions, StraightInput};
pub use normal_equations::{MeshSolution, Metric, NormalEquations, Share};
pub use photometric::{PhotometricInput, PhotometricOptions, Pyramid};
pub use refinement::Refinements;
pub use similarity::SimilarityEnergy;
pub use solver::MeshSolver;
pub use structure::{StructureInput, StructureOptions};

trueup_core::options! {
    /// How the grids are deformed.
    pub struct MeshOptions("mesh") {
        /// Largest side of a grid cell.
        cell_px: f64 = 40.0, between(4.0, 1000.0), "working px";
        /// The shape that the similarity prior asks of each picture.
        base: BaseShape = BaseShape::Sphere, Allowed::Any, "";
        /// How the sphere is unrolled: 0 is the equirectangular projection, which stretches steep pictures sideways; 1 is
        /// Mercator's, which keeps shapes and enlarges steep pictures.
        conformality: f64 = 0.85, between(0.0, 1.0), "";
        /// Cells of the delivered grid per cell of the solved one, along each axis: the finer grid follows the base's
        /// curves between the solved vertices.
        subdivision: usize = 2, between(1.0, 16.0), "";
        /// Weight of the alignment of overlaps.
        alignment_weight: f64 = 1.0, between(0.0, 1000.0), "";
        /// Weight of local similarity (on residuals).
        local_weight: f64 = 0.75, between(0.0, 1000.0), "";
        /// Weight of the similarity prior next to an overlap (on residuals, for 40 px cells).
        prior_weight: f64 = 6.0, between(0.001, 1000.0), "";
        /// Growth of that weight with the distance from the overlap, per picture diagonal.
        prior_slope: f64 = 20.0, between(0.0, 1000.0), "";
        /// Weight with which a refinement (`stitch.align`) keeps each picture's outline where the plain mesh has it (on
        /// residuals).
        outline_weight: f64 = 10.0, between(0.0, 1000.0), "";
    }
}

/// The cell size that the published weights belong to.
pub(crate) const PUBLISHED_CELL_PX: f64 = 40.0;

/// The deformed grids of one component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WarpedMesh {
    /// One grid per picture: sources in working pixels, targets in panorama units (about working pixels).
    pub meshes: Vec<GridMesh>,
    /// Root mean square distance between the two places of a match point, in panorama units.
    pub alignment_rms: f64,
    /// Number of grid triangles turned over (signed area not positive), over all pictures.
    pub folds: usize,
    /// Relative gradient |A^T (A x - b)| / |A^T b| of the energy at the solution.
    pub relative_gradient: f64,
    /// Length of a full turn in panorama units: places this far apart in x are the same. `None` if the pictures do not go
    /// all the way round, or their ends do not meet.
    #[serde(default)]
    pub period: Option<f64>,
}

/// Deforms the undeformed `grids` so that overlaps align and every edge keeps to its picture's base.
///
/// * `warps`: match points, two directions a pair; pairs across the cut of a full turn are not among them (see
///   [`Closure`]).
/// * `bases`: for every picture the shape that the prior asks for.
/// * `reference`: the picture whose first vertex stays in place (translation is otherwise free).
///
/// # Errors
/// [`Error::Unsolvable`] if the system is not positive definite or the solution is not finite;
/// [`Error::Cancelled`].
pub fn run(
    grids: &[GridMesh],
    warps: &[OverlapWarp],
    bases: &[Base],
    reference: usize,
    options: &MeshOptions,
    context: &StageContext,
) -> Result<WarpedMesh> {
    run_refined(grids, warps, bases, reference, options, &Refinements::default(), context)
}

/// As [`run`], and with the energies of `refinements`; none of them leave the grids exactly as [`run`] makes them.
///
/// A full turn is closed if its ends can meet; otherwise the warning `full-turn-open` says why not, and it is left open.
///
/// # Errors
/// As [`run`]; [`Error::Input`] if a refinement's lists do not have an entry per picture.
pub fn run_refined(
    grids: &[GridMesh],
    warps: &[OverlapWarp],
    bases: &[Base],
    reference: usize,
    options: &MeshOptions,
    refinements: &Refinements,
    context: &StageContext,
) -> Result<WarpedMesh> {
    context.check_cancelled()?;
    refinements.check(grids.len())?;
    let places: Vec<Vec<Vector2<f64>>> = bases.iter().zip(grids).map(|(base, grid)| base.places(grid)).collect();
    let alignment = AlignmentEnergy::new(grids, warps, bases, &places);
    let open = Problem {
        grids,
        warps,
        bases,
        places: &places,
        alignment: &alignment,
        reference,
        closing: &[],
        options,
        context,
    };
    let Some(closure) = &refinements.closure else { return open.deform(refinements) };
    let mut alignment = alignment.clone();
    alignment.join(closure, grids, bases, &places);
    let closed = Problem { alignment: &alignment, closing: closure.warps, ..open };
    let plain = open.solve_refined(open.equations(), &Refinements::default())?;
    let contradiction = match closure.contradiction(&alignment.apart(&plain.meshes)) {
        Some(contradiction) => contradiction,
        None => {
            let warped = closed.deform(refinements)?;
            if warped.folds <= refinement::total_folds(&open.delivered(&plain.meshes)) {
                return Ok(warped);
            }
            "closing the turn would fold the photographs".to_owned()
        }
    };
    context.report(Diagnostic::warning(
        "full-turn-open",
        Subject::stage("mesh"),
        format!("the photographs go all the way round, but the panorama's ends do not meet: {contradiction}"),
        "Look whether the photographs beside the cut show the same; --graph names the pairs to be matched.",
    ));
    open.deform(refinements)
}

/// The undeformed grid with `factor` cells per cell of `grid` along each axis.
pub fn divided(grid: &GridMesh, factor: usize) -> GridMesh {
    let (rows, columns) = ((grid.rows - 1) * factor + 1, (grid.columns - 1) * factor + 1);
    let mut fine = GridMesh { rows, columns, target: Vec::new(), lines: None, ..*grid };
    fine.target = (0..fine.len()).map(|vertex| fine.source(vertex).into()).collect();
    fine
}

/// What all rounds of solving have in common.
#[derive(Clone, Copy)]
struct Problem<'a> {
    grids: &'a [GridMesh],
    warps: &'a [OverlapWarp],
    bases: &'a [Base],
    /// The bases' places of the grids' vertices.
    places: &'a [Vec<Vector2<f64>>],
    alignment: &'a AlignmentEnergy,
    /// The picture that stays in place.
    reference: usize,
    /// Match points across the cut of a full turn that is to be closed.
    closing: &'a [OverlapWarp],
    options: &'a MeshOptions,
    context: &'a StageContext<'a>,
}

/// Grids whose vertices are a solution.
struct Solved {
    meshes: Vec<GridMesh>,
    /// Length of a full turn that is closed.
    period: Option<f64>,
    relative_gradient: f64,
}

impl Problem<'_> {
    /// The energies of the plain mesh.
    fn equations(&self) -> NormalEquations {
        /// Any positive weight anchors the one free translation exactly; 1 keeps the system well conditioned.
        const ANCHOR_WEIGHT: f64 = 1.0;
        let mut equations = NormalEquations::new(self.grids);
        self.alignment.add(self.options.alignment_weight, &mut equations, self.grids);
        let overlap = self.alignment.overlap_cells(self.grids);
        for (picture, grid) in self.grids.iter().enumerate() {
            SimilarityEnergy::new(grid, &self.places[picture], &overlap[picture], self.options)
                .add(picture, &mut equations);
        }
        for picture in anchors(self.grids.len(), &[self.warps, self.closing], self.reference) {
            equations.anchor(picture, ANCHOR_WEIGHT);
        }
        equations
    }

    fn deform(&self, refinements: &Refinements) -> Result<WarpedMesh> {
        let Solved { meshes, period, relative_gradient } = self.solve_refined(self.equations(), refinements)?;
        let alignment_rms = self.alignment.rms(&meshes, period);
        let meshes = self.delivered(&meshes);
        let folds = refinement::total_folds(&meshes);
        Ok(WarpedMesh { meshes, alignment_rms, folds, relative_gradient, period })
    }

    fn solve(&self, solver: &mut MeshSolver, equations: &NormalEquations) -> Result<Solved> {
        self.context.check_cancelled()?;
        let unsolvable = |why: &str| {
            Error::unsolvable(
                "mesh",
                "the panorama's grid",
                why,
                "Raise mesh.prior_weight, or leave out pictures that hardly overlap.",
            )
        };
        let solution = solver.solve(equations).ok_or_else(|| unsolvable("the equations are not positive definite"))?;
        if !solution.coordinates.iter().all(|coordinate| coordinate.is_finite()) {
            return Err(unsolvable("the solution is not finite"));
        }
        let meshes = equations.meshes(self.grids, &solution.coordinates);
        let period = solution.period;
        if period.is_some_and(|period| !(period.is_finite() && period > 0.0)) {
            return Err(unsolvable("the length of a full turn is not positive"));
        }
        Ok(Solved { meshes, period, relative_gradient: solution.relative_gradient })
    }

    /// Solved grids with the subdivision that they are delivered with.
    fn delivered(&self, solved: &[GridMesh]) -> Vec<GridMesh> {
        (0..solved.len())
            .map(|k| subdivided(&solved[k], &self.bases[k], &self.places[k], self.options.subdivision))
            .collect()
    }
}

/// A solved grid with more vertices: the base's own curves plus the bilinear deviation from it.
fn subdivided(solved: &GridMesh, base: &Base, places: &[Vector2<f64>], factor: usize) -> GridMesh {
    let mut fine = divided(solved, factor);
    let place = |pixel: Vector2<f64>| solved.warp(pixel) + base.sag(solved, places, pixel);
    fine.target = (0..fine.len()).map(|vertex| place(fine.source(vertex)).into()).collect();
    fine
}

/// One picture of every part that the warps connect: the reference where it is a member, else the first.
fn anchors(pictures: usize, warps: &[&[OverlapWarp]], reference: usize) -> Vec<usize> {
    let mut union = petgraph::unionfind::UnionFind::<usize>::new(pictures);
    for warp in warps.iter().copied().flatten().filter(|warp| warp.vertices.iter().any(Option::is_some)) {
        union.union(warp.from, warp.to);
    }
    let labels = union.into_labeling();
    let mut anchored: Vec<usize> = Vec::new();
    for picture in std::iter::once(reference).chain(0..pictures) {
        if picture < pictures && !anchored.iter().any(|&other| labels[other] == labels[picture]) {
            anchored.push(picture);
        }
    }
    anchored
}

/// Triangles of the grid with a signed area that is not positive.
pub fn count_folds(mesh: &GridMesh) -> usize {
    let vertex = |row: usize, column: usize| Vector2::from(mesh.target[row * mesh.columns + column]);
    let mut folds = 0;
    for row in 0..mesh.rows - 1 {
        for column in 0..mesh.columns - 1 {
            let top_left = vertex(row, column);
            let bottom_right = vertex(row + 1, column + 1) - top_left;
            let top_right = vertex(row, column + 1) - top_left;
            let bottom_left = vertex(row + 1, column) - top_left;
            folds += usize::from(top_right.perp(&bottom_right) <= 0.0);
            folds += usize::from(bottom_right.perp(&bottom_left) <= 0.0);
        }
    }
    folds
}

#[cfg(test)]
mod refinement_tests;
#[cfg(test)]
mod tests;
