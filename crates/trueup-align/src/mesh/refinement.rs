//! The order in which further energies refine a mesh.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result};

use super::line_alignment::Present;
use super::{
    Closure, LineAlignmentInput, MeshSolver, NormalEquations, PhotometricInput, Problem, Solved, StraightInput,
    StructureInput, count_folds,
};

/// Energies beyond those of the plain mesh; by default none.
#[derive(Debug, Clone, Copy, Default)]
pub struct Refinements<'a> {
    /// What closes a full turn.
    pub closure: Option<Closure<'a>>,
    /// Long lines that keep their shape.
    pub structure: Option<StructureInput<'a>>,
    /// Lines and points that align overlaps.
    pub lines: Option<LineAlignmentInput<'a>>,
    /// Lines that keep straight while lines or pixels align overlaps.
    pub straight: Option<StraightInput<'a>>,
    /// Pixels that align overlaps.
    pub photometric: Option<PhotometricInput<'a>>,
    /// Weight with which every picture's outline stays where the plain mesh has it while lines or pixels align overlaps
    /// (on residuals).
    pub outline_weight: f64,
}

impl Refinements<'_> {
    /// Refuses lists that do not have an entry for every one of `pictures`.
    pub(super) fn check(&self, pictures: usize) -> Result<()> {
        let given = [
            ("pyramids", self.photometric.map(|input| input.pyramids.len())),
            ("lists of lines", self.straight.map(|input| input.lines.len())),
            ("lists of chains", self.structure.map(|input| input.chains.len())),
        ];
        for (what, given) in given {
            if let Some(given) = given.filter(|&given| given != pictures) {
                let reason = format!("{given} are given for {pictures} pictures");
                return Err(Error::input(what, reason, "Give one for every picture."));
            }
        }
        Ok(())
    }
}

