//! Which views to cut: the content of a spec file.

use std::fs;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use trueup_core::geometry::exp_rotation;
use trueup_core::truth::{Level, LevelOrigin};
use trueup_core::{Error, Result};

use crate::rig::{camera_from_world, focal_px};

use super::view::PinholeView;

/// Largest width and height of a view, as of a rendered picture; pixels.
const MAX_SIDE_PX: usize = 16_384;
/// Smallest and largest horizontal field of view, degrees.
const HFOV_DEG: [f64; 2] = [5.0, 150.0];
/// Largest gain.
const MAX_GAIN: f64 = 16.0;
/// Largest deviation of noise, gray levels of 255.
const MAX_NOISE: f64 = 255.0;
/// Largest yaw and roll, degrees: more turns than anyone means.
const MAX_TURN_DEG: f64 = 3600.0;
/// How far `down` of a spec and of its `level` may differ, degrees: what printing to six digits loses.
const SAME_DOWN_DEG: f64 = 1e-3;

/// Which views to cut out of a panorama. In a file: JSON, unknown fields denied.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CutSpec {
    /// The panorama that the spec was made for: its file name without extension.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pano: Option<String>,
    /// Where the scene's vertical points in the panorama's own frame, of any length; measured when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub down: Option<[f64; 3]>,
    /// What `down` rests on; goes into the truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<Level>,
    /// Width of the views, 1 to 16384 px.
    pub width: usize,
    /// Height of the views, 1 to 16384 px.
    pub height: usize,
    /// Horizontal field of view, 5 to 150 degrees.
    pub hfov_deg: f64,
    /// The views, in the order of their file names.
    pub views: Vec<ViewSpec>,
}

/// One view. Angles are in degrees and turn the camera in the panorama's own frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewSpec {
    /// Turn to the right.
    pub yaw: f64,
    /// Elevation, positive upwards, -90 to 90.
    #[serde(default)]
    pub pitch: f64,
    /// Clockwise roll of the camera.
    #[serde(default)]
    pub roll: f64,
    /// Factor on the encoded values, above 0 up to 16.
    #[serde(default = "unit_gain")]
    pub gain: f64,
    /// Standard deviation of noise added to the encoded values, 0 to 255 gray levels.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub noise: f64,
    /// Horizontal field of view, where it differs from the spec's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hfov_deg: Option<f64>,
    /// Width, where it differs from the spec's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<usize>,
    /// Height, where it differs from the spec's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<usize>,
}

