//! The transfer curve of the panorama's colour space, both ways, by table.
//!
//! The tables of sRGB's curve are made once; those of another curve when they are asked for, which takes less than a
//! millisecond.

use std::sync::{Arc, LazyLock, OnceLock};

use trueup_core::colour::TransferCurve;

/// The table of a curve: sRGB's own if it is that, else a new one.
fn table_of<T>(curve: &TransferCurve, srgb: &LazyLock<Arc<T>>, new: impl Fn(&TransferCurve) -> T) -> Arc<T> {
    if *curve == TransferCurve::SRGB { (**srgb).clone() } else { Arc::new(new(curve)) }
}

/// Table steps between two 8-bit levels. The curve between two entries is replaced by its chord, which is off by less
/// than 4e-8 of full scale, a 400th of a 16-bit step; where a curve has a kink, by a fifth of a step.
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
    /// The table of a curve.
    pub(crate) fn of(curve: &TransferCurve) -> Arc<Self> {
        static SRGB: LazyLock<Arc<Linearise>> = LazyLock::new(|| Arc::new(Linearise::new(&TransferCurve::SRGB)));
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

/// 8-bit levels from linear light, exact to rounding.
#[derive(Debug)]
pub(crate) struct Encode {
    /// Level at the lower end of every bucket of the float's exponent and leading mantissa bits.
    bucket_level: Vec<u8>,
    /// Smallest linear value that rounds to level `i + 1`; the last one is never reached.
    threshold: [f32; 256],
    /// Values below are level 0.
    smallest: f32,
    /// Bits of a float below those that select a bucket.
    shift: u32,
}

/// Mantissa bits that select a bucket, at least and at most. With 7, a bucket is 1/128 of its value wide and spans less
/// than one 8-bit level of the usual curves (0.9 of a level at white for sRGB), so that one comparison settles the
/// rounding; straighter curves take more. At most, a curve that stands still may be a level off where it does.
const BUCKET_BITS: std::ops::RangeInclusive<u32> = 7..=10;

/// What counts as no light for every curve, beyond what a canvas of 16 bits holds: 2^-40.
const NO_LIGHT: f32 = 1.0 / (1_u64 << 40) as f32;

impl Encode {
    /// The table of a curve.
    pub(crate) fn of(curve: &TransferCurve) -> Arc<Self> {
        static SRGB: LazyLock<Arc<Encode>> = LazyLock::new(|| Arc::new(Encode::new(&TransferCurve::SRGB)));
        table_of(curve, &SRGB, Self::new)
    }

    fn new(curve: &TransferCurve) -> Self {
        let mut threshold = [f32::INFINITY; 256];
        for (level, value) in threshold.iter_mut().enumerate().take(255) {
            // Black stays black where a curve starts level, as tables of 16 bits do.
            *value = (curve.linear((level as f64 + 0.5) / 255.0) as f32).max(2.0 * NO_LIGHT);
        }
        // The power of two below the first threshold.
        let smallest = 0.5 * f32::from_bits(threshold[0].to_bits() & !((1 << 23) - 1));
        let mut table = Self { bucket_level: Vec::new(), threshold, smallest, shift: 0 };
        for bits in BUCKET_BITS {
            table.shift = 23 - bits;
            table.fill_buckets();
            let settled = table.bucket_level.windows(2).all(|pair| pair[1] - pair[0] <= 1);
            if settled {
                break;
            }
        }
        table
    }

    fn fill_buckets(&mut self) {
        let buckets = self.bucket(1.0) + 1;
        let level = |bucket: usize| {
            let low = f32::from_bits(self.smallest.to_bits() + ((bucket as u32) << self.shift));
            self.threshold.partition_point(|&limit| limit <= low) as u8
        };
        self.bucket_level = (0..buckets).map(level).collect();
    }

    #[inline(always)]
    fn bucket(&self, linear: f32) -> usize {
        ((linear.to_bits() - self.smallest.to_bits()) >> self.shift) as usize
    }

    /// The nearest 8-bit level; values outside 0 to 1 are clamped, NaN gives 0.
    #[inline(always)]
    pub(crate) fn level(&self, linear: f32) -> u8 {
        // NaN fails the comparison and becomes level 0.
        let linear = if linear >= self.smallest { linear.min(1.0) } else { self.smallest };
        let level = self.bucket_level[self.bucket(linear)];
        level + u8::from(linear >= self.threshold[usize::from(level)])
    }
}

/// 8-bit levels from the square root of linear light in 16 bits.
#[derive(Debug)]
pub(crate) struct EncodeRoots {
    levels: Vec<u8>,
}

impl EncodeRoots {
    /// The table of a curve.
    pub(crate) fn of(curve: &TransferCurve) -> Arc<Self> {
        static SRGB: LazyLock<Arc<EncodeRoots>> = LazyLock::new(|| Arc::new(EncodeRoots::new(&TransferCurve::SRGB)));
        table_of(curve, &SRGB, Self::new)
    }

    fn new(curve: &TransferCurve) -> Self {
        let encode = Encode::of(curve);
        let level = |root: u16| {
            let root = f32::from(root) / 65535.0;
            encode.level(root * root)
        };
        Self { levels: (0..=u16::MAX).map(level).collect() }
    }

    /// The nearest 8-bit level; 65535 is white.
    #[inline(always)]
    pub(crate) fn level(&self, root: u16) -> u8 {
        self.levels[usize::from(root)]
    }
}

/// Steps of [`Encode16`]. Against the square root of linear light sRGB's curve bends by at most 25.8 (twice its slope near
/// black, 12.92), so that the chord between entries is off by 25.8 / 8 / 4095^2 = 2e-7: an 80th of a 16-bit step. Where
/// the curve's two pieces meet its slope changes by 0.025, and the chord across is off by up to 0.025 / 4 / 4095: a tenth
/// of a step. A plain gamma of 2.2 is off by up to 1.3 steps between black and the first entry.
const ROOT_STEPS: usize = 4095;

/// 16-bit levels from linear light, off by hardly more than the rounding.
#[derive(Debug)]
pub(crate) struct Encode16 {
    /// Value, 0 to 65535, where the square root is entry `i` / 4095, and the difference to the next entry.
    entries: [[f32; 2]; ROOT_STEPS + 1],
}

impl Encode16 {
    /// The table of a curve.
    pub(crate) fn of(curve: &TransferCurve) -> Arc<Self> {
        static SRGB: LazyLock<Arc<Encode16>> = LazyLock::new(|| Arc::new(Encode16::new(&TransferCurve::SRGB)));
        table_of(curve, &SRGB, Self::new)
    }

    fn new(curve: &TransferCurve) -> Self {
        let value = |index: usize| {
            let root = index.min(ROOT_STEPS) as f64 / ROOT_STEPS as f64;
            65535.0 * curve.encoded(root * root)
        };
        let entry = |index| [value(index) as f32, (value(index + 1) - value(index)) as f32];
        Self { entries: std::array::from_fn(entry) }
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

/// 16-bit levels from the square root of linear light in 16 bits.
///
/// The roots are as fine as the levels of sRGB but for the darkest hundredth, where a root spans up to 1.45 of them.
#[derive(Debug)]
pub(crate) struct EncodeRoots16 {
    levels: Vec<u16>,
}

impl EncodeRoots16 {
    /// The table of a curve.
    pub(crate) fn of(curve: &TransferCurve) -> Arc<Self> {
        static SRGB: LazyLock<Arc<EncodeRoots16>> =
            LazyLock::new(|| Arc::new(EncodeRoots16::new(&TransferCurve::SRGB)));
        table_of(curve, &SRGB, Self::new)
    }

    fn new(curve: &TransferCurve) -> Self {
        let level = |root: u16| {
            let root = f64::from(root) / 65535.0;
            (65535.0 * curve.encoded(root * root)).round() as u16
        };
        Self { levels: (0..=u16::MAX).map(level).collect() }
    }

    /// The nearest 16-bit level; 65535 is white.
    #[inline(always)]
    pub(crate) fn level(&self, root: u16) -> u16 {
        self.levels[usize::from(root)]
    }
}

/// How a finished picture is written: its curve, and that curve's tables.
#[derive(Debug, Clone)]
pub(crate) struct Encoding {
    curve: TransferCurve,
    /// The colour profile's own curve, where pixels are light by another one.
    profile: Option<TransferCurve>,
    pub(crate) linear: Arc<Encode>,
    pub(crate) roots: Arc<EncodeRoots>,
    linear16: OnceLock<Arc<Encode16>>,
    roots16: OnceLock<Arc<EncodeRoots16>>,
}

impl Encoding {
    /// By a curve.
    pub(crate) fn new(curve: TransferCurve) -> Self {
        let (linear, roots) = (Encode::of(&curve), EncodeRoots::of(&curve));
        Self { linear, roots, linear16: OnceLock::new(), roots16: OnceLock::new(), curve, profile: None }
    }

    /// The same for a picture with the colour profile of `profile`, whatever light its pixels hold.
    pub(crate) fn of_profile(self, profile: &TransferCurve) -> Self {
        Self { profile: (self.curve != *profile).then(|| profile.clone()), ..self }
    }

    /// The colour profile's linear light of what the curve takes for `light`.
    pub(crate) fn profile_light(&self, light: f32) -> f32 {
        match &self.profile {
            Some(profile) => profile.linear(self.curve.encoded(f64::from(light))) as f32,
            None => light,
        }
    }

    /// To 16 bits from linear light.
    pub(crate) fn linear16(&self) -> &Encode16 {
        self.linear16.get_or_init(|| Encode16::of(&self.curve))
    }

    /// To 16 bits from roots.
    pub(crate) fn roots16(&self) -> &EncodeRoots16 {
        self.roots16.get_or_init(|| EncodeRoots16::of(&self.curve))
    }
}

impl PartialEq for Encoding {
    /// The tables follow from the curve.
    fn eq(&self, other: &Self) -> bool {
        self.curve == other.curve && self.profile == other.profile
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves() -> Vec<TransferCurve> {
        let adobe = TransferCurve::gamma(2.199_218_75);
        let pro_photo = TransferCurve::parametric([1.8, 1.0, 0.0, 0.0625, 0.031_25, 0.0, 0.0]);
        let table = TransferCurve::table((0..=1023).map(|step| (f64::from(step) / 1023.0).powf(1.9)).collect());
        let straight = TransferCurve::gamma(1.0);
        [Some(TransferCurve::SRGB), adobe, pro_photo, table, straight].map(|curve| curve.expect("a curve")).into()
    }

    #[test]
    fn every_level_survives_the_round_trip() {
        for curve in curves() {
            let (linearise, encoding) = (Linearise::of(&curve), Encoding::new(curve.clone()));
            for level in 0..=255_u8 {
                let linear = linearise.linear(f32::from(level));
                assert_eq!(encoding.linear.level(linear), level, "{curve:?}");
                assert_eq!(encoding.roots.level((linear.sqrt() * 65535.0 + 0.5) as u16), level, "{curve:?}");
            }
        }
    }

    #[test]
    fn encoding_rounds_as_the_formula_does() {
        let steps = 100_000;
        for curve in curves() {
            let encode = Encode::of(&curve);
            for step in 0..=steps {
                let linear = step as f32 / steps as f32;
                let exact = 255.0 * curve.encoded(f64::from(linear));
                let level = f64::from(encode.level(linear));
                assert!((level - exact).abs() <= 0.5 + 1e-3, "{curve:?} {linear}: {level} for {exact}");
            }
            for (value, level) in [(-1.0, 0), (0.0, 0), (1.0, 255), (7.0, 255), (f32::NAN, 0), (f32::INFINITY, 255)] {
                assert_eq!(encode.level(value), level);
            }
        }
    }

    #[test]
    fn a_curve_with_a_level_stretch_is_encoded_without_harm() {
        let curve = TransferCurve::table(vec![0.0, 0.0, 0.4, 0.4, 1.0]).expect("a curve");
        let encoding = Encoding::new(curve);
        assert_eq!((encoding.linear.level(0.0), encoding.linear.level(1.0)), (0, 255));
        assert!((127..=192).contains(&encoding.linear.level(0.4)));
    }

    #[test]
    fn sixteen_bits_are_off_by_hardly_more_than_half_a_level() {
        let steps = 1_000_000;
        for curve in curves() {
            // The table of 1024 entries has its sharpest kink behind the first: against the root of light the slope falls from
            // 1.41 to 0.52 there, and the chord across is off by up to 0.9 / 4 / 4095, 3.6 steps.
            let tolerance = if curve == TransferCurve::SRGB { 0.6 } else { 4.2 };
            let encode = Encode16::of(&curve);
            let mut last = 0;
            for step in 0..=steps {
                // Finer near black, where the curve is steep.
                let linear = (step as f32 / steps as f32).powi(2);
                let exact = 65535.0 * curve.encoded(f64::from(linear));
                let level = encode.level(linear);
                assert!((f64::from(level) - exact).abs() <= tolerance, "{curve:?} {linear}: {level} for {exact}");
                assert!(level >= last, "{linear}");
                last = level;
            }
            for (value, level) in
                [(-1.0, 0), (0.0, 0), (1.0, 65535), (7.0, 65535), (f32::NAN, 0), (f32::INFINITY, 65535)]
            {
                assert_eq!(encode.level(value), level);
            }
        }
    }

    /// The roots of neighbouring levels differ; a level that passes through them comes back to within the root's own step.
    #[test]
    fn sixteen_bits_pass_through_roots() {
        let encode = EncodeRoots16::of(&TransferCurve::SRGB);
        for level in 0..=u16::MAX {
            let linear = TransferCurve::SRGB.linear(f64::from(level) / 65535.0);
            let back = encode.level((linear.sqrt() * 65535.0).round() as u16);
            assert!(back.abs_diff(level) <= 1, "{level}: {back}");
        }
        assert_eq!(encode.level(0), 0);
        assert_eq!(encode.level(65535), 65535);
    }

    #[test]
    fn linear_light_between_levels_follows_the_formula() {
        for curve in curves() {
            let linearise = Linearise::of(&curve);
            // The others have kinks.
            let tolerance = if curve == TransferCurve::SRGB { 2e-7 } else { 4e-6 };
            for step in 0..=25_500 {
                let level = step as f32 / 100.0;
                let exact = curve.linear(f64::from(level) / 255.0);
                assert!((f64::from(linearise.linear(level)) - exact).abs() < tolerance, "{curve:?} {level}");
            }
            assert_eq!(linearise.linear(-9.0), 0.0);
            assert_eq!(linearise.linear(400.0), 1.0);
            assert_eq!(linearise.linear(f32::NAN), 0.0);
        }
    }
}
