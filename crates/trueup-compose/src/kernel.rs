//! Interpolation kernels.

use trueup_core::interpolation::cubic_convolution_taps;

/// A separable, even interpolation kernel over at most four samples.
pub(crate) trait InterpolationKernel {
    /// Half its width in samples.
    const RADIUS: f64;

    /// Whether it is straight between two samples, rather than cubic over four.
    const IS_LINEAR: bool;

    /// Value at `distance` samples from the middle.
    fn at(distance: f32) -> f32;

    /// Weights of four neighboring samples for a position `fraction` (in [0, 1]) beyond the second of them.
    fn taps(fraction: f32) -> [f32; 4];
}

/// Two samples, straight between them.
#[derive(Debug)]
pub(crate) struct Bilinear;

impl InterpolationKernel for Bilinear {
    const RADIUS: f64 = 1.0;
    const IS_LINEAR: bool = true;

    #[inline(always)]
    fn at(distance: f32) -> f32 {
        (1.0 - distance.abs()).max(0.0)
    }

    #[inline(always)]
    fn taps(fraction: f32) -> [f32; 4] {
        [0.0, 1.0 - fraction, fraction, 0.0]
    }
}

/// Four samples by cubic convolution with a = -1/2 (the Catmull-Rom spline): exact for parabolas.
///
/// # Source
/// Keys, "Cubic convolution interpolation for digital image processing", IEEE TASSP 29(6), 1981, equation 15.
#[derive(Debug)]
pub(crate) struct Bicubic;

impl InterpolationKernel for Bicubic {
    const RADIUS: f64 = 2.0;
    const IS_LINEAR: bool = false;

    #[allow(clippy::manual_clamp)]
    #[inline(always)]
    fn at(distance: f32) -> f32 {
        let d = distance.abs();
        // Each of both pieces is exactly 0 at its ends: held there, it adds nothing to the other, and nothing branches.
        let (near, far) = (d.min(1.0), d.max(1.0).min(2.0));
        ((1.5 * near - 2.5) * near * near + 1.0) + (((-0.5 * far + 2.5) * far - 4.0) * far + 2.0)
    }

    #[inline(always)]
    fn taps(fraction: f32) -> [f32; 4] {
        cubic_convolution_taps(fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_taps_follow_the_kernel<K: InterpolationKernel>() {
        for step in 0..=16 {
            let fraction = step as f32 / 16.0;
            let taps = K::taps(fraction);
            assert!((taps.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            for (tap, weight) in taps.iter().enumerate() {
                let expected = K::at(tap as f32 - 1.0 - fraction);
                assert!((weight - expected).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn taps_are_the_kernel_at_the_samples() {
        check_taps_follow_the_kernel::<Bilinear>();
        check_taps_follow_the_kernel::<Bicubic>();
        assert_eq!(Bicubic::taps(0.0), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(Bicubic::taps(1.0), [0.0, 0.0, 1.0, 0.0]);
        // Keys' kernel half way: -1/16, 9/16, 9/16, -1/16.
        assert_eq!(Bicubic::taps(0.5), [-0.0625, 0.5625, 0.5625, -0.0625]);
    }
}
