//! Samples of 8-bit RGB pictures between their pixels.

use super::positions::Positions;
use crate::kernel::InterpolationKernel;

/// An 8-bit RGB picture as the interpolation sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rgb8<'a> {
    pub(crate) samples: &'a [u8],
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Rgb8<'_> {
    /// Index of the first of the 4 x 4 pixels around a position, if 16 bytes can be read from each of their rows.
    #[inline(always)]
    fn window(&self, column: i32, row: i32) -> Option<usize> {
        // Sixteen bytes end a pixel and a third after the fourth pixel of a row: two columns more than the window.
        let inside = column >= 1 && row >= 1 && column as usize + 5 <= self.width && row as usize + 3 <= self.height;
        inside.then(|| ((row as usize - 1) * self.width + column as usize - 1) * 3)
    }
}

/// Interpolates 8-bit RGB at every position, on the scale of 0 to 255 and not yet clamped; the fourth value is 255.
///
/// Returns nothing for positions too near the border for a whole window: their indices go to `at_border`.
pub(crate) fn interpolate_rgb8<K: InterpolationKernel>(
    picture: Rgb8<'_>,
    positions: &Positions,
    out: &mut [[f32; 4]],
    at_border: &mut Vec<usize>,
) {
    debug_assert_eq!(picture.samples.len(), picture.width * picture.height * 3);
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::interpolate_rgb8::<K>(picture, positions, out, at_border) };
    }
    interpolate_rgb8_portable::<K>(picture, positions, out, at_border);
}

fn interpolate_rgb8_portable<K: InterpolationKernel>(
    picture: Rgb8<'_>,
    positions: &Positions,
    out: &mut [[f32; 4]],
    at_border: &mut Vec<usize>,
) {
    for (index, out) in out.iter_mut().enumerate().take(positions.len()) {
        let Some(top_left) = picture.window(positions.column[index], positions.row[index]) else {
            at_border.push(index);
            continue;
        };
        let (wx, wy) = (K::taps(positions.fraction_x[index]), K::taps(positions.fraction_y[index]));
        let stride = 3 * picture.width;
        let rows: [&[u8]; 4] = std::array::from_fn(|row| {
            let start = top_left + row * stride;
            &picture.samples[start..start + 12]
        });
        let columns: [f32; 12] = std::array::from_fn(|index| {
            ((f32::from(rows[0][index]) * wy[0] + f32::from(rows[1][index]) * wy[1])
                + f32::from(rows[2][index]) * wy[2])
                + f32::from(rows[3][index]) * wy[3]
        });
        let channel =
            |c| ((columns[c] * wx[0] + columns[3 + c] * wx[1]) + columns[6 + c] * wx[2]) + columns[9 + c] * wx[3];
        *out = [channel(0), channel(1), channel(2), 255.0];
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        __m128, __m128i, _mm_add_ps, _mm_alignr_epi8, _mm_blend_ps, _mm_castps_si128, _mm_castsi128_ps,
        _mm_cvtepi32_ps, _mm_cvtepu8_epi32, _mm_loadu_si128, _mm_mul_ps, _mm_set1_ps, _mm_srli_si128, _mm_storeu_ps,
        _mm256_add_ps, _mm256_castps256_ps128, _mm256_cvtepi32_ps, _mm256_cvtepu8_epi32, _mm256_extractf128_ps,
        _mm256_mul_ps, _mm256_set1_ps,
    };

    use super::{Positions, Rgb8};
    use crate::kernel::InterpolationKernel;

    #[target_feature(enable = "avx2")]
    pub(super) fn interpolate_rgb8<K: InterpolationKernel>(
        picture: Rgb8<'_>,
        positions: &Positions,
        out: &mut [[f32; 4]],
        at_border: &mut Vec<usize>,
    ) {
        let stride = 3 * picture.width;
        for (index, out) in out.iter_mut().enumerate().take(positions.len()) {
            let Some(top_left) = picture.window(positions.column[index], positions.row[index]) else {
                at_border.push(index);
                continue;
            };
            let (wx, wy) = (K::taps(positions.fraction_x[index]), K::taps(positions.fraction_y[index]));
            let window = &picture.samples[top_left..top_left + 3 * stride + 16];
            // Twelve sums over the rows: pixels 0 to 2 2/3 in `low`, the rest in `high`.
            let mut low = [_mm256_set1_ps(0.0); 4];
            let mut high = [_mm_set1_ps(0.0); 4];
            for row in 0..4 {
                // SAFETY: `window` holds 16 bytes from the start of each of its four rows.
                let bytes: __m128i = unsafe { _mm_loadu_si128(window.as_ptr().add(row * stride).cast()) };
                low[row] = _mm256_mul_ps(_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(bytes)), _mm256_set1_ps(wy[row]));
                let rest = _mm_cvtepu8_epi32(_mm_srli_si128::<8>(bytes));
                high[row] = _mm_mul_ps(_mm_cvtepi32_ps(rest), _mm_set1_ps(wy[row]));
            }
            let low = _mm256_add_ps(_mm256_add_ps(_mm256_add_ps(low[0], low[1]), low[2]), low[3]);
            let third = _mm_add_ps(_mm_add_ps(_mm_add_ps(high[0], high[1]), high[2]), high[3]);
            // r0 g0 b0 r1 | g1 b1 r2 g2 | b2 r3 g3 b3
            let (first, second) = (_mm256_castps256_ps128(low), _mm256_extractf128_ps::<1>(low));
            let taps = [first, shift::<12>(second, first), shift::<8>(third, second), shift::<4>(third, third)];
            let mut sum = _mm_mul_ps(taps[0], _mm_set1_ps(wx[0]));
            for tap in 1..4 {
                sum = _mm_add_ps(sum, _mm_mul_ps(taps[tap], _mm_set1_ps(wx[tap])));
            }
            let sum = _mm_blend_ps::<0b1000>(sum, _mm_set1_ps(255.0));
            // SAFETY: `out` is four floats.
            unsafe { _mm_storeu_ps(out.as_mut_ptr(), sum) };
        }
    }

    /// The four floats that start `BYTES` bytes into `low` followed by `high`.
    #[target_feature(enable = "avx2")]
    fn shift<const BYTES: i32>(high: __m128, low: __m128) -> __m128 {
        _mm_castsi128_ps(_mm_alignr_epi8::<BYTES>(_mm_castps_si128(high), _mm_castps_si128(low)))
    }
}
