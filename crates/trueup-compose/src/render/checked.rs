//! What can be rendered, and what is said of it before.

use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::options::StageOptions;
use trueup_core::{Error, Result, StageContext};

use super::input::RenderInput;
use crate::deformed_grid::count_folded_triangles;
use crate::layout::{CanvasLayout, Placed, check_mesh};
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

/// Share of a grid's triangles from which folds are seen: of fewer, most lie where another photograph is shown.
const SEEN_FOLDS: f64 = 0.01;

/// Reports the grids that are folded: the worst with a warning if its folds may be seen, the others with notes.
pub(super) fn report_folds(layout: &CanvasLayout, context: &StageContext) {
    let folded = |placed: &Placed| {
        let triangles = 2 * (placed.mesh.rows - 1) * (placed.mesh.columns - 1);
        Folds { photograph: placed.photograph, folded: count_folded_triangles(&placed.mesh), triangles }
    };
    let mut folds: Vec<Folds> = layout.placed.iter().map(folded).filter(|folds| folds.folded > 0).collect();
    folds.sort_by(|one, other| other.share().total_cmp(&one.share()));
    let seen = folds.iter().filter(|folds| folds.share() >= SEEN_FOLDS).count();
    for (rank, folds) in folds.iter().enumerate() {
        let subject = Subject::Photograph(folds.photograph);
        let mut message = format!("{} of {} triangles of its grid are folded over", folds.folded, folds.triangles);
        if rank > 0 || seen == 0 {
            context.report(Diagnostic::note("grid-folded", subject, message, ""));
            continue;
        }
        if seen > 1 {
            message += &format!(", and parts of {} other grids", seen - 1);
        }
        let hint = "Look at it there. The photograph may not fit the others: leave it out, or try another method.";
        context.report(Diagnostic::warning("grid-folded", subject, message, hint));
    }
}

/// Folds of a photograph's grid.
struct Folds {
    photograph: usize,
    folded: usize,
    triangles: usize,
}

impl Folds {
    fn share(&self) -> f64 {
        self.folded as f64 / self.triangles.max(1) as f64
    }
}
