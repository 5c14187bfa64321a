//! The usual kinds of cut sets.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use trueup_core::options::StageOptions;
use trueup_core::truth::Level;
use trueup_core::{Error, Result};

use crate::dice::{Dice, mix};

use super::panorama::Panorama360;
use super::spec::{CutSpec, ViewSpec};

/// Widths and heights are multiples of this: whole blocks of a JPEG with halved chroma; pixels.
const SIZE_STEP_PX: f64 = 16.0;
/// Most pictures of a `fewN`, so that it stays within one turn.
const MOST_FEW: usize = 13;
/// Steepest row of a sweep; degrees.
const STEEPEST_DEG: u32 = 60;

trueup_core::options! {
    /// How the views of a set are taken. Standard deviations are of normal distributions, drawn per view.
    pub struct SpecOptions("specs") {
        /// Seed of every random choice below; panoramas of different names draw differently.
        seed: u64 = 1, Allowed::Any, "";
        /// Where the views look: the middle of a row, the first view of a full turn and of a few.
        yaw_deg: f64 = 0.0, between(-360.0, 360.0), "degrees";
        /// Horizontal field of view.
        hfov_deg: f64 = 62.0, between(5.0, 150.0), "degrees";
        /// Largest width of the views.
        max_width: usize = 1600, between(16.0, 16384.0), "px";
        /// Width of the views as a multiple of the panorama's pixels over the same angle.
        oversampling: f64 = 1.05, between(0.05, 4.0), "";
        /// Height of the views over their width.
        height_over_width: f64 = 0.75, between(0.1, 4.0), "";
        /// Deviation of yaw and pitch.
        aim_sd_deg: f64 = 3.0, between(0.0, 45.0), "degrees";
        /// Deviation of the roll.
        roll_sd_deg: f64 = 5.0, between(0.0, 45.0), "degrees";
        /// Deviation of the gain's logarithm.
        gain_sd: f64 = 0.06, between(0.0, 1.0), "";
    }
}

/// A kind of set. Its name is also what spec files are called after.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpecKind {
    /// `row`: nine views in a row, 24 degrees apart.
    Row,
    /// `tilt`: six views in a row looking up by 22 degrees.
    Tilt,
    /// `grid`: three rows of seven views.
    Grid,
    /// `full`: a full turn of sixteen views.
    Full,
    /// `few`: three neighbors, 26 degrees apart.
    Few,
    /// `few2`, `few3`, ... `few13`: this many neighbors; the first ones of a longer set are the views of a shorter one.
    Neighbors(usize),
    /// `pitch0`, `pitch10`, ... `pitch60`, `pitch-20`: six views in a row at this elevation in degrees, -60 to 60. All
    /// elevations share their draws.
    Pitch(i32),
}

impl SpecKind {
    /// The elevations of a sweep, degrees.
    pub const SWEEP_DEG: [i32; 4] = [0, 10, 20, 40];

    /// The kinds that a word stands for: those of its own name, and for `pitch` the sweep of [`Self::SWEEP_DEG`].
    ///
    /// # Errors
    /// [`Error::Input`] for other words.
    pub fn of_word(word: &str) -> Result<Vec<Self>> {
        match word {
            "pitch" => Ok(Self::SWEEP_DEG.map(Self::Pitch).to_vec()),
            _ => Ok(vec![word.parse()?]),
        }
    }

    /// Yaw against the set's own, pitch, and the stream of random draws of every view.
    fn aims(self) -> Vec<(f64, f64, u64)> {
        let row = |count: usize, first: f64, step: f64, pitch: f64| -> Vec<(f64, f64)> {
            (0..count).map(|k| (first + step * k as f64, pitch)).collect()
        };
        let (aims, stream) = match self {
            Self::Row => (row(9, -90.0, 24.0, 0.0), 1),
            Self::Tilt => (row(6, -60.0, 24.0, 22.0), 2),
            Self::Grid => ([-20.0, 2.0, 24.0].iter().flat_map(|&pitch| row(7, -72.0, 26.0, pitch)).collect(), 3),
            Self::Full => (row(16, 0.0, 22.5, 0.0), 4),
            Self::Few => (row(3, 0.0, 26.0, 0.0), 5),
            Self::Neighbors(count) => (row(count, 0.0, 26.0, 0.0), 6),
            Self::Pitch(pitch) => (row(6, -60.0, 24.0, f64::from(pitch)), 7),
        };
        /// Room for the views of one kind among the streams.
        const STREAMS_PER_KIND: u64 = 1000;
        aims.into_iter().zip(0..).map(|((yaw, pitch), view)| (yaw, pitch, STREAMS_PER_KIND * stream + view)).collect()
    }
}

