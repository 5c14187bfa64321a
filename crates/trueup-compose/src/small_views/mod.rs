//! Every photograph read once and made small: for the search of the seams, and for the coarse levels of the blend.

mod coarse_level;
mod coarse_levels;
mod making;
mod sampling;
mod size;
mod view;

use std::borrow::Cow;
use std::sync::Arc;

use rayon::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::options::StageOptions;
use trueup_core::raster::Photograph;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use crate::crop::{BorderDeviations, CellsAhead};
use crate::ignored::ShownElsewhere;
use crate::layout::{Placed, TURNS, Unrolled};
use crate::light::{Correction, LocalExposure, PhotographLight};
use crate::memory_plan::MemoryPlan;
use crate::render_options::RenderOptions;
use crate::transfer_curve::EncodeRoots;
use crate::warped::{Resampling, WarpedPhotograph, check_photograph};
use coarse_level::CoarseLevelInput;
use making::small_view;
use sampling::{HALVING, scaled};

pub(crate) use coarse_level::{CoarseLevel, RIM};
pub(crate) use coarse_levels::{CoarseLevels, SAMPLE_BYTES};
pub(crate) use size::{COARSE_PIXELS, small_size};
pub(crate) use view::luma;
pub use view::{CLIPPED, IGNORED, KEPT, PARTLY, SmallPixel, SmallView, WHOLLY};

/// The photographs that are made small.
#[derive(Clone, Copy)]
pub(crate) struct SmallViewsInput<'a> {
    /// Where they lie.
    pub(crate) unrolled: &'a Unrolled<'a>,
    /// One for each photograph of the layout that was unrolled.
    pub(crate) corrections: &'a [Correction],
    /// What is done to the light of all of them, over the layout that was unrolled.
    pub(crate) local: Option<&'a LocalExposure>,
    pub(crate) photographs: &'a dyn PhotographSource,
    /// Log2 of the canvas pixels per sample of the coarse levels; `None` if there are to be none.
    pub(crate) first_level: Option<u32>,
    /// The border at which a frame is chosen; `None` if none is.
    pub(crate) border: Option<BorderInput<'a>>,
    pub(crate) plan: &'a MemoryPlan,
}

/// How the photographs are looked at for a frame.
#[derive(Clone, Copy)]
pub(crate) struct BorderInput<'a> {
    pub(crate) cells: &'a CellsAhead,
    /// How they will be read for the panorama, and how that is written.
    pub(crate) resampling: &'a Resampling,
    pub(crate) encode: &'a EncodeRoots,
}

/// What comes of reading every photograph once.
pub(crate) struct SmallViews {
    /// For the seams; empty boxes for a single photograph.
    pub(crate) views: Vec<SmallView>,
    /// Size of their canvas.
    pub(crate) size: [usize; 2],
    /// For the blend; empty boxes without coarse levels.
    pub(crate) coarse_levels: CoarseLevels,
    /// Of each photograph, for the frame; empty if none is chosen.
    pub(crate) border: Vec<BorderDeviations>,
    /// Decoded photographs.
    pub(crate) decoded: DecodedPhotographs,
}

/// Photographs that are decoded already.
pub(crate) struct DecodedPhotographs {
    /// The photographs, as far as there was room for them.
    pub(crate) kept: Vec<Option<Photograph>>,
    /// Bytes of each.
    pub(crate) bytes: Vec<usize>,
}

/// What is made of one photograph.
struct MadeSmall {
    view: SmallView,
    /// One for each of its placements.
    coarse_levels: Vec<CoarseLevel>,
    border: BorderDeviations,
    photograph: Photograph,
}

