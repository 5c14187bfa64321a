//! What the grids are deformed by.

use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result};

use super::base::BaseMap;
use super::closure::Closure;
use super::structure::StructureInput;
use crate::match_points::OverlapWarp;

/// The grids of one component and what is wanted of them. Photographs are counted 0..N; `grids` and `bases` have N
/// entries.
#[derive(Debug, Clone, Copy)]
pub struct MeshInput<'a> {
    /// The undeformed grids.
    pub grids: &'a [GridMesh],
    /// Match points, two directions a pair; pairs across the cut of a full turn are not among them (see
    /// [`Closure`]).
    pub warps: &'a [OverlapWarp],
    /// For every photograph the shape that the prior asks for.
    pub bases: &'a [BaseMap],
    /// The photograph whose first vertex stays in place (translation is otherwise free).
    pub reference: usize,
    /// What closes a full turn.
    pub closure: Option<Closure<'a>>,
    /// Long lines that keep their shape.
    pub structure: Option<StructureInput<'a>>,
}

impl MeshInput<'_> {
    /// Refuses chains that do not have a list for every photograph.
    pub(super) fn check(&self) -> Result<()> {
        match &self.structure {
            Some(structure) => an_entry_each("lists of chains", structure.chains.len(), self.grids.len()),
            None => Ok(()),
        }
    }
}

/// Refuses a list of which `given` entries are given for `photographs`.
pub(super) fn an_entry_each(what: &str, given: usize, photographs: usize) -> Result<()> {
    if given == photographs {
        return Ok(());
    }
    let reason = format!("{given} are given for {photographs} photographs");
    Err(Error::input(what, reason, "Give one for every photograph."))
}
