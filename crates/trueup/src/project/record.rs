//! The record of a stitch: what `--project` writes and other tools read. Documented in docs/project-file.md.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Deserializer, Serialize};
use trueup_align::cameras::FlatEvidence;
use trueup_align::mesh::CameraPlane;
use trueup_compose::exposure::{Correction, Response};
use trueup_core::camera::Camera;
use trueup_core::carrier::CarrierParts;
use trueup_core::color::LightRange;
use trueup_core::diagnostics::{Diagnostic, Severity};
use trueup_core::geometry::matrix_from_rows;
use trueup_core::inset::Inset;
use trueup_core::lens::{Lens, PlacedLens};
use trueup_core::matches::PairVerdict;
use trueup_core::outline::Outline;
use trueup_io::source::unique_names;

use super::level::ManhattanRecord;
use super::paths::file_name;
use super::projection::ProjectionRecord;
use crate::options::StitchOptions;
use crate::report::measures::Measures;

/// The `format` field of every project file.
pub const PROJECT_FORMAT: &str = "trueup-project";
/// The `version` field: raised when a field changes its meaning.
///
/// 2: the grids are those of the panorama, with a projection too. Files of version 1 are read; those with a projection
/// can be composed, but hold no grids of the panorama.
pub const PROJECT_VERSION: u32 = 2;

/// Whether a photograph is in the panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImageStatus {
    /// It is part of the panorama.
    Used,
    /// It is not, for the reason stated.
    LeftOut,
}

/// The deformed grid of one photograph, vertices row-major.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshRecord {
    /// Vertex rows.
    pub rows: usize,
    /// Vertex columns.
    pub cols: usize,
    /// Vertices in pixels of the original photograph after orientation; the corner is (0, 0).
    pub source: Vec<[f64; 2]>,
    /// Vertices in pixels of the written panorama; the corner is (0, 0), and where the panorama was cropped, or a
    /// projection shows a part, they may lie outside. NaN (null in the file) where a projection has no place for them.
    #[serde(deserialize_with = "places_or_nowhere")]
    pub target: Vec<[f64; 2]>,
}

/// Places of which `null` is NaN, as it is written.
fn places_or_nowhere<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 2]>, D::Error> {
    let places = Vec::<[Option<f64>; 2]>::deserialize(deserializer)?;
    Ok(places.into_iter().map(|place| place.map(|coordinate| coordinate.unwrap_or(f64::NAN))).collect())
}

/// What a mask means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MaskKind {
    /// White parts are used; black or transparent ones are ignored: not looked at, and not shown where another
    /// photograph can be.
    Use,
    /// White parts are shown, whatever other photographs show there; black or transparent ones are left to the seams.
    Keep,
}

/// A mask as the project records it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaskRecord {
    /// The picture's file as it was given.
    pub path: String,
    /// What it means.
    pub kind: MaskKind,
}

impl MaskRecord {
    /// The file's name without folders; paths written on another system are understood.
    pub fn file_name(&self) -> &str {
        file_name(&self.path)
    }
}

/// Another exposure of the view of a photograph, fused with it, or with [`Project::light`] merged. It is of the same
/// size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StackMemberRecord {
    /// The file as it was given.
    pub path: String,
    /// Rows of the homography from its pixels to those of the reference, both of the original photographs after
    /// orientation.
    pub reference_from_member: [[f64; 3]; 3],
}

