//! What light is estimated from, and what comes of it.

use serde::{Deserialize, Serialize};
use trueup_core::color::TransferCurve;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;

use crate::layout::CanvasLayout;
use crate::light::Corrections;
use crate::render_options::Look;

/// The photographs whose light is compared.
#[derive(Debug, Clone, Copy)]
pub struct ExposureInput<'a> {
    /// Where they lie.
    pub layout: &'a CanvasLayout,
    /// One for each of [`CanvasLayout::placed`], in the same order.
    pub thumbnails: &'a [Thumbnail<'a>],
    /// Position of the photograph that [`GainAnchor::Reference`](super::GainAnchor::Reference) keeps, and whose colors
    /// [`GainAnchor::Scene`](super::GainAnchor::Scene) does.
    pub reference: usize,
    /// How much of the differences the panorama evens out: [`GainAnchor::Scene`](super::GainAnchor::Scene) is the level
    /// at which least is lost of what it shows then.
    pub look: Look,
}

/// A photograph reduced to its working size, as the comparison of light reads it.
#[derive(Debug, Clone, Copy)]
pub struct Thumbnail<'a> {
    /// 8 bits, three channels.
    pub raster: &'a Raster<u8>,
    /// How its levels stand for light.
    pub curve: &'a TransferCurve,
    /// How its pixels relate to the full-resolution photograph.
    pub frame: WorkingFrame,
    /// Which camera took it: photographs with the same number share their vignetting.
    pub camera: usize,
}

/// What two overlapping photographs say about each other's brightness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairExposure {
    /// Position of the first photograph in [`CanvasLayout::placed`].
    pub first: usize,
    /// Position of the second, greater than `first`.
    pub second: usize,
    /// Median of ln(first / second) over the shared samples, linear light, mean of the channels.
    pub log_ratio: f64,
    /// Robust standard deviation of the same (1.4826 times the median absolute deviation).
    pub deviation: f64,
    /// Number of shared samples.
    pub samples: usize,
}

/// The corrections and the measurements behind them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// For each photograph of [`CanvasLayout::placed`]; gains of 1 where it overlaps no other.
    pub corrections: Corrections,
    /// The pairs that were compared, by (first, second).
    pub pairs: Vec<PairExposure>,
}
