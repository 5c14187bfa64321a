//! One vertical of everything that tells of it, each by how sure it is.
//!
//! The cameras expect to be held level, sensors recorded gravity, a far horizon is level, lines point down. Each gives
//! a direction and a covariance; the vertical is the direction of least summed squares, each in units of its own
//! deviation, so that none is believed altogether or not at all.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use trueup_core::geometry::tangent_basis;
use trueup_core::statistics::greatest_deviation;

use super::gate::CameraAngle;
use super::gravity::MeanGravity;
use super::held::{held_alike, held_roll};
use crate::far_horizon::FarHorizon;
use crate::straightening::{Straightened, level_moment, straighten, straighten_with_pitch};

/// Roll that photographers leave, degrees: what is expected before the photographs show their own. Reasoned: hand-held
/// photographs of level scenes scatter by 1 to 3 degrees.
const EXPECTED_ROLL_DEG: f64 = 2.0;
/// How many photographs that expectation counts for.
const EXPECTED_COUNT: f64 = 2.0;
/// The two angles of a vertical are fitted to the rolls.
const FITTED: f64 = 2.0;
/// How many of its deviations the cameras' level lies from the vertical when it counts for a quarter (Geman-McClure):
/// nothing keeps photographers from tilting all photographs alike.
const HELD_SCALE: f64 = 2.0;
/// A far horizon farther from the vertical of lines that may guide than so many deviations of both is none: what lines
/// agree on is seen as well, and in most scenes by more photographs.
const MAX_HORIZON_DEVIATIONS: f64 = 4.0;
/// Least standard deviation of a vertical, radians: what directions in double precision tell apart. A jackknife over
/// lines that leave a frame where it is finds none.
const LEAST_DEVIATION: f64 = 1.5e-8;
/// Least share of the information at which lines that do not guide are said to take part.
const LEAST_SHARE: f64 = 0.05;
/// Steps toward the vertical of least squares. Where the cameras' level is far off, it takes several to do without it.
const STEPS: usize = 20;

/// What tells of the vertical.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LevelSource {
    /// The directions of lines in the photographs.
    Lines,
    /// Gravity that the cameras recorded.
    Gravity,
    /// The expectation that cameras are held level.
    Cameras,
    /// The far horizon of sea or plain.
    Horizon,
}

/// What one source said of the vertical, and what it came to count for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LevelEvidence {
    /// Who says it.
    pub source: LevelSource,
    /// How many photographs it rests on.
    pub photographs: usize,
    /// Angle in radians between its own vertical and the one that was used.
    pub angle: f64,
    /// Standard deviation in radians, about the axis it tells least of.
    pub deviation: f64,
    /// Its share of the information that the vertical rests on, 0 to 1.
    pub share: f64,
}

/// A source before it is weighed: squares of a direction d are d^T `moment` d + (d - `down`)^T `information` (d -
/// `down`).
#[derive(Debug, Clone, Copy)]
struct Say {
    source: LevelSource,
    photographs: usize,
    down: Vector3<f64>,
    /// Of what a vertical is orthogonal to, rad^-2.
    moment: Matrix3<f64>,
    /// Of the vertical itself, rad^-2.
    information: Matrix3<f64>,
}

impl Say {
    /// Of what was seen: `across` is what it tells of turns of `down` along the columns of its tangent basis, rad^-2.
    ///
    /// Along `down` itself it tells as much as it does least across: to turns by small angles that says nothing, and
    /// the opposite of what was seen, which is orthogonal to the same tangents, is not as good.
    fn seen(source: LevelSource, photographs: usize, down: Vector3<f64>, across: &Matrix2<f64>) -> Self {
        let basis = tangent_basis(&down);
        let least = across.symmetric_eigenvalues().min().max(0.0);
        let information = basis * across * basis.transpose() + down * down.transpose() * least;
        Self { source, photographs, down, moment: Matrix3::zeros(), information }
    }

    /// What the squares of `down` are beyond those of its own vertical.
    fn squares_beyond(&self, down: &Vector3<f64>) -> f64 {
        let squares = |direction: &Vector3<f64>| direction.dot(&(self.moment * direction));
        (squares(down) - squares(&self.down)).max(0.0) + self.seen_beyond(down)
    }

