//! Which longitudes photographs cover, and whether they show the horizon all round.
//!
//! A sphere is laid about the horizon where photographs show all of it, however far up or down most of them look, as a
//! drone's do: the mesh and the projection both ask here.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::wrap_angle;

/// Longitudes are counted in steps of half a degree.
const STEPS: usize = 720;
/// Latitude, radians (20 degrees), up to which a direction is near the horizon.
const NEAR_HORIZON: f64 = 0.349;
/// Samples along each side of a photograph.
pub(crate) const SAMPLES: usize = 9;

/// A set of longitudes of the level world.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Longitudes {
    covered: [bool; STEPS],
}

impl Longitudes {
    pub(crate) fn none() -> Self {
        Self { covered: [false; STEPS] }
    }

    pub(crate) fn all() -> Self {
        Self { covered: [true; STEPS] }
    }

    pub(crate) fn is_all(&self) -> bool {
        !self.covered.contains(&false)
    }

    /// Covers the longitudes between those of `directions` that are farthest to both sides of `ahead`.
    pub(crate) fn cover<'a>(&mut self, ahead: Vector3<f64>, directions: impl Iterator<Item = &'a Vector3<f64>>) {
        let center = ahead.x.atan2(ahead.z);
        let from_center = directions.map(|direction| wrap_angle(direction.x.atan2(direction.z) - center));
        let (left, right) = from_center.fold((0.0_f64, 0.0_f64), |(left, right), one| (left.min(one), right.max(one)));
        let step = |longitude: f64| (longitude / TAU * STEPS as f64).round() as i64;
        for index in step(center + left)..=step(center + right) {
            self.covered[index.rem_euclid(STEPS as i64) as usize] = true;
        }
    }

    /// How much is covered, radians, a turn where there is no gap; and the middle of it, radians to the right of
    /// straight ahead, 0 of a turn.
    pub(crate) fn span_and_middle(&self) -> (f64, f64) {
        let (start, gap) = self.widest_gap();
        let span = TAU * (STEPS - gap) as f64 / STEPS as f64;
        let middle = match gap {
            0 => 0.0,
            _ => wrap_angle((start as f64 + (gap as f64 - 1.0) / 2.0) / STEPS as f64 * TAU + PI),
        };
        (span, middle)
    }

    /// First step and length of the widest run of uncovered steps around the turn.
    fn widest_gap(&self) -> (usize, usize) {
        let Some(start) = self.covered.iter().position(|&step| step) else { return (0, STEPS) };
        let (mut best, mut run) = ((0, 0), 0);
        for offset in 1..=STEPS {
            let index = (start + offset) % STEPS;
            run = if self.covered[index] { 0 } else { run + 1 };
            if run > best.1 {
                best = ((index + STEPS + 1 - run) % STEPS, run);
            }
        }
        best
    }
}

/// Pixels spread over a photograph of this size, so many along each side, its border included.
pub(crate) fn spread_pixels(size: Vector2<f64>, count: usize) -> impl Iterator<Item = Vector2<f64>> {
    let share = move |index: usize| index as f64 / (count - 1) as f64;
    (0..count * count).map(move |index| size.component_mul(&Vector2::new(share(index % count), share(index / count))))
}

/// Whether photographs (camera and size in its pixels) that show neither pole show directions near the horizon at every
/// longitude. What shows a pole has all longitudes, but no horizon that goes round.
pub(crate) fn goes_round_horizon<'a>(
    photographs: impl Iterator<Item = (&'a Camera, [f64; 2])>,
    level_from_world: &Matrix3<f64>,
) -> bool {
    let mut longitudes = Longitudes::none();
    for (camera, size) in photographs {
        let up_or_down = level_from_world.row(1).transpose();
        if camera.shows(up_or_down, size) || camera.shows(-up_or_down, size) {
            continue;
        }
        let directions: Vec<Vector3<f64>> = spread_pixels(size.into(), SAMPLES)
            .map(|pixel| level_from_world * camera.world_direction(pixel))
            .filter(|direction| direction.y.abs() < NEAR_HORIZON.sin())
            .collect();
        if !directions.is_empty() {
            longitudes.cover(level_from_world * camera.forward(), directions.iter());
        }
    }
    longitudes.is_all()
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    /// Photographs of 800 x 600 pixels and focal length 700: 59.5 x 46.4 degrees.
    fn cameras(count: usize, step_deg: f64, pitch_deg: f64) -> Vec<Camera> {
        let camera = |k: usize| {
            let world_from_camera =
                rotation_about_y((step_deg * k as f64).to_radians()) * rotation_about_x(pitch_deg.to_radians());
            Camera::new(700.0, 800.0, 600.0, &world_from_camera.transpose())
        };
        (0..count).map(camera).collect()
    }

    fn go_round(cameras: &[Camera], level_from_world: &Matrix3<f64>) -> bool {
        goes_round_horizon(cameras.iter().map(|camera| (camera, [800.0, 600.0])), level_from_world)
    }

    /// The upper border of what looks down by 35 degrees lies 11.8 below the horizon, of what looks down by 50 it is
    /// 26.8.
    #[test]
    fn what_looks_down_goes_round_while_it_shows_the_horizon() {
        let level = Matrix3::identity();
        assert!(go_round(&cameras(8, 45.0, -35.0), &level));
        assert!(!go_round(&cameras(8, 45.0, -50.0), &level));
        assert!(!go_round(&cameras(7, 45.0, -35.0), &level) && !go_round(&[], &level));
        // Two that show the nadir tell nothing, and take nothing away.
        let with_steep = [cameras(8, 45.0, -35.0), cameras(2, 90.0, -85.0)].concat();
        assert!(go_round(&with_steep, &level) && !go_round(&cameras(4, 90.0, -85.0), &level));
    }

    /// The same in a world that lies on its side, and level once it is turned back.
    #[test]
    fn the_horizon_is_that_of_the_level_world() {
        let turn = rotation_about_z(1.2);
        let turned: Vec<Camera> = cameras(8, 45.0, -35.0)
            .iter()
            .map(|camera| Camera::new(700.0, 800.0, 600.0, &(camera.rotation() * turn)))
            .collect();
        assert!(go_round(&turned, &turn));
        assert!(!go_round(&turned, &Matrix3::identity()));
    }

    #[test]
    fn a_turn_without_one_photograph_has_a_gap() {
        let mut longitudes = Longitudes::none();
        assert_eq!(longitudes.span_and_middle().0, 0.0);
        let ahead = Vector3::z();
        let sides = [-0.5_f64, 0.5].map(|side| Vector3::new(side.sin(), 0.0, side.cos()));
        longitudes.cover(ahead, sides.iter());
        let (span, middle) = longitudes.span_and_middle();
        assert!((span - 1.0).abs() < 0.02 && middle.abs() < 0.01, "{span} about {middle}");
        assert!(Longitudes::all().is_all() && Longitudes::all().span_and_middle() == (TAU, 0.0));
    }
}
