//! What is told of a lens before anything is matched.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::camera::Camera;
use crate::lens::{LensProjection, PlacedLens, TriedLens, tried_lenses};
use crate::source::WorkingFrame;

/// Standard deviation of a focal length that the user told, relative: what is engraved on a lens is rounded, and
/// focusing on near things changes it.
pub const TOLD_FOCAL_SD: f64 = 0.02;

/// What the user told of the lens of a photograph; nothing by default. Metadata tell nothing here: what they say of
/// focal lengths is off by up to a tenth.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ToldLens {
    /// All that the lens does, in working pixels.
    pub lens: Option<PlacedLens>,
    /// Its projection, where no more is told of what it does.
    pub projection: Option<LensProjection>,
    /// Its focal length in working pixels.
    pub focal_px: Option<f64>,
}

impl ToldLens {
    /// Whether what the lens does is known wholly.
    pub fn is_whole(&self) -> bool {
        self.lens.is_some() && self.focal_px.is_some()
    }

    /// Whether it is a pinhole, at any focal length.
    pub fn is_pinhole(&self) -> bool {
        self.lens.is_some_and(|lens| lens == PlacedLens::default())
    }

    /// The unturned camera of a photograph that is told so, and `tried` for what is not told; `None` where that
    /// contradicts what is told.
    pub fn camera(&self, tried: &TriedLens, frame: &WorkingFrame) -> Option<Camera> {
        let focal_px = self.focal_px.unwrap_or(tried.relative_focal * frame.width.max(frame.height));
        let pinhole = Camera::new(focal_px, frame.width, frame.height, &Matrix3::identity());
        match self.lens {
            Some(lens) => Some(pinhole.through(&lens)),
            None if self.projection.is_some_and(|told| told != tried.lens.terms().projection) => None,
            None => Some(Camera { lens: tried.lens, ..pinhole }),
        }
    }
}

/// The cameras worth trying on two photographs, unturned: what is told of them, and all [`tried_lenses`] for what is
/// not, the same through both as far as it is not told.
pub fn tried_cameras(told: [&ToldLens; 2], frames: [&WorkingFrame; 2]) -> Vec<[Camera; 2]> {
    let mut cameras: Vec<[Camera; 2]> = Vec::new();
    for tried in tried_lenses() {
        let both = [told[0].camera(&tried, frames[0]), told[1].camera(&tried, frames[1])];
        if let [Some(a), Some(b)] = both
            && !cameras.contains(&[a, b])
        {
            cameras.push([a, b]);
        }
    }
    cameras
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::LensTerms;

    const FRAME: WorkingFrame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };

    #[test]
    fn what_is_told_is_not_tried_otherwise() {
        let nothing = ToldLens::default();
        let all = tried_lenses().len();
        assert_eq!(tried_cameras([&nothing; 2], [&FRAME; 2]).len(), all);
        let terms = LensTerms { radial: [-0.1, 0.0, 0.0, 0.0], ..LensTerms::default() };
        let whole = ToldLens {
            lens: Some(PlacedLens { terms, center_px: [6.0, -4.0] }),
            focal_px: Some(500.0),
            ..ToldLens::default()
        };
        let [[a, b]] = tried_cameras([&whole; 2], [&FRAME; 2])[..] else { panic!("one") };
        assert_eq!((a, a.focal_px, a.principal_point, a.lens.terms()), (b, 500.0, [406.0, 296.0], terms));
        // Of one photograph: every lens is tried on the other.
        let one_sided = tried_cameras([&whole, &nothing], [&FRAME; 2]);
        assert_eq!(one_sided.len(), all);
        assert!(one_sided.iter().all(|[one, _]| *one == a));
    }

    #[test]
    fn a_fisheye_is_no_other_lens_and_a_focal_length_no_other() {
        let fisheye = ToldLens { projection: Some(LensProjection::Equidistant), ..ToldLens::default() };
        let tried = tried_cameras([&fisheye; 2], [&FRAME; 2]);
        assert!(!tried.is_empty() && tried.iter().flatten().all(|camera| camera.lens.is_fisheye()));
        let of_400_px = ToldLens { focal_px: Some(400.0), ..ToldLens::default() };
        let tried = tried_cameras([&of_400_px; 2], [&FRAME; 2]);
        // Three rectilinear lenses and a fisheye are listed.
        assert_eq!(tried.len(), 4);
        assert!(tried.iter().flatten().all(|camera| camera.focal_px == 400.0));
    }
}
