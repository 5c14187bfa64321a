//! Warp, correct and compose: the full-resolution photographs onto the canvas.
//!
//! With seams (the default), photographs are made small, seams are found between the small views, and the canvas is
//! finished in tiles along them; see [`Blend`]. Without, photographs are decoded as many at a time as memory and
//! threads allow, then added to the canvas one after the other, each in parallel over bands of rows. Both give the same
//! bits for any number of threads.

mod average;
mod checked;
mod divided;
mod fill;
mod grain;
mod helpers;
mod input;
mod layer;
mod panorama;
mod poles;
mod resources;

pub use crate::blend::{FinishedRegion, Region, RegionOf, RegionWork, TakeRegion};
pub use crate::render_options::{Blend, Interpolation, Look, RenderOptions};
pub use crate::small_views::TakeSmall;
pub use divided::{finish_region, make_small};
pub use helpers::{RenderHelpers, SmallWork};
pub use input::RenderInput;
pub use layer::{Layer, LayerRows, layer, layer_rows, layer_size};
pub use panorama::Panorama;
pub use resources::Resources;

use trueup_core::options::StageOptions;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use crate::blend::{self, BlendInput, Blending, WholeLevels};
use crate::coverage::Rectangle;
use crate::crop::{CellsAhead, Frame, Framing};
use crate::layout::{CanvasLayout, Unrolled};
use crate::light::{ByResponse, Correction, LocalExposure};
use crate::look;
use crate::memory_plan::{MemoryNeeds, MemoryPlan, photograph_bytes};
use crate::pyramid::first_level;
use crate::render_options::{Composition, Transition};
use crate::seam::{self, SeamInput, SeamOptions, Seams};
use crate::small_views::{self, BorderInput, SmallViews, SmallViewsInput, small_size};
use crate::store::{PixelStore, RootPixel};
use crate::unframed::Unframed;
use crate::warped::{Averaging, Resampling};
use crate::weights::Weighting;
use average::{AverageInput, Averaged};
use checked::{check, report_folds};

const STAGE: &str = RenderOptions::STAGE;

/// A panorama, and how it was composed.
#[derive(Debug)]
pub struct Rendered {
    /// The panorama.
    pub panorama: Panorama,
    /// The seams along which it was composed; `None` where photographs were averaged.
    pub seams: Option<Seams>,
    /// What of the canvas becomes the panorama, if that was decided: nothing else need be composed. `None` if all of it
    /// was.
    pub frame: Option<Frame>,
    /// Whether some photograph has an alpha channel: then all of the canvas was composed, no frame was chosen, and of
    /// what grids cover, [`Panorama::opaque_part`] is covered.
    pub has_alpha: bool,
}

/// Renders the panorama: every photograph warped by its grid, corrected and blended.
///
/// With a `framing`, what becomes of the canvas is decided as soon as the seams are known, if it can be, and what lies
/// outside of it, and is not read to fill its gaps, is not composed: it stays empty. What is composed is the same as
/// without. Where photographs are transparent shows when they are composed: with one that has an alpha channel,
/// `framing` decides nothing.
///
/// What does not fit into the memory of `resources` goes to a scratch file, and photographs are decoded again where
/// they cannot be kept; the panorama is the same to the last bit. A canvas pixel sees the photograph at exactly one
/// position, found by inverting the bilinear map of the cell that covers it; where a grid folds over itself, the later
/// cell (row-major) covers. Progress counts photographs, twice where seams are sought.
///
/// # Errors
/// [`trueup_core::Error::Options`]; [`trueup_core::Error::Input`] if corrections, grids and photographs do not fit
/// together or the canvas is empty; [`trueup_core::Error::Unsolvable`] if a vertex is not finite;
/// [`trueup_core::Error::Limits`] with the numbers, before any photograph is decoded, if memory or disk do not suffice;
/// [`trueup_core::Error::Cancelled`]; and what the photographs return.
///
/// # Departures
/// The published renderer splits cells into two triangles with an affine map each, which kinks straight lines along the
/// cells' diagonals; here the inverse is bilinear like the warp itself.
pub fn run(
    input: &RenderInput<'_>,
    resources: &Resources<'_>,
    options: &RenderOptions,
    seam_options: &SeamOptions,
    framing: Option<&Framing<'_>>,
    context: &StageContext,
) -> Result<Rendered> {
    seam_options.check()?;
    let &RenderInput { layout, corrections, .. } = input;
    let size = [layout.width, layout.height];
    Composing::within(input, resources, options, Holding::Everything, |composing| {
        report_folds(layout, context);
        if composing.local.is_some() {
            look::report(&corrections.photographs, options.look, context);
        }
        match composition(layout, options) {
            Composition::AlongSeams(_) => {
                let helpers = resources.helpers.filter(|_| layout.placed.len() > 1);
                let AlongSeams { pixels, seams, frame, has_alpha } =
                    composing.along_seams(options, seam_options, framing, helpers, context)?;
                let panorama = Panorama::from_roots(size, pixels, composing.photographs.encoding());
                Ok(Rendered { panorama, seams: Some(seams), frame, has_alpha })
            }
            Composition::Averaged(weighting) => {
                let averaging = Averaging { resampling: Resampling::of(options.interpolation), weighting };
                let Averaged { sums, has_alpha } = composing.averaged(averaging, context)?;
                let panorama = Panorama::from_sums(size, sums, composing.photographs.encoding());
                Ok(Rendered { panorama, seams: None, frame: None, has_alpha })
            }
        }
    })
}

