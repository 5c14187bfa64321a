//! Rendering that others do a part of: other programs, or other machines.
//!
//! Two parts of rendering along seams take most of its time, and can be done anywhere, photograph by photograph and
//! region by region: photographs are made small, and regions of the canvas are finished. What lies between them is
//! decided once, from all photographs: seams, the part of the canvas that is kept, and the coarse levels of the blend.
//! What helpers are handed and what they give can be written down; what they do, they do by [`make_small`] and
//! [`finish_region`], the very code that renders without them, so that the panorama is the same to the last bit.

use trueup_core::{Result, StageContext};

use super::helpers::SmallWork;
use super::input::RenderInput;
use super::resources::Resources;
use super::{Composing, Holding, unrolled, whole_levels};
use crate::blend::{self, FinishedRegion, Region, RegionInput, RegionWork};
use crate::handed_over::not_asked_for;
use crate::render_options::RenderOptions;
use crate::small_views::{self, BorderInput, SmallViewsInput, TakeSmall};
use crate::warped::Resampling;

/// Makes the photographs at these positions small, for somebody else who renders the same `input` by the same options;
/// hands them to `take` in their order.
///
/// # Errors
/// [`trueup_core::Error::Input`] if `work` or a position belongs to another panorama; those of [`run`](super::run) and
/// of `take`.
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
/// [`trueup_core::Error::Input`] if `work` or the region belongs to another panorama; those of [`run`](super::run).
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
