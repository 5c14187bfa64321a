//! When the mesh is worse than the cameras: the photographs as their cameras see them, with smooth corrections where
//! matches ask for them.
//!
//! The mesh lays photographs on a plane. A whole sphere has none: what looks at a pole cannot be unrolled, and pulls at
//! its neighbors. Cameras know no plane. Each photograph keeps its own pixels here, and the same energies as those of
//! the mesh move them aside until matches meet ([`corrections`]); a view is drawn from the directions that come of it,
//! and nothing folds, tears or bends that the cameras do not. [`judgement`] measures which of the two is better.

mod corrections;
mod drawing;
mod input;
mod judgement;

use trueup_core::camera::Camera;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::options::MeshOptions;
use super::warped_mesh::WarpedMesh;
use corrections::CameraCorrections;
pub(super) use corrections::carried;
use drawing::{Drawing, Seen};
pub use input::ByCamerasInput;
use judgement::{Evidence, Suspicion};

/// The code of the finding that says that the cameras draw the photographs instead of the mesh.
pub const DRAWN_BY_CAMERAS: &str = "drawn-by-cameras";

/// The grids that the cameras draw, where the mesh is worse than these; `None` where it is not.
///
/// `drawn-by-cameras` says what was drawn and why.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub fn unless_worse(
    mesh: &WarpedMesh,
    input: &ByCamerasInput,
    options: &MeshOptions,
    context: &StageContext,
) -> Result<Option<WarpedMesh>> {
    context.check_cancelled()?;
    let evidence = Evidence::of(mesh, input);
    let Some(suspicion) = Suspicion::of(&evidence) else { return Ok(None) };
    let Some(corrections) = CameraCorrections::find(input, options) else { return Ok(None) };
    let by_cameras = corrections.misfit_px(input);
    if !suspicion.is_confirmed(&evidence, by_cameras) {
        return Ok(None);
    }
    context.report(Diagnostic::note(
        DRAWN_BY_CAMERAS,
        Subject::stage("mesh"),
        format!(
            "drawn by the cameras instead, with corrections of up to {:.1} px where matches ask for them: {}",
            corrections.largest_px(),
            suspicion.reasons(&evidence, by_cameras)
        ),
        "",
    ));
    let drawing = Drawing::new(input, &corrections, options);
    Ok(Some(WarpedMesh {
        meshes: drawing.meshes,
        alignment_rms: by_cameras,
        folds: 0,
        relative_gradient: corrections.relative_gradient,
        period: drawing.period,
        by_cameras: Some(drawing.plane),
    }))
}

/// The grids of photographs of which nothing is known but the cameras, in the level world: on a plane of so many units
/// per radian. `grids` are over the photographs in the cameras' pixels.
pub fn drawn_by_cameras(cameras: &[Camera], grids: &[GridMesh], units_per_radian: f64) -> WarpedMesh {
    let seen = Seen { cameras, grids, dominant: None, subdivision: 1 };
    let Drawing { meshes, period, plane } = Drawing::of(&seen, units_per_radian, |_, pixel| pixel);
    WarpedMesh { meshes, alignment_rms: 0.0, folds: 0, relative_gradient: 0.0, period, by_cameras: Some(plane) }
}

#[cfg(test)]
mod tests;
