//! Which side of each photograph is up.
//!
//! A camera that is held on its side says so in the photograph's metadata. Old cameras did not know, and programs lose
//! what they knew: such photographs lie on their side, a few among others or all of them alike. How they are turned
//! against each other their overlaps tell, so that one question is left for all of them, which way is down. It is asked
//! of every side of every photograph: how cameras are held if each photograph may be turned by quarters, how rarely
//! photographs are stored so, and the light. Sky and lamps are above, brighter and bluer than the ground; to the left
//! and to the right the scene is about as bright.
//!
//! # Source
//! Bayes' theorem; that color and brightness tell which way up a photograph is: Vailaya, Zhang, Yang, Liu and Jain,
//! "Automatic image orientation detection" (2002).
//!
//! # Departures
//! Vailaya and others learn a classifier of single photographs from thousands, which turns some that stood right. Here
//! two slopes are asked, together with the geometry of all photographs, and only what is much more probable than that
//! they are stored as they were seen turns them.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::ops::Range;

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::StageContext;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::geometry::{roll_from_down, rotation_about_z, wrap_angle};
use trueup_core::raster::Raster;

use super::held::{TURNED, pitch_square, roll_square};
use crate::far_horizon::ShownPhotograph;
use crate::straightening::straighten_with_pitch;

/// The code of a photograph that is taken to be turned in its file.
pub const PHOTOGRAPH_TURNED: &str = "photograph-turned";

/// Quarter turns in a turn.
const QUARTERS: u8 = 4;
/// Sine of the angle to the viewing direction below which down is nowhere in the picture: 20 degrees.
const MIN_SINE: f64 = 0.35;
/// Photographs whose sides are tried as down, spread over all of them.
const MOST_TRIED: usize = 24;
/// Most times that down is straightened and the photographs turned by it.
const ROUNDS: usize = 3;
/// So many photographs count for how cameras are held: one person holds them all, and in the same way.
const INDEPENDENT: f64 = 4.0;

/// Improbability, as minus a logarithm, that all photographs are stored on one of their long sides, or on their head.
/// Reasoned: of cameras that do not know how they are held, one set in twenty; nobody holds a camera on its head, and
/// who turns it wants it upright: a picture that is upright as stored lies on its side as rarely.
const ON_SIDE: f64 = 3.0;
const ON_HEAD: f64 = 7.0;
/// Twice the same of a photograph that is turned by a quarter against the others, or by two. Reasoned: rarer than a
/// photograph that is rolled by 10 degrees, not as rare as one that is turned by whatever angle ([`TURNED`]).
const QUARTER_APART: f64 = 6.0;
const HEAD_APART: f64 = 10.0;
/// How much more probable, as a logarithm, photographs must be that are turned than as they are stored.
const MUCH: f64 = 2.0;

/// Slopes of brightness and blue toward the bottom of a set of photographs, from its middle to its edge: mean and
/// standard deviation. Measured on 61 photographed sets (-0.14 and 0.15) and 113 cut ones (-0.12 and 0.12).
const DOWNWARD: (f64, f64) = (-0.15, 0.13);
/// Standard deviation of the slope to the right, of any set and in addition of one photograph. Measured on the same:
/// 0.058 of two photographs, 0.042 of three to five, 0.020 of six and more; the last of them whole turns mostly.
const SIDEWAYS: (f64, f64) = (0.035, 0.06);
/// Degrees of freedom of Student's t, which both are compared with: scenes that are lit from below occur. Reasoned.
const FREEDOM: f64 = 6.0;

/// How photographs are turned in their files.
pub(super) struct Sides {
    /// Quarter turns clockwise after which each photograph stands upright.
    pub quarters: Vec<u8>,
}

/// What one photograph tells: slopes to the right and downward.
type Slope = Vector2<f64>;

