//! Weighted sums of the levels of several photographs.

#[cfg(doc)]
use super::plane::level_shares;
use super::plane::{PyramidPlane, Texel, color};

/// A weighted sum divided by its weight; `None` without any.
#[inline(always)]
fn mean([r, g, b, weight]: [f32; 4]) -> Option<[f32; 3]> {
    (weight > 0.0).then(|| [r / weight, g / weight, b / weight])
}

/// Adds to `sum` the level's detail of one photograph, `level` minus its interpolated coarser level, weighted by `mask` and by
/// the share covered (its fourth power); masks count as `least` more than they are. The coarser level has even shares ([`level_shares`]), as what is added back has.
pub(crate) fn add_detail(
    sum: &mut PyramidPlane<[f32; 4]>,
    level: &PyramidPlane<[f32; 4]>,
    coarser: &PyramidPlane<[f32; 4]>,
    mask: &PyramidPlane<f32>,
    least: f32,
) {
    let smooth = coarser.expanded(&level.columns, &level.rows);
    for_each_weighted(sum, level, mask, least, |index, own| match color(smooth.texels[index]) {
        Some(base) => [own[0] - base[0], own[1] - base[1], own[2] - base[2]],
        None => [0.0; 3],
    });
}

/// Adds to `sum` one photograph at the coarsest level.
pub(crate) fn add_base(sum: &mut PyramidPlane<[f32; 4]>, level: &PyramidPlane<[f32; 4]>, mask: &PyramidPlane<f32>) {
    for_each_weighted(sum, level, mask, LEAST_WEIGHT, |_, own| own);
}

/// A photograph that covers a place counts this much there even where its mask is zero: it shows where no other does.
pub(crate) const LEAST_WEIGHT: f32 = 1e-6;

/// Smallest share that weights tell apart; their products stay far from where numbers lose digits.
const LEAST_TRUST: f32 = 1e-3;

#[inline(always)]
fn for_each_weighted(
    sum: &mut PyramidPlane<[f32; 4]>,
    level: &PyramidPlane<[f32; 4]>,
    mask: &PyramidPlane<f32>,
    least: f32,
    value: impl Fn(usize, [f32; 3]) -> [f32; 3],
) {
    debug_assert_eq!((&level.columns, &level.rows), (&mask.columns, &mask.rows));
    let width = level.columns.len();
    for y in level.rows.clone() {
        let start = (y - level.rows.start) * width;
        let (own, mask) = (level.row(y), mask.row(y));
        let shift = level.columns.start - sum.columns.start;
        let sums = &mut sum.row_mut(y)[shift..shift + width];
        for (x, (sum, (own, mask))) in sums.iter_mut().zip(own.iter().zip(mask)).enumerate() {
            let mask = mask + least;
            if mask > 0.0
                && let Some(own_color) = color(*own)
            {
                // Where a photograph ends, its samples are means of one side only: they soon count nothing beside others.
                let share = own[3].max(LEAST_TRUST);
                let weight = mask * (share * share) * (share * share);
                let [r, g, b] = value(start + x, own_color);
                *sum = sum.plus([r, g, b, 1.0], weight);
            }
        }
    }
}

/// Turns weighted sums into the blended level: their mean, on top of what the coarser blended level interpolates to. The
/// fourth channel becomes 1 where there is something.
pub(crate) fn collapse(sum: &mut PyramidPlane<[f32; 4]>, coarser: Option<&PyramidPlane<[f32; 4]>>) {
    let smooth = coarser.map(|coarser| coarser.expanded(&sum.columns, &sum.rows));
    for (index, texel) in sum.texels.iter_mut().enumerate() {
        let base = smooth.as_ref().map_or(Some([0.0; 3]), |smooth| color(smooth.texels[index]));
        *texel = match (mean(*texel), base) {
            (Some(detail), Some(base)) => [detail[0] + base[0], detail[1] + base[1], detail[2] + base[2], 1.0],
            _ => [0.0; 4],
        };
    }
}
