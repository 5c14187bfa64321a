//! What a mesh is refined by.

use trueup_core::{Error, Result};

use super::closure::Closure;
use super::line_alignment::{LineAlignmentInput, StraightInput};
use super::photometric::PhotometricInput;
use super::structure::StructureInput;

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
    /// Weight with which every photograph's outline stays where the plain mesh has it while lines or pixels align
    /// overlaps (on residuals).
    pub outline_weight: f64,
}

impl Refinements<'_> {
    /// Refuses lists that do not have an entry for every one of `photographs`.
    pub(super) fn check(&self, photographs: usize) -> Result<()> {
        let given = [
            ("pyramids", self.photometric.map(|input| input.pyramids.len())),
            ("lists of lines", self.straight.map(|input| input.lines.len())),
            ("lists of chains", self.structure.map(|input| input.chains.len())),
        ];
        for (what, given) in given {
            if let Some(given) = given.filter(|&given| given != photographs) {
                let reason = format!("{given} are given for {photographs} photographs");
                return Err(Error::input(what, reason, "Give one for every photograph."));
            }
        }
        Ok(())
    }
}
