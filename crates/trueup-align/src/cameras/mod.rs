//! Focal lengths, lenses and rotations of the photographs of one component: the paper's R_i.
//!
//! Start values come from metadata, from the pair homographies (`homography_focal`) and from a search over a common
//! focal length (`focal`), or as GSP has them from local homographies (`local_focal`); rotations from the spanning tree
//! and from averaging over all edges (`rotations`); both are refined together by bundle adjustment (`bundle`), from
//! coarse to fine (`refinement`), photographs that differ with focal lengths of their own where a lens was zoomed or
//! refocused (`zoom`). Terms of the lenses are added as long as the matches, and edges that are to be straight
//! (`straightness`), are sure of them (`lenses`, `lens_evidence`; of few overlaps `lens_by_residual`): a pinhole stays
//! one. All this is a `solution`. Pairs that then contradict the others are set aside (`contradictions`), unless
//! cameras without the weaker ones explain more (`believed`). Focal lengths that parallax leaves open are those that
//! are expected, in part (`expected_focal`), and those through which lines lie at right angles (`directions`). Where
//! rotating cameras fail, or need a lens that nobody has, cameras that move before a plane are tried (`flat_scene`, by
//! `plane_adjustment`), and lines say how it is turned (`upright_plane`).

mod believed;
mod bundle;
mod contradictions;
mod directions;
mod equations;
mod expected_focal;
mod findings;
mod flat_scene;
mod focal;
mod homography_focal;
mod intrinsics;
mod lens_by_residual;
mod lens_evidence;
mod lenses;
mod levenberg_marquardt;
mod local_focal;
mod observations;
mod options;
mod pair_cost;
mod plane_adjustment;
mod plane_camera;
mod prior;
mod refinement;
mod rotations;
mod solution;
mod straightness;
mod transfer;
mod upright_plane;
mod zoom;

use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::lines::{EdgeCurve, LineSegment};
use trueup_core::matches::PairMatches;
use trueup_core::{Result, StageContext};

use believed::{Belief, Believed};
use flat_scene::FlatInput;
use solution::{Seen, Solution, graph_of, solve};
use straightness::CurveObservations;

pub use flat_scene::{FlatEvidence, FlatScene};
pub use options::{CameraOptions, FocalSharing, LensKind, SceneModel, StartFocal};
pub use plane_camera::PlaneCamera;
pub use prior::{CameraPrior, USUAL_FOCAL};
pub use transfer::CameraTransfer;

/// What cameras are found from. Photographs are counted 0..N.
#[derive(Debug, Clone, Copy)]
pub struct CameraInput<'a> {
    /// What is known of each photograph's camera.
    pub priors: &'a [CameraPrior],
    /// The joined pairs; they connect all photographs.
    pub pairs: &'a [PairMatches],
    /// Edges of each photograph that may be straight lines of the scene; none where they are not to tell of lenses.
    pub curves: &'a [&'a [EdgeCurve]],
    /// Line segments of each photograph, in working pixels.
    pub lines: &'a [Vec<LineSegment>],
    /// The photograph whose rotation is the identity in the end.
    pub reference: usize,
}

/// The cameras of one component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cameras {
    /// One camera per photograph, in working pixels; the reference photograph's rotation is the identity. Before a
    /// plane the rotations are from the plane's frame.
    pub cameras: Vec<Camera>,
    /// Whether photographs of a camera have focal lengths of their own, all or those that differ.
    pub per_picture_focal: bool,
    /// Root mean square residual of each pair in working pixels, in the order of the pairs given.
    pub pair_rms_px: Vec<f64>,
    /// Pairs (positions in the list given) that contradict the others and take no further part. Overlaps for sure that
    /// parallax keeps from agreeing are not among them: the cameras are found without them, but they are drawn and
    /// measured like others.
    pub contradicting: Vec<usize>,
    /// The plane that the photographs show from places of their own, if the cameras did more than rotate.
    #[serde(default)]
    pub flat_scene: Option<FlatScene>,
}

impl Cameras {
    /// Those of a flat scene.
    fn before_plane(flat_scene: FlatScene, pairs: &[PairMatches], options: &CameraOptions) -> Self {
        let before = &flat_scene.cameras;
        let transfer = |from: usize, to: usize| CameraTransfer::Plane(&before[from], &before[to]);
        let pair_rms_px: Vec<f64> = pairs.iter().map(|pair| observations::pair_rms(transfer, pair)).collect();
        Self {
            cameras: before.iter().map(|one| one.camera).collect(),
            per_picture_focal: options.focal_sharing == FocalSharing::PerPicture,
            contradicting: contradictions::not_needed_above(before.len(), pairs, &pair_rms_px, options.max_pair_rms_px),
            pair_rms_px,
            flat_scene: Some(flat_scene),
        }
    }

