//! Warp, correct and blend: the full-resolution photographs onto the canvas.
//!
//! With seams (the default), the canvas is finished in tiles; see [`Blend`]. Without, photographs are decoded as many at a
//! time as the current thread pool has threads, then added to the canvas one after the other, each in parallel over bands
//! of rows. Both give the same bits for any number of threads.

mod answering;
mod fill;
mod layer;
mod panorama;
pub(crate) mod plan;
pub(crate) mod prepared;
pub(crate) mod store;

pub use layer::{Layer, LayerRows, layer, layer_rows, layer_size};
pub use panorama::Panorama;
pub use plan::Resources;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::options::StageOptions;
use trueup_core::source::PhotographSource;
use trueup_core::{Error, Result, StageContext};

use crate::blend;
use crate::deformed_grid::{DeformedGrid, count_folded_triangles};
use crate::exposure::{Correction, Corrections};
use crate::layout::{CanvasLayout, Placed, check_mesh};
use crate::seam::{SeamOptions, small_size};
use crate::unwanted::{Covered, Unwanted};
use answering::Answering;
use plan::Plan;
use prepared::{Prepared, Scratch, check_photograph};
use store::Store;

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
        /// The photograph that the seams give it to, blended over the seams with its neighbors: contours over a few
        /// pixels, colors over many.
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
        /// evens out more of what differs in brightness and color.
        transition: f64 = 0.1, between(0.0, 1.0), "";
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
/// `corrections` holds one for each placed photograph, and the response by which they are read and the panorama is written.
/// A canvas pixel sees the photograph at exactly one position, found by
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
    corrections: &Corrections,
    photographs: &dyn PhotographSource,
    options: &RenderOptions,
    seams: &SeamOptions,
    context: &StageContext,
) -> Result<Panorama> {
    run_within(&Resources::unlimited(), layout, corrections, photographs, (options, seams), context)
}

/// [`run`] within so much memory. A canvas that does not fit into its share goes to a scratch file, and photographs are
/// decoded again where they cannot be kept; the panorama is the same to the last bit.
///
/// # Errors
/// As [`run`]; [`Error::Limits`] with the numbers, before any photograph is decoded, if memory or disk do not suffice.
pub fn run_within(
    resources: &Resources<'_>,
    layout: &CanvasLayout,
    corrections: &Corrections,
    photographs: &dyn PhotographSource,
    (options, seams): (&RenderOptions, &SeamOptions),
    context: &StageContext,
) -> Result<Panorama> {
    check(layout, corrections, options)?;
    seams.check()?;
    let photographs = &Answering::new(photographs, &corrections.response)?;
    let corrections = &corrections.photographs;
    let size = [layout.width, layout.height];
    let plan = Plan::new(layout, photographs, options, seams, resources)?;
    report_folds(layout, context);
    let cut = options.blend == Blend::None;
    match options.blend {
        Blend::MultiBand | Blend::None if !layout.placed.is_empty() => {
            let blended = blend::run(layout, corrections, photographs, (options, seams), (cut, &plan), context)?;
            Ok(Panorama::from_roots(size, blended.pixels, blended.seams, photographs.encoding()))
        }
        _ => {
            let sums = mean(layout, corrections, photographs, (options, seams), &plan, context)?;
            Ok(Panorama::from_sums(size, sums, photographs.encoding()))
        }
    }
}

/// The weighted mean of all photographs at every pixel: sums over as many rows at once as there is memory for.
fn mean(
    layout: &CanvasLayout,
    corrections: &[Correction],
    photographs: &dyn PhotographSource,
    (options, seams): (&RenderOptions, &SeamOptions),
    plan: &Plan,
    context: &StageContext,
) -> Result<Store<[f32; 4]>> {
    let (layout, originals) = layout.unrolled(0);
    let (width, height) = (layout.width, layout.height);
    let curve = photographs.transfer_curve();
    let shown_elsewhere = Covered::find(&layout, photographs, small_size([width, height], false, seams)).map(Arc::new);
    let part_rows = plan.sum_rows(width, BAND_ROWS);
    let parts: Vec<Range<usize>> =
        (0..height).step_by(part_rows).map(|first| first..first.saturating_add(part_rows).min(height)).collect();
    let covered = covered_rows(&layout);
    let meet = |a: &Range<usize>, b: &Range<usize>| a.start < b.end && b.start < a.end;
    let covering =
        |part: &Range<usize>| -> Vec<usize> { (0..covered.len()).filter(|&at| meet(&covered[at], part)).collect() };
    let covering: Vec<Vec<usize>> = parts.iter().map(covering).collect();
    context.progress().begin(STAGE, covering.iter().map(Vec::len).sum::<usize>() as u64);
    let mut store = plan.on_disk().then(|| plan.store([width, height], [width, BAND_ROWS]));
    for (part, covering) in parts.into_iter().zip(covering) {
        let mut sums = vec![[0.0; 4]; width * part.len()];
        for group in covering.chunks(plan.at_a_time) {
            context.check_cancelled()?;
            let prepared: Vec<Prepared<'_>> = group
                .par_iter()
                .map(|&at| {
                    let placed = &layout.placed[at];
                    let photograph = photographs.photograph(placed.photograph)?;
                    check_photograph(placed, &photograph)?;
                    let photograph = Cow::Owned(photograph);
                    let (size, light) = ([width, height], (&curve, &corrections[originals[at]]));
                    let masks = photographs.masks(placed.photograph);
                    Ok(Prepared::new(photograph, &placed.mesh, size, light, options).without(Unwanted::new(
                        &masks,
                        shown_elsewhere.as_ref(),
                        size,
                    )))
                })
                .collect::<Result<_>>()?;
            sums.par_chunks_mut(width * BAND_ROWS).enumerate().try_for_each(|(band, sums)| {
                context.check_cancelled()?;
                let first = part.start + band * BAND_ROWS;
                let rows = first..first + sums.len() / width;
                let mut scratch = Scratch::default();
                for picture in &prepared {
                    picture.add_to_band(&rows, sums, width, options, &mut scratch);
                }
                Ok(())
            })?;
            context.progress().advance(STAGE, group.len() as u64);
        }
        match &mut store {
            // All rows at once.
            None => store = Some(Store::of_pixels(width, sums)),
            Some(store) => {
                for (band, sums) in sums.chunks(width * BAND_ROWS).enumerate() {
                    let first = part.start + band * BAND_ROWS;
                    store.put(&(0..width), &(first..first + sums.len() / width), sums)?;
                }
            }
        }
    }
    context.progress().finish(STAGE);
    Ok(store.unwrap_or_else(|| Store::in_memory([width, height])))
}

/// The rows of the canvas that each photograph may cover.
fn covered_rows(layout: &CanvasLayout) -> Vec<Range<usize>> {
    let rows = |placed: &Placed| {
        let rows = DeformedGrid::new(&placed.mesh, 1.0, true, layout.width, layout.height).rows;
        // Reduced photographs have the same grid but for rounding.
        rows.start.saturating_sub(1)..(rows.end + 1).min(layout.height)
    };
    layout.placed.par_iter().map(rows).collect()
}

fn check(layout: &CanvasLayout, corrections: &Corrections, options: &RenderOptions) -> Result<()> {
    options.check()?;
    let corrections = &corrections.photographs;
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

fn report_folds(layout: &CanvasLayout, context: &StageContext) {
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

#[cfg(test)]
mod grid_tests;
#[cfg(test)]
mod row_tests;
#[cfg(test)]
pub(crate) mod test_pictures;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod within_tests;
