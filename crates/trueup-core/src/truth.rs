//! What is exactly known of a set of photographs: the content of a `truth.json`.

use std::collections::BTreeSet;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::camera::Camera;
use crate::geometry::{is_rotation, matrix_from_rows};
use crate::lens::{LensProjection, LensTerms, PlacedLens};
use crate::{Error, Result};

/// What is true of a set of photographs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// What the photographs show, or what they were cut from.
    pub source: String,
    /// One a photograph, in order.
    pub images: Vec<ImageTruth>,
    /// What the world's vertical rests on; absent where it is exact, as in rendered scenes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<Level>,
}

/// Where the vertical of a set's world comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LevelOrigin {
    /// Stated by whoever described the set.
    Given,
    /// Measured from the scene's vertical lines.
    Measured,
    /// The vertical of the panorama the photographs were cut from, for want of a better one.
    Panorama,
}

/// The vertical that defines a set's world, and how sure it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Where it comes from.
    pub origin: LevelOrigin,
    /// The direction "down" in the frame of the panorama that the photographs were cut from, a unit vector.
    pub down: [f64; 3],
    /// Angle by which the measurement's two components together err, one standard deviation, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standard_error_deg: Option<f64>,
    /// Angle between the measurements on the two halves of the views, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub halves_deg: Option<f64>,
    /// Vertical lines that the measurement found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lines: Option<usize>,
    /// Why a measurement was refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

impl Level {
    /// A level without figures.
    pub fn plain(origin: LevelOrigin, down: [f64; 3]) -> Self {
        Self { origin, down, standard_error_deg: None, halves_deg: None, lines: None, reason: None }
    }

    /// Angle between the level's "down" and the panorama's own, degrees.
    pub fn tilt_deg(&self) -> f64 {
        let [x, y, z] = self.down;
        x.hypot(z).atan2(y).to_degrees()
    }
}

/// What is true of one photograph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageTruth {
    /// File name beside `truth.json`.
    pub file: String,
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Focal length, pixels.
    pub focal_px: f64,
    /// What the lens bends; absent where it is a pinhole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensTruth>,
    /// Rows of the rotation from world to camera (x right, y down, z forward; world y is down).
    #[serde(rename = "R")]
    pub rotation: [[f64; 3]; 3],
    /// Angle from the photograph's down to the world's vertical, positive towards the right, degrees.
    pub gamma_deg: f64,
    /// Center of projection in the world, metres; absent where all photographs share one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 3]>,
    /// File name of the depth map beside `truth.json`, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<String>,
}

/// What is true of a lens; terms that are not listed are 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "kebab-case", deny_unknown_fields)]
pub enum LensTruth {
    /// A rectilinear lens with D. C. Brown's terms.
    Brown {
        /// k1, k2, k3 at most, in units of the focal length.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        k: Vec<f64>,
        /// p1, p2 at most, in units of the focal length.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        p: Vec<f64>,
        /// The principal point from the photograph's middle, pixels.
        #[serde(default)]
        c: [f64; 2],
    },
    /// A fisheye: a polynomial of the angle from the axis (Kannala and Brandt).
    Fisheye {
        /// k1 to k4 at most.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        k: Vec<f64>,
        /// The principal point from the photograph's middle, pixels.
        #[serde(default)]
        c: [f64; 2],
    },
}

impl LensTruth {
    /// The lens; `None` if it has more terms than its model, or one that is no number.
    pub fn placed(&self) -> Option<PlacedLens> {
        let (projection, (radial, most), tangential, center_px) = match self {
            Self::Brown { k, p, c } => (LensProjection::Rectilinear, (k.as_slice(), 3), p.as_slice(), *c),
            Self::Fisheye { k, c } => (LensProjection::Equidistant, (k.as_slice(), 4), &[][..], *c),
        };
        let is_number = |terms: &[f64]| terms.iter().all(|term| term.is_finite());
        let is_lens = radial.len() <= most && [radial, tangential, &center_px].into_iter().all(is_number);
        let terms = LensTerms { projection, radial: padded(radial)?, tangential: padded(tangential)? };
        is_lens.then_some(PlacedLens { terms, center_px })
    }
}

/// As many terms, and zeros behind them; `None` if there are more.
fn padded<const N: usize>(terms: &[f64]) -> Option<[f64; N]> {
    (terms.len() <= N).then(|| std::array::from_fn(|k| terms.get(k).copied().unwrap_or(0.0)))
}

impl ImageTruth {
    /// The rotation from world to camera.
    pub fn camera_from_world(&self) -> Matrix3<f64> {
        matrix_from_rows(&self.rotation)
    }

