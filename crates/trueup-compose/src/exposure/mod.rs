//! One look for all photographs: gain, color cast and vignetting, estimated together where photographs overlap.
//!
//! All factors act on linear light, so that they add up as logarithms: what photograph i shows of a place, times its
//! gain, times its lens's correction there, equals the same of photograph j. The overlaps give one such equation per
//! sample and channel; moving things and ghosts are weighed down by their residuals, saturated samples do not take
//! part. What is linear light is estimated, too, as a [`Response`] beside the color profile's curve. The reference
//! keeps its colors, but for its vignetting; how bright the whole is, all photographs decide.

mod equations;
mod evidence;
mod level;
mod measured;
mod options;
mod overlap;
mod predicted;
mod robust;
mod samples;
mod shoulder;
mod solution;
mod solve;

pub use crate::light::{Correction, Corrections, RESPONSE_TERMS, Response, VIGNETTING_TERMS};
pub use measured::{Exposure, ExposureInput, PairExposure, Thumbnail};
pub use options::{ExposureModel, ExposureOptions, GainAnchor};

use std::borrow::Cow;

use rayon::prelude::*;
use trueup_core::options::StageOptions;
use trueup_core::{Error, Result, StageContext};

use crate::layout::{CanvasLayout, check_mesh};
use overlap::{Observed, compare, kept_of_each};
use samples::{Patch, meet, shared};
use solve::{SolveInput, solve};

const STAGE: &str = ExposureOptions::STAGE;

/// Estimates the corrections of photographs from their reduced copies.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if thumbnails and layout do not fit together; [`Error::Unsolvable`] if a vertex
/// is not finite; [`Error::Cancelled`].
///
/// # Source
/// Gains: Brown, Lowe, "Automatic panoramic image stitching using invariant features", IJCV 74(1), 2007, section 6.
/// Vignetting from overlaps: Goldman, Chen, "Vignette and exposure calibration and compensation", ICCV 2005 (even
/// polynomial of the sixth degree, exposures and lens together). Response from unknown exposures: Mitsunaga, Nayar,
/// "Radiometric self calibration", CVPR 1999; that a power of it cannot be known: Grossberg, Nayar, "Determining the
/// camera response from images: what is knowable?", TPAMI 25(11), 2003.
///
/// # Departures
/// All errors are on logarithms, where the whole model is linear; the published error of the gains on intensities draws
/// them towards zero and is led by bright outliers. The response is a correction of the transfer curve of the
/// photographs' color space, one for all channels, whose mean slope stays that of the curve; its functions are read off
/// the light that both photographs together say, not off each one's own noisy sample.
pub fn run(input: &ExposureInput<'_>, options: &ExposureOptions, context: &StageContext) -> Result<Exposure> {
    check(input, options)?;
    let &ExposureInput { layout, thumbnails, reference, look } = input;
    let count = layout.placed.len();
    if !options.enabled || count < 2 {
        return Ok(Exposure { corrections: Corrections::plain(count), pairs: Vec::new() });
    }
    let scale = sampling_scale(layout);
    let turn = layout.period.map(|period| (period as f64 * scale).round() as usize);
    let [width, height] = [layout.width, layout.height].map(|length| (length as f64 * scale).ceil() as usize);
    let size = [turn.unwrap_or(width), height];
    // Samples of a turn lie on the photographs, not on the canvas: the same wherever it is cut open.
    let is_placed = |vertex: &&[f64; 2]| vertex.iter().all(|coordinate| coordinate.is_finite());
    let anchor =
        layout.period.and_then(|_| layout.placed.first()?.mesh.target.iter().find(is_placed).map(|place| place[0]));
    let patches: Vec<Patch> = layout
        .placed
        .par_iter()
        .zip(thumbnails)
        .map(|(placed, thumbnail)| {
            context.check_cancelled()?;
            let placed = anchor.map_or(Cow::Borrowed(placed), |anchor| Cow::Owned(placed.moved(-anchor)));
            Ok(Patch::new(&placed, thumbnail, scale, size, layout.period))
        })
        .collect::<Result<_>>()?;
    let following: Vec<Vec<usize>> = (0..count)
        .into_par_iter()
        .map(|first| (first + 1..count).filter(|&second| meet(&patches[first], &patches[second], turn)).collect())
        .collect();
    let kept_samples = kept_of_each(following.iter().map(Vec::len).sum());
    let observed: Vec<Observed> = following
        .into_par_iter()
        .enumerate()
        .map(|(first, following)| {
            context.check_cancelled()?;
            let observed = |second: usize| {
                let samples = shared(&patches[first], &patches[second], turn);
                compare(&samples, [first, second], thumbnails[first].curve, kept_samples)
            };
            Ok(following.into_iter().filter_map(observed).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    drop(patches);
    let cameras: Vec<usize> = thumbnails.iter().map(|thumbnail| thumbnail.camera).collect();
    let response_asked = options.response && options.model == ExposureModel::Full;
    // One response is fitted for one color profile; light has none.
    let profile = thumbnails.first().map(|thumbnail| thumbnail.curve).filter(|&profile| {
        let is_of_all = || thumbnails.iter().all(|thumbnail| thumbnail.curve == profile);
        response_asked && profile.light_range().is_none() && is_of_all()
    });
    let input = SolveInput { cameras: &cameras, observed: &observed, thumbnails, reference, look, profile };
    let corrections = solve(&input, options, context)?;
    Ok(Exposure { corrections, pairs: observed.into_iter().map(|observed| observed.pair).collect() })
}

fn check(input: &ExposureInput<'_>, options: &ExposureOptions) -> Result<()> {
    options.check()?;
    let &ExposureInput { layout, thumbnails, reference, .. } = input;
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
    if reference >= layout.placed.len() && options.anchor != GainAnchor::Mean {
        return Err(Error::input(
            STAGE,
            "the reference is not in the panorama",
            "Choose one of the photographs in use.",
        ));
    }
    Ok(())
}

/// Samples taken across a photograph, about, when the overlaps are compared.
const SAMPLES: f64 = 10_000.0;
/// Samples taken across all photographs, about, at most: 64 MB. Each of a thousand still has several times as many as
/// are kept of its overlaps.
const SAMPLES_OF_ALL: f64 = 4e6;

/// Factor from the canvas to the grid of samples, at most 1: the median photograph gets [`SAMPLES`] of them, or its
/// part of [`SAMPLES_OF_ALL`].
fn sampling_scale(layout: &CanvasLayout) -> f64 {
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
    let samples = SAMPLES.min(SAMPLES_OF_ALL / areas.len().max(1) as f64);
    let scale = (samples / median).sqrt().min(1.0).min(MAX_SIDE / layout.width.max(layout.height) as f64);
    // A turn is a whole number of samples.
    let whole = |period: usize| (period as f64 * scale).ceil() / period as f64;
    layout.period.map_or(scale, whole)
}

#[cfg(test)]
mod recovery_tests;
#[cfg(test)]
mod tests;
