//! How much a photograph counts at a canvas pixel, and how opaque the panorama is there.
//!
//! One number carries both. A photograph that covers a pixel wholly has a weight of at least [`EDGE_WEIGHT`]; one that
//! covers it in part (its border cuts the pixel, or the sample is partly transparent) has the covered share of
//! `EDGE_WEIGHT`, too little to be seen against a photograph that covers the pixel. The sum of the weights divided by
//! `EDGE_WEIGHT`, at most 1, is then the panorama's alpha, and no photograph darkens where it ends.

/// Weight of a photograph that only just covers a pixel; whole weights lie between this and 1.
///
/// 2^-20: below a quarter of an 8-bit step against a photograph of weight 2^-10, and exact in the sum.
pub(crate) const EDGE_WEIGHT: f32 = 1.0 / 1_048_576.0;

/// A share of the pixel closer to 1 than this counts as whole.
pub(crate) const WHOLE: f32 = 1.0 - 1e-3;

/// How photographs count beside each other where they are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weighting {
    /// Each by its [`Feather`].
    Feathered,
    /// All the same.
    Equal,
}

/// Power of the feather weight. Higher values let the photograph that lies deepest prevail, which shortens the
/// transition and with it ghosts; 1 blends over the whole overlap.
pub(crate) const FEATHER_EXPONENT: f64 = 3.0;

/// The feather of one photograph: a product of a profile along x and one along y, both 1 at the middle and 0 at the
/// borders.
///
/// The profile is `s(t)^exponent` with `t = 2 min(x, W - x) / W` and the smooth step `s(t) = t^2 (3 - 2 t)`.
///
/// # Departures
/// The published weight is `min(x + 1, W - x) min(y + 1, H - y)` of whole pixels, whose slope jumps at the middle and
/// at the border; the smooth step has no such lines to be seen.
#[derive(Debug, Clone)]
pub(crate) struct Feather {
    /// Profile at the centers of the columns -1 to W.
    x: Vec<f32>,
    /// Profile at the centers of the rows -1 to H.
    y: Vec<f32>,
    size: [f32; 2],
}

impl Feather {
    /// The feather of a photograph of `size` pixels.
    pub(crate) fn new(size: [f64; 2], exponent: f64) -> Self {
        let profile = |length: f64| -> Vec<f32> {
            (-1..=length.ceil() as i64)
                .map(|index| {
                    let position = index as f64 + 0.5;
                    let t = (2.0 * position.min(length - position) / length).clamp(0.0, 1.0);
                    (t * t * (3.0 - 2.0 * t)).powf(exponent) as f32
                })
                .collect()
        };
        Self { x: profile(size[0]), y: profile(size[1]), size: size.map(|length| length as f32) }
    }

    /// Feather from 0 to 1 at a position: pixel and fraction beyond its center.
    #[inline(always)]
    pub(crate) fn at(&self, column: i32, row: i32, fraction_x: f32, fraction_y: f32) -> f32 {
        profile_at(&self.x, column, fraction_x) * profile_at(&self.y, row, fraction_y)
    }

    /// The share of a canvas pixel that the photograph covers: 1/2 where the border runs through its center, falling to
    /// 0 and rising to 1 over one canvas pixel. `footprint` is the size of a canvas pixel in photograph pixels.
    #[inline(always)]
    pub(crate) fn coverage(&self, position: [f32; 2], footprint: [f32; 2]) -> f32 {
        let along = |axis: usize| {
            let inside = position[axis].min(self.size[axis] - position[axis]);
            (0.5 + inside / footprint[axis]).clamp(0.0, 1.0)
        };
        along(0) * along(1)
    }
}

#[inline(always)]
fn profile_at(profile: &[f32], index: i32, fraction: f32) -> f32 {
    let first = (index.max(-1) as usize).wrapping_add(1).min(profile.len() - 2);
    let pair = &profile[first..first + 2];
    pair[0] + fraction * (pair[1] - pair[0])
}

/// The weight of a sample that covers `share` (0 to 1) of its pixel and has the blend's weight `inside` (0 to 1) where
/// it covers all of it.
#[inline(always)]
pub(crate) fn weight(share: f32, inside: f32) -> f32 {
    if share >= WHOLE { EDGE_WEIGHT + (1.0 - EDGE_WEIGHT) * inside } else { EDGE_WEIGHT * share }
}

/// Alpha from 0 to 1 of a canvas pixel from the sum of its weights.
#[inline(always)]
pub(crate) fn alpha(weight_sum: f32) -> f32 {
    (weight_sum * (1.0 / EDGE_WEIGHT)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_feather_is_one_in_the_middle_and_zero_at_the_border() {
        let feather = Feather::new([100.0, 61.0], 1.0);
        assert!((feather.at(49, 30, 0.5, 0.0) - 1.0).abs() < 1e-3);
        // Position (25, 30.5): t = 1/2, the smooth step's middle.
        assert!((feather.at(24, 30, 0.5, 0.0) - 0.5).abs() < 1e-3);
        assert!(feather.at(-1, 30, 0.5, 0.0) < 1e-3);
        assert_eq!(feather.at(i32::MIN, i32::MAX, 0.0, 1.0), 0.0);
        assert!((Feather::new([100.0, 61.0], 2.0).at(24, 30, 0.5, 0.0) - 0.25).abs() < 2e-3);
    }

    #[test]
    fn coverage_is_half_on_the_border() {
        let feather = Feather::new([100.0, 60.0], 1.0);
        let coverage = |x, y| feather.coverage([x, y], [2.0, 1.0]);
        assert_eq!(coverage(0.0, 30.0), 0.5);
        assert_eq!(coverage(1.0, 30.0), 1.0);
        assert_eq!(coverage(101.0, 30.0), 0.0);
        assert_eq!(coverage(0.0, 60.0), 0.25);
    }

    #[test]
    fn alpha_is_the_covered_share() {
        assert_eq!(alpha(weight(0.25, 0.9)), 0.25);
        assert_eq!(alpha(weight(0.25, 0.9) + weight(0.5, 0.0)), 0.75);
        assert_eq!(alpha(weight(1.0, 0.0)), 1.0);
        assert_eq!(alpha(0.0), 0.0);
    }
}
