//! Frames of a video that lie in a folder as files: of many that show nearly the same, those that a panorama needs.
//!
//! No folder of photographs may lose one. Files are taken for frames only if all of this holds: there are thirty or
//! more of one format and size, numbered in order under one name; no camera wrote its name or its lens into them;
//! nearly each shows at least 85 % of what the one before does, in the same light; and fewer than half of them are
//! needed.

use std::path::Path;

use rayon::prelude::*;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::raster::luma_256ths;
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};
use trueup_io::decode::{self, FilePhotographs};
use trueup_io::source::FrameUse;
use trueup_vision::frames::FrameChooser;

use super::budget::Budget;
use crate::inputs::{Inputs, Reference};
use crate::options::StitchOptions;

/// The code of files that are not used because they are frames of a video.
pub const FRAMES_PASSED_OVER: &str = "frames-passed-over";

/// Fewest files that are looked at: a second of video. Fewer are stitched soon enough as they are.
const FEWEST: usize = 30;

/// Share of a frame that the next one shows, too. Photographs that were taken one by one have half or three quarters in
/// common; where all have so much, every second one is enough.
const LEAST_OVERLAP: f64 = 0.85;

/// Most that the mean level changes from a frame to the next, gray levels: half a stop, by which the exposures of a
/// bracket differ at least, changes a dark picture of level 40 by as much.
const MOST_CHANGE: f64 = 8.0;

/// Share of the steps from a file to the next that are those of a video; what else there is are cuts and flashes.
const NEARLY_ALL: f64 = 0.95;

/// Steps that are looked at before all files are decoded.
const PROBES: usize = 8;

/// Pixels to which frames are reduced: enough to see blur, and soon read.
const SMALL_PIXELS: f64 = 480.0 * 360.0;

/// Most frames that are decoded at a time, if the memory is not less.
const AT_ONCE: usize = 64;

