//! Arithmetic on the circle.

use std::f64::consts::{PI, TAU};

/// The angle in [-pi, pi) that differs from `angle` by whole turns.
pub fn wrap_angle(angle: f64) -> f64 {
    // The remainder of what is hardly negative is rounded to a whole turn.
    let wrapped = (angle + PI).rem_euclid(TAU) - PI;
    if wrapped >= PI { -PI } else { wrapped }
}

/// The shortest of the lengths that differ from `length` by whole periods; itself without a period.
pub fn wrap_length(length: f64, period: Option<f64>) -> f64 {
    period.map_or(length, |period| length - (length / period).round() * period)
}

/// The mean direction of weighted angles, in (-pi, pi]; `None` if they cancel out.
pub fn circular_mean(weighted_angles: impl IntoIterator<Item = (f64, f64)>) -> Option<f64> {
    const CANCELLED: f64 = 1e-12;
    let (sine, cosine, total) =
        weighted_angles.into_iter().fold((0.0, 0.0, 0.0), |(sine, cosine, total), (angle, weight): (f64, f64)| {
            (sine + weight * angle.sin(), cosine + weight * angle.cos(), total + weight.abs())
        });
    (sine.hypot(cosine) > CANCELLED * total).then(|| sine.atan2(cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_keeps_the_half_open_range() {
        assert_eq!(wrap_angle(PI), -PI);
        assert_eq!(wrap_angle(-PI), -PI);
        assert_eq!(wrap_angle((-PI).next_down()), -PI);
        assert!(wrap_angle(f64::NAN).is_nan());
        assert!((wrap_angle(3.0 * PI + 0.1) - (0.1 - PI)).abs() < 1e-12);
    }

    #[test]
    fn lengths_are_shortened_by_whole_periods() {
        assert_eq!(wrap_length(95.0, Some(100.0)), -5.0);
        assert_eq!(wrap_length(-212.0, Some(100.0)), -12.0);
        assert_eq!(wrap_length(95.0, None), 95.0);
    }

    #[test]
    fn the_mean_of_angles_across_the_cut_is_the_cut() {
        let mean = circular_mean([(PI - 0.1, 1.0), (-PI + 0.1, 1.0)]).expect("not cancelled");
        assert!((wrap_angle(mean - PI)).abs() < 1e-12);
        assert!(circular_mean([(0.0, 1.0), (PI, 1.0)]).is_none());
    }
}
