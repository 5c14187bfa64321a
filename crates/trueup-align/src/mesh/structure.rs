//! Long straight lines keep the shape that the base gives them, across the cells of a grid.
//!
//! # Source
//! The structure term of GES-GSP (Du and others, "Geometric structure preserving warp for natural image stitching",
//! CVPR 2022): samples of a long curve keep their coordinates in the frame of the curve's chord.
//!
//! # Departures
//! The curves are chains of collinear segments, whose samples lie on the chord; relative to the base, as all energies
//! here.

use trueup_core::lines::LineSegment;

use super::current_grids::CurrentGrids;
use super::normal_equations::NormalEquations;
use super::straight_line::{DeviationTerm, StraightLine};

trueup_core::options! {
    /// How long lines keep their shape (`stitch.structure = lines`).
    pub struct StructureOptions("structure") {
        /// Weight of a squared deviation of a line's sample from its place between the line's ends. Raise it where long
        /// edges are wavy, lower it where keeping them straight holds overlaps apart.
        weight: f64 = 2.25, between(0.0, 10000.0), "per working px squared";
    }
}

/// What the structure energy is given.
#[derive(Debug, Clone, Copy)]
pub struct StructureInput<'a> {
    /// Chains of collinear segments of every photograph, as one segment each.
    pub chains: &'a [Vec<LineSegment>],
    /// How.
    pub options: &'a StructureOptions,
}

impl StructureInput<'_> {
    /// Adds the equations of all long chains.
    pub(super) fn add(&self, equations: &mut NormalEquations, grids: &CurrentGrids) {
        /// Shortest line that counts, as a share of the photograph's diagonal.
        const MIN_DIAGONAL: f64 = 0.1;
        for (photograph, chains) in self.chains.iter().enumerate() {
            let grid = &grids.solved[photograph];
            let shortest = MIN_DIAGONAL * grid.width.hypot(grid.height);
            for chain in chains.iter().filter(|chain| chain.length() >= shortest) {
                let line = StraightLine::along(photograph, chain, grids.solved);
                line.add(DeviationTerm::All, self.options.weight, equations, grids);
            }
        }
    }
}
