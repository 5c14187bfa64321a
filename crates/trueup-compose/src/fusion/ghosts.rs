//! What the reference lets expect of another exposure, and where that exposure shows something else.

use std::ops::Range;

use rayon::prelude::*;
use trueup_core::color::{ToneRelation, ToneSums};
use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median};

/// Pixels of the small copies that are compared: as many as photographs are measured on, where noise is averaged away
/// and what is off by a part of a pixel is none.
const COMPARED_PIXELS: f64 = 480_000.0;
/// Beyond so many standard deviations of what pixels differ from what is expected, something else is there.
const UNEXPECTED: f32 = 4.0;
/// Levels that a pixel may differ by anyway: compression.
const LEAST_DIFFERENCE: f32 = 6.0;
/// Levels from which the reference tells that there is light, but not how much.
const CLIPPED: f32 = 250.0;
/// Levels up to which it tells of none.
const CRUSHED: f32 = 5.0;
/// Pixels of the small copies around a contradiction that are exchanged as well: a thing that moved has places where it
/// is by chance as bright as what is behind it.
const AROUND: usize = 4;
/// Pixels over which an exchange fades out.
const FADE: usize = 3;
/// Neighbors, of nine, that must contradict as well: single pixels are noise.
const LEAST_NEIGHBORS: usize = 4;
/// Times that the relation is fitted to what does not contradict the one before.
const ROUNDS: usize = 3;
/// Levels that share one standard deviation.
const LEVELS_TOGETHER: usize = 16;

/// A small copy in the reference's frame: colors and share, `None` where the photograph does not reach.
#[derive(Debug)]
pub(super) struct Small {
    width: usize,
    height: usize,
    /// Its pixels for each one of the reference.
    scale: f64,
    pixels: Vec<Option<[f32; 4]>>,
}

impl Small {
    /// Of a reference of `size`; `row` samples a row of the copy at a scale.
    pub(super) fn new(
        size: [usize; 2],
        row: impl Fn(f64, Range<usize>, usize) -> Vec<Option<[f32; 4]>> + Sync,
    ) -> Self {
        let scale = (COMPARED_PIXELS / (size[0] as f64 * size[1] as f64)).sqrt().min(1.0);
        let [width, height] = size.map(|length| ((length as f64 * scale) as usize).max(1));
        let pixels = (0..height).into_par_iter().flat_map_iter(|y| row(scale, 0..width, y)).collect();
        Self { width, height, scale, pixels }
    }

    /// Its pixels, row by row.
    pub(super) fn pixels(&self) -> &[Option<[f32; 4]>] {
        &self.pixels
    }
}

/// What the reference lets expect of an exposure.
#[derive(Debug)]
pub(super) struct Expectation {
    /// From the reference's levels to the exposure's, by channel.
    relations: [ToneRelation; 3],
    width: usize,
    height: usize,
    scale: f64,
    /// How much of each pixel is to be exchanged, 0 to 1.
    exchanged: Vec<f32>,
}

impl Expectation {
    /// `None` if the two have no place in common.
    pub(super) fn new(reference: &Small, other: &Small) -> Option<Self> {
        let (width, height) = (reference.width, reference.height);
        let mut contradicts = vec![false; width * height];
        let mut exchanged = vec![0.0; width * height];
        let mut relations = None;
        for round in 0..ROUNDS {
            // A thing that moved may be a good part of all that has a level: means would go half the way to it.
            let average = if round == 0 { Average::Median } else { Average::Mean };
            let fitted = Fitted::new(reference, other, &contradicts, average)?;
            let excess = fitted.excess(reference, other);
            contradicts = consolidated(&excess, [width, height]);
            exchanged = faded(&contradicts, other, [width, height]);
            relations = Some(fitted.relations);
        }
        Some(Self { relations: relations?, width, height, scale: reference.scale, exchanged })
    }

