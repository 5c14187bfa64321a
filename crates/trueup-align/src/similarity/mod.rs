//! The similarity prior: how each photograph should be turned and scaled so that the panorama stands upright.
//!
//! One file a prior (`vpg`, `gsp_2d`, `gsp_3d`, `aanap`; straightening is here); all share straightening, scales and
//! the least squares over unit vectors.

mod aanap;
mod block_matrix;
mod camera_correction;
mod dominant;
mod edge_range;
mod flat;
mod gate;
mod gravity;
mod gsp_2d;
mod gsp_3d;
mod held;
mod input;
mod level;
mod options;
mod path_voting;
mod pooled;
mod posterior;
mod printed;
mod prior;
mod probable_vertical;
mod scale;
mod sides;
mod signed_permutation;
mod turn_equations;
mod turns;
mod upright;
mod vertical;
mod vertical_vote;
mod vpg;
mod weighted_solve;
mod witnesses;

#[cfg(test)]
mod equation_tests;
#[cfg(test)]
mod gsp_tests;
#[cfg(test)]
mod pooled_tests;
#[cfg(test)]
mod posterior_tests;
#[cfg(test)]
pub(crate) mod synthetic;
#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, Vector3};
use trueup_core::camera::Camera;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::geometry::{matrix_from_rows, rows_of, wrap_angle};
use trueup_core::options::StageOptions;
use trueup_core::{Result, StageContext};

use gravity::MeanGravity;
use level::CameraLevel;
use sides::Sides;
use upright::{Upright, rolls};
use vpg::Guided;

use crate::far_horizon;
use crate::straightening;

pub use flat::of_flat_scene;
pub use input::PriorInput;
pub use level::{LevelEvidence, LevelSource};
pub use options::{BetaMode, Fallback, GateMode, PriorMethod, SimilarityOptions};
pub use posterior::{EstimatedRoll, RollsInput, estimated_rolls};
pub use printed::PrintedEquations;
pub use prior::{Guidance, SimilarityPrior, VerticalSpread};
pub use sides::PHOTOGRAPH_TURNED;

/// Farthest that a far horizon may lie from what cameras and gravity tell, in their deviations. Reasoned: nothing keeps
/// photographers from tilting all photographs alike, which their rolls do not tell.
const FARTHEST_HORIZON_DEVIATIONS: f64 = 5.0;
/// The same in degrees: of two photographs cameras know next to nothing. Measured: of cut scenes with a horizon the
/// cameras' level was off by 10 at most, roofs of two photographs were taken for one that is 22 off.
const FARTHEST_HORIZON_DEG: f64 = 15.0;
/// What a user can do when lines do not guide the panorama.
const REFUSED_HINT: &str =
    "What else tells which way is down levels the panorama; photographs that show upright edges level it better";

