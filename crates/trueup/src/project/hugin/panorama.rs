//! A Hugin project as a panorama that can be composed.

use std::f64::consts::PI;
use std::path::Path;

use trueup_align::mesh;
use trueup_align::projection::Projection;
use trueup_compose::exposure::Corrections;
use trueup_compose::layout::Placed;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z, rows_of};
use trueup_core::lens::PlacedLens;
use trueup_core::mesh::GridMesh;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result, StageContext};

use super::read::{HuginImage, HuginProject};
use crate::memo::Memo;
use crate::options::StitchOptions;
use crate::pipeline::arrange::{self, ArrangeInput};
use crate::project::fill::{empty, record_appearance, record_canvas};
use crate::project::read::find_file;
use crate::project::record::{ImageRecord, ImageStatus, Project};

/// Cells of a grid along a photograph's longer side: between its vertices, the picture is carried along bilinearly, to
/// a tenth of a pixel.
const CELLS: f64 = 64.0;
/// Sizes of the panorama, against the photographs' own pixels, that are taken over.
const SCALES: std::ops::RangeInclusive<f64> = 1e-3..=16.0;

impl HuginProject {
    /// The panorama that it describes, of its photographs, which lie as it names them in `folder` or here, ready to be
    /// composed: the cameras draw it, since the format knows of nothing else, and light is evened out anew.
    ///
    /// Projection and pixel scale are the project's, as far as they are drawn here; what is shown is chosen anew.
    ///
    /// # Errors
    /// [`Error::Input`] if a photograph is missing, cannot be read, has another size or a mirroring EXIF orientation;
    /// those of the layout; [`Error::Cancelled`].
    pub fn project(&self, folder: &Path, context: &StageContext) -> Result<Project> {
        let mut options = StitchOptions::default();
        options.arrange.projection.kind = self.projection.unwrap_or(Projection::Auto);
        let mut found = Vec::with_capacity(self.images.len());
        for image in &self.images {
            let source = find_file(&image.path, folder, &options.measure.source, context)?;
            found.push(Photograph::new(image, &source)?);
        }
        let reference = found.len() / 2;
        if let Some(scale) = self.px_per_radian.map(|scale| scale / found[reference].focal_px) {
            options.arrange.canvas.scale = scale.clamp(*SCALES.start(), *SCALES.end());
        }
        let cameras = found.iter().map(|photograph| {
            let rows = photograph.record.rotation.unwrap_or_default();
            photograph.record.camera(&rows)
        });
        let Some(cameras) = cameras.collect::<Option<Vec<_>>>() else {
            return Err(Error::input(folder.display(), "a photograph has no focal length", ""));
        };
        let grids: Vec<GridMesh> = found.iter().map(Photograph::grid).collect();
        let drawn = mesh::drawn_by_cameras(&cameras, &grids, found[reference].focal_px);
        let placed = drawn.meshes.into_iter().enumerate();
        let input = ArrangeInput {
            placed: placed.map(|(photograph, mesh)| Placed { photograph, mesh }).collect(),
            reference,
            cameras: Some(cameras),
            dominant: None,
            period: drawn.period,
            by_cameras: drawn.by_cameras,
            is_flat_scene: false,
        };
        let arrangement = arrange::run(input, &options.arrange, Memo::default(), context)?.value;
        let plain = Corrections::plain(found.len());
        let mut project = empty(&options);
        project.manhattan.failed_clause = Some("it was aligned in Hugin".to_owned());
        project.images = found.into_iter().map(|photograph| photograph.record).collect();
        project.reference.clone_from(&project.images[reference].path);
        record_canvas(&mut project, &arrangement);
        for (k, (record, correction)) in project.images.iter_mut().zip(&plain.photographs).enumerate() {
            record_appearance(record, &arrangement, k, correction);
            (record.gain, record.correction) = (None, None);
        }
        project.diagnostics = self.masked.iter().map(|&photograph| masks_left_out(photograph)).collect();
        Ok(project)
    }
}

fn masks_left_out(photograph: usize) -> Diagnostic {
    Diagnostic::warning(
        "hugin-masks-left-out",
        Subject::Photograph(photograph),
        "the Hugin project masks parts of it, which are not read",
        "Paint them into a picture, and give it after --mask.",
    )
}

/// A photograph of the panorama, and its record.
struct Photograph {
    record: ImageRecord,
    focal_px: f64,
}

impl Photograph {
    /// The camera of `image` before the upright photograph in the file `source`.
    fn new(image: &HuginImage, source: &SourceImage) -> Result<Self> {
        let quarters: u8 = match source.orientation {
            0 | 1 => 0,
            6 => 1,
            3 => 2,
            8 => 3,
            _ => {
                let reason = "its EXIF orientation mirrors it, which a Hugin project cannot say";
                return Err(Error::input(&image.path, reason, "Store it upright and align it again."));
            }
        };
        let is_turned = quarters % 2 == 1;
        let (width, height) = if is_turned { (source.height, source.width) } else { (source.width, source.height) };
        if (width, height) != (image.width, image.height) {
            let reason = format!(
                "it is {width} x {height} px, the Hugin project has it at {} x {} px",
                image.width, image.height
            );
            return Err(Error::input(&image.path, reason, "Give back the photograph that was aligned."));
        }
        let inset = image.inset.turned(quarters);
        let Some([width, height]) = inset.inner([source.width, source.height]) else {
            return Err(Error::input(&image.path, "nothing is left of it inside its crop", "Crop it less in Hugin."));
        };
        // Hugin counts from the middle of the picture in the file.
        let ([right, down], mut lens) = (inset.offset(), image.lens.unwrap_or_default().turned(quarters));
        lens.center_px = [lens.center_px[0] - right, lens.center_px[1] - down];
        let [yaw, pitch, roll] = image.attitude;
        let roll = roll - f64::from(quarters) * 0.5 * PI;
        let level_from_camera = rotation_about_y(yaw) * rotation_about_x(pitch) * rotation_about_z(roll);
        let record = ImageRecord {
            width,
            height,
            inset,
            orientation: source.orientation,
            status: ImageStatus::Used,
            component: Some(0),
            camera: source.camera_model.clone(),
            focal_px: Some(image.focal_px),
            lens: (lens != PlacedLens::default()).then_some(lens),
            rotation: Some(rows_of(&level_from_camera.transpose())),
            ..ImageRecord::left_out(source.path.display().to_string(), String::new(), String::new())
        };
        Ok(Self { record, focal_px: image.focal_px })
    }

    fn grid(&self) -> GridMesh {
        let (width, height) = (self.record.width as f64, self.record.height as f64);
        GridMesh::regular(width, height, width.max(height) / CELLS)
    }
}
