//! What is known of a photograph before its pixels are looked at, and how pixels are asked for.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::carrier::CarrierParts;
use crate::color::{LightRange, TransferCurve};
use crate::error::Result;
use crate::inset::Inset;
use crate::lens::PlacedLens;
use crate::mask::Masks;
use crate::outline::Outline;
use crate::raster::Photograph;

/// Where a focal length came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FocalSource {
    /// EXIF FocalLengthIn35mmFilm.
    Equivalent35mm,
    /// EXIF FocalLength with the sensor's size from the focal plane resolution tags.
    FocalPlaneResolution,
    /// EXIF FocalLength with the sensor's size from the camera's model.
    CameraModel,
    /// The user, by an earlier project with the same lens.
    Project,
}

/// A focal length known before the photographs are compared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FocalPrior {
    /// Focal length in pixels of the full-resolution photograph.
    pub focal_px: f64,
    /// Where it came from.
    pub source: FocalSource,
}

/// Where a recorded vertical came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GravitySource {
    /// The acceleration vector in the maker note of Apple's telephones.
    AppleAcceleration,
    /// The angles of the gimbal in the XMP of DJI's drones and hand cameras.
    DjiGimbal,
    /// PosePitchDegrees and PoseRollDegrees of Google's photo sphere XMP.
    PhotoSpherePose,
}

/// Which way was down when a photograph was taken, as its camera recorded it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RecordedGravity {
    /// Unit vector toward the ground in the camera frame of the photograph as it is shown: x right, y down, z forward.
    pub down: [f64; 3],
    /// Where it came from.
    pub source: GravitySource,
}

/// What a camera recorded of how a photograph was exposed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RecordedExposure {
    /// How much light the same scene came to, in stops: the logarithm to base 2 of exposure time in seconds times
    /// sensitivity (ISO) over the square of the f-number. `None` if one of them is missing or impossible.
    pub stops: Option<f64>,
    /// When it was taken, to the fraction of a second that is stated: text that differs between two moments.
    pub taken: Option<String>,
}

/// A photograph the user gave: file, size and what its metadata say. The paper's I_i.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SourceImage {
    /// The file as the user named it.
    pub path: PathBuf,
    /// Short name for messages: the file's name, or enough of the path to be unique among the inputs.
    pub name: String,
    /// Width in pixels after orientation, without what lies beside the photograph.
    pub width: usize,
    /// Height in pixels after orientation, without what lies beside the photograph.
    pub height: usize,
    /// What of the picture in the file lies beside the photograph, after orientation: it is cut off on decoding.
    #[serde(default)]
    pub inset: Inset,
    /// Inside of what the photograph lies, in pixels of width and height, where these hold more than it: what is beside
    /// it becomes transparent on decoding.
    #[serde(default)]
    pub outline: Option<Outline>,
    /// Where it shows what carries the camera, in pixels of width and height: not looked at, and not shown where
    /// another photograph can be.
    #[serde(default)]
    pub carrier: Option<CarrierParts>,
    /// EXIF orientation (1 to 8) that is applied on decoding: 1 where the tag is absent or stale.
    pub orientation: u8,
    /// Focal length from metadata, if believable.
    pub focal_prior: Option<FocalPrior>,
    /// Camera make and model, trimmed, if stated; photographs of one camera share a focal length where none is stated.
    pub camera_model: Option<String>,
    /// The lens's model, trimmed, if stated; photographs of different lenses share nothing.
    pub lens_model: Option<String>,
    /// The lens's focal length in millimeters, if stated; a zoom does not bend alike at different ones.
    pub focal_mm: Option<f64>,
    /// How it was exposed, as far as the file says.
    #[serde(default)]
    pub exposure: RecordedExposure,
    /// Which way was down, if the camera recorded it.
    #[serde(default)]
    pub gravity: Option<RecordedGravity>,
    /// The lens, in pixels of the full-resolution photograph, if the user told it by an earlier project.
    pub lens: Option<PlacedLens>,
    /// Whether its samples are floating point numbers: linear light.
    #[serde(default)]
    pub is_float: bool,
    /// The light that it is handed out in, where its samples are floating point numbers and what is brighter than white
    /// is kept; `None` where 1 is white.
    #[serde(default)]
    pub light: Option<LightRange>,
    /// The other exposures of the stack whose reference this is: its pixels are those of all, fused or merged. Empty
    /// for a photograph of one file.
    #[serde(default)]
    pub stack: Vec<StackMember>,
}

impl SourceImage {
    /// A picture of which nothing is known but its file and its size.
    pub fn unknown(path: impl Into<PathBuf>, name: impl Into<String>, [width, height]: [usize; 2]) -> Self {
        Self {
            path: path.into(),
            name: name.into(),
            width,
            height,
            inset: Inset::default(),
            outline: None,
            carrier: None,
            orientation: 1,
            focal_prior: None,
            camera_model: None,
            lens_model: None,
            focal_mm: None,
            exposure: RecordedExposure::default(),
            gravity: None,
            lens: None,
            is_float: false,
            light: None,
            stack: Vec::new(),
        }
    }

    /// Width and height of the picture in the file, after orientation.
    pub fn picture_size(&self) -> [usize; 2] {
        self.inset.outer([self.width, self.height])
    }

