//! One look for all photographs: gain, color cast and vignetting, estimated together where photographs overlap.
//!
//! All factors act on linear light, so that they add up as logarithms: what photograph i shows of a place, times its gain,
//! times its lens's correction there, equals the same of photograph j. The overlaps give one such equation per sample and
//! channel; moving things and ghosts are weighed down by their residuals, saturated samples do not take part. What is linear
//! light is estimated, too, as a [`Response`] beside the color profile's curve. What the reference shows stays as it is, but
//! for its vignetting.

mod correction;
mod equations;
mod evidence;
mod overlap;
mod predicted;
mod response;
mod robust;
mod samples;
mod solve;

pub use correction::{Correction, Corrections, VIGNETTING_TERMS};
pub(crate) use correction::{LightTable, exposed};
pub use response::{RESPONSE_TERMS, Response};

use std::borrow::Cow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::color::TransferCurve;
use trueup_core::options::StageOptions;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result, StageContext};

use crate::layout::{CanvasLayout, check_mesh};
use overlap::{Observed, compare};
use samples::{Patch, shared};
use solve::solve;

const STAGE: &str = ExposureOptions::STAGE;

trueup_core::choice! {
    /// Which photograph's look the panorama keeps.
    pub enum GainAnchor {
        /// The geometric mean of all gains is 1 in every channel.
        Mean = "mean",
        /// The reference's gains are 1.
        Reference = "reference",
    }
}

trueup_core::choice! {
    /// What may differ between the photographs.
    pub enum ExposureModel {
        /// Brightness: one gain per photograph.
        Gain = "gain",
        /// Brightness, color cast (a gain per channel) and vignetting (one lens per camera).
        Full = "full",
    }
}