/// What became of one photograph. The geometry of a left-out one is `None`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageRecord {
    /// The file as it was given.
    pub path: String,
    /// Width after orientation, without [`Self::inset`]; 0 if the file could not be read.
    pub width: usize,
    /// Height after orientation, without [`Self::inset`]; 0 if the file could not be read.
    pub height: usize,
    /// What of the picture in the file, as it is shown, lies beside the photograph: an even frame, or bars. All places
    /// in the record are the photograph's own.
    #[serde(default, skip_serializing_if = "Inset::is_none")]
    pub inset: Inset,
    /// Corners of the polygon inside of which the photograph lies in its picture, in its pixels; what is beside it is
    /// not shown. `None` where the whole picture is the photograph.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outline: Option<Outline>,
    /// Where it shows what carries the camera: rectangles `[left, top, right, bottom]` in its pixels, that are not
    /// looked at, nor shown where another photograph can be. `None` where it shows nothing of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carrier: Option<CarrierParts>,
    /// EXIF orientation (1 to 8) that was applied to the stored pixels; 0 in files of programs that did not record it.
    #[serde(default)]
    pub orientation: u8,
    /// Whether it is used.
    pub status: ImageStatus,
    /// Why it is left out; empty when used.
    pub reason: String,
    /// What the user can do about it; empty when used.
    pub hint: String,
    /// Group of overlapping photographs it belongs to, the largest first; `None` if it could not be read.
    pub component: Option<usize>,
    /// Make and model of its camera, if the file states them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Whether its lens was told by [`Project::lens_from`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub lens_told: bool,
    /// Focal length in pixels of the original photograph.
    pub focal_px: Option<f64>,
    /// What the lens does beside that; nothing recorded of a pinhole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<PlacedLens>,
    /// Rows of the rotation from the levelled world (y down) to the camera.
    pub rotation: Option<[[f64; 3]; 3]>,
    /// The same as the photograph's own lines correct it, which projections are drawn by; `None` in files of programs
    /// that knew no projections.
    #[serde(default)]
    pub upright_rotation: Option<[[f64; 3]; 3]>,
    /// Where the camera stands before a flat scene: x to the right and y down on its plane, z away from the
    /// photographer and so negative, in pixels of the photographs at their median scale. `None` for rotating cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f64; 3]>,
    /// Clockwise rotation that the similarity prior wants, in degrees.
    pub theta_deg: Option<f64>,
    /// Scale that the similarity prior wants, relative to the others.
    pub scale: Option<f64>,
    /// Factor on linear light that evens out the exposure: the mean over the channels, in the photograph's middle.
    pub gain: Option<f64>,
    /// All that was done to its light; `None` in files of programs that knew gains only.
    #[serde(default)]
    pub correction: Option<Correction>,
    /// The other exposures of the stack that it is the reference of; empty for a photograph of one file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stack: Vec<StackMemberRecord>,
    /// The masks it was given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masks: Vec<MaskRecord>,
    /// Three orthogonal vanishing directions in the camera frame, if found.
    pub vanishing_points: Option<[[f64; 3]; 3]>,
    /// The deformed grid, in the panorama.
    pub mesh: Option<MeshRecord>,
    /// The same as the method solved it, on [`Project::mesh_canvas`]: with [`Project::projection`], which takes from
    /// its overlaps how photographs meet, or where the panorama was cropped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solved_mesh: Option<MeshRecord>,
}

/// The outcome of matching two photographs, by their positions in `images`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairRecord {
    /// Position of the first photograph.
    pub a: usize,
    /// Position of the second photograph.
    pub b: usize,
    /// Putative matches.
    pub matches: usize,
    /// Matches that agree on one homography.
    pub inliers: usize,
    /// How many had to agree.
    pub needed: usize,
    /// Whether the pair is joined, and why not.
    pub verdict: PairVerdict,
}

/// What told that the photographs show a flat scene from places of their own, and how it is laid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FlatSceneRecord {
    /// How well a plane and how well rotating cameras explain the matches.
    #[serde(flatten)]
    pub evidence: FlatEvidence,
    /// Clockwise turn that lines on the plane asked for, beyond what the photographs' own up and down say, degrees;
    /// `None` where they did not agree.
    pub turned_by_lines_deg: Option<f64>,
}

/// Size of the written panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Canvas {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Whether it goes all the way round and its ends meet: columns are then meant modulo the width, and vertices may
    /// lie beyond either end.
    #[serde(default)]
    pub full_turn: bool,
}

impl Canvas {
    /// Columns after which the panorama repeats; `None` if it does not.
    pub fn period(&self) -> Option<f64> {
        self.full_turn.then_some(self.width as f64)
    }
}

/// The part of a canvas that became the panorama.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CropRecord {
    /// Columns of the canvas left of the panorama.
    pub left: usize,
    /// Rows of the canvas above the panorama.
    pub top: usize,
    /// Width of the canvas in pixels.
    pub canvas_width: usize,
    /// Height of the canvas in pixels.
    pub canvas_height: usize,
    /// Share of what the photographs cover that was cut off, 0 to 1.
    pub lost: f64,
    /// Share of the panorama that no photograph covers and that was filled for a whole frame, 0 to 1.
    pub filled: f64,
}

