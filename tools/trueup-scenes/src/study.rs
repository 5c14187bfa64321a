//! The sets of pictures that are made again and again: the committed example, the study's synthetic sets, and the many
//! small sets for statistics of the gate.

use crate::dice::Dice;
use crate::rig::RigOptions;
use crate::scene::{LightQuality, RoomStyle, SceneKind, SceneOptions};

trueup_core::choice! {
    /// A family of sets.
    pub enum SetKind {
        /// Sets 1 to 12 of the study: rooms and streets with three dominant directions.
        Manhattan = "manhattan",
        /// Their twins 1 to 12: the same cameras among blocks at random turns or in the open country.
        Twins = "twins",
        /// Sets 1 to 4 with one vertical and horizontals at free angles.
        Mixed = "mixed",
        /// Sets 1 to 130 for statistics: small, with dominant directions.
        GateManhattan = "gate-manhattan",
        /// Sets 1 to 130 for statistics: small, without dominant directions.
        GateRandom = "gate-random",
    }
}

/// Sets of each kind for statistics of the gate.
pub(crate) const GATE_SETS: usize = 130;

impl SetKind {
    /// How many sets there are; they are numbered from 1.
    pub fn count(self) -> usize {
        match self {
            Self::Manhattan | Self::Twins => 12,
            Self::Mixed => 4,
            Self::GateManhattan | Self::GateRandom => GATE_SETS,
        }
    }

    /// Scene and cameras of a set; `None` if there is no such number.
    pub fn set(self, number: usize) -> Option<(SceneOptions, RigOptions)> {
        match self {
            Self::Manhattan => study_set(number),
            Self::Twins => twin_set(number),
            Self::Mixed => mixed_set(number),
            Self::GateManhattan | Self::GateRandom => gate_set(self == Self::GateManhattan, number),
        }
    }
}

/// The committed example: a room in five hand-held pictures.
pub fn example_set() -> (SceneOptions, RigOptions) {
    let scene = SceneOptions { seed: 3, ..SceneOptions::default() };
    let rig = RigOptions {
        seed: 3,
        pictures: 5,
        yaw_step_deg: 26.0,
        yaw_sd_deg: 0.8,
        pitch_deg: 0.0,
        roll_sd_deg: 4.0,
        translation_fraction: 0.003,
        noise: 0.8,
        ..RigOptions::default()
    };
    (scene, rig)
}

/// Synthetic set 1 to 12 of the study; `None` for other numbers.
///
/// # Source
/// Section VI of the paper: sets 01 to 06 are indoors, 07 to 12 streets, of 5 to 72 pictures each.
///
/// # Departures
/// The paper's own sets are not public. These differ in what its sets were chosen to differ in: number of pictures and
/// rows, pitch, full turns, focal lengths, parallax.
pub(crate) fn study_set(number: usize) -> Option<(SceneOptions, RigOptions)> {
    let rig = study_rig(number)?;
    let styles = [
        RoomStyle::Living,
        RoomStyle::Office,
        RoomStyle::Library,
        RoomStyle::Kitchen,
        RoomStyle::Gallery,
        RoomStyle::Workshop,
    ];
    let kind = if number <= styles.len() { SceneKind::Room } else { SceneKind::Street };
    let style = styles[(number - 1) % styles.len()];
    let scene = SceneOptions { kind, style, seed: 100 + number as u64, light: LightQuality::Standard };
    Some((scene, rig))
}

/// The cameras of a study set and of its twin.
fn study_rig(number: usize) -> Option<RigOptions> {
    let base = RigOptions { seed: number as u64, width: 1024, height: 768, roll_sd_deg: 6.0, ..RigOptions::default() };
    let rig = match number {
        // A careless row.
        1 | 7 => RigOptions { pictures: 5, roll_sd_deg: 7.0, ..base },
        // Two rows.
        2 | 8 => RigOptions { pictures: 12, rows: 2, yaw_step_deg: 24.0, translation_fraction: 0.02, ..base },
        // Looking up, at two focal lengths.
        3 | 9 => RigOptions { pictures: 9, pitch_deg: 15.0, second_hfov_deg: 40.0, yaw_step_deg: 20.0, ..base },
        // The strongest parallax.
        4 | 10 => RigOptions { pictures: 7, translation_fraction: 0.05, yaw_step_deg: 22.0, ..base },
        // A full turn from one point.
        5 | 11 => RigOptions { pictures: 16, yaw_step_deg: 22.5, yaw_sd_deg: 1.0, translation_fraction: 0.0, ..base },
        // A full turn in four rows.
        6 | 12 => {
            RigOptions { pictures: 72, rows: 4, yaw_step_deg: 20.0, pitch_step_deg: 24.0, pitch_deg: 8.0, ..base }
        }
        _ => return None,
    };
    Some(rig)
}

