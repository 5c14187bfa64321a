//! Gravity as the cameras recorded it, in their common frame.

use nalgebra::{Matrix3, Vector3};
use trueup_core::source::{GravitySource, RecordedGravity};

/// Standard deviation about each axis that is expected of a recorded vertical, degrees, before the photographs show
/// their own. Reasoned: accelerometers of telephones are off by about a degree while a hand moves; gimbals hold to a
/// tenth, but drift by as much.
const fn expected_deviation_deg(source: GravitySource) -> f64 {
    match source {
        GravitySource::AppleAcceleration => 1.0,
        GravitySource::DjiGimbal => 0.5,
        GravitySource::PhotoSpherePose => 1.5,
    }
}
/// How many photographs that expectation counts for.
const EXPECTED_COUNT: f64 = 2.0;
/// What all photographs of a camera err by alike, degrees: how its sensor sits in it, and its calibration. Reasoned.
const COMMON_DEVIATION_DEG: f64 = 0.3;
/// Farther off than so many deviations of the scatter found, gravity was recorded in the middle of a move.
const MAX_OFF: f64 = 3.0;
/// Rounds in which the mean is taken of the photographs near the last one. They settle within a few.
const ROUNDS: usize = 5;
/// Scatter beyond which photographs contradict each other, in expected deviations: a tenth of a turn and more.
const MAX_SCATTER: f64 = 20.0;
/// Median of the length of a vector of two normal components of deviation 1: sqrt(2 ln 2).
const RAYLEIGH_MEDIAN: f64 = 1.177_410_022_515_474_7;

/// What recorded gravity says of the vertical.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanGravity {
    /// Down, in the common frame.
    pub down: Vector3<f64>,
    /// Standard deviation about each axis, radians.
    pub deviation: f64,
    /// How many photographs recorded it and agree.
    pub photographs: usize,
}

impl MeanGravity {
    /// The mean of the photographs that recorded it and agree, seen through the cameras' `rotations` from the common
    /// frame; its deviation is that of the scatter found, and of what all err by alike.
    ///
    /// `None` where no photograph recorded it, or they contradict each other.
    pub(super) fn of(rotations: &[Matrix3<f64>], recorded: &[Option<RecordedGravity>]) -> Option<Self> {
        let seen: Vec<(Vector3<f64>, f64)> = rotations
            .iter()
            .zip(recorded)
            .filter_map(|(rotation, recorded)| {
                let RecordedGravity { down, source } = (*recorded)?;
                let down = rotation.tr_mul(&Vector3::from(down).try_normalize(f64::EPSILON)?);
                down.iter().all(|part| part.is_finite()).then_some((down, expected_deviation_deg(source).to_radians()))
            })
            .collect();
        let mut down = most_central(&seen)?;
        let scatter = median_off(&seen, &down) / RAYLEIGH_MEDIAN;
        if scatter > MAX_SCATTER {
            return None;
        }
        let limit = MAX_OFF * scatter.max(1.0);
        let is_near =
            |down: &Vector3<f64>, (one, deviation): &(Vector3<f64>, f64)| down.angle(one) <= limit * deviation;
        for _ in 0..ROUNDS {
            let near = seen.iter().filter(|one| is_near(&down, one));
            let weighted = near.map(|(one, deviation)| one * deviation.powi(-2)).sum::<Vector3<f64>>();
            down = weighted.try_normalize(f64::EPSILON)?;
        }
        let near: Vec<&(Vector3<f64>, f64)> = seen.iter().filter(|one| is_near(&down, one)).collect();
        // In units of what is expected, of two axes each, one photograph's of which the mean takes.
        let squares: f64 = near.iter().map(|(one, deviation)| 0.5 * (down.angle(one) / deviation).powi(2)).sum();
        let variance = (squares + EXPECTED_COUNT) / (near.len().saturating_sub(1) as f64 + EXPECTED_COUNT);
        let information: f64 = near.iter().map(|(_, deviation)| deviation.powi(-2)).sum();
        let deviation = (variance / information).sqrt().hypot(COMMON_DEVIATION_DEG.to_radians());
        Some(Self { down, deviation, photographs: near.len() })
    }
}