    /// The same of what was seen.
    fn seen_beyond(&self, down: &Vector3<f64>) -> f64 {
        let off = down - self.down;
        off.dot(&(self.information * off))
    }

    /// The same of what was only expected, in squares of the scale at which it gives way.
    fn expected_beyond(&self, down: &Vector3<f64>) -> f64 {
        Self { information: Matrix3::zeros(), ..*self }.squares_beyond(down) / HELD_SCALE.powi(2)
    }

    /// What is left of this say if the vertical is `down`: all of what was seen, less of what was only expected.
    fn heeded(&self, down: &Vector3<f64>) -> Self {
        Self { moment: self.moment * (1.0 + self.expected_beyond(down)).powi(-2), ..*self }
    }

    /// The squares of `down` beyond its own that are minimized: of what was only expected, no more than the square of
    /// the scale.
    fn cost(&self, down: &Vector3<f64>) -> f64 {
        let expected = self.expected_beyond(down);
        HELD_SCALE.powi(2) * expected / (1.0 + expected) + self.seen_beyond(down)
    }

    /// Information about turns of `down` along the columns of `basis`.
    fn information(&self, basis: &Matrix3x2<f64>) -> Matrix2<f64> {
        basis.tr_mul(&((self.moment + self.information) * basis))
    }

    /// Half the gradient of the squares at `down` along the columns of `basis`.
    fn gradient(&self, down: &Vector3<f64>, basis: &Matrix3x2<f64>) -> Vector2<f64> {
        basis.tr_mul(&(self.moment * down + self.information * (down - self.down)))
    }

    /// Standard deviation in radians about the axis it tells least of.
    fn deviation(&self) -> f64 {
        greatest_deviation(&self.information(&tangent_basis(&self.down)))
    }
}

/// What is known of the vertical without lines.
#[derive(Debug, Clone)]
pub(super) struct CameraLevel<'a> {
    /// The cameras' rotations, from the common frame to each camera.
    pub rotations: &'a [Matrix3<f64>],
    /// The same as if all photographs had been stored upright.
    pub viewed: &'a [Matrix3<f64>],
    /// By [`straighten`], as published, of the cameras that are held alike.
    pub straightened: Straightened,
    /// Down in the common frame, by the cameras, by recorded gravity and by the far horizon.
    pub down: Vector3<f64>,
    /// The same without the far horizon.
    held: Vector3<f64>,
    /// Whether recorded gravity takes part.
    pub has_gravity: bool,
    says: Vec<Say>,
}

impl<'a> CameraLevel<'a> {
    /// Of the cameras with what [`straighten_with_pitch`] expects of them, but for few that were turned on purpose, and
    /// of the mean of recorded gravity, if there is any.
    pub(super) fn new(rotations: &'a [Matrix3<f64>], pitch_prior: f64, gravity: Option<MeanGravity>) -> Self {
        Self::of_viewed(rotations, rotations, pitch_prior, gravity)
    }

    /// The same where some photographs lie on their side: `viewed` are the cameras as if all were stored upright.
    pub(super) fn of_viewed(
        rotations: &'a [Matrix3<f64>],
        viewed: &'a [Matrix3<f64>],
        pitch_prior: f64,
        gravity: Option<MeanGravity>,
    ) -> Self {
        let held = held_alike(viewed);
        let level = straighten_with_pitch(&held, pitch_prior);
        let cameras = Say {
            source: LevelSource::Cameras,
            photographs: held.len(),
            down: level,
            moment: level_moment(&held, pitch_prior) / roll_variance(&held, &level),
            information: Matrix3::zeros(),
        };
        let gravity = gravity.map(|gravity| Say {
            source: LevelSource::Gravity,
            photographs: gravity.photographs,
            down: gravity.down,
            moment: Matrix3::zeros(),
            information: Matrix3::identity() * gravity.deviation.powi(-2),
        });
        let says: Vec<Say> = [Some(cameras), gravity].into_iter().flatten().collect();
        let has_gravity = gravity.is_some();
        let down = if has_gravity { combined(&says) } else { level };
        Self { rotations, viewed, straightened: straighten(&held), down, held: down, has_gravity, says }
    }

