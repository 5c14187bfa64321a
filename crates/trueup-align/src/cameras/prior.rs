//! What is known of a photograph's camera beforehand.

use nalgebra::{Matrix3, Vector3};
use trueup_core::camera::Camera;
use trueup_core::lens::{Lens, LensProjection, LensTerms, PlacedLens};
use trueup_core::source::WorkingFrame;
use trueup_core::told_lens::{TOLD_FOCAL_SD, ToldLens};

use super::options::{CameraOptions, LensKind};

/// Shortest focal length that is believed, in longer sides of the photograph: an angle of view of 118 degrees.
const MIN_FOCAL: f64 = 0.3;
/// Longest focal length that is believed, in longer sides of the photograph: an angle of view of 5.7 degrees.
const MAX_FOCAL: f64 = 10.0;
/// How far the matches may take a told focal length, as a factor: what is engraved on a lens is rounded, and focusing
/// on near things changes it.
const TOLD_FOCAL_REACH: f64 = 1.05;
/// Standard deviation of an estimated start value of the focal length, relative: it only keeps a focal length that the
/// matches leave open from running away.
const ESTIMATED_FOCAL_SD: f64 = 0.3;

/// Focal length that is expected of a photograph of which nothing is known, in its longer sides: telephones' are 0.7 to
/// 0.8, those of compact cameras and of zoom lenses as they are sold from 0.7 at their shortest to 1.5 and more.
pub const USUAL_FOCAL: f64 = 0.85;
/// Standard deviation of its logarithm: one of twenty is shorter than 0.38 or longer than 1.9.
pub(super) const USUAL_FOCAL_SD: f64 = 0.4;

/// A fisheye of which nothing more is known.
const FISHEYE: LensTerms =
    LensTerms { projection: LensProjection::Equidistant, radial: [0.0; 4], tangential: [0.0; 2] };

/// What is known of a photograph's camera beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPrior {
    /// The photograph's working frame.
    pub frame: WorkingFrame,
    /// Focal length from metadata or the user in working pixels, if any.
    pub focal_px: Option<f64>,
    /// Whether the user told the focal length.
    pub focal_told: bool,
    /// The lens in working pixels, if the user told it: nothing of it is looked for.
    pub lens: Option<PlacedLens>,
    /// Photographs with equal numbers were taken with one camera at one size and may share a focal length.
    pub camera_group: usize,
    /// Photographs with equal numbers were, as far as metadata tell, taken through one lens at one focal length, and
    /// may share what it does.
    pub lens_group: usize,
}

impl CameraPrior {
    /// A photograph of which nothing is known but that it is one of a group by one camera.
    pub fn unknown(frame: WorkingFrame, group: usize) -> Self {
        Self { frame, focal_px: None, focal_told: false, lens: None, camera_group: group, lens_group: group }
    }

    /// What is known with what `options` tell of lens and field of view.
    pub(super) fn told_by(mut self, options: &CameraOptions) -> Self {
        if options.fov > 0.0 {
            let lens = match (self.lens, options.kind_of_lens()) {
                (Some(lens), _) => Lens::new(lens.terms),
                (None, LensKind::Fisheye) => Lens::new(FISHEYE),
                (None, _) => Lens::PINHOLE,
            };
            let half = options.fov.to_radians() / 2.0;
            // The lens's own place for a ray at half the angle lies half the longer side from the middle.
            let place = lens.place(Vector3::new(half.sin(), 0.0, half.cos())).map(|place| place.norm());
            let focal_px = place.map(|place| 0.5 * self.longer() / place).filter(|focal_px| focal_px.is_finite());
            self.focal_told |= focal_px.is_some();
            self.focal_px = focal_px.or(self.focal_px);
        }
        self
    }

    /// What the user told of the lens, by an earlier project or by `options`: all that matching may go by.
    pub fn told_lens(&self, options: &CameraOptions) -> ToldLens {
        let told = self.told_by(options);
        let kind = options.kind_of_lens();
        ToldLens {
            lens: told.lens.or((kind == LensKind::Pinhole).then(PlacedLens::default)),
            projection: match kind {
                LensKind::Auto => None,
                LensKind::Pinhole | LensKind::Rectilinear => Some(LensProjection::Rectilinear),
                LensKind::Fisheye => Some(LensProjection::Equidistant),
            },
            focal_px: told.focal_px.filter(|_| told.focal_told),
        }
    }

    /// Standard deviation of the focal length that refinement starts from, relative.
    pub(super) fn focal_sd(&self, options: &CameraOptions) -> f64 {
        match (self.focal_told, self.focal_px) {
            (true, _) => TOLD_FOCAL_SD.min(options.known_focal_sd),
            (false, Some(_)) => options.known_focal_sd,
            (false, None) => ESTIMATED_FOCAL_SD,
        }
    }

    /// The focal length that is expected, working pixels: by metadata or the user, else a usual one.
    pub(super) fn expected_focal_px(&self) -> f64 {
        let known = self.focal_px.filter(|focal_px| focal_px.is_finite() && *focal_px > 0.0);
        self.believable_focal_px(known.unwrap_or(USUAL_FOCAL * self.longer()))
    }

    /// The longer side in working pixels.
    pub(super) fn longer(&self) -> f64 {
        self.frame.width.max(self.frame.height)
    }

    /// The shortest focal length in working pixels that is believed of any photograph of this size.
    pub(super) fn shortest_focal_px(&self) -> f64 {
        MIN_FOCAL * self.longer()
    }

    /// The focal length in working pixels nearest to `focal_px` that is believed for this photograph.
    pub(super) fn believable_focal_px(&self, focal_px: f64) -> f64 {
        let believed = |focal_px: f64| focal_px.clamp(self.shortest_focal_px(), MAX_FOCAL * self.longer());
        match self.focal_px.filter(|told| self.focal_told && told.is_finite()).map(believed) {
            Some(told) => believed(focal_px.clamp(told / TOLD_FOCAL_REACH, told * TOLD_FOCAL_REACH)),
            None => believed(focal_px),
        }
    }

    /// Which photographs one lens at one setting may have taken: a number for each. Those held upright are apart from
    /// those held across, whose pictures were turned: what a lens does aside turns with them. Those whose lens was told
    /// are apart from the others.
    pub(super) fn lens_groups(priors: &[Self]) -> Vec<usize> {
        let key = |prior: &Self| {
            let across = prior.frame.width >= prior.frame.height;
            (prior.camera_group, prior.lens_group, across, prior.lens.is_some())
        };
        let mut keys: Vec<_> = priors.iter().map(key).collect();
        keys.sort_unstable();
        keys.dedup();
        priors.iter().map(|prior| keys.binary_search(&key(prior)).unwrap_or(0)).collect()
    }

    /// The camera of this photograph with the rotation `camera_from_world`.
    pub(super) fn camera(&self, focal_px: f64, camera_from_world: &Matrix3<f64>) -> Camera {
        Camera::new(focal_px, self.frame.width, self.frame.height, camera_from_world)
    }

    /// The camera of this photograph with the identity rotation.
    pub(super) fn unturned_camera(&self, focal_px: f64) -> Camera {
        self.camera(focal_px, &Matrix3::identity())
    }
}
