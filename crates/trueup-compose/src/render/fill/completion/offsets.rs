//! By which offsets what is shown elsewhere goes on along the border of a gap.

use rayon::prelude::*;

use super::part::Part;
use super::samples::difference;

/// Stretches of the border that offsets are looked for apart, at most, and samples of each, at least.
const MOST_STRETCHES: usize = 16;
const LEAST_STRETCH: usize = 12;

/// Offsets that are kept for a stretch.
const KEPT: usize = 4;

/// Offsets that are tried at most, beside finer ones around the best.
const MOST_TRIED: usize = 1 << 13;

/// Samples of a stretch, and of the gap beside it, that an offset is tried on at most.
const MOST_ASKED: usize = 32;

/// Least share of these that what is shown elsewhere must have.
const LEAST_SHARE: f32 = 0.7;

/// A stretch of the border, and the samples of the gap beside it.
#[derive(Debug, Default)]
struct Stretch {
    border: Vec<usize>,
    gap: Vec<usize>,
}

/// The offsets, in samples, that continue some stretch of the border of a gap best, each once.
///
/// # Source
/// He, Sun, "Statistics of patch offsets for image completion", ECCV 2012: a gap is filled from few offsets.
///
/// # Departures
/// These are those that fit the border, each a stretch of it, rather than those at which patches repeat most often: of
/// clouds, none do.
pub(super) fn of(part: &Part) -> Vec<[isize; 2]> {
    let [width, height] = [part.width(), part.rows.len().min(part.reach_down)];
    let tried = |step: usize| (2 * width / step + 1) * (2 * height / step + 1);
    let step = (1..).find(|&step| tried(step) <= MOST_TRIED).unwrap_or(1);
    let along = |length: usize| {
        let most = (length / step * step) as isize;
        (-most..=most).step_by(step)
    };
    let all: Vec<[isize; 2]> = along(height).flat_map(|down| along(width).map(move |across| [across, down])).collect();
    let of_stretch = |stretch: &Stretch| {
        let error = |&offset: &[isize; 2]| error(part, stretch, offset).map(|error| (error, offset));
        let mut best: Vec<(f32, [isize; 2])> = all.iter().filter_map(error).collect();
        best.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        let mut kept: Vec<[isize; 2]> = Vec::new();
        for (_, offset) in best {
            // What lies beside one that is kept shows the same.
            let is_apart = |other: &[isize; 2]| (0..2).any(|axis| offset[axis].abs_diff(other[axis]) > 2 * step);
            if kept.len() < KEPT && kept.iter().all(is_apart) {
                kept.push(offset);
            }
        }
        let fine = step as isize - 1;
        let finest = |[across, down]: [isize; 2]| {
            let around = (down - fine..=down + fine)
                .flat_map(|down| (across - fine..=across + fine).map(move |across| [across, down]));
            let best = around.filter_map(|offset| error(&offset));
            best.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, offset)| offset)
        };
        kept.into_iter().filter_map(finest).collect::<Vec<_>>()
    };
    let found: Vec<Vec<[isize; 2]>> = stretches(part).par_iter().map(of_stretch).collect();
    let mut offsets: Vec<[isize; 2]> = Vec::new();
    for offset in found.into_iter().flatten() {
        if !offsets.contains(&offset) {
            offsets.push(offset);
        }
    }
    offsets
}

/// The mean difference of a stretch of the border from what lies at an offset; `None` where too little does.
fn error(part: &Part, stretch: &Stretch, offset: [isize; 2]) -> Option<f32> {
    let enough = |count: usize, all: usize| count as f32 >= LEAST_SHARE * all as f32;
    let shown = stretch.gap.iter().filter(|&&at| part.source(at, offset).is_some()).count();
    if !enough(shown, stretch.gap.len()) {
        return None;
    }
    let (mut sum, mut count) = (0.0, 0);
    for &at in &stretch.border {
        let Some(source) = part.source(at, offset).filter(|&source| source != at) else { continue };
        sum += difference(part.colors[at], part.colors[source]);
        count += 1;
    }
    (count > 0 && enough(count, stretch.border.len())).then(|| sum / count as f32)
}

/// The border in stretches of about one length, each with what lies beside it of the gap.
fn stretches(part: &Part) -> Vec<Stretch> {
    let count = (part.border.len() / LEAST_STRETCH).min(MOST_STRETCHES);
    let Some(&[first, _]) = part.border.first().filter(|_| count > 0) else { return Vec::new() };
    // Each the farthest from all before.
    let mut middles = vec![first];
    let mut distances: Vec<usize> = part.border.iter().map(|&[at, _]| part.distance_squared(at, first)).collect();
    while middles.len() < count {
        let Some(farthest) = (0..distances.len()).max_by_key(|&index| (distances[index], std::cmp::Reverse(index)))
        else {
            break;
        };
        let [middle, _] = part.border[farthest];
        middles.push(middle);
        for (distance, &[at, _]) in distances.iter_mut().zip(&part.border) {
            *distance = part.distance_squared(at, middle).min(*distance);
        }
    }
    let nearest =
        |at: usize| (0..middles.len()).min_by_key(|&index| part.distance_squared(at, middles[index])).unwrap_or(0);
    let mut stretches: Vec<Stretch> = middles.iter().map(|_| Stretch::default()).collect();
    part.border.iter().for_each(|&[at, _]| stretches[nearest(at)].border.push(at));
    part.gap.iter().for_each(|&at| stretches[nearest(at)].gap.push(at));
    for stretch in &mut stretches {
        for samples in [&mut stretch.border, &mut stretch.gap] {
            let step = samples.len().div_ceil(MOST_ASKED).max(1);
            *samples = samples.iter().copied().step_by(step).collect();
        }
    }
    stretches
}