impl Sides {
    /// Of photographs whose cameras have `rotations`, from the common frame; `stored_level` is what is down in it if
    /// none is turned. `None` unless it is much more probable that some are; of two photographs, than that they are in
    /// any other way, as two tell little of which of them is turned.
    pub(super) fn found(
        rotations: &[Matrix3<f64>],
        shown: &[ShownPhotograph<'_>],
        stored_level: &Vector3<f64>,
        pitch_prior: f64,
    ) -> Option<Self> {
        if shown.len() != rotations.len() {
            return None;
        }
        let slopes: Vec<Slope> = shown.iter().map(|one| slope(one.thumbnail)).collect();
        let upright_formats = shown.iter().filter(|one| one.frame.height > one.frame.width).count();
        let scene = Scene { rotations, slopes: &slopes, is_upright_format: 2 * upright_formats > shown.len() };
        let as_stored = scene.improbability(stored_level, 0..1);
        let judged: Vec<(f64, Vector3<f64>)> =
            scene.downs(pitch_prior).map(|down| (scene.improbability(&down, 0..QUARTERS), down)).collect();
        let (improbability, down) = judged.iter().copied().min_by(|one, other| one.0.total_cmp(&other.0))?;
        let quarters = scene.quarters(&down);
        let is_turned = quarters.iter().any(|&quarter| quarter != 0);
        let is_rival = |other: &Vector3<f64>| rotations.len() == 2 && other.angle(&down) > FRAC_PI_4;
        let rivals = judged.iter().filter(|(_, other)| is_rival(other)).map(|(improbability, _)| *improbability);
        (is_turned && rivals.fold(as_stored, f64::min) - improbability > MUCH).then_some(Self { quarters })
    }

    /// Names the photographs that are turned, for who has to check it.
    pub(super) fn report(&self, context: &StageContext<'_>) {
        for (index, &quarters) in self.quarters.iter().enumerate().filter(|(_, quarters)| **quarters != 0) {
            let how = if quarters == 2 { "stands on its head" } else { "lies on its side" };
            context.report(Diagnostic::note(
                PHOTOGRAPH_TURNED,
                Subject::Photograph(index),
                format!("it {how} in its file, whatever its metadata say: light and neighbors tell; it is stood up"),
                "If the panorama is not upright now, give --roll 90, 180 or -90, or turn the photographs.",
            ));
        }
    }

    /// The cameras as if all photographs had been stored upright.
    pub(super) fn viewed(&self, rotations: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
        turned(rotations, &self.quarters)
    }
}

/// Photographs, their cameras and their light.
struct Scene<'a> {
    rotations: &'a [Matrix3<f64>],
    slopes: &'a [Slope],
    /// Whether most are higher than wide as they are stored.
    is_upright_format: bool,
}

