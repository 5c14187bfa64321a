//! The measure phase: every photograph is decoded once, reduced, and measured.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use trueup_core::diagnostics::Reported;
use trueup_core::raster::Raster;
use trueup_core::source::{SourceImage, WorkingFrame};
use trueup_core::{Error, Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_vision::border::even_border;
use trueup_vision::features;
use trueup_vision::lines;
use trueup_vision::padding::padding;

use super::budget::MANY_PER_THREAD;
use super::measured::Measured;
use super::outside::blacken;
use super::photographs::PhotographSet;
use super::shelf::{Shelf, ShelvedFeatures};
use crate::memo::{Key, MEASURED, Memo};
use crate::options::MeasureOptions;
use crate::workers::Division;

const STAGE: &str = "measuring";

/// Pixels of the small copies that exposures are compared on: enough for the brightness of an overlap, and small enough
/// to be kept for every photograph.
pub(crate) const THUMBNAIL_PIXELS: f64 = 30_000.0;

/// What the phase works on.
pub(crate) struct MeasureInput<'a> {
    pub set: &'a PhotographSet,
    /// Where what earlier runs measured is found.
    pub memo: Memo<'a>,
    /// Where the features go.
    pub shelf: &'a Shelf<'a>,
    /// Whether the gray values are handed on, for a mesh that is refined by pixels.
    pub keep_grays: bool,
    /// Who measures photographs elsewhere.
    pub workers: Option<Division<'a>>,
}

/// What the phase makes of the photographs, in their order.
#[derive(Debug, Default)]
pub(crate) struct Measurements {
    /// Each photograph's measurements, or why it could not be decoded.
    pub photographs: Vec<Result<Measured>>,
    /// What decides each of them; all `None` where nothing is kept.
    pub keys: Vec<Option<Key>>,
}

/// Photographs of one size that could be decoded, one at least.
#[derive(Default)]
pub(crate) struct OfOneSize<'a> {
    /// Ascending.
    pub numbers: Vec<usize>,
    /// Of each what was measured.
    pub measured: Vec<&'a Measured>,
}

impl Measurements {
    /// The photographs `images`, by their sizes.
    pub(crate) fn by_size(&self, images: &[SourceImage]) -> BTreeMap<[usize; 2], OfOneSize<'_>> {
        let mut by_size: BTreeMap<[usize; 2], OfOneSize> = BTreeMap::new();
        for (number, (image, outcome)) in images.iter().zip(&self.photographs).enumerate() {
            if let Ok(measured) = outcome {
                let of_size = by_size.entry([image.width, image.height]).or_default();
                of_size.numbers.push(number);
                of_size.measured.push(measured);
            }
        }
        by_size
    }
}

/// One photograph to be measured.
struct OnePhotograph<'a> {
    files: &'a FilePhotographs,
    index: usize,
    keep_grays: bool,
}

/// What the seconds of interleaved stages are called.
const DECODING: &str = "decoding";
const FEATURES: &str = "features";
const LINES: &str = "lines";

