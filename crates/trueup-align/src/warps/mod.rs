//! Warp models: methods that place the pictures by closed formulas instead of the mesh energies.
//!
//! One file a model. All start from the same matches, cameras and grids and yield the same [`WarpedMesh`] as the mesh
//! energies do, so that renderer and measures are shared. A set of pictures that a model cannot place is refused with
//! [`trueup_core::Error::NotApplicable`]: what cannot lie on one plane is not torn or blown up instead.

mod aanap;
mod apap;
mod autostitch;
mod half_projective;
mod homography;
mod limits;
mod options;
mod placement;
mod quasi_homography;
mod sphp;

use nalgebra::{Matrix3, Vector2};
use trueup_core::camera::Camera;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::options::StageOptions;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result, StageContext};

use crate::match_points::OverlapWarp;
use crate::mesh::{WarpedMesh, count_folds};
pub use apap::Kernel;
pub use autostitch::Projection;
pub use options::{HomographySource, WarpOptions};
pub use quasi_homography::QuasiHomography;
pub use sphp::SphpWarp;

/// The stage's name in progress and generators.
const STAGE: &str = WarpOptions::STAGE;

trueup_core::choice! {
    /// A method that is a warp model.
    pub enum WarpModel {
        /// One homography per picture, onto the plane of the reference.
        Homography = "homography",
        /// Straightened cameras on a sphere, a cylinder or a plane.
        Autostitch = "autostitch",
        /// As-projective-as-possible: moving DLT.
        Apap = "apap",
        /// Shape-preserving half-projective, its similarity upright.
        Sphp = "sphp",
        /// Shape-preserving half-projective, its similarity free to turn.
        SphpFree = "sphp-free",
        /// Adaptive as-natural-as-possible.
        Aanap = "aanap",
        /// Homographies of linear scale outside the overlaps.
        QuasiHomography = "quasi-homography",
    }
}

/// What a warp model is made from. Pictures are counted 0..N; `cameras`, `frames`, `grids`, `match_grids`, `names` and
/// `seeds` have N entries.
#[derive(Debug, Clone, Copy)]
pub struct WarpInput<'a> {
    /// Cameras in working pixels, in any common world frame.
    pub cameras: &'a [Camera],
    /// Each picture's working frame.
    pub frames: &'a [WorkingFrame],
    /// Undeformed grids, as fine as they are to be delivered.
    pub grids: &'a [GridMesh],
    /// The pairs whose overlaps are to meet, with their matches; they connect all pictures.
    pub pairs: &'a [PairMatches],
    /// The grids whose vertices `overlaps` carry, of the same pictures.
    pub match_grids: &'a [GridMesh],
    /// Match points, by which the alignment is measured.
    pub overlaps: &'a [OverlapWarp],
    /// Names of the pictures, for messages.
    pub names: &'a [String],
    /// For each picture a number that does not depend on the order of the pictures; random choices derive from it.
    pub seeds: &'a [u64],
    /// The picture that stays in place in models that have such a one.
    pub reference: usize,
    /// The rotation that levels the cameras' world: y down, the mean viewing direction above z.
    pub level_from_world: Matrix3<f64>,
    /// Direction of the cut in the level world where the pictures go all the way round, radians from z towards x.
    pub cut_yaw: Option<f64>,
    /// Clockwise turn in radians that the user wants of the whole panorama.
    pub turn: f64,
}

/// Places the pictures by a warp model.
///
/// # Errors
/// [`Error::Options`]; [`Error::Unsolvable`] for lists of different lengths; [`Error::NotApplicable`] if the model cannot
/// place these pictures, with the angle they reach; [`Error::Cancelled`].
pub fn run(
    model: WarpModel,
    input: &WarpInput<'_>,
    options: &WarpOptions,
    context: &StageContext<'_>,
) -> Result<WarpedMesh> {
    options.check()?;
    check(input)?;
    context.check_cancelled()?;
    let mut meshes = match model {
        WarpModel::Homography => homography::place(input, options)?,
        WarpModel::Autostitch => autostitch::place(input, options)?,
        WarpModel::Apap => apap::place(input, options, context)?,
        WarpModel::Sphp | WarpModel::SphpFree => half_projective::place(model, input, options, context)?,
        WarpModel::Aanap => aanap::place(input, options, context)?,
        WarpModel::QuasiHomography => quasi_homography::place(input, options, context)?,
    };
    limits::check(model, input, &meshes, options)?;
    turn(&mut meshes, input.turn);
    Ok(WarpedMesh {
        alignment_rms: alignment_rms(&meshes, input),
        folds: meshes.iter().map(count_folds).sum(),
        relative_gradient: 0.0,
        period: autostitch::period(model, input, options),
        meshes,
    })
}

fn check(input: &WarpInput<'_>) -> Result<()> {
    let count = input.grids.len();
    let lengths =
        [input.cameras.len(), input.frames.len(), input.match_grids.len(), input.names.len(), input.seeds.len()];
    let known = |picture: usize| picture < count;
    let whole = lengths.iter().all(|&length| length == count)
        && known(input.reference)
        && input.pairs.iter().all(|pair| known(pair.a) && known(pair.b) && pair.a != pair.b)
        && input.overlaps.iter().all(|overlap| known(overlap.from) && known(overlap.to));
    match whole {
        true => Ok(()),
        false => Err(Error::unsolvable(
            STAGE,
            "warp model",
            format!("cameras, frames, names, pairs or the reference do not fit {count} pictures"),
            "Give one entry per picture.",
        )),
    }
}

/// The grid whose vertices go where `place` says.
fn deformed(grid: &GridMesh, place: impl Fn(Vector2<f64>) -> Vector2<f64>) -> GridMesh {
    let target = (0..grid.len()).map(|vertex| place(grid.source(vertex)).into()).collect();
    GridMesh { target, ..grid.clone() }
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
