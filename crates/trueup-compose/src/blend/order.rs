//! In which order tiles are finished: strip by strip, in batches whose photographs fit into memory.

use std::ops::Range;

use rayon::prelude::*;
use trueup_core::memory::{needed_in_words, room_in_words};
use trueup_core::{Error, Result};

use super::tile::BlendTile;
use super::work::BlendWork;
use crate::coverage::Rectangle;
use crate::label::Label;
use crate::layout::Unrolled;
use crate::pyramid::tile_side;
use crate::window::common;

/// Canvas pixels across a strip: enough tiles for all threads, few enough photographs.
const STRIP: usize = 512;

/// Tiles that are finished one after the other, and the photographs they are made of.
#[derive(Debug)]
pub(super) struct Batch {
    pub(super) tiles: Vec<BlendTile>,
    pub(super) shown: Vec<Label>,
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

/// The tiles of all `parts` of the canvas in batches whose photographs, of these sizes in `bytes`, have `room`.
/// Strips run across that side of the canvas which leaves fewer photographs in memory from one strip to the next.
///
/// # Errors
/// [`Error::Limits`] if a single tile is made of more.
pub(super) fn batches(work: &BlendWork<'_>, parts: &[Rectangle], bytes: &[usize], room: Room) -> Result<Vec<Batch>> {
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
    let along_x = of_wanted(strips(columns.len(), rows.len(), side, |along, across| across * columns.len() + along));
    let along_y = of_wanted(strips(rows.len(), columns.len(), side, |along, across| along * columns.len() + across));
    let (x, y) = (most_alive(&along_x, &tiles, bytes), most_alive(&along_y, &tiles, bytes));
    let strips = if x < y || x == y && width >= height { along_x } else { along_y };
    let mut batches = Vec::new();
    for strip in strips {
        split(&strip, &tiles, bytes, room, &mut batches)?;
    }
    Ok(batches)
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

/// Indices of the tiles of every strip; within a strip, those that lie side by side across it follow each other.
fn strips(along: usize, across: usize, side: usize, index: impl Fn(usize, usize) -> usize) -> Vec<Vec<usize>> {
    let thick = (STRIP / side).max(1);
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

/// Adds the tiles of a strip in as few batches as the room allows.
fn split(strip: &[usize], tiles: &[BlendTile], bytes: &[usize], room: Room, batches: &mut Vec<Batch>) -> Result<()> {
    let mut batch = Batch { tiles: Vec::new(), shown: Vec::new() };
    for tile in strip.iter().map(|&at| &tiles[at]) {
        let own: Vec<Label> = tile.shown.iter().copied().filter(|&label| usize::from(label) < bytes.len()).collect();
        let size = |labels: &[Label]| labels.iter().map(|&label| bytes[usize::from(label)]).sum::<usize>();
        if size(&own) > room.most {
            return Err(too_many(own.len(), size(&own), room.most));
        }
        let mut joined = batch.shown.clone();
        joined.extend(own.iter().filter(|label| !batch.shown.contains(label)));
        if size(&joined) > room.usual && !batch.tiles.is_empty() {
            batches.push(std::mem::replace(&mut batch, Batch { tiles: Vec::new(), shown: own }));
        } else {
            batch.shown = joined;
        }
        batch.tiles.push(tile.clone());
    }
    batches.push(batch);
    for batch in batches {
        batch.shown.sort_unstable();
    }
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

    /// Photographs of 10 bytes each. Of three tiles that show two, the first and the second have one in common; a
    /// fourth shows three.
    #[test]
    fn a_tile_that_shows_more_than_usual_is_finished_by_itself() {
        let tile = |shown: &[Label]| BlendTile { columns: 0..1, rows: 0..1, shown: shown.to_vec() };
        let tiles = [tile(&[0, 1]), tile(&[1, 2]), tile(&[3, 4]), tile(&[2, 3, 4])];
        let shown = |room: Room| -> Option<Vec<Vec<Label>>> {
            let mut batches = Vec::new();
            split(&[0, 1, 2, 3], &tiles, &[10; 5], room, &mut batches).ok()?;
            Some(batches.into_iter().map(|batch| batch.shown).collect())
        };
        let all = |shown: &[&[Label]]| Some(shown.iter().map(|labels| labels.to_vec()).collect());
        assert_eq!(shown(Room::UNLIMITED), all(&[&[0, 1, 2, 3, 4]]));
        assert_eq!(shown(Room { usual: 30, most: 30 }), all(&[&[0, 1, 2], &[2, 3, 4]]));
        assert_eq!(shown(Room { usual: 20, most: 30 }), all(&[&[0, 1], &[1, 2], &[3, 4], &[2, 3, 4]]));
        assert_eq!(shown(Room { usual: 20, most: 29 }), None);
    }
}
