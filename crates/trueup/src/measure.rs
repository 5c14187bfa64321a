//! The first pass over the pixels: every photograph is decoded once, reduced, and measured.

use std::ops::Range;
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

/// With room for so many photographs per thread, no group of them is waited for.
const MANY_PER_THREAD: usize = 4;

/// What is known of a photograph after its pixels were looked at.
#[derive(Debug)]
pub(crate) struct Measured {
    pub frame: WorkingFrame,
    pub features: Features,
    /// In working pixels.
    pub lines: Vec<LineSegment>,
    /// Gray values at the working size, kept if the mesh is to be refined by pixels.
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

/// Measures every photograph, at most `at_once` in parallel, but for those that earlier runs measured. A photograph that
/// cannot be decoded yields its error; the others go on.
///
/// # Errors
/// [`Error::Cancelled`].
pub(crate) fn run(
    photographs: &FilePhotographs,
    (known, at_once): (Option<&Known<'_>>, usize),
    options: &StitchOptions,
    context: &StageContext,
    clock: &mut Clock,
) -> Result<Vec<Result<Measured>>> {
    let count = photographs.images().len();
    context.progress().begin(STAGE, count as u64);
    let start = Instant::now();
    let measured_one = |index: usize| {
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
    };
    // Threads that share a photograph's work may begin another one meanwhile: where memory counts, only groups limit them.
    let mut measured: Vec<(Result<Measured>, Busy)> = Vec::with_capacity(count);
    for group in groups(count, at_once) {
        measured.par_extend(group.into_par_iter().map(measured_one));
    }
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

/// The thumbnails of photographs that need not be measured, with their frames; at most `at_once` are made in parallel.
///
/// # Errors
/// Those of decoding; [`Error::Cancelled`].
pub(crate) fn thumbnails(
    photographs: &FilePhotographs,
    at_once: usize,
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
    let count = photographs.images().len();
    let mut thumbnails = Vec::with_capacity(count);
    for group in groups(count, at_once) {
        thumbnails.extend(group.into_par_iter().map(thumbnail).collect::<Result<Vec<_>>>()?);
    }
    Ok(thumbnails)
}

/// Photographs to be looked at together: all, if `at_once` leaves room for many per thread.
fn groups(count: usize, at_once: usize) -> impl Iterator<Item = Range<usize>> {
    let group = if at_once >= MANY_PER_THREAD * rayon::current_num_threads() { count } else { at_once };
    let group = group.max(1);
    (0..count).step_by(group).map(move |first| first..first.saturating_add(group).min(count))
}

/// Whether an error is about one photograph, so that the others can still be stitched.
pub(crate) fn concerns_one_photograph(error: &Error) -> bool {
    !matches!(error, Error::Cancelled | Error::Options(_))
}
