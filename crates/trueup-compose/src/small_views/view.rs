//! Photographs as the search for seams sees them: small, corrected, on the canvas.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use trueup_core::raster::luma_256ths;

use crate::distance::border_distances;

/// What is known of one pixel of a [`SmallView`] beside its color.
///
/// The photograph covers it in part.
pub const PARTLY: u8 = 1;
/// The photograph covers it wholly.
pub const WHOLLY: u8 = 2;
/// The camera's sensor was saturated there: brighter detail is lost.
pub const CLIPPED: u8 = 4;
/// The user does not want this photograph here, if another one can be had.
pub const IGNORED: u8 = 8;
/// The user wants this photograph here.
pub const KEPT: u8 = 16;

/// One pixel of a view: red, green and blue (square root of linear light, 255 is white; where what is brighter than
/// white is kept, as it is written with 8 bits) and flags.
pub type SmallPixel = [u8; 4];

/// Brightness of a pixel in 256ths of a level: Rec. 601 luma.
pub(crate) fn luma(pixel: &SmallPixel) -> u32 {
    let &[red, green, blue, _] = pixel;
    luma_256ths([red, green, blue])
}

/// A photograph on a small canvas: the box it lies in.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SmallView {
    /// Columns of the small canvas; on a cylinder they may run past its width into the next turn, but not meet
    /// themselves.
    pub columns: Range<usize>,
    /// Rows of the small canvas.
    pub rows: Range<usize>,
    /// Row-major pixels of the box.
    #[serde(with = "crate::bulk")]
    pub pixels: Vec<SmallPixel>,
}

impl SmallView {
    /// Index of the canvas pixel (x, y), if it is in the box.
    #[inline]
    pub(crate) fn index(&self, x: usize, y: usize) -> Option<usize> {
        (self.columns.contains(&x) && self.rows.contains(&y))
            .then(|| (y - self.rows.start) * self.columns.len() + x - self.columns.start)
    }

    /// The same on a cylinder of `turn` columns, or with 0 on a plane.
    #[inline]
    pub(crate) fn index_around(&self, x: usize, y: usize, turn: usize) -> Option<usize> {
        self.index(if self.columns.contains(&x) { x } else { x + turn }, y)
    }

    /// Flags of the canvas pixel (x, y); 0 outside. `turn` as for [`Self::index_around`].
    #[inline]
    pub(crate) fn flags(&self, x: usize, y: usize, turn: usize) -> u8 {
        self.index_around(x, y, turn).map_or(0, |index| self.pixels[index][3])
    }

    /// Whether the boxes of two views meet or touch on a cylinder of `turn` columns, or with 0 on a plane.
    pub(crate) fn meets(&self, other: &Self, turn: usize) -> bool {
        let meet = |a: &Range<usize>, b: &Range<usize>, by: usize| a.start <= b.end + by && b.start + by <= a.end;
        let (mine, others) = (&self.columns, &other.columns);
        meet(&self.rows, &other.rows, 0)
            && (meet(mine, others, 0) || meet(mine, others, turn) || meet(others, mine, turn))
    }

    /// The view on a canvas of half the size: means of 2 x 2 pixels over those that are covered.
    pub(crate) fn halved(&self) -> Self {
        let half = |range: &Range<usize>| range.start / 2..range.end.div_ceil(2);
        let (columns, rows) = (half(&self.columns), half(&self.rows));
        let outside = vec![[0; 4]; self.columns.len()];
        let row = |y: usize| match self.rows.contains(&y) {
            true => &self.pixels[(y - self.rows.start) * self.columns.len()..][..self.columns.len()],
            false => &outside,
        };
        // An odd first column shares its pixel with what is outside, and so does a last one without a right neighbor.
        let alone = usize::from(!self.columns.is_empty()) * (self.columns.start % 2);
        let mut pixels = Vec::with_capacity(columns.len() * rows.len());
        for y in rows.clone() {
            let (first_upper, upper) = row(2 * y).split_at(alone);
            let (first_lower, lower) = row(2 * y + 1).split_at(alone);
            let ((upper, last_upper), (lower, last_lower)) = (upper.as_chunks::<2>(), lower.as_chunks::<2>());
            let lone = |(&upper, &lower): (&SmallPixel, &SmallPixel)| mean_of_four([upper, [0; 4], lower, [0; 4]]);
            pixels.extend(first_upper.iter().zip(first_lower).map(lone));
            pixels.extend(upper.iter().zip(lower).map(|(&[a, b], &[c, d])| mean_of_four([a, b, c, d])));
            pixels.extend(last_upper.iter().zip(last_lower).map(lone));
        }
        Self { columns, rows, pixels }
    }