/// The record of one panorama.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Project {
    /// [`PROJECT_FORMAT`].
    pub format: String,
    /// [`PROJECT_VERSION`].
    pub version: u32,
    /// The method, as in the options.
    pub method: String,
    /// Every option of every stage as used.
    pub options: StitchOptions,
    /// The project that told the lenses, as it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens_from: Option<String>,
    /// Path of the reference photograph.
    pub reference: String,
    /// Every photograph given, in the order given: used, left out, and unreadable. The exposures of a stack are one, by
    /// its reference.
    pub images: Vec<ImageRecord>,
    /// Every pair tried, sorted.
    pub pairs: Vec<PairRecord>,
    /// Vanishing-point guidance.
    pub manhattan: ManhattanRecord,
    /// How upright, straight and well aligned it is, by its own lines and matches; `None` for a single photograph, and
    /// in files of programs that did not measure.
    #[serde(default)]
    pub measures: Option<Measures>,
    /// Size of the panorama.
    pub canvas: Canvas,
    /// Name of the color space it was composed in; empty in files of programs that knew one only.
    #[serde(default, alias = "colour_space")]
    pub color_space: String,
    /// What the cameras' response adds to that space's transfer curve: all factors act on the light by it. Nothing in
    /// files of programs that estimated none.
    #[serde(default)]
    pub response: Response,
    /// The light that the photographs were handed out in, where what is brighter than white is kept: those of stacks
    /// are merged then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<LightRange>,
    /// How directions were drawn; `None` where the panorama is the mesh itself, and in files of programs that knew no
    /// projections.
    #[serde(default)]
    pub projection: Option<ProjectionRecord>,
    /// What of the canvas was kept; `None` where it was not to be cropped, before it is composed, and in files of
    /// programs that did not record it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<CropRecord>,
    /// The canvas of the plane in which the grids were solved, where that is not the panorama's: with a projection, or
    /// where the panorama is a part of it.
    #[serde(default)]
    pub mesh_canvas: Option<Canvas>,
    /// Where directions of the level world lie on `mesh_canvas`, if the mesh was worse than the cameras, so that these
    /// drew the panorama.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_cameras: Option<CameraPlane>,
    /// How the photographs were told to show a flat scene from places of their own; `None` for rotating cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flat_scene: Option<FlatSceneRecord>,
    /// Wall seconds per stage.
    pub seconds: BTreeMap<String, f64>,
    /// What was found on the way.
    pub diagnostics: Vec<Diagnostic>,
}

impl ImageRecord {
    /// A photograph without geometry.
    pub(crate) fn left_out(path: String, reason: String, hint: String) -> Self {
        Self {
            path,
            width: 0,
            height: 0,
            inset: Inset::default(),
            outline: None,
            carrier: None,
            orientation: 0,
            status: ImageStatus::LeftOut,
            reason,
            hint,
            component: None,
            camera: None,
            lens_told: false,
            focal_px: None,
            lens: None,
            rotation: None,
            upright_rotation: None,
            place: None,
            theta_deg: None,
            scale: None,
            gain: None,
            correction: None,
            stack: Vec::new(),
            masks: Vec::new(),
            vanishing_points: None,
            mesh: None,
            solved_mesh: None,
        }
    }

    /// Rows of the rotation from the levelled world to the camera, as the photograph's own lines correct it where that
    /// is recorded.
    pub(crate) fn level_rotation(&self) -> Option<&[[f64; 3]; 3]> {
        self.upright_rotation.as_ref().or(self.rotation.as_ref())
    }

    /// The camera in the photograph's own pixels, with the rotation of these rows; `None` where no focal length is
    /// known.
    pub fn camera(&self, camera_from_world: &[[f64; 3]; 3]) -> Option<Camera> {
        let (width, height) = (self.width as f64, self.height as f64);
        let pinhole = Camera::new(self.focal_px?, width, height, &matrix_from_rows(camera_from_world));
        Some(match self.lens {
            Some(PlacedLens { terms, center_px: [x, y] }) => {
                Camera { lens: Lens::new(terms), principal_point: [width / 2.0 + x, height / 2.0 + y], ..pinhole }
            }
            None => pinhole,
        })
    }

    /// The file's name without folders; paths written on another system are understood.
    pub fn file_name(&self) -> &str {
        file_name(&self.path)
    }

    /// The recorded path and the name of every file that it is made of: its own, and the other exposures of its stack.
    pub fn files(&self) -> impl Iterator<Item = (&String, &str)> {
        let members = self.stack.iter().map(|member| (&member.path, member.file_name()));
        std::iter::once((&self.path, self.file_name())).chain(members)
    }
}

