//! Seams and multi-band blending: from photographs to finished pixels, tile by tile.
//!
//! Two passes over the photographs. The first makes small pictures of all of them: for the search of the seams, and for the
//! coarse levels of the blend, which reach far and are blended as a whole. The second finishes the canvas in tiles, from
//! strip by strip; a photograph is in memory from the first strip of tiles that shows it to the last, or less, if there is
//! little memory. Where a tile shows one photograph alone, only what the coarse levels changed is added to it.
//!
//! Values are square roots of linear light. Differences between photographs that corrections have left are proportional to
//! the light; added to linear light, what is smoothed over the bright side of a contour would push the dark side below
//! black and show as a halo, while the root, near to what the eye sees, keeps both sides' errors equally small.

mod bases;
mod coarse;
mod needs;
mod order;
pub(crate) mod pyramid;
mod shelf;
mod tile;
mod unrolled;
mod views;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use trueup_core::mask::Mask;
use trueup_core::options::StageOptions;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use crate::exposure::Correction;
use crate::layout::{CanvasLayout, unit_of_turn};
use crate::render::RenderOptions;
use crate::render::plan::Plan;
use crate::render::prepared::Scratch;
use crate::render::store::Store;
use crate::seam::{self, SeamOptions, Seams};
use bases::Bases;
pub(crate) use coarse::first_level;
pub(crate) use needs::needed_bytes;
use pyramid::Plane;
use shelf::{Shelf, Supply};
use tile::Tile;
pub(crate) use tile::margin as tile_margin;
use unrolled::Unrolled;

/// A finished pixel: square roots of linear light and alpha, 65535 is 1.
pub(crate) type Finished = [u16; 4];

/// Side of a tile in canvas pixels, a multiple of 2^first_level: 128 for the canvases of most panoramas. Larger tiles waste
/// less on margins, smaller ones less on pixels that only one photograph shows.
pub(crate) const fn tile_side(first_level: u32) -> usize {
    16 << first_level
}

/// Tiles for each thread that are finished before they are put on the canvas.
const TILES_AT_ONCE: usize = 16;

/// The coarse levels.
struct Levels {
    /// The blended level `first_level`.
    blended: Plane<[f32; 4]>,
    /// The same level of every photograph.
    bases: Bases,
}

impl Levels {
    /// Blends from `first_level` on and at so many `levels` above it.
    fn new(
        mut bases: Bases,
        seams: &Seams,
        unrolled: &Unrolled<'_>,
        (first_level, levels): (u32, u32),
    ) -> Result<Self> {
        let blended = coarse::blend(&bases, seams, unrolled, (first_level, levels))?;
        bases.level_all();
        Ok(Self { blended, bases })
    }
}

/// What all tiles need.
struct Work<'a> {
    options: &'a RenderOptions,
    seams: &'a Seams,
    unrolled: &'a Unrolled<'a>,
    /// Log2 of the pixels per sample of the first level that is blended as a whole.
    first_level: u32,
    /// `None` to cut without blending.
    levels: Option<Levels>,
    /// What is ignored of the photograph of each placement.
    ignored: Vec<Option<Arc<Mask>>>,
}

/// The finished canvas, and the seams that were used.
pub(crate) struct Blended {
    pub(crate) pixels: Store<Finished>,
    pub(crate) seams: Seams,
}

