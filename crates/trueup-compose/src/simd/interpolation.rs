//! Samples of 8-bit RGB pictures between their pixels.

use trueup_core::interpolation::cubic_convolution_taps;

use super::positions::Positions;
use super::{VectorLoop, with_vector_instructions};
use crate::linear_table::ROUNDING;

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

/// Interpolates 8-bit RGB at every position by cubic convolution, on the scale of 0 to 255 and not yet clamped; the
/// fourth value is 255.
///
/// Returns nothing for positions too near the border for a whole window: their indices go to `at_border`.
pub(crate) fn cubic_rgb8(picture: Rgb8<'_>, positions: &Positions, out: &mut [[f32; 4]], at_border: &mut Vec<usize>) {
    debug_assert_eq!(picture.samples.len(), picture.width * picture.height * 3);
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::cubic_rgb8(picture, positions, out, at_border) };
    }
    cubic_rgb8_portable(picture, positions, out, at_border);
}

/// Interpolates 8-bit RGB between the 2 x 2 pixels around every position; else as [`cubic_rgb8`].
pub(crate) fn linear_rgb8(picture: Rgb8<'_>, positions: &Positions, out: &mut [[f32; 4]], at_border: &mut Vec<usize>) {
    debug_assert_eq!(picture.samples.len(), picture.width * picture.height * 3);
    with_vector_instructions(Linear { picture, positions, out, at_border });
}

struct Linear<'a> {
    picture: Rgb8<'a>,
    positions: &'a Positions,
    out: &'a mut [[f32; 4]],
    at_border: &'a mut Vec<usize>,
}

impl VectorLoop for Linear<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { picture, positions, out, at_border } = self;
        let stride = 3 * picture.width;
        for (index, out) in out.iter_mut().enumerate().take(positions.len()) {
            let Some(top_left) = picture.window(positions.column[index], positions.row[index]) else {
                at_border.push(index);
                continue;
            };
            let (right, below) = (positions.fraction_x[index], positions.fraction_y[index]);
            let (left, above) = (1.0 - right, 1.0 - below);
            // The middle two columns and rows of the window, six samples each, and two more, which are not looked at.
            let row = |row: usize| picture.samples[top_left + row * stride + 3..].first_chunk::<8>();
            let (Some(upper), Some(lower)) = (row(1), row(2)) else { continue };
            let mut columns = [0.0; 8];
            for at in 0..8 {
                columns[at] = f32::from(upper[at]) * above + f32::from(lower[at]) * below;
            }
            for channel in 0..3 {
                out[channel] = columns[channel] * left + columns[3 + channel] * right;
            }
            out[3] = 255.0;
        }
    }
}

/// One in the fixed-point weights of the taps. Two weights and their samples make up one 32-bit sum.
const ONE_BITS: u32 = 14;

/// Bits behind the point of what is summed along a column, 16 bits with its sign: a cubic kernel makes -32 to 287 of
/// levels of 0 to 255. A sum over the columns is off by less than a hundredth of a level.
const COLUMN_BITS: u32 = 6;

/// Positions whose weights are found together.
const BLOCK: usize = 16;

/// Fixed-point weights of four taps, as pairs of 16 bits: the first and the second, the third and the fourth.
#[derive(Debug, Clone, Copy, Default)]
struct PairedTaps {
    first: [u32; BLOCK],
    last: [u32; BLOCK],
}

impl PairedTaps {
    /// Those of some positions; the weights of one add up to one exactly.
    #[inline(always)]
    fn of(fractions: &[f32]) -> Self {
        const ONE: u32 = 1 << ONE_BITS;
        let mut block = [0.0; BLOCK];
        block[..fractions.len()].copy_from_slice(fractions);
        let mut taps = Self::default();
        // Without closures, which are functions of their own to the compiler, without the caller's vector instructions.
        for (at, fraction) in block.into_iter().enumerate() {
            let [a, _, c, d] = cubic_convolution_taps(fraction);
            let a = (a * ONE as f32 + ROUNDING).to_bits() & 0xffff;
            let c = (c * ONE as f32 + ROUNDING).to_bits() & 0xffff;
            let d = (d * ONE as f32 + ROUNDING).to_bits() & 0xffff;
            let b = ONE.wrapping_sub(a).wrapping_sub(c).wrapping_sub(d);
            taps.first[at] = a | b << 16;
            taps.last[at] = c | d << 16;
        }
        taps
    }