    /// The same with a far horizon that was found.
    pub(super) fn with_horizon(self, horizon: &FarHorizon) -> Self {
        let mut says = self.says;
        let basis = tangent_basis(&horizon.down);
        let across = basis.tr_mul(&(horizon.information * basis));
        says.push(Say::seen(LevelSource::Horizon, horizon.photographs, horizon.down, &across));
        let down = combined(&says);
        Self { down, says, ..self }
    }

    /// How many deviations of what is known without lines a vertical lies from its own.
    pub(super) fn deviations_to(&self, down: &Vector3<f64>) -> f64 {
        self.says.iter().map(|say| say.squares_beyond(down)).sum::<f64>().sqrt()
    }

    /// Standard deviation in radians of `down`, about the axis that is known worst.
    pub(super) fn deviation(&self) -> f64 {
        let heeded: Vec<Say> = self.says.iter().map(|say| say.heeded(&self.down)).collect();
        greatest_deviation(&information(&heeded, &self.down))
    }

    /// How far a vertical lies from the one that the cameras tell, without the far horizon: with recorded gravity; of
    /// two photographs, whose x axes contradict nothing, as they expect to be held; or by straightening as published if
    /// the cameras fix that. The horizon is compared with lines where both are weighed.
    pub(super) fn angle_to(&self, down: &Vector3<f64>) -> Option<CameraAngle> {
        let own = match (self.has_gravity, self.straightened.conditioned) {
            (true, _) => self.held,
            (false, _) if self.rotations.len() == 2 => self.held,
            (false, true) => self.straightened.down,
            (false, false) => return None,
        };
        let held = self.says.iter().filter(|say| say.source != LevelSource::Horizon);
        let squares: f64 = held.map(|say| say.squares_beyond(down)).sum();
        let rolls = held_roll(self.viewed, down);
        let pitch_is_untold = !self.has_gravity && self.rotations.len() == 2;
        Some(CameraAngle {
            angle: own.angle(down),
            deviations: squares.sqrt(),
            rolls: pitch_is_untold.then_some(rolls),
            is_recorded: self.has_gravity,
        })
    }

    /// What told of `down`, and of how much.
    pub(super) fn evidence(&self) -> Vec<LevelEvidence> {
        evidence(&self.says, &self.down)
    }

    /// The same without the far horizon.
    pub(super) fn without_horizon(&self) -> Self {
        let held = self.says.iter().copied().filter(|say| say.source != LevelSource::Horizon);
        Self { down: self.held, says: held.collect(), ..*self }
    }

    /// The same without a far horizon that contradicts `lines` that may guide, whose vertical deviates by `deviation`
    /// radians.
    pub(super) fn without_contradicted_horizon(&self, lines: &Vector3<f64>, deviation: f64) -> Self {
        let contradicts = |say: &Say| {
            let off = lines.angle(&say.down);
            say.source == LevelSource::Horizon && off > MAX_HORIZON_DEVIATIONS * deviation.hypot(say.deviation())
        };
        if self.says.iter().any(contradicts) { self.without_horizon() } else { self.clone() }
    }

    /// What told of the vertical `down`, which has the covariance `covariance` about its tangents, rad^2, with lines in
    /// `photographs` photographs: the lines first. `covariance` is that of all together, so that the lines' share comes
    /// of what its inverse has beyond the information of the other sources. `None` where that is less than
    /// [`LEAST_SHARE`].
    pub(super) fn evidence_beside_lines(
        &self,
        down: &Vector3<f64>,
        covariance: &Matrix2<f64>,
        photographs: usize,
    ) -> Option<Vec<LevelEvidence>> {
        let heeded: Vec<Say> = self.says.iter().map(|say| say.heeded(down)).collect();
        let mut left = (covariance.try_inverse()? - information(&heeded, down)).symmetric_eigen();
        // What was known to a quarter turn was not known.
        left.eigenvalues.apply(|value| *value = value.max(FRAC_PI_2.powi(-2)));
        let lines = Say::seen(LevelSource::Lines, photographs, *down, &left.recompose());
        let says: Vec<Say> = std::iter::once(lines).chain(self.says.iter().copied()).collect();
        let evidence = evidence(&says, down);
        evidence.first().is_some_and(|lines| lines.share >= LEAST_SHARE).then_some(evidence)
    }

