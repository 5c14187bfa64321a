//! What can be rendered, and what is said of it before.

use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::options::StageOptions;
use trueup_core::{Error, Result, StageContext};

use super::input::RenderInput;
use crate::deformed_grid::count_folded_triangles;
use crate::layout::{CanvasLayout, check_mesh};
use crate::light::Correction;
use crate::render_options::RenderOptions;

/// Refuses what cannot be rendered.
pub(super) fn check(input: &RenderInput<'_>, options: &RenderOptions) -> Result<()> {
    options.check()?;
    let (layout, corrections) = (input.layout, &input.corrections.photographs);
    layout.placed.iter().try_for_each(check_mesh)?;
    if corrections.len() != layout.placed.len() {
        return Err(Error::input(
            "gains",
            format!("{} corrections for {} photographs", corrections.len(), layout.placed.len()),
            "Give one for each photograph.",
        ));
    }
    corrections.iter().try_for_each(Correction::check)?;
    let pixels = layout.width.checked_mul(layout.height).filter(|&pixels| pixels > 0);
    if pixels.is_none_or(|pixels| pixels > isize::MAX as usize / size_of::<[f32; 4]>()) {
        return Err(Error::input(
            "canvas",
            format!("{} x {} px are not a canvas", layout.width, layout.height),
            "Lower canvas.scale or canvas.max_pixels.",
        ));
    }
    Ok(())
}

/// Reports the grids that are folded.
pub(super) fn report_folds(layout: &CanvasLayout, context: &StageContext) {
    for placed in &layout.placed {
        let folded = count_folded_triangles(&placed.mesh);
        if folded > 0 {
            let triangles = 2 * (placed.mesh.rows - 1) * (placed.mesh.columns - 1);
            context.report(Diagnostic::warning(
                "grid-folded",
                Subject::Photograph(placed.photograph),
                format!("{folded} of {triangles} triangles of its grid are folded over"),
                "The photograph may not fit the others: leave it out, or try another method.",
            ));
        }
    }
}