    /// Distance of every pixel to the border of what is covered wholly.
    pub(crate) fn depths(&self) -> Depths {
        let covered: Vec<bool> = self.pixels.iter().map(|pixel| pixel[3] & WHOLLY != 0).collect();
        let distances = border_distances(&covered, self.columns.len());
        let largest = distances.iter().copied().max().unwrap_or(0).max(1);
        Depths { distances, largest }
    }
}

/// The mean of those of four pixels that are covered.
#[inline]
fn mean_of_four(four: [SmallPixel; 4]) -> SmallPixel {
    let any = four.iter().fold(0, |any, pixel| any | pixel[3]);
    let all = four.iter().fold(u8::MAX, |all, pixel| all & pixel[3]);
    let flags = any & !WHOLLY | all & WHOLLY;
    if any & PARTLY == 0 {
        return [0, 0, 0, flags];
    }
    let sum = |channel: usize| -> u16 {
        let level = |pixel: &SmallPixel| if pixel[3] & PARTLY != 0 { u16::from(pixel[channel]) } else { 0 };
        four.iter().map(level).sum()
    };
    // Most have all four; their mean takes no division.
    let count = if all & PARTLY != 0 { 4 } else { four.iter().filter(|pixel| pixel[3] & PARTLY != 0).count() as u16 };
    let mean = |channel: usize| match count {
        4 => ((sum(channel) + 2) / 4) as u8,
        _ => ((sum(channel) + count / 2) / count) as u8,
    };
    [mean(0), mean(1), mean(2), flags]
}

/// [`Depths::lack_of_room`] where there is none.
pub(crate) const WHOLE_LACK: i32 = 256;
/// The widest transitions reach over a tenth of a photograph's side (`render.transition`): a fifth of the way from its
/// border to its middle.
const ROOM_PARTS: u32 = 5;

/// How deep the pixels of a view lie inside its photograph.
#[derive(Debug)]
pub(crate) struct Depths {
    distances: Vec<u32>,
    largest: u32,
}

impl Depths {
    /// That of a pixel of the box, relative to the deepest, 0 to 255.
    #[inline]
    pub(crate) fn at(&self, index: usize) -> u8 {
        (u64::from(self.distances[index]) * 255 / u64::from(self.largest)) as u8
    }

    /// How much of the room that a wide transition takes is missing between a pixel of the box and the border, in
    /// [`WHOLE_LACK`]s; 0 deep inside.
    #[inline]
    pub(crate) fn lack_of_room(&self, index: usize) -> i32 {
        let room = (self.largest / ROOM_PARTS).max(1);
        let missing = room.saturating_sub(self.distances[index]);
        if missing == 0 { 0 } else { (u64::from(missing) * WHOLE_LACK as u64 / u64::from(room)) as i32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_keeps_to_what_is_covered() {
        let whole = PARTLY | WHOLLY;
        let pixels = vec![[10, 0, 0, whole], [20, 0, 0, whole | CLIPPED], [30, 9, 9, PARTLY], [99, 99, 99, 0]];
        let view = SmallView { columns: 2..4, rows: 6..8, pixels };
        let half = view.halved();
        assert_eq!((half.columns, half.rows), (1..2, 3..4));
        assert_eq!(half.pixels, [[20, 3, 3, PARTLY | CLIPPED]]);
        // An odd start shares its pixel with what is outside.
        let half = SmallView { columns: 1..2, rows: 0..2, pixels: vec![[8, 8, 8, whole]; 2] }.halved();
        assert_eq!(half.pixels, [[8, 8, 8, PARTLY]]);
    }

    #[test]
    fn depth_grows_towards_the_middle() {
        let view = SmallView { columns: 0..5, rows: 0..5, pixels: vec![[0, 0, 0, PARTLY | WHOLLY]; 25] };
        let depths = view.depths();
        assert_eq!((depths.at(0), depths.at(6), depths.at(12)), (85, 170, 255));
    }

    /// By hand: ten pixels are the deepest, two are room; the first row lacks half of it.
    #[test]
    fn beside_a_border_transitions_lack_room() {
        let view = SmallView { columns: 0..19, rows: 0..19, pixels: vec![[0, 0, 0, PARTLY | WHOLLY]; 19 * 19] };
        let depths = view.depths();
        assert_eq!([0, 1, 2].map(|row| depths.lack_of_room(row * 19 + 9)), [WHOLE_LACK / 2, 0, 0]);
    }
}
