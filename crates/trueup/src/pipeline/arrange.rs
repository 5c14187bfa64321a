//! The arrange phase: from the solved mesh to the canvas that is composed: projection and frame.
//!
//! Works from what a stitch has at hand as from what its project records: grids in any plane and levelled cameras.

use std::borrow::Cow;
use std::f64::consts::TAU;

use nalgebra::Matrix3;
use serde::Serialize;
use trueup_align::mesh::CameraPlane;
use trueup_align::metrics::without_torn_cells;
use trueup_align::parallax;
use trueup_align::projection::{
    self, FlatKind, ParallaxShift, Placement, PosedPhotograph, Projection, ProjectionOptions, ProjectionView,
};
use trueup_compose::layout::{self, CanvasLayout, CanvasOptions, Frame, Placed};
use trueup_core::camera::Camera;
use trueup_core::diagnostics::{Diagnostic, Reported, Subject};
use trueup_core::geometry::matrix_from_rows;
use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result, StageContext};

use super::align::Geometry;
use super::align::component::Component;
use crate::memo::{KeyMaker, Memo, PARALLAX};
use crate::options::ArrangeOptions;
use crate::project::projection::{ProjectionRecord, WHOLE_SPHERE};
use crate::project::record::{ImageRecord, Project};

/// The code of photographs of which the view shows a part.
pub const PROJECTION_CUT: &str = "projection-cut";

/// What the phase works on.
#[derive(Debug, Clone)]
pub(crate) struct ArrangeInput {
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
    /// Where directions lie in the plane of `placed`, if the cameras drew it because the mesh was worse.
    pub by_cameras: Option<CameraPlane>,
    /// Whether `placed` lie on the plane of a flat scene, which has no directions.
    pub is_flat_scene: bool,
}

/// A canvas, and how it came about.
#[derive(Debug, Clone)]
pub(crate) struct Arrangement {
    /// Every photograph once in the plane of the mesh, in pixels of the canvas if that is the mesh's; for measures,
    /// exposure and the record.
    pub plane: CanvasLayout,
    /// What is composed.
    pub drawn: CanvasLayout,
    /// Every photograph once in pixels of the canvas `drawn`, in the order of `plane`: the panorama as it is measured
    /// and, but for the crop, recorded. Vertices beyond what a projection can show are NaN.
    pub delivered: Vec<GridMesh>,
    /// How directions were drawn; `None` for the mesh.
    pub projection: Option<ProjectionRecord>,
    /// Where directions lie in `plane`, if the cameras drew it because the mesh was worse.
    pub by_cameras: Option<CameraPlane>,
}

impl Arrangement {
    /// The mesh itself.
    fn of_mesh(plane: CanvasLayout) -> Self {
        let delivered = plane.placed.iter().map(|placed| placed.mesh.clone()).collect();
        Self { delivered, drawn: plane.clone(), plane, projection: None, by_cameras: None }
    }
}

impl Arrangement {
    /// The plane by which light is evened out: without cells that are torn around a pole.
    pub(crate) fn lit_plane(&self) -> Cow<'_, CanvasLayout> {
        let Some(by_cameras) = self.by_cameras else { return Cow::Borrowed(&self.plane) };
        let turn = Some(TAU * by_cameras.units_per_radian);
        let mut plane = self.plane.clone();
        for placed in &mut plane.placed {
            placed.mesh = without_torn_cells(&placed.mesh, turn);
        }
        Cow::Owned(plane)
    }
}

impl ArrangeInput {
    /// What a stitch knows of a group of photographs.
    pub(crate) fn of_geometry(placed: Vec<Placed>, component: &Component, geometry: Option<&Geometry>) -> Self {
        let is_flat_scene = geometry.is_some_and(|geometry| geometry.cameras.flat_scene.is_some());
        let rotating = geometry.filter(|_| !is_flat_scene);
        let cameras = rotating.map(|geometry| {
            let level_from_world = geometry.prior.level_from_world();
            let corrected = geometry.prior.corrected_cameras(&geometry.cameras.cameras);
            let full = corrected.iter().zip(&component.frames).zip(&placed).map(|((camera, frame), placed)| {
                let camera_from_level = camera.rotation() * level_from_world.transpose();
                let focal_px = camera.focal_px / frame.working_from_full;
                let pinhole = Camera::new(focal_px, placed.mesh.width, placed.mesh.height, &camera_from_level);
                let Camera { lens, principal_point, .. } = camera.scaled(1.0 / frame.working_from_full);
                if lens.is_pinhole() { pinhole } else { Camera { lens, principal_point, ..pinhole } }
            });
            full.collect()
        });
        let dominant = geometry.and_then(|geometry| geometry.prior.guidance.dominant);
        let dominant = dominant.as_ref().map(matrix_from_rows);
        let period = geometry.and_then(|geometry| geometry.mesh.period);
        let by_cameras = geometry.and_then(|geometry| geometry.mesh.by_cameras);
        Self { placed, reference: component.reference, cameras, dominant, period, by_cameras, is_flat_scene }
    }

