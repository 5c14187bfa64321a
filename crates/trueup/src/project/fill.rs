//! Fills the project: what is recorded of photographs, pairs and geometry.

use std::collections::BTreeMap;

use trueup_align::cameras::FlatScene;
use trueup_align::similarity::LevelEvidence;
use trueup_compose::crop::Rectangle;
use trueup_compose::exposure::{Correction, Corrections, Response};
use trueup_compose::layout::{CanvasLayout, Placed};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::geometry::{matrix_from_rows, rows_of};
use trueup_core::lens::PlacedLens;
use trueup_core::mesh::GridMesh;
use trueup_core::source::{SourceImage, StackMember};

use super::level::{LevelRecord, ManhattanRecord};
use super::record::{
    Canvas, CropRecord, FlatSceneRecord, ImageRecord, ImageStatus, MeshRecord, PROJECT_FORMAT, PROJECT_VERSION,
    PairRecord, Project, StackMemberRecord,
};
use crate::options::{MethodForm, StitchOptions};
use crate::pipeline::align::Geometry;
use crate::pipeline::align::component::Component;
use crate::pipeline::arrange::{Arrangement, PROJECTION_CUT};
use crate::pipeline::compose::CROP_TOO_SMALL;
use crate::pipeline::matched::Matched;
use crate::pipeline::photographs::PhotographSet;

/// The record of all photographs and pairs, without geometry, for the panorama of `members`; `stitched` are the members
/// of all panoramas.
pub(crate) fn unfilled(
    matched: &Matched,
    options: &StitchOptions,
    members: &[usize],
    stitched: &[Vec<usize>],
) -> Project {
    let images = matched
        .set
        .images
        .iter()
        .enumerate()
        .map(|(index, image)| {
            let (reason, hint) = match members.contains(&index) {
                true => Default::default(),
                false => {
                    let why = matched.why_left_out(index, stitched);
                    (why.reason, why.hint)
                }
            };
            let component = matched.graph.components.iter().position(|component| component.contains(&index));
            ImageRecord {
                width: image.width,
                height: image.height,
                inset: image.inset,
                outline: image.outline.clone(),
                carrier: image.carrier.clone(),
                orientation: image.orientation,
                camera: image.camera_model.clone(),
                lens_told: image.lens.is_some(),
                component: component.filter(|_| matched.measured[index].is_some()),
                stack: stack_record(image),
                masks: matched.set.masks[index].clone(),
                ..ImageRecord::left_out(image.path.display().to_string(), reason, hint)
            }
        })
        .chain(matched.set.rejected.iter().map(|rejected| {
            ImageRecord::left_out(rejected.path.display().to_string(), rejected.reason.clone(), rejected.hint.clone())
        }))
        .collect();
    let pairs = matched.pairs.iter().map(|pair| PairRecord {
        a: pair.a,
        b: pair.b,
        matches: pair.putative,
        inliers: pair.agreeing,
        needed: pair.needed,
        verdict: pair.verdict,
    });
    Project {
        lens_from: matched.set.lens_from.as_ref().map(|path| path.display().to_string()),
        images,
        pairs: pairs.collect(),
        ..empty(options)
    }
}

/// The record of nothing, by these options.
pub(crate) fn empty(options: &StitchOptions) -> Project {
    Project {
        format: PROJECT_FORMAT.to_owned(),
        version: PROJECT_VERSION,
        method: trueup_core::options::OptionValue::display(&options.align.stitch.method),
        options: options.clone(),
        lens_from: None,
        reference: String::new(),
        images: Vec::new(),
        pairs: Vec::new(),
        manhattan: ManhattanRecord {
            divergence: None,
            threshold: options.align.similarity.max_divergence,
            significance: None,
            vertical_deviation_deg: None,
            accepted: false,
            pooled: false,
            slope_deg: None,
            failed_clause: Some("a single photograph is left as it is".to_owned()),
            dominant: None,
            inliers: Vec::new(),
            level: Vec::new(),
        },
        measures: None,
        canvas: Canvas { width: 0, height: 0, full_turn: false },
        color_space: String::new(),
        response: Response::default(),
        light: None,
        projection: None,
        crop: None,
        mesh_canvas: None,
        by_cameras: None,
        flat_scene: None,
        seconds: BTreeMap::new(),
        diagnostics: Vec::new(),
    }
}

fn stack_record(image: &SourceImage) -> Vec<StackMemberRecord> {
    let record = |member: &StackMember| StackMemberRecord {
        path: member.source.path.display().to_string(),
        reference_from_member: member.reference_from_member,
    };
    image.stack.iter().map(record).collect()
}

/// The deformed grids over the full-resolution photographs; a single photograph stays as it is.
pub(crate) fn place(component: &Component, geometry: Option<&Geometry>) -> Vec<Placed> {
    (0..component.members.len())
        .map(|k| {
            let (width, height) = (component.images[k].width as f64, component.images[k].height as f64);
            let mesh = match geometry {
                Some(geometry) => GridMesh { width, height, ..geometry.mesh.meshes[k].clone() },
                None => GridMesh::regular(width, height, width.max(height)),
            };
            Placed { photograph: component.members[k], mesh }
        })
        .collect()
}

