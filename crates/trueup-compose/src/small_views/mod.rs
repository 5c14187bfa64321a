//! Every photograph read once and made small: for the search of the seams, and for the coarse levels of the blend.

mod coarse_level;
mod coarse_levels;
mod making;
mod sampling;
mod size;
mod view;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::color::TransferCurve;
use trueup_core::options::StageOptions;
use trueup_core::raster::Photograph;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use crate::crop::{BorderDeviations, CellsAhead};
use crate::handed_over::not_asked_for;
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
pub use view::{CLIPPED, IGNORED, KEPT, PARTLY, SmallPixel, SmallView, WHOLLY};
pub(crate) use view::{Depths, WHOLE_LACK, luma};

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
    /// Levels of the views by their roots, where these are not the levels; see
    /// [`Encoding::view_levels`](crate::transfer_curve::Encoding::view_levels).
    pub(crate) view_levels: Option<&'a EncodeRoots>,
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
    /// Whether one of them has an alpha channel.
    pub(crate) has_alpha: bool,
}

/// Photographs that are decoded already.
pub(crate) struct DecodedPhotographs {
    /// The photographs, as far as there was room for them.
    pub(crate) kept: Vec<Option<Photograph>>,
    /// Bytes of each.
    pub(crate) bytes: Vec<usize>,
}

/// What is made of one photograph.
#[derive(Debug, Serialize, Deserialize)]
pub struct MadeSmall {
    view: SmallView,
    /// One for each of its placements.
    coarse_levels: Vec<CoarseLevel>,
    border: BorderDeviations,
    /// Bytes of the decoded photograph.
    bytes: usize,
    /// Whether it has an alpha channel.
    has_alpha: bool,
}

/// Bytes of a decoded pixel, at most: four channels of 16 bits.
const MOST_PIXEL_BYTES: f64 = 8.0;

impl MadeSmall {
    /// Whether it can have been made of the photograph at a position: boxes lie on their canvases and have their
    /// pixels.
    fn fits(&self, input: &SmallViewsInput<'_>, position: usize) -> bool {
        let unrolled = input.unrolled;
        let layout = unrolled.original_layout();
        let lies_within = |range: &Range<usize>, length: usize| range.start <= length && range.end <= length;
        let [width, height] = small_size([layout.width, layout.height], layout.period.is_some());
        let Self { view, coarse_levels, bytes, .. } = self;
        // On a cylinder, a view may run into the next turn.
        let turns = if layout.period.is_some() { 2 } else { 1 };
        let is_view = lies_within(&view.columns, turns * width)
            && view.columns.len() <= width
            && lies_within(&view.rows, height)
            && view.columns.len() * view.rows.len() == view.pixels.len();
        let samples = |length: usize| input.first_level.map_or(0, |level| length.div_ceil(1 << level));
        let [samples_across, samples_down] = unrolled.canvas().map(samples);
        let is_level = |CoarseLevel { plane }: &CoarseLevel| {
            lies_within(&plane.columns, samples_across) && lies_within(&plane.rows, samples_down) && plane.is_whole()
        };
        let is_as_large = layout.placed.get(position).is_some_and(|placed| {
            *bytes as f64 <= placed.mesh.width.round() * placed.mesh.height.round() * MOST_PIXEL_BYTES
        });
        is_view
            && coarse_levels.len() == unrolled.placements(position).count()
            && coarse_levels.iter().all(is_level)
            && is_as_large
    }
}

/// Makes the small views. Progress counts photographs, of a stage that the caller begins.
///
/// # Errors
/// [`trueup_core::Error::Input`] if a photograph does not fit its grid; [`trueup_core::Error::Cancelled`]; what the
/// photographs and a scratch file return.
pub(crate) fn run(input: &SmallViewsInput<'_>, context: &StageContext) -> Result<SmallViews> {
    let mut all = SmallViews::none(input);
    let mut room = input.plan.kept;
    let positions: Vec<usize> = (0..input.unrolled.original_layout().placed.len()).collect();
    make_each(input, &positions, context, |_, made, photograph| {
        let bytes = made.bytes;
        let fits = bytes <= room;
        room -= if fits { bytes } else { 0 };
        all.push(made, fits.then_some(photograph))
    })?;
    Ok(all)
}

/// Takes what a photograph became, with its position among [`placed`](crate::layout::CanvasLayout::placed).
pub type TakeSmall<'a> = &'a mut dyn FnMut(usize, MadeSmall) -> Result<()>;