/// Makes the small views. Progress counts photographs, of a stage that the caller begins.
///
/// # Errors
/// [`trueup_core::Error::Input`] if a photograph does not fit its grid; [`trueup_core::Error::Cancelled`]; what the
/// photographs and a scratch file return.
pub(crate) fn run(input: &SmallViewsInput<'_>, context: &StageContext) -> Result<SmallViews> {
    let &SmallViewsInput { unrolled, corrections, photographs, plan, .. } = input;
    let layout = unrolled.original_layout();
    let curve = photographs.transfer_curve();
    let elsewhere = ShownElsewhere::find(unrolled.layout(), photographs, small_size(unrolled.canvas(), false));
    let making = Making {
        input,
        curve: &curve,
        size: small_size([layout.width, layout.height], layout.period.is_some()),
        elsewhere: elsewhere.map(Arc::new),
    };
    let mut coarse_levels = CoarseLevels::new(plan.coarse_levels.clone());
    let (mut views, mut border) = (Vec::new(), Vec::new());
    let mut decoded = DecodedPhotographs { kept: Vec::new(), bytes: Vec::new() };
    let mut room = plan.photographs;
    let at_a_time = plan.at_a_time;
    for (chunk, (placed, corrections)) in layout.placed.chunks(at_a_time).zip(corrections.chunks(at_a_time)).enumerate()
    {
        context.check_cancelled()?;
        let made: Vec<MadeSmall> = placed
            .par_iter()
            .zip(corrections)
            .enumerate()
            .map(|(index, (placed, correction))| {
                let made = making.make(chunk * at_a_time + index, placed, correction)?;
                context.progress().advance(RenderOptions::STAGE, 1);
                Ok(made)
            })
            .collect::<Result<_>>()?;
        for made in made {
            views.push(made.view);
            border.push(made.border);
            made.coarse_levels.into_iter().try_for_each(|level| coarse_levels.push(level))?;
            let bytes = made.photograph.bytes();
            let fits = bytes <= room;
            room -= if fits { bytes } else { 0 };
            decoded.bytes.push(bytes);
            decoded.kept.push(fits.then_some(made.photograph));
        }
    }
    Ok(SmallViews { views, size: making.size, coarse_levels, border, decoded })
}

/// What is the same for all photographs.
struct Making<'a> {
    input: &'a SmallViewsInput<'a>,
    curve: &'a TransferCurve,
    /// Size of the canvas of the small views.
    size: [usize; 2],
    elsewhere: Option<Arc<ShownElsewhere>>,
}

impl Making<'_> {
    /// Makes the photograph at a position of the layout small.
    fn make(&self, position: usize, placed: &Placed, correction: &Correction) -> Result<MadeSmall> {
        let &SmallViewsInput { unrolled, photographs, first_level, local, .. } = self.input;
        let layout = unrolled.original_layout();
        let canvas = [layout.width, layout.height];
        let period = layout.period.map(|_| self.size[0]);
        let clip = [self.size[0] * if period.is_some() { TURNS } else { 1 }, self.size[1]];
        let photograph = photographs.photograph(placed.photograph)?;
        check_photograph(placed, &photograph)?;
        // The larger picture first: the smaller is made from what is left of the photograph then.
        let first = placed.in_first_turn(layout.period);
        let mesh = scaled(&first.mesh, [0, 1].map(|axis| self.size[axis] as f64 / canvas[axis] as f64), 0.0);
        let canvas_px = [0, 1].map(|axis| canvas[axis] as f64 / self.size[axis] as f64);
        let local_small = local.map(|local| local.over(canvas_px, [0.0; 2]));
        let light = PhotographLight { curve: self.curve, correction, local: local_small.as_ref() };
        let warped = WarpedPhotograph::new(Cow::Borrowed(&photograph), &mesh, clip, light, &HALVING);
        let masks = photographs.masks(placed.photograph);
        let view = match layout.placed.len() {
            1 => SmallView::default(),
            _ => small_view(&warped, &masks, period),
        };
        let local_unrolled = local.map(|local| local.led_by(unrolled.lead()));
        let light = PhotographLight { local: local_unrolled.as_ref(), ..light };
        let coarse_level = |placement: usize| match first_level {
            Some(first_level) => CoarseLevel::new(&CoarseLevelInput {
                larger: &warped,
                placed: &unrolled.placed()[placement],
                light,
                canvas: unrolled.canvas(),
                first_level,
                masks: &masks,
                elsewhere: self.elsewhere.as_ref(),
            }),
            None => CoarseLevel::default(),
        };
        let coarse_levels = unrolled.placements(position).map(coarse_level).collect();
        drop(warped);
        let border = self.border(&first, &photograph, correction);
        Ok(MadeSmall { view, coarse_levels, border, photograph })
    }

    /// What the photograph, placed in the first turn, alone shows at the border.
    fn border(&self, placed: &Placed, photograph: &Photograph, correction: &Correction) -> BorderDeviations {
        let Some(BorderInput { cells, resampling, encode }) = self.input.border else { return Vec::new() };
        let layout = self.input.unrolled.original_layout();
        let clip = [layout.width * if layout.period.is_some() { TURNS } else { 1 }, layout.height];
        let light = PhotographLight { curve: self.curve, correction, local: self.input.local };
        let photograph = Cow::Borrowed(photograph);
        cells.border(&WarpedPhotograph::new(photograph, &placed.mesh, clip, light, resampling), resampling, encode)
    }
}
