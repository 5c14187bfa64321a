//! Where a photographer stands and points the camera.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector3};
use trueup_core::Result;
use trueup_core::camera::Camera;
use trueup_core::geometry::{roll_from_down, rotation_about_x, rotation_about_y, rotation_about_z, wrap_angle};
use trueup_core::options::StageOptions;

use crate::dice::Dice;
use crate::scene::Viewpoint;

trueup_core::options! {
    /// How a scene is photographed. Standard deviations are of normal distributions, drawn per picture.
    pub struct RigOptions("rig") {
        /// Seed of every random choice below.
        seed: u64 = 1, Allowed::Any, "";
        /// Number of pictures.
        pictures: usize = 5, between(1.0, 500.0), "pictures";
        /// Rows, one above the other; pictures fill row after row.
        rows: usize = 1, between(1.0, 20.0), "rows";
        /// Picture width.
        width: usize = 1200, between(1.0, 16384.0), "px";
        /// Picture height.
        height: usize = 900, between(1.0, 16384.0), "px";
        /// Horizontal field of view.
        hfov_deg: f64 = 55.0, between(5.0, 140.0), "degrees";
        /// Horizontal field of view of every third picture, taken at another focal length; 0 for one focal length.
        second_hfov_deg: f64 = 0.0, between(0.0, 140.0), "degrees";
        /// Turn of the middle of a row against the viewpoint's own direction, positive to the right.
        yaw_deg: f64 = 0.0, between(-360.0, 360.0), "degrees";
        /// Turn from picture to picture.
        yaw_step_deg: f64 = 26.0, between(-180.0, 180.0), "degrees";
        /// Deviation of the turn.
        yaw_sd_deg: f64 = 1.5, between(0.0, 45.0), "degrees";
        /// Elevation of the middle row, positive upwards.
        pitch_deg: f64 = 2.0, between(-80.0, 80.0), "degrees";
        /// Elevation from row to row.
        pitch_step_deg: f64 = 22.0, between(-90.0, 90.0), "degrees";
        /// Deviation of the elevation.
        pitch_sd_deg: f64 = 2.0, between(0.0, 45.0), "degrees";
        /// Deviation of the roll; 5 to 8 for a careless hand.
        roll_sd_deg: f64 = 5.0, between(0.0, 45.0), "degrees";
        /// Distance within which the camera wanders, as a share of the scene's depth: 0 for a pure rotation, 0.05 for
        /// strong parallax.
        translation_fraction: f64 = 0.01, between(0.0, 0.5), "of depth";
        /// Deviation of the exposure.
        exposure_sd: f64 = 0.15, between(0.0, 2.0), "stops";
        /// How much brighter the half of the world around the viewpoint's own direction is than the other half, as sun
        /// is than shade; every picture is then exposed for what lies in its middle. 0 for the scene's own light and
        /// one exposure.
        shade_stops: f64 = 0.0, between(0.0, 16.0), "stops";
        /// Deviation of the red and blue gains.
        white_balance_sd: f64 = 0.015, between(0.0, 0.3), "";
        /// Loss of light at the picture's corners.
        vignetting: f64 = 0.15, between(0.0, 0.9), "";
        /// Deviation of sensor noise at middle gray.
        noise: f64 = 1.2, between(0.0, 50.0), "of 255";
    }
}

/// One photograph's exactly known camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedCamera {
    /// Focal length, principal point, rotation from world to camera.
    pub camera: Camera,
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Center of projection in the world, metres.
    pub center: [f64; 3],
    /// Gain of the exposure; 1 is the scene's own.
    pub exposure: f64,
    /// What lies in shade.
    pub shade: Shade,
    /// Gains of red, green and blue.
    pub white_balance: [f64; 3],
    /// Loss of light at the corners, 0 to 1.
    pub vignetting: f64,
    /// Deviation of sensor noise at middle gray, of 255.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
}

/// Light that differs by directions, beside what the scene's own lamps and sun do: the two halves of a turn lie in sun
/// and in shade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shade {
    /// Yaw of the middle of the sunlit half, radians, positive to the right of the world's z.
    pub sun_yaw: f64,
    /// Stops between sun and shade.
    pub stops: f64,
}

impl Shade {
    /// The same light everywhere.
    pub const NONE: Self = Self { sun_yaw: 0.0, stops: 0.0 };

    /// Gain of the light that comes from `direction` of the world: half of the stops more in the sun, half less in the
    /// shade.
    pub fn gain(&self, direction: &Vector3<f64>) -> f64 {
        /// Half of the angle over which sun goes over into shade, radians: about a third of an ordinary photograph.
        const PENUMBRA: f64 = 0.15;
        if self.stops == 0.0 {
            return 1.0;
        }
        let off = wrap_angle(direction.x.atan2(direction.z) - self.sun_yaw);
        let share = ((FRAC_PI_2 - off.abs()) / PENUMBRA).clamp(-1.0, 1.0);
        (self.stops * 0.5 * share).exp2()
    }
}

impl PosedCamera {
    /// A level camera at `center` looking along world z turned by `yaw_deg`, with plain exposure and no noise.
    pub fn level(center: [f64; 3], yaw_deg: f64, width: usize, height: usize, hfov_deg: f64) -> Self {
        let focal_px = focal_px(width, hfov_deg);
        let rotation = camera_from_world(yaw_deg, 0.0, 0.0);
        Self {
            camera: Camera::new(focal_px, width as f64, height as f64, &rotation),
            width,
            height,
            center,
            exposure: 1.0,
            shade: Shade::NONE,
            white_balance: [1.0; 3],
            vignetting: 0.0,
            noise: 0.0,
            seed: 0,
        }
    }

