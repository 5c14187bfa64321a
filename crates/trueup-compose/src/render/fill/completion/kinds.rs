//! What around a gap is of the kind of its border.

use rayon::prelude::*;

use super::part::Part;
use super::samples::Samples;
use crate::window::near;

/// Most that a sample differs from one of the border that is of its kind, root of light.
const SAME_COLOR: f32 = 0.08;

/// The same of the deviation of its pixels, as a multiple and beyond it: a tree is as dark as the sky between clouds,
/// but not as even.
const SAME_DEVIATION: f32 = 1.5;

/// The same of the mean deviation around that of the border, as a multiple of its own: a pavement is as gray as a
/// tree's shade, but evener.
const SAME_TEXTURE: f32 = 2.0;

/// Deviations that are alike whatever their proportion: noise.
const NOISE: f32 = 0.01;

/// Half the side of the square of samples whose deviations are averaged.
const TEXTURE: usize = 2;

/// Least share of the border that is of the kind of what fills a gap: a lamp that ends at a border fills none.
const LEAST_OF_BORDER: f32 = 0.02;

/// Samples of a border that others are compared with, at most.
const MOST_KINDS: usize = 512;

/// What a sample shows.
struct Kind {
    color: [f32; 3],
    deviation: f32,
    /// Mean deviation of the samples around it.
    texture: f32,
}

impl Kind {
    fn is_of(&self, border: &Self) -> bool {
        (0..3).all(|k| (self.color[k] - border.color[k]).abs() <= SAME_COLOR)
            && self.deviation <= SAME_DEVIATION * border.deviation + NOISE
            && border.texture <= SAME_TEXTURE * self.texture + NOISE
    }
}

/// Which samples of a part are, with those around them, of the kind of the gap's border; `is_whole` tells which are
/// known and wholly covered.
pub(super) fn usable(part: &Part, samples: &Samples, is_whole: &[bool]) -> Vec<bool> {
    let (width, height) = (part.width(), part.rows.len());
    let deviations: Vec<f32> = samples.within(&part.columns, &part.rows).map(|at| samples.deviations[at]).collect();
    let square = |at: usize, reach: usize| {
        let (x, y) = (at % width, at / width);
        near(y, reach, height, false).flat_map(move |y| near(x, reach, width, false).map(move |x| y * width + x))
    };
    let texture = |at: usize| {
        let known = square(at, TEXTURE).filter(|&other| is_whole[other]);
        let (sum, count) = known.fold((0.0, 0.0_f32), |(sum, count), other| (sum + deviations[other], count + 1.0));
        sum / count.max(1.0)
    };
    let kind = |at: usize| {
        let color = part.colors[at].filter(|_| is_whole[at])?;
        Some(Kind { color, deviation: deviations[at], texture: texture(at) })
    };
    let step = part.border.len().div_ceil(MOST_KINDS).max(1);
    let border: Vec<Kind> = part.border.iter().step_by(step).filter_map(|&[at, _]| kind(at)).collect();
    let least = (LEAST_OF_BORDER * border.len() as f32).max(1.0) as usize;
    let is_of_kind = |at: usize| {
        kind(at).is_some_and(|own| border.iter().filter(|border| own.is_of(border)).take(least).count() == least)
    };
    let of_kind: Vec<bool> = (0..is_whole.len()).into_par_iter().map(is_of_kind).collect();
    (0..is_whole.len()).map(|at| square(at, 1).all(|other| of_kind[other])).collect()
}
