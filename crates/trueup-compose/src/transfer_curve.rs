//! The sRGB transfer curve, both ways, by table.
//!
//! # Source
//! IEC 61966-2-1:1999, equations 5 to 7.

use std::sync::LazyLock;

/// Encoded value (0 to 1) to linear light (0 to 1), by the formula.
fn linear_from_encoded(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Table steps between two 8-bit levels. The curve between two entries is replaced by its chord, which is off by less
/// than 4e-8 of full scale: a 400th of a 16-bit step.
const STEPS_PER_LEVEL: usize = 16;

/// Length of the table: 255 levels of 16 steps and the end, filled up to a power of two.
const ENTRIES: usize = 4096;

/// Linear light from samples on the scale of 0 to 255, whole or between.
#[derive(Debug)]
pub(crate) struct Linearise {
    /// Value at entry `i` / 16 levels, and the difference to the next entry.
    entries: [[f32; 2]; ENTRIES],
}

impl Linearise {
    /// The table of the process.
    pub(crate) fn table() -> &'static Self {
        static TABLE: LazyLock<Linearise> = LazyLock::new(|| {
            let last = 255 * STEPS_PER_LEVEL;
            let value = |index: usize| linear_from_encoded(index.min(last) as f64 / last as f64);
            let entry = |index| [value(index) as f32, (value(index + 1) - value(index)) as f32];
            Linearise { entries: std::array::from_fn(entry) }
        });
        &TABLE
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

/// 8-bit sRGB from linear light, exact to rounding.
#[derive(Debug)]
pub(crate) struct Encode {
    /// Level at the lower end of every bucket of the float's exponent and leading mantissa bits.
    bucket_level: Vec<u8>,
    /// Smallest linear value that rounds to level `i + 1`; the last one is never reached.
    threshold: [f32; 256],
}

/// Mantissa bits that select a bucket. A bucket is then 1/128 of its value wide and spans less than one 8-bit level
/// (0.9 of a level at white), so that one comparison settles the rounding.
const BUCKET_BITS: u32 = 7;
/// Values below are level 0: the first threshold is 0.5 / 255 / 12.92 = 1.5e-4, above 2^-13.
const SMALLEST: f32 = 1.0 / 8192.0;

impl Encode {
    /// The table of the process.
    pub(crate) fn table() -> &'static Self {
        static TABLE: LazyLock<Encode> = LazyLock::new(|| {
            let mut threshold = [f32::INFINITY; 256];
            for (level, value) in threshold.iter_mut().enumerate().take(255) {
                *value = linear_from_encoded((level as f64 + 0.5) / 255.0) as f32;
            }
            let buckets = Encode::bucket(1.0) + 1;
            let bucket_level = (0..buckets)
                .map(|bucket| {
                    let low = f32::from_bits(SMALLEST.to_bits() + ((bucket as u32) << (23 - BUCKET_BITS)));
                    threshold.partition_point(|&limit| limit <= low) as u8
                })
                .collect();
            Encode { bucket_level, threshold }
        });
        &TABLE
    }

    #[inline(always)]
    fn bucket(linear: f32) -> usize {
        ((linear.to_bits() - SMALLEST.to_bits()) >> (23 - BUCKET_BITS)) as usize
    }

    /// The nearest 8-bit level; values outside 0 to 1 are clamped, NaN gives 0.
    #[inline(always)]
    pub(crate) fn level(&self, linear: f32) -> u8 {
        // NaN fails the comparison and becomes level 0.
        let linear = if linear >= SMALLEST { linear.min(1.0) } else { SMALLEST };
        let level = self.bucket_level[Encode::bucket(linear)];
        level + u8::from(linear >= self.threshold[usize::from(level)])
    }
}

/// 8-bit sRGB from the square root of linear light in 16 bits.
#[derive(Debug)]
pub(crate) struct EncodeRoots {
    levels: Vec<u8>,
}

impl EncodeRoots {
    /// The table of the process.
    pub(crate) fn table() -> &'static Self {
        static TABLE: LazyLock<EncodeRoots> = LazyLock::new(|| {
            let level = |root: u16| {
                let root = f32::from(root) / 65535.0;
                Encode::table().level(root * root)
            };
            EncodeRoots { levels: (0..=u16::MAX).map(level).collect() }
        });
        &TABLE
    }

    /// The nearest 8-bit level; 65535 is white.
    #[inline(always)]
    pub(crate) fn level(&self, root: u16) -> u8 {
        self.levels[usize::from(root)]
    }
}

