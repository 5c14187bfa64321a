//! In which order tiles are finished: strip by strip, in batches whose photographs fit into memory.

use std::ops::Range;

use rayon::prelude::*;
use trueup_core::memory::{needed_in_words, room_in_words};
use trueup_core::{Error, Result};

use super::parts::{HeldPhotographs, WantedRows, join};
use super::tile::{BlendTile, sampled_window};
use super::work::BlendWork;
use crate::coverage::Rectangle;
use crate::layout::Unrolled;
use crate::pyramid::tile_side;
use crate::window::{Window, common};

/// Canvas pixels across a strip: enough tiles for all threads, few enough photographs.
const STRIP: usize = 512;

/// The same where photographs are held in parts: the thicker strips are, the fewer want a photograph, and the more of
/// it each.
const PARTS_STRIPS: [usize; 4] = [512, 1024, 2048, 4096];

/// Tiles that are finished one after the other, and the photographs they are made of.
#[derive(Debug)]
pub(super) struct Batch {
    pub(super) tiles: Vec<BlendTile>,
    pub(super) shown: WantedRows,
}

/// Bytes for the photographs of a batch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    /// What several tiles may take together.
    pub(super) usual: usize,
    /// What one may that shows more; no less than `usual`.
    pub(super) most: usize,
}

impl Room {
    /// As much as is wanted.
    pub(super) const UNLIMITED: Self = Self { usual: usize::MAX, most: usize::MAX };
}

/// The tiles of all `parts` of the canvas in batches for which what is `held` of the photographs has `room`.
/// Strips run across that side of the canvas which leaves fewer photographs in memory from one strip to the next; of
/// photographs in parts, those in which fewer are decoded.
///
/// # Errors
/// [`Error::Limits`] if a single tile is made of more.
pub(super) fn batches(
    work: &BlendWork<'_>,
    parts: &[Rectangle],
    held: &HeldPhotographs,
    room: Room,
) -> Result<Vec<Batch>> {
    let [width, height] = work.shown.unrolled.finished();
    let side = tile_side(work.first_level);
    let cut = |first: usize, length: usize| -> Vec<Range<usize>> {
        let end = first + length;
        (first..end).step_by(side).map(|start| start..(start + side).min(end)).collect()
    };
    let (columns, rows) = (cut(work.shown.unrolled.lead(), width), cut(0, height));
    let mut wanted = vec![false; rows.len() * columns.len()];
    for part in parts {
        let across = part.columns.start / side..part.columns.end.div_ceil(side).min(columns.len());
        for row in part.rows.start / side..part.rows.end.div_ceil(side).min(rows.len()) {
            wanted[row * columns.len()..][across.clone()].fill(true);
        }
    }
    let tile = |at: usize| {
        let (columns, rows) = (columns[at % columns.len()].clone(), rows[at / columns.len()].clone());
        if wanted[at] { BlendTile::new(work, columns, rows) } else { BlendTile { columns, rows, shown: Vec::new() } }
    };
    let tiles: Vec<BlendTile> = (0..wanted.len()).into_par_iter().map(tile).collect();
    let of_wanted = |strips: Vec<Vec<usize>>| -> Vec<Vec<usize>> {
        let wanted = |strip: Vec<usize>| strip.into_iter().filter(|&at| wanted[at]).collect();
        strips.into_iter().map(wanted).collect()
    };
    let along_x = |thick: usize| {
        of_wanted(strips(columns.len(), rows.len(), thick / side, |along, across| across * columns.len() + along))
    };
    let along_y = |thick: usize| {
        of_wanted(strips(rows.len(), columns.len(), thick / side, |along, across| along * columns.len() + across))
    };
    let wanted = |at: usize| {
        let tile = [&tiles[at].columns, &tiles[at].rows];
        let (columns, rows) = sampled_window(tile, work.first_level, work.shown.unrolled);
        held.wanted(&tiles[at].shown, Window { columns: &columns, rows: &rows })
    };
    let in_batches = |strips: Vec<Vec<usize>>| -> Result<Vec<Batch>> {
        let mut batches = Vec::new();
        for strip in strips {
            let strip = strip.into_iter().map(|at| (&tiles[at], wanted(at)));
            split(strip, |wanted| held.size(wanted), room, &mut batches)?;
        }
        Ok(batches)
    };
    if held.is_in_parts() {
        // Other strips want other rows: what counts is how often photographs are decoded.
        let each = PARTS_STRIPS.into_iter().flat_map(|thick| [in_batches(along_y(thick)), in_batches(along_x(thick))]);
        let decoded = |batches: &Vec<Batch>| batches.iter().map(|batch| batch.shown.len()).sum::<usize>();
        return Ok(each.collect::<Result<Vec<_>>>()?.into_iter().min_by_key(decoded).unwrap_or_default());
    }
    let (along_x, along_y) = (along_x(STRIP), along_y(STRIP));
    let (x, y) = (most_alive(&along_x, &tiles, held.bytes()), most_alive(&along_y, &tiles, held.bytes()));
    in_batches(if x < y || x == y && width >= height { along_x } else { along_y })
}

/// Sides of a region, in photographs: of a larger one more is lost with a computer that fails, of a smaller one more
/// photographs are read for two or more regions. One of 4 reads a photograph (1 + 1 / 4)^2 = 1.6 times.
const REGION_PHOTOGRAPHS: f64 = 4.0;