/// What is found on the way from the geometry to the panorama, each time anew.
const FOUND_IN_COMPOSING: [&str; 12] = [
    "canvas-reduced",
    "color-converted",
    "color-profile-damaged",
    "color-profile-ignored",
    CROP_TOO_SMALL,
    "exposures-far-apart",
    "gaps-filled",
    "grid-folded",
    "photograph-replaced",
    PROJECTION_CUT,
    "projection-left-out",
    "view-not-heeded",
];

/// Brings the record up to what is composed of the photographs of `set`, which stand at the positions `used`.
pub(crate) fn record_composition(
    project: &mut Project,
    used: &[usize],
    set: &PhotographSet,
    arrangement: &Arrangement,
    corrections: &Corrections,
) {
    record_canvas(project, arrangement);
    project.response = corrections.response;
    project.diagnostics.retain(|one| !FOUND_IN_COMPOSING.contains(&one.code.as_str()));
    let mut renamed = Vec::new();
    for (k, &position) in used.iter().enumerate() {
        let record = &mut project.images[position];
        record_appearance(record, arrangement, k, &corrections.photographs[k]);
        let path = set.images[k].path.display().to_string();
        if path != record.path {
            project.diagnostics.push(Diagnostic::note(
                "photograph-replaced",
                Subject::Photograph(position),
                format!("it is shown in place of {}", record.path),
                "",
            ));
        }
        record.masks.clone_from(&set.masks[k]);
        record.stack = stack_record(&set.images[k]);
        renamed.push((std::mem::replace(&mut record.path, path.clone()), path));
    }
    rename(paths(project), &renamed.into_iter().collect());
}

/// Puts the names that `renamed` has in place of those it has them by.
fn rename<'a>(names: impl Iterator<Item = &'a mut String>, renamed: &BTreeMap<String, String>) {
    for known in names {
        if let Some(name) = renamed.get(known) {
            known.clone_from(name);
        }
    }
}

impl Project {
    /// Names photographs and masks by other paths, where they are to be found from now on: those that `moved` has by
    /// the paths that are recorded.
    pub fn rename_files(&mut self, moved: &BTreeMap<String, String>) {
        for image in &mut self.images {
            let masks = image.masks.iter_mut().map(|mask| &mut mask.path);
            let stack = image.stack.iter_mut().map(|member| &mut member.path);
            rename(std::iter::once(&mut image.path).chain(masks).chain(stack), moved);
        }
        rename(paths(self), moved);
    }
}

/// Everywhere that a project names photographs in use by their paths, but for their own records.
fn paths(project: &mut Project) -> impl Iterator<Item = &mut String> {
    let measures = project.measures.iter_mut().flat_map(|measures| {
        let bent = measures.long_lines.iter_mut().filter_map(|lines| lines.longest_bent.as_mut());
        let apart = measures.reprojection.iter_mut().filter_map(|found| found.worst_pair.as_mut());
        let places = bent.map(|bent| &mut bent.path).chain(apart.flat_map(|pair| [&mut pair.a, &mut pair.b]));
        measures.photographs.iter_mut().map(|one| &mut one.path).chain(places)
    });
    std::iter::once(&mut project.reference).chain(&mut project.manhattan.inliers).chain(measures)
}

/// Where the photograph of that number in the arrangement is shown, and in which light.
pub(crate) fn record_appearance(
    record: &mut ImageRecord,
    arrangement: &Arrangement,
    number: usize,
    correction: &Correction,
) {
    record.gain = Some(correction.brightness());
    record.correction = Some(*correction);
    record.mesh = Some(mesh_record(&arrangement.delivered[number]));
    record.solved_mesh = arrangement.projection.map(|_| mesh_record(&arrangement.plane.placed[number].mesh));
}

fn mesh_record(mesh: &GridMesh) -> MeshRecord {
    MeshRecord {
        rows: mesh.rows,
        cols: mesh.columns,
        source: (0..mesh.len()).map(|vertex| mesh.source(vertex).into()).collect(),
        target: mesh.target.clone(),
    }
}

/// What the panorama is drawn on.
pub(crate) fn record_canvas(project: &mut Project, arrangement: &Arrangement) {
    let canvas = |layout: &CanvasLayout| Canvas {
        width: layout.width,
        height: layout.height,
        full_turn: layout.period.is_some(),
    };
    project.canvas = canvas(&arrangement.drawn);
    project.crop = None;
    project.mesh_canvas = arrangement.projection.map(|_| canvas(&arrangement.plane));
    project.projection = arrangement.projection;
    project.by_cameras = arrangement.by_cameras;
}

