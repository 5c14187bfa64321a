//! From the solved mesh to the canvas that is composed: projection, frame, crop.
//!
//! Works from what a stitch has at hand as from what its project records: grids in any plane and levelled cameras.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use trueup_align::projection::{self, FlatKind, Placement, Projection, Shot, View};
use trueup_compose::crop::{self, Crop, Rectangle};
use trueup_compose::layout::{self, CanvasLayout, CanvasOptions, Frame, Placed};
use trueup_core::camera::Camera;
use trueup_core::diagnostics::Diagnostic;
use trueup_core::geometry::matrix_from_rows;
use trueup_core::mesh::GridMesh;
use trueup_core::spherical::{SphericalFrame, SphericalProjection};
use trueup_core::{Error, Result, StageContext};

use crate::align::{Component, Geometry};
use crate::options::StitchOptions;
use crate::project::Project;

/// How the panorama is drawn from directions. A direction of the level world (x right, y down, z forward) that the rotations
/// `yaw`, `pitch` and `roll` turn into the viewer's lies at `(plane - origin) * px_per_radian` on the canvas, where `plane` is
/// its place in the projection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProjectionRecord {
    /// The projection's name.
    pub kind: FlatKind,
    /// Where the viewer looks: to the right of straight ahead in the level world.
    pub yaw_deg: f64,
    /// Where the viewer looks: up.
    pub pitch_deg: f64,
    /// How the viewer's head is turned, clockwise.
    pub roll_deg: f64,
    /// Distance of Panini's viewpoint behind the axis; the others do not ask.
    pub panini_distance: f64,
    /// Canvas pixels per radian at the projection's middle.
    pub px_per_radian: f64,
    /// The plane's coordinates (radians at the middle) at the canvas's corner.
    pub origin: [f64; 2],
    /// Where the panorama lies on the whole sphere, for viewers of spherical panoramas; `None` for other projections.
    pub sphere: Option<SphericalFrame>,
}

/// What an arrangement is made from.
#[derive(Debug, Clone)]
pub(crate) struct Sources {
    /// Every photograph once, in the plane of the solved mesh, in any unit.
    pub placed: Vec<Placed>,
    /// Which of them sets the pixel scale.
    pub reference: usize,
    /// Their cameras in the photographs' own pixels, in the level world; `None` where none are known.
    pub cameras: Option<Vec<Camera>>,
    /// The scene's dominant directions in the level world (columns), if they are known.
    pub dominant: Option<Matrix3<f64>>,
    /// The turn of the plane of `placed` in its unit, if it closes on itself.
    pub period: Option<f64>,
}

/// A canvas, and how it came about.
#[derive(Debug, Clone)]
pub(crate) struct Arrangement {
    /// Every photograph once in the plane of the mesh, in pixels of the canvas if that is the mesh's; for measures, exposure
    /// and the record.
    pub plane: CanvasLayout,
    /// The canvas's pixel (0, 0) in `plane`'s pixels; zero but for a cropped mesh.
    pub plane_shift: [f64; 2],
    /// What is composed.
    pub written: CanvasLayout,
    /// How directions were drawn; `None` for the mesh.
    pub projection: Option<ProjectionRecord>,
}

impl Sources {
    /// What a stitch knows of a group of photographs.
    pub fn of_geometry(placed: Vec<Placed>, component: &Component, geometry: Option<&Geometry>) -> Self {
        let cameras = geometry.map(|geometry| {
            let level_from_world = geometry.prior.level_from_world();
            let corrected = geometry.prior.corrected_cameras(&geometry.cameras.cameras);
            let full = corrected.iter().zip(&component.frames).zip(&placed).map(|((camera, frame), placed)| {
                let camera_from_level = camera.rotation() * level_from_world.transpose();
                let focal_px = camera.focal_px / frame.working_from_full;
                Camera::new(focal_px, placed.mesh.width, placed.mesh.height, &camera_from_level)
            });
            full.collect()
        });
        let dominant = geometry.and_then(|geometry| geometry.prior.guidance.dominant);
        let dominant = dominant.as_ref().map(matrix_from_rows);
        let period = geometry.and_then(|geometry| geometry.mesh.period);
        Self { placed, reference: component.reference, cameras, dominant, period }
    }

