//! How bright the panorama is as a whole: the level at which least of its photographs is lost.

use trueup_core::color::TransferCurve;

use super::measured::Thumbnail;
use crate::light::{Correction, Corrections, LightTable, PhotographLight, exposed};
use crate::render_options::Look;

/// Pixels of a photograph that are looked at, about.
const SAMPLES: usize = 1_000;

/// 8-bit levels of the brightest channel from which on nothing is told from white, and up to which nothing from black.
const WHITE: u8 = 250;
const BLACK: u8 = 8;

/// Levels that are tried per stop.
const TRIED_PER_STOP: f64 = 8.0;

/// Share of the photographs' pixels that must be saved for every stop that the panorama is brighter or darker than its
/// reference: enough that photographs of nearly one exposure are shown as they were taken.
const STOP_FROM_REFERENCE: f64 = 0.01;

/// Stops by which a photograph may be shown brighter or darker than it was taken at no cost; a camera's own choice of
/// exposure is no surer.
const STOPS_FREE: f64 = 1.0;

/// Share of a photograph's pixels that a further stop is worth: the tones of a photograph fill some five stops, of
/// which cameras choose those that matter.
const FURTHER_STOP: f64 = 0.05;

/// What decides the level of a panorama.
pub(super) struct LevelInput<'a> {
    pub(super) thumbnails: &'a [Thumbnail<'a>],
    /// Corrections that leave the reference as bright as it was taken.
    pub(super) corrections: &'a Corrections,
    /// Which photographs were compared with others: the rest has no level of its own.
    pub(super) compared: &'a [bool],
    /// How the panorama shows differences of exposure.
    pub(super) look: Look,
}

/// The brightest channel of a pixel: its light, and the factor on it.
struct Sample {
    light: f32,
    factor: f32,
}

impl LevelInput<'_> {
    /// Natural logarithm of a factor on all photographs, so that the least of them is lost: of their pixels as few as
    /// can be turn white or black that were not when they were taken, and few photographs are shown much brighter or
    /// darker than they were taken; each counts the same, as the look shows it. The level lies between those of the
    /// photographs, so that photographs of one exposure stay as they are, and it is that of the reference if another
    /// gains next to nothing.
    pub(super) fn log_factor(&self) -> f64 {
        let compared = self.corrections.photographs.iter().zip(self.compared).filter(|(_, compared)| **compared);
        let own: Vec<f64> = compared.map(|(correction, _)| -correction.brightness().log2()).collect();
        let [low, high] = own.iter().fold([0.0_f64; 2], |[low, high], &stops| [low.min(stops), high.max(stops)]);
        let tried = (low * TRIED_PER_STOP).ceil() as i64..=(high * TRIED_PER_STOP).floor() as i64;
        let Some(curve) = self.curve().filter(|_| tried.clone().count() > 1) else { return 0.0 };
        let ends = [BLACK, WHITE].map(|level| curve.linear(f64::from(level) / 255.0) as f32);
        let photographs: Vec<Vec<Sample>> =
            (0..self.thumbnails.len()).map(|index| self.samples(index, &curve)).collect();
        let gains: Vec<f64> =
            self.corrections.photographs.iter().map(|correction| correction.brightness().log2()).collect();
        let cost = |stops: f64| {
            let moved = own.iter().map(|own| (self.look.borne(stops - own).abs() - STOPS_FREE).max(0.0));
            let moved = moved.sum::<f64>() / own.len().max(1) as f64;
            // What a photograph is brightened by beside what makes it fit at the reference's level.
            let shown = gains.iter().map(|gain| self.look.borne(gain + stops) - gain);
            lost(photographs.iter().zip(shown), ends) + FURTHER_STOP * moved + STOP_FROM_REFERENCE * stops.abs()
        };
        // Nearest to the reference first: of equal ones the nearest is taken.
        let mut tried: Vec<f64> = tried.map(|step| step as f64 / TRIED_PER_STOP).collect();
        tried.sort_by(|one, other| one.abs().total_cmp(&other.abs()).then(one.total_cmp(other)));
        let costs = tried.iter().map(|&stops| (cost(stops), stops));
        let best = costs.reduce(|best, other| if other.0 < best.0 { other } else { best });
        best.map_or(0.0, |(_, stops)| stops * std::f64::consts::LN_2)
    }

    /// The curve by which the samples of all photographs are read: that of their profile if the response makes none.
    fn curve(&self) -> Option<TransferCurve> {
        let profile = self.thumbnails.first()?.curve;
        Some(self.corrections.response.curve(profile).unwrap_or_else(|_| profile.clone()))
    }

    /// The pixels of a photograph that tell something.
    fn samples(&self, index: usize, curve: &TransferCurve) -> Vec<Sample> {
        let (thumbnail, correction) = (&self.thumbnails[index], &self.corrections.photographs[index]);
        if !self.compared[index] {
            return Vec::new();
        }
        let raster = thumbnail.raster;
        let size = [raster.width() as f64, raster.height() as f64];
        let light = LightTable::new(PhotographLight { curve, correction, local: None }, size);
        let step = ((raster.width() * raster.height() / SAMPLES) as f64).sqrt().max(1.0) as usize;
        let mut samples = Vec::new();
        for y in (step / 2..raster.height()).step_by(step) {
            for x in (step / 2..raster.width()).step_by(step) {
                samples.extend(brightest(&light, raster.pixel(x, y), [x as f32 + 0.5, y as f32 + 0.5]));
            }
        }
        samples
    }
}