/// Renders with seams; blends over them unless `cut`.
pub(crate) fn run(
    layout: &CanvasLayout,
    corrections: &[Correction],
    photographs: &dyn PhotographSource,
    (options, seam_options): (&RenderOptions, &SeamOptions),
    (cut, plan): (bool, &Plan),
    context: &StageContext,
) -> Result<Blended> {
    let stage = RenderOptions::STAGE;
    let count = layout.placed.len();
    let first_level = first_level([layout.width, layout.height]);
    let levels = if cut || count == 1 { None } else { Some(levels_above(layout, options)) };
    let unrolled = Unrolled::new(layout, first_level, levels)?;
    let placements = unrolled.placed().len();
    // Small pictures, and the photographs themselves wherever they are placed.
    context.progress().begin(stage, (count + placements) as u64);
    let views::Small { views, size, bases, mut kept, bytes } = views::make(
        &unrolled,
        corrections,
        photographs,
        (options, seam_options),
        (levels.map(|_| first_level), plan),
        context,
    )?;
    let around = layout.period.is_some();
    let seams = match count {
        1 => Seams::of_one(size[0], size[1]),
        _ => seam::run(views, size, around, seam_options, context)?,
    };
    let levels = levels.map(|levels| Levels::new(bases, &seams, &unrolled, (first_level, levels))).transpose()?;
    let ignored = unrolled.placed().iter().map(|placed| photographs.masks(placed.photograph).ignored).collect();
    let mut work = Work { options, seams: &seams, unrolled: &unrolled, first_level, levels, ignored };

    let bytes: Vec<usize> = (0..placements).map(|at| bytes[unrolled.original(at)]).collect();
    // Of several placements, the first takes what was kept.
    let kept = (0..placements).map(|at| kept[unrolled.original(at)].take()).collect();
    let batches = order::batches(&work, &bytes, plan.photographs)?;
    let curve = photographs.transfer_curve();
    let supply = Supply { unrolled: &unrolled, curve: &curve, corrections, photographs, options, context };
    let mut shelf = Shelf::new(supply, kept, &batches, plan.photographs, plan.at_a_time);
    let mut pixels = plan.store([layout.width, layout.height], [tile_side(first_level); 2]);
    for (index, batch) in batches.iter().enumerate() {
        shelf.prepare(index, batch, &bytes)?;
        if let Some(levels) = &mut work.levels {
            levels.bases.hold(|at| shelf.pictures()[at].is_some())?;
        }
        for tiles in batch.tiles.chunks(TILES_AT_ONCE * rayon::current_num_threads().max(1)) {
            let finish = |scratch: &mut Scratch, tile: &Tile| {
                context.check_cancelled()?;
                Ok(tile.finish(&work, shelf.pictures(), scratch))
            };
            let finished: Vec<Vec<Finished>> =
                tiles.par_iter().map_init(Scratch::default, finish).collect::<Result<_>>()?;
            for (tile, finished) in tiles.iter().zip(finished) {
                let columns = tile.columns.start - unrolled.lead()..tile.columns.end - unrolled.lead();
                pixels.put(&columns, &tile.rows, &finished)?;
            }
        }
    }
    drop(work);
    context.progress().finish(stage);
    Ok(Blended { pixels, seams })
}

/// Levels above the first that is blended as a whole, so that the coarsest samples are as wide as the widest transition
/// wanted, but on a cylinder no wider than those of which a turn has a whole number.
fn levels_above(layout: &CanvasLayout, options: &RenderOptions) -> u32 {
    let wanted = (options.transition * layout.photograph_side()).max(1.0).log2().round();
    // A turn that no layout makes has samples of its own at every turn, rather than hardly any transitions.
    let repeats = layout.period.filter(|&period| period > 0 && period.is_multiple_of(unit_of_turn(period)));
    let widest = repeats.map_or(u32::MAX, usize::trailing_zeros);
    (wanted as u32).min(widest).saturating_sub(first_level([layout.width, layout.height])).min(MOST_LEVELS)
}

/// 2^(3 + 12) pixels are wider than any photograph.
const MOST_LEVELS: u32 = 12;

/// The tile of these columns and rows.
fn tile(work: &Work<'_>, columns: Range<usize>, rows: Range<usize>) -> Tile {
    let (wide, high) = Tile::with_margin(&columns, &rows, work);
    Tile { shown: work.unrolled.shown_in(work.seams, &wide, &high), columns, rows }
}

#[cfg(test)]
mod tests;
