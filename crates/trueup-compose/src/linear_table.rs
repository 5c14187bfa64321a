//! Tables of a curve, read between their entries.

/// Adding 1.5 * 2^23 rounds to a whole number and leaves it in the low bits: cheaper than a checked cast.
pub(crate) const ROUNDING: f32 = 12_582_912.0;

/// A curve by its values at the whole numbers from 0 on, straight between them. The number of entries is a power of
/// two, so that reading one needs no check.
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

    /// Every entry: its value, and the difference to the next.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(crate) fn entries(&self) -> &[[f32; 2]; ENTRIES] {
        &self.entries
    }

    /// The value at a position from 0 to below `ENTRIES`.
    #[inline(always)]
    pub(crate) fn at(&self, position: f32) -> f32 {
        let (index, beyond) = Self::place(position);
        let [value, step] = self.entries[index];
        value + beyond * step
    }

    /// The values at `COUNT` positions: entries are read one after the other, all else is done side by side.
    #[inline(always)]
    pub(crate) fn at_all<const COUNT: usize>(&self, positions: [f32; COUNT]) -> [f32; COUNT] {
        let (mut indices, mut beyond) = ([0_u32; COUNT], [0.0; COUNT]);
        for ((index, beyond), position) in indices.iter_mut().zip(&mut beyond).zip(positions) {
            let place = Self::place(position);
            (*index, *beyond) = (place.0 as u32, place.1);
        }
        let (mut values, mut steps) = ([0.0; COUNT], [0.0; COUNT]);
        for ((value, step), index) in values.iter_mut().zip(&mut steps).zip(indices) {
            [*value, *step] = self.entries[index as usize % ENTRIES];
        }
        for ((value, beyond), step) in values.iter_mut().zip(beyond).zip(steps) {
            *value += beyond * step;
        }
        values
    }

    /// The entry at or below a position, and how far beyond it that lies.
    #[inline(always)]
    fn place(position: f32) -> (usize, f32) {
        // Half a step lower, rounding gives the entry at or below; at an entry itself either side of it will do.
        let rounded = (position - 0.5) + ROUNDING;
        (rounded.to_bits() as usize % ENTRIES, position - (rounded - ROUNDING))
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
            assert_eq!(squares.at_all([position, 0.5]), [expected, 0.5], "{position}");
        }
    }
}