/// The brightest channel of a pixel after correction; `None` if it was white or black as it was taken.
fn brightest(light: &LightTable, pixel: &[u8], [x, y]: [f32; 2]) -> Option<Sample> {
    let [lift] = if light.varies() { light.at([x], [y]) } else { [1.0] };
    let channels = pixel.iter().zip(light.gain).map(|(&level, gain)| (level, gain * lift));
    let (level, factor) = channels.max_by(|one, other| {
        let value = |&(level, factor): &(u8, f32)| exposed(light.linearize.linear(f32::from(level)), factor);
        value(one).total_cmp(&value(other))
    })?;
    (level > BLACK && level < WHITE).then(|| Sample { light: light.linearize.linear(f32::from(level)), factor })
}

/// The share of the photographs' pixels beyond the ends of light, `black` and `white`, if each is brightened by the
/// stops beside it.
fn lost<'a>(photographs: impl Iterator<Item = (&'a Vec<Sample>, f64)>, [black, white]: [f32; 2]) -> f64 {
    let (mut shares, mut count) = (0.0, 0.0_f64);
    for (samples, stops) in photographs.filter(|(samples, _)| !samples.is_empty()) {
        let factor = stops.exp2() as f32;
        let beyond = |sample: &&Sample| {
            let light = exposed(sample.light, sample.factor * factor);
            light <= black || light >= white
        };
        shares += samples.iter().filter(beyond).count() as f64 / samples.len() as f64;
        count += 1.0;
    }
    shares / count.max(1.0)
}

impl Corrections {
    /// With no photograph of those that were compared farther than the factor `largest` from the median one, brighter
    /// or darker; and whether one was.
    ///
    /// How far photographs lie apart has nothing to do with how bright the panorama is shown.
    pub(super) fn limited(mut self, compared: &[bool], largest: f64) -> (Self, bool) {
        let members = || self.photographs.iter().zip(compared).filter(|(_, compared)| **compared);
        let mut logs: Vec<f64> = members().map(|(correction, _)| correction.brightness().ln()).collect();
        logs.sort_by(f64::total_cmp);
        let Some(median) = logs.get(logs.len() / 2).map(|upper| 0.5 * (upper + logs[(logs.len() - 1) / 2])) else {
            return (self, false);
        };
        let [low, high] = [largest.recip(), largest].map(|limit| limit * median.exp());
        let limited = members().any(|(correction, _)| !(low..=high).contains(&correction.brightness()));
        for (correction, _) in self.photographs.iter_mut().zip(compared).filter(|(_, compared)| **compared) {
            // All channels alike: the color is right however bright it may be made.
            let brightness = correction.brightness();
            let factor = brightness.clamp(low, high) / brightness;
            correction.gain = correction.gain.map(|gain| gain * factor);
        }
        (self, limited)
    }