/// Median angle from `down` in expected deviations.
fn median_off(seen: &[(Vector3<f64>, f64)], down: &Vector3<f64>) -> f64 {
    let mut off: Vec<f64> = seen.iter().map(|(one, deviation)| down.angle(one) / deviation).collect();
    off.sort_by(f64::total_cmp);
    off.get(off.len() / 2).copied().unwrap_or(0.0)
}

/// The direction that the angles to all others are least from, in sum: a start that outliers do not move. The first of
/// equals.
fn most_central(seen: &[(Vector3<f64>, f64)]) -> Option<Vector3<f64>> {
    let apart = |one: &Vector3<f64>| seen.iter().map(|(other, _)| one.angle(other)).sum::<f64>();
    seen.iter().map(|(one, _)| (apart(one), *one)).min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, one)| one)
}

#[cfg(test)]
mod tests {
    use rand::RngExt;
    use trueup_core::StageContext;
    use trueup_core::geometry::{exp_rotation, rotation_about_x, rotation_about_y};

    use super::*;

    fn recorded(rotation: &Matrix3<f64>, down: &Vector3<f64>) -> Option<RecordedGravity> {
        Some(RecordedGravity { down: (rotation * down).into(), source: GravitySource::AppleAcceleration })
    }

    fn row(count: usize) -> Vec<Matrix3<f64>> {
        (0..count).map(|place| rotation_about_x(0.1) * rotation_about_y(0.4 * place as f64)).collect()
    }

    #[test]
    fn one_of_seven_that_moved_is_overruled() {
        let rotations = row(7);
        let mut gravity: Vec<_> = rotations.iter().map(|rotation| recorded(rotation, &Vector3::y())).collect();
        gravity[2] = recorded(&rotations[2], &(rotation_about_x(0.5) * Vector3::y()));
        gravity.push(None);
        let found = MeanGravity::of(&rotations, &gravity).expect("they agree");
        assert!(
            found.down.angle(&Vector3::y()).to_degrees() < 0.05,
            "{}",
            found.down.angle(&Vector3::y()).to_degrees()
        );
        assert_eq!(found.photographs, 6);
    }

    /// The stated deviation is that of the errors: in 400 draws of sixteen photographs that scatter by twice what is
    /// expected, the mean square of the error about both axes is twice the stated variance, less what all err by alike,
    /// to a quarter.
    #[test]
    fn the_deviation_is_that_of_the_scatter() {
        const DRAWS: usize = 400;
        let mut generator = StageContext::default().generator("gravity", 7);
        let rotations = row(16);
        let (mut squares, mut stated) = (0.0, 0.0);
        for _ in 0..DRAWS {
            let mut noisy = |rotation: &Matrix3<f64>| {
                // Sums of twelve even draws have a variance of 1.
                let mut normal = || (0..12).map(|_| generator.random_range(-0.5..0.5)).sum::<f64>();
                let turn = Vector3::new(normal(), 0.0, normal()) * 2_f64.to_radians();
                recorded(rotation, &(exp_rotation(&turn) * Vector3::y()))
            };
            let gravity: Vec<_> = rotations.iter().map(&mut noisy).collect();
            let found = MeanGravity::of(&rotations, &gravity).expect("they agree");
            squares += found.down.angle(&Vector3::y()).powi(2);
            stated += 2.0 * (found.deviation.powi(2) - COMMON_DEVIATION_DEG.to_radians().powi(2));
        }
        let ratio = squares / stated;
        assert!((0.75..1.33).contains(&ratio), "{ratio}");
    }

    #[test]
    fn contradictions_and_nothing_are_no_gravity() {
        let rotations = row(4);
        let axes = [Vector3::x(), Vector3::y(), Vector3::z(), -Vector3::y()];
        let gravity: Vec<_> = rotations.iter().zip(&axes).map(|(rotation, down)| recorded(rotation, down)).collect();
        assert!(MeanGravity::of(&rotations, &gravity).is_none());
        assert!(MeanGravity::of(&rotations, &[]).is_none());
        assert!(MeanGravity::of(&rotations, &[None; 4]).is_none());
        let broken = [Some(RecordedGravity { down: [0.0; 3], source: GravitySource::DjiGimbal }), None, None, None];
        assert!(MeanGravity::of(&rotations, &broken).is_none());
    }
}
