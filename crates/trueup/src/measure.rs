//! The first pass over the pixels: every photograph is decoded once, reduced, and measured.

use std::time::{Duration, Instant};

use rayon::prelude::*;
use trueup_core::lines::LineSegment;
use trueup_core::raster::Raster;
use trueup_core::source::{PhotographSource, WorkingFrame};
use trueup_core::{Error, Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_vision::features::{self, Features};
use trueup_vision::lines;

use crate::cache::Known;
use crate::clock::Clock;
use crate::masks;
use crate::options::StitchOptions;
use crate::refinement;

const STAGE: &str = "measuring";

/// What is known of a photograph after its pixels were looked at.
#[derive(Debug)]
pub(crate) struct Measured {
    pub frame: WorkingFrame,
    pub features: Features,
    /// In working pixels.
    pub lines: Vec<LineSegment>,
    /// Grey values at the working size, kept if the mesh is to be refined by pixels.
    pub gray: Option<Raster<u8>>,
    pub thumbnail: Raster<u8>,
    pub thumbnail_frame: WorkingFrame,
}

/// Time spent on one photograph.
#[derive(Default, Clone, Copy)]
struct Busy {
    decode: Duration,
    features: Duration,
    lines: Duration,
}

/// Measures every photograph in parallel but for those that earlier runs measured. A photograph that cannot be decoded yields its error; the others go on.
///
/// # Errors
/// [`Error::Cancelled`].
pub(crate) fn run(
    photographs: &FilePhotographs,
    known: Option<&Known<'_>>,
    options: &StitchOptions,
    context: &StageContext,
    clock: &mut Clock,
) -> Result<Vec<Result<Measured>>> {
    let count = photographs.images().len();
    context.progress().begin(STAGE, count as u64);
    let start = Instant::now();
    let measured: Vec<(Result<Measured>, Busy)> = (0..count)
        .into_par_iter()
        .map(|index| {
            let mut busy = Busy::default();
            let result = match known.and_then(|known| known.measured(index)) {
                Some(measured) => Ok(measured),
                None => {
                    let result = measure(photographs, index, options, context, &mut busy);
                    if let (Some(known), Ok(measured)) = (known, &result) {
                        known.keep_measured(index, measured);
                    }
                    result
                }
            };
            context.progress().advance(STAGE, 1);
            (result, busy)
        })
        .collect();
    context.progress().finish(STAGE);
    context.check_cancelled()?;
    let total = |part: fn(&Busy) -> Duration| measured.iter().map(|(_, busy)| part(busy)).sum::<Duration>();
    clock.share(
        start.elapsed(),
        &[
            ("decoding", total(|busy| busy.decode)),
            ("features", total(|busy| busy.features)),
            ("lines", total(|busy| busy.lines)),
        ],
    );
    Ok(measured.into_iter().map(|(result, _)| result).collect())
}

fn measure(
    photographs: &FilePhotographs,
    index: usize,
    options: &StitchOptions,
    context: &StageContext,
    busy: &mut Busy,
) -> Result<Measured> {
    context.check_cancelled()?;
    let image = &photographs.images()[index];
    let frame = WorkingFrame::new(image.width, image.height, options.stitch.working_pixels);
    let mut lap = Instant::now();
    let mut next_lap = || std::mem::replace(&mut lap, Instant::now()).elapsed();
    let picture = photographs.working(index, &frame, options.stitch.thumbnail_pixels)?;
    busy.decode = next_lap();
    let ignored = photographs.masks(index).ignored;
    let mut features = features::detect(&picture.gray, &options.features, context)?;
    busy.features = next_lap();
    let mut lines = lines::detect(&picture.gray, &options.lines, context)?;
    let mut thumbnail = picture.thumbnail;
    if let Some(ignored) = ignored {
        features = masks::outside(&features, &ignored, &frame);
        lines = masks::lines_outside(lines, &ignored, &frame);
        masks::blacken(&mut thumbnail, &ignored, &picture.thumbnail_frame);
    }
    busy.lines = next_lap();
    let gray = refinement::needs_pixels(options).then(|| refinement::eight_bit(&picture.gray));
    Ok(Measured { frame, features, lines, gray, thumbnail, thumbnail_frame: picture.thumbnail_frame })
}

/// The thumbnails of photographs that need not be measured, with their frames.
///
/// # Errors
/// Those of decoding; [`Error::Cancelled`].
pub(crate) fn thumbnails(
    photographs: &FilePhotographs,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Vec<(Raster<u8>, WorkingFrame)>> {
    let thumbnail = |index: usize| {
        context.check_cancelled()?;
        let image = &photographs.images()[index];
        let frame = WorkingFrame::new(image.width, image.height, options.stitch.working_pixels);
        let picture = photographs.working(index, &frame, options.stitch.thumbnail_pixels)?;
        let mut thumbnail = picture.thumbnail;
        if let Some(ignored) = photographs.masks(index).ignored {
            masks::blacken(&mut thumbnail, &ignored, &picture.thumbnail_frame);
        }
        Ok((thumbnail, picture.thumbnail_frame))
    };
    (0..photographs.images().len()).into_par_iter().map(thumbnail).collect()
}

/// Whether an error is about one photograph, so that the others can still be stitched.
pub(crate) fn concerns_one_photograph(error: &Error) -> bool {
    !matches!(error, Error::Cancelled | Error::Options(_))
}