impl Problem<'_> {
    /// Solves the plain `equations`, then with one refinement after the other.
    pub(super) fn solve_refined(&self, mut equations: NormalEquations, refinements: &Refinements) -> Result<Solved> {
        let mut solver = MeshSolver::default();
        if let Some(structure) = &refinements.structure {
            let present = Present { solved: self.grids, fine: self.grids, places: self.places };
            structure.add(&mut equations, &present);
        }
        let mut solved = self.solve(&mut solver, &equations)?;
        if refinements.photometric.is_some() || refinements.lines.is_some() {
            self.hold_outlines(&mut equations, &solved.meshes, refinements.outline_weight);
        }
        if let Some(input) = &refinements.lines {
            (equations, solved) = self.align_lines(&mut solver, equations, (input, refinements.straight), solved)?;
        }
        if let Some(input) = &refinements.photometric {
            solved = self.align_pixels(&mut solver, &equations, (input, refinements.straight), solved)?;
        }
        Ok(solved)
    }

    /// Rounds of line alignment; with the last round's equations. A step that folds the grids is shortened; if that does
    /// not help it is undone and ends the rounds.
    fn align_lines(
        &self,
        solver: &mut MeshSolver,
        equations: NormalEquations,
        (input, straight): (&LineAlignmentInput, Option<StraightInput>),
        start: Solved,
    ) -> Result<(NormalEquations, Solved)> {
        let mut best = start;
        let mut fine = self.delivered(&best.meshes);
        let folds = total_folds(&fine);
        let shares = input.shares(&Present { solved: &best.meshes, fine: &fine, places: self.places });
        let mut last = None;
        let mut robust_px = input.options.robust_px;
        for _ in 0..input.options.rounds {
            let mut with_lines = equations.clone();
            let present = Present { solved: &best.meshes, fine: &fine, places: self.places };
            input.add(&mut with_lines, &present, &shares, robust_px);
            robust_px *= input.options.narrowing;
            let mut all = with_lines.clone();
            if let Some(straight) = straight {
                straight.add(&mut all, &present);
            }
            let next = self.solve(solver, &all)?;
            let Some(step) = self.longest_step(&best, next, |_, fine| total_folds(fine) <= folds) else { break };
            (best, fine) = step;
            last = Some(with_lines);
        }
        Ok((last.unwrap_or(equations), best))
    }

    /// Keeps the outlines of the pictures where they are in `meshes`.
    ///
    /// Where neighbors were taken from different places their pixels would bend and turn the pictures against each other;
    /// how a picture stands is the prior's to say. Its outline lies over the inside of a neighbor, which can give way.
    fn hold_outlines(&self, equations: &mut NormalEquations, meshes: &[GridMesh], weight: f64) {
        for (picture, mesh) in meshes.iter().enumerate() {
            let is_outer = |at: usize, length: usize| at == 0 || at + 1 == length;
            for vertex in 0..mesh.len() {
                if is_outer(vertex / mesh.columns, mesh.rows) || is_outer(vertex % mesh.columns, mesh.columns) {
                    let now = Vector2::from(mesh.target[vertex]);
                    equations.add_inside(picture, &[(vertex, Vector2::new(weight, 0.0))], now * weight);
                }
            }
        }
    }

    /// Rounds of photometric alignment, from coarse to fine. A step that folds the grids or tears match points apart is
    /// shortened; if that does not help it is undone, and ends its level.
    fn align_pixels(
        &self,
        solver: &mut MeshSolver,
        equations: &NormalEquations,
        (input, straight): (&PhotometricInput, Option<StraightInput>),
        start: Solved,
    ) -> Result<Solved> {
        let options = input.options;
        let mut best = start;
        let mut fine = self.delivered(&best.meshes);
        let folds = total_folds(&fine);
        let shares = input.shares(self.warps, [&best.meshes, &fine], self.context)?;
        for level in (0..options.levels).rev() {
            let mut before = f64::INFINITY;
            for _ in 0..options.rounds {
                let mut with_pixels = equations.clone();
                let misfit =
                    input.add(&mut with_pixels, self.warps, [&best.meshes, &fine], (level, &shares), self.context)?;
                if misfit >= before * (1.0 - options.settled) {
                    break;
                }
                before = misfit;
                if let Some(straight) = straight {
                    straight.add(&mut with_pixels, &Present { solved: &best.meshes, fine: &fine, places: self.places });
                }
                let next = self.solve(solver, &with_pixels)?;
                let most_rms = self.alignment.rms(&best.meshes, best.period) + options.max_departure_px;
                let is_sound = |step: &Solved, fine: &[GridMesh]| {
                    total_folds(fine) <= folds && self.alignment.rms(&step.meshes, step.period) <= most_rms
                };
                let Some(step) = self.longest_step(&best, next, is_sound) else { break };
                (best, fine) = step;
            }
        }
        Ok(best)
    }

    /// The whole step from one solution to another, or its half or quarter, whichever is sound first; with the grids as
    /// delivered.
    fn longest_step(
        &self,
        from: &Solved,
        to: Solved,
        is_sound: impl Fn(&Solved, &[GridMesh]) -> bool,
    ) -> Option<(Solved, Vec<GridMesh>)> {
        const SHARES: [f64; 3] = [1.0, 0.5, 0.25];
        SHARES.iter().find_map(|&share| {
            let meshes: Vec<GridMesh> =
                from.meshes.iter().zip(&to.meshes).map(|(from, to)| between(from, to, share)).collect();
            let fine = self.delivered(&meshes);
            let period = from.period.zip(to.period).map(|(from, to)| from + share * (to - from));
            let solved = Solved { meshes, period, relative_gradient: to.relative_gradient };
            is_sound(&solved, &fine).then_some((solved, fine))
        })
    }
}

/// A grid part of the way from one to another.
fn between(from: &GridMesh, to: &GridMesh, share: f64) -> GridMesh {
    let target = from
        .target
        .iter()
        .zip(&to.target)
        .map(|(from, to)| [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis])))
        .collect();
    GridMesh { target, ..to.clone() }
}

pub(super) fn total_folds(meshes: &[GridMesh]) -> usize {
    meshes.iter().map(count_folds).sum()
}
