//! How the brightness of photographs changes over wider places than a contour.

use super::band::Band;
use crate::small_views::{SmallView, WHOLLY, luma};

/// Parts of a gray level in which slopes are counted.
pub(super) const FRACTION: i32 = 64;

/// Pixels of the seams' canvas over which shading is averaged to either side; half of it across.
const SHADING_REACH: usize = 4;

/// How bright a view is around its pixels, and how that changes there. Where it is not wanted, zeros, which no memory
/// need be touched for.
pub(super) struct Shading {
    /// Across and down: the mean brightness on one side minus that on the other, in [`FRACTION`]s of a gray level; 0
    /// where one side shows nothing.
    pub(super) slopes: Vec<[i16; 2]>,
    /// One more than the mean brightness around the pixel, in [`FRACTION`]s of a gray level; 0 where nothing is
    /// covered.
    pub(super) means: Vec<i16>,
}

/// The shading of every pixel of a view that is `wanted`; none elsewhere.
///
/// The sides are half of [`SHADING_REACH`] pixels deep and reach that many pixels to either side along the line between
/// them. Where two photographs differ in this, a panorama cannot go over from one to the other without a slope that
/// neither shows, however wide the transition: it is what the eye takes for a seam in skies and on walls, while
/// differences of single pixels have both signs along a seam and mean little there.
pub(super) fn shading(view: &SmallView, wanted: &Band) -> Shading {
    let reach = SHADING_REACH;
    let (width, height) = (view.columns.len(), view.rows.len());
    let sums = Sums::new(view);
    let deep = (reach / 2).max(1);
    let slope = |first: Option<i32>, second: Option<i32>| match (first, second) {
        // Means of 8 bits in 64ths differ by less than 2^15.
        (Some(first), Some(second)) => (second - first) as i16,
        _ => 0,
    };
    let (mut slopes, mut means) = (vec![[0; 2]; width * height], vec![0; width * height]);
    let rows = slopes.chunks_exact_mut(width.max(1)).zip(means.chunks_exact_mut(width.max(1)));
    for (y, (slopes, means)) in rows.enumerate() {
        let along_y = [y.saturating_sub(reach), (y + reach + 1).min(height)];
        let (above, below) = ([y.saturating_sub(deep), y], [y + 1, (y + 1 + deep).min(height)]);
        for x in wanted.within(&view.columns, view.rows.start + y).map(|x| x - view.columns.start) {
            let along_x = [x.saturating_sub(reach), (x + reach + 1).min(width)];
            let (left, right) = ([x.saturating_sub(deep), x], [x + 1, (x + 1 + deep).min(width)]);
            slopes[x] = [
                slope(sums.mean(left, along_y), sums.mean(right, along_y)),
                slope(sums.mean(along_x, above), sums.mean(along_x, below)),
            ];
            // 255 levels in 64ths, and one, are less than 2^15.
            means[x] = sums.mean(along_x, along_y).map_or(0, |mean| mean as i16 + 1);
        }
    }
    Shading { slopes, means }
}

/// Sums of brightness over the pixels left of and above each corner, and their number.
///
/// # Source
/// Crow, "Summed-area tables for texture mapping", SIGGRAPH 1984. Sums wrap around; those of small boxes, their
/// differences, do not.
struct Sums {
    /// Corners of a row, one more than pixels.
    corners: usize,
    sums: Vec<[u32; 2]>,
}

impl Sums {
    fn new(view: &SmallView) -> Self {
        let corners = view.columns.len() + 1;
        let mut sums = vec![[0_u32; 2]; corners * (view.rows.len() + 1)];
        for (y, row) in view.pixels.chunks_exact(view.columns.len().max(1)).enumerate() {
            let mut so_far = [0_u32; 2];
            for (x, pixel) in row.iter().enumerate() {
                if pixel[3] & WHOLLY != 0 {
                    so_far = [so_far[0].wrapping_add(luma(pixel)), so_far[1] + 1];
                }
                let above = sums[y * corners + x + 1];
                sums[(y + 1) * corners + x + 1] = [so_far[0].wrapping_add(above[0]), so_far[1].wrapping_add(above[1])];
            }
        }
        Self { corners, sums }
    }

    /// The mean over a box whose ends are corners, in [`FRACTION`]s of a level; `None` where nothing is covered wholly.
    #[inline]
    fn mean(&self, [left, right]: [usize; 2], [top, bottom]: [usize; 2]) -> Option<i32> {
        if left >= right || top >= bottom {
            return None;
        }
        let at = |x: usize, y: usize| self.sums[y * self.corners + x];
        let (a, b, c, d) = (at(right, bottom), at(left, bottom), at(right, top), at(left, top));
        let of = |k: usize| a[k].wrapping_sub(b[k]).wrapping_sub(c[k]).wrapping_add(d[k]);
        let (sum, count) = (of(0), of(1));
        (count > 0).then(|| ((u64::from(sum) * FRACTION as u64) / (u64::from(count) << 8)) as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small_views::PARTLY;

    fn view(level: impl Fn(usize, usize) -> u8, covered: impl Fn(usize, usize) -> bool) -> SmallView {
        let pixel = |index: usize| {
            let (x, y) = (index % 40, index / 40);
            let level = level(x, y);
            [level, level, level, if covered(x, y) { PARTLY | WHOLLY } else { 0 }]
        };
        SmallView { columns: 3..43, rows: 5..35, pixels: (0..40 * 30).map(pixel).collect() }
    }

    /// All pixels of a canvas but those of a column.
    fn canvas_but(left_out: u32) -> Band {
        Band::of_columns((0..60).filter(|&x| x != left_out), [60, 40])
    }

    #[test]
    fn a_ramp_has_the_slope_between_the_middles_of_both_sides() {
        // Three levels a column, two a row. Sides of two pixels: their middles lie three pixels apart.
        let ramp = view(|x, y| (3 * x + 2 * y) as u8, |_, _| true);
        let shading = shading(&ramp, &canvas_but(33));
        let slope = |at: usize| shading.slopes[at];
        assert_eq!(slope(15 * 40 + 20), [9 * FRACTION as i16, 6 * FRACTION as i16]);
        assert_eq!(shading.means[15 * 40 + 20], (3 * 20 + 2 * 15) * FRACTION as i16 + 1);
        // Beside the border the side that is left counts: one pixel, its middle two and a half away.
        assert_eq!(slope(15 * 40 + 1), [15 * FRACTION as i16 / 2, 6 * FRACTION as i16]);
        assert_eq!(slope(15 * 40), [0, 6 * FRACTION as i16]);
        // Not wanted.
        assert_eq!((shading.slopes[15 * 40 + 30], shading.means[15 * 40 + 30]), ([0, 0], 0));
    }

    #[test]
    fn texture_is_no_slope_and_what_is_not_covered_takes_no_part() {
        let stripes = view(|x, _| if x % 2 == 0 { 90 } else { 110 }, |_, _| true);
        let is_even = |slope: &[i16; 2]| *slope == [0, 0];
        assert!(shading(&stripes, &canvas_but(0)).slopes.iter().skip(15 * 40 + 5).take(30).all(is_even));
        let half = view(|x, _| if x < 20 { 100 } else { 0 }, |x, _| x < 20);
        let shading = shading(&half, &canvas_but(0));
        assert!(shading.slopes.iter().all(is_even));
        let level = 100 * FRACTION as i16 + 1;
        assert_eq!([10, 23, 30].map(|x| shading.means[15 * 40 + x]), [level, level, 0]);
    }
}
