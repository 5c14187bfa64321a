//! Whether the mesh is worse than the cameras, by what can be measured of both.

use nalgebra::Vector3;
use trueup_core::camera::Camera;
use trueup_core::geometry::{roll_from_down, wrap_length};
use trueup_core::mesh::GridMesh;

use super::super::warped_mesh::WarpedMesh;
use super::corrections::{CarriedPoint, points, root_mean};
use super::input::ByCamerasInput;
use crate::full_turn::is_moderate;

/// What was measured of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Evidence {
    /// Photographs that look within 20 degrees of a pole or show it: no plane has them.
    pub at_poles: usize,
    /// Triangles turned over.
    pub folds: usize,
    /// Whether the photographs go all the way round by their cameras and the mesh does not.
    pub opened: bool,
    /// Largest lean, in the mesh, of what is vertical by the cameras in the middle of a photograph; radians.
    pub lean: f64,
    /// Root mean square distance of match points in the mesh, in pixels of the photographs.
    pub mesh_px: f64,
    /// The same by the cameras alone.
    pub cameras_px: f64,
}

impl Evidence {
    pub(super) fn of(mesh: &WarpedMesh, input: &ByCamerasInput) -> Self {
        let apart = |point: CarriedPoint| mesh_misfit(mesh, input, &point);
        let upright: Vec<f64> = (0..input.grids.len())
            .filter(|&k| is_moderate(input.cameras[k].forward()))
            .map(|k| lean(&input.cameras[k], &mesh.meshes[k]).abs())
            .collect();
        Self {
            at_poles: (0..input.grids.len()).filter(|&k| is_at_pole(&input.cameras[k], &input.grids[k])).count(),
            folds: mesh.folds,
            opened: !input.severed.is_empty() && mesh.period.is_none(),
            lean: upright.into_iter().fold(0.0, f64::max),
            mesh_px: root_mean(points(input.warps).filter_map(apart)),
            cameras_px: root_mean(points(input.warps).filter_map(|point| point.camera_misfit(input))),
        }
    }
}

/// Lean from which a mesh is said to bend what cameras have upright: what people see in a single photograph; radians (3
/// degrees). Meshes of rows, grids and full turns lean by half a degree at most.
const MOST_LEAN: f64 = 0.052;
/// Pixels by which match points may lie farther apart in the mesh than by the cameras: less is not seen.
const UNSEEN_PX: f64 = 1.0;

/// What speaks against a mesh at first sight, before the cameras are corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Suspicion {
    /// A plane cannot have what the photographs show.
    Poles,
    /// The mesh folds, leans, is open, or is apart.
    Shape,
}

impl Suspicion {
    pub(super) fn of(evidence: &Evidence) -> Option<Self> {
        let Evidence { at_poles, folds, opened, lean, mesh_px, cameras_px } = *evidence;
        if at_poles > 0 {
            return Some(Self::Poles);
        }
        let wrong = folds > 0 || opened || lean > MOST_LEAN || mesh_px > cameras_px + UNSEEN_PX;
        wrong.then_some(Self::Shape)
    }

    /// Whether cameras whose match points lie `by_cameras` pixels apart after correction are the better ones.
    pub(super) fn is_confirmed(self, evidence: &Evidence, by_cameras: f64) -> bool {
        match self {
            Self::Poles => true,
            Self::Shape => by_cameras <= evidence.mesh_px + UNSEEN_PX,
        }
    }

    /// In words.
    pub(super) fn reasons(self, evidence: &Evidence, by_cameras: f64) -> String {
        let Evidence { at_poles, folds, opened, lean, mesh_px, .. } = *evidence;
        let said = [
            (at_poles > 0)
                .then(|| format!("{at_poles} photographs look at a pole, which the mesh's plane does not have")),
            (folds > 0).then(|| format!("the mesh folds ({folds} triangles)")),
            opened.then(|| "its ends do not meet".to_owned()),
            (lean > MOST_LEAN).then(|| format!("it leans by up to {:.0} degrees", lean.to_degrees())),
            (mesh_px > by_cameras + UNSEEN_PX)
                .then(|| format!("its matches are {mesh_px:.1} px apart, by the cameras {by_cameras:.1}")),
        ];
        said.into_iter().flatten().collect::<Vec<String>>().join(", ")
    }
}

/// Whether a photograph shows a pole of the level world, or looks so near to one that it cannot be unrolled.
fn is_at_pole(camera: &Camera, grid: &GridMesh) -> bool {
    let shows = |down: f64| camera.shows(Vector3::new(0.0, down, 0.0), [grid.width, grid.height]);
    !is_moderate(camera.forward()) || shows(1.0) || shows(-1.0)
}

/// Clockwise angle in the mesh from down to what is down by the camera in the photograph's middle.
fn lean(camera: &Camera, mesh: &GridMesh) -> f64 {
    mesh.lean_in_the_middle(roll_from_down(&(camera.rotation() * Vector3::y())))
}

/// Squared distance of a match point in the mesh, taken back to pixels of its photograph; `None` where the mesh lays
/// the two a turn apart and is not closed, or has no area.
fn mesh_misfit(mesh: &WarpedMesh, input: &ByCamerasInput, point: &CarriedPoint) -> Option<f64> {
    let severed = input.severed.binary_search(&(point.from.min(point.to), point.from.max(point.to))).is_ok();
    if severed && mesh.period.is_none() {
        return None;
    }
    let vertex = input.grids[point.from].source(point.vertex);
    let mut apart = mesh.meshes[point.from].warp(vertex) - mesh.meshes[point.to].warp(point.place);
    if severed {
        apart.x = wrap_length(apart.x, mesh.period);
    }
    let back = mesh.meshes[point.from].derivative(vertex).try_inverse()? * apart;
    Some(back.norm_squared())
}
