//! What the grids are deformed by.

use trueup_core::mesh::GridMesh;

use super::base::BaseMap;
use super::refinements::Refinements;
use crate::match_points::OverlapWarp;

/// The grids of one component and what is wanted of them. Photographs are counted 0..N; `grids` and `bases` have N
/// entries.
#[derive(Debug, Clone, Copy)]
pub struct MeshInput<'a> {
    /// The undeformed grids.
    pub grids: &'a [GridMesh],
    /// Match points, two directions a pair; pairs across the cut of a full turn are not among them (see
    /// [`Closure`](super::Closure)).
    pub warps: &'a [OverlapWarp],
    /// For every photograph the shape that the prior asks for.
    pub bases: &'a [BaseMap],
    /// The photograph whose first vertex stays in place (translation is otherwise free).
    pub reference: usize,
    /// Energies beyond those of the plain mesh.
    pub refinements: Refinements<'a>,
}
