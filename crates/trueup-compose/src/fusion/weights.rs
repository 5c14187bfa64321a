//! How much each exposure counts at a place.

use crate::pyramid::PyramidPlane;
use trueup_core::raster::LUMA;

/// Level that is exposed best, of 0 to 1.
///
/// # Source
/// Mertens, Kautz and Van Reeth (2007), section 3.1; so is the deviation.
const BEST_LEVEL: f32 = 0.5;
/// Standard deviation about [`BEST_LEVEL`] by which a level is exposed worse.
const LEVEL_DEVIATION: f32 = 0.2;
/// Contrast, of 0 to 1, that a place has anyway: about what noise and compression make of an even one.
const CONTRAST_FLOOR: f32 = 0.01;
/// Saturation, of 0 to 1, that a place has anyway: a fifth of a plain color's, so that gray things are judged by their
/// exposure.
const SATURATION_FLOOR: f32 = 0.1;
/// What a place that nothing shows well counts in each exposure, so that there is always a mean.
const LEAST: f32 = 1e-12;

/// The weights of all exposures at every place: they add up to 1.
pub(super) fn normalized_weights(exposures: &[PyramidPlane<[f32; 4]>], has_color: bool) -> Vec<PyramidPlane<f32>> {
    let mut weights: Vec<PyramidPlane<f32>> =
        exposures.iter().map(|exposure| weights_of(exposure, has_color)).collect();
    let count = weights.first().map_or(0, |first| first.texels.len());
    for index in 0..count {
        let sum: f32 = weights.iter().map(|one| one.texels[index]).sum();
        weights.iter_mut().for_each(|one| one.texels[index] /= sum);
    }
    weights
}

fn weights_of(exposure: &PyramidPlane<[f32; 4]>, has_color: bool) -> PyramidPlane<f32> {
    let (width, height) = (exposure.columns.len(), exposure.rows.len());
    let mut weights = PyramidPlane::new(exposure.columns.clone(), exposure.rows.clone());
    let gray: Vec<f32> =
        exposure.texels.iter().map(|[r, g, b, _]| (LUMA[0] * r + LUMA[1] * g + LUMA[2] * b) / 255.0).collect();
    for y in 0..height {
        let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
        for x in 0..width {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            let at = |x: usize, y: usize| gray[y * width + x];
            let contrast = (at(left, y) + at(right, y) + at(x, above) + at(x, below) - 4.0 * at(x, y)).abs();
            let [r, g, b, _] = exposure.texels[y * width + x].map(|level| level / 255.0);
            weights.texels[y * width + x] = (CONTRAST_FLOOR + contrast)
                * if has_color { SATURATION_FLOOR + saturation([r, g, b]) } else { 1.0 }
                * well_exposed([r, g, b])
                + LEAST;
        }
    }
    weights
}

/// Standard deviation of the three channels.
fn saturation(color: [f32; 3]) -> f32 {
    let mean = color.iter().sum::<f32>() / 3.0;
    (color.iter().map(|level| (level - mean) * (level - mean)).sum::<f32>() / 3.0).sqrt()
}

/// Product over the channels of how near each is to [`BEST_LEVEL`].
fn well_exposed(color: [f32; 3]) -> f32 {
    let far: f32 = color.iter().map(|level| (level - BEST_LEVEL) * (level - BEST_LEVEL)).sum();
    (-far / (2.0 * LEVEL_DEVIATION * LEVEL_DEVIATION)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand, of the paper's formulas with the floors: exp(-3 * 0.25^2 / 0.08) = 0.09597.
    #[test]
    fn weights_are_the_papers_with_floors() {
        assert!((well_exposed([0.25, 0.75, 0.25]) - 0.095_97).abs() < 1e-5);
        assert!((well_exposed([0.5; 3]) - 1.0).abs() < 1e-6);
        // Deviation of 0, 0, 1 about 1/3: sqrt(2)/3.
        assert!((saturation([0.0, 0.0, 1.0]) - 0.471_405).abs() < 1e-5);
        let even = |level: f32| PyramidPlane { columns: 0..3, rows: 0..3, texels: vec![[level, level, level, 1.0]; 9] };
        let weights = normalized_weights(&[even(127.5), even(255.0)], true);
        // exp(-3 * 0.25 / 0.08) = 8.48e-5 beside 1.
        assert!((weights[1].texels[4] - 8.48e-5 / 1.000_084_8).abs() < 1e-6);
        assert!((weights[0].texels[4] + weights[1].texels[4] - 1.0).abs() < 1e-6);
    }
}
