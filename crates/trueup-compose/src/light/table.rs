//! From samples to corrected light, by table.

use std::sync::Arc;

use trueup_core::color::TransferCurve;

use super::correction::Correction;
use super::local_exposure::LocalExposure;
use crate::linear_table::LinearTable;
use crate::transfer_curve::Linearize;

/// Smallest factor at which what is clipped in all channels stays white: highlights are lifted by its inverse at most,
/// since what lies between the levels next to white is mostly noise.
pub(crate) const LEAST_WHITE: f32 = 0.6;

/// Linear light above which a channel counts as clipped the more the nearer it is to white: level 237 of sRGB. Noise
/// and compression carry what is clipped this far down. Of 0.8 to 0.95, the lower leave fewer false hues (4.1 to 7.2 %
/// of what is clipped in one or two channels, five panoramas).
pub(crate) const NEAR_WHITE: f32 = 0.85;

/// Mean linear light of the channels between which what a camera without a shoulder took becomes white: levels 231 and
/// 251 of sRGB, so that noise beside white is none in what is darkened.
pub(crate) const WHITENED: [f32; 2] = [0.8, 0.97];

/// Darkest light by which another channel is divided: level 3 of sRGB.
pub(crate) const LEAST_DIVISOR: f32 = 1e-3;

/// How far green may lie above blue, as a factor, for what is clipped in red to be yet redder: beyond that it may be a
/// yellow thing as well, which should not turn orange.
pub(crate) const WARMEST: f32 = 1.5;

/// Linear light times a factor f; above 1 `f x / (1 + (f^4 - 1) x^4)^(1/4)`.
///
/// That levels off towards white: it rises from 0 to 1, so that what the camera did not clip is not clipped here, and
/// is within 1 % of `f x` up to x = 0.22 for f = 2.
#[inline(always)]
pub(crate) fn exposed(linear: f32, factor: f32) -> f32 {
    let square = |value: f32| value * value;
    let levelled = 1.0 + (square(square(factor.max(1.0))) - 1.0) * square(square(linear));
    factor * linear / levelled.sqrt().sqrt()
}

/// Linear light of red, green and blue times a factor f for each: [`exposed`] where that brightens.
///
/// Cameras level highlights off when they expose longer, as far as they have a `shoulder` (0 to 1): darkening spreads
/// them by `1 / (1 + (f^4 - 1) x^4)^(1/4)`, channel by channel. What one without took keeps its proportions up to the
/// light at which the camera clips, where all three channels together become white. Between them the factors lie so,
/// too. With either, what is clipped in all of them stays white instead of turning gray.
///
/// Of what is clipped in one or two channels the hue is lost: blue skies turn cyan, and wood yellow. Skies, shade, skin
/// and wood are colored along the spectrum: where green is above red, blue is above green, and where it is above blue,
/// red is. What is near white in blue, or in red, is therefore made brighter as if it were above green by half of the
/// stops by which green is above the third. (Of 0.25 to 1 the middle; in what five panoramas show bright and not
/// clipped, the median is 0.15 to 0.95.) Green near white is spread to the middle between red and blue at most, in
/// stops, or to red where blue is darker.
#[inline(always)]
pub(crate) fn shown([red, green, blue]: [f32; 3], factors: [f32; 3], shoulder: f32) -> [f32; 3] {
    let square = |value: f32| value * value;
    let [from, to] = WHITENED;
    let mean = (red + green + blue) * (1.0 / 3.0);
    let white = smooth((mean - from) * (1.0 / (to - from)));
    let root = |ratio: f32| ratio.max(1.0).sqrt();
    let blue_of = green * root(green / red.max(LEAST_DIVISOR));
    let red_of = green * root((green / blue.max(LEAST_DIVISOR)).min(WARMEST));
    let near = |linear: f32| smooth((linear - NEAR_WHITE) * (1.0 / (1.0 - NEAR_WHITE)));
    let developed = |linear: f32, continued: f32, factor: f32| {
        let darkening = factor.clamp(LEAST_WHITE, 1.0);
        let missing = (continued.min(linear / darkening) - linear).max(0.0);
        let spread = 1.0 + (square(square(darkening)) - 1.0) * square(square(linear));
        let spread = 1.0 / spread.sqrt().sqrt();
        let together = 1.0 + white * (1.0 / darkening - 1.0);
        let lift = together + shoulder * (spread - together);
        (exposed(linear + near(linear) * missing, factor) * lift).min(factor / darkening)
    };
    let shown_red = developed(red, red_of, factors[0]);
    let shown_green = developed(green, 0.0, factors[1]);
    let shown_blue = developed(blue, blue_of, factors[2]);
    let between = (shown_red * shown_red.max(shown_blue)).sqrt();
    let bounded = shown_green.min(between.max(factors[1] * green));
    [shown_red, shown_green + near(green) * (bounded - shown_green), shown_blue]
}

/// From 0 up to 0 to 1 from 1 on, level at both.
#[inline(always)]
fn smooth(share: f32) -> f32 {
    // `clamp` keeps NaN.
    #[allow(clippy::manual_clamp)]
    let share = share.max(0.0).min(1.0);
    share * share * (3.0 - 2.0 * share)
}

/// What is done to the light of one photograph, and how its samples stand for it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhotographLight<'a> {
    pub(crate) curve: &'a TransferCurve,
    pub(crate) correction: &'a Correction,
    /// What is done to all photographs alike at a place of the canvas on which it is laid; `None` for nothing.
    pub(crate) local: Option<&'a LocalExposure>,
}

