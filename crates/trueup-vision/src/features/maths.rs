//! Elementary functions without branches, so that loops over them become vector instructions with the same bits on
//! every processor.

/// The angle of the vector (x, y) as a share of a full turn, in [0, 1]; zero for the zero vector.
///
/// # Source
/// Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49: error of the arc tangent below 1e-5 radians.
#[inline(always)]
pub(super) fn turns(y: f32, x: f32) -> f32 {
    let (absolute_x, absolute_y) = (x.abs(), y.abs());
    let steep = absolute_y > absolute_x;
    let (low, high) = if steep { (absolute_x, absolute_y) } else { (absolute_y, absolute_x) };
    let ratio = low / (high + f32::MIN_POSITIVE);
    let s = ratio * ratio;
    let series = 0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1)));
    let octant = ratio * series * (0.5 * std::f32::consts::FRAC_1_PI);
    let quadrant = if steep { 0.25 - octant } else { octant };
    let half = if x < 0.0 { 0.5 - quadrant } else { quadrant };
    if y < 0.0 { 1.0 - half } else { half }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angle_agrees_with_the_library() {
        for step in 0..720 {
            let angle = std::f64::consts::TAU * f64::from(step) / 720.0;
            let (sin, cos) = angle.sin_cos();
            let difference = f64::from(turns(sin as f32, cos as f32)) - f64::from(step) / 720.0;
            assert!((difference - difference.round()).abs() < 1e-5, "{step}");
        }
        assert_eq!(turns(0.0, 0.0), 0.0);
    }
}
