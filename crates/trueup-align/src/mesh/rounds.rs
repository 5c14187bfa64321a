//! The order in which further energies refine a mesh.

use nalgebra::Vector2;
use trueup_core::Result;
use trueup_core::mesh::GridMesh;

use super::current_grids::CurrentGrids;
use super::line_alignment::{LineAlignmentInput, StraightInput};
use super::normal_equations::NormalEquations;
use super::photometric::{LEVELS, PhotometricInput};
use super::problem::{MeshProblem, Solved};
use super::refinements::Refinements;
use super::solver::MeshSolver;
use super::warped_mesh::total_folds;

/// What the rounds of photometric alignment are made from.
#[derive(Debug, Clone, Copy)]
pub(super) struct PixelAlignment<'a> {
    pub input: &'a PhotometricInput<'a>,
    /// The share of its weight that every overlap has.
    pub shares: &'a [f64],
    /// Lines that are kept straight meanwhile.
    pub straight: Option<StraightInput<'a>>,
}

impl MeshProblem<'_> {
    /// Refines a solution of the plain `equations` by one refinement after the other.
    pub(super) fn refine(
        &self,
        solver: &mut MeshSolver,
        mut equations: NormalEquations,
        mut solved: Solved,
        refinements: &Refinements,
    ) -> Result<Solved> {
        if refinements.photometric.is_some() || refinements.lines.is_some() {
            self.hold_outlines(&mut equations, &solved.meshes, refinements.outline_weight);
        }
        if let Some(input) = &refinements.lines {
            (equations, solved) = self.align_lines(solver, equations, input, refinements.straight, solved)?;
        }
        if let Some(input) = &refinements.photometric {
            let fine = self.delivered(&solved.meshes);
            let shares = input.shares(self.warps, &self.current(&solved.meshes, &fine), self.context)?;
            let pixels = PixelAlignment { input, shares: &shares, straight: refinements.straight };
            solved = self.align_pixels(solver, &equations, &pixels, solved)?;
        }
        Ok(solved)
    }

    /// Rounds of line alignment; with the last round's equations. A step that folds the grids is shortened; if that
    /// does not help it is undone, and the next round asks less of what is far apart.
    fn align_lines(
        &self,
        solver: &mut MeshSolver,
        mut equations: NormalEquations,
        input: &LineAlignmentInput,
        straight: Option<StraightInput>,
        start: Solved,
    ) -> Result<(NormalEquations, Solved)> {
        /// Times the mesh is solved with lines and weights found on the solution before.
        const ROUNDS: usize = 4;
        /// Distance at which a match has half its weight in the first round, panorama units: what is near the camera
        /// starts as far from where most matches meet.
        const FIRST_ROBUST_PX: f64 = 30.0;
        /// Factor on the robust distance from round to round: where depth differs within a cell, the surface that most
        /// matches are on wins. The last round's distance is that of a match's own error, 1 px.
        const NARROWING: f64 = 0.32;
        let mut best = start;
        let mut fine = self.delivered(&best.meshes);
        let folds = total_folds(&fine);
        let shares = input.shares(&self.current(&best.meshes, &fine));
        let mut last = Vec::new();
        let mut robust_px = FIRST_ROBUST_PX;
        let kept_straight = kept_straight(&equations, straight, &self.current(&best.meshes, &fine));
        for _ in 0..ROUNDS {
            let mut all = kept_straight.clone();
            let lines = input.cells(&self.current(&best.meshes, &fine), &shares, robust_px);
            lines.iter().for_each(|cells| all.add_cell_pairs(cells));
            robust_px *= NARROWING;
            let next = self.solve(solver, all)?;
            let Some(step) = self.longest_step(&best, next, |_, fine| total_folds(fine) <= folds) else { continue };
            (best, fine) = step;
            last = lines;
        }
        last.iter().for_each(|cells| equations.add_cell_pairs(cells));
        Ok((equations, best))
    }

    /// Keeps the outlines of the photographs where they are in `meshes`.
    ///
    /// Where neighbors were taken from different places their pixels would bend and turn the photographs against each
    /// other; how a photograph stands is the prior's to say. Its outline lies over the inside of a neighbor, which can
    /// give way.
    pub(super) fn hold_outlines(&self, equations: &mut NormalEquations, meshes: &[GridMesh], weight: f64) {
        for (photograph, mesh) in meshes.iter().enumerate() {
            let is_outer = |at: usize, length: usize| at == 0 || at + 1 == length;
            for vertex in 0..mesh.len() {
                if is_outer(vertex / mesh.columns, mesh.rows) || is_outer(vertex % mesh.columns, mesh.columns) {
                    let now = Vector2::from(mesh.target[vertex]);
                    equations.add_inside(photograph, &[(vertex, Vector2::new(weight, 0.0))], now * weight);
                }
            }
        }
    }

    /// Rounds of photometric alignment, from coarse to fine. A step that folds the grids or tears match points apart is
    /// shortened; if that does not help it is undone, and ends its level.
    pub(super) fn align_pixels(
        &self,
        solver: &mut MeshSolver,
        equations: &NormalEquations,
        pixels: &PixelAlignment,
        start: Solved,
    ) -> Result<Solved> {
        /// Most rounds at a level; each solves the mesh once. Four lower NCC MSE by another 0.1 to 0.3 % (four pairs
        /// and a rendered set) and take half as long again.
        const ROUNDS: usize = 2;
        /// A level ends when the mean difference falls by less than this share in a round.
        const SETTLED: f64 = 0.01;
        /// A round that raises the root mean square distance of match points by more than this is undone, panorama
        /// units.
        const MAX_DEPARTURE_PX: f64 = 1.0;
        let PixelAlignment { input, shares, straight } = *pixels;
        let mut best = start;
        let mut fine = self.delivered(&best.meshes);
        let folds = total_folds(&fine);
        let kept_straight = kept_straight(equations, straight, &self.current(&best.meshes, &fine));
        for level in (0..LEVELS).rev() {
            let mut before = f64::INFINITY;
            for _ in 0..ROUNDS {
                let mut with_pixels = kept_straight.clone();
                let grids = self.current(&best.meshes, &fine);
                let misfit = input.add(&mut with_pixels, self.warps, &grids, level, shares, self.context)?;
                if misfit >= before * (1.0 - SETTLED) {
                    break;
                }
                before = misfit;
                let next = self.solve(solver, with_pixels)?;
                let most_rms = self.alignment.rms(&best.meshes, best.period) + MAX_DEPARTURE_PX;
                let is_sound = |step: &Solved, fine: &[GridMesh]| {
                    total_folds(fine) <= folds && self.alignment.rms(&step.meshes, step.period) <= most_rms
                };
                let Some(step) = self.longest_step(&best, next, is_sound) else { break };
                (best, fine) = step;
            }
        }
        Ok(best)
    }

    /// The grids around which the next equations are made.
    pub(super) fn current<'b>(&'b self, solved: &'b [GridMesh], fine: &'b [GridMesh]) -> CurrentGrids<'b> {
        CurrentGrids { solved, fine, places: self.places }
    }

    /// The whole step from one solution to another, or its half or quarter, whichever is sound first; with the grids as
    /// delivered.
    fn longest_step(
        &self,
        from: &Solved,
        to: Solved,
        is_sound: impl Fn(&Solved, &[GridMesh]) -> bool,
    ) -> Option<(Solved, Vec<GridMesh>)> {
        /// What is tried, the longest first.
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

/// The `equations` with those of straight lines around `grids`.
///
/// Of the grids they take the directions of the lines alone, which rounds change by little.
fn kept_straight(
    equations: &NormalEquations,
    straight: Option<StraightInput>,
    grids: &CurrentGrids,
) -> NormalEquations {
    let mut all = equations.clone();
    if let Some(straight) = straight {
        straight.add(&mut all, grids);
    }
    all
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