/// The same, where the photographs are made small by others: `make_small` has those at the positions that it is told
/// made so.
///
/// # Errors
/// Those of `make_small`; [`trueup_core::Error::Input`] if what they give cannot be; those of a scratch file.
pub(crate) fn run_elsewhere(
    input: &SmallViewsInput<'_>,
    make_small: impl FnOnce(&[usize], TakeSmall<'_>) -> Result<()>,
    context: &StageContext,
) -> Result<SmallViews> {
    let mut all = SmallViews::none(input);
    let positions: Vec<usize> = (0..input.unrolled.original_layout().placed.len()).collect();
    let mut waiting: Vec<Option<MadeSmall>> = positions.iter().map(|_| None).collect();
    let mut next = 0;
    make_small(&positions, &mut |position, made| {
        context.check_cancelled()?;
        let is_wanted = waiting.get(position).is_some_and(Option::is_none) && position >= next;
        if !(is_wanted && made.fits(input, position)) {
            return Err(not_asked_for());
        }
        context.progress().advance(RenderOptions::STAGE, 1);
        waiting[position] = Some(made);
        // In their order, so that no more than those that others are ahead by wait.
        while let Some(made) = waiting.get_mut(next).and_then(Option::take) {
            all.push(made, None)?;
            next += 1;
        }
        Ok(())
    })?;
    if next < positions.len() {
        return Err(not_asked_for());
    }
    Ok(all)
}

/// Makes photographs at these positions small, for [`run_elsewhere`]; `made` is called in their order.
///
/// # Errors
/// Those of [`run`].
pub(crate) fn make_each(
    input: &SmallViewsInput<'_>,
    positions: &[usize],
    context: &StageContext,
    mut made: impl FnMut(usize, MadeSmall, Photograph) -> Result<()>,
) -> Result<()> {
    let &SmallViewsInput { unrolled, corrections, photographs, plan, .. } = input;
    let layout = unrolled.original_layout();
    let curve = photographs.transfer_curve();
    let elsewhere = ShownElsewhere::find(unrolled.layout(), photographs, small_size(unrolled.canvas(), false));
    let size = small_size([layout.width, layout.height], layout.period.is_some());
    let making = Making { input, curve: &curve, size, elsewhere: elsewhere.map(Arc::new) };
    for positions in positions.chunks(plan.at_a_time) {
        context.check_cancelled()?;
        let all: Vec<(MadeSmall, Photograph)> = positions
            .par_iter()
            .map(|&position| {
                let made = making.make(position, &layout.placed[position], &corrections[position])?;
                context.progress().advance(RenderOptions::STAGE, 1);
                Ok(made)
            })
            .collect::<Result<_>>()?;
        for (&position, (small, photograph)) in positions.iter().zip(all) {
            made(position, small, photograph)?;
        }
    }
    Ok(())
}

impl SmallViews {
    /// None so far.
    fn none(input: &SmallViewsInput<'_>) -> Self {
        let layout = input.unrolled.original_layout();
        Self {
            views: Vec::new(),
            size: small_size([layout.width, layout.height], layout.period.is_some()),
            coarse_levels: CoarseLevels::new(input.plan.coarse_levels.clone()),
            border: Vec::new(),
            decoded: DecodedPhotographs { kept: Vec::new(), bytes: Vec::new() },
            has_alpha: false,
        }
    }

    /// Adds the next photograph, with its pixels if these are kept.
    fn push(&mut self, made: MadeSmall, photograph: Option<Photograph>) -> Result<()> {
        self.views.push(made.view);
        self.border.push(made.border);
        self.has_alpha |= made.has_alpha;
        made.coarse_levels.into_iter().try_for_each(|level| self.coarse_levels.push(level))?;
        self.decoded.bytes.push(made.bytes);
        self.decoded.kept.push(photograph);
        Ok(())
    }
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
    fn make(&self, position: usize, placed: &Placed, correction: &Correction) -> Result<(MadeSmall, Photograph)> {
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
        let view = || match layout.placed.len() {
            1 => SmallView::default(),
            _ => small_view(&warped.with_spread_highlights(), &masks, period, self.input.view_levels),
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
        let coarse_levels = || unrolled.placements(position).map(coarse_level).collect();
        let (view, coarse_levels) = rayon::join(view, coarse_levels);
        drop(warped);
        let border = self.border(&first, &photograph, correction);
        let (bytes, has_alpha) = (photograph.bytes(), photograph.has_alpha());
        Ok((MadeSmall { view, coarse_levels, border, bytes, has_alpha }, photograph))
    }

    /// What the photograph, placed in the first turn, alone shows at the border.
    fn border(&self, placed: &Placed, photograph: &Photograph, correction: &Correction) -> BorderDeviations {
        let Some(BorderInput { cells, resampling, encode }) = self.input.border else { return Vec::new() };
        let layout = self.input.unrolled.original_layout();
        let clip = [layout.width * if layout.period.is_some() { TURNS } else { 1 }, layout.height];
        let light = PhotographLight { curve: self.curve, correction, local: self.input.local };
        let (photograph, resampling) = (Cow::Borrowed(photograph), resampling.in_few_places());
        cells.border(&WarpedPhotograph::new(photograph, &placed.mesh, clip, light, &resampling), &resampling, encode)
    }
}