/// Measures every photograph, as many in parallel as the memory bears, but for those that earlier runs measured. A
/// photograph that cannot be decoded yields its error; the others go on.
///
/// # Errors
/// [`Error::Cancelled`].
pub(crate) fn run(
    input: &MeasureInput,
    options: &MeasureOptions,
    context: &StageContext,
) -> Result<Reported<Measurements>> {
    context.gather(|context| {
        let MeasureInput { set, memo, shelf, keep_grays, workers } = input;
        let contents = match memo.disk {
            Some(_) => context.time("source", || set.keys(&(0..set.images.len()).collect::<Vec<_>>(), context))?,
            None => vec![None; set.images.len()],
        };
        let keys: Vec<Option<Key>> = contents.into_iter().map(|content| memo.key(MEASURED, content, options)).collect();
        let count = set.images.len();
        context.progress().begin(STAGE, count as u64);
        let start = Instant::now();
        let recall = |key: &Option<Key>| memo.recall(MEASURED, key.as_ref()).map(|known| shelved(known, shelf));
        let mut known: Vec<Option<Reported<Measured>>> = keys.par_iter().map(recall).collect();
        if let Some(workers) = workers {
            let missing: Vec<usize> = (0..count).filter(|&index| known[index].is_none()).collect();
            workers.measured(&set.files, &missing, *keep_grays, context, |index, measured| {
                memo.store(MEASURED, keys[index].as_ref(), &measured);
                known[index] = Some(shelved(measured, shelf));
                context.progress().advance(STAGE, 1);
            })?;
        }
        let measured_one = |(index, known): (usize, Option<Reported<Measured>>)| {
            if let Some(known) = known {
                return Ok(known);
            }
            let one = OnePhotograph { files: &set.files, index, keep_grays: *keep_grays };
            let measured = memo.make(MEASURED, keys[index].as_ref(), &one, options, measure, context);
            context.progress().advance(STAGE, 1);
            measured.map(|measured| shelved(measured, shelf))
        };
        // Threads that share a photograph's work may begin another one meanwhile: where memory counts, only groups
        // limit them.
        let mut measured: Vec<Result<Reported<Measured>>> = Vec::with_capacity(count);
        for group in groups(count, set.measuring.at_once) {
            let first = group.start;
            let known: Vec<_> = known.drain(..group.len()).collect();
            let numbered = known.into_par_iter().enumerate().map(|(index, known)| (first + index, known));
            measured.par_extend(numbered.map(measured_one));
        }
        context.progress().finish(STAGE);
        context.check_cancelled()?;
        let busy = |stage: &'static str| {
            let seconds = measured.iter().flatten().filter_map(|one| one.seconds.get(stage));
            (stage, Duration::from_secs_f64(seconds.sum()))
        };
        context.share(start.elapsed(), &[busy(DECODING), busy(FEATURES), busy(LINES)]);
        let photographs = measured
            .into_iter()
            .map(|one| {
                one.map(|Reported { value, findings, .. }| {
                    findings.into_iter().for_each(|finding| context.report(finding));
                    value
                })
            })
            .collect();
        Ok(Measurements { photographs, keys })
    })
}

/// What some photographs of a set are measured as, in their order, for somebody else; `None` for those that are in
/// trouble, which is found out again, and told, by who asked.
///
/// # Errors
/// [`Error::Cancelled`]; [`Error::Options`].
pub(crate) fn of_some(
    input: &MeasureInput,
    photographs: &[usize],
    options: &MeasureOptions,
    context: &StageContext,
) -> Result<Vec<Option<Reported<Measured>>>> {
    let MeasureInput { set, keep_grays, .. } = *input;
    let measured_one = |&index: &usize| {
        let one = OnePhotograph { files: &set.files, index, keep_grays };
        match context.gather(|context| measure(&one, options, context)) {
            Ok(measured) => Ok(Some(measured)),
            Err(error) if concerns_one_photograph(&error) => Ok(None),
            Err(error) => Err(error),
        }
    };
    let mut measured = Vec::with_capacity(photographs.len());
    for group in photographs.chunks(set.measuring.at_once.max(1)) {
        measured.extend(group.par_iter().map(measured_one).collect::<Result<Vec<_>>>()?);
    }
    Ok(measured)
}

/// Measures some photographs of a set, in their order, as [`run`] does all of them: each, and what decides it.
///
/// # Errors
/// [`Error::Cancelled`].
pub(crate) fn some(
    input: &MeasureInput,
    photographs: &[usize],
    options: &MeasureOptions,
    context: &StageContext,
) -> Result<Reported<Measurements>> {
    context.gather(|context| {
        let MeasureInput { set, memo, shelf, keep_grays, .. } = input;
        let contents = match memo.disk {
            Some(_) => context.time("source", || set.keys(photographs, context))?,
            None => vec![None; photographs.len()],
        };
        let numbered: Vec<(usize, Option<Key>)> =
            photographs.iter().copied().zip(contents.into_iter().map(|one| memo.key(MEASURED, one, options))).collect();
        let measured_one = |(index, key): &(usize, Option<Key>)| {
            let one = OnePhotograph { files: &set.files, index: *index, keep_grays: *keep_grays };
            let measured = memo.run(MEASURED, key.as_ref(), &one, options, measure, context);
            measured.map(|measured| shelved(measured, shelf))
        };
        let mut measured: Vec<Result<Reported<Measured>>> = Vec::with_capacity(photographs.len());
        for group in numbered.chunks(set.measuring.at_once.max(1)) {
            measured.par_extend(group.par_iter().map(measured_one));
        }
        context.check_cancelled()?;
        let photographs = measured.into_iter().map(|one| one.map(|one| context.absorb(one))).collect();
        Ok(Measurements { photographs, keys: numbered.into_iter().map(|(_, key)| key).collect() })
    })
}