    /// The same with the plane laid otherwise.
    #[must_use]
    pub fn on_plane(&self, flat_scene: FlatScene) -> Self {
        let cameras = flat_scene.cameras.iter().map(|one| one.camera).collect();
        Self { cameras, flat_scene: Some(flat_scene), ..self.clone() }
    }

    /// How pixels of photograph `from` are carried into `to`.
    pub fn transfer(&self, from: usize, to: usize) -> CameraTransfer<'_> {
        match &self.flat_scene {
            Some(FlatScene { cameras, .. }) => CameraTransfer::Plane(&cameras[from], &cameras[to]),
            None => CameraTransfer::Rotating(&self.cameras[from], &self.cameras[to]),
        }
    }
}

/// Finds the cameras of the photographs that the pairs connect.
///
/// Everything is solved relative to the central photograph and turned in the end, so that the shape does not depend on
/// the reference: a solution that starts from another photograph may end in another local minimum where parallax leaves
/// several.
///
/// A focal length that metadata or photographs get wrong never ends the run: non-finite or absurd results are replaced
/// by a solution with the focal lengths fixed to those expected, and a diagnostic says so.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
///
/// # Source
/// Brown and Lowe, "Automatic panoramic image stitching using invariant features" (2007), section 4.
///
/// # Departures
/// Photographs are not added one at a time: averaging the relative rotations over all edges first gives a start from
/// which all cameras can be refined together, at a fraction of the cost. Focal lengths are shared within a camera
/// unless the data contradict it, which keeps short rows from drifting.
pub fn run(input: &CameraInput<'_>, options: &CameraOptions, context: &StageContext) -> Result<Cameras> {
    let CameraInput { priors, pairs, curves, lines, reference } = *input;
    let priors: &[CameraPrior] = &priors.iter().map(|prior| prior.told_by(options)).collect::<Vec<_>>();
    let curves = CurveObservations::new(priors.iter().map(|prior| prior.frame), curves);
    let everything: Vec<usize> = (0..priors.len()).collect();
    let anchor = graph_of(priors.len(), pairs.iter()).central_photograph(&everything);
    let solve_with = |active: &[usize]| {
        let used: Vec<&PairMatches> = active.iter().map(|&position| &pairs[position]).collect();
        let seen = Seen { pairs: &used, curves: &curves, lines };
        solve(priors, seen, anchor, options, context)
    };
    let belief =
        Belief { photographs: priors.len(), pairs, anchor, max_rms_px: options.max_pair_rms_px, solve: &solve_with };
    let Believed { mut solution, contradicting, told_rms_px } = belief.best()?;
    let pair_rms_px = belief.residuals(&solution.cameras);
    let flat_input = FlatInput { priors, pairs, rotating: &solution.by_matches, anchor };
    if let Some(flat_scene) = flat_scene::find(&flat_input, options, context)? {
        let cameras = Cameras::before_plane(flat_scene, pairs, options);
        findings::report_contradicting(pairs, &cameras.contradicting, &cameras.pair_rms_px, context);
        return Ok(cameras);
    }
    let (strained, contradicting): (Vec<usize>, Vec<usize>) =
        contradicting.into_iter().partition(|&position| is_strained(&pairs[position], pair_rms_px[position], options));
    findings::report_contradicting(pairs, &contradicting, &told_rms_px, context);
    findings::report_strained(pairs, &strained, &pair_rms_px, context);
    turn_to(&mut solution.cameras, reference);
    findings::report_doubts(&solution, priors, pairs.len(), context);
    let Solution { cameras, per_picture_focal, .. } = solution;
    Ok(Cameras { cameras, per_picture_focal, pair_rms_px, contradicting, flat_scene: None })
}

/// How many times the agreeing matches that a pair needs show that it is an overlap, whatever it contradicts. Of
/// photographed sets, false ones have 1.4 at most.
const SURE_OVERLAP: f64 = 1.5;
/// Largest residual of a sure overlap that parallax makes, in units of that from which on the cameras are found without
/// it.
const MOST_STRAINED: f64 = 3.0;

/// Whether a pair that contradicts the others is an overlap all the same, which parallax keeps from agreeing with
/// rotating cameras.
fn is_strained(pair: &PairMatches, rms_px: f64, options: &CameraOptions) -> bool {
    pair.agreeing as f64 >= SURE_OVERLAP * pair.needed as f64 && rms_px <= MOST_STRAINED * options.max_pair_rms_px
}

/// Makes the rotation of photograph `reference` the identity.
fn turn_to(cameras: &mut [Camera], reference: usize) {
    let Some(back) = cameras.get(reference).map(|camera| camera.rotation().transpose()) else { return };
    for camera in cameras {
        camera.set_rotation(&(camera.rotation() * back));
    }
}

#[cfg(test)]
mod tests;
