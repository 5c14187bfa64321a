//! What a mesh is refined by.

use trueup_core::Result;

use super::input::an_entry_each;
use super::line_alignment::{LineAlignmentInput, StraightInput};
use super::photometric::PhotometricInput;

/// Energies beyond those of the plain mesh; by default none.
#[derive(Debug, Clone, Copy, Default)]
pub struct Refinements<'a> {
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
        if let Some(input) = &self.photometric {
            an_entry_each("pyramids", input.pyramids.len(), photographs)?;
        }
        match &self.straight {
            Some(input) => an_entry_each("lists of lines", input.lines.len(), photographs),
            None => Ok(()),
        }
    }
}