    /// What a project knows of the photographs used, whose grids are `placed` in its order: composing from the record starts
    /// here.
    pub fn of_project(placed: Vec<Placed>, reference: usize, project: &Project) -> Self {
        let camera = |(record, placed): (&crate::project::ImageRecord, &Placed)| {
            let camera_from_level = record.upright_rotation.or(record.rotation)?;
            let mesh = &placed.mesh;
            Some(Camera::new(record.focal_px?, mesh.width, mesh.height, &matrix_from_rows(&camera_from_level)))
        };
        let cameras = project.used_images().zip(&placed).map(camera).collect();
        let dominant = project.manhattan.dominant.as_ref();
        let period = project.grid_canvas().period();
        Self { placed, reference, cameras, dominant: dominant.map(matrix_from_rows), period }
    }
}

/// Arranges the photographs as the options ask: projected, laid on a canvas, cropped.
///
/// # Errors
/// Those of the layout; [`Error::NotApplicable`] if a projection is asked for and no cameras are known;
/// [`Error::Unsolvable`] if nothing lies in the view.
pub(crate) fn run(sources: Sources, options: &StitchOptions, context: &StageContext) -> Result<Arrangement> {
    let Sources { placed, reference, cameras, dominant, period } = sources;
    let is_drawn = cameras.is_none() || options.projection.kind == Projection::Mesh;
    // A canvas that is never drawn is of a size that is nobody's concern.
    let unheard = StageContext::default();
    let told = if is_drawn { context } else { &unheard };
    let plane = layout::run_around(placed, reference, period, &options.canvas, told)?;
    on_plane(plane, reference, (cameras, dominant), options, context)
}

