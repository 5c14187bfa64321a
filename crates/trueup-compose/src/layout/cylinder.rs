//! The canvas as a cylinder: photographs whole turns apart are the same.

use std::borrow::Cow;
use std::ops::Range;

use super::canvas::{CanvasLayout, Placed};

/// Samples that a turn has at least at the coarsest level that repeats exactly. Twice as many would change the scale by
/// half as much, at most a 128th instead of a 64th, and leave too narrow transitions where few photographs make up a
/// turn.
const LEAST_SAMPLES: usize = 32;

/// Columns of the finest samples that are blended as a whole: a turn has a whole number at least of these.
const LEAST_UNIT: usize = 8;

/// A cylinder about so wide has a whole number of times so many columns, a power of two. All levels of a blend whose
/// samples are no wider repeat exactly from turn to turn. On one of a few pixels it is a single column: nothing is
/// blended there.
pub(crate) fn unit_of_turn(width: usize) -> usize {
    let unit = 1 << (width / LEAST_SAMPLES).max(1).ilog2();
    if width < LEAST_SAMPLES { 1 } else { unit.max(LEAST_UNIT) }
}

/// Turns that a photograph of [`Placed::in_first_turn`] may reach into: its own, those that a very wide one takes up.
pub(crate) const TURNS: usize = 4;

impl CanvasLayout {
    /// The layout without its period: every photograph at every place at which it meets the columns from `-reach` to
    /// `width + reach`. With `reach`, the canvas is wider by it on both sides and begins that much farther left.
    ///
    /// Gives for each of the photographs placed the position of its original. Without a period nothing changes.
    pub(crate) fn unrolled(&self, reach: usize) -> (Cow<'_, Self>, Vec<usize>) {
        let Some(period) = self.period else { return (Cow::Borrowed(self), (0..self.placed.len()).collect()) };
        let (mut placed, mut originals) = (Vec::new(), Vec::new());
        let (reach_px, width) = (reach as f64, self.width as f64);
        for (position, item) in self.placed.iter().enumerate() {
            let (low, high) = item.mesh.bounds();
            // One pixel more for what the border's pixels take from beyond it.
            let first = ((-reach_px - high.x - 1.0) / period as f64).ceil();
            let last = ((width + reach_px - low.x + 1.0) / period as f64).floor();
            let mut turn = first;
            while turn <= last {
                placed.push(item.moved(turn * period as f64 + reach_px));
                originals.push(position);
                turn += 1.0;
            }
        }
        (Cow::Owned(Self { width: self.width + 2 * reach, placed, period: None, ..*self }), originals)
    }
}

/// The columns of a photograph of [`Placed::in_first_turn`], beginning in the first turn and not longer than one. One
/// that goes all the way round is to be turned to the right by the second number of columns, after which it begins
/// at 0.
pub(crate) fn columns_around(columns: Range<usize>, period: Option<usize>) -> (Range<usize>, usize) {
    let Some(period) = period else { return (columns, 0) };
    let start = columns.start % period;
    if columns.len() >= period { (0..period, start) } else { (start..start + columns.len(), 0) }
}

impl Placed {
    /// The photograph moved to the right.
    pub(crate) fn moved(&self, by: f64) -> Self {
        let mut moved = self.clone();
        for vertex in &mut moved.mesh.target {
            vertex[0] += by;
        }
        moved
    }

    /// The photograph moved by whole turns, so that it begins in the first turn or soon after and no column before it
    /// is wanted for its border; without a period where it is.
    pub(crate) fn in_first_turn(&self, period: Option<usize>) -> Cow<'_, Self> {
        let Some(period) = period else { return Cow::Borrowed(self) };
        // As a share of the period: pixels of any smaller canvas that the border cuts.
        const RIM: f64 = 1.0 / 16.0;
        let turns = RIM - self.mesh.bounds().0.x / period as f64;
        let moved = turns.ceil() * period as f64;
        if moved == 0.0 { Cow::Borrowed(self) } else { Cow::Owned(self.moved(moved)) }
    }
}
