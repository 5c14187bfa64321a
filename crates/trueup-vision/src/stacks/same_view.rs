//! Two small copies of photographs that may show the same view at two exposures.

use trueup_core::raster::Raster;

use super::likeness::{Likeness, expected, gray, likeness, stops_between};
use super::limits::{LEAST_STEP, LEAST_STOPS, MOST_SHIFT, ONE_EXPOSURE};
use crate::gray::halved;

/// Longest side, in pixels, of the copies that the search begins with.
const COARSEST_PX: usize = 64;
/// Correlation below which the coarsest copies are none of one view: half of what the finest must reach.
const WORTH_REFINING: f64 = 0.3;
/// Correlation of details from which small copies may show one view, which their alignment then decides.
const MAY_BE_SAME: f64 = 0.5;
/// Correlation of details from which small copies show one view, whether or not they can be aligned.
const SAME_VIEW: f64 = 0.75;
/// Share of tiles with detail that must agree.
const LEAST_AGREEING_TILES: f64 = 0.6;
/// How much brighter, in the mean of its levels, one of two exposures that are far enough apart is at least: half a
/// stop is a factor of 1.17 on the levels of all places that neither loses. Most photographs that follow one another
/// are told apart by that alone.
const LEAST_BRIGHTER: f64 = 1.05;
/// The same of two that were recorded as two exposures: a third of a stop is a factor of 1.11, and of the brightest of
/// a bracket most is white.
const LEAST_BRIGHTER_RECORDED: f64 = 1.02;
/// Or so much less dark, in the mean of what its levels lack of white: where most is white, a stop more adds next to
/// nothing to the mean.
const LEAST_LESS_DARK: f64 = 1.1;
/// White, in levels.
const WHITE: f64 = 255.0;
/// Share of the picture in which both must tell something.
const LEAST_TOLD: f64 = 0.02;

/// The same where cameras recorded as many stops as the pictures tell: of the brightest of a bracket next to nothing
/// may be left.
const LEAST_TOLD_RECORDED: f64 = 0.005;
/// Recorded and seen stops agree if they differ by no more than this ...
const AGREEING_STOPS: f64 = 1.0;
/// ... and this part of the recorded ones: the curve of a camera is not known.
const AGREEING_SHARE: f64 = 0.5;

/// A small copy ready to be compared.
#[derive(Debug)]
pub(super) struct SmallCopy {
    /// The finest first.
    levels: Vec<Raster<f32>>,
    brightness: f64,
}

impl SmallCopy {
    /// `None` for a copy that is no picture of three channels.
    pub(super) fn new(thumbnail: &Raster<u8>) -> Option<Self> {
        let gray = gray(thumbnail).filter(|gray| gray.width().min(gray.height()) >= 2)?;
        let mut levels = vec![smoothed(&gray)];
        while let Some(last) = levels.last()
            && last.width().max(last.height()) > COARSEST_PX
            && last.width().min(last.height()) >= 4
        {
            levels.push(halved(last));
        }
        let finest = levels[0].data();
        let brightness = finest.iter().map(|&level| f64::from(level)).sum::<f64>() / finest.len() as f64;
        Some(Self { levels, brightness })
    }
}

/// That two photographs show the same view at two exposures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SameView {
    /// How much brighter the second one is, in stops; negative if it is darker.
    pub(super) stops: f64,
    /// Where the second one shows a thing, minus where the first one does, as parts of the width.
    pub(super) shift: [f64; 2],
    /// Correlation of their details.
    pub(super) correlation: f64,
    /// Whether the two are a bracket by themselves: far enough apart, or recorded as two exposures. Others only join
    /// such ones.
    pub(super) is_bracket: bool,
}

impl SameView {
    /// Whether the view is the same, even if one of the two cannot be aligned.
    pub(super) fn is_sure(&self) -> bool {
        self.correlation >= SAME_VIEW
    }
}

