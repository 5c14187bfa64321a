//! What is rendered.

use trueup_core::source::PhotographSource;

use crate::layout::CanvasLayout;
use crate::light::Corrections;

/// Photographs, and where they lie in which light.
#[derive(Clone, Copy)]
pub struct RenderInput<'a> {
    /// Where the photographs lie.
    pub layout: &'a CanvasLayout,
    /// One correction for each of [`CanvasLayout::placed`], and the response by which the photographs are read and the
    /// panorama is written.
    pub corrections: &'a Corrections,
    /// The photographs at full resolution.
    pub photographs: &'a dyn PhotographSource,
}

impl std::fmt::Debug for RenderInput<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { layout, corrections, .. } = self;
        formatter
            .debug_struct("RenderInput")
            .field("layout", layout)
            .field("corrections", corrections)
            .finish_non_exhaustive()
    }
}