/// The numbers of the photographs without the frames that no panorama needs. Nothing is passed over where the user
/// speaks of single photographs or wants them all.
///
/// # Errors
/// [`trueup_core::Error::Limits`] if one cannot be measured in the memory; [`trueup_core::Error::Cancelled`].
pub(super) fn needed(
    images: &[SourceImage],
    inputs: &Inputs,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Vec<usize>> {
    let is_of_single_ones =
        inputs.graph.is_some() || inputs.reference != Reference::Auto || !inputs.masks.is_empty() || inputs.require_all;
    if options.measure.source.frames == FrameUse::All || is_of_single_ones {
        return Ok((0..images.len()).collect());
    }
    let mut kept = Vec::with_capacity(images.len());
    let mut start = 0;
    let is_file = |image: &SourceImage| inputs.in_memory.of(image).is_none();
    for run in images.chunk_by(|one, next| is_file(one) && is_file(next) && may_follow(one, next)) {
        match needed_of(run, options, context)? {
            Some(numbers) => {
                context.report(told(run, numbers.len()));
                kept.extend(numbers.into_iter().map(|number| start + number));
            }
            None => kept.extend(start..start + run.len()),
        }
        start += run.len();
    }
    Ok(kept)
}

/// Whether two files may be frames of one video, by all but their pixels.
fn may_follow(one: &SourceImage, next: &SourceImage) -> bool {
    let is_by_a_camera =
        |image: &SourceImage| image.camera_model.is_some() || image.lens_model.is_some() || image.focal_mm.is_some();
    let size = |image: &SourceImage| (image.width, image.height, image.is_float);
    let numbers = (numbered(&one.path), numbered(&next.path));
    let (Some((one_start, one_number)), Some((next_start, next_number))) = numbers else { return false };
    one_start == next_start
        && one_number < next_number
        && one.path.parent() == next.path.parent()
        && one.path.extension() == next.path.extension()
        && size(one) == size(next)
        && !one.is_float
        && !is_by_a_camera(one)
        && !is_by_a_camera(next)
}

/// The name of a file before the number that it ends in, and that number.
fn numbered(path: &Path) -> Option<(&str, u64)> {
    let stem = path.file_stem()?.to_str()?;
    let start = stem.trim_end_matches(|character: char| character.is_ascii_digit());
    Some((start, stem[start.len()..].parse().ok()?))
}

/// The numbers of those of `run` that are needed; `None` if they are not frames of a video, or one cannot be read.
fn needed_of(run: &[SourceImage], options: &StitchOptions, context: &StageContext) -> Result<Option<Vec<usize>>> {
    if run.len() < FEWEST {
        return Ok(None);
    }
    let files = FilePhotographs::new(run.to_vec(), 0);
    let measuring = Budget::new(&options.run.resources).measuring(&files, options.measure.working.pixels)?;
    let at_once = measuring.at_once.min(AT_ONCE);
    let probed: Vec<usize> = (0..PROBES).map(|probe| probe * (run.len() - 2) / (PROBES - 1)).collect();
    let mut others = 0;
    for &first in &probed {
        let pair = Followed::new(&run[first..first + 2], at_once, context)?;
        others += usize::from(!pair.is_some_and(|pair| pair.is_video(1.0)));
        // One may be a cut.
        if others > 1 {
            return Ok(None);
        }
    }
    let Some(followed) = Followed::new(run, at_once, context)? else { return Ok(None) };
    let needed = followed.chooser.needed();
    Ok(Some(needed).filter(|needed| followed.is_video(NEARLY_ALL) && 2 * needed.len() < run.len()))
}

/// Files that are followed as if they were the frames of a video.
struct Followed {
    chooser: FrameChooser,
    /// Mean gray level of each.
    levels: Vec<f64>,
}

impl Followed {
    /// `None` if one cannot be read, which measuring tells of.
    fn new(run: &[SourceImage], at_once: usize, context: &StageContext) -> Result<Option<Self>> {
        let mut followed: Option<Self> = None;
        for some in run.chunks(at_once) {
            let small = |image: &SourceImage| {
                context.check_cancelled()?;
                Ok(decode::small(image, SMALL_PIXELS).ok())
            };
            let small = some.par_iter().map(small).collect::<Result<Option<Vec<_>>>>()?;
            let Some(small) = small else { return Ok(None) };
            for picture in small {
                let gray: Vec<u8> =
                    picture.data().as_chunks().0.iter().map(|&pixel| (luma_256ths(pixel) >> 8) as u8).collect();
                let new = || Self { chooser: FrameChooser::new(picture.width(), picture.height()), levels: Vec::new() };
                let followed = followed.get_or_insert_with(new);
                followed.chooser.push(&gray);
                let sum: u64 = gray.iter().map(|&level| u64::from(level)).sum();
                followed.levels.push(sum as f64 / gray.len().max(1) as f64);
            }
        }
        Ok(followed)
    }

    /// Whether at least this share of the steps are those of a video.
    fn is_video(&self, share: f64) -> bool {
        let changes = self.levels.windows(2).map(|two| (two[1] - two[0]).abs());
        let steps = self.chooser.steps();
        let alike =
            steps.iter().zip(changes).filter(|(overlap, change)| **overlap >= LEAST_OVERLAP && *change <= MOST_CHANGE);
        alike.count() as f64 >= share * steps.len() as f64
    }
}

fn told(run: &[SourceImage], used: usize) -> Diagnostic {
    let names = run.first().zip(run.last()).map(|(first, last)| format!("{} to {}", first.name, last.name));
    Diagnostic::note(
        FRAMES_PASSED_OVER,
        Subject::file(names.unwrap_or_default()),
        format!("they are {} frames of a video, numbered in order, of which {used} are needed and used", run.len()),
        "Set source.frames to all to use every one.",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A level that looks drawn: the output function of SplitMix64.
    fn drawn(place: u64) -> u8 {
        let mut z = place.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 56) as u8 / 2
    }

    /// A chooser of frames of 240 x 120 pixels that lie at these columns of a wall whose levels look drawn.
    fn followed(columns: &[usize], brighter: impl Fn(usize) -> f64) -> Followed {
        const SIZE: [usize; 2] = [240, 120];
        let mut chooser = FrameChooser::new(SIZE[0], SIZE[1]);
        let mut levels = Vec::new();
        for (number, column) in columns.iter().enumerate() {
            let level = |at: usize| {
                let (x, y) = ((at % SIZE[0] + column) / 10, at / SIZE[0] / 10);
                drawn((x as u64) << 32 | y as u64)
            };
            chooser.push(&(0..SIZE[0] * SIZE[1]).map(level).collect::<Vec<u8>>());
            levels.push(60.0 + brighter(number));
        }
        Followed { chooser, levels }
    }

    #[test]
    fn a_slow_pan_is_a_video_and_photographs_are_none() {
        let pan = |step: usize| (0..40).map(|number| step * number).collect::<Vec<usize>>();
        assert!(followed(&pan(12), |_| 0.0).is_video(NEARLY_ALL));
        // A third of the view apart, as photographs are.
        assert!(!followed(&pan(78), |_| 0.0).is_video(NEARLY_ALL));
        // One cut in forty is none; four are no video.
        let cut = |cuts: usize| (0..40).map(|number| 6 * number + 5000 * (number * cuts / 39)).collect::<Vec<usize>>();
        assert!(followed(&cut(1), |_| 0.0).is_video(NEARLY_ALL));
        assert!(!followed(&cut(4), |_| 0.0).is_video(NEARLY_ALL));
    }

    /// Two of three steps of a bracketed row show the same view.
    #[test]
    fn brackets_are_no_video() {
        let row: Vec<usize> = (0..45).map(|number| number / 3 * 80).collect();
        assert!(!followed(&row, |_| 0.0).is_video(NEARLY_ALL));
        // Nor those of a camera that stood still, which get brighter.
        assert!(!followed(&[0; 45], |number| 25.0 * (number % 3) as f64).is_video(NEARLY_ALL));
        assert!(followed(&[0; 45], |number| number as f64).is_video(NEARLY_ALL));
    }

    #[test]
    fn frames_go_by_their_numbers() {
        assert_eq!(numbered(Path::new("out/clip-000123.png")), Some(("clip-", 123)));
        assert_eq!(numbered(Path::new("7.png")), Some(("", 7)));
        assert_eq!(numbered(Path::new("clip.png")), None);
    }
}
