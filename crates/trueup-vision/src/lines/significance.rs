//! How many rectangles as well aligned as one found are expected in noise.

use std::f64::consts::{LN_10, PI, TAU};

/// Number of precisions a rectangle is tried with, each half of the one before: the factor gamma of the number of tests
/// (IPOL, section 2.7).
const PRECISIONS_TESTED: usize = 11;

/// Factorials kept in a table; above, Stirling's series is exact to double precision.
const TABLED_FACTORIALS: usize = 2048;

/// The tail's sum ends when what is left cannot change it by more than this share.
const TAIL_TOLERANCE: f64 = 1e-3;

/// The number of false alarms (NFA) of rectangles in a field of given size.
#[derive(Debug)]
pub(super) struct FalseAlarms {
    /// log10 of the number of rectangles, times precisions, that a photograph of this size has.
    log10_tests: f64,
    /// ln n! for small n.
    ln_factorials: Vec<f64>,
    /// The first precision, and what comes of halving it again and again.
    precisions: [Precision; PRECISIONS_TESTED],
}

/// How closely a pixel must be aligned, with what follows from it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Precision {
    /// Probability that a pixel of noise is aligned: twice the tolerance over 2 pi.
    pub probability: f64,
    /// Tangent of the tolerance.
    pub tangent: f32,
    /// Logarithm of the probability.
    ln: f64,
    /// Logarithm of that of the opposite.
    ln_opposite: f64,
}

impl Precision {
    fn new(probability: f64) -> Self {
        Self {
            probability,
            tangent: (PI * probability).tan() as f32,
            ln: probability.ln(),
            ln_opposite: (-probability).ln_1p(),
        }
    }
}

impl FalseAlarms {
    /// For a field of so many nodes across and down, whose pixels of noise are aligned with `probability`.
    ///
    /// # Source
    /// The number of tests is (width height)^(5/2) gamma: two end points and a width (TPAMI, section 2.3).
    pub(super) fn new(width: usize, height: usize, probability: f64) -> Self {
        let area = (width.max(1) as f64) * (height.max(1) as f64);
        let mut sum = 0.0;
        let ln_factorials = (0..TABLED_FACTORIALS)
            .map(|n| {
                sum += (n.max(1) as f64).ln();
                sum
            })
            .collect();
        let precisions = std::array::from_fn(|halvings| Precision::new(probability * 0.5_f64.powi(halvings as i32)));
        Self { log10_tests: 2.5 * area.log10() + (PRECISIONS_TESTED as f64).log10(), ln_factorials, precisions }
    }

    /// The fewest pixels that could be significant if all of them were aligned.
    pub(super) fn smallest_region(&self, min_significance: f64) -> usize {
        ((self.log10_tests + min_significance) / -self.precisions[0].probability.log10()).max(0.0) as usize
    }

    /// The precision halved so often; the last that is tested if that is more.
    pub(super) fn precision(&self, halvings: usize) -> &Precision {
        &self.precisions[halvings.min(PRECISIONS_TESTED - 1)]
    }

    /// -log10 of the number of false alarms: `aligned` of `total` pixels, each aligned with `probability` in noise.
    ///
    /// # Source
    /// NFA = tests * P(Binomial(total, probability) >= aligned) (TPAMI, equation 1).
    pub(super) fn significance(&self, total: usize, aligned: usize, precision: &Precision) -> f64 {
        -self.log10_tests - self.log10_tail(total, aligned, precision)
    }

    /// log10 of the upper tail of the binomial law.
    fn log10_tail(&self, total: usize, aligned: usize, precision: &Precision) -> f64 {
        if aligned == 0 || total == 0 {
            return 0.0;
        }
        let (n, k) = (total as f64, aligned as f64);
        let failures = total.saturating_sub(aligned);
        let ln_first = self.ln_factorial(total) - self.ln_factorial(aligned) - self.ln_factorial(failures)
            + k * precision.ln
            + failures as f64 * precision.ln_opposite;
        // Terms relative to the first. Their ratios fall, so that the rest is bounded by a geometric series.
        let odds = precision.probability / (1.0 - precision.probability);
        let (mut term, mut sum) = (1.0, 1.0);
        for i in aligned + 1..=total {
            let ratio = (n - i as f64 + 1.0) / i as f64 * odds;
            term *= ratio;
            sum += term;
            if ratio < 1.0 && term * ratio / (1.0 - ratio) < TAIL_TOLERANCE * sum {
                break;
            }
        }
        ((ln_first + sum.ln()) / LN_10).min(0.0)
    }

    /// ln n!.
    fn ln_factorial(&self, n: usize) -> f64 {
        self.ln_factorials.get(n).copied().unwrap_or_else(|| stirling(n as f64))
    }
}

/// ln n! for n >= 2000 by Stirling's series; the first term left out is below 1e-19.
fn stirling(n: f64) -> f64 {
    n * n.ln() - n + 0.5 * (TAU * n).ln() + 1.0 / (12.0 * n) - 1.0 / (360.0 * n.powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact sums of binomial terms, computed with rational arithmetic (Python's fractions).
    #[test]
    fn tails_agree_with_exact_sums() {
        let alarms = FalseAlarms::new(10, 10, 0.125);
        let tail = |n, k, p: f64| 10_f64.powf(alarms.log10_tail(n, k, &Precision::new(p)));
        // sum_{j>=3} C(10, j) (1/8)^j (7/8)^(10 - j)
        assert!((tail(10, 3, 0.125) / 0.119_497_267_529_368_4 - 1.0).abs() < 2e-3);
        // C(5, 5) (1/8)^5
        assert!((tail(5, 5, 0.125) * 32768.0 - 1.0).abs() < 1e-9);
        assert_eq!(tail(20, 0, 0.125), 1.0);
        // 10 x 10: 100^2.5 * 11 tests.
        let expected = -(5.0 + 11_f64.log10()) + 5.0 * 8_f64.log10();
        assert!((alarms.significance(5, 5, alarms.precision(0)) - expected).abs() < 1e-9);
    }

    #[test]
    fn factorials_continue_beyond_the_table() {
        let alarms = FalseAlarms::new(1, 1, 0.125);
        let last = alarms.ln_factorial(TABLED_FACTORIALS - 1);
        let next = alarms.ln_factorial(TABLED_FACTORIALS);
        assert!((next - last - (TABLED_FACTORIALS as f64).ln()).abs() < 1e-9);
    }

    #[test]
    fn a_region_below_the_smallest_is_never_significant() {
        let alarms = FalseAlarms::new(640, 480, 0.125);
        let precision = alarms.precision(0);
        let smallest = alarms.smallest_region(0.0);
        assert!(smallest > 10);
        assert!(alarms.significance(smallest - 1, smallest - 1, precision) < 0.0);
        assert!(alarms.significance(smallest + 1, smallest + 1, precision) > 0.0);
    }
}
