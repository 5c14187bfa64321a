//! Means, deviations, quantiles.

/// Mean and standard deviation of some values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Summary {
    /// Arithmetic mean.
    pub mean: f64,
    /// Sample standard deviation (divided by n - 1); 0 for a single value.
    pub deviation: f64,
    /// Number of values.
    pub count: usize,
}

/// Mean and deviation; `None` without values.
pub(crate) fn summary(values: &[f64]) -> Option<Summary> {
    let count = values.len();
    if count == 0 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / count as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let deviation = if count > 1 { (squares / (count - 1) as f64).sqrt() } else { 0.0 };
    Some(Summary { mean, deviation, count })
}

/// The mean; `None` without values.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    summary(values).map(|found| found.mean)
}

/// The quantile `share` (0 to 1), interpolated linearly between the two nearest values; `None` without values.
pub(crate) fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let (below, rest) = (place.floor() as usize, place.fract());
    let above = (below + 1).min(last);
    Some(sorted[below] + rest * (sorted[above] - sorted[below]))
}

/// The middle value; `None` without values.
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// Largest minus smallest value; `None` without values.
pub(crate) fn spread(values: &[f64]) -> Option<f64> {
    let largest = values.iter().copied().max_by(f64::total_cmp)?;
    let smallest = values.iter().copied().min_by(f64::total_cmp)?;
    Some(largest - smallest)
}

/// "3 of 4".
pub(crate) fn share(count: usize, of: usize) -> String {
    format!("{count} of {of}")
}

/// Spearman's correlation of two lists of the same length: Pearson's of the ranks, ties sharing the mean of theirs.
/// `None` with fewer than two pairs, or where all values of a list are alike.
///
/// # Source
/// Spearman, "The proof and measurement of association between two things", 1904.
pub(crate) fn rank_correlation(one: &[f64], other: &[f64]) -> Option<f64> {
    let (ranks, others) = (ranks(one), ranks(other));
    let (mean_rank, mean_other) = (mean(&ranks)?, mean(&others)?);
    let sum = |terms: &mut dyn Iterator<Item = f64>| terms.sum::<f64>();
    let product = sum(&mut ranks.iter().zip(&others).map(|(a, b)| (a - mean_rank) * (b - mean_other)));
    let squares = sum(&mut ranks.iter().map(|a| (a - mean_rank).powi(2)));
    let others = sum(&mut others.iter().map(|b| (b - mean_other).powi(2)));
    (squares > 0.0 && others > 0.0).then(|| product / (squares * others).sqrt())
}

/// The rank of every value from 1 on, ties sharing the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |value: &f64| {
        let below = values.iter().filter(|other| other.total_cmp(value).is_lt()).count();
        let alike = values.iter().filter(|other| other.total_cmp(value).is_eq()).count();
        below as f64 + (alike as f64 + 1.0) / 2.0
    };
    values.iter().map(rank).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_deviation_of_a_textbook_sample() {
        // 2, 4, 4, 4, 5, 5, 7, 9: mean 5, sum of squares 32, 32/7 under the root.
        let found = summary(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).expect("values");
        assert_eq!((found.mean, found.count), (5.0, 8));
        assert!((found.deviation - 2.138_089_935).abs() < 1e-9);
    }

    #[test]
    fn one_value_has_no_deviation_and_none_has_no_summary() {
        assert_eq!(summary(&[3.0]), Some(Summary { mean: 3.0, deviation: 0.0, count: 1 }));
        assert_eq!((summary(&[]), median(&[]), spread(&[])), (None, None, None));
    }

    #[test]
    fn rank_correlation_of_a_textbook_example() {
        // Ten pairs with rank differences whose squares sum to 194: 1 - 6 * 194 / (10 * 99) = -29/165.
        let first = [86.0, 97.0, 99.0, 100.0, 101.0, 103.0, 106.0, 110.0, 112.0, 113.0];
        let second = [2.0, 20.0, 28.0, 27.0, 50.0, 29.0, 7.0, 17.0, 6.0, 12.0];
        let found = rank_correlation(&first, &second).expect("pairs");
        assert!((found + 29.0 / 165.0).abs() < 1e-12, "{found}");
        assert_eq!(rank_correlation(&[1.0, 2.0, 9.0], &[0.1, 0.2, 0.3]), Some(1.0));
        // Ties share their mean rank: 1, 2.5, 2.5, 4 against 1 to 4.
        let tied = rank_correlation(&[1.0, 2.0, 2.0, 3.0], &[1.0, 2.0, 3.0, 4.0]).expect("pairs");
        assert!((tied - 4.5 / (4.5 * 5.0_f64).sqrt()).abs() < 1e-12);
        assert_eq!((rank_correlation(&[1.0], &[1.0]), rank_correlation(&[1.0, 1.0], &[1.0, 2.0])), (None, None));
    }

    #[test]
    fn quantiles_interpolate() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(median(&values), Some(2.5));
        assert_eq!(quantile(&values, 0.0), Some(1.0));
        assert_eq!(quantile(&values, 1.0), Some(4.0));
        assert_eq!(quantile(&values, 0.25), Some(1.75));
        assert_eq!(spread(&values), Some(3.0));
    }
}