    /// With a factor on all photographs that were compared.
    pub(super) fn at_level(mut self, log_factor: f64, compared: &[bool]) -> Self {
        let compared = self.photographs.iter_mut().zip(compared).filter(|(_, compared)| **compared);
        for (Correction { gain, .. }, _) in compared {
            *gain = gain.map(|gain| gain * log_factor.exp());
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::raster::Raster;
    use trueup_core::source::WorkingFrame;

    use super::*;

    fn corrections(gains: &[f64]) -> Corrections {
        gains.iter().map(|&gain| Correction::uniform(gain)).collect::<Vec<_>>().into()
    }

    #[test]
    fn the_level_is_a_factor_on_all_that_were_compared() {
        let at_level = corrections(&[1.0, 20.0, 1.0]).at_level(0.25_f64.ln(), &[true, true, false]);
        for (correction, gain) in at_level.photographs.iter().zip([0.25, 5.0, 1.0]) {
            assert!((correction.brightness() / gain - 1.0).abs() < 1e-12, "{at_level:?}");
        }
    }

    /// White balance stays what it is where brightness is limited.
    #[test]
    fn a_limited_photograph_keeps_its_color() {
        let warm = Correction { gain: [6.0, 4.0, 3.0], ..Correction::uniform(1.0) };
        let all: Corrections = vec![Correction::uniform(1.0), Correction::uniform(1.0), warm].into();
        let (limited, is_limited) = all.limited(&[true; 3], 2.0);
        let [red, green, blue] = limited.photographs[2].gain;
        assert!(is_limited && (limited.photographs[2].brightness() - 2.0).abs() < 1e-9, "{limited:?}");
        assert!((red / green - 1.5).abs() < 1e-9 && (green / blue - 4.0 / 3.0).abs() < 1e-9, "{limited:?}");
        // A channel beyond the limit alone is none.
        let tinted = Correction { gain: [2.5, 1.0, 1.0], ..Correction::uniform(1.0) };
        let all: Corrections = vec![Correction::uniform(1.0), Correction::uniform(1.0), tinted].into();
        assert_eq!(all.clone().limited(&[true; 3], 2.0), (all, false));
    }

    /// A turn in sun and shade: two in the sun, a hundredth of the light of those in the shade, which a level in the
    /// sun brought to the limit before.
    #[test]
    fn photographs_are_limited_by_their_distance_from_one_another() {
        let turn = [0.01, 0.01, 0.1, 0.1, 1.0, 1.0];
        for level in [1.0, 0.01, 100.0] {
            let gains = turn.map(|gain| level * gain);
            assert_eq!(corrections(&gains).limited(&[true; 6], 32.0), (corrections(&gains), false));
        }
        // The geometric mean of 2 and 8 is 4, of which 0.25 and 64 are a sixteenth and sixteen times; the last was
        // compared with none.
        let (limited, is_limited) =
            corrections(&[0.25, 2.0, 8.0, 64.0, 1e6]).limited(&[true, true, true, true, false], 8.0);
        assert!(is_limited);
        for (correction, gain) in limited.photographs.iter().zip([0.5, 2.0, 8.0, 32.0, 1e6]) {
            assert!((correction.brightness() / gain - 1.0).abs() < 1e-12, "{limited:?}");
        }
        assert_eq!(corrections(&[7.0]).limited(&[false], 2.0), (corrections(&[7.0]), false));
    }

    #[test]
    fn the_level_is_that_at_which_least_is_lost_of_what_the_look_shows() {
        let plain = |level: u8| Raster::from_data(40, 30, 3, vec![level; 3600]).expect("samples");
        let (bright, dark) = (plain(188), plain(90));
        let frame = WorkingFrame::new(40, 30, 1200.0);
        let thumbnail = |raster| Thumbnail { raster, curve: &TransferCurve::SRGB, frame, camera: 0 };
        let thumbnails = [thumbnail(&bright), thumbnail(&dark)];
        // Six stops darker, level 90 (light 0.102) is at 0.0016, level 5; 0.7 stops above that at 0.0026, level 8.5.
        let corrections = corrections(&[1.0, 1.0 / 64.0]);
        let level = |look| {
            let compared = &[true, true];
            LevelInput { thumbnails: &thumbnails, corrections: &corrections, compared, look }.log_factor()
        };
        let stops = level(Look::Linear) / std::f64::consts::LN_2;
        assert!((0.6..=1.0).contains(&stops), "{stops}");
        // There, it is shown 1.5 stops darker than it was taken at most, and nothing is lost.
        assert_eq!(level(Look::Natural), 0.0);
    }

    #[test]
    fn pixels_count_as_lost_by_what_they_become() {
        let samples = |lights: &[f32]| lights.iter().map(|&light| Sample { light, factor: 2.0 }).collect::<Vec<_>>();
        // Of the first, 0.6 and 0.8 become 1.2 / (1 + 15 * 0.1296)^(1/4) = 0.916 and 1.6 / (1 + 15 * 0.4096)^(1/4) =
        // 0.978, and 0.001 becomes 0.002. The second loses nothing, the third is none.
        let photographs = [samples(&[0.001, 0.1, 0.6, 0.8]), samples(&[0.1, 0.2]), Vec::new()];
        let lost_at = |stops: [f64; 3]| lost(photographs.iter().zip(stops), [0.0025, 0.95]);
        assert_eq!(lost_at([0.0; 3]), 0.25);
        // Two stops darker, factors of 1/2: only the first is lost.
        assert_eq!(lost_at([-2.0, 0.0, 0.0]), 0.125);
        assert_eq!(lost(std::iter::empty(), [0.0, 1.0]), 0.0);
    }
}
