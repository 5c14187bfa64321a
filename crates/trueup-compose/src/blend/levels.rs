//! The levels that are blended as a whole.

use crate::layout::{CanvasLayout, unit_of_turn};
use crate::pyramid::first_level;

/// Which levels of a canvas are blended as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct WholeLevels {
    /// Log2 of the pixels per sample of the finest of them.
    pub(crate) first_level: u32,
    /// How many lie above it.
    pub(crate) above: u32,
}

impl WholeLevels {
    /// Those of a canvas; `transition` is the widest that is wanted, as a share of the photographs' side.
    pub(crate) fn of(layout: &CanvasLayout, transition: f64) -> Self {
        let first_level = first_level([layout.width, layout.height]);
        Self { first_level, above: levels_above(layout, first_level, transition) }
    }
}

/// Levels above the first that is blended as a whole, so that the coarsest samples are as wide as the widest transition
/// wanted, but on a cylinder no wider than those of which a turn has a whole number.
fn levels_above(layout: &CanvasLayout, first_level: u32, transition: f64) -> u32 {
    let wanted = (transition * layout.photograph_side()).max(1.0).log2().round();
    // A turn that no layout makes has samples of its own at every turn, rather than hardly any transitions.
    let repeats = layout.period.filter(|&period| period > 0 && period.is_multiple_of(unit_of_turn(period)));
    let widest = repeats.map_or(u32::MAX, usize::trailing_zeros);
    (wanted as u32).min(widest).saturating_sub(first_level).min(MOST_LEVELS)
}

/// 2^(3 + 12) pixels are wider than any photograph.
const MOST_LEVELS: u32 = 12;
