//! What a user can choose about the similarity prior.

use super::printed::PrintedEquations;
use crate::straightening::PITCH_PRIOR;

/// Where the turns and scales come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorMethod {
    /// Vanishing points, straightening where they are not believed.
    VanishingPoints,
    /// Straightening.
    Straightening,
    /// The global similarity prior in two dimensions, as published: the reference is straightened, and every photograph
    /// stays as it was taken that its overlaps let be.
    Gsp2d,
    /// The global similarity prior in three dimensions, as published: cameras straightened without a prior on their
    /// pitch, corrected by overlaps from the reference outwards.
    Gsp3d,
    /// AANAP's turns: of every overlap the similarity that turns least, from the reference as it was taken.
    Aanap,
}

trueup_core::choice! {
    /// Where the relative roll of two photographs comes from.
    pub enum BetaMode {
        /// The difference of the rolls that the dominant vertical means for each camera.
        World = "world",
        /// The twist of the relative rotation, with the sign that the paper's eq. 7 needs; biased when cameras are
        /// pitched.
        Relative = "relative",
        /// The same with the sign of the rotation that the paper decomposes, which is the opposite one.
        Printed = "printed",
    }
}

trueup_core::choice! {
    /// Which conditions accept the dominant directions.
    pub enum GateMode {
        /// Divergence, number of agreeing photographs, straightening and roll.
        Full = "full",
        /// The divergence alone, as published.
        Paper = "paper",
    }
}

trueup_core::choice! {
    /// What stands in for vanishing directions that are not believed.
    pub enum Fallback {
        /// Straightened cameras.
        Straightening = "straightening",
        /// The global similarity prior in three dimensions, as published.
        Gsp3d = "gsp-3d",
    }
}

trueup_core::options! {
    /// How the similarity prior is found.
    pub struct SimilarityOptions("similarity") {
        /// Sum of squared distances of a photograph's directions from the dominant ones up to which it agrees with
        /// them; 0.24 is a misorientation of 19.9 degrees. Lower it where wrong directions take part, raise it where
        /// right ones are left out.
        rejection: f64 = 0.24, between(1e-6, 1e9), "";
        /// Where relative rolls come from. The others to see what the published wording does.
        beta_mode: BetaMode = BetaMode::World, Allowed::Any, "";
        /// Weight of the relative rolls against the photographs' own. Raise it where single photographs lean against
        /// their neighbors, lower it where one wrong pair turns a whole row.
        relative_weight: f64 = 10.0, between(0.0, 1e6), "";
        /// Whether photographs vote along paths on how much a photograph's own roll weighs; otherwise all weigh the
        /// same. Turn it off to see what the vote does.
        path_voting: bool = true, Allowed::Any, "";
        /// Which conditions accept the dominant directions. `paper` to compare with the published gate, which accepts
        /// far more.
        gate: GateMode = GateMode::Full, Allowed::Any, "";
        /// Largest divergence of the vanishing directions. Raise it where lines are right and refused, lower it where
        /// directions that are none guide the panorama.
        max_divergence: f64 = 0.10, between(0.0, 1e3), "";
        /// The same with three photographs or fewer, which agree by chance more easily; more where their lines stand
        /// out by more than 6 standard deviations.
        max_divergence_few: f64 = 0.02, between(0.0, 1e3), "";
        /// Whether photographs that disagree are searched again near the dominant directions. Turn it off to keep to
        /// the published method.
        guided_redetection: bool = true, Allowed::Any, "";
        /// Whether the segments of all photographs refine the dominant directions together. Turn it off to keep to the
        /// published method.
        joint_refinement: bool = true, Allowed::Any, "";
        /// Whether each camera is turned so that its own segments point to the common directions, as far as its
        /// overlaps allow. Turn it off where the cameras are known better than the lines, from a calibrated rig.
        camera_correction: bool = true, Allowed::Any, "";
        /// Whether the segments of all photographs are searched together for one frame: to confirm the directions that
        /// the photographs agree on, and in their place where they do not agree. Turn it off to keep to the published
        /// method.
        pooled_search: bool = true, Allowed::Any, "";
        /// Whether a vertical alone may guide where the horizontal directions do not agree, and whether a few upright
        /// lines that may not guide tell of the level beside what else does. Turn it off where what looks vertical is
        /// not, as leaning trees or masts.
        vertical_only: bool = true, Allowed::Any, "";
        /// Whether gravity that cameras recorded takes part in the vertical. Turn it off where a camera was tilted on
        /// purpose, or its sensor is wrong.
        gravity: bool = true, Allowed::Any, "";
        /// Whether the far horizon of sea or plain takes part in the vertical, where photographs show it beyond doubt.
        /// Turn it off where what looks like one is not level: a long wall or a dike before the sky.
        far_horizon: bool = true, Allowed::Any, "";
        /// Whether photographs that lie on their side or stand on their head, because no metadata tell how the camera
        /// was held, are told by their light and by how they are turned against each other. Turn it off where some
        /// that lie as they are meant to are turned.
        turned_photographs: bool = true, Allowed::Any, "";
        /// What stands in for vanishing directions that are not believed. `gsp-3d` to compare with the published
        /// method.
        fallback: Fallback = Fallback::Straightening, Allowed::Any, "";
        /// Equations of the paper that are taken as they are printed, joined by +, where this program corrects them;
        /// `all` or `none` of them. Name some to see what the correction does.
        as_printed: PrintedEquations = PrintedEquations::NONE, Allowed::Any, "";
        /// How much straightening expects photographs to look level: variance of the roll over that of the pitch among
        /// photographers. Raise it if a panorama without buildings leans, lower it for photographs taken steeply up or
        /// down. 0 is the published form, which lets a short sweep with some roll pitch by tens of degrees; it is
        /// what the priors of the published methods always take.
        pitch_prior: f64 = PITCH_PRIOR, between(0.0, 1.0), "", basic;
    }
}
