//! The lens of other photographs, as an earlier project, or one of Hugin's, found it, told of the photographs at hand.
//!
//! A lens belongs to a camera and a size: it is told of photographs of the same shape, whatever their pixels, that no
//! metadata tell to be of another camera. What it does aside turns with a photograph that was held upright.

use std::path::Path;

use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::lens::PlacedLens;
use trueup_core::source::{FocalPrior, FocalSource, SourceImage};
use trueup_core::{Error, Result, StageContext};

use crate::project::HuginProject;
use crate::project::record::{ImageRecord, Project};

/// Recorded focal lengths, in longer sides, that are believed: from beyond any fisheye to beyond any telescope.
const FOCAL: std::ops::RangeInclusive<f64> = 0.1..=100.0;
/// Farthest recorded principal point from the middle, in longer sides, that is believed.
const FARTHEST_CENTER: f64 = 0.25;
/// Relative difference of two quotients of long and short side that is rounding.
const SAME_SHAPE: f64 = 0.005;
/// Spread of recorded focal lengths, as a logarithm, up to which they are of one setting: what estimates scatter by.
const ONE_SETTING: f64 = 0.03;
/// Difference, as a logarithm, of a zoom's recorded setting from the focal length that a file states; what files state
/// is off by a few percent.
const NEAREST_SETTING: f64 = 0.1;

/// The lens of one recorded photograph, for a picture whose longer side is 1, as the sensor saw it.
#[derive(Debug, Clone, PartialEq)]
struct KnownLens {
    /// Long over short side.
    shape: f64,
    camera: Option<String>,
    /// In longer sides.
    focal: f64,
    lens: PlacedLens,
}

impl KnownLens {
    fn of(record: &ImageRecord) -> Option<Self> {
        // Other photographs are told apart by the pictures in their files, before what lies beside them is known.
        let [width, height] = record.inset.outer([record.width, record.height]);
        let (long, short) = (width.max(height) as f64, width.min(height) as f64);
        let focal = record.focal_px? / long;
        let turned = Held::of(record.orientation, width, height);
        let lens = record.lens.unwrap_or_default();
        let ([x, y], [right, down]) = (lens.center_px, record.inset.offset());
        let lens = turned.back(&PlacedLens { center_px: [x + right, y + down], ..lens }).scaled(1.0 / long);
        let shape = long / short;
        let is_sane = FOCAL.contains(&focal)
            && shape.is_finite()
            && lens.center_px.iter().all(|offset| offset.abs() <= FARTHEST_CENTER);
        is_sane.then(|| Self { shape, camera: record.camera.clone(), focal, lens })
    }

    /// Whether it may have taken this photograph.
    fn suits(&self, image: &SourceImage) -> bool {
        let shape = image.width.max(image.height) as f64 / image.width.min(image.height) as f64;
        let is_other = matches!((&self.camera, &image.camera_model), (Some(one), Some(other)) if one != other);
        (shape / self.shape - 1.0).abs() < SAME_SHAPE && !is_other
    }

    fn tell(&self, image: &mut SourceImage) {
        let long = image.width.max(image.height) as f64;
        let held = Held::of(image.orientation, image.width, image.height);
        image.focal_prior = Some(FocalPrior { focal_px: self.focal * long, source: FocalSource::Project });
        image.lens = Some(held.forth(&self.lens.scaled(long)));
    }
}

/// How a photograph's pixels are turned against the sensor's, as far as that is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Held {
    /// Clockwise by so many quarters.
    Turned(u8),
    /// Somehow: nothing is known of what lies aside.
    Somehow,
}

impl Held {
    fn of(orientation: u8, width: usize, height: usize) -> Self {
        match orientation {
            6 => Self::Turned(1),
            3 => Self::Turned(2),
            8 => Self::Turned(3),
            // Sensors are wider than tall: what is upright without a tag was turned by a program, either way.
            0 | 1 if width >= height => Self::Turned(0),
            _ => Self::Somehow,
        }
    }