    /// The four weights of one position.
    #[inline(always)]
    fn weights(&self, index: usize) -> [i32; 4] {
        let [low, high] = [0, 16].map(|shift| move |pair: u32| i32::from((pair >> shift) as u16 as i16));
        [low(self.first[index]), high(self.first[index]), low(self.last[index]), high(self.last[index])]
    }
}

/// A weighted sum of samples along a column, with [`COLUMN_BITS`] behind the point.
#[inline(always)]
fn column_sum(samples: [u8; 4], weights: [i32; 4]) -> i32 {
    let sum = (0..4).map(|tap| i32::from(samples[tap]) * weights[tap]).sum::<i32>();
    (sum + (1 << (ONE_BITS - COLUMN_BITS - 1))) >> (ONE_BITS - COLUMN_BITS)
}

/// A weighted sum of columns, on the scale of 0 to 255.
#[inline(always)]
fn level(columns: [i32; 4], weights: [i32; 4]) -> f32 {
    const SCALE: f32 = 1.0 / (1 << (ONE_BITS + COLUMN_BITS)) as f32;
    (0..4).map(|tap| columns[tap] * weights[tap]).sum::<i32>() as f32 * SCALE
}

/// The 4 x 4 pixels around one position as the interpolation weighs them, columns of rows, for positions whose window
/// is cut by the border.
pub(crate) fn cubic_window(window: [[[u8; 3]; 4]; 4], fraction_x: f32, fraction_y: f32) -> [f32; 4] {
    let [wx, wy] = [fraction_x, fraction_y].map(|fraction| PairedTaps::of(&[fraction]).weights(0));
    let channel = |c: usize| level(window.map(|column| column_sum(column.map(|pixel| pixel[c]), wy)), wx);
    [channel(0), channel(1), channel(2), 255.0]
}