impl StackMemberRecord {
    /// The file's name without folders; paths written on another system are understood.
    pub fn file_name(&self) -> &str {
        file_name(&self.path)
    }
}

impl Project {
    /// The canvas that the grids of the photographs were solved on.
    pub fn solved_canvas(&self) -> Canvas {
        self.mesh_canvas.unwrap_or(self.canvas)
    }

    /// The photographs in the panorama, in the order given.
    pub fn used_images(&self) -> impl Iterator<Item = &ImageRecord> {
        self.images.iter().filter(|image| image.status == ImageStatus::Used)
    }

    /// What was found and makes the panorama worse.
    pub fn warnings(&self) -> impl Iterator<Item = &Diagnostic> {
        self.diagnostics.iter().filter(|one| one.severity == Severity::Warning)
    }

    /// The positions of these in [`Self::images`].
    pub fn used_positions(&self) -> Vec<usize> {
        (0..self.images.len()).filter(|&position| self.images[position].status == ImageStatus::Used).collect()
    }

    /// The names by which people know the photographs, in the order of [`Self::images`]: file names, with as much of
    /// their folders as tells them apart.
    pub fn photograph_names(&self) -> Vec<String> {
        let paths: Vec<&Path> = self.images.iter().map(|image| Path::new(&image.path)).collect();
        unique_names(&paths)
    }

    /// Number of photographs in the panorama.
    pub fn used(&self) -> usize {
        self.used_images().count()
    }

    /// Forgets what evened out the light of its photographs: composing from it evens out that of the photographs that
    /// are shown. For those of another shot, whose light is another.
    pub fn forget_light(&mut self) {
        self.response = Response::default();
        for image in &mut self.images {
            (image.gain, image.correction) = (None, None);
        }
    }

    /// The project as JSON text.
    ///
    /// # Errors
    /// [`trueup_core::Error::Input`] if a number cannot be written (never for results of a stitch).
    pub fn to_json(&self) -> trueup_core::Result<String> {
        serde_json::to_string(self)
            .map_err(|error| trueup_core::Error::input("project", error, "Report this as a defect."))
    }

    /// Reads a project file's text. `file` is its name, for messages.
    ///
    /// # Errors
    /// [`trueup_core::Error::Input`] if it is no project, damaged, or of a later version, or if numbers in it cannot
    /// be.
    pub fn from_json(text: &str, file: &str) -> trueup_core::Result<Self> {
        let wrong = |reason: String| {
            trueup_core::Error::input(file, reason, "Give a file that `trueup stitch --project` wrote.")
        };
        // Editors of some systems begin a text with a mark of its byte order.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut value: serde_json::Value =
            serde_json::from_str(text).map_err(|error| wrong(format!("not a project file ({error})")))?;
        if value.get("format").and_then(serde_json::Value::as_str) != Some(PROJECT_FORMAT) {
            return Err(wrong(format!("its format is not \"{PROJECT_FORMAT}\"")));
        }
        let version = value.get("version").and_then(serde_json::Value::as_u64);
        if !version.is_some_and(|version| (1..=u64::from(PROJECT_VERSION)).contains(&version)) {
            let found = version.map_or("unknown".to_owned(), |version| version.to_string());
            let reason = format!("its version is {found}, this program reads versions 1 to {PROJECT_VERSION}");
            return Err(match version {
                Some(1..) => trueup_core::Error::input(
                    file,
                    reason,
                    "Read it with the version of trueup that wrote it, or a later one.",
                ),
                _ => wrong(reason),
            });
        }
        if let Some(options) = value.get_mut("options") {
            StitchOptions::update_recorded(options, file)?;
        }
        let project: Self =
            serde_json::from_value(value).map_err(|error| wrong(format!("the project is damaged ({error})")))?;
        project.check(file)?;
        Ok(project.brought_up_to_date().without_grids_of_left_out())
    }

    /// What draws photographs looks at their grids: one that somebody has marked as left out has none.
    fn without_grids_of_left_out(mut self) -> Self {
        for image in self.images.iter_mut().filter(|image| image.status == ImageStatus::LeftOut) {
            (image.mesh, image.solved_mesh) = (None, None);
        }
        self
    }

    /// Version 1 recorded grids as they were solved, whatever the panorama was drawn on.
    fn brought_up_to_date(mut self) -> Self {
        if self.version == 1 && self.projection.is_some() {
            for image in &mut self.images {
                image.solved_mesh = image.mesh.take();
            }
        }
        self.version = PROJECT_VERSION;
        self
    }
}
