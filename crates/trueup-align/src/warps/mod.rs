//! Warp models: methods that place the photographs by closed formulas instead of the mesh energies.
//!
//! A model is a file, an alternative of [`WarpModel`] and its arm in `run_within`. All start from the same matches,
//! cameras and grids and yield the same [`WarpedMesh`] as the mesh energies do, so that renderer and measures are
//! shared. A set of photographs that a model cannot place is refused with [`trueup_core::Error::NotApplicable`]: what
//! cannot lie on one plane is not torn or blown up instead.

mod aanap;
mod apap;
mod autostitch;
mod deformed;
mod distance_kernel;
mod half_planes;
mod half_projective;
mod homography;
mod input;
mod limits;
mod options;
mod placement;
mod quasi_homography;
mod sphp;

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;
use trueup_core::options::StageOptions;
use trueup_core::{Result, StageContext};

use crate::mesh::{WarpedMesh, count_folds};
pub use distance_kernel::DistanceKernel;
pub use input::WarpInput;
use limits::{LIMITS, Limits};
pub use options::{AutostitchSurface, HomographySource, WarpModel, WarpOptions};

/// Places the photographs by a warp model.
///
/// # Errors
/// [`trueup_core::Error::Options`]; [`trueup_core::Error::Unsolvable`] for lists of different lengths;
/// [`trueup_core::Error::NotApplicable`] if the model cannot place these photographs, with the angle they reach;
/// [`trueup_core::Error::Cancelled`].
pub fn run(
    model: WarpModel,
    input: &WarpInput<'_>,
    options: &WarpOptions,
    context: &StageContext<'_>,
) -> Result<WarpedMesh> {
    run_within(model, input, options, &LIMITS, context)
}

/// As [`run`], with any limits of deformation.
fn run_within(
    model: WarpModel,
    input: &WarpInput<'_>,
    options: &WarpOptions,
    limits: &Limits,
    context: &StageContext<'_>,
) -> Result<WarpedMesh> {
    options.check()?;
    input.check()?;
    context.check_cancelled()?;
    let mut meshes = match model {
        WarpModel::Homography => homography::place(input, options)?,
        WarpModel::Autostitch => autostitch::place(input, options)?,
        WarpModel::Apap => apap::place(input, options, context)?,
        WarpModel::Sphp | WarpModel::SphpFree => half_projective::place(model, input, options, context)?,
        WarpModel::Aanap => aanap::place(input, options, context)?,
        WarpModel::QuasiHomography => quasi_homography::place(input, options, context)?,
    };
    limits::check(model, input, &meshes, limits)?;
    turn(&mut meshes, input.turn);
    Ok(WarpedMesh {
        alignment_rms: alignment_rms(&meshes, input),
        folds: meshes.iter().map(count_folds).sum(),
        relative_gradient: 0.0,
        period: autostitch::period(model, input, options),
        by_cameras: None,
        meshes,
    })
}

/// Turns the panorama clockwise by `angle` radians.
fn turn(meshes: &mut [GridMesh], angle: f64) {
    if angle == 0.0 {
        return;
    }
    let (sine, cosine) = angle.sin_cos();
    for vertex in meshes.iter_mut().flat_map(|mesh| &mut mesh.target) {
        let [x, y] = *vertex;
        *vertex = [cosine * x - sine * y, sine * x + cosine * y];
    }
}

/// Root mean square distance between the two places of a match point; 0 without any.
fn alignment_rms(meshes: &[GridMesh], input: &WarpInput<'_>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for overlap in input.overlaps {
        let (from, to) = (&meshes[overlap.from], &meshes[overlap.to]);
        for (vertex, place) in overlap.vertices.iter().enumerate() {
            let Some(place) = place else { continue };
            let apart = from.warp(input.match_grids[overlap.from].source(vertex)) - to.warp(Vector2::from(*place));
            sum += apart.norm_squared();
            count += 1;
        }
    }
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}

#[cfg(test)]
mod tests;
