//! Seams and multi-band blending: from photographs to finished pixels, tile by tile.
//!
//! Two passes over the photographs. The first makes small pictures of all of them: for the search of the seams, and for the
//! coarse levels of the blend, which reach far and are blended as a whole. The second finishes the canvas in tiles, from
//! one end of its longer side to the other; a photograph is in memory only from the first strip of tiles that shows it to
//! the last. Where a tile shows one photograph alone, only what the coarse levels changed is added to it.
//!
//! Values are square roots of linear light. Differences between photographs that corrections have left are proportional to
//! the light; added to linear light, what is smoothed over the bright side of a contour would push the dark side below
//! black and show as a halo, while the root, near to what the eye sees, keeps both sides' errors equally small.

mod coarse;
mod pyramid;
mod tile;
mod unrolled;
mod views;

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;
use trueup_core::options::StageOptions;
use trueup_core::raster::Photograph;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use crate::exposure::Correction;
use crate::layout::CanvasLayout;
use crate::render::RenderOptions;
use crate::render::prepared::{Prepared, Scratch, check_photograph};
use crate::seam::{self, Label, SeamOptions, Seams};
use coarse::FIRST_LEVEL;
use pyramid::Plane;
use tile::Tile;
use unrolled::Unrolled;

/// A finished pixel: square roots of linear light and alpha, 65535 is 1.
pub(crate) type Finished = [u16; 4];

/// Side of a tile in canvas pixels, a multiple of 2^[`FIRST_LEVEL`]. Larger tiles waste less on margins, smaller ones
/// less on pixels that only one photograph shows.
const TILE: usize = 128;

/// Tiles across a strip: enough for all threads, few enough to let photographs go.
const TILES_ACROSS: usize = 4;

/// A photograph at an eighth of the canvas.
#[derive(Debug, Clone, Default)]
struct Base {
    plane: Plane<[f32; 4]>,
}

/// The coarse levels.
struct Levels {
    /// The blended level [`FIRST_LEVEL`].
    blended: Plane<[f32; 4]>,
    /// The same level of every photograph.
    bases: Vec<Base>,
}

impl Levels {
    fn new(mut bases: Vec<Base>, seams: &Seams, unrolled: &Unrolled<'_>, levels: u32) -> Self {
        let mut blended = coarse::blend(&bases, seams, unrolled, levels);
        unrolled.join_ends(&mut blended, levels);
        bases.par_iter_mut().for_each(|base| pyramid::level_shares(&mut base.plane));
        Self { blended, bases }
    }
}

/// What all tiles need.
struct Work<'a> {
    options: &'a RenderOptions,
    seams: &'a Seams,
    unrolled: &'a Unrolled<'a>,
    /// `None` to cut without blending.
    levels: Option<Levels>,
}

/// The finished canvas, and the seams that were used.
pub(crate) struct Blended {
    pub(crate) pixels: Vec<Finished>,
    pub(crate) seams: Seams,
}