    /// The vertical with what lines in `photographs` photographs say of it, whose covariance is `covariance`, rad^2,
    /// weighed in; and what told of it, the lines first.
    pub(super) fn with_lines(
        &self,
        lines: &Vector3<f64>,
        covariance: &Matrix3<f64>,
        photographs: usize,
    ) -> (Vector3<f64>, Vec<LevelEvidence>) {
        let basis = tangent_basis(lines);
        let least = Matrix2::identity() * LEAST_DEVIATION.powi(2);
        // What is infinite tells nothing.
        let across = (basis.tr_mul(&(covariance * basis)) + least).try_inverse();
        let across = across.filter(|across| across.iter().all(|part| part.is_finite())).unwrap_or_default();
        let lines_say = Say::seen(LevelSource::Lines, photographs, *lines, &across);
        let says: Vec<Say> = std::iter::once(lines_say).chain(self.says.iter().copied()).collect();
        let down = combined(&says);
        let evidence = evidence(&says, &down);
        (down, evidence)
    }
}

/// Variance of the cameras' rolls about `level`, of which two angles were fitted; with what is expected of
/// photographers, which few photographs do not refute.
fn roll_variance(rotations: &[Matrix3<f64>], level: &Vector3<f64>) -> f64 {
    let squares: f64 = rotations.iter().map(|rotation| rotation.row(0).transpose().dot(level).powi(2)).sum();
    let free = (rotations.len() as f64 - FITTED).max(0.0);
    (squares + EXPECTED_COUNT * EXPECTED_ROLL_DEG.to_radians().powi(2)) / (free + EXPECTED_COUNT)
}

/// The direction of least squares. As what was only expected gives way, there is one near what was seen and one near
/// what was expected: steps begin at what each say means by itself, and end where the cost is least.
fn combined(says: &[Say]) -> Vector3<f64> {
    let cost = |down: &Vector3<f64>| says.iter().map(|say| say.cost(down)).sum::<f64>();
    let ends = says.iter().map(|say| descended(says, &say.down)).map(|down| (cost(&down), down));
    let least = ends.min_by(|one, other| one.0.total_cmp(&other.0));
    least.map_or_else(Vector3::y, |(_, down)| down)
}

/// Where steps of least squares lead from `start`.
fn descended(says: &[Say], start: &Vector3<f64>) -> Vector3<f64> {
    let mut down = *start;
    for _ in 0..STEPS {
        let basis = tangent_basis(&down);
        let says: Vec<Say> = says.iter().map(|say| say.heeded(&down)).collect();
        let gradient: Vector2<f64> = says.iter().map(|say| say.gradient(&down, &basis)).sum();
        let Some(covariance) = information(&says, &down).try_inverse() else { break };
        down = (down - basis * (covariance * gradient)).normalize();
    }
    if down.iter().all(|part| part.is_finite()) { down } else { *start }
}

/// What the sources tell together of turns of `down` about its two tangents.
fn information(says: &[Say], down: &Vector3<f64>) -> Matrix2<f64> {
    let basis = tangent_basis(down);
    says.iter().map(|say| say.information(&basis)).sum()
}