impl fmt::Display for SpecKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Row => formatter.write_str("row"),
            Self::Tilt => formatter.write_str("tilt"),
            Self::Grid => formatter.write_str("grid"),
            Self::Full => formatter.write_str("full"),
            Self::Few => formatter.write_str("few"),
            Self::Neighbors(count) => write!(formatter, "few{count}"),
            Self::Pitch(pitch) => write!(formatter, "pitch{pitch}"),
        }
    }
}

impl FromStr for SpecKind {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self> {
        let plain = [Self::Row, Self::Tilt, Self::Grid, Self::Full, Self::Few];
        if let Some(kind) = plain.into_iter().find(|kind| kind.to_string() == word) {
            return Ok(kind);
        }
        let few = word.strip_prefix("few").and_then(|count| count.parse().ok()).map(Self::Neighbors);
        let pitch = word.strip_prefix("pitch").and_then(|pitch| pitch.parse().ok()).map(Self::Pitch);
        match few.or(pitch) {
            Some(kind @ Self::Neighbors(2..=MOST_FEW)) => Ok(kind),
            Some(Self::Pitch(pitch)) if pitch.unsigned_abs() <= STEEPEST_DEG => Ok(Self::Pitch(pitch)),
            _ => Err(Error::input(
                word,
                "there is no such kind of set",
                format!(
                    "Choose row, tilt, grid, full, few, few2 to few{MOST_FEW}, pitch, or pitch-{STEEPEST_DEG} to \
                     pitch{STEEPEST_DEG}."
                ),
            )),
        }
    }
}

/// A spec of one kind for a panorama, with the vertical of `level`.
///
/// Steps and elevations are those of the kind, to which hand-held jitter, roll and gain are added; the width is that of
/// the panorama's own resolution. Numbers are rounded to a thousandth.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if `level` points above the horizon.
pub fn make_spec(panorama: &Panorama360, kind: SpecKind, level: &Level, options: &SpecOptions) -> Result<CutSpec> {
    const FULL_TURN_DEG: f64 = 360.0;
    options.check()?;
    let name = Path::new(panorama.name()).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into());
    let seed = name.bytes().fold(options.seed, |seed, byte| mix(seed ^ u64::from(byte)).wrapping_add(1));
    let own_width = panorama.width() as f64 / FULL_TURN_DEG * options.hfov_deg * options.oversampling;
    let width = whole_steps(own_width.min(options.max_width as f64));
    let views = kind.aims().into_iter().map(|(yaw, pitch, stream)| {
        let mut dice = Dice::new(seed, stream);
        let mut draw = |mean: f64, deviation: f64| mean + deviation * dice.normal();
        ViewSpec {
            yaw: thousandths(draw(options.yaw_deg + yaw, options.aim_sd_deg)),
            pitch: thousandths(draw(pitch, options.aim_sd_deg)).clamp(-90.0, 90.0),
            roll: thousandths(draw(0.0, options.roll_sd_deg)),
            gain: thousandths(draw(0.0, options.gain_sd).exp()),
            ..ViewSpec::default()
        }
    });
    let mut spec = CutSpec {
        pano: Some(name),
        width: width as usize,
        height: whole_steps(width * options.height_over_width) as usize,
        hfov_deg: options.hfov_deg,
        views: views.collect(),
        ..CutSpec::default()
    };
    spec.set_level(level.clone());
    spec.check(panorama.name())?;
    Ok(spec)
}

/// A length as a multiple of [`SIZE_STEP_PX`], at least one.
fn whole_steps(length_px: f64) -> f64 {
    (length_px / SIZE_STEP_PX).round_ties_even().max(1.0) * SIZE_STEP_PX
}

fn thousandths(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}