/// How the photographs of a layout are composed: as the blend says, but for an empty canvas, which has no seams.
fn composition(layout: &CanvasLayout, options: &RenderOptions) -> Composition {
    match layout.placed.is_empty() {
        true => Composition::Averaged(Weighting::Equal),
        false => options.blend.composition(),
    }
}

/// The levels that are blended as a whole, if any.
fn whole_levels(layout: &CanvasLayout, options: &RenderOptions) -> Option<WholeLevels> {
    let bands = match composition(layout, options) {
        Composition::AlongSeams(Transition::Bands) => layout.placed.len() > 1,
        Composition::AlongSeams(Transition::Cut) | Composition::Averaged(_) => false,
    };
    bands.then(|| WholeLevels::of(layout, options.transition))
}

/// The cells in which a frame is chosen before anything is composed; `None` if it cannot be.
fn ahead(layout: &CanvasLayout, framing: &Framing<'_>) -> Option<CellsAhead> {
    // Of a single photograph there is no small view.
    let several = layout.placed.len() > 1;
    let small = small_size([layout.width, layout.height], layout.period.is_some());
    several.then(|| CellsAhead::new(layout, framing.coverage, small)).flatten()
}

/// The parts of a canvas that are to be finished.
fn to_finish(layout: &CanvasLayout, framing: Option<&Framing<'_>>, frame: Option<&Frame>) -> Vec<Rectangle> {
    let (Some(framing), Some(Frame::Part(kept))) = (framing, frame) else {
        return vec![Rectangle::whole([layout.width, layout.height])];
    };
    let beside_gaps = framing.gaps(layout, kept).map(|gaps| fill::read_for(&gaps)).unwrap_or_default();
    std::iter::once(kept.clone()).chain(beside_gaps).collect()
}

/// The canvas on which the photographs of a layout are made small and blended.
fn unrolled<'a>(layout: &'a CanvasLayout, levels: Option<WholeLevels>) -> Result<Unrolled<'a>> {
    Unrolled::new(layout, first_level([layout.width, layout.height]), levels.map(|levels| levels.above))
}

/// Bytes that composing takes.
fn memory_needs(
    layout: &CanvasLayout,
    photographs: &dyn PhotographSource,
    options: &RenderOptions,
) -> Result<MemoryNeeds> {
    let bytes = photograph_bytes(layout, photographs);
    let (work, in_parts) = match composition(layout, options) {
        Composition::AlongSeams(_) => {
            let levels = whole_levels(layout, options);
            let (work, in_parts) = blend::needed_bytes(&unrolled(layout, levels)?, levels, &bytes);
            (work, Some(in_parts))
        }
        Composition::Averaged(_) => (average::needed_bytes(layout.width), None),
    };
    Ok(MemoryNeeds::new(layout, bytes, work, in_parts))
}

/// Photographs that are composed within a plan.
struct Composing<'a> {
    layout: &'a CanvasLayout,
    corrections: &'a [Correction],
    local: Option<&'a LocalExposure>,
    photographs: &'a ByResponse<'a>,
    plan: &'a MemoryPlan,
}

/// A panorama that was composed along seams.
struct AlongSeams {
    pixels: PixelStore<RootPixel>,
    seams: Seams,
    /// As in [`Rendered`].
    frame: Option<Frame>,
    has_alpha: bool,
}

/// What composing holds of the panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Holding {
    /// The canvas, and all photographs' own coarse levels.
    Everything,
    /// A few tiles.
    APart,
}