    /// The pixel of the exposure (NaN where it does not reach), exchanged as far as it contradicts `reference`, the
    /// reference's color there.
    pub(super) fn without_ghost(&self, pixel: [usize; 2], own: [f32; 4], reference: [f32; 3]) -> [f32; 4] {
        let share = if own[0].is_nan() { 1.0 } else { self.share_at(pixel) };
        if share <= 0.0 {
            return own;
        }
        let expected: [f32; 3] = std::array::from_fn(|channel| self.relations[channel].at(reference[channel]));
        if share >= 1.0 {
            return [expected[0], expected[1], expected[2], 1.0];
        }
        let mixed: [f32; 3] = std::array::from_fn(|channel| own[channel] + share * (expected[channel] - own[channel]));
        [mixed[0], mixed[1], mixed[2], 1.0]
    }

    /// Whether a pixel of the small copies is exchanged, if only in part.
    pub(super) fn is_exchanged(&self, index: usize) -> bool {
        self.exchanged[index] > 0.0
    }

    /// How much of a pixel of the reference is exchanged, between the small copy's pixels.
    pub(super) fn share_at(&self, [x, y]: [usize; 2]) -> f32 {
        let place = |pixel: usize, length: usize| {
            let at = ((pixel as f64 + 0.5) * self.scale - 0.5).clamp(0.0, (length - 1) as f64);
            let below = at as usize;
            (below, (below + 1).min(length - 1), (at - below as f64) as f32)
        };
        let ((left, right, u), (top, bottom, v)) = (place(x, self.width), place(y, self.height));
        let at = |x: usize, y: usize| self.exchanged[y * self.width + x];
        let upper = at(left, top) + u * (at(right, top) - at(left, top));
        let lower = at(left, bottom) + u * (at(right, bottom) - at(left, bottom));
        upper + v * (lower - upper)
    }
}

/// What stands for all pixels of one level.
#[derive(Debug, Clone, Copy)]
enum Average {
    Mean,
    Median,
}

/// The sums in which every pixel has the median of those of its level.
fn of_medians(pixels: impl Iterator<Item = (f32, f32)>) -> ToneSums {
    let mut of_level: Vec<Vec<f32>> = vec![Vec::new(); 256];
    for (level, other) in pixels {
        of_level[((level + 0.5) as usize).min(255)].push(other);
    }
    let mut sums = ToneSums::default();
    for (level, mut others) in of_level.into_iter().enumerate() {
        if let Some(median) = median(&mut others) {
            others.iter().for_each(|_| sums.add(level as f32, median));
        }
    }
    sums
}

/// Relations of tones with what pixels scatter about them.
struct Fitted {
    relations: [ToneRelation; 3],
    /// Standard deviation by channel and [`LEVELS_TOGETHER`] of the reference's levels.
    deviations: [Vec<f32>; 3],
}

impl Fitted {
    fn new(reference: &Small, other: &Small, contradicts: &[bool], average: Average) -> Option<Self> {
        let both = || {
            let pixels = reference.pixels.iter().zip(&other.pixels).zip(contradicts);
            pixels.filter_map(|((own, other), contradicts)| (!contradicts).then_some(((*own)?, (*other)?)))
        };
        let sums: [ToneSums; 3] = match average {
            Average::Mean => {
                let mut sums: [ToneSums; 3] = Default::default();
                for (own, other) in both() {
                    (0..3).for_each(|channel| sums[channel].add(own[channel], other[channel]));
                }
                sums
            }
            Average::Median => {
                let medians = |channel: usize| of_medians(both().map(|(own, other)| (own[channel], other[channel])));
                [medians(0), medians(1), medians(2)]
            }
        };
        let [red, green, blue] = sums.map(|sums| ToneRelation::fit(&sums));
        let relations = [red?, green?, blue?];
        let mut magnitudes: [Vec<Vec<f32>>; 3] = std::array::from_fn(|_| vec![Vec::new(); 256 / LEVELS_TOGETHER]);
        for (own, other) in both() {
            for channel in 0..3 {
                let difference = (other[channel] - relations[channel].at(own[channel])).abs();
                magnitudes[channel][own[channel] as usize / LEVELS_TOGETHER].push(difference);
            }
        }
        Some(Self { relations, deviations: magnitudes.map(|levels| levels.into_iter().map(deviation).collect()) })
    }

