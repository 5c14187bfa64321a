//! Statistics that few wild values do not move, and how sure an estimate of two numbers is.

use std::cmp::Ordering;

use nalgebra::Matrix2;

/// Standard deviation of a normal distribution over the median magnitude of what is drawn from it: 1 / Phi^-1(3/4).
///
/// # Source
/// Rousseeuw and Croux, Alternatives to the Median Absolute Deviation (1993), section 1.
pub const SD_PER_MEDIAN_MAGNITUDE: f64 = 1.4826;

/// Floating-point numbers in their total order.
pub trait TotalOrder: Copy {
    /// As [`f64::total_cmp`].
    fn total_cmp(&self, other: &Self) -> Ordering;
}

impl TotalOrder for f32 {
    fn total_cmp(&self, other: &Self) -> Ordering {
        f32::total_cmp(self, other)
    }
}

impl TotalOrder for f64 {
    fn total_cmp(&self, other: &Self) -> Ordering {
        f64::total_cmp(self, other)
    }
}

/// The middle value, of an even number the upper one of the two; `None` without any. Puts the values in another order,
/// in linear time.
pub fn median<T: TotalOrder>(values: &mut [T]) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, T::total_cmp).1)
}

/// [`median`] of what an iterator yields.
pub fn median_of<T: TotalOrder>(values: impl IntoIterator<Item = T>) -> Option<T> {
    median(&mut values.into_iter().collect::<Vec<T>>())
}

/// Standard deviation about the axis of which an information matrix (the inverse of a covariance) tells least; infinite
/// where it tells nothing of it.
pub fn greatest_deviation(information: &Matrix2<f64>) -> f64 {
    information.symmetric_eigenvalues().min().max(0.0).sqrt().recip()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_value_is_the_upper_of_two() {
        assert_eq!(median::<f64>(&mut []), None);
        assert_eq!(median_of([3.0]), Some(3.0));
        assert_eq!(median(&mut [4.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0_f32, -1.0, 2.0, 1.0]), Some(2.0));
    }

    /// Three quarters of a normal distribution lie below 0.67449 standard deviations, so that half of its magnitudes
    /// do.
    #[test]
    fn the_deviation_of_a_normal_distribution_comes_of_its_upper_quartile() {
        assert!((SD_PER_MEDIAN_MAGNITUDE * 0.674_489_75 - 1.0).abs() < 1e-5);
    }
}
