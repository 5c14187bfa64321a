//! What a Hugin project says, and its lenses as ours.

use std::f64::consts::PI;
use std::path::Path;

use nalgebra::{SMatrix, SVector};
use trueup_align::projection::Projection;
use trueup_core::inset::Inset;
use trueup_core::lens::{Lens, LensProjection, LensTerms, PlacedLens};
use trueup_core::{Error, Result};

use super::parse::{Fields, HuginLines};
use crate::project::record::{ImageRecord, ImageStatus};

/// Largest error, pixels, of our terms for a lens of Hugin's.
const MAX_LENS_ERROR_PX: f64 = 1.0;
/// Widest and tallest photograph that is believed, pixels.
const MAX_SIDE: f64 = 1e6;
/// A photograph of a Hugin project.
#[derive(Debug, Clone, PartialEq)]
pub struct HuginImage {
    /// The file, as the project names it.
    pub path: String,
    /// As stored in its file, whatever its EXIF orientation.
    pub width: usize,
    /// See `width`.
    pub height: usize,
    /// Pixels of the stored picture.
    pub focal_px: f64,
    /// Before the stored picture; nothing of a pinhole.
    pub lens: Option<PlacedLens>,
    /// What of the stored picture is left out at its sides.
    pub inset: Inset,
    /// Yaw to the right, pitch upwards and clockwise roll of the stored picture, radians.
    pub attitude: [f64; 3],
}

/// A Hugin project: the cameras, and what the panorama is drawn on.
#[derive(Debug, Clone, PartialEq)]
pub struct HuginProject {
    /// In the order of the project.
    pub images: Vec<HuginImage>,
    /// The panorama's projection; `None` for one that is not drawn here, and without a panorama.
    pub(super) projection: Option<Projection>,
    /// Pixels of the panorama per radian in its middle, if it says so.
    pub(super) px_per_radian: Option<f64>,
    /// Positions of the photographs of which parts are masked.
    pub(super) masked: Vec<usize>,
}

impl HuginProject {
    /// Whether a text looks like one, and not like a project of ours.
    pub fn is_one(text: &str, file: &Path) -> bool {
        let named = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pto"));
        named || text.trim_start_matches('\u{feff}').starts_with("# hugin project file")
    }

    /// Reads the text of `file`.
    ///
    /// # Errors
    /// [`Error::Input`] that names file and photograph if it is no Hugin project, is damaged, or holds what is not
    /// read: lenses other than rectilinear and fisheye, cameras that moved (mosaic mode), shear.
    pub fn parse(text: &str, file: &str) -> Result<Self> {
        let HuginLines { panorama, images, masked } = HuginLines::parse(text, file)?;
        let images: Vec<HuginImage> =
            images.iter().map(|fields| HuginImage::new(fields, file)).collect::<Result<_>>()?;
        let (mut projection, mut px_per_radian) = (None, None);
        if let Some(panorama) = panorama {
            let (width, angle) = (panorama.number("w"), panorama.number("v").to_radians());
            projection = match panorama.number("f") as i64 {
                0 => Some(Projection::Perspective),
                1 => Some(Projection::Cylindrical),
                2 => Some(Projection::Equirectangular),
                4 => Some(Projection::Stereographic),
                5 => Some(Projection::Mercator),
                12 | 19 => Some(Projection::Panini),
                _ => None,
            };
            let radians = match projection {
                Some(Projection::Perspective) if angle < PI => Some(2.0 * (0.5 * angle).tan()),
                Some(Projection::Cylindrical | Projection::Equirectangular | Projection::Mercator) => Some(angle),
                _ => None,
            };
            px_per_radian = radians.map(|radians| width / radians).filter(|scale| scale.is_finite() && *scale > 0.0);
        }
        Ok(Self { images, projection, px_per_radian, masked })
    }

    /// The photographs as a record of their lenses alone, as they are stored: what tells lenses of others.
    pub(crate) fn lens_records(&self) -> Vec<ImageRecord> {
        let record = |image: &HuginImage| ImageRecord {
            width: image.width,
            height: image.height,
            orientation: 1,
            status: ImageStatus::Used,
            focal_px: Some(image.focal_px),
            lens: image.lens,
            ..ImageRecord::left_out(image.path.clone(), String::new(), String::new())
        };
        self.images.iter().map(record).collect()
    }
}