    /// What a project knows of the photographs used, whose grids are `placed` in its order: composing from the record
    /// starts here.
    pub(crate) fn of_project(placed: Vec<Placed>, reference: usize, project: &Project) -> Self {
        let camera = |record: &ImageRecord| record.camera(record.level_rotation()?);
        let is_flat_scene = project.flat_scene.is_some();
        let cameras = if is_flat_scene { None } else { project.used_images().map(camera).collect() };
        let dominant = project.manhattan.dominant.as_ref();
        let period = project.solved_canvas().period();
        let by_cameras = project.by_cameras;
        let dominant = dominant.map(matrix_from_rows);
        Self { placed, reference, cameras, dominant, period, by_cameras, is_flat_scene }
    }
}

/// Arranges the photographs as the options ask: projected and laid on a canvas. Photographs go by their numbers in
/// `placed`.
///
/// # Errors
/// Those of the layout; [`Error::NotApplicable`] if a projection is asked for and no cameras are known;
/// [`Error::Unsolvable`] if nothing lies in the view.
pub(crate) fn run(
    input: ArrangeInput,
    options: &ArrangeOptions,
    memo: Memo,
    context: &StageContext,
) -> Result<Reported<Arrangement>> {
    context.gather(|context| context.time("canvas", || lay_out(input, options, memo, context)))
}

fn lay_out(input: ArrangeInput, options: &ArrangeOptions, memo: Memo, context: &StageContext) -> Result<Arrangement> {
    let ArrangeInput { placed, reference, cameras, dominant, period, by_cameras, is_flat_scene } = input;
    let by_mesh = options.projection.kind == Projection::Mesh && by_cameras.is_none();
    let is_drawn = cameras.is_none() || by_mesh;
    let lay = |context: &StageContext| layout::run_around(placed, reference, period, &options.canvas, context);
    // A canvas that is never drawn is of a size that is nobody's concern.
    let plane = if is_drawn { lay(context)? } else { context.gather(lay)?.value };
    let by_cameras = by_cameras.map(|by_cameras| by_cameras.moved(plane.origin, plane.canvas_from_target));
    on_plane(Plane { layout: plane, reference, cameras, dominant, by_cameras, is_flat_scene }, options, memo, context)
}

/// Arranges the photographs of `project`, recorded on `plane`, as the options ask: with the recorded options as they
/// were recorded, to the last bit.
///
/// # Errors
/// As [`run`].
pub(crate) fn recall(
    plane: CanvasLayout,
    reference: usize,
    project: &Project,
    options: &ArrangeOptions,
    context: &StageContext,
) -> Result<Reported<Arrangement>> {
    context.gather(|context| {
        context.time("canvas", || {
            // What is kept and filled of a canvas does not change it.
            let CanvasOptions { crop, min_kept, fill, .. } = project.options.arrange.canvas;
            let wanted = CanvasOptions { crop, min_kept, fill, ..options.canvas.clone() };
            let input = ArrangeInput::of_project(plane.placed.clone(), reference, project);
            if wanted != project.options.arrange.canvas {
                return lay_out(input, options, Memo::default(), context);
            }
            let ArrangeInput { cameras, dominant, by_cameras, is_flat_scene, .. } = input;
            let plane = Plane { layout: plane, reference, cameras, dominant, by_cameras, is_flat_scene };
            on_plane(plane, options, Memo::default(), context)
        })
    })
}