    /// The camera, through its lens as far as this is one ([`Truth::check`]).
    pub fn camera(&self) -> Camera {
        let pinhole = Camera::new(self.focal_px, self.width as f64, self.height as f64, &self.camera_from_world());
        match self.lens.as_ref().and_then(LensTruth::placed) {
            Some(lens) => pinhole.through(&lens),
            None => pinhole,
        }
    }
}

impl Truth {
    /// Checks what a file may get wrong: sizes, focal lengths, angles, rotations that are none, names given twice.
    ///
    /// # Errors
    /// [`Error::Input`] about `subject` with the first photograph at fault.
    pub fn check(&self, subject: &str) -> Result<()> {
        let wrong = |reason: String| {
            Error::input(subject, reason, "Give the truth.json that was written together with the photographs.")
        };
        if self.images.is_empty() {
            return Err(wrong("it lists no photographs".to_owned()));
        }
        let mut names = BTreeSet::new();
        for image in &self.images {
            let file = &image.file;
            if !names.insert(file) {
                return Err(wrong(format!("{file} is listed twice")));
            }
            if image.width == 0 || image.height == 0 {
                return Err(wrong(format!("{file} has no size")));
            }
            if !(image.focal_px.is_finite() && image.focal_px > 0.0) {
                return Err(wrong(format!("the focal length of {file} is {}", image.focal_px)));
            }
            if image.lens.as_ref().is_some_and(|lens| lens.placed().is_none()) {
                return Err(wrong(format!("the lens of {file} has too many terms, or one that is no number")));
            }
            if !image.gamma_deg.is_finite() {
                return Err(wrong(format!("gamma_deg of {file} is no number")));
            }
            if !is_rotation(&image.camera_from_world()) {
                return Err(wrong(format!("R of {file} is no rotation")));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector3};

    use super::*;

    fn photograph(file: &str) -> ImageTruth {
        ImageTruth {
            file: file.to_owned(),
            width: 4,
            height: 3,
            focal_px: 4.0,
            lens: None,
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            gamma_deg: 0.0,
            center: None,
            depth: None,
        }
    }

    fn complaint(images: Vec<ImageTruth>) -> String {
        let truth = Truth { source: "test".to_owned(), images, level: None };
        truth.check("truth.json").map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn good_truth_passes() {
        assert_eq!(complaint(vec![photograph("a.jpg"), photograph("b.jpg")]), "");
    }

    /// By hand, f = 400: 45 degrees to the right the barrel has 400 (1 - 0.2 + 0.05) = 340 px from its center, 6 px
    /// right and 4 px above the middle; the fisheye 400 (pi/4) (1 - 0.015 (pi/4)^2) px = 311.2524 from the middle.
    #[test]
    fn a_camera_sees_through_its_lens() {
        let seen = |lens: &str| {
            let lens = serde_json::from_str(lens).expect("a lens");
            let image =
                ImageTruth { width: 800, height: 600, focal_px: 400.0, lens: Some(lens), ..photograph("a.jpg") };
            image.camera().project(Vector3::new(1.0, 0.0, 1.0)).expect("before the lens")
        };
        let barrel = seen(r#"{"model": "brown", "k": [-0.2, 0.05], "c": [6, -4]}"#);
        assert!((barrel - Vector2::new(746.0, 296.0)).norm() < 1e-9, "{barrel}");
        let fisheye = seen(r#"{"model": "fisheye", "k": [-0.015]}"#);
        assert!((fisheye - Vector2::new(711.252_4, 300.0)).norm() < 1e-3, "{fisheye}");
        assert!(serde_json::from_str::<LensTruth>(r#"{"model": "mirror"}"#).is_err());
    }

    #[test]
    fn every_fault_is_named() {
        let mirrored = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(complaint(Vec::new()).contains("no photographs"));
        assert!(complaint(vec![photograph("a.jpg"), photograph("a.jpg")]).contains("a.jpg is listed twice"));
        assert!(complaint(vec![ImageTruth { width: 0, ..photograph("a.jpg") }]).contains("no size"));
        assert!(complaint(vec![ImageTruth { focal_px: -1.0, ..photograph("a.jpg") }]).contains("focal length"));
        let many = LensTruth::Brown { k: vec![0.1; 4], p: Vec::new(), c: [0.0; 2] };
        assert!(complaint(vec![ImageTruth { lens: Some(many), ..photograph("a.jpg") }]).contains("the lens of a.jpg"));
        assert!(complaint(vec![ImageTruth { gamma_deg: f64::NAN, ..photograph("a.jpg") }]).contains("gamma_deg"));
        assert!(complaint(vec![ImageTruth { rotation: mirrored, ..photograph("a.jpg") }]).contains("no rotation"));
    }
}
