//! The deformed grids of all photographs: one sparse least-squares problem.
//!
//! Energies, one file each: alignment of the overlaps (`alignment`); local similarity of the grid's edges and their
//! agreement with the similarity prior (`similarity`); and what refines the plain mesh: matched lines and points
//! (`line_alignment`), pixels (`photometric`), long lines that keep their shape (`structure`). Unknown are the vertices
//! of all grids in the panorama. `plain_mesh` is the mesh that can be refined, `problem` its equations, `rounds` the
//! order of the refinements. Where the mesh is
//! worse than the cameras, these draw (`by_cameras`).
//!
//! # Source
//! Chen and Chuang (2016), section 3; VPG section IV with its global similarity.

mod alignment;
mod base;
mod by_cameras;
mod camera_plane;
mod cell_pair;
mod closure;
mod coarsening;
mod complex;
mod current_grids;
mod factor;
mod input;
mod line_alignment;
mod metric;
mod normal_equations;
mod options;
mod photometric;
mod plain_mesh;
mod problem;
mod refinements;
mod rounds;
mod similarity;
mod smooth_steps;
mod solver;
mod sphere_view;
mod straight_line;
mod structure;
mod subdivision;
mod warped_mesh;

use nalgebra::Vector2;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};

use alignment::AlignmentEnergy;
use base::placed;
pub(crate) use base::tilt_from_level;
pub use base::{BaseMap, bases, bases_on_drawing, bases_on_plane, tilts, turn_length};
pub use by_cameras::{ByCamerasInput, DRAWN_BY_CAMERAS, drawn_by_cameras, unless_worse};
pub use camera_plane::CameraPlane;
pub use closure::Closure;
pub use coarsening::cell_px;
pub(crate) use coarsening::coarsening_of_steps;
pub use input::MeshInput;
pub use line_alignment::{LineAlignmentInput, LineAlignmentOptions, StraightInput};
pub use options::{BaseShape, MeshOptions};
pub use photometric::{GrayPyramid, PhotometricInput, PhotometricOptions};
use plain_mesh::Layout;
pub use plain_mesh::PlainMesh;
pub use refinements::Refinements;
pub(crate) use smooth_steps::{LATTICE_CELLS, Meeting, smooth_steps};
pub use structure::{StructureInput, StructureOptions};
pub use subdivision::divided;
pub use warped_mesh::WarpedMesh;
pub(crate) use warped_mesh::count_folds;

/// Deforms the undeformed grids so that overlaps align and every edge keeps to its photograph's base.
///
/// A full turn is closed if its ends can meet and the closed grid has a solution; otherwise the warning
/// `full-turn-open` says why not, and it is left open.
///
/// # Errors
/// [`trueup_core::Error::Unsolvable`] if the system is not positive definite or the solution is not finite;
/// [`trueup_core::Error::Input`] if the chains do not have an entry per photograph; [`trueup_core::Error::Cancelled`].
pub fn run<'a>(input: &MeshInput<'a>, options: &'a MeshOptions, context: &StageContext) -> Result<PlainMesh<'a>> {
    context.check_cancelled()?;
    input.check()?;
    let MeshInput { grids, bases, reference, .. } = *input;
    let places: Vec<Vec<Vector2<f64>>> = bases.iter().zip(grids).map(|(base, grid)| base.places(grid)).collect();
    let within = AlignmentEnergy::new(grids, input.warps, bases, &places);
    let solved = |alignment: &AlignmentEnergy, closing| {
        let layout = Layout::new(input, places.clone(), alignment.clone(), closing, options);
        PlainMesh::solve(*input, layout, options, context)
    };
    let Some(closure) = &input.closure else { return solved(&within, &[]) };
    let mut joined = within.clone();
    joined.join(closure, grids, bases, &places);
    // What looks at a pole from all sides can have no length of a turn in a plane.
    let close = || match solved(&joined, closure.warps) {
        Err(Error::Unsolvable { .. }) => Ok(None),
        closed => closed.map(Some),
    };
    // Ends that lie a turn apart where the photographs only shift need no look at how they lie in an open mesh, unless
    // closing folds it.
    let mut closed = None;
    let undeformed = joined.shifted(&placed(grids, &places), reference);
    if undeformed.is_some_and(|grids| closure.contradiction(&joined.apart(&grids)).is_none()) {
        match close()? {
            Some(at_once) if at_once.warped().folds == 0 => return Ok(at_once),
            at_once => closed = Some(at_once),
        }
    }
    let open = solved(&within, &[])?;
    let contradiction = match closure.contradiction(&joined.apart(open.grids())) {
        Some(contradiction) => contradiction,
        None => match closed.map_or_else(close, Ok)? {
            Some(closed) if closed.warped().folds <= open.warped().folds => return Ok(closed),
            Some(_) => "closing the turn would fold the photographs".to_owned(),
            None => "the closed turn has no shape in the panorama's plane".to_owned(),
        },
    };
    context.report(Diagnostic::warning(
        "full-turn-open",
        Subject::stage("mesh"),
        format!("the photographs go all the way round, but the panorama's ends do not meet: {contradiction}"),
        "Look whether the photographs beside the cut show the same; --graph names the pairs to be matched.",
    ));
    Ok(open)
}

#[cfg(test)]
mod refinement_tests;
#[cfg(test)]
mod tests;