    /// How far each pixel is from what may be expected, in tolerances; 0 where nothing is known.
    fn excess(&self, reference: &Small, other: &Small) -> Vec<f32> {
        let (width, height) = (reference.width, reference.height);
        let row = |y: usize| {
            (0..width).map(move |x| {
                let Some(own) = other.pixels[y * width + x] else { return 0.0 };
                let (rows, columns) =
                    (y.saturating_sub(1)..(y + 2).min(height), x.saturating_sub(1)..(x + 2).min(width));
                let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
                for near in rows.flat_map(|y| reference.pixels[y * width..][columns.clone()].iter()).flatten() {
                    for channel in 0..3 {
                        low[channel] = low[channel].min(near[channel]);
                        high[channel] = high[channel].max(near[channel]);
                    }
                }
                let channel = |channel: usize| self.channel_excess(channel, own[channel], low[channel], high[channel]);
                (0..3).map(channel).fold(0.0, f32::max)
            })
        };
        (0..height).into_par_iter().flat_map_iter(row).collect()
    }

    /// The same of one channel whose neighbors in the reference have levels from `low` to `high`.
    fn channel_excess(&self, channel: usize, level: f32, low: f32, high: f32) -> f32 {
        if low > high {
            return 0.0;
        }
        let relation = &self.relations[channel];
        let least = if low <= CRUSHED { 0.0 } else { relation.at(low.min(CLIPPED)) };
        let most = if high >= CLIPPED { 255.0 } else { relation.at(high.max(CRUSHED)) };
        let scatter = |level: f32| self.deviations[channel][(level as usize).min(255) / LEVELS_TOGETHER];
        let tolerance = (UNEXPECTED * scatter(low).max(scatter(high))).max(LEAST_DIFFERENCE);
        (least - level).max(level - most).max(0.0) / tolerance
    }
}

/// From the median of magnitudes, as of a normal distribution.
fn deviation(mut magnitudes: Vec<f32>) -> f32 {
    median(&mut magnitudes).map_or(0.0, |median| SD_PER_MEDIAN_MAGNITUDE as f32 * median)
}

/// Where pixels contradict together, and what is around them.
fn consolidated(excess: &[f32], size: [usize; 2]) -> Vec<bool> {
    let unexpected: Vec<f32> = excess.iter().map(|&excess| f32::from(u8::from(excess > 1.0))).collect();
    let together = box_sums(&unexpected, size, 1);
    let core: Vec<f32> = unexpected
        .iter()
        .zip(together)
        .map(|(&unexpected, near)| if near >= LEAST_NEIGHBORS as f32 { unexpected } else { 0.0 })
        .collect();
    box_sums(&core, size, AROUND).into_iter().map(|near| near > 0.0).collect()
}

/// How much is exchanged: all where pixels contradict together and around, fading out beside them, and what the
/// exposure does not reach.
fn faded(contradicts: &[bool], other: &Small, size: [usize; 2]) -> Vec<f32> {
    let sharp: Vec<f32> = contradicts.iter().map(|&contradicts| f32::from(u8::from(contradicts))).collect();
    // A pixel is exchanged wholly where half of the box is: what contradicts lies [`AROUND`] pixels within.
    let half = ((2 * FADE + 1) * (2 * FADE + 1)) as f32 / 2.0;
    let blurred = box_sums(&sharp, size, FADE);
    let one = |(sum, pixel): (f32, &Option<[f32; 4]>)| if pixel.is_some() { (sum / half).min(1.0) } else { 1.0 };
    blurred.into_iter().zip(&other.pixels).map(one).collect()
}

/// Sums over boxes of `2 radius + 1` pixels a side, as far as the picture goes.
fn box_sums(values: &[f32], [width, height]: [usize; 2], radius: usize) -> Vec<f32> {
    let sums = |length: usize, at: &dyn Fn(usize) -> f32| -> Vec<f32> {
        let mut running = 0.0;
        let mut all = Vec::with_capacity(length);
        (0..radius.min(length)).for_each(|k| running += at(k));
        for k in 0..length {
            if k + radius < length {
                running += at(k + radius);
            }
            if k > radius {
                running -= at(k - radius - 1);
            }
            all.push(running);
        }
        all
    };
    let along: Vec<f32> = (0..height).flat_map(|y| sums(width, &|x| values[y * width + x])).collect();
    let mut all = vec![0.0; width * height];
    for x in 0..width {
        for (y, sum) in sums(height, &|y| along[y * width + x]).into_iter().enumerate() {
            all[y * width + x] = sum;
        }
    }
    all
}
