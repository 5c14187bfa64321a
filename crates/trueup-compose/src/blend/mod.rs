//! Blending along seams: from photographs to finished pixels, tile by tile.
//!
//! The photographs were read once before, for their small views: from these come the seams, and the coarse levels of the
//! blend, which reach far and are blended as a whole. Here the canvas is finished in tiles, strip by strip; a photograph is in memory from the first strip of tiles that shows it to the last, or less, if there is
//! little memory. Where a tile shows one photograph alone, only what the coarse levels changed is added to it.
//!
//! Values are square roots of linear light. Differences between photographs that corrections have left are proportional to
//! the light; added to linear light, what is smoothed over the bright side of a contour would push the dark side below
//! black and show as a halo, while the root, near to what the eye sees, keeps both sides' errors equally small.

mod coarse;
mod levels;
mod loaded;
mod needs;
mod order;
mod shown;
#[cfg(test)]
mod tests;
mod tile;
mod work;

use rayon::prelude::*;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use crate::layout::Unrolled;
use crate::light::{Correction, LocalExposure};
use crate::memory_plan::MemoryPlan;
use crate::pyramid::{first_level, tile_side};
use crate::seam::Seams;
use crate::small_views::{CoarseLevels, DecodedPhotographs};
use crate::store::{PixelStore, RootPixel};
use crate::warped::{Resampling, SamplingMemory};
use loaded::{LoadedPhotographs, PhotographLoader};
use shown::ShownWhere;
use tile::BlendTile;
use work::{BlendWork, BlendedLevels, TILES_AT_ONCE};

pub(crate) use levels::WholeLevels;
pub(crate) use needs::needed_bytes;

/// What is blended.
pub(crate) struct BlendInput<'a> {
    /// Where the photographs lie.
    pub(crate) unrolled: &'a Unrolled<'a>,
    /// One for each photograph of the layout that was unrolled.
    pub(crate) corrections: &'a [Correction],
    /// What is done to the light of all of them, over the layout that was unrolled.
    pub(crate) local: Option<&'a LocalExposure>,
    pub(crate) photographs: &'a dyn PhotographSource,
    pub(crate) resampling: Resampling,
    pub(crate) seams: &'a Seams,
    /// The photographs' own coarse levels.
    pub(crate) coarse_levels: CoarseLevels,
    /// Which levels are blended as a whole; `None` to cut along the seams without blending.
    pub(crate) levels: Option<WholeLevels>,
    /// Photographs that were kept since they were made small.
    pub(crate) decoded: DecodedPhotographs,
    pub(crate) plan: &'a MemoryPlan,
}

/// Finishes the canvas. Progress counts placements of photographs, of a stage that the caller begins.
///
/// # Errors
/// [`trueup_core::Error::Limits`] if more photographs meet at one place than there is memory for;
/// [`trueup_core::Error::Cancelled`]; what the photographs and a scratch file return.
pub(crate) fn run(input: BlendInput<'_>, context: &StageContext) -> Result<PixelStore<RootPixel>> {
    let BlendInput { unrolled, corrections, photographs, resampling, seams, plan, .. } = input;
    let [width, height] = unrolled.finished();
    let first_level = first_level([width, height]);
    let shown = ShownWhere { unrolled, seams };
    let coarse_levels = input.coarse_levels;
    let levels = input.levels.map(|levels| BlendedLevels::new(coarse_levels, shown, levels)).transpose()?;
    let ignored = unrolled.placed().iter().map(|placed| photographs.masks(placed.photograph).ignored).collect();
    let mut work = BlendWork { resampling, shown, first_level, levels, ignored };

    let placements = unrolled.placed().len();
    let DecodedPhotographs { mut kept, bytes } = input.decoded;
    let bytes: Vec<usize> = (0..placements).map(|at| bytes[unrolled.original(at)]).collect();
    // Of several placements, the first takes what was kept.
    let kept = (0..placements).map(|at| kept[unrolled.original(at)].take()).collect();
    let batches = order::batches(&work, &bytes, plan.photographs)?;
    let curve = photographs.transfer_curve();
    let local = input.local.map(|local| local.led_by(unrolled.lead()));
    let local = local.as_ref();
    let loader = PhotographLoader { unrolled, curve: &curve, corrections, local, photographs, resampling, context };
    let mut loaded = LoadedPhotographs::new(loader, kept, &batches, plan.photographs, plan.at_a_time);
    let mut pixels = plan.store([width, height], [tile_side(first_level); 2]);
    for (index, batch) in batches.iter().enumerate() {
        loaded.prepare(index, batch, &bytes)?;
        if let Some(levels) = &mut work.levels {
            levels.own.hold(|at| loaded.warped()[at].is_some())?;
        }
        for tiles in batch.tiles.chunks(TILES_AT_ONCE * rayon::current_num_threads().max(1)) {
            let finish = |memory: &mut SamplingMemory, tile: &BlendTile| {
                context.check_cancelled()?;
                Ok(tile.finish(&work, loaded.warped(), memory))
            };
            let finished: Vec<Vec<RootPixel>> =
                tiles.par_iter().map_init(SamplingMemory::default, finish).collect::<Result<_>>()?;
            for (tile, finished) in tiles.iter().zip(finished) {
                let columns = tile.columns.start - unrolled.lead()..tile.columns.end - unrolled.lead();
                pixels.put(&columns, &tile.rows, &finished)?;
            }
        }
    }
    Ok(pixels)
}
