//! From 8-bit samples to linear light.

use std::sync::{Arc, LazyLock};

use trueup_core::color::TransferCurve;

use super::by_curve::table_of;

/// Table steps between two 8-bit levels. The curve between two entries is replaced by its chord, which is off by less
/// than 4e-8 of full scale, a 400th of a 16-bit step; where a curve has a kink, by a fifth of a step.
const STEPS_PER_LEVEL: usize = 16;

/// Length of the table: 255 levels of 16 steps and the end, filled up to a power of two.
const ENTRIES: usize = 4096;

/// Linear light from samples on the scale of 0 to 255, whole or between.
#[derive(Debug)]
pub(crate) struct Linearize {
    /// Value at entry `i` / 16 levels, and the difference to the next entry.
    entries: [[f32; 2]; ENTRIES],
}

impl Linearize {
    /// The table of a curve.
    pub(crate) fn of(curve: &TransferCurve) -> Arc<Self> {
        static SRGB: LazyLock<Arc<Linearize>> = LazyLock::new(|| Arc::new(Linearize::new(&TransferCurve::SRGB)));
        table_of(curve, &SRGB, Self::new)
    }

    fn new(curve: &TransferCurve) -> Self {
        let last = 255 * STEPS_PER_LEVEL;
        let values: Vec<f64> = (0..=last).map(|index| curve.linear(index as f64 / last as f64)).collect();
        let value = |index: usize| values[index.min(last)];
        let entry = |index| [value(index) as f32, (value(index + 1) - value(index)) as f32];
        Self { entries: std::array::from_fn(entry) }
    }

    /// Linear light, 0 to 1, of a sample on the scale of 0 to 255; values outside are clamped, NaN gives 0.
    #[inline(always)]
    pub(crate) fn linear(&self, level: f32) -> f32 {
        // Adding 1.5 * 2^23 rounds to a whole number and leaves it in the low bits: cheaper than a checked cast.
        const ROUNDING: f32 = 12_582_912.0;
        // `max` first: unlike `clamp`, it turns NaN into a number.
        #[allow(clippy::manual_clamp)]
        let position = level.max(0.0).min(255.0) * STEPS_PER_LEVEL as f32;
        // Half a step lower, rounding gives the entry at or below; at an entry itself either side of it will do.
        let rounded = (position - 0.5) + ROUNDING;
        let [value, step] = self.entries[rounded.to_bits() as usize % ENTRIES];
        value + (position - (rounded - ROUNDING)) * step
    }
}