impl Scene<'_> {
    /// Directions that may be down: about those in which a photograph has one of its sides.
    fn downs(&self, pitch_prior: f64) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let count = self.rotations.len();
        let tried = (0..count).step_by(count.div_ceil(MOST_TRIED).max(1));
        let sides = tried.flat_map(move |index| {
            let side = move |axis: Vector3<f64>| self.rotations[index].tr_mul(&axis);
            [Vector3::y(), Vector3::x(), -Vector3::y(), -Vector3::x()].map(side)
        });
        sides.map(move |side| {
            (0..ROUNDS).fold(side, |down, _| {
                straighten_with_pitch(&turned(self.rotations, &self.quarters(&down)), pitch_prior)
            })
        })
    }

    /// By how many quarters each photograph has to be turned if `down` is down.
    fn quarters(&self, down: &Vector3<f64>) -> Vec<u8> {
        let of_one = |rotation: &Matrix3<f64>| {
            let seen = rotation * down;
            match seen.xy().norm() > MIN_SINE {
                true => (roll_from_down(&seen) / FRAC_PI_2).round().rem_euclid(f64::from(QUARTERS)) as u8,
                false => 0,
            }
        };
        self.rotations.iter().map(of_one).collect()
    }

    /// How improbable it is that `down` is down, as minus a logarithm and but for a constant, where most photographs
    /// have to be turned by whichever of these numbers of quarters is the least improbable.
    fn improbability(&self, down: &Vector3<f64>, stored: Range<u8>) -> f64 {
        let lit = self.lit(down);
        let storing = |stored: u8| match stored {
            0 => 0.0,
            2 => ON_HEAD,
            _ if self.is_upright_format => ON_HEAD,
            _ => ON_SIDE,
        };
        stored.map(|stored| storing(stored) + self.held(down, stored) + lit).fold(f64::INFINITY, f64::min)
    }

    /// The same of how cameras are held, if most have to be turned by `stored` quarters.
    fn held(&self, down: &Vector3<f64>, stored: u8) -> f64 {
        let of_one = |rotation: &Matrix3<f64>| {
            let seen = rotation * down;
            let (roll, sine) = (roll_from_down(&seen), seen.xy().norm());
            let turned = |quarter: u8| {
                let left = wrap_angle(roll - f64::from(quarter) * FRAC_PI_2);
                let apart = match (quarter + QUARTERS - stored) % QUARTERS {
                    0 => 0.0,
                    2 => HEAD_APART,
                    _ => QUARTER_APART,
                };
                let is_nearest = left.abs() <= FRAC_PI_4;
                is_nearest.then(|| apart + roll_square(left.sin() * sine))
            };
            let least = (0..QUARTERS).filter_map(turned).fold(TURNED, f64::min);
            least + pitch_square(seen.z)
        };
        let count = self.rotations.len() as f64;
        let mean = self.rotations.iter().map(of_one).sum::<f64>() / count;
        0.5 * count.min(INDEPENDENT) * mean
    }

    /// The same of the light.
    fn lit(&self, down: &Vector3<f64>) -> f64 {
        let level = |(rotation, slope): (&Matrix3<f64>, &Slope)| {
            let seen = (rotation * down).xy();
            let sine = seen.norm();
            (sine > MIN_SINE).then(|| {
                let below = seen / sine;
                Slope::new(slope.x * below.y - slope.y * below.x, slope.dot(&below))
            })
        };
        let levels: Vec<Slope> = self.rotations.iter().zip(self.slopes).filter_map(level).collect();
        if levels.is_empty() {
            return 0.0;
        }
        let count = levels.len() as f64;
        let mean = levels.iter().sum::<Slope>() / count;
        let students_t = |off: f64| 0.5 * (FREEDOM + 1.0) * (off * off / FREEDOM).ln_1p();
        students_t(mean.x / SIDEWAYS.0.hypot(SIDEWAYS.1 / count.sqrt()))
            + students_t((mean.y - DOWNWARD.0) / DOWNWARD.1)
    }
}

/// Cameras whose photographs were turned clockwise by so many quarters.
fn turned(rotations: &[Matrix3<f64>], quarters: &[u8]) -> Vec<Matrix3<f64>> {
    let turn = |(rotation, &quarter): (&Matrix3<f64>, &u8)| rotation_about_z(f64::from(quarter) * FRAC_PI_2) * rotation;
    rotations.iter().zip(quarters).map(turn).collect()
}