fn cubic_rgb8_portable(picture: Rgb8<'_>, positions: &Positions, out: &mut [[f32; 4]], at_border: &mut Vec<usize>) {
    let stride = 3 * picture.width;
    let count = positions.len().min(out.len());
    for start in (0..count).step_by(BLOCK) {
        let block = start..(start + BLOCK).min(count);
        let taps_x = PairedTaps::of(&positions.fraction_x[block.clone()]);
        let taps_y = PairedTaps::of(&positions.fraction_y[block.clone()]);
        for (at, index) in block.enumerate() {
            let Some(top_left) = picture.window(positions.column[index], positions.row[index]) else {
                at_border.push(index);
                continue;
            };
            let (wx, wy) = (taps_x.weights(at), taps_y.weights(at));
            let sample =
                |column: usize, row: usize, c: usize| picture.samples[top_left + row * stride + 3 * column + c];
            let column = |column: usize, c: usize| column_sum([0, 1, 2, 3].map(|row| sample(column, row, c)), wy);
            let channel = |c: usize| level([0, 1, 2, 3].map(|tap| column(tap, c)), wx);
            out[index] = [channel(0), channel(1), channel(2), 255.0];
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        __m128i, __m256i, _mm_add_epi32, _mm_alignr_epi8, _mm_blend_ps, _mm_cvtepi32_ps, _mm_loadu_si128,
        _mm_madd_epi16, _mm_mul_ps, _mm_set1_epi32, _mm_set1_ps, _mm_setr_epi8, _mm_shuffle_epi8, _mm_storeu_ps,
        _mm256_add_epi32, _mm256_castsi256_si128, _mm256_cvtepu8_epi16, _mm256_extracti128_si256, _mm256_madd_epi16,
        _mm256_packs_epi32, _mm256_set1_epi32, _mm256_srai_epi32, _mm256_unpackhi_epi16, _mm256_unpacklo_epi16,
    };

    use super::{BLOCK, COLUMN_BITS, ONE_BITS, PairedTaps, Positions, Rgb8};

    #[target_feature(enable = "avx2")]
    pub(super) fn cubic_rgb8(
        picture: Rgb8<'_>,
        positions: &Positions,
        out: &mut [[f32; 4]],
        at_border: &mut Vec<usize>,
    ) {
        const SHIFT: i32 = (ONE_BITS - COLUMN_BITS) as i32;
        const SCALE: f32 = 1.0 / (1 << (ONE_BITS + COLUMN_BITS)) as f32;
        let stride = 3 * picture.width;
        let half = _mm256_set1_epi32(1 << (SHIFT - 1));
        // Of words r0 g0 b0 r1 g1 b1 .. and of words r2 g2 b2 r3 g3 b3 ..: r0 r1, g0 g1, b0 b1.
        let pairs = _mm_setr_epi8(0, 1, 6, 7, 2, 3, 8, 9, 4, 5, 10, 11, -1, -1, -1, -1);
        let count = positions.len().min(out.len());
        for start in (0..count).step_by(BLOCK) {
            let block = start..(start + BLOCK).min(count);
            let taps_x = PairedTaps::of(&positions.fraction_x[block.clone()]);
            let taps_y = PairedTaps::of(&positions.fraction_y[block.clone()]);
            for (at, index) in block.enumerate() {
                let Some(top_left) = picture.window(positions.column[index], positions.row[index]) else {
                    at_border.push(index);
                    continue;
                };
                let window = &picture.samples[top_left..top_left + 3 * stride + 16];
                // SAFETY: `window` holds 16 bytes from the start of each of its four rows.
                let row = |row: usize| unsafe { _mm_loadu_si128(window.as_ptr().add(row * stride).cast()) };
                let rows = [words(row(0)), words(row(1)), words(row(2)), words(row(3))];
                let upper = _mm256_set1_epi32(taps_y.first[at] as i32);
                let lower = _mm256_set1_epi32(taps_y.last[at] as i32);
                // Each half of a vector for itself: words 0 to 3 and 8 to 11, then 4 to 7 and 12 to 15.
                let low = _mm256_add_epi32(
                    _mm256_madd_epi16(_mm256_unpacklo_epi16(rows[0], rows[1]), upper),
                    _mm256_madd_epi16(_mm256_unpacklo_epi16(rows[2], rows[3]), lower),
                );
                let high = _mm256_add_epi32(
                    _mm256_madd_epi16(_mm256_unpackhi_epi16(rows[0], rows[1]), upper),
                    _mm256_madd_epi16(_mm256_unpackhi_epi16(rows[2], rows[3]), lower),
                );
                let columns = _mm256_packs_epi32(
                    _mm256_srai_epi32::<SHIFT>(_mm256_add_epi32(low, half)),
                    _mm256_srai_epi32::<SHIFT>(_mm256_add_epi32(high, half)),
                );
                // r0 g0 b0 r1 g1 b1 r2 g2 | b2 r3 g3 b3
                let (first, rest) = (_mm256_castsi256_si128(columns), _mm256_extracti128_si256::<1>(columns));
                let last = _mm_alignr_epi8::<12>(rest, first);
                let sums = _mm_add_epi32(
                    _mm_madd_epi16(_mm_shuffle_epi8(first, pairs), _mm_set1_epi32(taps_x.first[at] as i32)),
                    _mm_madd_epi16(_mm_shuffle_epi8(last, pairs), _mm_set1_epi32(taps_x.last[at] as i32)),
                );
                let levels = _mm_mul_ps(_mm_cvtepi32_ps(sums), _mm_set1_ps(SCALE));
                let levels = _mm_blend_ps::<0b1000>(levels, _mm_set1_ps(255.0));
                // SAFETY: a pixel is four floats.
                unsafe { _mm_storeu_ps(out[index].as_mut_ptr(), levels) };
            }
        }
    }

    /// Sixteen bytes as words.
    #[target_feature(enable = "avx2")]
    fn words(bytes: __m128i) -> __m256i {
        _mm256_cvtepu8_epi16(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_to_one_and_are_the_kernels() {
        for step in 0..=1000 {
            let fraction = step as f32 / 1000.0;
            let weights = PairedTaps::of(&[fraction]).weights(0);
            assert_eq!(weights.iter().sum::<i32>(), 1 << ONE_BITS, "{fraction}");
            for (weight, exact) in weights.into_iter().zip(cubic_convolution_taps(fraction)) {
                // Three are rounded; what is left of one is off by all of them.
                assert!((weight as f32 - exact * (1 << ONE_BITS) as f32).abs() <= 1.6, "{weight} at {fraction}");
            }
        }
    }
}
