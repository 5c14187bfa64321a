//! Weighted sums of the levels of several photographs.

#[cfg(doc)]
use super::plane::level_shares;
use super::plane::{PyramidPlane, Texel, color};
use crate::simd::{VectorLoop, with_vector_instructions};

/// A weighted sum divided by its weight; `None` without any.
#[inline(always)]
fn mean([r, g, b, weight]: [f32; 4]) -> Option<[f32; 3]> {
    (weight > 0.0).then(|| [r / weight, g / weight, b / weight])
}

/// Adds to `sum` the level's detail of one photograph, `level` minus its interpolated coarser level, weighted by `mask`
/// and by the share covered (its fourth power); masks count as `least` more than they are. The coarser level has even
/// shares ([`level_shares`]), as what is added back has.
pub(crate) fn add_detail(
    sum: &mut PyramidPlane<[f32; 4]>,
    level: &PyramidPlane<[f32; 4]>,
    coarser: &PyramidPlane<[f32; 4]>,
    mask: &PyramidPlane<f32>,
    least: f32,
) {
    let mut expansion = coarser.expansion(&level.columns, level.rows.start);
    let mut smooth = vec![[0.0; 4]; level.columns.len()];
    for y in level.rows.clone() {
        expansion.next_row(&mut smooth);
        with_vector_instructions(Weighted { row: WeightedRow::of(sum, level, mask, y), smooth: Some(&smooth), least });
    }
}

/// Adds to `sum` one photograph at the coarsest level.
pub(crate) fn add_base(sum: &mut PyramidPlane<[f32; 4]>, level: &PyramidPlane<[f32; 4]>, mask: &PyramidPlane<f32>) {
    for y in level.rows.clone() {
        let row = WeightedRow::of(sum, level, mask, y);
        with_vector_instructions(Weighted { row, smooth: None, least: LEAST_WEIGHT });
    }
}

/// A photograph that covers a place counts this much there even where its mask is zero: it shows where no other does.
pub(crate) const LEAST_WEIGHT: f32 = 1e-6;

/// Smallest share that weights tell apart; their products stay far from where numbers lose digits.
const LEAST_TRUST: f32 = 1e-3;

/// A row of a photograph's level, of its mask, and of the sums it is added to.
struct WeightedRow<'a> {
    sums: &'a mut [[f32; 4]],
    own: &'a [[f32; 4]],
    mask: &'a [f32],
}

impl<'a> WeightedRow<'a> {
    fn of(
        sum: &'a mut PyramidPlane<[f32; 4]>,
        level: &'a PyramidPlane<[f32; 4]>,
        mask: &'a PyramidPlane<f32>,
        y: usize,
    ) -> Self {
        debug_assert_eq!((&level.columns, &level.rows), (&mask.columns, &mask.rows));
        let shift = level.columns.start - sum.columns.start;
        let sums = &mut sum.row_mut(y)[shift..shift + level.columns.len()];
        Self { sums, own: level.row(y), mask: mask.row(y) }
    }
}

/// Adds a row, less what its coarser level interpolates to, weighted.
struct Weighted<'a> {
    row: WeightedRow<'a>,
    /// `None` where there is no coarser level.
    smooth: Option<&'a [[f32; 4]]>,
    least: f32,
}

impl VectorLoop for Weighted<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { row: WeightedRow { sums, own, mask }, smooth, least } = self;
        for (x, (sum, (own, mask))) in sums.iter_mut().zip(own.iter().zip(mask)).enumerate() {
            let mask = mask + least;
            if mask > 0.0
                && let Some([r, g, b]) = color(*own)
            {
                // Where a photograph ends, its samples are means of one side only: they soon count nothing beside
                // others.
                let share = own[3].max(LEAST_TRUST);
                let weight = mask * (share * share) * (share * share);
                let detail = match smooth.map(|smooth| color(smooth[x])) {
                    Some(Some(base)) => [r - base[0], g - base[1], b - base[2]],
                    Some(None) => [0.0; 3],
                    None => [r, g, b],
                };
                *sum = sum.plus([detail[0], detail[1], detail[2], 1.0], weight);
            }
        }
    }
}

/// Turns weighted sums into the blended level: their mean, on top of what the coarser blended level interpolates to.
/// The fourth channel becomes 1 where there is something.
pub(crate) fn collapse(sum: &mut PyramidPlane<[f32; 4]>, coarser: Option<&PyramidPlane<[f32; 4]>>) {
    let (columns, rows) = (sum.columns.clone(), sum.rows.clone());
    let mut expansion = coarser.map(|coarser| coarser.expansion(&columns, rows.start));
    // Without a coarser level, black is what is added to.
    let mut smooth = vec![[0.0, 0.0, 0.0, 1.0]; columns.len()];
    for y in rows {
        if let Some(expansion) = &mut expansion {
            expansion.next_row(&mut smooth);
        }
        with_vector_instructions(Collapsed { sums: sum.row_mut(y), smooth: &smooth });
    }
}

/// A row of sums and what its coarser level interpolates to.
struct Collapsed<'a> {
    sums: &'a mut [[f32; 4]],
    smooth: &'a [[f32; 4]],
}

impl VectorLoop for Collapsed<'_> {
    #[inline(always)]
    fn run(self) {
        for (texel, smooth) in self.sums.iter_mut().zip(self.smooth) {
            *texel = match (mean(*texel), color(*smooth)) {
                (Some(detail), Some(base)) => [detail[0] + base[0], detail[1] + base[1], detail[2] + base[2], 1.0],
                _ => [0.0; 4],
            };
        }
    }
}