impl Composing<'_> {
    /// What `work` makes of photographs that are composed within a plan.
    ///
    /// # Errors
    /// Those of [`run`] before photographs are read; those of `work`.
    fn within<T>(
        input: &RenderInput<'_>,
        resources: &Resources<'_>,
        options: &RenderOptions,
        holding: Holding,
        work: impl FnOnce(&Composing<'_>) -> Result<T>,
    ) -> Result<T> {
        check(input, options)?;
        let &RenderInput { layout, corrections, photographs } = input;
        let photographs = &Unframed(photographs);
        let photographs = &ByResponse::new(photographs, corrections)?;
        let needs = memory_needs(layout, photographs, options)?;
        let needs = if holding == Holding::APart { needs.of_a_part() } else { needs };
        let plan = &MemoryPlan::new(&needs, &resources.allowed())?;
        let local = photographs.local_exposure(layout, options.look);
        let corrections = photographs.corrections();
        work(&Composing { layout, corrections, local: local.as_ref(), photographs, plan })
    }

    /// Small views, seams, frame, blend; with `helpers`, these make the photographs small and finish the canvas.
    fn along_seams(
        &self,
        options: &RenderOptions,
        seam_options: &SeamOptions,
        framing: Option<&Framing<'_>>,
        helpers: Option<&dyn RenderHelpers>,
        context: &StageContext,
    ) -> Result<AlongSeams> {
        let &Self { layout, corrections, local, photographs, plan } = self;
        let levels = whole_levels(layout, options);
        let unrolled = &unrolled(layout, levels)?;
        let resampling = Resampling::of(options.interpolation);
        let encoding = photographs.encoding();
        let mut frame = framing.and_then(|framing| framing.without_panorama(layout));
        let ahead = framing.filter(|_| frame.is_none()).and_then(|framing| ahead(layout, framing));
        // Small views, and the photographs themselves wherever they are placed.
        context.progress().begin(STAGE, (layout.placed.len() + unrolled.placed().len()) as u64);
        let first_level = levels.map(|levels| levels.first_level);
        let border =
            ahead.as_ref().map(|cells| BorderInput { cells, resampling: &resampling, encode: &encoding.roots });
        let view_levels = encoding.view_levels();
        let input =
            SmallViewsInput { unrolled, corrections, local, photographs, view_levels, first_level, border, plan };
        let small = match helpers {
            None => small_views::run(&input, context)?,
            Some(helpers) => {
                let work = SmallWork { border: ahead.clone() };
                let make_small = |positions: &[usize], take: TakeSmall<'_>| helpers.make_small(&work, positions, take);
                small_views::run_elsewhere(&input, make_small, context)?
            }
        };
        let SmallViews { views, size, coarse_levels, border, decoded, has_alpha } = small;
        let framing = framing.filter(|_| !has_alpha);
        let ahead = ahead.filter(|_| !has_alpha);
        frame = frame.filter(|_| !has_alpha);
        if let Some((framing, frame)) = framing.zip(frame.as_ref()) {
            framing.check_size(frame, layout)?;
        }
        let seams = match views.len() {
            1 => Seams::of_one(size[0], size[1]),
            _ => {
                let input = SeamInput { views: &views, size, around: layout.period.is_some() };
                seam::run(&input, seam_options, context)?
            }
        };
        let cells = ahead.map(|ahead| ahead.cut(&views, &border, &seams));
        drop(views);
        let input = BlendInput {
            unrolled,
            corrections,
            local,
            photographs,
            resampling,
            seams: &seams,
            coarse_levels,
            levels,
            decoded,
            plan,
        };
        let blending = Blending::new(input)?;
        if let Some((framing, cells)) = framing.zip(cells) {
            let changes = blending.changes(&cells.places())?;
            let chosen = framing.of_cells(&cells.blended(&changes, &encoding), layout);
            framing.check_size(&chosen, layout)?;
            frame = Some(chosen);
        }
        let parts = to_finish(layout, framing, frame.as_ref());
        let pixels = match helpers {
            None => blending.finish(&parts, context)?,
            Some(helpers) => {
                let finish = |work: &RegionWork, count: usize, region: RegionOf<'_>, take: TakeRegion<'_>| {
                    helpers.finish(work, count, region, take)
                };
                blending.finish_elsewhere(&parts, finish, context)?
            }
        };
        context.progress().finish(STAGE);
        Ok(AlongSeams { pixels, seams, frame, has_alpha })
    }

    /// Means of all photographs.
    fn averaged(&self, averaging: Averaging, context: &StageContext) -> Result<Averaged> {
        let &Self { layout, corrections, local, photographs, plan } = self;
        average::run(&AverageInput { layout, corrections, local, photographs, averaging, plan }, context)
    }
}

#[cfg(test)]
mod alpha_tests;
#[cfg(test)]
mod divided_tests;
#[cfg(test)]
mod frame_tests;
#[cfg(test)]
mod grid_tests;
#[cfg(test)]
mod plan_tests;
#[cfg(test)]
mod row_tests;
#[cfg(test)]
pub(crate) mod test_rendering;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod within_tests;
