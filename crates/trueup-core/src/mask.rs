//! Parts of a photograph that its photographer marked.

use std::ops::Range;
use std::sync::Arc;

use crate::inset::Inset;

/// Bits of a word.
const WORD_BITS: usize = u64::BITS as usize;

/// A mark for every pixel of a photograph in its upright orientation, a bit each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    width: usize,
    height: usize,
    words: Vec<u64>,
}

impl Mask {
    /// A mask of `width` x `height` pixels; `marked` is asked for every pixel (x, y).
    pub fn from_fn(width: usize, height: usize, marked: impl Fn(usize, usize) -> bool) -> Self {
        let mut words = vec![0; (width * height).div_ceil(WORD_BITS)];
        for y in 0..height {
            for x in 0..width {
                let bit = y * width + x;
                words[bit / WORD_BITS] |= u64::from(marked(x, y)) << (bit % WORD_BITS);
            }
        }
        Self { width, height, words }
    }

    /// A mask of `width` x `height` pixels, of whose row y those of the columns are marked that `marked` hands out for
    /// it; columns beyond the width are passed over. Large parts are marked by the word.
    pub fn from_rows<Columns: IntoIterator<Item = Range<usize>>>(
        width: usize,
        height: usize,
        marked: impl Fn(usize) -> Columns,
    ) -> Self {
        let mut words = vec![0; (width * height).div_ceil(WORD_BITS)];
        for y in 0..height {
            for columns in marked(y) {
                let (start, end) = (y * width + columns.start.min(width), y * width + columns.end.min(width));
                let first = start / WORD_BITS;
                let behind = end.div_ceil(WORD_BITS).max(first);
                for (number, word) in words[first..behind].iter_mut().enumerate() {
                    let bit = (first + number) * WORD_BITS;
                    *word |= u64::MAX << start.saturating_sub(bit) & u64::MAX >> WORD_BITS.saturating_sub(end - bit);
                }
            }
        }
        Self { width, height, words }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All marks, row by row, the lowest bit of a word first: what tells two masks of one size apart.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// The share of its pixels that are marked, 0 to 1.
    pub fn share(&self) -> f64 {
        let marked: u64 = self.words.iter().map(|word| u64::from(word.count_ones())).sum();
        marked as f64 / (self.width * self.height).max(1) as f64
    }

    /// Whether the pixel (x, y) is marked; nothing outside is.
    pub fn is_marked(&self, x: usize, y: usize) -> bool {
        let bit = y * self.width + x;
        x < self.width && y < self.height && self.words[bit / WORD_BITS] >> (bit % WORD_BITS) & 1 != 0
    }

    /// Whether the pixel at (x, y) is marked; nothing outside is.
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        // The casts saturate.
        x >= 0.0 && y >= 0.0 && self.is_marked(x as usize, y as usize)
    }

    /// Whether any pixel is marked in a box of this size around (x, y).
    pub fn any_within(&self, [x, y]: [f64; 2], size: [f64; 2]) -> bool {
        let range = |middle: f64, size: f64, limit: usize| {
            let (low, high) = (middle - 0.5 * size, middle + 0.5 * size);
            (low.max(0.0) as usize).min(limit)..(high.max(0.0).ceil() as usize).min(limit)
        };
        let columns = range(x, size[0], self.width);
        range(y, size[1], self.height).any(|y| columns.clone().any(|x| self.is_marked(x, y)))
    }

    /// The mask that marks what this one does not.
    #[must_use]
    pub fn inverted(&self) -> Self {
        Self::from_fn(self.width, self.height, |x, y| !self.is_marked(x, y))
    }

    /// The mask of the photograph inside `inset`; of nothing if nothing is left of it.
    #[must_use]
    pub fn inside(self, inset: Inset) -> Self {
        if inset.is_none() {
            return self;
        }
        let [width, height] = inset.inner([self.width, self.height]).unwrap_or_default();
        Self::from_fn(width, height, |x, y| self.is_marked(x + inset.left, y + inset.top))
    }

