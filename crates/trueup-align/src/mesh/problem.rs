//! The equations of the plain mesh and their solution.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result, StageContext};

use super::alignment::AlignmentEnergy;
use super::normal_equations::{NormalEquations, solved_grids};
use super::options::MeshOptions;
use super::similarity::SimilarityEnergy;
use super::solver::MeshSolver;
use super::subdivision::subdivided;
use super::warped_mesh::{WarpedMesh, total_folds};
use crate::match_points::OverlapWarp;

/// What all rounds of solving have in common.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeshProblem<'a> {
    pub grids: &'a [GridMesh],
    pub warps: &'a [OverlapWarp],
    /// The bases' places of the grids' vertices.
    pub places: &'a [Vec<Vector2<f64>>],
    /// How far the bases are from their bilinear interpolation, at the vertices of the grids as they are delivered.
    pub sags: &'a [Vec<Vector2<f64>>],
    pub alignment: &'a AlignmentEnergy,
    /// The photograph that stays in place.
    pub reference: usize,
    /// Match points across the cut of a full turn that is to be closed.
    pub closing: &'a [OverlapWarp],
    /// Growth of the prior's weight with the distance from the overlap, see
    /// [`PRIOR_SLOPE`](super::similarity::PRIOR_SLOPE).
    pub prior_slope: f64,
    pub options: &'a MeshOptions,
    pub context: &'a StageContext<'a>,
}

/// Grids whose vertices are a solution.
#[derive(Debug)]
pub(super) struct Solved {
    pub meshes: Vec<GridMesh>,
    /// Length of a full turn that is closed.
    pub period: Option<f64>,
    pub relative_gradient: f64,
}

impl MeshProblem<'_> {
    /// The energies of the plain mesh.
    pub(super) fn equations(&self) -> NormalEquations {
        /// Any positive weight anchors the one free translation exactly; 1 keeps the system well conditioned.
        const ANCHOR_WEIGHT: f64 = 1.0;
        let mut equations = NormalEquations::new(self.grids);
        self.alignment.add(self.options.alignment_weight, &mut equations, self.grids);
        let overlap = self.alignment.overlap_cells(self.grids);
        for (photograph, grid) in self.grids.iter().enumerate() {
            SimilarityEnergy::new(grid, &self.places[photograph], &overlap[photograph], self.options, self.prior_slope)
                .add(photograph, &mut equations);
        }
        for photograph in anchors(self.grids.len(), &[self.warps, self.closing], self.reference) {
            equations.anchor(photograph, ANCHOR_WEIGHT);
        }
        equations
    }

    /// What a solution makes of the grids.
    pub(super) fn warped(&self, solved: &Solved) -> WarpedMesh {
        let &Solved { ref meshes, period, relative_gradient } = solved;
        let alignment_rms = self.alignment.rms(meshes, period);
        let meshes = self.delivered(meshes);
        let folds = total_folds(&meshes);
        WarpedMesh { meshes, alignment_rms, folds, relative_gradient, period, by_cameras: None }
    }

    pub(super) fn solve(&self, solver: &mut MeshSolver, equations: NormalEquations) -> Result<Solved> {
        self.context.check_cancelled()?;
        let unsolvable = |why: &str| {
            Error::unsolvable(
                "mesh",
                "the panorama's grid",
                why,
                "Raise mesh.prior_weight, or leave out photographs that hardly overlap.",
            )
        };
        let solution = solver.solve(equations).ok_or_else(|| unsolvable("the equations are not positive definite"))?;
        if !solution.coordinates.iter().all(|coordinate| coordinate.is_finite()) {
            return Err(unsolvable("the solution is not finite"));
        }
        let meshes = solved_grids(self.grids, &solution.coordinates);
        let period = solution.period;
        if period.is_some_and(|period| !(period.is_finite() && period > 0.0)) {
            return Err(unsolvable("the length of a full turn is not positive"));
        }
        Ok(Solved { meshes, period, relative_gradient: solution.relative_gradient })
    }

    /// Solved grids with the subdivision that they are delivered with.
    pub(super) fn delivered(&self, solved: &[GridMesh]) -> Vec<GridMesh> {
        solved.iter().zip(self.sags).map(|(grid, sags)| subdivided(grid, sags, self.options.subdivision)).collect()
    }
}

/// One photograph of every part that the warps connect: the reference where it is a member, else the first.
fn anchors(photographs: usize, warps: &[&[OverlapWarp]], reference: usize) -> Vec<usize> {
    let mut union = petgraph::unionfind::UnionFind::<usize>::new(photographs);
    for warp in warps.iter().copied().flatten().filter(|warp| warp.vertices.iter().any(Option::is_some)) {
        union.union(warp.from, warp.to);
    }
    let labels = union.into_labeling();
    let mut anchored: Vec<usize> = Vec::new();
    for photograph in std::iter::once(reference).chain(0..photographs) {
        if photograph < photographs && !anchored.iter().any(|&other| labels[other] == labels[photograph]) {
            anchored.push(photograph);
        }
    }
    anchored
}
