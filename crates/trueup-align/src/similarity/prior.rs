//! The similarity prior and how it came to be.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::geometry::{matrix_from_rows, rows_of};

use super::level::LevelEvidence;
use super::witnesses::Reconciled;

/// How the vanishing directions took part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Guidance {
    /// Whether lines guide the prior; otherwise straightening does.
    pub used: bool,
    /// Whether the frame guides that the segments of all photographs together stand for, since the photographs' own
    /// directions did not agree, or were outvoted.
    pub pooled: bool,
    /// How far the best frame of the pooled search stands out, in standard deviations over all frames tried; `None`
    /// without enough segments.
    pub significance: Option<f64>,
    /// Standard deviation of the vertical in radians, by a jackknife over the photographs; `None` where it was not
    /// asked for.
    pub vertical_deviation: Option<f64>,
    /// Whether the vertical alone guides, since the gate refused the dominant directions.
    pub vertical_only: bool,
    /// The divergence epsilon; `None` without any agreeing photograph.
    pub divergence: Option<f64>,
    /// The largest divergence allowed.
    pub threshold: f64,
    /// Share of the photographs whose directions agree with the dominant ones.
    pub inlier_ratio: f64,
    /// The gate's clause that refused the dominant directions, in words.
    pub failed_clause: Option<String>,
    /// Rows of the dominant directions (columns) in the level world, if accepted: one column is (0, 1, 0) up to sign,
    /// rounding.
    pub dominant: Option<[[f64; 3]; 3]>,
    /// Photographs that agree with the dominant directions (the paper's Psi), ascending.
    pub inliers: Vec<usize>,
    /// Per photograph the sum of squared distances of its directions from the dominant ones; `None` without a triad.
    pub residuals: Vec<Option<f64>>,
    /// Per photograph the weight psi_i of its own roll; 0 for photographs without one.
    pub weights: Vec<f64>,
    /// Score of the strongest rival of the vertical over the vertical's own, from the segments of all photographs;
    /// `None` where the dominant directions were accepted and where there are no segments.
    pub vertical_rivalry: Option<f64>,
    /// Share of the segments' weight that supports the vertical; `None` as above.
    pub vertical_share: Option<f64>,
    /// Angle in radians between the vertical of the upright lines and the one that level lines imply, where these lie
    /// along a slope and do not take part; `None` otherwise.
    pub slope: Option<f64>,
    /// How far the vertical may be off by what upright and level lines say apart; `None` where these were not asked.
    pub spread: Option<VerticalSpread>,
    /// What told of the vertical, and of how much; empty for priors that ask nothing but the overlaps.
    pub level: Vec<LevelEvidence>,
}

/// How far a vertical may be off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct VerticalSpread {
    /// Rows of the mean outer product of its error, rad^2, in the level world.
    pub covariance: [[f64; 3]; 3],
    /// How many sectors of the scene, or photographs, it comes from.
    pub groups: usize,
}

impl VerticalSpread {
    /// About `down` of what was `reconciled`, both in the common frame.
    pub(super) fn about(down: &Vector3<f64>, reconciled: &Reconciled) -> Self {
        let off = reconciled.vertical * reconciled.vertical.dot(down).signum() - down;
        let covariance = rows_of(&(reconciled.covariance + off * off.transpose()));
        Self { covariance, groups: reconciled.groups }
    }

    /// The same in a world that the rotation `to` takes the common frame to.
    pub(super) fn turned(&self, to: &Matrix3<f64>) -> Self {
        Self { covariance: rows_of(&(to * matrix_from_rows(&self.covariance) * to.transpose())), ..*self }
    }
}

impl Guidance {
    /// No line takes part in a prior of `count` photographs; `threshold` is the divergence that would be allowed,
    /// `level` what told of the vertical.
    pub(super) fn none(count: usize, threshold: f64, level: Vec<LevelEvidence>) -> Self {
        Self {
            used: false,
            pooled: false,
            significance: None,
            vertical_deviation: None,
            vertical_only: false,
            divergence: None,
            threshold,
            inlier_ratio: 0.0,
            failed_clause: None,
            dominant: None,
            inliers: Vec::new(),
            residuals: vec![None; count],
            weights: vec![0.0; count],
            vertical_rivalry: None,
            vertical_share: None,
            slope: None,
            spread: None,
            level,
        }
    }
}

/// How each photograph should be turned and scaled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimilarityPrior {
    /// Clockwise turns theta_i in radians.
    pub theta: Vec<f64>,
    /// Scales s_i, of mean 1.
    pub scale: Vec<f64>,
    /// How the vanishing directions took part.
    pub guidance: Guidance,
    /// Rows of the rotation that takes the cameras' world to a level one: y down, the mean viewing direction above z.
    pub level_from_world: [[f64; 3]; 3],
    /// Per photograph the rows of the rotation from the cameras' world to the camera as its own segments correct it;
    /// the rotation given where nothing does.
    pub camera_from_world: Vec<[[f64; 3]; 3]>,
    /// Roll rho_i in radians of each of these cameras in the level world: the turn that stands it upright.
    pub roll: Vec<f64>,
}

impl SimilarityPrior {
    /// The rotation that levels the cameras' world.
    pub fn level_from_world(&self) -> Matrix3<f64> {
        matrix_from_rows(&self.level_from_world)
    }

    /// The cameras as the segments correct them: `cameras` must be those that the prior was made from.
    pub fn corrected_cameras(&self, cameras: &[Camera]) -> Vec<Camera> {
        let corrected = |(camera, &camera_from_world): (&Camera, _)| Camera { camera_from_world, ..*camera };
        cameras.iter().zip(&self.camera_from_world).map(corrected).collect()
    }
}