fn unit_gain() -> f64 {
    1.0
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Default for ViewSpec {
    /// Straight ahead, as bright as the panorama, without noise.
    fn default() -> Self {
        Self { yaw: 0.0, pitch: 0.0, roll: 0.0, gain: 1.0, noise: 0.0, hfov_deg: None, width: None, height: None }
    }
}

impl CutSpec {
    /// Reads a spec and checks it.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read; [`Error::Input`] naming what is wrong in it.
    pub fn read(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).map_err(|error| Error::io("reading", path, error))?;
        let subject = path.display().to_string();
        let spec: Self = serde_json::from_str(&text).map_err(|error| {
            Error::input(&subject, format!("it is no spec of views ({error})"), "Make one with `trueup-scenes specs`.")
        })?;
        spec.check(&subject)?;
        Ok(spec)
    }

    /// Writes the spec as JSON.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, path: &Path) -> Result<()> {
        let failed = |error| Error::io("writing", path, error);
        let text = serde_json::to_string_pretty(self).map_err(|error| failed(std::io::Error::other(error)))?;
        fs::write(path, text + "\n").map_err(failed)
    }

    /// Sets the vertical and what it rests on.
    pub fn set_level(&mut self, level: Level) {
        self.down = Some(level.down);
        self.level = Some(level);
    }

    /// The vertical the spec states, `down` made a unit vector; `None` where it is to be measured.
    pub fn given_level(&self) -> Option<Level> {
        let down = Vector3::from(self.down?).normalize().into();
        let stated = self.level.clone().unwrap_or_else(|| Level::plain(LevelOrigin::Given, down));
        Some(Level { down, ..stated })
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Input`] about `subject` with the first number at fault and its range.
    pub fn check(&self, subject: &str) -> Result<()> {
        let wrong = |reason: String| Err(Error::input(subject, reason, "Correct the spec."));
        if let Some(reason) = self.wrong_down() {
            return wrong(reason);
        }
        if self.views.is_empty() {
            return wrong("it lists no views".to_owned());
        }
        for (index, view) in self.views.iter().enumerate() {
            if let Some(reason) = self.wrong_view(view) {
                return wrong(format!("views[{index}]: {reason}"));
            }
        }
        Ok(())
    }

    fn wrong_down(&self) -> Option<String> {
        let Some(down) = self.down else {
            return self.level.as_ref().map(|_| "it has a level but no down".to_owned());
        };
        // A direction that is not finite fails these comparisons too.
        let down = Vector3::from(down);
        if !(down.norm().is_finite() && down.y > 0.0) {
            let [x, y, z]: [f64; 3] = down.into();
            return Some(format!("down is [{x}, {y}, {z}], but must point below the panorama's horizon (y above 0)"));
        }
        let level = Vector3::from(self.level.as_ref()?.down);
        let apart = down.cross(&level).norm().atan2(down.dot(&level)).to_degrees();
        (apart.is_nan() || apart > SAME_DOWN_DEG || !level.norm().is_finite())
            .then(|| format!("level.down is {apart} degrees from down; both must be the same direction"))
    }

    fn wrong_view(&self, view: &ViewSpec) -> Option<String> {
        let outside = |value: f64, [min, max]: [f64; 2]| !(min..=max).contains(&value);
        let (width, height) = self.size(view);
        let [narrowest, widest] = HFOV_DEG;
        let turns = [("yaw", view.yaw, MAX_TURN_DEG), ("pitch", view.pitch, 90.0), ("roll", view.roll, MAX_TURN_DEG)];
        if let Some((name, value, limit)) = turns.into_iter().find(|&(_, value, limit)| outside(value, [-limit, limit]))
        {
            return Some(format!("{name} is {value}, but must be from -{limit} to {limit} degrees"));
        }
        if outside(self.hfov_deg(view), HFOV_DEG) {
            return Some(format!("hfov_deg is {}, but must be from {narrowest} to {widest}", self.hfov_deg(view)));
        }
        if !(1..=MAX_SIDE_PX).contains(&width) || !(1..=MAX_SIDE_PX).contains(&height) {
            return Some(format!("the size is {width} x {height}, but each side must have 1 to {MAX_SIDE_PX} px"));
        }
        if outside(view.gain, [f64::MIN_POSITIVE, MAX_GAIN]) {
            return Some(format!("gain is {}, but must be above 0 and at most {MAX_GAIN}", view.gain));
        }
        if outside(view.noise, [0.0, MAX_NOISE]) {
            return Some(format!("noise is {}, but must be from 0 to {MAX_NOISE}", view.noise));
        }
        None
    }

    fn size(&self, view: &ViewSpec) -> (usize, usize) {
        (view.width.unwrap_or(self.width), view.height.unwrap_or(self.height))
    }

    fn hfov_deg(&self, view: &ViewSpec) -> f64 {
        view.hfov_deg.unwrap_or(self.hfov_deg)
    }

    /// The pinhole camera of a view, in the panorama's frame.
    pub(super) fn camera_of(&self, view: &ViewSpec) -> PinholeView {
        let (width, height) = self.size(view);
        let rotation = camera_from_world(view.yaw, view.pitch, view.roll);
        PinholeView::new(width, height, focal_px(width, self.hfov_deg(view)), &rotation)
    }
}

/// The rotation from the panorama's frame to the world: the shortest turn that takes `down`, of any length, to y.
pub fn world_from_panorama(down: &Vector3<f64>) -> Matrix3<f64> {
    let across = down.cross(&Vector3::y());
    let angle = across.norm().atan2(down.y);
    across.try_normalize(0.0).map_or_else(Matrix3::identity, |axis| exp_rotation(&(axis * angle)))
}
