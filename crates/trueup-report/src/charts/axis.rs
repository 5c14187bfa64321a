//! From numbers to places on an axis.

/// An axis: numbers from `low` to `high` lie on pixels from `start` to `end`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
    step: f64,
}

/// About as many labels as an axis carries.
const LABELS: f64 = 6.0;

impl Scale {
    /// An axis that begins at the label below `low` and ends at the one above `high`.
    pub(super) fn new(low: f64, high: f64, start: f64, end: f64) -> Self {
        let exact = Self::exact(low, high, start, end);
        let low = (exact.low / exact.step + 1e-9).floor() * exact.step;
        let labels = ((exact.high - low) / exact.step - 1e-9).ceil().max(1.0);
        Self { low, high: low + labels * exact.step, ..exact }
    }

    /// An axis from `low` to `high`. An empty or infinite range becomes one unit wide.
    pub(super) fn exact(low: f64, high: f64, start: f64, end: f64) -> Self {
        let (low, high) = match (low.is_finite() && high.is_finite(), high > low) {
            (true, true) => (low, high),
            (true, false) => (low, low + 1.0),
            (false, _) => (0.0, 1.0),
        };
        Self { low, high, start, end, step: round_step((high - low) / LABELS) }
    }

    /// The pixel of a number.
    pub(super) fn place(&self, value: f64) -> f64 {
        self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)
    }

    /// The numbers that are labelled.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let first = (self.low / self.step - 1e-9).ceil() as i64;
        let last = (self.high / self.step + 1e-9).floor() as i64;
        (first..=last).map(|count| count as f64 * self.step).collect()
    }

    /// A label with as many decimals as the steps need.
    pub(super) fn label(&self, tick: f64) -> String {
        let decimals = (-self.step.log10().floor()).max(0.0) as usize;
        format!("{tick:.decimals$}")
    }
}

/// The next of 1, 2, 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let digit = [1.0, 2.0, 5.0, 10.0].into_iter().find(|digit| digit * power >= step * (1.0 - 1e-9));
    digit.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        assert_eq!([0.9, 1.3, 3.0, 7.0].map(round_step), [1.0, 2.0, 5.0, 10.0]);
        assert!((round_step(0.03) - 0.05).abs() < 1e-12);
    }

    #[test]
    fn an_axis_ends_at_a_label_and_maps_its_ends() {
        let scale = Scale::new(0.0, 4.7, 300.0, 0.0);
        assert_eq!(scale.ticks(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!((scale.place(0.0), scale.place(5.0), scale.place(2.5)), (300.0, 0.0, 150.0));
        assert_eq!(Scale::new(0.0, 0.13, 0.0, 1.0).label(0.05), "0.05");
    }

    #[test]
    fn ranges_without_width_do_not_divide_by_zero() {
        for scale in [Scale::new(0.0, 0.0, 0.0, 10.0), Scale::exact(f64::INFINITY, f64::NEG_INFINITY, 0.0, 10.0)] {
            assert!(scale.place(0.5).is_finite());
            assert!(scale.ticks().len() > 2);
        }
    }
}