    /// The lens before the sensor's picture, of that before the photograph.
    fn back(self, lens: &PlacedLens) -> PlacedLens {
        match self {
            Self::Turned(quarters) => lens.turned((4 - quarters) % 4),
            Self::Somehow => centered(lens),
        }
    }

    /// The lens before the photograph, of that before the sensor's picture.
    fn forth(self, lens: &PlacedLens) -> PlacedLens {
        match self {
            Self::Turned(quarters) => lens.turned(quarters),
            Self::Somehow => centered(lens),
        }
    }
}

/// What a lens does all around alike.
fn centered(lens: &PlacedLens) -> PlacedLens {
    let mut centered = PlacedLens { center_px: [0.0; 2], ..*lens };
    centered.terms.tangential = [0.0; 2];
    centered
}

/// Tells `images` the lenses of the project in the file `path`. Says of which photographs it knows none.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read; [`Error::Input`] if it is no project, or knows no lens for any photograph.
pub(crate) fn tell_lenses(path: &Path, images: &mut [SourceImage], context: &StageContext) -> Result<()> {
    let file = path.display().to_string();
    let hint = "Give a file that `trueup stitch --project` wrote, or a project of Hugin's (.pto).";
    let text = trueup_io::text::read_named(path, hint)?;
    let known = match HuginProject::is_one(&text, path) {
        true => HuginProject::parse(&text, &file)?.lens_records().iter().filter_map(KnownLens::of).collect(),
        false => known_by(&Project::from_json(&text, &file)?, &file)?,
    };
    let mut untold = Vec::new();
    for (photograph, image) in images.iter_mut().enumerate() {
        match lens_for(&known, image) {
            Ok(lens) => lens.tell(image),
            Err(reason) => untold.push((photograph, reason)),
        }
    }
    if let Some((_, reason)) = untold.first().filter(|_| untold.len() == images.len()) {
        let hint = "Give a project of photographs through the same lens, in the same shape.";
        return Err(Error::input(&file, format!("it tells the lens of none of the photographs: {reason}"), hint));
    }
    for (photograph, reason) in untold {
        context.report(Diagnostic::warning(
            "lens-not-told",
            Subject::Photograph(photograph),
            format!("{file} does not tell its lens: {reason}"),
            "Stitch photographs of one lens together, or leave --lens-from out.",
        ));
    }
    Ok(())
}

/// The lenses that a project of ours knows.
fn known_by(project: &Project, file: &str) -> Result<Vec<KnownLens>> {
    if project.flat_scene.is_some_and(|scene| scene.evidence.straight_on) {
        return Err(Error::input(
            file,
            "its photographs look straight at a flat scene, as a scanner does, which tells of no lens",
            "Give a project of photographs through the same lens that a camera took, turning or tilted.",
        ));
    }
    Ok(project.used_images().filter_map(KnownLens::of).collect())
}

/// The lens among those known that took a photograph, or why none did.
fn lens_for<'a>(known: &'a [KnownLens], image: &SourceImage) -> std::result::Result<&'a KnownLens, &'static str> {
    let mut suited: Vec<&KnownLens> = known.iter().filter(|lens| lens.suits(image)).collect();
    suited.sort_by(|one, other| one.focal.total_cmp(&other.focal));
    let [shortest, .., longest] = suited[..] else {
        return suited.first().copied().ok_or("there is no photograph of its camera and shape");
    };
    if (longest.focal / shortest.focal).ln() < ONE_SETTING {
        return Ok(suited[suited.len() / 2]);
    }
    let stated = image.focal_prior.map(|prior| prior.focal_px / image.width.max(image.height) as f64);
    let stated = stated.ok_or("there are several focal lengths, and the file does not say which is its own")?;
    let apart = |lens: &KnownLens| (lens.focal / stated).ln().abs();
    let nearest = suited.into_iter().min_by(|one, other| apart(one).total_cmp(&apart(other)));
    nearest.filter(|lens| apart(lens) < NEAREST_SETTING).ok_or("none of its focal lengths is that of the file")
}

#[cfg(test)]
#[path = "lens_from_tests.rs"]
mod tests;