/// From a photograph's samples to corrected light, as the inner loops read it: its transfer curve and its
/// [`Correction`].
#[derive(Debug, Clone)]
pub(crate) struct LightTable {
    pub(crate) linearize: Arc<Linearize>,
    pub(crate) gain: [f32; 3],
    /// How far the camera levels highlights off, 0 to 1.
    pub(crate) shoulder: f32,
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
    /// The same with highlights that the camera levels off all the way, whether it does or not.
    pub(crate) fn with_whole_shoulder(self) -> Self {
        Self { shoulder: 1.0, ..self }
    }

    /// For a photograph of `size` pixels.
    pub(crate) fn new(light: PhotographLight<'_>, size: [f64; 2]) -> Self {
        let PhotographLight { curve, correction, .. } = light;
        let plain = correction.vignetting.iter().all(|&coefficient| coefficient == 0.0);
        let factor = |index: usize| correction.at_radius((index as f64 / STEPS as f64).min(1.0));
        let corner = 0.25 * (size[0] * size[0] + size[1] * size[1]);
        Self {
            linearize: Linearize::of(curve),
            gain: correction.gain.map(|gain| gain as f32),
            shoulder: correction.shoulder as f32,
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

    /// The factors against vignetting by the squared distance from a center, pixels: the table, that center, table
    /// steps per squared pixel, and the last step; `None` where there is none.
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
        let correction = Correction { gain: [1.0, 2.0, 0.5], vignetting: [0.3, -0.2, 0.4], ..Correction::default() };
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
        assert!((exposed(0.5, 0.5) - 0.25).abs() < 1e-6);
        // 0.4 / (1 + 15 * 0.0016)^(1/4)
        assert!((exposed(0.2, 2.0) - 0.397_636).abs() < 1e-5);
        let levels: Vec<f32> = (0..=100).map(|step| exposed(step as f32 / 100.0, 8.0)).collect();
        assert!(levels.windows(2).all(|pair| pair[0] < pair[1]) && levels[100] < 1.000_001);
        let gray = |level: f32, factor: f32| shown([level; 3], [factor; 3], 1.0);
        // 0.25 / (1 - (1 - 0.6^4) / 16)^(1/4)
        assert!(gray(0.5, 0.5).iter().all(|light| (light - 0.253_521).abs() < 1e-5));
        assert!(gray(0.1, 0.5).iter().all(|light| (light - 0.05).abs() < 1e-5));
        for (level, factor) in [(0.3, 0.7), (0.9, 0.6), (0.99, 0.8), (0.7, 1.4)] {
            let there = gray(level, factor);
            assert!(
                there.iter().all(|&light| (gray(light, factor.recip())[0] - level).abs() < 1e-5),
                "{level} {factor}"
            );
        }
    }

    /// Clipped light stays white with a shoulder and without, but is lifted by no more than 1 / 0.6.
    #[test]
    fn what_is_clipped_stays_white() {
        for shoulder in [0.0, 0.4, 1.0] {
            for (factor, white) in [(0.8, 1.0), (0.6, 1.0), (0.3, 0.5)] {
                let light = shown([1.0; 3], [factor; 3], shoulder);
                assert!(light.iter().all(|channel| (channel - white).abs() < 1e-6), "{light:?}");
            }
        }
        // Noise of white stays white where there is no shoulder: level 252 of sRGB is 0.973.
        let light = shown([0.975, 1.0, 0.985], [0.7; 3], 0.0);
        assert!(light.iter().all(|channel| *channel > 0.97), "{light:?}");
    }

    /// Without a shoulder, what is not clipped keeps its proportions however it is darkened; with one, what is brighter
    /// gains.
    #[test]
    fn a_camera_that_clips_hard_has_no_highlights_to_spread() {
        for factor in [0.3, 0.6, 0.9] {
            for color in [[0.84, 0.7, 0.6], [0.2, 0.5, 0.83], [0.1, 0.1, 0.1]] {
                let light = shown(color, [factor; 3], 0.0);
                for (light, color) in light.iter().zip(color) {
                    assert!((light - factor * color).abs() < 1e-6, "{light} of {color}");
                }
            }
        }
        let [red, green, blue] = shown([0.84, 0.7, 0.6], [0.6; 3], 1.0);
        assert!(red / green > 1.25 && green / blue > 1.18, "{red} {green} {blue}");
    }

    /// A sky that is clipped in blue, or in blue and green, is shown blue, not cyan; a wall clipped in red no pinker
    /// than it is, and a yellow leaf not orange.
    #[test]
    fn what_is_clipped_in_some_channels_keeps_a_hue() {
        for shoulder in [0.0, 0.5, 1.0] {
            for sky in [[0.35, 0.83, 1.0], [0.5, 1.0, 1.0], [0.45, 0.95, 0.99]] {
                let [red, green, blue] = shown(sky, [0.6; 3], shoulder);
                assert!((blue / green).ln() > 0.3 * (green / red).ln(), "{sky:?}: {red} {green} {blue}");
            }
            let [red, green, _] = shown([1.0, 1.0, 0.2], [0.7; 3], shoulder);
            assert!(red >= green && red < 1.25 * green, "{red} {green}");
        }
        let [red, green, blue] = shown([1.0, 0.83, 0.8], [0.7; 3], 0.0);
        assert!(red / green < 1.21 && green / blue < 1.04, "{red} {green} {blue}");
    }

    /// What is brightened has nothing of all this.
    #[test]
    fn brightened_light_is_the_formulas() {
        for shoulder in [0.0, 1.0] {
            for color in [[1.0, 1.0, 1.0], [0.3, 0.97, 1.0], [1.0, 0.9, 0.1]] {
                let light = shown(color, [1.0, 1.5, 2.5], shoulder);
                let expected = [exposed(color[0], 1.0), exposed(color[1], 1.5), exposed(color[2], 2.5)];
                assert_eq!(light, expected);
            }
        }
    }
}