trueup_core::options! {
    /// How brightness, color and vignetting of the photographs are evened out.
    pub struct ExposureOptions("exposure") {
        /// Whether anything is evened out at all; without, every photograph keeps its light.
        enabled: bool = true, Allowed::Any, "";
        /// What may differ between the photographs: their brightness, or color cast and vignetting, too.
        model: ExposureModel = ExposureModel::Full, Allowed::Any, "";
        /// Which photograph's look the panorama keeps.
        anchor: GainAnchor = GainAnchor::Reference, Allowed::Any, "";
        /// Samples taken across a photograph, about, when the overlaps are compared.
        samples: f64 = 10_000.0, between(100.0, 1e6), "";
        /// Fewest samples two photographs must share to be compared.
        min_shared: usize = 20, between(1.0, 1e6), "samples";
        /// Darkest 8-bit level that still tells brightness.
        darkest: u8 = 4, Allowed::Any, "level";
        /// Brightest 8-bit level that still tells brightness.
        brightest: u8 = 251, Allowed::Any, "level";
        /// Uncertainty of a pair's measured ratio, from vignetting and misalignment, as a standard deviation of its natural
        /// logarithm; the spread of the samples adds to it.
        pair_deviation: f64 = 0.02, between(1e-4, 1.0), "";
        /// How far gains are expected to lie from 1, as a standard deviation of their natural logarithm. Lower keeps long
        /// rows of photographs from drifting in brightness, higher follows the measured ratios.
        gain_deviation: f64 = 2.0, between(1e-3, 100.0), "";
        /// How far a channel's gain is expected to lie from the mean of the channels, as a standard deviation of natural
        /// logarithms. Lower keeps long rows of photographs from drifting in color.
        cast_deviation: f64 = 0.2, between(1e-3, 100.0), "";
        /// How strong vignetting is expected to be, as a standard deviation of every coefficient of its natural logarithm.
        /// Lower trusts that the lenses are good, higher follows the overlaps.
        vignetting_deviation: f64 = 0.6, between(1e-4, 100.0), "";
        /// Whether the cameras' response is estimated beside the full model, one for all photographs; without, their samples
        /// are taken for light by the color profile's curve.
        response: bool = true, Allowed::Any, "";
        /// How far the response is expected to lie from the color profile's curve, as a standard deviation of every
        /// coefficient of its natural logarithm.
        response_deviation: f64 = 0.5, between(1e-4, 100.0), "";
        /// Largest gain; the smallest is its inverse. Photographs of sun and shade that each were exposed for what they show lie
        /// up to five stops apart.
        max_gain: f64 = 32.0, between(1.0, 1000.0), "";
    }
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

/// Estimates the corrections of the photographs of `layout` from `thumbnails`, one for each in the same order;
/// `reference` is the position of the photograph that [`GainAnchor::Reference`] keeps.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if thumbnails and layout do not fit together; [`Error::Unsolvable`] if a vertex is
/// not finite; [`Error::Cancelled`].
///
/// # Source
/// Gains: Brown, Lowe, "Automatic panoramic image stitching using invariant features", IJCV 74(1), 2007, section 6.
/// Vignetting from overlaps: Goldman, Chen, "Vignette and exposure calibration and compensation", ICCV 2005 (even
/// polynomial of the sixth degree, exposures and lens together). Response from unknown exposures: Mitsunaga, Nayar,
/// "Radiometric self calibration", CVPR 1999; that a power of it cannot be known: Grossberg, Nayar, "Determining the camera
/// response from images: what is knowable?", TPAMI 25(11), 2003.
///
/// # Departures
/// All errors are on logarithms, where the whole model is linear; the published error of the gains on intensities draws
/// them towards zero and is led by bright outliers. The response is a correction of the transfer curve of the photographs' color
/// space, one for all channels, whose mean slope stays that of the curve; its functions are read off the light that both
/// photographs together say, not off each one's own noisy sample.
pub fn run(
    layout: &CanvasLayout,
    thumbnails: &[Thumbnail<'_>],
    reference: usize,
    options: &ExposureOptions,
    context: &StageContext,
) -> Result<Exposure> {
    check(layout, thumbnails, reference, options)?;
    let count = layout.placed.len();
    if !options.enabled || count < 2 {
        return Ok(Exposure { corrections: Corrections::plain(count), pairs: Vec::new() });
    }
    let scale = sampling_scale(layout, options.samples);
    let turn = layout.period.map(|period| (period as f64 * scale).round() as usize);
    let [width, height] = [layout.width, layout.height].map(|length| (length as f64 * scale).ceil() as usize);
    let size = [turn.unwrap_or(width), height];
    // Samples of a turn lie on the photographs, not on the canvas: the same wherever it is cut open.
    let anchor = layout.period.and_then(|_| layout.placed.first()?.mesh.target.first().map(|vertex| vertex[0]));
    let patches: Vec<Patch> = layout
        .placed
        .par_iter()
        .zip(thumbnails)
        .map(|(placed, thumbnail)| {
            context.check_cancelled()?;
            let placed = anchor.map_or(Cow::Borrowed(placed), |anchor| Cow::Owned(placed.moved(-anchor)));
            Ok(Patch::new(&placed, thumbnail, scale, size, layout.period, options))
        })
        .collect::<Result<_>>()?;
    let observed: Vec<Observed> = (0..count)
        .into_par_iter()
        .map(|first| {
            context.check_cancelled()?;
            Ok((first + 1..count)
                .filter_map(|second| {
                    compare(
                        shared(&patches[first], &patches[second], turn),
                        [first, second],
                        thumbnails[first].curve,
                        options,
                    )
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    let cameras: Vec<usize> = thumbnails.iter().map(|thumbnail| thumbnail.camera).collect();
    let response_asked = options.response && options.model == ExposureModel::Full;
    // One response is fitted for one color profile.
    let profile = thumbnails
        .first()
        .map(|thumbnail| thumbnail.curve)
        .filter(|&profile| response_asked && thumbnails.iter().all(|thumbnail| thumbnail.curve == profile));
    let corrections = solve(&cameras, &observed, (reference, profile), options, context)?;
    Ok(Exposure { corrections, pairs: observed.into_iter().map(|observed| observed.pair).collect() })
}

fn check(
    layout: &CanvasLayout,
    thumbnails: &[Thumbnail<'_>],
    reference: usize,
    options: &ExposureOptions,
) -> Result<()> {
    options.check()?;
    layout.placed.iter().try_for_each(check_mesh)?;
    let usable = |thumbnail: &Thumbnail| {
        thumbnail.raster.channels() == 3
            && !thumbnail.raster.data().is_empty()
            && thumbnail.frame.working_from_full > 0.0
    };
    if thumbnails.len() != layout.placed.len() || !thumbnails.iter().all(usable) {
        return Err(Error::input(
            STAGE,
            format!("{} thumbnails for {} photographs, or one not RGB", thumbnails.len(), layout.placed.len()),
            "Give one three-channel thumbnail for each photograph.",
        ));
    }
    if reference >= layout.placed.len() && options.anchor == GainAnchor::Reference {
        return Err(Error::input(
            STAGE,
            "the reference is not in the panorama",
            "Choose one of the photographs in use.",
        ));
    }
    Ok(())
}

/// Factor from the canvas to the grid of samples, at most 1: the median photograph gets `samples` of them.
fn sampling_scale(layout: &CanvasLayout, samples: f64) -> f64 {
    let mut areas: Vec<f64> = layout
        .placed
        .iter()
        .map(|placed| {
            let (low, high) = placed.mesh.bounds();
            let extent = high - low;
            extent.x * extent.y
        })
        .collect();
    areas.sort_by(f64::total_cmp);
    let median = areas.get(areas.len() / 2).copied().unwrap_or(1.0).max(1.0);
    // Coordinates beyond this are no sampling grid any more.
    const MAX_SIDE: f64 = 16_384.0;
    let scale = (samples / median).sqrt().min(1.0).min(MAX_SIDE / layout.width.max(layout.height) as f64);
    // A turn is a whole number of samples.
    let whole = |period: usize| (period as f64 * scale).ceil() / period as f64;
    layout.period.map_or(scale, whole)
}

#[cfg(test)]
mod recovery_tests;
#[cfg(test)]
mod tests;