/// Renders with seams; blends over them unless `cut`.
pub(crate) fn run(
    layout: &CanvasLayout,
    corrections: &[Correction],
    photographs: &dyn PhotographSource,
    (options, seam_options): (&RenderOptions, &SeamOptions),
    cut: bool,
    context: &StageContext,
) -> Result<Blended> {
    let stage = RenderOptions::STAGE;
    let count = layout.placed.len();
    let levels = if cut || count == 1 { None } else { Some(levels_above(layout, options)) };
    let unrolled = Unrolled::new(layout, levels)?;
    let (canvas, placed) = (unrolled.canvas(), unrolled.placed());
    // Small pictures, and the photographs themselves wherever they are placed.
    context.progress().begin(stage, (count + placed.len()) as u64);
    let views::Small { views, size, bases, mut kept } =
        views::make(&unrolled, corrections, photographs, (options, seam_options), levels.is_some(), context)?;
    let around = layout.period.is_some();
    let seams = match count {
        1 => Seams::of_one(size[0], size[1]),
        _ => seam::run(views, size, around, seam_options, context)?,
    };
    let levels = levels.map(|levels| Levels::new(bases, &seams, &unrolled, levels));
    let work = Work { options, seams: &seams, unrolled: &unrolled, levels };

    let strips = strips(&work);
    let last_strip: Vec<Option<usize>> = (0..placed.len())
        .map(|picture| strips.iter().rposition(|strip| strip.shown.contains(&(picture as Label))))
        .collect();
    let mut pictures: Vec<Option<Prepared<'_>>> = placed.iter().map(|_| None).collect();
    let mut pixels = vec![[0; 4]; layout.width * layout.height];
    for (index, strip) in strips.iter().enumerate() {
        context.check_cancelled()?;
        let wanted: Vec<usize> =
            strip.shown.iter().map(|&label| usize::from(label)).filter(|&at| pictures[at].is_none()).collect();
        let ready: Vec<(usize, Option<Photograph>)> =
            wanted.iter().map(|&at| (at, kept[unrolled.original(at)].take())).collect();
        let loaded: Vec<(usize, Prepared<'_>)> = ready
            .into_par_iter()
            .map(|(at, photograph)| {
                let (placed, correction) = (&placed[at], &corrections[unrolled.original(at)]);
                let photograph = match photograph {
                    Some(photograph) => photograph,
                    None => photographs.photograph(placed.photograph)?,
                };
                check_photograph(placed, &photograph)?;
                let prepared = Prepared::new(Cow::Owned(photograph), &placed.mesh, canvas, correction, options);
                context.progress().advance(stage, 1);
                Ok((at, prepared))
            })
            .collect::<Result<_>>()?;
        for (at, prepared) in loaded {
            pictures[at] = Some(prepared);
        }
        let finished: Vec<Vec<Finished>> = strip
            .tiles
            .par_iter()
            .map_init(Scratch::default, |scratch, tile| {
                context.check_cancelled()?;
                Ok(tile.finish(&work, &pictures, scratch))
            })
            .collect::<Result<_>>()?;
        for (tile, finished) in strip.tiles.iter().zip(finished) {
            let rows = finished.chunks_exact(tile.columns.len().max(1));
            for (y, row) in tile.rows.clone().zip(rows) {
                let first = y * layout.width + tile.columns.start - unrolled.lead();
                pixels[first..first + row.len()].copy_from_slice(row);
            }
        }
        for (at, picture) in pictures.iter_mut().enumerate() {
            if last_strip[at].is_none_or(|last| last <= index) {
                *picture = None;
            }
        }
    }
    drop(work);
    context.progress().finish(stage);
    Ok(Blended { pixels, seams })
}

/// Levels above [`FIRST_LEVEL`], so that the coarsest samples are as wide as the widest transition wanted.
fn levels_above(layout: &CanvasLayout, options: &RenderOptions) -> u32 {
    let mut sides: Vec<f64> = layout
        .placed
        .iter()
        .map(|placed| {
            let (low, high) = placed.mesh.bounds();
            (high - low).min()
        })
        .collect();
    sides.sort_by(f64::total_cmp);
    let side = sides.get(sides.len() / 2).copied().unwrap_or(1.0);
    let wanted = (options.transition * side).max(1.0).log2().round();
    (wanted as u32).saturating_sub(FIRST_LEVEL).min(MOST_LEVELS)
}

/// 2^(3 + 12) pixels are wider than any photograph.
const MOST_LEVELS: u32 = 12;

/// A row of tiles across the canvas, or several, and what they show.
struct Strip {
    tiles: Vec<Tile>,
    shown: Vec<Label>,
}

/// The canvas in strips across its shorter side.
fn strips(work: &Work<'_>) -> Vec<Strip> {
    let [width, height] = work.unrolled.finished();
    let lead = work.unrolled.lead();
    let wide = width >= height;
    let (along, across) = if wide { (width, height) } else { (height, width) };
    (0..along)
        .step_by(TILE * TILES_ACROSS)
        .map(|start| {
            let end = (start + TILE * TILES_ACROSS).min(along);
            let mut tiles = Vec::new();
            for a in (start..end).step_by(TILE) {
                for b in (0..across).step_by(TILE) {
                    let (a, b) = (a..(a + TILE).min(along), b..(b + TILE).min(across));
                    let (columns, rows) = if wide { (a, b) } else { (b, a) };
                    tiles.push(tile(work, columns.start + lead..columns.end + lead, rows));
                }
            }
            let mut shown: Vec<Label> = tiles.iter().flat_map(|tile| tile.shown.clone()).collect();
            shown.sort_unstable();
            shown.dedup();
            shown.retain(|&label| usize::from(label) < work.unrolled.placed().len());
            Strip { tiles, shown }
        })
        .collect()
}

fn tile(work: &Work<'_>, columns: Range<usize>, rows: Range<usize>) -> Tile {
    let (wide, high) = Tile::with_margin(&columns, &rows, work.unrolled.canvas());
    Tile { shown: work.unrolled.shown_in(work.seams, &wide, &high), columns, rows }
}

#[cfg(test)]
mod tests;
