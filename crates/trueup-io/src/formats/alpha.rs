//! Colors that were multiplied by their opacity.

/// A sample as a share of the most it can be.
pub(crate) trait Share: Copy {
    fn share(self) -> f64;
    fn of_share(share: f64) -> Self;
}

macro_rules! whole_share {
    ($type:ty) => {
        impl Share for $type {
            fn share(self) -> f64 {
                f64::from(self) / f64::from(<$type>::MAX)
            }

            // The conversion saturates.
            fn of_share(share: f64) -> Self {
                (share * f64::from(<$type>::MAX) + 0.5) as $type
            }
        }
    };
}

whole_share!(u8);
whole_share!(u16);

impl Share for f32 {
    fn share(self) -> f64 {
        f64::from(self)
    }

    fn of_share(share: f64) -> Self {
        share as f32
    }
}

/// The same colors without what opacity took from them, if `is_premultiplied`; alpha is the second of two channels and
/// the fourth of four. What is transparent has no color.
pub(crate) fn straight<S: Share>(mut samples: Vec<S>, channels: usize, is_premultiplied: bool) -> Vec<S> {
    if !is_premultiplied || !matches!(channels, 2 | 4) {
        return samples;
    }
    for pixel in samples.chunks_exact_mut(channels) {
        let Some((alpha, colors)) = pixel.split_last_mut() else { continue };
        let alpha = alpha.share();
        for color in colors {
            *color = S::of_share(if alpha > 0.0 { color.share() / alpha } else { 0.0 });
        }
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opacity_is_divided_out() {
        // 51 / 255 is a fifth; 20 of 255 are 100 of 255 then.
        assert_eq!(straight(vec![20_u8, 51, 200, 51, 9, 0], 2, true), [100, 51, 255, 51, 0, 0]);
        assert_eq!(straight(vec![100_u16, 200, 300, 65535], 4, true), [100, 200, 300, 65535]);
        assert_eq!(straight(vec![0.5_f32, 1.0, 4.0, 0.5], 4, true), [1.0, 2.0, 8.0, 0.5]);
        assert_eq!(straight(vec![20_u8, 51], 2, false), [20, 51]);
        assert_eq!(straight(vec![20_u8, 51, 7], 3, true), [20, 51, 7]);
    }
}
