//! From 8-bit samples to linear light.

use std::sync::{Arc, LazyLock};

use trueup_core::color::TransferCurve;

use super::by_curve::table_of;
use crate::linear_table::LinearTable;

/// Table steps between two 8-bit levels. The curve between two entries is replaced by its chord, which is off by less
/// than 4e-8 of full scale, a 400th of a 16-bit step; where a curve has a kink, by a fifth of a step.
const STEPS_PER_LEVEL: usize = 16;

/// Length of the table: 255 levels of 16 steps and the end, filled up to a power of two.
pub(crate) const ENTRIES: usize = 4096;

/// Linear light from samples on the scale of 0 to 255, whole or between.
#[derive(Debug)]
pub(crate) struct Linearize {
    /// Values at `i` / 16 levels.
    values: LinearTable<ENTRIES>,
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
        Self { values: LinearTable::new(|index| values[index.min(last)]) }
    }

    /// The table, and its steps for each level of a sample.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(crate) fn table(&self) -> (&LinearTable<ENTRIES>, f32) {
        (&self.values, STEPS_PER_LEVEL as f32)
    }

    /// Linear light, 0 to 1, of a sample on the scale of 0 to 255; values outside are clamped, NaN gives 0.
    #[inline(always)]
    pub(crate) fn linear(&self, level: f32) -> f32 {
        self.values.at(position(level))
    }

    /// [`Self::linear`] of `COUNT` samples.
    #[inline(always)]
    pub(crate) fn linear_all<const COUNT: usize>(&self, mut levels: [f32; COUNT]) -> [f32; COUNT] {
        // A loop: `map` is a function of its own to the compiler, without the caller's vector instructions.
        for level in &mut levels {
            *level = position(*level);
        }
        self.values.at_all(levels)
    }
}

/// Where a sample lies in the table.
#[inline(always)]
fn position(level: f32) -> f32 {
    // `max` first: unlike `clamp`, it turns NaN into a number.
    #[allow(clippy::manual_clamp)]
    let level = level.max(0.0).min(255.0);
    level * STEPS_PER_LEVEL as f32
}
