//! Rendering that others do a part of: other programs, or other machines.
//!
//! Two parts of rendering along seams take most of its time, and can be done anywhere, photograph by photograph and region by
//! region: photographs are made small, and regions of the canvas are finished. What lies between them is decided once, from all
//! photographs: seams, the part of the canvas that is kept, and the coarse levels of the blend. What helpers are handed and what they
//! give can be written down; what they do, they do by [`make_small`] and [`finish_region`], the very code that renders without them,
//! so that the panorama is the same to the last bit.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use trueup_core::{Error, Result, StageContext};

use super::input::RenderInput;
use super::{Composing, Holding, unrolled, whole_levels};
use crate::blend::{self, RegionInput};
use crate::coverage::Rectangle;
use crate::crop::CellsAhead;
use crate::memory_plan::Resources;
use crate::pyramid::PyramidPlane;
use crate::render_options::RenderOptions;
use crate::seam::Seams;
use crate::small_views::{self, BorderInput, CoarseLevel, MadeSmall, SmallViewsInput};
use crate::store::RootPixel;
use crate::warped::Resampling;

/// Takes what a photograph became, with its position among [`placed`](crate::layout::CanvasLayout::placed).
pub type TakeSmall<'a> = &'a mut dyn FnMut(usize, MadeSmall) -> Result<()>;

/// A region by its number.
pub type RegionOf<'a> = &'a dyn Fn(usize) -> Result<Region>;

/// Takes what a region became, with its number.
pub type TakeRegion<'a> = &'a mut dyn FnMut(usize, FinishedRegion) -> Result<()>;

/// Others who do a part of rendering.
pub trait RenderHelpers: Sync {
    /// Has the photographs at these positions made small by [`make_small`], and hands each once, in any order, to `take`.
    ///
    /// # Errors
    /// What keeps them from it; those of `take`.
    fn make_small(&self, work: &SmallWork, positions: &[usize], take: TakeSmall<'_>) -> Result<()>;

    /// Has regions 0 to `count` finished by [`finish_region`], and hands each once, in any order, to `take`. What `region` returns is
    /// large: no more of them are to be asked for than there is room for.
    ///
    /// # Errors
    /// What keeps them from it; those of `region` and `take`.
    fn finish(&self, work: &RegionWork, count: usize, region: RegionOf<'_>, take: TakeRegion<'_>) -> Result<()>;
}

/// What making photographs small takes beside what is rendered.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SmallWork {
    /// Where the photographs are looked at for a frame; `None` if none is chosen.
    pub(crate) border: Option<CellsAhead>,
}

/// What finishing any region takes beside what is rendered.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RegionWork {
    pub(crate) seams: Seams,
    /// The coarse levels, blended; `None` to cut along the seams.
    pub(crate) blended: Option<PyramidPlane<[f32; 4]>>,
    /// Bytes of each photograph.
    pub(crate) bytes: Vec<usize>,
}

/// A region of the canvas.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Region {
    /// What of it is to be finished.
    pub(crate) parts: Vec<Rectangle>,
    /// The own coarse levels of the placements that it shows.
    pub(crate) own: Vec<(usize, CoarseLevel)>,
}

/// A finished region.
#[derive(Debug, Serialize, Deserialize)]
pub struct FinishedRegion {
    pub(crate) tiles: Vec<FinishedTile>,
    /// The placements that it shows.
    pub(crate) shown: Vec<usize>,
}

/// A tile of the canvas.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct FinishedTile {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
    /// Row by row.
    #[serde(with = "crate::bulk")]
    pub(crate) pixels: Vec<RootPixel>,
}

/// Makes the photographs at these positions small, for somebody else who renders the same `input` by the same options; hands them to
/// `take` in their order.
///
/// # Errors
/// [`Error::Input`] if `work` or a position belongs to another panorama; those of [`run`](super::run) and of `take`.
pub fn make_small(
    input: &RenderInput<'_>,
    resources: &Resources<'_>,
    options: &RenderOptions,
    work: &SmallWork,
    positions: &[usize],
    context: &StageContext,
    take: TakeSmall<'_>,
) -> Result<()> {
    Composing::within(input, resources, options, Holding::APart, |composing| {
        let &Composing { layout, corrections, local, photographs, plan } = composing;
        let fits = work.border.as_ref().is_none_or(|cells| cells.are_of(layout));
        if !fits || positions.iter().any(|&position| position >= layout.placed.len()) {
            return Err(not_asked_for());
        }
        let levels = whole_levels(layout, options);
        let unrolled = &unrolled(layout, levels)?;
        let (resampling, encoding) = (Resampling::of(options.interpolation), photographs.encoding());
        let border =
            work.border.as_ref().map(|cells| BorderInput { cells, resampling: &resampling, encode: &encoding.roots });
        let first_level = levels.map(|levels| levels.first_level);
        let view_levels = encoding.view_levels();
        let input =
            SmallViewsInput { unrolled, corrections, local, photographs, view_levels, first_level, border, plan };
        small_views::make_each(&input, positions, context, |position, made, _| take(position, made))
    })
}

/// Finishes a region of the canvas, for somebody else who renders the same `input` by the same options.
///
/// # Errors
/// [`Error::Input`] if `work` or the region belongs to another panorama; those of [`run`](super::run).
pub fn finish_region(
    input: &RenderInput<'_>,
    resources: &Resources<'_>,
    options: &RenderOptions,
    work: &RegionWork,
    region: Region,
    context: &StageContext,
) -> Result<FinishedRegion> {
    Composing::within(input, resources, options, Holding::APart, |composing| {
        let &Composing { layout, corrections, local, photographs, plan } = composing;
        let levels = whole_levels(layout, options);
        let unrolled = &unrolled(layout, levels)?;
        let resampling = Resampling::of(options.interpolation);
        let input = RegionInput { unrolled, corrections, local, photographs, resampling, levels, plan };
        blend::finish_region(input, work, region, context)
    })
}

/// The error when what is handed over between programs does not belong to what both of them render.
pub(crate) fn not_asked_for() -> Error {
    Error::input(
        "work that is divided",
        "what one program handed to another does not belong to this panorama",
        "Run the same version of trueup on all machines, with the same photographs.",
    )
}
