//! The order in which further energies refine a mesh.

use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result};

use super::{MeshSolver, NormalEquations, PhotometricInput, Problem, Solved, count_folds};

/// Energies beyond those of the plain mesh; by default none.
#[derive(Debug, Clone, Copy, Default)]
pub struct Refinements<'a> {
    /// Pixels that align overlaps.
    pub photometric: Option<PhotometricInput<'a>>,
}

impl Refinements<'_> {
    /// Refuses lists that do not have an entry for every one of `pictures`.
    pub(super) fn check(&self, pictures: usize) -> Result<()> {
        let wrong = |what: &str, given: usize| {
            Error::input(what, format!("{given} are given for {pictures} pictures"), "Give one for every picture.")
        };
        match self.photometric {
            Some(input) if input.pyramids.len() != pictures => Err(wrong("pyramids", input.pyramids.len())),
            _ => Ok(()),
        }
    }
}

impl Problem<'_> {
    /// Solves the plain `equations`, then with one refinement after the other.
    pub(super) fn solve_refined(&self, equations: NormalEquations, refinements: &Refinements) -> Result<Solved> {
        let mut solver = MeshSolver::default();
        let mut solved = self.solve(&mut solver, &equations)?;
        if let Some(input) = &refinements.photometric {
            solved = self.align_pixels(&mut solver, &equations, input, solved)?;
        }
        Ok(solved)
    }

    /// Rounds of photometric alignment, from coarse to fine. A round that folds the grids or tears match points apart is
    /// undone, and ends its level.
    fn align_pixels(
        &self,
        solver: &mut MeshSolver,
        equations: &NormalEquations,
        input: &PhotometricInput,
        start: Solved,
    ) -> Result<Solved> {
        let options = input.options;
        let mut best = start;
        let mut fine = self.delivered(&best.meshes);
        let folds = total_folds(&fine);
        let most_rms = self.alignment.rms(&best.meshes) + options.max_departure_px;
        for level in (0..options.levels).rev() {
            let mut before = f64::INFINITY;
            for _ in 0..options.rounds {
                let mut with_pixels = equations.clone();
                let misfit = input.add(&mut with_pixels, self.warps, [&best.meshes, &fine], level, self.context)?;
                if misfit >= before * (1.0 - options.settled) {
                    break;
                }
                before = misfit;
                let next = self.solve(solver, &with_pixels)?;
                let next_fine = self.delivered(&next.meshes);
                if total_folds(&next_fine) > folds || self.alignment.rms(&next.meshes) > most_rms {
                    break;
                }
                (best, fine) = (next, next_fine);
            }
        }
        Ok(best)
    }
}

fn total_folds(meshes: &[GridMesh]) -> usize {
    meshes.iter().map(count_folds).sum()
}