    /// This mask and another of the same size: what is marked in either. Sizes that differ leave this one as it is.
    #[must_use]
    pub fn or(mut self, other: &Self) -> Self {
        if (self.width, self.height) == (other.width, other.height) {
            self.words.iter_mut().zip(&other.words).for_each(|(word, other)| *word |= other);
        }
        self
    }
}

/// What a photographer wants of the parts of one photograph.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Masks {
    /// Marked parts are not looked at, and not shown where another photograph can be.
    pub ignored: Option<Arc<Mask>>,
    /// Marked parts are shown, whatever other photographs show there.
    pub kept: Option<Arc<Mask>>,
}

impl Masks {
    /// The masks of the photograph inside `inset`.
    #[must_use]
    pub fn inside(self, inset: Inset) -> Self {
        let inside = |mask: Arc<Mask>| Arc::new(Arc::unwrap_or_clone(mask).inside(inset));
        Self { ignored: self.ignored.map(inside), kept: self.kept.map(inside) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stretches that begin, end and lie within words, over several, without a pixel, and beyond the width.
    #[test]
    fn rows_are_marked_as_their_pixels_are() {
        let rows =
            [vec![0..1, 5..70, 149..400], vec![], vec![63..64, 64..65, 90..90, 100..150], vec![0..140, 145..150]];
        let by_rows = Mask::from_rows(150, 4, |y| rows[y].clone());
        assert_eq!(by_rows, Mask::from_fn(150, 4, |x, y| rows[y].iter().any(|columns| columns.contains(&x))));
        assert_eq!(Mask::from_rows(0, 3, |_| [0..4, 5..6]), Mask::from_fn(0, 3, |_, _| true));
    }

    #[test]
    fn marks_are_found_where_they_were_made_and_nowhere_else() {
        let mask = Mask::from_fn(70, 3, |x, y| x == 65 && y == 1);
        for y in 0..4 {
            for x in 0..71 {
                assert_eq!(mask.is_marked(x, y), (x, y) == (65, 1), "({x}, {y})");
            }
        }
        assert!(mask.contains([65.0, 1.99]) && !mask.contains([66.0, 1.5]) && !mask.contains([-1.0, 1.0]));
        assert!(mask.any_within([63.5, 1.5], [4.0, 1.0]) && !mask.any_within([62.5, 1.5], [4.0, 1.0]));
        assert!(!mask.any_within([f64::NAN, 1.0], [4.0, 4.0]) && !mask.any_within([1e300, 1.0], [4.0, 1e300]));
    }

    #[test]
    fn a_mask_is_cut_with_its_photograph() {
        let mask = Mask::from_fn(8, 6, |x, y| (x, y) == (3, 2));
        let masks = Masks { ignored: Some(Arc::new(mask)), kept: None };
        let cut = masks.inside(Inset { left: 2, top: 1, right: 1, bottom: 0 });
        assert_eq!(cut.ignored.as_deref(), Some(&Mask::from_fn(5, 5, |x, y| (x, y) == (1, 1))));
    }

    #[test]
    fn what_is_inverted_twice_is_the_same() {
        let mask = Mask::from_fn(13, 7, |x, y| x * y % 3 == 0);
        assert!((0..13).all(|x| (0..7).all(|y| mask.inverted().is_marked(x, y) != mask.is_marked(x, y))));
        assert_eq!(mask.inverted().inverted(), mask);
    }

    #[test]
    fn either_of_two_masks_of_one_size_counts() {
        let left = Mask::from_fn(4, 2, |x, _| x == 0);
        let right = Mask::from_fn(4, 2, |x, _| x == 3);
        assert_eq!(left.clone().or(&right), Mask::from_fn(4, 2, |x, _| x == 0 || x == 3));
        assert_eq!(left.clone().or(&Mask::from_fn(5, 2, |_, _| true)), left);
    }
}