/// `None` if `a` and `b`, of one size, do not show the same view, or at the same exposure. `recorded` are the stops by
/// which `b` took more light, if their cameras recorded it: what contradicts the pictures is none of a bracket, and
/// what differs where the record does not was made later, or is of the light.
///
/// Exposures that are nearer than half a stop, as cameras take them by half and third stops, count as well: as a
/// bracket where the record says the same as the pictures, else as what may join exposures that are farther apart.
pub(super) fn same_view(a: &SmallCopy, b: &SmallCopy, recorded: Option<f64>) -> Option<SameView> {
    if recorded.is_some_and(|stops| stops.abs() < ONE_EXPOSURE) {
        return None;
    }
    let b_is_bright = b.brightness >= a.brightness;
    let (dark, bright) = if b_is_bright { (a, b) } else { (b, a) };
    let least_brighter = if recorded.is_some() { LEAST_BRIGHTER_RECORDED } else { LEAST_BRIGHTER };
    let is_brighter = bright.brightness >= least_brighter * dark.brightness
        || WHITE - dark.brightness > LEAST_LESS_DARK * (WHITE - bright.brightness);
    if !is_brighter {
        return None;
    }
    let coarsest = dark.levels.len().min(bright.levels.len()) - 1;
    let mut best = [0_isize; 2];
    for level in (0..=coarsest).rev() {
        let (dark, bright) = (&dark.levels[level], &bright.levels[level]);
        let (reach, middle) = if level == coarsest {
            ((MOST_SHIFT * dark.width().max(dark.height()) as f64).ceil() as isize, [0; 2])
        } else {
            (1, best.map(|one| 2 * one))
        };
        let candidates = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [middle[0] + x, middle[1] + y]));
        let correlations =
            candidates.map(|shift| (compared(dark, bright, shift).map_or(-1.0, |found| found.correlation), shift));
        let (correlation, shift) = correlations.max_by(|one, other| one.0.total_cmp(&other.0))?;
        if correlation < WORTH_REFINING {
            return None;
        }
        best = shift;
    }
    let (dark, bright) = (&dark.levels[0], &bright.levels[0]);
    let found = compared(dark, bright, best)?;
    let stops = stops_between(dark, &shifted(bright, best))?;
    let sign = if b_is_bright { 1.0 } else { -1.0 };
    let is_far = stops >= LEAST_STOPS;
    let is_agreed = |recorded: f64| {
        let within_share = (sign * stops - recorded).abs() - AGREEING_SHARE * recorded.abs();
        // Of less than half a stop, a whole one more or less would say nothing, not even which one is brighter.
        within_share <= if is_far { AGREEING_STOPS } else { 0.0 }
    };
    let is_recorded = recorded.is_some_and(is_agreed);
    let least_told = if is_recorded { LEAST_TOLD_RECORDED } else { LEAST_TOLD };
    let is_bracket = is_far || is_recorded;
    // What makes no bracket itself must be sure.
    let least_correlation = if is_bracket { MAY_BE_SAME } else { SAME_VIEW };
    let is_same = found.correlation >= least_correlation
        && found.agreeing_tiles >= LEAST_AGREEING_TILES
        && found.told >= least_told;
    if !is_same || stops < LEAST_STEP || !(recorded.is_none() || is_recorded) {
        return None;
    }
    let shift = best.map(|pixels| sign * pixels as f64 / dark.width() as f64);
    Some(SameView { stops: sign * stops, shift, correlation: found.correlation, is_bracket })
}

/// The picture without what a shift by half a pixel changes: by 1 2 1 along both sides.
fn smoothed(picture: &Raster<f32>) -> Raster<f32> {
    let (width, height) = (picture.width(), picture.height());
    let mut along = picture.clone();
    for y in 0..height {
        let row = picture.row(y);
        for (x, value) in along.row_mut(y).iter_mut().enumerate() {
            *value = 0.25 * (row[x.saturating_sub(1)] + 2.0 * row[x] + row[(x + 1).min(width - 1)]);
        }
    }
    let mut smooth = along.clone();
    for y in 0..height {
        let (above, here, below) = (along.row(y.saturating_sub(1)), along.row(y), along.row((y + 1).min(height - 1)));
        for (x, value) in smooth.row_mut(y).iter_mut().enumerate() {
            *value = 0.25 * (above[x] + 2.0 * here[x] + below[x]);
        }
    }
    smooth
}

/// `picture` as it is seen from a frame whose pixels lie at theirs plus `shift`; NaN outside.
fn shifted(picture: &Raster<f32>, [x, y]: [isize; 2]) -> Vec<f32> {
    let (width, height) = (picture.width() as isize, picture.height() as isize);
    let at = |column: isize, row: isize| match (0..width).contains(&column) && (0..height).contains(&row) {
        true => picture.data()[(row * width + column) as usize],
        false => f32::NAN,
    };
    (0..height).flat_map(|row| (0..width).map(move |column| at(column + x, row + y))).collect()
}

fn compared(dark: &Raster<f32>, bright: &Raster<f32>, shift: [isize; 2]) -> Option<Likeness> {
    let (_, expected) = expected(dark, &shifted(bright, shift))?;
    Some(likeness(dark, &expected))
}