/// What was measured, its features on the shelf.
fn shelved(measured: Reported<Measured>, shelf: &Shelf) -> Reported<Measured> {
    let Reported { value, findings, seconds } = measured;
    Reported { value: Measured { features: value.features.put_on(shelf), ..value }, findings, seconds }
}

fn measure(one: &OnePhotograph, options: &MeasureOptions, context: &StageContext) -> Result<Measured> {
    context.check_cancelled()?;
    let OnePhotograph { files, index, keep_grays } = *one;
    let image = &files.sources()[index];
    let frame = WorkingFrame::new(image.width, image.height, options.working.pixels);
    let picture = context.time(DECODING, || files.working(index, &frame, THUMBNAIL_PIXELS))?;
    // Side by side, so that no core is left waiting for the last photograph.
    let (features, lines) = rayon::join(
        || context.time(FEATURES, || features::detect(&picture.gray, &options.features, context)),
        || {
            context.time(LINES, || -> Result<_> {
                let lines = lines::detect(&picture.gray, &options.lines, context)?;
                let curves = lines::edge_curves(&picture.gray, &lines);
                Ok((lines, curves))
            })
        },
    );
    let (features, (lines, curves)) = (features?, lines?);
    let mut measured = Measured {
        frame,
        features: ShelvedFeatures::Held(features),
        lines,
        curves,
        gray: keep_grays.then(|| eight_bit(&picture.gray)),
        border: even_border(&picture.gray),
        padding: padding(&picture.gray),
        thumbnail: picture.thumbnail,
        thumbnail_frame: picture.thumbnail_frame,
    };
    if let Some(ignored) = files.not_looked_at(index) {
        measured.forget(&ignored)?;
    }
    Ok(measured)
}

/// Gray values rounded to eight bits.
pub(crate) fn eight_bit(gray: &Raster<f32>) -> Raster<u8> {
    let mut rounded = Raster::new(gray.width(), gray.height(), 1);
    for (rounded, &value) in rounded.data_mut().iter_mut().zip(gray.data()) {
        // The cast saturates.
        *rounded = (value + 0.5) as u8;
    }
    rounded
}

/// A photograph's thumbnail.
#[derive(Debug)]
pub(crate) struct SmallCopy {
    pub thumbnail: Raster<u8>,
    pub frame: WorkingFrame,
}

/// The thumbnails of photographs that need not be measured, as many in parallel as the memory bears.
///
/// # Errors
/// Those of decoding; [`Error::Cancelled`].
pub(crate) fn thumbnails(
    set: &PhotographSet,
    options: &MeasureOptions,
    context: &StageContext,
) -> Result<Vec<SmallCopy>> {
    let photographs = &set.files;
    let thumbnail = |index: usize| {
        context.check_cancelled()?;
        let image = &photographs.sources()[index];
        let frame = WorkingFrame::new(image.width, image.height, options.working.pixels);
        let picture = photographs.working(index, &frame, THUMBNAIL_PIXELS)?;
        let mut thumbnail = picture.thumbnail;
        if let Some(ignored) = photographs.not_looked_at(index) {
            blacken(&mut thumbnail, &ignored, &picture.thumbnail_frame);
        }
        Ok(SmallCopy { thumbnail, frame: picture.thumbnail_frame })
    };
    let count = photographs.sources().len();
    let mut thumbnails = Vec::with_capacity(count);
    for group in groups(count, set.measuring.at_once) {
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