/// Shares are of the trace of the information.
fn evidence(says: &[Say], down: &Vector3<f64>) -> Vec<LevelEvidence> {
    let basis = tangent_basis(down);
    let traces: Vec<f64> = says.iter().map(|say| say.heeded(down).information(&basis).trace()).collect();
    let total: f64 = traces.iter().sum();
    let of_say = |(say, trace): (&Say, &f64)| LevelEvidence {
        source: say.source,
        photographs: say.photographs,
        angle: say.down.angle(down),
        deviation: say.deviation(),
        share: if total > 0.0 { trace / total } else { 0.0 },
    };
    says.iter().zip(&traces).map(of_say).collect()
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    const PITCH_PRIOR: f64 = 0.1;

    /// Four cameras that look in all directions, rolled by turns to the left and to the right.
    fn all_round(roll: f64) -> Vec<Matrix3<f64>> {
        let turn = |quarter: i32| rotation_about_y(f64::from(quarter) * FRAC_PI_2);
        (0..4).map(|quarter| rotation_about_z(if quarter % 2 == 0 { roll } else { -roll }) * turn(quarter)).collect()
    }

    /// The covariance of a vertical that deviates alike all round.
    fn alike(deviation: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal_element(deviation.powi(2))
    }

    fn gravity(down: Vector3<f64>, deviation: f64) -> Option<MeanGravity> {
        Some(MeanGravity { down, deviation, photographs: 4 })
    }

    /// By symmetry the level is y. The variance of a roll is (4 sin^2 r + 2 e^2) / (2 + 2) with e the expected roll,
    /// and either horizontal axis is fixed by 2 cos^2 r + 2 p.
    #[test]
    fn the_level_of_cameras_is_as_certain_as_rolls_let_it_be() {
        let roll = 0.1_f64;
        let rotations = all_round(roll);
        let level = CameraLevel::new(&rotations, PITCH_PRIOR, None);
        assert!(level.down.angle(&Vector3::y()) < 1e-12, "{}", level.down);
        let variance = (4.0 * roll.sin().powi(2) + 2.0 * EXPECTED_ROLL_DEG.to_radians().powi(2)) / 4.0;
        let expected = (variance / (2.0 * roll.cos().powi(2) + 2.0 * PITCH_PRIOR)).sqrt();
        assert!((level.deviation() - expected).abs() < 1e-12, "{} instead of {expected}", level.deviation());
        let [cameras] = level.evidence()[..] else { panic!("one source") };
        assert_eq!((cameras.source, cameras.share), (LevelSource::Cameras, 1.0));
    }

    /// Two directions a small angle apart, of deviations 1 and 2: the mean lies at a fifth of the angle from the surer.
    #[test]
    fn lines_and_gravity_meet_by_their_variances() {
        let rotations = all_round(0.0);
        let tilted = rotation_about_x(0.02) * Vector3::y();
        let level = CameraLevel::new(&rotations, 0.0, gravity(tilted, 0.002));
        // The cameras, sure to a degree, move gravity a little; what remains lies between.
        let (down, evidence) = level.with_lines(&Vector3::y(), &alike(0.001), 4);
        let cameras = CameraLevel::new(&rotations, 0.0, None).deviation().powi(-2);
        let (lines, gravity) = (1e6, 0.25e6);
        let expected = 0.02 * gravity / (gravity + lines + cameras);
        assert!((down.angle(&Vector3::y()) - expected).abs() < 1e-4 * expected, "{}", down.angle(&Vector3::y()));
        let shares: Vec<f64> = evidence.iter().map(|one| one.share).collect();
        let total = lines + gravity + cameras;
        for (share, expected) in shares.iter().zip([lines / total, cameras / total, gravity / total]) {
            assert!((share - expected).abs() < 1e-3, "{shares:?}");
        }
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    /// Lines sure to 0.001 one way and to 1 the other, against gravity sure to 0.001 that is 0.002 off both ways:
    /// halfway the one way, all of it the other. The cameras, sure to a degree, change either by less than a hundredth.
    #[test]
    fn lines_are_heard_as_far_as_they_tell() {
        let rotations = all_round(0.0);
        let recorded = Vector3::new(0.002, 1.0, 0.002).normalize();
        let level = CameraLevel::new(&rotations, 0.0, gravity(recorded, 0.001));
        let covariance = Matrix3::from_diagonal(&Vector3::new(1e-6, 0.0, 1.0));
        let (down, evidence) = level.with_lines(&Vector3::y(), &covariance, 4);
        assert!((down.x - 0.001).abs() < 1e-5 && (down.z - 0.002).abs() < 2e-5, "{down}");
        assert!((evidence[0].deviation - 1.0).abs() < 1e-6, "{}", evidence[0].deviation);
        let (unheard, _) = level.with_lines(&Vector3::x(), &alike(f64::INFINITY), 4);
        assert!(unheard.angle(&level.down) < 1e-9, "{unheard}");
    }

    /// A telephone laid on its side for every photograph: its cameras expect another level, gravity knows.
    #[test]
    fn gravity_outweighs_how_cameras_are_held() {
        let rotations: Vec<Matrix3<f64>> =
            all_round(0.0).iter().map(|rotation| rotation_about_z(FRAC_PI_2) * rotation).collect();
        let level = CameraLevel::new(&rotations, PITCH_PRIOR, gravity(Vector3::y(), 0.02));
        assert!(level.down.angle(&Vector3::y()) < 1e-3, "{}", level.down);
        let shares: Vec<f64> = level.evidence().iter().map(|one| one.share).collect();
        assert!(shares[0] < 1e-3 && shares[1] > 0.999, "{shares:?}");
    }

    /// Two of three photographs stand upright, one lies on its side: whichever way the vertical of lines points, with
    /// the cameras' level or against it, it keeps its sense.
    #[test]
    fn lines_are_not_stood_on_their_head() {
        let rolls = [0.0, FRAC_PI_2, 0.0];
        let rotations: Vec<Matrix3<f64>> = rolls
            .iter()
            .zip([-0.5, 0.0, 0.5])
            .map(|(&roll, yaw)| rotation_about_z(roll) * rotation_about_y(yaw))
            .collect();
        let level = CameraLevel::new(&rotations, PITCH_PRIOR, None);
        for lines in [Vector3::y(), -Vector3::y()] {
            let (down, _) = level.with_lines(&lines, &alike(0.002), 3);
            assert!(down.angle(&lines) < 0.01, "{down}");
        }
    }

    /// The level of two photographs is that of three of which the third lies on its side; of two turned against each
    /// other both count.
    #[test]
    fn who_turns_a_camera_on_purpose_does_not_tilt_the_level() {
        let views = [-0.4, 0.4, 0.0].map(|yaw| rotation_about_x(0.05) * rotation_about_y(yaw));
        let on_its_side = rotation_about_z(FRAC_PI_2) * views[2];
        let level = |rotations: &[Matrix3<f64>]| CameraLevel::new(rotations, PITCH_PRIOR, None).down;
        let turned = level(&[views[0], views[1], on_its_side]);
        assert!(turned.angle(&level(&views[..2])) < 1e-12, "{turned}");
        assert_eq!(held_alike(&[views[0], on_its_side]).len(), 2);
    }

    /// Lines 14 degrees from the cameras' level. Cameras whose level is sure to sqrt((2 e^2 / 4) / 2) = 1 degree cost
    /// at most 4, Geman and McClure's scale squared; at their own level, lines that are sure to 10 degrees cost (14 /
    /// 10)^2, such as are sure to 3 (14 / 3)^2.
    #[test]
    fn cameras_give_way_to_what_is_surer_than_their_distance_alone() {
        let rotations = all_round(0.0);
        let level = CameraLevel::new(&rotations, 0.0, None);
        let lines = rotation_about_x(14_f64.to_radians()) * Vector3::y();
        let down = |deviation_deg: f64| level.with_lines(&lines, &alike(deviation_deg.to_radians()), 4).0;
        let from_cameras = |deviation_deg: f64| down(deviation_deg).angle(&Vector3::y()).to_degrees();
        assert!(from_cameras(10.0) < 0.5, "{}", from_cameras(10.0));
        assert!(from_cameras(3.0) > 13.0, "{}", from_cameras(3.0));
    }

    fn far_horizon(down: Vector3<f64>, deviation: f64) -> FarHorizon {
        let about = Matrix3::identity() - down * down.transpose();
        FarHorizon { down, information: about * deviation.powi(-2), photographs: 3 }
    }

    /// Cameras that all look up by 0.1 expect a level that is off by that, the horizon knows: it is surer by far.
    #[test]
    fn a_far_horizon_outweighs_how_cameras_are_held() {
        let rotations: Vec<Matrix3<f64>> =
            [-0.2, 0.2].map(|yaw| rotation_about_x(-0.1) * rotation_about_y(yaw)).to_vec();
        let level = CameraLevel::new(&rotations, PITCH_PRIOR, None);
        assert!(level.down.angle(&Vector3::y()) > 0.04, "{}", level.down);
        let level = level.with_horizon(&far_horizon(Vector3::y(), 0.003));
        assert!(level.down.angle(&Vector3::y()) < 0.001, "{}", level.down);
        let evidence = level.evidence();
        let [cameras, horizon] = evidence[..] else { panic!("two sources") };
        assert_eq!((horizon.source, horizon.photographs), (LevelSource::Horizon, 3));
        assert!(horizon.share > 0.95 && cameras.share < 0.05, "{evidence:?}");
        assert!((horizon.deviation - 0.003).abs() < 1e-9);
    }

    /// Lines sure to 0.002 and a horizon sure to 0.004, 0.01 apart, are 2.2 deviations of both: the mean lies at a
    /// fifth, but for what the cameras tell. 0.05 apart are 11, and the horizon is none.
    #[test]
    fn a_far_horizon_that_contradicts_the_lines_does_not_count() {
        let rotations = all_round(0.0);
        let with = |angle: f64| {
            let down = rotation_about_x(angle) * Vector3::y();
            let level = CameraLevel::new(&rotations, 0.0, None).with_horizon(&far_horizon(down, 0.004));
            level.without_contradicted_horizon(&Vector3::y(), 0.002).with_lines(&Vector3::y(), &alike(0.002), 4)
        };
        let (down, evidence) = with(0.01);
        assert!((down.angle(&Vector3::y()) - 0.002).abs() < 1e-4, "{}", down.angle(&Vector3::y()));
        assert_eq!(evidence.len(), 3);
        // Heard all the same, it counts for a fifth as before.
        let contradicted = rotation_about_x(0.05) * Vector3::y();
        let level = CameraLevel::new(&rotations, 0.0, None).with_horizon(&far_horizon(contradicted, 0.004));
        let (down, evidence) = level.with_lines(&Vector3::y(), &alike(0.002), 4);
        assert!((down.angle(&Vector3::y()) - 0.01).abs() < 5e-4, "{}", down.angle(&Vector3::y()));
        assert_eq!(evidence.len(), 3);
        let (down, evidence) = with(0.05);
        assert!(down.angle(&Vector3::y()) < 1e-9, "{}", down.angle(&Vector3::y()));
        assert!(evidence.iter().all(|one| one.source != LevelSource::Horizon));
    }

    /// The gate asks how far lines lie from how two photographs are held, 0.3, wherever a horizon is.
    #[test]
    fn lines_are_compared_with_cameras_without_the_horizon() {
        let rotations = [-0.2, 0.2].map(rotation_about_y);
        let horizon = far_horizon(rotation_about_x(-0.2) * Vector3::y(), 0.003);
        let level = CameraLevel::new(&rotations, PITCH_PRIOR, None).with_horizon(&horizon);
        assert!(level.down.angle(&horizon.down) < 0.01, "{}", level.down);
        let angle = level.angle_to(&(rotation_about_x(0.3) * Vector3::y())).expect("two photographs").angle;
        assert!((angle - 0.3).abs() < 1e-9, "{angle}");
        assert!(level.without_horizon().down.angle(&Vector3::y()) < 1e-9);
    }

    #[test]
    fn lines_that_do_not_scatter_are_believed() {
        let rotations = all_round(0.0);
        let lines = rotation_about_x(0.02) * Vector3::y();
        let (down, evidence) = CameraLevel::new(&rotations, PITCH_PRIOR, None).with_lines(&lines, &alike(0.0), 4);
        assert!(down.angle(&lines) < 1e-9, "{down}");
        assert!(evidence[0].share > 0.999, "{evidence:?}");
    }

    #[test]
    fn a_single_photograph_has_a_level() {
        let rotations = [Matrix3::identity()];
        let level = CameraLevel::new(&rotations, PITCH_PRIOR, None);
        assert!(level.down.angle(&Vector3::y()) < 1e-12);
        // sqrt(e^2 / p): its pitch is what it tells least of.
        let expected = EXPECTED_ROLL_DEG / PITCH_PRIOR.sqrt();
        assert!((level.deviation().to_degrees() - expected).abs() < 1e-9, "{}", level.deviation().to_degrees());
    }
}