/// Finds the similarity prior of a connected set of photographs.
///
/// The world frame of the cameras is arbitrary and does not affect the result. The reference affects the published
/// global similarity priors alone.
///
/// # Errors
/// [`trueup_core::Error::Unsolvable`] if there are no photographs, the lists differ in length, an edge or the reference
/// names a photograph that does not exist, a camera is not finite, or overlaps come without a usable grid;
/// [`trueup_core::Error::Cancelled`].
///
/// # Source
/// The paper's sections on the vanishing point guided prior; see the modules for equations and departures.
pub fn run(input: &PriorInput<'_>, options: &SimilarityOptions, context: &StageContext<'_>) -> Result<SimilarityPrior> {
    input.check()?;
    context.check_cancelled()?;
    let rotations: Vec<Matrix3<f64>> = input.cameras.iter().map(Camera::rotation).collect();
    let focals: Vec<f64> = input.cameras.iter().map(|camera| camera.focal_px).collect();
    let gravity = options.gravity.then(|| MeanGravity::of(&rotations, input.gravity)).flatten();
    let as_stored = CameraLevel::new(&rotations, options.pitch_prior, gravity);
    let sides = sides_of(&as_stored, input, options, context);
    let viewed = sides.map(|sides| sides.viewed(&rotations));
    let level = match &viewed {
        Some(viewed) => CameraLevel::of_viewed(&rotations, viewed, options.pitch_prior, gravity),
        None => as_stored,
    };
    let level = with_far_horizon(level, input, options);
    let straightened = level.straightened.down;
    let unguided = |told: Vec<LevelEvidence>| {
        Guidance::none(input.cameras.len(), gate::allowed_divergence(input.cameras.len(), None, options), told)
    };
    let by_overlaps =
        |upright: Upright| Guided { guidance: unguided(Vec::new()), upright: Some(upright), level: level.down };
    let Guided { mut guidance, upright, level: down } = match input.method {
        PriorMethod::VanishingPoints => vpg::guide(input, &level, options, context)?,
        PriorMethod::Straightening => Guided { guidance: unguided(level.evidence()), upright: None, level: level.down },
        PriorMethod::Gsp2d => by_overlaps(gsp_2d::upright(input, straightened)),
        PriorMethod::Gsp3d => by_overlaps(gsp_3d::upright(input, &rotations, straightened)),
        PriorMethod::Aanap => by_overlaps(aanap::upright(input, &rotations, straightened, context)),
    };
    if let Some(clause) = guidance.failed_clause.as_ref().filter(|_| !guidance.used) {
        context.report(Diagnostic::note(
            "vanishing-guidance-refused",
            Subject::stage(SimilarityOptions::STAGE),
            clause,
            REFUSED_HINT,
        ));
    }
    let upright = upright.unwrap_or_else(|| match (input.method, options.fallback) {
        (PriorMethod::VanishingPoints, Fallback::Gsp3d) => gsp_3d::upright(input, &rotations, straightened),
        _ => straightening(&rotations, &down),
    });
    let level_from_world = straightening::level_from_world(&upright.down, &rotations);
    guidance.dominant = guidance.dominant.map(|world| rows_of(&(level_from_world * matrix_from_rows(&world))));
    guidance.spread = guidance.spread.map(|spread| spread.turned(&level_from_world));
    Ok(SimilarityPrior {
        theta: upright.theta.iter().map(|theta| wrap_angle(theta + input.turn)).collect(),
        scale: match input.method {
            PriorMethod::Gsp2d | PriorMethod::Gsp3d | PriorMethod::Aanap => scale::focal_scales(&focals),
            PriorMethod::VanishingPoints | PriorMethod::Straightening => {
                scale::scales(input.edges, &focals, options.as_printed)
            }
        },
        guidance,
        level_from_world: rows_of(&level_from_world),
        roll: rolls(&upright.down, &upright.rotations),
        camera_from_world: upright.rotations.iter().map(rows_of).collect(),
    })
}

/// How photographs are turned in their files, if the method asks for the vertical, no camera recorded gravity, and it
/// is much more probable than that none is; this is reported.
fn sides_of(
    as_stored: &CameraLevel<'_>,
    input: &PriorInput<'_>,
    options: &SimilarityOptions,
    context: &StageContext<'_>,
) -> Option<Sides> {
    if !options.turned_photographs || !asks_for_vertical(input) || as_stored.has_gravity {
        return None;
    }
    let sides = Sides::found(as_stored.rotations, input.shown, &as_stored.down, options.pitch_prior)?;
    sides.report(context);
    Some(sides)
}

/// Whether the method levels the panorama by whatever tells of the vertical.
fn asks_for_vertical(input: &PriorInput<'_>) -> bool {
    matches!(input.method, PriorMethod::VanishingPoints | PriorMethod::Straightening)
}

/// What is known of the vertical without lines, with the far horizon if the method asks for the vertical and the
/// photographs show one beyond doubt.
fn with_far_horizon<'a>(
    level: CameraLevel<'a>,
    input: &PriorInput<'_>,
    options: &SimilarityOptions,
) -> CameraLevel<'a> {
    if !options.far_horizon || !asks_for_vertical(input) {
        return level;
    }
    let is_plausible = |down: &Vector3<f64>| {
        let is_near = level.down.angle(down).to_degrees() <= FARTHEST_HORIZON_DEG;
        is_near && level.deviations_to(down) <= FARTHEST_HORIZON_DEVIATIONS
    };
    match far_horizon::find(input.shown, input.cameras, &level.down, is_plausible) {
        Some(horizon) => level.with_horizon(&horizon),
        None => level,
    }
}

/// Straightened cameras.
///
/// # Departures
/// The paper falls back to the global similarity prior ([`Fallback::Gsp3d`]), which corrects turns that an overlap
/// contradicts. Level photographs that look up are twisted against each other although neither is rolled; that
/// correction rolls them by the twist, which adds up along a row. Their place on the level sphere has the twist
/// already.
fn straightening(rotations: &[Matrix3<f64>], down: &Vector3<f64>) -> Upright {
    Upright { down: *down, theta: rolls(down, rotations), rotations: rotations.to_vec() }
}