impl HuginImage {
    fn new(fields: &Fields, file: &str) -> Result<Self> {
        let name = if fields.name.is_empty() { format!("line {}", fields.line) } else { fields.name.clone() };
        let wrong = |reason: String, hint: &str| Error::input(format!("{name} in {file}"), reason, hint);
        let again = "Save the project in Hugin again.";
        if fields.name.is_empty() {
            return Err(wrong("the photograph has no name".to_owned(), again));
        }
        let [width, height] = ["w", "h"].map(|side| fields.number(side));
        if ![width, height].iter().all(|side| (1.0..=MAX_SIDE).contains(side) && side.fract() == 0.0) {
            return Err(wrong(format!("{width} x {height} is no size of a photograph"), again));
        }
        let moved = ["TrX", "TrY", "TrZ"].iter().any(|name| fields.number(name) != 0.0);
        if moved {
            let hint =
                "Reset the translations in Hugin and optimise the rotations, or stitch the photographs by trueup.";
            return Err(wrong("its camera moved (TrX, TrY, TrZ), which is not read".to_owned(), hint));
        }
        if fields.number("g") != 0.0 || fields.number("t") != 0.0 {
            return Err(wrong("it is sheared (g, t), which is not read".to_owned(), "Reset g and t in Hugin."));
        }
        let projection = match fields.number("f") {
            0.0 => LensProjection::Rectilinear,
            2.0 | 3.0 => LensProjection::Equidistant,
            other => {
                let hint = "Rectilinear lenses (0) and fisheyes (2, 3) are read.";
                return Err(wrong(format!("lenses of type {other} are not read"), hint));
            }
        };
        let angle = fields.number("v").to_radians();
        let focal_px = match projection {
            LensProjection::Rectilinear if angle < PI => 0.5 * width / (0.5 * angle).tan(),
            LensProjection::Rectilinear => f64::NAN,
            LensProjection::Equidistant => width / angle,
        };
        // A record's own limits are narrower still.
        if !(focal_px > 0.01 * width && focal_px < 1e3 * width) {
            return Err(wrong(format!("{} degrees is no field of view of such a lens", fields.number("v")), again));
        }
        let polynomial = Polynomial {
            terms: ["a", "b", "c"].map(|name| fields.number(name)),
            unit_px: 0.5 * width.min(height),
            farthest_px: 0.5 * width.hypot(height),
        };
        let center_px = ["d", "e"].map(|name| fields.number(name));
        if center_px.iter().any(|offset| offset.abs() > 0.5 * width.max(height)) {
            return Err(wrong("its center (d, e) lies outside of it".to_owned(), again));
        }
        // A circle around a fisheye's picture may reach beyond it.
        let inset = fields.crop.map(|[left, right, top, bottom]| {
            Inset::from_sides(
                [left, top, width - right, height - bottom].map(|beside| beside.max(0.0).round() as usize),
            )
        });
        let inset = inset.unwrap_or_default();
        if inset.inner([width as usize, height as usize]).is_none() {
            return Err(wrong("its crop (S) leaves nothing of it".to_owned(), "Crop it less in Hugin."));
        }
        let attitude = ["y", "p", "r"].map(|name| fields.number(name).to_radians());
        let hint = "Optimise the lens again, with b alone.";
        let (terms, stretch) = polynomial
            .as_terms(projection, focal_px)
            .ok_or_else(|| wrong("its lens (a, b, c) is none that light passes one to one".to_owned(), hint))?;
        let lens = PlacedLens { terms, center_px };
        Ok(Self {
            path: fields.name.clone(),
            width: width as usize,
            height: height as usize,
            focal_px: focal_px * stretch,
            lens: (lens != PlacedLens::default()).then_some(lens),
            inset,
            attitude,
        })
    }
}

/// What a lens of Hugin's makes of a radius: see [`super::HuginLens`].
struct Polynomial {
    /// a, b and c.
    terms: [f64; 3],
    /// Unit of the radius.
    unit_px: f64,
    /// Radius of the corners.
    farthest_px: f64,
}

impl Polynomial {
    /// The radius, pixels, where the projection alone has `alone_px`.
    fn at(&self, alone_px: f64) -> f64 {
        let ([a, b, c], r) = (self.terms, alone_px / self.unit_px);
        alone_px * (1.0 - a - b - c + r * (c + r * (b + r * a)))
    }

    /// Our terms nearest to it over the photograph, by least squares, and by what the focal length grows with them;
    /// `None` if it bends light back, or our terms come nowhere near.
    fn as_terms(&self, projection: LensProjection, focal_px: f64) -> Option<(LensTerms, f64)> {
        if self.terms == [0.0; 3] {
            return Some((LensTerms { projection, ..LensTerms::default() }, 1.0));
        }
        const SAMPLES: usize = 256;
        const TERMS: usize = 5;
        // The tangent of 80 degrees, and half a turn: beyond, no light falls on a photograph.
        let limit = match projection {
            LensProjection::Rectilinear => 5.67,
            LensProjection::Equidistant => PI,
        };
        let step = limit * focal_px / 4096.0;
        let mut end = 0.0;
        while self.at(end) < self.farthest_px {
            if end >= limit * focal_px || self.at(end + step) <= self.at(end) {
                return None;
            }
            end += step;
        }
        let powers = |alone: f64| SVector::<f64, TERMS>::from_fn(|k, _| alone.powi(2 * k as i32 + 1));
        let (mut normal, mut right) = (SMatrix::<f64, TERMS, TERMS>::zeros(), SVector::<f64, TERMS>::zeros());
        // Powers of the share of the way, so that large and small ones weigh alike.
        for k in 1..=SAMPLES {
            let share = k as f64 / SAMPLES as f64;
            let of_share = powers(share);
            normal += of_share * of_share.transpose();
            right += of_share * self.at(share * end);
        }
        let fitted = normal.cholesky()?.solve(&right);
        let per_share = end / focal_px;
        let coefficient = |k: usize| fitted[k] / focal_px / per_share.powi(2 * k as i32 + 1);
        let stretch = coefficient(0);
        let terms = LensTerms {
            projection,
            radial: std::array::from_fn(|k| coefficient(k + 1) / stretch),
            tangential: [0.0; 2],
        };
        let lens = Lens::new(terms);
        let worst = (1..=SAMPLES).map(|k| {
            let alone = per_share * k as f64 / SAMPLES as f64;
            let ray = match projection {
                LensProjection::Rectilinear => nalgebra::Vector3::new(alone, 0.0, 1.0),
                LensProjection::Equidistant => nalgebra::Vector3::new(alone.sin(), 0.0, alone.cos()),
            };
            let place = lens.place(ray).map_or(f64::INFINITY, |place| place.x);
            (place * focal_px * stretch - self.at(alone * focal_px)).abs()
        });
        let worst = worst.fold(0.0, f64::max);
        (stretch > 0.0 && worst <= MAX_LENS_ERROR_PX).then_some((terms, stretch))
    }
}

#[cfg(test)]
#[path = "read_tests.rs"]
mod tests;