/// Linear light (0 to 1) to encoded value (0 to 1), by the formula.
fn encoded_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Steps of [`Encode16`]. Against the square root of linear light the curve bends by at most 25.8 (twice its slope near
/// black, 12.92), so that the chord between entries is off by 25.8 / 8 / 4095^2 = 2e-7: an 80th of a 16-bit step. Where the curve's two pieces meet its slope changes by 0.025, and
/// the chord across is off by up to 0.025 / 4 / 4095: a tenth of a step.
const ROOT_STEPS: usize = 4095;

/// 16-bit sRGB from linear light, off by hardly more than the rounding.
#[derive(Debug)]
pub(crate) struct Encode16 {
    /// Value, 0 to 65535, where the square root is entry `i` / 4095, and the difference to the next entry.
    entries: [[f32; 2]; ROOT_STEPS + 1],
}

impl Encode16 {
    /// The table of the process.
    pub(crate) fn table() -> &'static Self {
        static TABLE: LazyLock<Encode16> = LazyLock::new(|| {
            let value = |index: usize| {
                let root = index.min(ROOT_STEPS) as f64 / ROOT_STEPS as f64;
                65535.0 * encoded_from_linear(root * root)
            };
            let entry = |index| [value(index) as f32, (value(index + 1) - value(index)) as f32];
            Encode16 { entries: std::array::from_fn(entry) }
        });
        &TABLE
    }

    /// The nearest 16-bit level; values outside 0 to 1 are clamped, NaN gives 0.
    #[inline(always)]
    pub(crate) fn level(&self, linear: f32) -> u16 {
        // `max` first: unlike `clamp`, it turns NaN into a number.
        #[allow(clippy::manual_clamp)]
        let position = linear.max(0.0).min(1.0).sqrt() * ROOT_STEPS as f32;
        let index = position as usize;
        let [value, step] = self.entries[index.min(ROOT_STEPS)];
        // The addition rounds; the conversion truncates.
        ((position - index as f32) * step + value + 0.5) as u16
    }
}

/// 16-bit sRGB from the square root of linear light in 16 bits.
///
/// The roots are as fine as the levels but for the darkest hundredth, where a root spans up to 1.45 of them.
#[derive(Debug)]
pub(crate) struct EncodeRoots16 {
    levels: Vec<u16>,
}

impl EncodeRoots16 {
    /// The table of the process.
    pub(crate) fn table() -> &'static Self {
        static TABLE: LazyLock<EncodeRoots16> = LazyLock::new(|| {
            let level = |root: u16| {
                let root = f64::from(root) / 65535.0;
                (65535.0 * encoded_from_linear(root * root)).round() as u16
            };
            EncodeRoots16 { levels: (0..=u16::MAX).map(level).collect() }
        });
        &TABLE
    }

    /// The nearest 16-bit level; 65535 is white.
    #[inline(always)]
    pub(crate) fn level(&self, root: u16) -> u16 {
        self.levels[usize::from(root)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_survives_the_round_trip() {
        for level in 0..=255_u8 {
            let linear = Linearise::table().linear(f32::from(level));
            assert_eq!(Encode::table().level(linear), level);
            assert_eq!(EncodeRoots::table().level((linear.sqrt() * 65535.0 + 0.5) as u16), level);
        }
    }

    #[test]
    fn encoding_rounds_as_the_formula_does() {
        let steps = 200_000;
        for step in 0..=steps {
            let linear = step as f32 / steps as f32;
            let exact = 255.0 * encoded_from_linear(f64::from(linear));
            let level = f64::from(Encode::table().level(linear));
            assert!((level - exact).abs() <= 0.5 + 1e-3, "{linear}: {level} for {exact}");
        }
        for (value, level) in [(-1.0, 0), (0.0, 0), (1.0, 255), (7.0, 255), (f32::NAN, 0), (f32::INFINITY, 255)] {
            assert_eq!(Encode::table().level(value), level);
        }
    }

    #[test]
    fn sixteen_bits_are_off_by_hardly_more_than_half_a_level() {
        let steps = 3_000_000;
        let mut last = 0;
        for step in 0..=steps {
            // Finer near black, where the curve is steep.
            let linear = (step as f32 / steps as f32).powi(2);
            let exact = 65535.0 * encoded_from_linear(f64::from(linear));
            let level = Encode16::table().level(linear);
            assert!((f64::from(level) - exact).abs() <= 0.6, "{linear}: {level} for {exact}");
            assert!(level >= last, "{linear}");
            last = level;
        }
        for (value, level) in [(-1.0, 0), (0.0, 0), (1.0, 65535), (7.0, 65535), (f32::NAN, 0), (f32::INFINITY, 65535)] {
            assert_eq!(Encode16::table().level(value), level);
        }
    }

    /// The roots of neighbouring levels differ; a level that passes through them comes back to within the root's own step.
    #[test]
    fn sixteen_bits_pass_through_roots() {
        for level in 0..=u16::MAX {
            let linear = linear_from_encoded(f64::from(level) / 65535.0);
            let back = EncodeRoots16::table().level((linear.sqrt() * 65535.0).round() as u16);
            assert!(back.abs_diff(level) <= 1, "{level}: {back}");
        }
        assert_eq!(EncodeRoots16::table().level(0), 0);
        assert_eq!(EncodeRoots16::table().level(65535), 65535);
    }

    #[test]
    fn linear_light_between_levels_follows_the_formula() {
        for step in 0..=25_500 {
            let level = step as f32 / 100.0;
            let exact = linear_from_encoded(f64::from(level) / 255.0);
            assert!((f64::from(Linearise::table().linear(level)) - exact).abs() < 2e-7);
        }
        assert_eq!(Linearise::table().linear(-9.0), 0.0);
        assert_eq!(Linearise::table().linear(400.0), 1.0);
        assert_eq!(Linearise::table().linear(f32::NAN), 0.0);
    }
}
