//! What composing may take, and who helps.

use trueup_core::scratch::{NoScratch, ScratchSpace};

use super::helpers::RenderHelpers;
use crate::memory_plan::Allowed;

/// What composing may take.
#[derive(Clone, Copy)]
pub struct Resources<'a> {
    /// Bytes of memory for the photographs, the canvas and all that is made on the way.
    pub memory: usize,
    /// Bytes that may be taken where `memory` is too little to compose at all; `memory` itself if that is the user's
    /// word and the program takes no more beside than it is counted with.
    pub ceiling: usize,
    /// Where the canvas goes if it does not fit.
    pub scratch: &'a dyn ScratchSpace,
    /// Others who do a part of the work, if there are any.
    pub helpers: Option<&'a dyn RenderHelpers>,
}

impl Resources<'_> {
    /// Without the helpers.
    pub(crate) fn allowed(&self) -> Allowed<'_> {
        let Self { memory, ceiling, scratch, .. } = *self;
        Allowed { memory, ceiling, scratch }
    }
}

impl std::fmt::Debug for Resources<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { memory, ceiling, .. } = self;
        formatter.debug_struct("Resources").field("memory", memory).field("ceiling", ceiling).finish_non_exhaustive()
    }
}

impl Resources<'static> {
    /// Everything is held in memory, however much that is.
    pub fn unlimited() -> Self {
        Self { memory: usize::MAX, ceiling: usize::MAX, scratch: &NoScratch, helpers: None }
    }
}