    /// The pixel of a point of the world, metres; `None` behind the camera.
    pub fn project(&self, point: [f64; 3]) -> Option<[f64; 2]> {
        let bearing = self.camera.rotation() * (Vector3::from(point) - Vector3::from(self.center));
        self.camera.project(bearing).map(Into::into)
    }

    /// The angle at which the world's vertical shows in the picture: from the picture's down towards its right,
    /// radians. Turning the picture clockwise by it puts the vertical upright.
    pub fn vertical_angle(&self) -> f64 {
        roll_from_down(&(self.camera.rotation() * Vector3::y()))
    }
}

/// Focal length of a picture of this width and horizontal field of view.
pub(crate) fn focal_px(width: usize, hfov_deg: f64) -> f64 {
    width as f64 / 2.0 / (hfov_deg.to_radians() / 2.0).tan()
}

/// The rotation of a camera turned to the right by `yaw_deg`, then lifted by `pitch_deg`, then rolled clockwise by
/// `roll_deg`.
pub fn camera_from_world(yaw_deg: f64, pitch_deg: f64, roll_deg: f64) -> Matrix3<f64> {
    let world_from_camera = rotation_about_y(yaw_deg.to_radians())
        * rotation_about_x(pitch_deg.to_radians())
        * rotation_about_z(roll_deg.to_radians());
    world_from_camera.transpose()
}

/// The cameras of a hand-held panorama from a viewpoint.
///
/// # Errors
/// [`trueup_core::Error::Options`] listing every option outside its range.
pub fn rig(options: &RigOptions, viewpoint: &Viewpoint) -> Result<Vec<PosedCamera>> {
    options.check()?;
    let columns = options.pictures.div_ceil(options.rows);
    Ok((0..options.pictures).map(|index| posed(options, viewpoint, index, columns)).collect())
}

fn posed(options: &RigOptions, viewpoint: &Viewpoint, index: usize, columns: usize) -> PosedCamera {
    // Narrower than this no option allows; 0 means "none".
    const NO_SECOND_DEG: f64 = 5.0;
    let mut dice = Dice::new(options.seed, 0x5249_4700 + index as u64);
    let (row, column) = (index / columns, index % columns);
    let from_middle = |k: usize, count: usize| k as f64 - (count as f64 - 1.0) / 2.0;
    let yaw = viewpoint.yaw_deg
        + options.yaw_deg
        + options.yaw_step_deg * from_middle(column, columns)
        + options.yaw_sd_deg * dice.normal();
    let pitch = options.pitch_deg
        + options.pitch_step_deg * from_middle(row, options.rows)
        + options.pitch_sd_deg * dice.normal();
    let roll = options.roll_sd_deg * dice.normal();
    let reach = options.translation_fraction * viewpoint.depth_m;
    let wander = in_ball(&mut dice) * reach;
    let second = options.second_hfov_deg >= NO_SECOND_DEG && index % 3 == 2;
    let hfov_deg = if second { options.second_hfov_deg } else { options.hfov_deg };
    let center = Vector3::from(viewpoint.eye) + wander;
    let shade = Shade { sun_yaw: (viewpoint.yaw_deg + options.yaw_deg).to_radians(), stops: options.shade_stops };
    let rotation = camera_from_world(yaw, pitch, roll);
    let metered = shade.gain(&rotation.row(2).transpose());
    let exposure = (options.exposure_sd * dice.normal()).exp2() / metered;
    let white_balance =
        [1.0 + options.white_balance_sd * dice.normal(), 1.0, 1.0 + options.white_balance_sd * dice.normal()];
    let plain = PosedCamera::level(center.into(), 0.0, options.width, options.height, hfov_deg);
    let mut camera = plain.camera;
    camera.set_rotation(&rotation);
    PosedCamera {
        camera,
        exposure,
        shade,
        white_balance,
        vignetting: options.vignetting,
        noise: options.noise,
        seed: dice.bits(),
        ..plain
    }
}

/// Uniform in the unit ball, by rejection.
fn in_ball(dice: &mut Dice) -> Vector3<f64> {
    loop {
        let point = Vector3::new(dice.range(-1.0, 1.0), dice.range(-1.0, 1.0), dice.range(-1.0, 1.0));
        if point.norm_squared() <= 1.0 {
            return point;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Eight stops: sixteen times as much light in the middle of the sun, a sixteenth opposite, the scene's own at the
    /// edge; exposures undo it.
    #[test]
    fn sun_and_shade_lie_stops_apart_and_each_picture_is_exposed_for_its_own() {
        let shade = Shade { sun_yaw: 0.5, stops: 8.0 };
        let gain = |yaw: f64| shade.gain(&Vector3::new(yaw.sin(), 0.3, yaw.cos()));
        assert!((gain(0.5) - 16.0).abs() < 1e-12 && (gain(0.5 + PI) - 1.0 / 16.0).abs() < 1e-12);
        assert!((gain(0.5 + FRAC_PI_2) - 1.0).abs() < 1e-9 && (gain(0.5 - FRAC_PI_2 + 0.075) - 4.0).abs() < 1e-9);
        assert_eq!(Shade::NONE.gain(&Vector3::x()), 1.0);
        let viewpoint = Viewpoint { eye: [0.0; 3], yaw_deg: 10.0, depth_m: 5.0 };
        let options = RigOptions {
            shade_stops: 8.0,
            exposure_sd: 0.0,
            yaw_step_deg: 36.0,
            pictures: 10,
            ..RigOptions::default()
        };
        let cameras = rig(&options, &viewpoint).expect("options in their ranges");
        let stops = |k: usize| cameras[k].exposure.log2();
        assert!((stops(4) + 4.0).abs() < 1e-9 && (stops(0) - 4.0).abs() < 1e-9, "{} {}", stops(4), stops(0));
    }
}
