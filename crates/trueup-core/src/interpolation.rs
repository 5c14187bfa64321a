//! Interpolation between samples.

/// Weights of four neighboring samples for a position `fraction` (in [0, 1]) beyond the second of them: cubic
/// convolution with a = -1/2 (the Catmull-Rom spline), exact for parabolas. They add up to 1.
///
/// # Source
/// Keys, "Cubic convolution interpolation for digital image processing", IEEE TASSP 29(6), 1981, equation 15.
#[inline(always)]
pub fn cubic_convolution_taps(fraction: f32) -> [f32; 4] {
    // Coefficients of fraction^3, fraction^2, fraction and 1, a column for each tap: exact at both ends.
    const CUBE: [f32; 4] = [-0.5, 1.5, -1.5, 0.5];
    const SQUARE: [f32; 4] = [1.0, -2.5, 2.0, -0.5];
    const LINE: [f32; 4] = [-0.5, 0.0, 0.5, 0.0];
    const CONSTANT: [f32; 4] = [0.0, 1.0, 0.0, 0.0];
    std::array::from_fn(|tap| ((CUBE[tap] * fraction + SQUARE[tap]) * fraction + LINE[tap]) * fraction + CONSTANT[tap])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_reproduced() {
        let parabola = |x: f32| 2.0 * x * x - 3.0 * x + 1.0;
        for step in 0..=8 {
            let fraction = step as f32 / 8.0;
            let taps = cubic_convolution_taps(fraction);
            let value: f32 = (0..4).map(|tap| taps[tap] * parabola(tap as f32 - 1.0)).sum();
            assert!((value - parabola(fraction)).abs() < 1e-5);
        }
    }
}
