//! From linear light, or its square root, to 8-bit samples.

use std::sync::{Arc, LazyLock};

use trueup_core::color::TransferCurve;

use super::ScaledCurve;
use super::by_curve::scaled_table_of;

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
    pub(crate) fn of<'a>(curve: impl Into<ScaledCurve<'a>>) -> Arc<Self> {
        static SRGB: LazyLock<Arc<Encode>> = LazyLock::new(|| Arc::new(Encode::new((&TransferCurve::SRGB).into())));
        scaled_table_of(curve.into(), &SRGB, Self::new)
    }

    fn new(curve: ScaledCurve) -> Self {
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
    pub(crate) fn of<'a>(curve: impl Into<ScaledCurve<'a>>) -> Arc<Self> {
        static SRGB: LazyLock<Arc<EncodeRoots>> =
            LazyLock::new(|| Arc::new(EncodeRoots::new((&TransferCurve::SRGB).into())));
        scaled_table_of(curve.into(), &SRGB, Self::new)
    }

    fn new(curve: ScaledCurve) -> Self {
        let encode = Encode::of(curve);
        let level = |root: u16| {
            let root = f32::from(root) / 65535.0;
            let square = root * root;
            encode.level(if curve.keeps_light() { square * square } else { square })
        };
        Self { levels: (0..=u16::MAX).map(level).collect() }
    }

    /// The nearest 8-bit level; 65535 is white.
    #[inline(always)]
    pub(crate) fn level(&self, root: u16) -> u8 {
        self.levels[usize::from(root)]
    }
}
