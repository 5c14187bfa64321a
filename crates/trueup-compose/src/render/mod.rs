//! Warp, correct and blend: the full-resolution photographs onto the canvas.
//!
//! With seams (the default), the canvas is finished in tiles; see [`Blend`]. Without, photographs are decoded as many at a
//! time as the current thread pool has threads, then added to the canvas one after the other, each in parallel over bands
//! of rows. Both give the same bits for any number of threads.

mod layer;
mod panorama;
pub(crate) mod prepared;

pub use layer::{Layer, layer};
pub use panorama::Panorama;

use std::borrow::Cow;

use rayon::prelude::*;
use trueup_core::diagnostics::Diagnostic;
use trueup_core::options::StageOptions;
use trueup_core::source::PhotographSource;
use trueup_core::{Error, Result, StageContext};

use crate::blend;
use crate::deformed_grid::count_folded_triangles;
use crate::exposure::Correction;
use crate::layout::{CanvasLayout, check_mesh};
use crate::seam::SeamOptions;
use prepared::{Prepared, Scratch, check_photograph};

const STAGE: &str = RenderOptions::STAGE;

/// Rows of the canvas that one task renders; large enough to find its cells once, small enough to share evenly.
const BAND_ROWS: usize = 16;

trueup_core::choice! {
    /// How a photograph is read between its samples.
    pub enum Interpolation {
        /// Two samples along each axis: soft, never rings.
        Bilinear = "bilinear",
        /// Four samples along each axis (Catmull-Rom): keeps detail.
        Bicubic = "bicubic",
    }
}

trueup_core::choice! {
    /// What a canvas pixel shows where photographs overlap.
    pub enum Blend {
        /// The photograph that the seams give it to, blended over the seams with its neighbours: contours over a few
        /// pixels, colours over many.
        MultiBand = "multiband",
        /// The mean of all, each weighted by its distance from its own border.
        Feather = "feather",
        /// The plain mean of all: shows misalignment best.
        Average = "average",
        /// The photograph that the seams give it to, alone: shows every seam.
        None = "none",
    }
}

trueup_core::options! {
    /// How the photographs become one picture.
    pub struct RenderOptions("render") {
        /// How a photograph is read between its samples.
        interpolation: Interpolation = Interpolation::Bicubic, Allowed::Any, "";
        /// What a pixel shows where photographs overlap.
        blend: Blend = Blend::MultiBand, Allowed::Any, "";
        /// Widest transition of multi-band blending, as a share of the photographs' shorter side on the canvas. Higher
        /// evens out more of what differs in brightness and colour.
        transition: f64 = 0.25, between(0.0, 1.0), "";
        /// Decoded photographs are kept up to this much memory between the search of the seams and the blending, so that
        /// they need not be decoded again.
        kept_photographs: f64 = 512.0, between(0.0, 1000000.0), "MB";
        /// Power of the feather weight. Higher values let the photograph that lies deepest prevail, which shortens the
        /// transition and with it ghosts; 1 blends over the whole overlap.
        feather_exponent: f64 = 3.0, between(0.1, 16.0), "";
        /// Photograph pixels per canvas pixel above which the photograph is averaged instead of interpolated. Lower is
        /// softer, higher lets fine patterns shimmer.
        minification_threshold: f64 = 1.25, between(1.0, 4.0), "";
    }
}

/// Renders the panorama: every photograph warped by its grid, corrected and blended.
///
/// `corrections` holds one for each placed photograph. A canvas pixel sees the photograph at exactly one position, found by
/// inverting the bilinear map of the cell that covers it; where a grid folds over itself, the later cell (row-major)
/// covers. Progress counts photographs, twice where seams are sought.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if corrections, grids and photographs do not fit together or the canvas is empty;
/// [`Error::Unsolvable`] if a vertex is not finite; [`Error::Cancelled`]; and what `photographs` returns.
///
/// # Departures
/// The published renderer splits cells into two triangles with an affine map each, which kinks straight lines along the
/// cells' diagonals; here the inverse is bilinear like the warp itself.
pub fn run(
    layout: &CanvasLayout,
    corrections: &[Correction],
    photographs: &dyn PhotographSource,
    options: &RenderOptions,
    seams: &SeamOptions,
    context: &StageContext,
) -> Result<Panorama> {
    check(layout, corrections, options)?;
    seams.check()?;
    report_folds(layout, context);
    let cut = options.blend == Blend::None;
    match options.blend {
        Blend::MultiBand | Blend::None if !layout.placed.is_empty() => {
            let blended = blend::run(layout, corrections, photographs, (options, seams), cut, context)?;
            Ok(Panorama::from_roots(layout.width, layout.height, blended.pixels, blended.seams))
        }
        _ => mean(layout, corrections, photographs, options, context),
    }
}

/// The weighted mean of all photographs at every pixel.
fn mean(
    layout: &CanvasLayout,
    corrections: &[Correction],
    photographs: &dyn PhotographSource,
    options: &RenderOptions,
    context: &StageContext,
) -> Result<Panorama> {
    let (layout, originals) = layout.unrolled(0);
    let (width, height) = (layout.width, layout.height);
    let mut sums = vec![[0.0; 4]; width * height];
    context.progress().begin(STAGE, layout.placed.len() as u64);
    let at_a_time = rayon::current_num_threads().max(1);
    for (placed, originals) in layout.placed.chunks(at_a_time).zip(originals.chunks(at_a_time)) {
        context.check_cancelled()?;
        let prepared: Vec<Prepared<'_>> = placed
            .par_iter()
            .zip(originals)
            .map(|(placed, &original)| {
                let correction = &corrections[original];
                let photograph = photographs.photograph(placed.photograph)?;
                check_photograph(placed, &photograph)?;
                Ok(Prepared::new(Cow::Owned(photograph), &placed.mesh, [width, height], correction, options))
            })
            .collect::<Result<_>>()?;
        sums.par_chunks_mut(width * BAND_ROWS).enumerate().try_for_each(|(band, sums)| {
            context.check_cancelled()?;
            let rows = band * BAND_ROWS..(band * BAND_ROWS + sums.len() / width);
            let mut scratch = Scratch::default();
            for picture in &prepared {
                picture.add_to_band(&rows, sums, width, options, &mut scratch);
            }
            Ok(())
        })?;
        context.progress().advance(STAGE, placed.len() as u64);
    }
    context.progress().finish(STAGE);
    Ok(Panorama::from_sums(width, height, sums))
}

fn check(layout: &CanvasLayout, corrections: &[Correction], options: &RenderOptions) -> Result<()> {
    options.check()?;
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
            format!("{} x {} px cannot be held in memory", layout.width, layout.height),
            "Lower canvas.scale or canvas.max_pixels.",
        ));
    }
    Ok(())
}

fn report_folds(layout: &CanvasLayout, context: &StageContext) {
    for placed in &layout.placed {
        let folded = count_folded_triangles(&placed.mesh);
        if folded > 0 {
            let triangles = 2 * (placed.mesh.rows - 1) * (placed.mesh.columns - 1);
            context.report(Diagnostic::warning(
                "grid-folded",
                format!("photograph {}", placed.photograph),
                format!("{folded} of {triangles} triangles of its grid are folded over"),
                "The photograph may not fit the others: leave it out, or try another method.",
            ));
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