/// Photographs that lie on the mesh's canvas.
struct Plane {
    layout: CanvasLayout,
    /// Which of them sets the pixel scale.
    reference: usize,
    /// See [`ArrangeInput::cameras`].
    cameras: Option<Vec<Camera>>,
    /// See [`ArrangeInput::dominant`].
    dominant: Option<Matrix3<f64>>,
    /// See [`Arrangement::by_cameras`].
    by_cameras: Option<CameraPlane>,
    /// See [`ArrangeInput::is_flat_scene`].
    is_flat_scene: bool,
}

fn on_plane(plane: Plane, options: &ArrangeOptions, memo: Memo, context: &StageContext) -> Result<Arrangement> {
    let Plane { layout: plane, reference, cameras, dominant, by_cameras, is_flat_scene } = plane;
    let asked = match (options.projection.kind, by_cameras) {
        // There is no mesh: the view that suits.
        (Projection::Mesh, Some(_)) => ProjectionOptions { kind: Projection::Auto, ..options.projection.clone() },
        _ => options.projection.clone(),
    };
    let wanted = asked.kind;
    let missing = match (is_flat_scene, cameras.is_none()) {
        (true, _) => MissingView::FLAT_SCENE,
        (false, true) => MissingView::NO_CAMERAS,
        (false, false) => MissingView::MESH,
    };
    let Some(cameras) = cameras.filter(|_| wanted != Projection::Mesh) else {
        if !matches!(wanted, Projection::Mesh | Projection::Auto) {
            let option = format!("projection.kind = {}", trueup_core::options::OptionValue::display(&wanted));
            let hint = format!("Leave projection.kind to auto, or {}.", missing.remedy);
            return Err(Error::not_applicable(option, missing.reason, hint));
        }
        missing.report(&asked, context);
        return Ok(Arrangement::of_mesh(plane));
    };
    let photographs: Vec<PosedPhotograph> = cameras
        .iter()
        .zip(&plane.placed)
        .map(|(camera, placed)| PosedPhotograph { camera: *camera, mesh: placed.mesh.clone() })
        .collect();
    let view = ProjectionView::choose(&photographs, dominant.as_ref(), &asked);
    let max_parallax = asked.max_parallax_deg.to_radians();
    let shifts = match by_cameras {
        Some(by_cameras) => photographs.iter().map(|photograph| by_cameras.shift(photograph)).collect(),
        None => {
            let input = Unrolled { photographs: &photographs, period: plane.period.map(|period| period as f64) };
            parallax_shifts(&input, max_parallax, memo, context)?
        }
    };
    context.check_cancelled()?;
    let scene = Scene { photographs: &photographs, shifts: &shifts, view: &view };
    // The reference keeps its own pixels in the middle of the projection.
    let canvas_from_plane = options.canvas.scale * photographs[reference].camera.focal_px;
    let drawn = scene.draw(&plane, canvas_from_plane, options, context)?;
    report_cut(&plane, &drawn, &view, options, context);
    let projection = Some(ProjectionRecord::new(&view, &drawn));
    Ok(Arrangement { delivered: scene.delivered(&drawn), plane, drawn, projection, by_cameras })
}

/// Why a panorama has no view that could be turned or bounded.
struct MissingView {
    /// Without a closing full stop.
    reason: &'static str,
    /// What gives it a view, the rest of a sentence.
    remedy: &'static str,
}

impl MissingView {
    const FLAT_SCENE: Self = Self {
        reason: "the photographs show a flat scene from many places, and are drawn as they lie in its plane",
        remedy: "stitch with cameras.scene = rotating",
    };
    const NO_CAMERAS: Self = Self {
        reason: "no cameras are known: there is one photograph alone, or its record lacks them",
        remedy: "stitch at least two overlapping photographs",
    };
    const MESH: Self = Self {
        reason: "the panorama is drawn on the mesh, as it lies",
        remedy: "choose another projection.kind than the mesh, where the method has others",
    };

    /// Says what was `asked` of a view and is not heeded; 0 asks for nothing.
    fn report(&self, asked: &ProjectionOptions, context: &StageContext) {
        let ProjectionOptions { yaw, pitch, roll, fov, .. } = *asked;
        let idle: Vec<String> = [("yaw", yaw), ("pitch", pitch), ("roll", roll), ("fov", fov)]
            .into_iter()
            .filter(|(_, value)| *value != 0.0)
            .map(|(name, value)| format!("projection.{name} = {value}"))
            .collect();
        if idle.is_empty() {
            return;
        }
        let message = format!("nothing is turned or bounded by {}: {}", idle.join(", "), self.reason);
        let hint = format!("Leave it out, or {}.", self.remedy);
        context.report(Diagnostic::warning("view-not-heeded", Subject::Stage("projection".into()), message, hint));
    }
}

