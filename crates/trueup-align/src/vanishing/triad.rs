//! What the search for a photograph's vanishing directions comes to.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use trueup_core::geometry::matrix_from_rows;

/// Three vanishing directions of a photograph, the paper's v_i.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Triad {
    /// Rows of the 3 x 3 matrix whose columns are the three directions in the camera frame: of unit length,
    /// mutually orthogonal as they are detected, of arbitrary order and sign.
    pub camera_from_triad: [[f64; 3]; 3],
    /// Fraction of the segments' weight that supports the triad, 0..1.
    pub quality: f64,
    /// Segments in each direction's cluster.
    pub line_counts: [usize; 3],
    /// For every segment given, the direction (0, 1, 2) whose cluster it belongs to; `None` if in none or not used.
    pub clusters: Vec<Option<u8>>,
    /// Covariance of the rotation vector d, in radians squared, for the perturbation `V exp([d]x)` of the matrix V.
    pub covariance: [[f64; 3]; 3],
    /// Standard deviation in radians of the roll that the direction closest to the photograph's vertical predicts;
    /// `None` if none is within 45 degrees of the photograph plane's vertical.
    pub roll_sd: Option<f64>,
}

impl Triad {
    /// The matrix whose columns are the directions in the camera frame.
    pub fn matrix(&self) -> Matrix3<f64> {
        matrix_from_rows(&self.camera_from_triad)
    }
}

/// Why a photograph has no triad.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "reason")]
pub enum MissingTriad {
    /// The photograph shows a flat scene, which has no depth that lines could lead into: none was looked for.
    FlatScene,
    /// Fewer usable segments than needed.
    TooFewLines {
        /// Usable segments.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The best triad explains too little of the segments.
    LowQuality {
        /// Its quality.
        quality: f64,
        /// The quality needed.
        needed: f64,
    },
    /// Fewer than two directions have enough segments.
    TooFewClusters {
        /// Populated clusters.
        populated: usize,
        /// Clusters needed.
        needed: usize,
    },
    /// The orientation is too uncertain about at least one axis.
    Uncertain {
        /// Largest standard deviation over the axes, in radians.
        sd: f64,
        /// The largest allowed, in radians.
        allowed: f64,
    },
}

/// What the search for a photograph's vanishing directions came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TriadOutcome {
    /// Three directions.
    Found(Triad),
    /// None, and why.
    Missing(MissingTriad),
}

impl TriadOutcome {
    /// The triad, if there is one.
    pub fn triad(&self) -> Option<&Triad> {
        match self {
            Self::Found(triad) => Some(triad),
            Self::Missing(_) => None,
        }
    }
}