    /// The photograph that lies in this picture inside `inset`, with what is known of its lens; `None` if nothing is
    /// left of it.
    ///
    /// Its outline and the carrier's parts are not known then. A stated focal length in terms of 35 mm film is taken to
    /// be that of the photograph, which was smaller on the film then; any other one has to do with pixels.
    pub fn inside(self, inset: Inset) -> Option<Self> {
        let [old_width, old_height] = [self.width, self.height];
        let [width, height] = inset.inner([old_width, old_height])?;
        let smaller = (width as f64).hypot(height as f64) / (old_width as f64).hypot(old_height as f64);
        let of_photograph = |prior: FocalPrior| match prior.source {
            FocalSource::Equivalent35mm => FocalPrior { focal_px: prior.focal_px * smaller, ..prior },
            _ => prior,
        };
        let [right, down] = inset.offset();
        let moved = |lens: PlacedLens| {
            let [x, y] = lens.center_px;
            PlacedLens { center_px: [x - right, y - down], ..lens }
        };
        let (outer, inner) = (self.inset.sides(), inset.sides());
        let inset = Inset::from_sides(std::array::from_fn(|side| outer[side].saturating_add(inner[side])));
        let (focal_prior, lens) = (self.focal_prior.map(of_photograph), self.lens.map(moved));
        Some(Self { width, height, inset, outline: None, carrier: None, focal_prior, lens, ..self })
    }

    /// Whether the file says something of the camera that took it.
    pub fn is_by_camera(&self) -> bool {
        self.camera_model.is_some() || self.focal_mm.is_some() || self.focal_prior.is_some()
    }
}

/// A file that shows the same view as another one, the stack's reference, at another exposure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StackMember {
    /// The file.
    pub source: SourceImage,
    /// Rows of the homography from its full-resolution pixels to those of the reference.
    pub reference_from_member: [[f64; 3]; 3],
}

/// The pixels of a [`StackMember`].
#[derive(Debug, Clone, PartialEq)]
pub struct AlignedPhotograph {
    /// Of the same size as the reference, upright.
    pub photograph: Photograph,
    /// Rows of the homography from its pixels to those of the reference.
    pub reference_from_member: [[f64; 3]; 3],
}

/// Makes one photograph of a stack: what reading files asks of those who know how to compose.
pub trait StackFusion: std::fmt::Debug + Send + Sync {
    /// The picture of all exposures, in the frame, depth and channels of the reference.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) if a member has another size or a homography that is none.
    fn fuse(&self, reference: &Photograph, others: &[AlignedPhotograph]) -> Result<Photograph>;

    /// The light of all exposures, in the frame and channels of the reference, as 16-bit samples of `light`; `samples`
    /// is the curve of the exposures' own. Light is in the unit in which the reference's samples tell it.
    ///
    /// # Errors
    /// Those of [`Self::fuse`].
    fn merge(
        &self,
        reference: &Photograph,
        others: &[AlignedPhotograph],
        samples: &TransferCurve,
        light: &TransferCurve,
    ) -> Result<Photograph>;

    /// Bytes that fusing, or merging, takes beside the photographs themselves, for each of a photograph's pixels.
    fn bytes_per_pixel(&self, photographs: usize) -> usize;
}

/// The reduced frame a photograph is measured in: `working = working_from_full * full` on both axes, corner (0, 0).
///
/// Width and height are real numbers; the working raster holds the whole pixels inside them, so that the scale stays
/// exact and pixels stay square. The principal point is (width / 2, height / 2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WorkingFrame {
    /// Width in working pixels.
    pub width: f64,
    /// Height in working pixels.
    pub height: f64,
    /// Factor from full-resolution to working coordinates, at most 1.
    pub working_from_full: f64,
}

impl WorkingFrame {
    /// The frame of a photograph of `width` x `height` full pixels, reduced to at most `max_area_px` working pixels.
    pub fn new(width: usize, height: usize, max_area_px: f64) -> Self {
        let (width, height) = (width as f64, height as f64);
        let working_from_full = (max_area_px / (width * height)).sqrt().min(1.0);
        Self { width: width * working_from_full, height: height * working_from_full, working_from_full }
    }

    /// Diagonal in working pixels.
    pub fn diagonal(&self) -> f64 {
        self.width.hypot(self.height)
    }

    /// Whether (x, y) lies inside the photograph, borders included.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        (0.0..=self.width).contains(&x) && (0.0..=self.height).contains(&y)
    }
}

/// Hands out full-resolution photographs by index; implemented over files, memory or a cache.
pub trait PhotographSource: Sync {
    /// Decodes photograph `index` in its upright orientation.
    ///
    /// # Errors
    /// If the file can no longer be read or decoded.
    fn photograph(&self, index: usize) -> Result<Photograph>;

    /// What the photographer wants of the parts of photograph `index`; nothing unless a source says so.
    fn masks(&self, _index: usize) -> Masks {
        Masks::default()
    }

    /// Bytes that the samples of photograph `index` take once decoded, where that is known before.
    fn bytes(&self, _index: usize) -> Option<usize> {
        None
    }

    /// How the samples of all photographs stand for light; sRGB's curve unless told otherwise. What wraps another
    /// source hands its curve on.
    fn transfer_curve(&self) -> TransferCurve {
        TransferCurve::SRGB
    }
}