/// What of the canvas that is recorded is kept.
pub(crate) fn record_crop(project: &mut Project, part: &Rectangle, crop: CropRecord) {
    let whole = project.canvas;
    project.crop = Some(crop);
    if *part == Rectangle::whole([whole.width, whole.height]) {
        return;
    }
    let is_mesh = project.projection.is_none();
    let [left, top] = part.corner();
    for image in project.images.iter_mut().filter(|image| image.status == ImageStatus::Used) {
        let Some(mesh) = &mut image.mesh else { continue };
        if is_mesh {
            image.solved_mesh = Some(mesh.clone());
        }
        mesh.target.iter_mut().for_each(|vertex| *vertex = [vertex[0] - left, vertex[1] - top]);
    }
    if is_mesh {
        project.mesh_canvas = Some(whole);
    }
    let turn = whole.full_turn.then_some(whole.width);
    project.projection = project.projection.map(|projection| projection.of_part(part, turn));
    let [width, height] = part.size();
    project.canvas = Canvas { width, height, ..whole };
}

/// What was found of a group of photographs.
pub(crate) struct GeometryRecord<'a> {
    pub component: &'a Component<'a>,
    /// `None` for a single photograph.
    pub geometry: Option<&'a Geometry>,
    pub arrangement: &'a Arrangement,
    /// In the order of the component.
    pub corrections: &'a Corrections,
}

/// Fills in what was found of the photographs used.
pub(crate) fn fill_geometry(project: &mut Project, found: &GeometryRecord) {
    let GeometryRecord { component, geometry, arrangement, corrections } = *found;
    record_canvas(project, arrangement);
    project.response = corrections.response;
    project.reference = component.images[component.reference].path.display().to_string();
    let method = project.options.align.stitch.method;
    let is_warp = matches!(method.form(), MethodForm::Warp(_));
    for (k, &photograph) in component.members.iter().enumerate() {
        let record = &mut project.images[photograph];
        record.status = ImageStatus::Used;
        record_appearance(record, arrangement, k, &corrections.photographs[k]);
        let Some(geometry) = geometry else { continue };
        let camera = &geometry.cameras.cameras[k];
        let camera_from_level = camera.rotation() * geometry.prior.level_from_world().transpose();
        record.focal_px = Some(camera.focal_px / component.frames[k].working_from_full);
        record.lens = (!camera.lens.is_pinhole()).then(|| {
            let full = camera.scaled(1.0 / component.frames[k].working_from_full);
            let [x, y] = full.principal_point;
            let center_px = [x - record.width as f64 / 2.0, y - record.height as f64 / 2.0];
            PlacedLens { terms: camera.lens.terms(), center_px }
        });
        record.rotation = Some(rows_of(&camera_from_level));
        let upright = matrix_from_rows(&geometry.prior.camera_from_world[k]);
        record.upright_rotation = Some(rows_of(&(upright * geometry.prior.level_from_world().transpose())));
        // A warp model asks no prior; what straightening would want is not what was done.
        if !is_warp {
            record.theta_deg = Some(geometry.prior.theta[k].to_degrees());
            record.scale = Some(geometry.prior.scale[k]);
        }
        record.vanishing_points = geometry.triads[k].triad().map(|triad| {
            let matrix = triad.matrix();
            std::array::from_fn(|direction| matrix.column(direction).into_owned().into())
        });
    }
    if let Some(geometry) = geometry {
        if let Some(scene) = &geometry.cameras.flat_scene {
            record_flat_scene(project, scene, component);
        }
        let guidance = &geometry.prior.guidance;
        project.manhattan = ManhattanRecord {
            divergence: guidance.divergence,
            threshold: guidance.threshold,
            significance: guidance.significance,
            vertical_deviation_deg: guidance.vertical_deviation.map(f64::to_degrees),
            accepted: guidance.used,
            pooled: guidance.pooled,
            slope_deg: guidance.slope.filter(|_| guidance.used).map(f64::to_degrees),
            failed_clause: match method.form() {
                MethodForm::Mesh(..) => guidance.failed_clause.clone(),
                MethodForm::Warp(_) => Some(format!("the method {} does not ask them", project.method)),
            },
            dominant: guidance.dominant,
            inliers: guidance.inliers.iter().map(|&k| component.images[k].path.display().to_string()).collect(),
            level: if is_warp { Vec::new() } else { guidance.level.iter().map(level_record).collect() },
        };
    }
}

/// Why the scene is flat, and where its cameras stand.
fn record_flat_scene(project: &mut Project, scene: &FlatScene, component: &Component) {
    let turned_by_lines_deg = scene.turned_by_lines.map(f64::to_degrees);
    project.flat_scene = Some(FlatSceneRecord { evidence: scene.evidence, turned_by_lines_deg });
    let reference = &component.frames[component.reference];
    let px_per_unit = scene.pixels_per_unit() / reference.working_from_full;
    for (camera, &photograph) in scene.cameras.iter().zip(&component.members) {
        project.images[photograph].place = Some((camera.center() * px_per_unit).into());
    }
}

fn level_record(evidence: &LevelEvidence) -> LevelRecord {
    LevelRecord {
        source: evidence.source,
        photographs: evidence.photographs,
        angle_deg: evidence.angle.to_degrees(),
        deviation_deg: evidence.deviation.to_degrees(),
        share: evidence.share,
    }
}