/// How much brighter and bluer a picture grows to the right and downward: the slopes of the plane that fits best over
/// its largest middle square, from there to its edge; 1 is from black to white over the whole.
fn slope(picture: &Raster<u8>) -> Slope {
    let side = picture.width().min(picture.height());
    let (left, top) = ((picture.width() - side) / 2, (picture.height() - side) / 2);
    let across = |place: usize| (2.0 * place as f64 + 1.0) / side as f64 - 1.0;
    let mut sum = Slope::zeros();
    for y in 0..side {
        for x in 0..side {
            let pixel = picture.pixel(left + x, top + y);
            let [red, green, blue] = [0, 1, 2].map(|channel| f64::from(pixel[channel.min(pixel.len() - 1)]) / 255.0);
            // Brightness by the weights of ITU-R BT.601.
            let value = 0.299 * red + 0.587 * green + 0.114 * blue + (blue - red);
            sum += Slope::new(across(x), across(y)) * value;
        }
    }
    // The mean square of what `across` takes is a third.
    sum * 3.0 / (side * side).max(1) as f64
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y};
    use trueup_core::source::WorkingFrame;

    use super::*;

    const SIZE: [usize; 2] = [16, 12];
    const PITCH_PRIOR: f64 = 0.1;
    const FRAME: WorkingFrame = WorkingFrame { width: 16.0, height: 12.0, working_from_full: 1.0 };

    /// What a camera of 53 degrees shows of a world that is `contrast` levels brighter above than at eye level, y down.
    fn picture(rotation: &Matrix3<f64>, contrast: f64) -> Raster<u8> {
        let [width, height] = SIZE;
        let mut picture = Raster::new(width, height, 3);
        for y in 0..height {
            for x in 0..width {
                let ray = Vector3::new(x as f64 - 7.5, y as f64 - 5.5, width as f64).normalize();
                let below = rotation.tr_mul(&ray).y;
                picture.pixel_mut(x, y).fill((128.0 - contrast * below) as u8);
            }
        }
        picture
    }

    /// The sides of photographs that look along these yaws, level but for a roll, degrees.
    fn sides(looks_deg: &[[f64; 2]], contrast: f64) -> Option<Vec<u8>> {
        let camera = |[yaw, roll]: &[f64; 2]| rotation_about_z(roll.to_radians()) * rotation_about_y(yaw.to_radians());
        let rotations: Vec<Matrix3<f64>> = looks_deg.iter().map(camera).collect();
        found(&rotations, contrast)
    }

    fn found(rotations: &[Matrix3<f64>], contrast: f64) -> Option<Vec<u8>> {
        let pictures: Vec<Raster<u8>> = rotations.iter().map(|rotation| picture(rotation, contrast)).collect();
        let shown = |thumbnail| ShownPhotograph { frame: &FRAME, curves: &[], thumbnail, thumbnail_frame: &FRAME };
        let shown: Vec<ShownPhotograph<'_>> = pictures.iter().map(shown).collect();
        let level = straighten_with_pitch(rotations, PITCH_PRIOR);
        Sides::found(rotations, &shown, &level, PITCH_PRIOR).map(|sides| sides.quarters)
    }

    const YAWS: [f64; 5] = [-50.0, -25.0, 0.0, 25.0, 50.0];

    /// A camera rolled by 90 degrees sees to its left what is down.
    #[test]
    fn a_row_on_its_side_is_turned() {
        for (roll, quarter) in [(-90.0, 1), (90.0, 3)] {
            let looks = YAWS.map(|yaw| [yaw, roll + 0.05 * yaw]);
            assert_eq!(sides(&looks, 200.0), Some(vec![quarter; 5]), "{roll}");
        }
    }

    #[test]
    fn some_on_their_side_are_turned() {
        let looks = [[-50.0, 2.0], [-25.0, 91.0], [0.0, -3.0], [25.0, 88.0], [50.0, 1.0]];
        assert_eq!(sides(&looks, 200.0), Some(vec![0, 3, 0, 3, 0]));
    }

    /// Without any light to tell, a whole turn is a row, and five photographs may be a column.
    #[test]
    fn a_turn_on_its_side_is_no_column() {
        let turn: [[f64; 2]; 12] = std::array::from_fn(|index| [30.0 * index as f64, 90.0]);
        let quarters = sides(&turn, 0.0).expect("no column");
        assert!(quarters.iter().all(|&quarter| quarter == quarters[0] && quarter % 2 == 1), "{quarters:?}");
        assert_eq!(sides(&YAWS.map(|yaw| [yaw, 90.0]), 0.0), None);
    }

    #[test]
    fn what_is_stored_upright_stays() {
        for contrast in [200.0, 40.0, 0.0, -120.0] {
            assert_eq!(sides(&YAWS.map(|yaw| [yaw, 0.1 * yaw]), contrast), None, "{contrast}");
            let column = [-40.0_f64, -15.0, 10.0, 35.0].map(|pitch| rotation_about_x(pitch.to_radians()));
            assert_eq!(found(&column, contrast), None, "a column, {contrast}");
        }
    }

    /// By hand: 0.5 (x + 1) of the way from black to white over the width, and no blue.
    #[test]
    fn slopes_are_those_of_a_plane() {
        let mut picture = Raster::new(40, 20, 3);
        for y in 0..20 {
            for x in 0..40 {
                let level = 255.0 * (x as f64 + 0.5) / 40.0;
                picture.pixel_mut(x, y).copy_from_slice(&[level as u8; 3]);
            }
        }
        // Its middle square has half of that.
        let slope = slope(&picture);
        assert!((slope - Slope::new(0.25, 0.0)).norm() < 5e-3, "{slope}");
    }
}
