//! Sets of pictures on disk with their truth.

use std::fs;
use std::path::Path;

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use trueup_core::raster::Raster;
use trueup_core::truth::{ImageTruth, Truth};
use trueup_core::{Error, Result, StageContext};

use crate::render::{Quality, depth_map, render};
use crate::rig::PosedCamera;
use crate::scene::lit::LitScene;

/// JPEG quality of the pictures written, of 100.
const JPEG_QUALITY: u8 = 87;

/// The truth of a camera whose picture is stored as `file`.
pub fn truth_of(posed: &PosedCamera, file: String) -> ImageTruth {
    ImageTruth {
        file,
        width: posed.width,
        height: posed.height,
        focal_px: posed.camera.focal_px,
        lens: None,
        rotation: posed.camera.camera_from_world,
        gamma_deg: posed.vertical_angle().to_degrees(),
        center: Some(posed.center),
        depth: None,
    }
}

/// How a set is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetOutput {
    /// How carefully pictures are rendered.
    pub quality: Quality,
    /// Whether every picture gets a depth map: metres along the optical axis through pixel centers, infinite where
    /// there is only sky, as a portable float map (`00.pfm`).
    pub depth: bool,
}

/// Renders a set into a folder, which is made if need be: `00.jpg`, `01.jpg`, ..., depth maps if wanted, and last
/// `truth.json`, so that a folder with it is complete.
///
/// # Errors
/// [`Error::Io`] if a file cannot be written, [`Error::Limits`] for a picture too large for JPEG,
/// [`Error::Cancelled`] between pictures.
pub fn write_set(
    directory: &Path,
    source: &str,
    scene: &LitScene,
    cameras: &[PosedCamera],
    output: SetOutput,
    context: &StageContext,
) -> Result<Truth> {
    const STAGE: &str = "rendering";
    fs::create_dir_all(directory).map_err(|error| Error::io("making the folder", directory, error))?;
    context.progress().begin(STAGE, cameras.len() as u64);
    let mut truth = Truth { source: source.to_owned(), images: Vec::with_capacity(cameras.len()), level: None };
    for (index, posed) in cameras.iter().enumerate() {
        context.check_cancelled()?;
        let file = format!("{index:02}.jpg");
        let path = directory.join(&file);
        let bytes = jpeg(&render(scene, posed, output.quality))?;
        fs::write(&path, bytes).map_err(|error| Error::io("writing", &path, error))?;
        let mut image = truth_of(posed, file);
        if output.depth {
            let file = format!("{index:02}.pfm");
            let path = directory.join(&file);
            fs::write(&path, float_map(&depth_map(scene, posed)))
                .map_err(|error| Error::io("writing", &path, error))?;
            image.depth = Some(file);
        }
        truth.images.push(image);
        context.progress().advance(STAGE, 1);
    }
    context.progress().finish(STAGE);
    write_truth(directory, &truth)?;
    Ok(truth)
}

/// Writes `truth.json` into the folder of its pictures.
pub(crate) fn write_truth(directory: &Path, truth: &Truth) -> Result<()> {
    let path = directory.join("truth.json");
    let text = serde_json::to_string_pretty(truth)
        .map_err(|error| Error::io("writing", &path, std::io::Error::other(error)))?;
    let beside = directory.join("truth.json.part");
    fs::write(&beside, text + "\n").map_err(|error| Error::io("writing", &beside, error))?;
    fs::rename(&beside, &path).map_err(|error| Error::io("renaming to", &path, error))
}

/// A portable float map: three lines of text, then rows from the bottom up of little-endian 32-bit numbers (the minus
/// in the third line says so).
///
/// # Source
/// Debevec, "PFM: portable float map", 2001; read by OpenCV, ImageMagick and the stereo benchmarks.
fn float_map(depths: &Raster<f32>) -> Vec<u8> {
    let mut bytes = format!("Pf\n{} {}\n-1.0\n", depths.width(), depths.height()).into_bytes();
    for y in (0..depths.height()).rev() {
        bytes.extend(depths.row(y).iter().flat_map(|depth| depth.to_le_bytes()));
    }
    bytes
}

/// A baseline JPEG at [`JPEG_QUALITY`] with halved chroma, in one scan: the encoder's optimized Huffman tables would
/// come with a scan for each component, which cameras never write and some decoders misread.
pub(crate) fn jpeg(picture: &Raster<u8>) -> Result<Vec<u8>> {
    let too_large = || Error::Limits {
        subject: "a JPEG picture".to_owned(),
        needed: format!("{} x {} px", picture.width(), picture.height()),
        allowed: "65535 x 65535 px".to_owned(),
        hint: "Render smaller pictures.".to_owned(),
    };
    let width = u16::try_from(picture.width()).map_err(|_| too_large())?;
    let height = u16::try_from(picture.height()).map_err(|_| too_large())?;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, JPEG_QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder
        .encode(picture.data(), width, height, ColorType::Rgb)
        .map_err(|error| Error::input("a picture", error, "Render at least one pixel."))?;
    Ok(bytes)
}
