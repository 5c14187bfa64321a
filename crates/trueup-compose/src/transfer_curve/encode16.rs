//! From linear light, or its square root, to 16-bit samples.

use std::sync::{Arc, LazyLock};

use trueup_core::color::TransferCurve;

use super::ScaledCurve;
use super::by_curve::scaled_table_of;

/// Steps of [`Encode16`]. Against the square root of linear light sRGB's curve bends by at most 25.8 (twice its slope
/// near black, 12.92), so that the chord between entries is off by 25.8 / 8 / 4095^2 = 2e-7: an 80th of a 16-bit step.
/// Where the curve's two pieces meet its slope changes by 0.025, and the chord across is off by up to 0.025 / 4 / 4095:
/// a tenth of a step. A plain gamma of 2.2 is off by up to 1.3 steps between black and the first entry.
const ROOT_STEPS: usize = 4095;

/// 16-bit levels from linear light, off by hardly more than the rounding.
#[derive(Debug)]
pub(crate) struct Encode16 {
    /// Value, 0 to 65535, where the square root is entry `i` / 4095, and the difference to the next entry.
    entries: [[f32; 2]; ROOT_STEPS + 1],
    /// Whether entries are by the fourth root of the light.
    is_fourth_root: bool,
}

impl Encode16 {
    /// The table of a curve.
    pub(crate) fn of<'a>(curve: impl Into<ScaledCurve<'a>>) -> Arc<Self> {
        static SRGB: LazyLock<Arc<Encode16>> = LazyLock::new(|| Arc::new(Encode16::new((&TransferCurve::SRGB).into())));
        scaled_table_of(curve.into(), &SRGB, Self::new)
    }

    fn new(curve: ScaledCurve) -> Self {
        let value = |index: usize| {
            let root = index.min(ROOT_STEPS) as f64 / ROOT_STEPS as f64;
            65535.0 * curve.encoded(curve.light_of_root(root))
        };
        let entry = |index| [value(index) as f32, (value(index + 1) - value(index)) as f32];
        Self { entries: std::array::from_fn(entry), is_fourth_root: curve.keeps_light() }
    }

    /// The nearest 16-bit level; values outside 0 to 1 are clamped, NaN gives 0.
    #[inline(always)]
    pub(crate) fn level(&self, linear: f32) -> u16 {
        // `max` first: unlike `clamp`, it turns NaN into a number.
        #[allow(clippy::manual_clamp)]
        let root = linear.max(0.0).min(1.0).sqrt();
        let position = if self.is_fourth_root { root.sqrt() } else { root } * ROOT_STEPS as f32;
        let index = position as usize;
        let [value, step] = self.entries[index.min(ROOT_STEPS)];
        // The addition rounds; the conversion truncates.
        ((position - index as f32) * step + value + 0.5) as u16
    }
}

/// 16-bit levels from the square root of linear light in 16 bits.
///
/// The roots are as fine as the levels of sRGB but for the darkest hundredth, where a root spans up to 1.45 of them.
#[derive(Debug)]
pub(crate) struct EncodeRoots16 {
    levels: Vec<u16>,
}

impl EncodeRoots16 {
    /// The table of a curve.
    pub(crate) fn of<'a>(curve: impl Into<ScaledCurve<'a>>) -> Arc<Self> {
        static SRGB: LazyLock<Arc<EncodeRoots16>> =
            LazyLock::new(|| Arc::new(EncodeRoots16::new((&TransferCurve::SRGB).into())));
        scaled_table_of(curve.into(), &SRGB, Self::new)
    }

    fn new(curve: ScaledCurve) -> Self {
        let level = |root: u16| {
            let root = f64::from(root) / 65535.0;
            (65535.0 * curve.encoded(curve.light_of_root(root))).round() as u16
        };
        Self { levels: (0..=u16::MAX).map(level).collect() }
    }

    /// The nearest 16-bit level; 65535 is white.
    #[inline(always)]
    pub(crate) fn level(&self, root: u16) -> u16 {
        self.levels[usize::from(root)]
    }
}
