//! Blending along seams: from photographs to finished pixels, tile by tile.
//!
//! The photographs were read once before, for their small views: from these come the seams, and the coarse levels of
//! the blend, which reach far and are blended as a whole. Here the canvas is finished in tiles, strip by strip; a
//! photograph is in memory from the first strip of tiles that shows it to the last, or less, if there is little memory.
//! Where a tile shows one photograph alone, only what the coarse levels changed is added to it.
//!
//! Values are square roots of linear light. Differences between photographs that corrections have left are proportional
//! to the light; added to linear light, what is smoothed over the bright side of a contour would push the dark side
//! below black and show as a halo, while the root, near to what the eye sees, keeps both sides' errors equally small.

mod coarse;
mod levels;
mod loaded;
mod needs;
mod order;
mod parts;
mod region;
mod shown;
#[cfg(test)]
mod tests;
mod things;
mod tile;
mod work;

use std::collections::BTreeSet;

use rayon::prelude::*;
use trueup_core::options::StageOptions;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use crate::coverage::Rectangle;
use crate::handed_over::not_asked_for;
use crate::label::Label;
use crate::layout::Unrolled;
use crate::light::{Correction, LocalExposure};
use crate::memory_plan::MemoryPlan;
use crate::pyramid::{PyramidPlane, first_level, tile_side};
use crate::render_options::RenderOptions;
use crate::seam::Seams;
use crate::small_views::{CoarseLevels, DecodedPhotographs, small_size};
use crate::store::{Block, PixelStore, RootPixel};
use crate::warped::{Resampling, SamplingMemory};
use loaded::{LoadedPhotographs, PhotographLoader};
use parts::HeldPhotographs;
use region::FinishedTile;
use shown::ShownWhere;
use tile::BlendTile;
use work::{BlendWork, BlendedLevels, TILES_AT_ONCE};