/// Arranges the photographs of `project`, recorded on `plane`, as the options ask: with the recorded options as they were
/// recorded, to the last bit.
///
/// # Errors
/// As [`run`].
pub(crate) fn recall(
    plane: CanvasLayout,
    reference: usize,
    project: &Project,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Arrangement> {
    let recorded = &project.options;
    let may_be_cropped = project.projection.is_none() && recorded.canvas.crop != Crop::None;
    if may_be_cropped && (&options.canvas, &options.projection) == (&recorded.canvas, &recorded.projection) {
        let whole = Rectangle { columns: 0..plane.width, rows: 0..plane.height };
        let written = crop::cropped(plane.clone(), &whole);
        return Ok(Arrangement { plane, plane_shift: [0.0; 2], written, projection: None });
    }
    let CanvasOptions { crop, min_kept, fill, .. } = recorded.canvas;
    let same_plane = CanvasOptions { crop, min_kept, fill, ..options.canvas.clone() } == recorded.canvas;
    let sources = Sources::of_project(plane.placed.clone(), reference, project);
    match same_plane && !may_be_cropped {
        true => on_plane(plane, reference, (sources.cameras, sources.dominant), options, context),
        false => run(sources, options, context),
    }
}

/// Arranges photographs that lie on the mesh's canvas.
fn on_plane(
    plane: CanvasLayout,
    reference: usize,
    (cameras, dominant): (Option<Vec<Camera>>, Option<Matrix3<f64>>),
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Arrangement> {
    let wanted = options.projection.kind;
    let Some(cameras) = cameras.filter(|_| wanted != Projection::Mesh) else {
        if !matches!(wanted, Projection::Mesh | Projection::Auto) {
            return Err(Error::not_applicable(
                format!("projection.kind = {}", trueup_core::options::OptionValue::display(&wanted)),
                "no cameras are known: there is one photograph alone, or its record lacks them",
                "Stitch at least two overlapping photographs, or leave the projection to mesh.",
            ));
        }
        let (written, plane_shift) = framed(plane.clone(), options);
        return Ok(Arrangement { plane, plane_shift, written, projection: None });
    };
    let shots: Vec<Shot> = cameras
        .iter()
        .zip(&plane.placed)
        .map(|(camera, placed)| Shot { camera: *camera, mesh: placed.mesh.clone() })
        .collect();
    let view = View::choose(&shots, dominant.as_ref(), &options.projection);
    let drawn = draw(&shots, &plane, &view, reference, options, context)?;
    let (written, _) = framed(drawn, options);
    report_cut(&plane, &written, &view, options, context);
    let projection = Some(record(&view, &written));
    Ok(Arrangement { plane, plane_shift: [0.0; 2], written, projection })
}

/// The photographs on the view's canvas.
fn draw(
    shots: &[Shot],
    plane: &CanvasLayout,
    view: &View,
    reference: usize,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<CanvasLayout> {
    let max_parallax = options.projection.max_parallax_deg.to_radians();
    let meetings = projection::meeting(shots, plane.period.map(|period| period as f64), max_parallax);
    context.check_cancelled()?;
    // The reference keeps its own pixels in the middle of the projection.
    let canvas_from_plane = options.canvas.scale * shots[reference].camera.focal_px;
    let placement = Placement { view, canvas_from_plane, closed: view.closed };
    let placed = projection::place(shots, &meetings, &placement)
        .into_iter()
        .map(|grid| Placed { photograph: plane.placed[grid.shot].photograph, mesh: grid.mesh })
        .collect();
    context.check_cancelled()?;
    let reach = view.flat.reach(view.half);
    let frame = Frame {
        canvas_from_target: canvas_from_plane,
        window: Some([-reach, reach]),
        period: view.flat.period().filter(|_| view.closed),
    };
    layout::framed(placed, &frame, &options.canvas, context)
}

/// The layout as it is cropped, and by how much it moved.
fn framed(layout: CanvasLayout, options: &StitchOptions) -> (CanvasLayout, [f64; 2]) {
    match crop::choose(&layout, &options.canvas) {
        None => (layout, [0.0; 2]),
        Some(kept) => {
            let shift = [kept.columns.start, kept.rows.start].map(|start| start as f64);
            (crop::cropped(layout, &kept), shift)
        }
    }
}

/// Says which photographs are not shown, or not wholly though nobody asked for that.
fn report_cut(
    plane: &CanvasLayout,
    written: &CanvasLayout,
    view: &View,
    options: &StitchOptions,
    context: &StageContext,
) {
    let size = [written.width, written.height].map(|length| length as f64);
    for placed in &plane.placed {
        let shown = || written.placed.iter().filter(|other| other.photograph == placed.photograph);
        let subject = format!("photograph {}", placed.photograph);
        let hint = "Choose an equirectangular projection, widen projection.fov, or turn the view (yaw, pitch).";
        if shown().next().is_none() {
            let message = format!("it lies outside of the {} view and is not shown", view.flat.kind.name());
            context.report(Diagnostic::warning("projection-left-out", subject, message, hint));
        } else if !view.flat.kind.turns() && options.projection.fov == 0.0 {
            let outside = shown().map(|other| share_outside(&other.mesh, size)).fold(1.0, f64::min);
            /// Less than this is a corner.
            const NOTABLE: f64 = 0.02;
            if outside > NOTABLE {
                let [across, _] = view.half.map(|half| 2.0 * half.to_degrees());
                let message = format!(
                    "{:.0} % of it lies outside of the {} view, which is {across:.0} degrees wide and as high as carries well",
                    100.0 * outside,
                    view.flat.kind.name()
                );
                context.report(Diagnostic::note("projection-cut", subject, message, hint));
            }
        }
    }
}

/// Share of the grid's vertices that lie outside of a canvas.
fn share_outside(mesh: &GridMesh, size: [f64; 2]) -> f64 {
    // Vertices lie closer where the projection bends more; each counts for the photograph around it.
    let weight = |vertex: usize| {
        let (row, column) = (vertex / mesh.columns, vertex % mesh.columns);
        let at = |row: usize, column: usize| mesh.source(row * mesh.columns + column);
        let low = at(row.saturating_sub(1), column.saturating_sub(1));
        let high = at((row + 1).min(mesh.rows - 1), (column + 1).min(mesh.columns - 1));
        (high - low).product()
    };
    let (mut outside, mut all) = (0.0, 0.0);
    for vertex in 0..mesh.len() {
        let shown = (0..2).all(|axis| (0.0..=size[axis]).contains(&mesh.target[vertex][axis]));
        all += weight(vertex);
        outside += if shown { 0.0 } else { weight(vertex) };
    }
    outside / all
}

fn record(view: &View, written: &CanvasLayout) -> ProjectionRecord {
    let px_per_radian = written.canvas_from_target;
    ProjectionRecord {
        kind: view.flat.kind,
        yaw_deg: view.yaw.to_degrees(),
        pitch_deg: view.pitch.to_degrees(),
        roll_deg: view.roll.to_degrees(),
        panini_distance: view.flat.panini_distance,
        px_per_radian,
        origin: written.origin,
        sphere: sphere(view, written),
    }
}

/// Where a canvas lies on the whole sphere, in whole pixels.
fn sphere(view: &View, written: &CanvasLayout) -> Option<SphericalFrame> {
    use std::f64::consts::{PI, TAU};
    let scale = written.canvas_from_target;
    let [x, y] = written.origin;
    // Rounding may put the last column a pixel beyond the whole.
    let whole = |length: f64, start: usize, own: usize| (length.round() as usize).max(start + own);
    let start = |at: f64| (at * scale).round().max(0.0) as usize;
    let left = start(x + PI);
    let full_width = match written.period {
        Some(period) => period,
        None => whole(TAU * scale, left, written.width),
    };
    let (projection, top, full_height) = match view.flat.kind {
        FlatKind::Equirectangular => {
            let top = start(y + PI / 2.0);
            (SphericalProjection::Equirectangular, top, whole(PI * scale, top, written.height))
        }
        FlatKind::Cylindrical => {
            // As high above the horizon as below it.
            let half = (-y).max(y + written.height as f64 / scale).max(0.0);
            let top = start(y + half);
            (SphericalProjection::Cylindrical, top, whole(2.0 * half * scale, top, written.height))
        }
        _ => return None,
    };
    Some(SphericalFrame { projection, full_width, full_height, left, top, middle_yaw: view.yaw })
}

#[cfg(test)]
mod tests {
    use trueup_align::projection::Flat;

    use super::*;

    fn view(kind: FlatKind) -> View {
        let flat = Flat { kind, panini_distance: 1.0 };
        View { flat, yaw: 0.25, pitch: 0.0, roll: 0.0, half: kind.comfortable(), closed: false }
    }

    fn canvas(width: usize, height: usize, origin: [f64; 2]) -> CanvasLayout {
        CanvasLayout { width, height, canvas_from_target: 1000.0, origin, placed: Vec::new(), period: None }
    }

    /// 1000 pixels a radian: the whole is 6283 x 3142 pixels, its middle at (3141.6, 1570.8); the canvas begins half a radian
    /// left of it and 0.2 radians above the horizon.
    #[test]
    fn a_cropped_panorama_knows_its_place_on_the_sphere() {
        let frame = sphere(&view(FlatKind::Equirectangular), &canvas(1200, 700, [-0.5, -0.2])).expect("a sphere");
        assert_eq!((frame.full_width, frame.full_height, frame.left, frame.top), (6283, 3142, 2642, 1371));
        assert!(frame.holds(1200, 700) && frame.middle_yaw == 0.25);
        // The cylinder reaches 0.5 below the horizon, and as much above it in the whole.
        let frame = sphere(&view(FlatKind::Cylindrical), &canvas(1200, 700, [-0.5, -0.2])).expect("a cylinder");
        assert_eq!((frame.full_height, frame.top), (1000, 300));
        assert!(sphere(&view(FlatKind::Panini), &canvas(10, 10, [0.0; 2])).is_none());
        // What rounding adds at the end is part of the whole.
        let corner = [-std::f64::consts::PI, -std::f64::consts::FRAC_PI_2];
        let ending = sphere(&view(FlatKind::Equirectangular), &canvas(6284, 3143, corner));
        assert!(ending.expect("a sphere").holds(6284, 3143));
    }

    #[test]
    fn a_single_photograph_has_no_projection() {
        let mesh = GridMesh::regular(40.0, 30.0, 40.0);
        let sources = |period| Sources {
            placed: vec![Placed { photograph: 0, mesh: mesh.clone() }],
            reference: 0,
            cameras: None,
            dominant: None,
            period,
        };
        let mut options = StitchOptions::default();
        options.projection.kind = Projection::Perspective;
        let refused = run(sources(None), &options, &StageContext::default()).expect_err("no camera");
        assert!(matches!(refused, Error::NotApplicable { .. }), "{refused}");
        options.projection.kind = Projection::Auto;
        let kept = run(sources(None), &options, &StageContext::default()).expect("as it is");
        assert_eq!((kept.written.width, kept.written.height, kept.projection), (40, 30, None));
    }
}
