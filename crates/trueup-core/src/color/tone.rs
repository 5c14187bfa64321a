//! How the levels of one exposure stand for those of another.

/// Levels that a relation is known at: those of 8 bits.
const LEVELS: usize = 256;

/// Sums over pixels that show the same place in two exposures, from which a [`ToneRelation`] is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct ToneSums {
    count: Vec<f64>,
    sum: Vec<f64>,
}

impl Default for ToneSums {
    fn default() -> Self {
        Self { count: vec![0.0; LEVELS], sum: vec![0.0; LEVELS] }
    }
}

impl ToneSums {
    /// Adds a pixel of `level` in the one picture and `other` in the other one, both on the scale of 0 to 255. NaN
    /// counts for nothing.
    pub fn add(&mut self, level: f32, other: f32) {
        if level.is_nan() || other.is_nan() {
            return;
        }
        // The cast saturates.
        let place = ((level + 0.5).max(0.0) as usize).min(LEVELS - 1);
        self.count[place] += 1.0;
        self.sum[place] += f64::from(other);
    }
}

/// The level in one exposure that belongs to each level of another one: it never falls. Whatever a camera does to its
/// light, the brighter of two places is the brighter one in all exposures.
///
/// # Source
/// The comparagram of Mann, "Comparametric equations with practical applications in quantigraphic image processing",
/// IEEE TIP 9(8), 2000; fitted by pooling adjacent violators (Ayer and others, "An empirical distribution function for
/// sampling with incomplete information", Annals of Mathematical Statistics 26(4), 1955), which is the least-squares
/// relation among all that never fall.
#[derive(Debug, Clone, PartialEq)]
pub struct ToneRelation {
    levels: Vec<f32>,
}

impl ToneRelation {
    /// The relation that fits best; `None` without a single pixel. Levels that no pixel has are interpolated, beyond
    /// the first and the last one they are those of these.
    pub fn fit(sums: &ToneSums) -> Option<Self> {
        /// Neighboring levels that have one mean.
        struct Block {
            last: usize,
            count: f64,
            sum: f64,
        }
        let mean = |block: &Block| block.sum / block.count;
        let mut blocks: Vec<Block> = Vec::new();
        for (last, (&count, &sum)) in
            sums.count.iter().zip(&sums.sum).enumerate().filter(|(_, (count, _))| **count > 0.0)
        {
            let mut block = Block { last, count, sum };
            while let Some(before) = blocks.pop_if(|before| mean(before) >= mean(&block)) {
                block = Block { last, count: before.count + block.count, sum: before.sum + block.sum };
            }
            blocks.push(block);
        }
        // Knots at the levels that pixels have.
        let (mut blocks, mut knots) = (blocks.into_iter().peekable(), Vec::new());
        for level in (0..LEVELS).filter(|&level| sums.count[level] > 0.0) {
            while blocks.next_if(|block| block.last < level).is_some() {}
            knots.push((level, mean(blocks.peek()?) as f32));
        }
        let (&first, &last) = (knots.first()?, knots.last()?);
        let mut levels = vec![first.1; LEVELS];
        levels[last.0..].fill(last.1);
        for pair in knots.windows(2) {
            let [(from, low), (to, high)] = [pair[0], pair[1]];
            for (step, level) in levels[from..to].iter_mut().enumerate() {
                *level = low + (high - low) * step as f32 / (to - from) as f32;
            }
        }
        Some(Self { levels })
    }

    /// The other exposure's level, 0 to 255, for `level`, between those that are known; what is beyond 0 to 255 is
    /// taken for the nearer end.
    #[inline]
    pub fn at(&self, level: f32) -> f32 {
        let level = level.clamp(0.0, (LEVELS - 1) as f32);
        // A level that is no number has none in the other picture: the cast makes it zero, the fraction stays no
        // number.
        let below = (level as usize).min(LEVELS - 2);
        let fraction = level - below as f32;
        self.levels[below] + (self.levels[below + 1] - self.levels[below]) * fraction
    }

    /// How much the other exposure's level rises with each one at `level`.
    #[inline]
    pub fn slope(&self, level: f32) -> f32 {
        /// Levels on either side over which the rise is taken: the relation is fitted to noisy pixels.
        const REACH: f32 = 3.0;
        let (low, high) = ((level - REACH).max(0.0), (level + REACH).min((LEVELS - 1) as f32));
        (self.at(high) - self.at(low)) / (high - low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_falls_is_pooled_and_what_is_missing_interpolated() {
        let mut sums = ToneSums::default();
        // At 10 once 20, at 20 once 60, at 30 twice 30: of the last two the mean is (60 + 2 * 30) / 3 = 40.
        for (level, other) in [(10.0, 20.0), (20.0, 60.0), (30.0, 30.0), (30.0, 30.0), (50.0, 100.0), (f32::NAN, 7.0)] {
            sums.add(level, other);
        }
        let relation = ToneRelation::fit(&sums).expect("pixels");
        for (level, expected) in [
            (0.0, 20.0),
            (10.0, 20.0),
            (15.0, 30.0),
            (20.0, 40.0),
            (25.0, 40.0),
            (30.0, 40.0),
            (40.0, 70.0),
            (300.0, 100.0),
        ] {
            assert!((relation.at(level) - expected).abs() < 1e-4, "{level}: {}", relation.at(level));
        }
        assert!((relation.slope(40.0) - 3.0).abs() < 1e-4);
        assert!(relation.at(f32::NAN).is_nan());
    }

    #[test]
    fn nothing_has_no_relation() {
        assert_eq!(ToneRelation::fit(&ToneSums::default()), None);
    }
}