pub(crate) use levels::WholeLevels;
pub(crate) use needs::needed_bytes;
pub use region::{FinishedRegion, Region, RegionOf, RegionWork, TakeRegion};

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
        let BlendInput { unrolled, photographs, resampling, seams, plan, .. } = input;
        let first_level = first_level(unrolled.finished());
        let shown = ShownWhere { unrolled, seams };
        let coarse_levels = std::mem::take(&mut input.coarse_levels);
        let levels = input
            .levels
            .map(|levels| BlendedLevels::new(coarse_levels, shown, levels, plan.levels_at_a_time))
            .transpose()?;
        let ignored = unrolled.placed().iter().map(|placed| photographs.masks(placed.photograph).ignored).collect();
        Ok(Self { input, work: BlendWork { resampling, shown, first_level, levels, ignored } })
    }

    /// What the coarse levels change of photographs at places of the canvas, pixels from its corner: square roots of
    /// linear light.
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

    /// Finishes `parts` of the canvas, and maybe more; what is not finished is empty. Progress counts placements of
    /// photographs, of a stage that the caller begins.
    ///
    /// # Errors
    /// [`trueup_core::Error::Limits`] if more photographs meet at one place than there is memory for;
    /// [`trueup_core::Error::Cancelled`]; what the photographs and a scratch file return.
    pub(crate) fn finish(self, parts: &[Rectangle], context: &StageContext) -> Result<PixelStore<RootPixel>> {
        let mut pixels = self.canvas();
        self.finish_each(parts, &mut pixels, context)?;
        Ok(pixels)
    }

    /// The same, where others finish regions of the canvas: `finish` has as many of them finished as it is told, each
    /// by [`finish_region`].
    ///
    /// # Errors
    /// Those of `finish`; [`trueup_core::Error::Input`] if what they give cannot be; those of a scratch file.
    pub(crate) fn finish_elsewhere(
        self,
        parts: &[Rectangle],
        finish: impl FnOnce(&RegionWork, usize, RegionOf<'_>, TakeRegion<'_>) -> Result<()>,
        context: &StageContext,
    ) -> Result<PixelStore<RootPixel>> {
        let Self { input, work } = &self;
        let BlendInput { unrolled, seams, .. } = input;
        let mut pixels = self.canvas();
        let whole = HeldPhotographs::whole(unrolled, self.placement_bytes());
        let regions = order::regions(unrolled, work.first_level, parts);
        let common = RegionWork {
            seams: (*seams).clone(),
            blended: work.levels.as_ref().map(|levels| levels.blended.clone()),
            bytes: input.decoded.bytes.clone(),
        };
        let mut counted = vec![false; unrolled.placed().len()];
        let mut done = vec![false; regions.len()];
        let region = |number: usize| {
            context.check_cancelled()?;
            let parts = &regions[number];
            let batches = order::batches(work, parts, &whole, order::Room::UNLIMITED)?;
            let shown: BTreeSet<Label> = batches.into_iter().flat_map(|batch| batch.shown.into_keys()).collect();
            let own = |&label: &Label| {
                let at = usize::from(label);
                Ok((at, work.levels.as_ref().map(|levels| levels.own.ready(at)).transpose()?.unwrap_or_default()))
            };
            Ok(Region { parts: parts.clone(), own: shown.iter().map(own).collect::<Result<_>>()? })
        };
        finish(&common, regions.len(), &region, &mut |number, finished: FinishedRegion| {
            context.check_cancelled()?;
            if done.get(number) != Some(&false) {
                return Err(not_asked_for());
            }
            done[number] = true;
            let side = tile_side(work.first_level);
            for tile in finished.tiles {
                let block = Block { columns: tile.columns, rows: tile.rows, pixels: &tile.pixels };
                let in_region = regions[number].iter().any(|part| block.is_tile_of(part, side, unrolled.finished()));
                if !in_region {
                    return Err(not_asked_for());
                }
                pixels.put(&[block])?;
            }
            for at in finished.shown {
                if let Some(counted @ false) = counted.get_mut(at) {
                    *counted = true;
                    context.progress().advance(RenderOptions::STAGE, 1);
                }
            }
            Ok(())
        })?;
        match done.iter().all(|&done| done) {
            true => Ok(pixels),
            false => Err(not_asked_for()),
        }
    }

    /// What is to be finished, empty.
    fn canvas(&self) -> PixelStore<RootPixel> {
        let side = tile_side(self.work.first_level);
        self.input.plan.store(self.input.unrolled.finished(), [side; 2])
    }

    /// Bytes of the photograph of each placement.
    fn placement_bytes(&self) -> Vec<usize> {
        let BlendInput { unrolled, decoded, .. } = &self.input;
        (0..unrolled.placed().len()).map(|at| decoded.bytes[unrolled.original(at)]).collect()
    }

    /// [`Self::finish`], onto what takes the tiles.
    fn finish_each(self, parts: &[Rectangle], onto: &mut dyn TakesTiles, context: &StageContext) -> Result<()> {
        let held = HeldPhotographs::whole(self.input.unrolled, self.placement_bytes());
        let Self { input, mut work } = self;
        let BlendInput { unrolled, corrections, photographs, resampling, plan, .. } = input;
        let held = if plan.in_parts { held.in_parts(unrolled) } else { held };
        let placements = unrolled.placed().len();
        let mut kept = input.decoded.kept;
        // Of several placements, the first takes what was kept.
        let kept = (0..placements).map(|at| kept[unrolled.original(at)].take()).collect();
        let room = order::Room { usual: plan.photographs, most: plan.most_photographs };
        let batches = order::batches(&work, parts, &held, room)?;
        let curve = photographs.transfer_curve();
        let local = input.local.map(|local| local.led_by(unrolled.lead()));
        let local = local.as_ref();
        let loader = PhotographLoader { unrolled, curve: &curve, corrections, local, photographs, resampling, context };
        let mut loaded = LoadedPhotographs::new(loader, kept, &batches, plan.photographs, plan.at_a_time);
        for (index, batch) in batches.iter().enumerate() {
            loaded.prepare(index, batch, &held)?;
            if let Some(levels) = &mut work.levels {
                levels.own.hold(|at| loaded.warped()[at].is_some())?;
            }
            let place = |tile: &&BlendTile| {
                let columns = tile.columns.start - unrolled.lead()..tile.columns.end - unrolled.lead();
                Rectangle { columns, rows: tile.rows.clone() }
            };
            let showing: Vec<&BlendTile> = batch.tiles.iter().filter(|tile| !tile.shown.is_empty()).collect();
            if let Some(places) = onto.places(&showing.iter().map(place).collect::<Vec<_>>()) {
                let finish_in =
                    |memory: &mut SamplingMemory, (tile, mut rows): (&&BlendTile, Vec<&mut [RootPixel]>)| {
                        context.check_cancelled()?;
                        tile.finish_in(&mut rows, &work, loaded.warped(), memory);
                        Ok(())
                    };
                showing.par_iter().zip(places).map_init(SamplingMemory::default, finish_in).collect::<Result<()>>()?;
                continue;
            }
            let finish = |memory: &mut SamplingMemory, tile: &&BlendTile| {
                context.check_cancelled()?;
                Ok(tile.finish(&work, loaded.warped(), memory))
            };
            let finish_all = |tiles: &[&BlendTile]| -> Result<Vec<Vec<RootPixel>>> {
                tiles.par_iter().map_init(SamplingMemory::default, finish).collect()
            };
            let mut put_all = |tiles: &[&BlendTile], finished: &[Vec<RootPixel>]| {
                let block = |(tile, pixels)| {
                    let Rectangle { columns, rows } = place(tile);
                    Block { columns, rows, pixels }
                };
                let blocks: Vec<Block<'_, RootPixel>> =
                    tiles.iter().zip(finished.iter().map(Vec::as_slice)).map(block).collect();
                onto.put(&blocks)
            };
            // Tiles are put on the canvas while the next ones are finished: no thread waits for the others' last tile.
            let mut last: (&[&BlendTile], Vec<Vec<RootPixel>>) = (&[], Vec::new());
            let tiles: Vec<&BlendTile> = batch.tiles.iter().collect();
            for tiles in tiles.chunks(TILES_AT_ONCE * rayon::current_num_threads().max(1)) {
                let (done, finished) = rayon::join(|| put_all(last.0, &last.1), || finish_all(tiles));
                done?;
                last = (tiles, finished?);
            }
            put_all(last.0, &last.1)?;
        }
        Ok(())
    }
}