/// Photographs on the mesh's plane, and its turn if it closes on itself.
#[derive(Debug, Serialize)]
struct Unrolled<'a> {
    photographs: &'a [PosedPhotograph],
    period: Option<f64>,
}

/// How far the photographs give way, whatever they are drawn on: unless an earlier run found it for the same grids and
/// cameras.
fn parallax_shifts(
    input: &Unrolled,
    max_parallax: f64,
    memo: Memo,
    context: &StageContext,
) -> Result<Vec<ParallaxShift>> {
    let content = memo.disk.map(|_| KeyMaker::new().part(input));
    let key = memo.key(PARALLAX, content, &max_parallax);
    let is_whole = |shifts: &Vec<ParallaxShift>| {
        let sizes = shifts.iter().map(|shift| shift.aside.len());
        sizes.eq(input.photographs.iter().map(|photograph| photograph.mesh.len()))
    };
    memo.found_or_made(PARALLAX, key.as_ref(), is_whole, || {
        let found = parallax::shifts(input.photographs, input.period, max_parallax);
        context.check_cancelled()?;
        Ok(found)
    })
}

/// Photographs that a view shows.
struct Scene<'a> {
    photographs: &'a [PosedPhotograph],
    shifts: &'a [ParallaxShift],
    view: &'a ProjectionView,
}

impl Scene<'_> {
    fn placement(&self, canvas_from_plane: f64) -> Placement<'_> {
        Placement { view: self.view, canvas_from_plane, closed: self.view.closed }
    }

    /// The photographs on the view's canvas, of so many pixels per radian in its middle.
    fn draw(
        &self,
        plane: &CanvasLayout,
        canvas_from_plane: f64,
        options: &ArrangeOptions,
        context: &StageContext,
    ) -> Result<CanvasLayout> {
        let placed = projection::place(self.photographs, self.shifts, &self.placement(canvas_from_plane))
            .into_iter()
            .map(|grid| Placed { photograph: plane.placed[grid.photograph].photograph, mesh: grid.mesh })
            .collect();
        context.check_cancelled()?;
        let frame = Frame {
            canvas_from_target: canvas_from_plane,
            window: Some(self.view.window(0.0)),
            period: self.view.flat.period().filter(|_| self.view.closed),
            // Viewers want all of a sphere, with a hole where the tripod stood.
            whole_from: (self.view.closed && self.view.flat.kind == FlatKind::Equirectangular).then_some(WHOLE_SPHERE),
        };
        layout::framed(placed, &frame, &options.canvas, context)
    }

    /// Every photograph once on the canvas `drawn`, see [`Arrangement::delivered`].
    fn delivered(&self, drawn: &CanvasLayout) -> Vec<GridMesh> {
        let (scale, [left, top]) = (drawn.canvas_from_target, drawn.origin);
        let mut meshes = projection::place_once(self.photographs, self.shifts, &self.placement(scale));
        for vertex in meshes.iter_mut().flat_map(|mesh| &mut mesh.target) {
            *vertex = [(vertex[0] - left) * scale, (vertex[1] - top) * scale];
        }
        meshes
    }
}

/// Says which photographs are not shown, or not wholly though nobody asked for that.
fn report_cut(
    plane: &CanvasLayout,
    drawn: &CanvasLayout,
    view: &ProjectionView,
    options: &ArrangeOptions,
    context: &StageContext,
) {
    let size = [drawn.width, drawn.height].map(|length| length as f64);
    for placed in &plane.placed {
        let drawn_of_it = drawn.placed.iter().filter(|other| other.photograph == placed.photograph);
        let shown: Vec<&GridMesh> = drawn_of_it.map(|other| &other.mesh).collect();
        let subject = Subject::Photograph(placed.photograph);
        let hint = "Choose an equirectangular projection, widen projection.fov, or turn the view (yaw, pitch).";
        if shown.is_empty() {
            let message = format!("it lies outside of the {} view and is not shown", view.flat.kind.name());
            context.report(Diagnostic::warning("projection-left-out", subject.clone(), message, hint));
        } else if !view.flat.kind.turns() && options.projection.fov == 0.0 {
            let outside = share_outside(&shown, size);
            /// Less than this is a corner.
            const NOTABLE: f64 = 0.02;
            if outside > NOTABLE {
                let [across, _] = view.half.map(|half| 2.0 * half.to_degrees());
                let message = format!(
                    "{:.0} % of it lies outside of the {} view, which is {across:.0} degrees wide and as high as carries well",
                    100.0 * outside,
                    view.flat.kind.name()
                );
                context.report(Diagnostic::note(PROJECTION_CUT, subject, message, hint));
            }
        }
    }
}

