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

use crate::coverage::Rectangle;
use crate::label::Label;
use crate::layout::Unrolled;
use crate::light::{Correction, LocalExposure};
use crate::memory_plan::MemoryPlan;
use crate::pyramid::{first_level, tile_side};
use crate::seam::Seams;
use crate::small_views::{CoarseLevels, DecodedPhotographs};
use crate::store::{Block, PixelStore, RootPixel};
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

/// Photographs whose coarse levels are blended: what is left is to finish the canvas.
pub(crate) struct Blending<'a> {
    input: BlendInput<'a>,
    work: BlendWork<'a>,
}

impl<'a> Blending<'a> {
    /// Blends the coarse levels.
    ///
    /// # Errors
    /// Those of a scratch file.
    pub(crate) fn new(mut input: BlendInput<'a>) -> Result<Self> {
        let BlendInput { unrolled, photographs, resampling, seams, .. } = input;
        let first_level = first_level(unrolled.finished());
        let shown = ShownWhere { unrolled, seams };
        let coarse_levels = std::mem::take(&mut input.coarse_levels);
        let levels = input.levels.map(|levels| BlendedLevels::new(coarse_levels, shown, levels)).transpose()?;
        let ignored = unrolled.placed().iter().map(|placed| photographs.masks(placed.photograph).ignored).collect();
        Ok(Self { input, work: BlendWork { resampling, shown, first_level, levels, ignored } })
    }

    /// What the coarse levels change of photographs at places of the canvas, pixels from its corner: square roots of linear
    /// light.
    ///
    /// # Errors
    /// Those of a scratch file.
    pub(crate) fn changes(&self, places: &[(Label, [f64; 2])]) -> Result<Vec<[f32; 3]>> {
        let mut changes = vec![[0.0; 3]; places.len()];
        let Some(levels) = &self.work.levels else { return Ok(changes) };
        let unrolled = self.input.unrolled;
        let step = f64::from(1 << self.work.first_level);
        for placement in 0..levels.own.len() {
            let own = levels.own.read(placement)?;
            let original = unrolled.original(placement);
            changes.par_iter_mut().zip(places).for_each(|(change, &(label, [x, y]))| {
                // Sample i lies on the middle of pixel i * step.
                let at = [(x + unrolled.lead() as f64 - 0.5) / step, (y - 0.5) / step];
                if usize::from(label) == original
                    && let (Some(own), Some(all)) = (own.plane.color_at(at), levels.blended.color_at(at))
                {
                    *change = [all[0] - own[0], all[1] - own[1], all[2] - own[2]];
                }
            });
        }
        Ok(changes)
    }

    /// Finishes `parts` of the canvas, and maybe more; what is not finished is empty. Progress counts placements of photographs,
    /// of a stage that the caller begins.
    ///
    /// # Errors
    /// [`trueup_core::Error::Limits`] if more photographs meet at one place than there is memory for;
    /// [`trueup_core::Error::Cancelled`]; what the photographs and a scratch file return.
    pub(crate) fn finish(self, parts: &[Rectangle], context: &StageContext) -> Result<PixelStore<RootPixel>> {
        let Self { input, mut work } = self;
        let BlendInput { unrolled, corrections, photographs, resampling, plan, .. } = input;
        let [width, height] = unrolled.finished();
        let side = tile_side(work.first_level);
        let placements = unrolled.placed().len();
        let DecodedPhotographs { mut kept, bytes } = input.decoded;
        let bytes: Vec<usize> = (0..placements).map(|at| bytes[unrolled.original(at)]).collect();
        // Of several placements, the first takes what was kept.
        let kept = (0..placements).map(|at| kept[unrolled.original(at)].take()).collect();
        let batches = order::batches(&work, parts, &bytes, plan.photographs)?;
        let curve = photographs.transfer_curve();
        let local = input.local.map(|local| local.led_by(unrolled.lead()));
        let local = local.as_ref();
        let loader = PhotographLoader { unrolled, curve: &curve, corrections, local, photographs, resampling, context };
        let mut loaded = LoadedPhotographs::new(loader, kept, &batches, plan.photographs, plan.at_a_time);
        let mut pixels = plan.store([width, height], [side; 2]);
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
                let block = |(tile, pixels)| {
                    let BlendTile { columns, rows, .. }: &BlendTile = tile;
                    let columns = columns.start - unrolled.lead()..columns.end - unrolled.lead();
                    Block { columns, rows: rows.clone(), pixels }
                };
                let blocks: Vec<Block<'_, RootPixel>> =
                    tiles.iter().zip(finished.iter().map(Vec::as_slice)).map(block).collect();
                pixels.put(&blocks)?;
            }
        }
        Ok(pixels)
    }
}