/// What takes finished tiles.
trait TakesTiles: Send {
    /// Where the tiles in these places are to be finished, row by row, empty so far; `None` if they are to be
    /// [put](Self::put), those that show nothing as well.
    fn places(&mut self, tiles: &[Rectangle]) -> Option<Vec<Vec<&mut [RootPixel]>>>;

    /// Takes finished tiles.
    fn put(&mut self, tiles: &[Block<'_, RootPixel>]) -> Result<()>;
}

impl TakesTiles for PixelStore<RootPixel> {
    fn places(&mut self, tiles: &[Rectangle]) -> Option<Vec<Vec<&mut [RootPixel]>>> {
        self.tiles_mut(tiles)
    }

    fn put(&mut self, tiles: &[Block<'_, RootPixel>]) -> Result<()> {
        Self::put(self, tiles)
    }
}

impl TakesTiles for Vec<FinishedTile> {
    fn places(&mut self, _: &[Rectangle]) -> Option<Vec<Vec<&mut [RootPixel]>>> {
        None
    }

    fn put(&mut self, tiles: &[Block<'_, RootPixel>]) -> Result<()> {
        let tile = |Block { columns, rows, pixels }: &Block<'_, RootPixel>| FinishedTile {
            columns: columns.clone(),
            rows: rows.clone(),
            pixels: pixels.to_vec(),
        };
        self.extend(tiles.iter().map(tile));
        Ok(())
    }
}

/// What a region is finished from.
pub(crate) struct RegionInput<'a> {
    /// Where the photographs lie.
    pub(crate) unrolled: &'a Unrolled<'a>,
    /// One for each photograph of the layout that was unrolled.
    pub(crate) corrections: &'a [Correction],
    /// What is done to the light of all of them, over the layout that was unrolled.
    pub(crate) local: Option<&'a LocalExposure>,
    pub(crate) photographs: &'a dyn PhotographSource,
    pub(crate) resampling: Resampling,
    pub(crate) levels: Option<WholeLevels>,
    pub(crate) plan: &'a MemoryPlan,
}

/// Finishes one region, for [`Blending::finish_elsewhere`].
///
/// # Errors
/// [`trueup_core::Error::Input`] if the region is none of this panorama; those of [`Blending::finish`].
pub(crate) fn finish_region(
    input: RegionInput<'_>,
    common: &RegionWork,
    region: Region,
    context: &StageContext,
) -> Result<FinishedRegion> {
    let RegionInput { unrolled, corrections, local, photographs, resampling, levels, plan } = input;
    let RegionWork { seams, blended, bytes } = common;
    let Region { parts, own } = region;
    let (layout, placements) = (unrolled.original_layout(), unrolled.placed().len());
    let [width, height] = unrolled.finished();
    let small = small_size([layout.width, layout.height], layout.period.is_some());
    let lies_within = |part: &Rectangle| part.area() > 0 && part.columns.end <= width && part.rows.end <= height;
    let first_level = first_level(unrolled.finished());
    let whole = unrolled.canvas().map(|length| 0..length.div_ceil(1 << first_level));
    let is_blended =
        |plane: &PyramidPlane<[f32; 4]>| plane.is_whole() && [&plane.columns, &plane.rows] == [&whole[0], &whole[1]];
    let fits = seams.fit(layout.placed.len(), small, layout.period.is_some())
        && bytes.len() == layout.placed.len()
        && parts.iter().all(lies_within)
        && blended.is_some() == levels.is_some()
        && blended.as_ref().is_none_or(is_blended)
        && own.iter().all(|(at, level)| *at < placements && level.plane.is_whole());
    if !fits {
        return Err(not_asked_for());
    }
    let has_own: BTreeSet<usize> = own.iter().map(|(at, _)| *at).collect();
    let decoded = DecodedPhotographs { kept: layout.placed.iter().map(|_| None).collect(), bytes: bytes.clone() };
    let shown = ShownWhere { unrolled, seams };
    let levels_blended = blended
        .as_ref()
        .map(|blended| BlendedLevels { blended: blended.clone(), own: CoarseLevels::of_some(placements, own) });
    let ignored = unrolled.placed().iter().map(|placed| photographs.masks(placed.photograph).ignored).collect();
    let work = BlendWork { resampling, shown, first_level, levels: levels_blended, ignored };
    let coarse_levels = CoarseLevels::default();
    let input = BlendInput {
        unrolled,
        corrections,
        local,
        photographs,
        resampling,
        seams,
        coarse_levels,
        levels,
        decoded,
        plan,
    };
    let blending = Blending { input, work };
    let whole = HeldPhotographs::whole(unrolled, blending.placement_bytes());
    let batches = order::batches(&blending.work, &parts, &whole, order::Room::UNLIMITED)?;
    if !batches.iter().flat_map(|batch| batch.shown.keys()).all(|&label| has_own.contains(&usize::from(label))) {
        return Err(not_asked_for());
    }
    let mut tiles = Vec::new();
    blending.finish_each(&parts, &mut tiles, context)?;
    Ok(FinishedRegion { tiles, shown: has_own.into_iter().collect() })
}