/// The twin 1 to 12 of a study set: the same cameras where no direction is preferred, odd numbers among blocks at
/// random turns, even ones in the open country; `None` for other numbers.
fn twin_set(number: usize) -> Option<(SceneOptions, RigOptions)> {
    let rig = study_rig(number)?;
    let kind = if number % 2 == 1 { SceneKind::Boxes } else { SceneKind::Nature };
    let scene =
        SceneOptions { kind, seed: 200 + number as u64, light: LightQuality::Standard, ..SceneOptions::default() };
    Some((scene, rig))
}

/// Mixed set 1 to 4, with one vertical and horizontals at free angles: two rooms, two squares; `None` for other
/// numbers.
fn mixed_set(number: usize) -> Option<(SceneOptions, RigOptions)> {
    let base = RigOptions { width: 1024, height: 768, roll_sd_deg: 6.0, ..RigOptions::default() };
    let (kind, style, rig) = match number {
        1 => (SceneKind::TurnedRoom, RoomStyle::Living, RigOptions { pictures: 8, ..base }),
        2 => {
            let rig = RigOptions { pictures: 12, rows: 2, yaw_step_deg: 24.0, translation_fraction: 0.02, ..base };
            (SceneKind::TurnedRoom, RoomStyle::Library, rig)
        }
        3 => (SceneKind::TurnedStreet, RoomStyle::Living, RigOptions { pictures: 8, pitch_deg: 8.0, ..base }),
        4 => {
            let rig = RigOptions { pictures: 16, yaw_step_deg: 22.5, yaw_sd_deg: 1.0, pitch_deg: 6.0, ..base };
            (SceneKind::TurnedStreet, RoomStyle::Living, rig)
        }
        _ => return None,
    };
    let seed = 300 + number as u64;
    Some((SceneOptions { kind, style, seed, light: LightQuality::Standard }, RigOptions { seed, ..rig }))
}

/// Set 1 to [`GATE_SETS`] for statistics of the gate: 4 to 8 small pictures of rooms and streets (`manhattan`), or of
/// blocks at random turns and open country; `None` for other numbers.
fn gate_set(manhattan: bool, number: usize) -> Option<(SceneOptions, RigOptions)> {
    const STREAM: u64 = 0x4741_5445;
    if number == 0 || number > GATE_SETS {
        return None;
    }
    let seed = 1000 + 2 * number as u64 + u64::from(manhattan);
    let mut dice = Dice::new(seed, STREAM);
    let styles = [
        RoomStyle::Living,
        RoomStyle::Office,
        RoomStyle::Kitchen,
        RoomStyle::Library,
        RoomStyle::Gallery,
        RoomStyle::Workshop,
    ];
    let kind = match (manhattan, number % 2) {
        (true, 0) => SceneKind::Street,
        (true, _) => SceneKind::Room,
        (false, 0) => SceneKind::Nature,
        (false, _) => SceneKind::Boxes,
    };
    let rows = if dice.chance(0.25) { 2 } else { 1 };
    let rig = RigOptions {
        seed,
        pictures: if rows == 2 { 2 * (2 + dice.index(3)) } else { 4 + dice.index(5) },
        rows,
        width: 640,
        height: 480,
        hfov_deg: dice.range(48.0, 64.0),
        yaw_deg: dice.range(-180.0, 180.0),
        yaw_step_deg: dice.range(18.0, 26.0),
        pitch_deg: dice.range(-4.0, 14.0),
        pitch_step_deg: dice.range(18.0, 22.0),
        roll_sd_deg: dice.range(3.0, 8.0),
        translation_fraction: dice.range(0.0, 0.03),
        ..RigOptions::default()
    };
    let style = styles[dice.index(styles.len())];
    Some((SceneOptions { kind, style, seed, light: LightQuality::Fast }, rig))
}
