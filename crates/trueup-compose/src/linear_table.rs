//! Tables of a curve, read between their entries.

/// A curve by its values at the whole numbers from 0 on, straight between them. The number of entries is a power of two, so that
/// reading one needs no check.
#[derive(Debug)]
pub(crate) struct LinearTable<const ENTRIES: usize> {
    /// A value, and the difference to the next.
    entries: [[f32; 2]; ENTRIES],
}

impl<const ENTRIES: usize> LinearTable<ENTRIES> {
    /// Of a curve whose value at every whole number up to `ENTRIES` is known.
    pub(crate) fn new(value: impl Fn(usize) -> f64) -> Self {
        const { assert!(ENTRIES.is_power_of_two()) };
        let entry = |index| [value(index) as f32, (value(index + 1) - value(index)) as f32];
        Self { entries: std::array::from_fn(entry) }
    }

    /// The value at a position from 0 to below `ENTRIES`.
    #[inline(always)]
    pub(crate) fn at(&self, position: f32) -> f32 {
        // Adding 1.5 * 2^23 rounds to a whole number and leaves it in the low bits: cheaper than a checked cast.
        const ROUNDING: f32 = 12_582_912.0;
        // Half a step lower, rounding gives the entry at or below; at an entry itself either side of it will do.
        let rounded = (position - 0.5) + ROUNDING;
        let [value, step] = self.entries[rounded.to_bits() as usize % ENTRIES];
        value + (position - (rounded - ROUNDING)) * step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_hit_and_the_curve_is_straight_between_them() {
        let squares = LinearTable::<8>::new(|index| (index * index) as f64);
        for (position, expected) in [(0.0, 0.0), (1.0, 1.0), (2.0, 4.0), (3.0, 9.0), (2.5, 6.5), (6.25, 39.25)] {
            assert_eq!(squares.at(position), expected, "{position}");
        }
    }
}