/// The `parts` of a canvas in regions of whole tiles, which have no tile in common, each with what of the parts lies in
/// it.
pub(super) fn regions(unrolled: &Unrolled<'_>, first_level: u32, parts: &[Rectangle]) -> Vec<Vec<Rectangle>> {
    let [width, height] = unrolled.finished();
    let tile = tile_side(first_level);
    // The cast saturates.
    let side = (REGION_PHOTOGRAPHS * unrolled.original_layout().photograph_side()) as usize;
    let side = side.clamp(1, width.max(height)).next_multiple_of(tile);
    let within = |top: usize, left: usize| {
        let region = Rectangle { columns: left..left + side, rows: top..top + side };
        let part = |part: &Rectangle| {
            let part =
                Rectangle { columns: common(&part.columns, &region.columns), rows: common(&part.rows, &region.rows) };
            (part.area() > 0).then_some(part)
        };
        parts.iter().filter_map(part).collect::<Vec<_>>()
    };
    let places = (0..height).step_by(side).flat_map(|top| (0..width).step_by(side).map(move |left| (top, left)));
    places.map(|(top, left)| within(top, left)).filter(|parts| !parts.is_empty()).collect()
}

/// Indices of the tiles of every strip, so many tiles `thick`; within a strip, those that lie side by side across it
/// follow each other.
fn strips(along: usize, across: usize, thick: usize, index: impl Fn(usize, usize) -> usize) -> Vec<Vec<usize>> {
    let thick = thick.max(1);
    (0..along)
        .step_by(thick)
        .map(|start| {
            let end = (start + thick).min(along);
            (0..across)
                .flat_map(|across| (start..end).map(move |along| (along, across)))
                .map(|(a, b)| index(a, b))
                .collect()
        })
        .collect()
}

/// The most bytes of photographs that are in memory at once if each stays from the first strip that shows it to the
/// last.
fn most_alive(strips: &[Vec<usize>], tiles: &[BlendTile], bytes: &[usize]) -> usize {
    let mut spans: Vec<Option<[usize; 2]>> = vec![None; bytes.len()];
    for (index, strip) in strips.iter().enumerate() {
        for &label in strip.iter().flat_map(|&at| &tiles[at].shown) {
            if let Some(span) = spans.get_mut(usize::from(label)) {
                *span = Some([span.map_or(index, |[first, _]| first), index]);
            }
        }
    }
    (0..strips.len())
        .map(|strip| {
            let alive = |span: &Option<[usize; 2]>| span.is_some_and(|[first, last]| (first..=last).contains(&strip));
            spans.iter().zip(bytes).filter(|(span, _)| alive(span)).map(|(_, bytes)| bytes).sum()
        })
        .max()
        .unwrap_or(0)
}

/// Adds the tiles of a strip, with what each wants of photographs, in as few batches as there is room for what they
/// want, of which `size` says how much it is.
fn split<'a>(
    strip: impl Iterator<Item = (&'a BlendTile, WantedRows)>,
    size: impl Fn(&WantedRows) -> usize,
    room: Room,
    batches: &mut Vec<Batch>,
) -> Result<()> {
    let mut batch = Batch { tiles: Vec::new(), shown: WantedRows::new() };
    for (tile, own) in strip {
        if size(&own) > room.most {
            return Err(too_many(own.len(), size(&own), room.most));
        }
        let mut joined = batch.shown.clone();
        join(&mut joined, &own);
        if size(&joined) > room.usual && !batch.tiles.is_empty() {
            batches.push(std::mem::replace(&mut batch, Batch { tiles: Vec::new(), shown: own }));
        } else {
            batch.shown = joined;
        }
        batch.tiles.push(tile.clone());
    }
    batches.push(batch);
    Ok(())
}

fn too_many(count: usize, needed: usize, room: usize) -> Error {
    let words = |bytes: usize| needed_in_words(bytes as u64);
    Error::Limits {
        subject: format!("{count} photographs that meet at one place"),
        needed: format!("{} of memory for them", words(needed)),
        allowed: room_in_words(room as u64),
        hint: format!("Raise --memory (resources.memory) by {}.", words(needed - room)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::Label;

    /// Photographs of 10 bytes each. Of three tiles that show two, the first and the second have one in common; a
    /// fourth shows three.
    #[test]
    fn a_tile_that_shows_more_than_usual_is_finished_by_itself() {
        let tile = |shown: &[Label]| BlendTile { columns: 0..1, rows: 0..1, shown: shown.to_vec() };
        let tiles = [tile(&[0, 1]), tile(&[1, 2]), tile(&[3, 4]), tile(&[2, 3, 4])];
        let shown = |room: Room| -> Option<Vec<Vec<Label>>> {
            let whole = |tile: &BlendTile| tile.shown.iter().map(|&label| (label, 0..5)).collect();
            let strip = tiles.iter().map(|tile| (tile, whole(tile)));
            let mut batches = Vec::new();
            split(strip, |wanted| 10 * wanted.len(), room, &mut batches).ok()?;
            Some(batches.into_iter().map(|batch| batch.shown.into_keys().collect()).collect())
        };
        let all = |shown: &[&[Label]]| Some(shown.iter().map(|labels| labels.to_vec()).collect());
        assert_eq!(shown(Room::UNLIMITED), all(&[&[0, 1, 2, 3, 4]]));
        assert_eq!(shown(Room { usual: 30, most: 30 }), all(&[&[0, 1, 2], &[2, 3, 4]]));
        assert_eq!(shown(Room { usual: 20, most: 30 }), all(&[&[0, 1], &[1, 2], &[3, 4], &[2, 3, 4]]));
        assert_eq!(shown(Room { usual: 20, most: 29 }), None);
    }
}
