//! The vanishing directions of every photograph.

use rayon::prelude::*;
use trueup_align::cameras::Cameras;
use trueup_align::vanishing::{self, TriadOutcome, VanishingOptions};
use trueup_core::lines::LineSegment;
use trueup_core::{Result, StageContext};

use super::component::{Component, name_seed};

const STAGE: &str = "vanishing points";

/// Searches the lines of every photograph for three orthogonal directions.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub(super) fn run(
    component: &Component,
    lines: &[Vec<LineSegment>],
    cameras: &Cameras,
    options: &VanishingOptions,
    context: &StageContext,
) -> Result<Vec<TriadOutcome>> {
    context.progress().begin(STAGE, component.frames.len() as u64);
    let find = |k: usize| {
        context.check_cancelled()?;
        // Seeded by the photograph's own content-independent name, so that the order of inputs does not matter.
        let mut generator = context.generator(STAGE, name_seed(&component.images[k].path));
        let (lines, camera) = (&lines[k], &cameras.cameras[k]);
        let found = vanishing::detect_triad(lines, camera, &component.frames[k], options, &mut generator);
        context.progress().advance(STAGE, 1);
        Ok(found)
    };
    let triads = context.time(STAGE, || (0..component.frames.len()).into_par_iter().map(find).collect());
    context.progress().finish(STAGE);
    triads
}
