//! The sets of pictures that are made again and again: the committed example and the paper's twelve synthetic sets.

use crate::rig::RigOptions;
use crate::scene::{SceneKind, SceneOptions};

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
pub fn study_set(number: usize) -> Option<(SceneOptions, RigOptions)> {
    let kind = if number <= 6 { SceneKind::Room } else { SceneKind::Street };
    let base = RigOptions { seed: number as u64, width: 1024, height: 768, roll_sd_deg: 6.0, ..RigOptions::default() };
    let rig = match number {
        1 | 7 => RigOptions { pictures: 5, ..base },
        2 | 8 => RigOptions { pictures: 12, rows: 2, yaw_step_deg: 24.0, translation_fraction: 0.02, ..base },
        3 | 9 => RigOptions { pictures: 9, pitch_deg: 15.0, second_hfov_deg: 40.0, yaw_step_deg: 20.0, ..base },
        4 | 10 => RigOptions { pictures: 7, translation_fraction: 0.05, yaw_step_deg: 22.0, ..base },
        5 | 11 => RigOptions { pictures: 16, yaw_step_deg: 22.5, yaw_sd_deg: 1.0, translation_fraction: 0.0, ..base },
        6 | 12 => {
            RigOptions { pictures: 72, rows: 4, yaw_step_deg: 20.0, pitch_step_deg: 24.0, pitch_deg: 8.0, ..base }
        }
        _ => return None,
    };
    let scene = SceneOptions { kind, seed: 100 + number as u64, ..SceneOptions::default() };
    Some((scene, rig))
}
