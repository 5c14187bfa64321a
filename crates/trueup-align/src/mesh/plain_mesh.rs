//! The plain mesh, and what its solution leaves to be refined.

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::alignment::AlignmentEnergy;
use super::base::placed;
use super::current_grids::CurrentGrids;
use super::input::MeshInput;
use super::line_alignment;
use super::normal_equations::NormalEquations;
use super::options::MeshOptions;
use super::problem::{MeshProblem, Solved};
use super::refinements::Refinements;
use super::similarity::PRIOR_SLOPE;
use super::solver::MeshSolver;
use super::subdivision::sags;
use super::warped_mesh::WarpedMesh;
use crate::match_points::OverlapWarp;

/// How the grids lie to one another: open, or closed to a full turn.
#[derive(Debug)]
pub(super) struct Layout<'a> {
    /// The bases' places of the grids' vertices.
    pub places: Vec<Vec<Vector2<f64>>>,
    sags: Vec<Vec<Vector2<f64>>>,
    pub alignment: AlignmentEnergy,
    /// Match points across the cut of a full turn that is to be closed.
    pub closing: &'a [OverlapWarp],
}

impl<'a> Layout<'a> {
    /// Of grids whose vertices the bases have at `places`.
    pub(super) fn new(
        input: &MeshInput,
        places: Vec<Vec<Vector2<f64>>>,
        alignment: AlignmentEnergy,
        closing: &'a [OverlapWarp],
        options: &MeshOptions,
    ) -> Self {
        let MeshInput { grids, bases, .. } = *input;
        let of_grid = |k: usize| sags(&grids[k], &bases[k], &places[k], options.subdivision);
        Self { sags: (0..grids.len()).into_par_iter().map(of_grid).collect(), places, alignment, closing }
    }

    /// The equations of `input`, laid out so.
    pub(super) fn problem<'b>(
        &'b self,
        input: &MeshInput<'b>,
        options: &'b MeshOptions,
        context: &'b StageContext<'b>,
    ) -> MeshProblem<'b> {
        let MeshInput { grids, warps, reference, .. } = *input;
        let Self { places, sags, alignment, closing } = self;
        let prior_slope = PRIOR_SLOPE;
        MeshProblem { grids, warps, places, sags, alignment, reference, closing, prior_slope, options, context }
    }
}

/// The equations of the mesh of `input`, whose `problem` it is.
fn plain_equations(input: &MeshInput, problem: &MeshProblem) -> NormalEquations {
    let mut equations = problem.equations();
    if let Some(structure) = &input.structure {
        structure.add(&mut equations, &problem.current(input.grids, input.grids));
    }
    equations
}

/// A mesh without refinements, and all that these go on from.
#[derive(Debug)]
pub struct PlainMesh<'a> {
    input: MeshInput<'a>,
    layout: Layout<'a>,
    options: &'a MeshOptions,
    solved: Solved,
    warped: WarpedMesh,
}

impl<'a> PlainMesh<'a> {
    /// Solves the mesh of `input` as it is laid out.
    pub(super) fn solve(
        input: MeshInput<'a>,
        layout: Layout<'a>,
        options: &'a MeshOptions,
        context: &StageContext,
    ) -> Result<Self> {
        let problem = layout.problem(&input, options, context);
        // Equations and factor are not kept for refinements: they are the largest things there are while it is asked
        // whether the cameras draw.
        let solved = problem.solve(&mut MeshSolver::default(), plain_equations(&input, &problem))?;
        let warped = problem.warped(&solved);
        Ok(Self { input, layout, options, solved, warped })
    }

    /// What the cameras draw, to be refined: the bases of `input` are the drawing, less the first vertex of the
    /// reference.
    ///
    /// The cameras have decided how the overlaps lie. The match points, which would bend the drawing to the mesh that
    /// was worse, have no weight; what a refinement finds draws the overlaps together, while the outlines stay.
    pub fn of_drawing(input: MeshInput<'a>, options: &'a MeshOptions, context: &StageContext) -> Self {
        let MeshInput { grids, bases, warps, .. } = input;
        let places: Vec<Vec<Vector2<f64>>> = bases.iter().zip(grids).map(|(base, grid)| base.places(grid)).collect();
        let alignment = AlignmentEnergy::new(grids, warps, bases, &places);
        let solved = Solved { meshes: placed(grids, &places), period: None, relative_gradient: 0.0 };
        let layout = Layout::new(&input, places, alignment, &[], options);
        let problem = layout.problem(&input, options, context);
        let warped = problem.warped(&solved);
        Self { input, layout, options, solved, warped }
    }

    /// The grids, as they are delivered if nothing refines them.
    pub fn warped(&self) -> &WarpedMesh {
        &self.warped
    }

    /// [`PlainMesh::warped`], for good.
    pub fn into_warped(self) -> WarpedMesh {
        self.warped
    }

    /// The solved grids, before they are subdivided.
    pub(super) fn grids(&self) -> &[GridMesh] {
        &self.solved.meshes
    }

    /// How much of the distance at which matched `points` land is common to neighbors, and so is no noise but parallax
    /// that a refinement could take up: the mean over the points of the share of its weight that each would have, 0 to
    /// 1; 0 where noise alone may have it.
    pub fn misaligned_share(&self, points: &[PairMatches]) -> f64 {
        let (solved, fine, places) = (&self.solved.meshes, &self.warped.meshes, &self.layout.places);
        line_alignment::misaligned_share(points, &CurrentGrids { solved, fine, places })
    }

    /// The mesh with one refinement after the other.
    ///
    /// # Errors
    /// As those of [`run`](super::run); [`trueup_core::Error::Input`] if a refinement's lists do not have an entry per
    /// photograph.
    pub fn refined(self, refinements: &Refinements, context: &StageContext) -> Result<WarpedMesh> {
        let Self { input, layout, options, solved, .. } = self;
        refinements.check(input.grids.len())?;
        let problem = layout.problem(&input, options, context);
        let equations = plain_equations(&input, &problem);
        Ok(problem.warped(&problem.refine(&mut MeshSolver::of_rounds(), equations, solved, refinements)?))
    }
}
