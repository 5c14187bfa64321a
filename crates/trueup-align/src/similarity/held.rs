//! How people hold cameras: about level, little rolled, but for some that are turned on purpose.

use nalgebra::{Matrix3, Vector3};

/// Roll of cameras that are held level, degrees. Reasoned.
const EXPECTED_ROLL_DEG: f64 = 5.0;
/// How far photographs look up or down, degrees. Reasoned.
const EXPECTED_PITCH_DEG: f64 = 25.0;
/// Square of the roll, in expected ones, of a camera that was turned on purpose, by whatever angle. Reasoned: rarer
/// than a photograph that looks up by 60 degrees, more frequent than one of the zenith.
pub(super) const TURNED: f64 = 12.0;
/// Largest angle that two cameras are rolled against each other by where both are held level, degrees. Reasoned: rolls
/// scatter by 1 to 5 degrees, and what is turned on purpose is turned farther.
const MAX_HELD_APART_DEG: f64 = 20.0;

/// Square of a roll, by its sine, in units of what is expected.
pub(super) fn roll_square(sine: f64) -> f64 {
    (sine.clamp(-1.0, 1.0).asin() / EXPECTED_ROLL_DEG.to_radians()).powi(2)
}

/// The same of how far a camera looks up or down.
pub(super) fn pitch_square(sine: f64) -> f64 {
    (sine.clamp(-1.0, 1.0).asin() / EXPECTED_PITCH_DEG.to_radians()).powi(2)
}

/// How improbably cameras are held if the vertical is `down` or its opposite: mean squares of their roll, of which none
/// counts for more than [`TURNED`], and of how far they look up or down, each in units of what is expected of it.
pub(super) fn improbability(down: &Vector3<f64>, rotations: &[Matrix3<f64>]) -> f64 {
    let of_one = |rotation: &Matrix3<f64>| {
        let seen = rotation * down;
        roll_square(seen.x).min(TURNED) + pitch_square(seen.z)
    };
    rotations.iter().map(of_one).sum::<f64>() / rotations.len() as f64
}

/// Most of the cameras, those that are held alike; all of them where no more than half are. Least squares would look
/// for a vertical between the others and these.
pub(super) fn held_alike(rotations: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
    // Somebody holds the camera level.
    let candidates = rotations.iter().map(|rotation| rotation.row(1).transpose());
    let costs = candidates.map(|down| (improbability(&down, rotations), down));
    let least = costs.min_by(|one, other| one.0.total_cmp(&other.0));
    let held: Vec<_> = least.map_or_else(Vec::new, |(_, down)| held(rotations, &down));
    match 2 * held.len() > rotations.len() {
        true => held.into_iter().map(|(rotation, _)| *rotation).collect(),
        false => rotations.to_vec(),
    }
}

/// Root mean square in radians of the rolls of cameras if the vertical is `down`. Cameras that are rolled against the
/// one that is rolled least by more than anybody who holds them level does were turned on purpose, whatever the
/// vertical is, and are not counted.
pub(super) fn held_roll(rotations: &[Matrix3<f64>], down: &Vector3<f64>) -> f64 {
    let held = held(rotations, down);
    (held.iter().map(|(_, roll)| roll * roll).sum::<f64>() / held.len() as f64).sqrt()
}

/// Cameras that are held as the one is that is rolled least if the vertical is `down`, and their rolls in radians.
fn held<'a>(rotations: &'a [Matrix3<f64>], down: &Vector3<f64>) -> Vec<(&'a Matrix3<f64>, f64)> {
    let rolled = |rotation: &'a Matrix3<f64>| (rotation, (rotation * down).x.clamp(-1.0, 1.0).asin());
    let mut all: Vec<(&Matrix3<f64>, f64)> = rotations.iter().map(rolled).collect();
    let rolls = all.iter().map(|(_, roll)| *roll);
    let least = rolls.min_by(|one, other| one.abs().total_cmp(&other.abs())).unwrap_or(0.0);
    all.retain(|(_, roll)| (roll - least).abs() <= MAX_HELD_APART_DEG.to_radians());
    all
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::rotation_about_z;

    use super::*;

    /// By hand: rolls of 0.02, -0.04 and, turned on purpose, 0.7.
    #[test]
    fn who_turns_a_camera_on_purpose_does_not_hold_it_askew() {
        let rotations = [0.02, -0.04, 0.7].map(rotation_about_z);
        let expected = ((0.02_f64.powi(2) + 0.04_f64.powi(2)) / 2.0).sqrt();
        assert!((held_roll(&rotations, &Vector3::y()) - expected).abs() < 1e-12);
    }
}