/// Share of a photograph that lies outside of a canvas on each of its grids, which are divided alike.
fn share_outside(grids: &[&GridMesh], size: [f64; 2]) -> f64 {
    let Some(mesh) = grids.first() else { return 1.0 };
    // Vertices lie closer where the projection bends more; each counts for the photograph around it.
    let weight = |vertex: usize| {
        let (row, column) = (vertex / mesh.columns, vertex % mesh.columns);
        let at = |row: usize, column: usize| mesh.source(row * mesh.columns + column);
        let low = at(row.saturating_sub(1), column.saturating_sub(1));
        let high = at((row + 1).min(mesh.rows - 1), (column + 1).min(mesh.columns - 1));
        (high - low).product()
    };
    let is_on_canvas = |place: [f64; 2]| (0..2).all(|axis| (0.0..=size[axis]).contains(&place[axis]));
    let (mut outside, mut all) = (0.0, 0.0);
    for vertex in 0..mesh.len() {
        let shown = grids.iter().any(|grid| grid.target.get(vertex).is_some_and(|&place| is_on_canvas(place)));
        all += weight(vertex);
        outside += if shown { 0.0 } else { weight(vertex) };
    }
    outside / all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of five columns of vertices the first three lie on one grid, the third and fourth on the other, and the last on
    /// none.
    #[test]
    fn a_photograph_on_both_sides_of_a_view_is_shown_on_each() {
        let whole = GridMesh::regular(40.0, 10.0, 10.0);
        let part = |columns: std::ops::Range<usize>| {
            let place = |(vertex, &place): (usize, &[f64; 2])| {
                if columns.contains(&(vertex % whole.columns)) { place } else { [f64::NAN; 2] }
            };
            GridMesh { target: whole.target.iter().enumerate().map(place).collect(), ..whole.clone() }
        };
        let (left, right) = (part(0..3), part(2..4));
        // By hand: columns weigh 1, 2, 2, 2 and 1 eighths.
        for (grids, expected) in [(vec![&whole], 0.0), (vec![&left], 0.375), (vec![&left, &right], 0.125)] {
            assert!((share_outside(&grids, [40.0, 10.0]) - expected).abs() < 1e-12, "{expected}");
        }
        assert_eq!(share_outside(&[], [40.0, 10.0]), 1.0);
    }

    #[test]
    fn a_single_photograph_has_no_projection() {
        let mesh = GridMesh::regular(40.0, 30.0, 40.0);
        let input = |period| ArrangeInput {
            placed: vec![Placed { photograph: 0, mesh: mesh.clone() }],
            reference: 0,
            cameras: None,
            dominant: None,
            period,
            by_cameras: None,
            is_flat_scene: false,
        };
        let mut options = ArrangeOptions::default();
        options.projection.kind = Projection::Perspective;
        let refused = run(input(None), &options, Memo::default(), &StageContext::default()).expect_err("no camera");
        assert!(matches!(refused, Error::NotApplicable { .. }), "{refused}");
        options.projection.kind = Projection::Auto;
        let kept = run(input(None), &options, Memo::default(), &StageContext::default()).expect("as it is");
        assert_eq!(kept.findings, []);
        let kept = kept.value;
        assert_eq!((kept.drawn.width, kept.drawn.height, kept.projection), (40, 30, None));
        // What turns a view is not passed over in silence.
        (options.projection.yaw, options.projection.fov) = (20.0, 60.5);
        let told = run(input(None), &options, Memo::default(), &StageContext::default()).expect("as it is").findings;
        assert_eq!(told.iter().map(|one| one.code.as_str()).collect::<Vec<_>>(), ["view-not-heeded"]);
        let start = "nothing is turned or bounded by projection.yaw = 20, projection.fov = 60.5: no cameras are known";
        assert!(told[0].message.starts_with(start), "{}", told[0].message);
    }
}
