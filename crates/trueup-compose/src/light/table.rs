//! From samples to corrected light, by table.

use std::sync::Arc;

use trueup_core::color::TransferCurve;

use super::correction::Correction;
use super::local_exposure::LocalExposure;
use crate::linear_table::LinearTable;
use crate::transfer_curve::Linearize;

/// Smallest factor whose levelling off is undone: highlights are lifted by its inverse at most, since what lies between the
/// levels next to white is mostly noise.
pub(crate) const LEAST_LEVELLED: f32 = 0.6;

/// Linear light times a factor f, `f x / (1 + (f^4 - 1) x^4)^(1/4)`.
///
/// Factors above 1 level off towards white: it rises from 0 to 1, so that what the camera did not clip is not clipped here,
/// and is within 1 % of `f x` up to x = 0.22 for f = 2. Factors below 1 undo that: as cameras level highlights off when they
/// expose longer, darkening spreads them. What is clipped stays white, or nearly so, instead of turning gray; and a sky of which
/// only the blue is clipped stays blue instead of turning green.
#[inline(always)]
pub(crate) fn exposed(linear: f32, factor: f32) -> f32 {
    let square = |value: f32| value * value;
    let levelled = 1.0 + (square(square(factor.max(LEAST_LEVELLED))) - 1.0) * square(square(linear));
    factor * linear / levelled.sqrt().sqrt()
}

/// What is done to the light of one photograph, and how its samples stand for it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhotographLight<'a> {
    pub(crate) curve: &'a TransferCurve,
    pub(crate) correction: &'a Correction,
    /// What is done to all photographs alike at a place of the canvas on which it is laid; `None` for nothing.
    pub(crate) local: Option<&'a LocalExposure>,
}

/// From a photograph's samples to corrected light, as the inner loops read it: its transfer curve and its [`Correction`].
#[derive(Debug, Clone)]
pub(crate) struct LightTable {
    pub(crate) linearize: Arc<Linearize>,
    pub(crate) gain: [f32; 3],
    /// Whether what is brighter than white is kept: factors are nothing but factors then.
    pub(crate) keeps_light: bool,
    /// The factor at r^2 = index / [`STEPS`]; `None` without vignetting. All beyond the corner is as at the corner.
    falloff: Option<Arc<LinearTable<ENTRIES>>>,
    center: [f32; 2],
    /// Table steps per squared pixel.
    steps_per_px2: f32,
}

/// Entries up to the corner. Between two of them the factor of a strong lens (two stops) changes by 1 %, and its chord
/// is off by a thousandth of that.
const STEPS: usize = 256;

/// Length of the table: the entries up to the corner, filled up to a power of two.
pub(crate) const ENTRIES: usize = 512;

impl LightTable {
    /// For a photograph of `size` pixels.
    pub(crate) fn new(light: PhotographLight<'_>, size: [f64; 2]) -> Self {
        let PhotographLight { curve, correction, .. } = light;
        let plain = correction.vignetting.iter().all(|&coefficient| coefficient == 0.0);
        let factor = |index: usize| correction.at_radius((index as f64 / STEPS as f64).min(1.0));
        let corner = 0.25 * (size[0] * size[0] + size[1] * size[1]);
        Self {
            linearize: Linearize::of(curve),
            gain: correction.gain.map(|gain| gain as f32),
            keeps_light: curve.light_range().is_some(),
            falloff: (!plain).then(|| Arc::new(LinearTable::new(factor))),
            center: size.map(|length| 0.5 * length as f32),
            steps_per_px2: (STEPS as f64 / corner) as f32,
        }
    }

    /// Whether the factor depends on the place.
    pub(crate) fn varies(&self) -> bool {
        self.falloff.is_some()
    }

    /// The factors against vignetting by the squared distance from a center, pixels: the table, that center, table steps per squared pixel,
    /// and the last step; `None` where there is none.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(crate) fn falloff(&self) -> Option<(&LinearTable<ENTRIES>, [f32; 2], f32, f32)> {
        Some((self.falloff.as_deref()?, self.center, self.steps_per_px2, STEPS as f32))
    }

    /// The factors against vignetting at positions in the photograph, pixels; only where [`Self::varies`].
    #[inline(always)]
    pub(crate) fn at<const COUNT: usize>(&self, x: [f32; COUNT], y: [f32; COUNT]) -> [f32; COUNT] {
        let Some(falloff) = &self.falloff else { return [1.0; COUNT] };
        // A loop: a closure would be compiled without the vector instructions of its caller.
        let mut positions = [0.0; COUNT];
        for ((position, x), y) in positions.iter_mut().zip(x).zip(y) {
            let (dx, dy) = (x - self.center[0], y - self.center[1]);
            *position = ((dx * dx + dy * dy) * self.steps_per_px2).min(STEPS as f32);
        }
        falloff.at_all(positions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_follows_the_formula() {
        let correction = Correction { gain: [1.0, 2.0, 0.5], vignetting: [0.3, -0.2, 0.4] };
        let light = PhotographLight { curve: &TransferCurve::SRGB, correction: &correction, local: None };
        let table = LightTable::new(light, [400.0, 300.0]);
        assert!(table.varies());
        for (x, y) in [(200.0, 150.0), (0.0, 0.0), (37.5, 281.0), (400.0, 300.0), (390.0, 12.0)] {
            let r2 = ((x - 200.0) * (x - 200.0) + (y - 150.0) * (y - 150.0)) / (200.0 * 200.0 + 150.0 * 150.0);
            let expected = f64::exp(0.3 * r2 - 0.2 * r2 * r2 + 0.4 * r2 * r2 * r2);
            assert!((f64::from(table.at([x as f32], [y as f32])[0]) - expected).abs() < 1e-4, "({x}, {y})");
        }
        let even = PhotographLight { correction: &Correction::uniform(3.0), ..light };
        assert!(!LightTable::new(even, [400.0, 300.0]).varies());
        assert!((correction.brightness() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn brightening_clips_nothing_and_darkening_undoes_it() {
        assert!((exposed(1.0, 3.0) - 1.0).abs() < 1e-6);
        // 0.25 / (1 - (1 - 0.6^4) / 16)^(1/4)
        assert!((exposed(0.5, 0.5) - 0.253_521).abs() < 1e-5);
        assert!((exposed(0.1, 0.5) - 0.05).abs() < 1e-5);
        // Clipped light stays white, but is lifted by no more than 1 / 0.6.
        assert!((exposed(1.0, 0.8) - 1.0).abs() < 1e-6 && (exposed(1.0, 0.3) - 0.5).abs() < 1e-6);
        for (level, factor) in [(0.3, 0.7), (0.9, 0.6), (0.99, 0.8), (0.7, 1.4)] {
            assert!((exposed(exposed(level, factor), factor.recip()) - level).abs() < 1e-5, "{level} {factor}");
        }
        // 0.4 / (1 + 15 * 0.0016)^(1/4)
        assert!((exposed(0.2, 2.0) - 0.397_636).abs() < 1e-5);
        let levels: Vec<f32> = (0..=100).map(|step| exposed(step as f32 / 100.0, 8.0)).collect();
        assert!(levels.windows(2).all(|pair| pair[0] < pair[1]) && levels[100] < 1.000_001);
    }
}
