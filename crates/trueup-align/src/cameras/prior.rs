//! What is known of a photograph's camera beforehand.

use nalgebra::Matrix3;
use trueup_core::camera::Camera;
use trueup_core::source::WorkingFrame;

/// Shortest focal length that is believed, in longer sides of the photograph: an angle of view of 118 degrees.
const MIN_FOCAL: f64 = 0.3;
/// Longest focal length that is believed, in longer sides of the photograph: an angle of view of 5.7 degrees.
const MAX_FOCAL: f64 = 10.0;

/// What is known of a photograph's camera beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPrior {
    /// The photograph's working frame.
    pub frame: WorkingFrame,
    /// Focal length from metadata in working pixels, if any.
    pub focal_px: Option<f64>,
    /// Photographs with equal numbers were taken with one camera at one size and may share a focal length.
    pub camera_group: usize,
}

impl CameraPrior {
    /// The focal length in working pixels nearest to `focal_px` that is believed for a photograph of this size.
    pub(super) fn believable_focal_px(&self, focal_px: f64) -> f64 {
        let longer = self.frame.width.max(self.frame.height);
        focal_px.clamp(MIN_FOCAL * longer, MAX_FOCAL * longer)
    }

    /// Which photographs one lens at one setting may have taken: a number for each. Those held upright are apart from those
    /// held across, whose pictures were turned: what a lens does aside turns with them.
    pub(super) fn lens_groups(priors: &[Self]) -> Vec<usize> {
        let key = |prior: &Self| (prior.camera_group, prior.frame.width >= prior.frame.height);
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
