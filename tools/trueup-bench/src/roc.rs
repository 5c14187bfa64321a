//! How well a number tells two classes apart: receiver operating characteristic, area under it, best threshold.

/// One threshold's outcome: everything at or below it is called positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RocPoint {
    /// Largest number that is called positive; minus infinity calls nothing so.
    pub threshold: f64,
    /// Share of the positives that are called positive.
    pub true_rate: f64,
    /// Share of the negatives that are called positive.
    pub false_rate: f64,
}

/// The curve from nothing called positive to everything, one point per distinct number; `None` unless both classes
/// have members.
///
/// Small numbers speak for the positive class (a divergence for a Manhattan world). Not-a-number counts as infinite.
pub(crate) fn curve(positives: &[f64], negatives: &[f64]) -> Option<Vec<RocPoint>> {
    if positives.is_empty() || negatives.is_empty() {
        return None;
    }
    let plain = |values: &[f64]| -> Vec<f64> {
        values.iter().map(|value| if value.is_nan() { f64::INFINITY } else { *value }).collect()
    };
    let (positives, negatives) = (plain(positives), plain(negatives));
    let mut thresholds: Vec<f64> = positives.iter().chain(&negatives).copied().collect();
    thresholds.sort_by(f64::total_cmp);
    thresholds.dedup();
    let rate = |values: &[f64], threshold: f64| {
        values.iter().filter(|value| **value <= threshold).count() as f64 / values.len() as f64
    };
    let at = |threshold: f64| RocPoint {
        threshold,
        true_rate: rate(&positives, threshold),
        false_rate: rate(&negatives, threshold),
    };
    Some(std::iter::once(f64::NEG_INFINITY).chain(thresholds).map(at).collect())
}

/// Area under the curve, by trapezoids: 1 for perfect separation, 0.5 for none.
pub(crate) fn area(curve: &[RocPoint]) -> f64 {
    curve
        .windows(2)
        .map(|pair| (pair[1].false_rate - pair[0].false_rate) * (pair[1].true_rate + pair[0].true_rate) / 2.0)
        .sum()
}

/// The threshold that parts the classes best: it maximizes true rate minus false rate (Youden's J), and lies half way
/// to the next number above, where it is farthest from either. `None` for an empty curve.
pub(crate) fn best_threshold(curve: &[RocPoint]) -> Option<RocPoint> {
    let gain = |point: &RocPoint| point.true_rate - point.false_rate;
    let mut best: Option<usize> = None;
    for index in 0..curve.len() {
        if best.is_none_or(|known| gain(&curve[index]) > gain(&curve[known])) {
            best = Some(index);
        }
    }
    let best = best?;
    let point = curve[best];
    let next = curve.get(best + 1).map_or(point.threshold, |next| next.threshold);
    let threshold =
        if point.threshold.is_finite() && next.is_finite() { (point.threshold + next) / 2.0 } else { point.threshold };
    Some(RocPoint { threshold, ..point })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separable_classes_have_area_one_and_a_threshold_between() {
        let curve = curve(&[0.01, 0.02], &[0.20, 0.30]).expect("both classes");
        assert!((area(&curve) - 1.0).abs() < 1e-12);
        let best = best_threshold(&curve).expect("points");
        assert!((best.threshold - 0.11).abs() < 1e-12);
        assert_eq!((best.true_rate, best.false_rate), (1.0, 0.0));
    }

    #[test]
    fn area_counts_pairs_in_the_right_order_and_half_of_the_ties() {
        // Mann-Whitney: of the 6 pairs, (1,2) (1,3) (1,3) (2,3) (2,3) are right and (2,2) is a tie: 5.5 / 6.
        let curve = curve(&[1.0, 2.0], &[2.0, 3.0, 3.0]).expect("both classes");
        assert!((area(&curve) - 5.5 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn missing_numbers_count_as_far_away() {
        let curve = curve(&[0.1, f64::NAN], &[f64::INFINITY]).expect("both classes");
        let best = best_threshold(&curve).expect("points");
        assert_eq!((best.threshold, best.true_rate, best.false_rate), (0.1, 0.5, 0.0));
    }

    #[test]
    fn one_class_alone_has_no_curve() {
        assert_eq!(curve(&[], &[1.0]), None);
        assert_eq!(best_threshold(&[]), None);
    }
}
