//! What photographs show differently because something moved or stood nearer, not because of their light.
//!
//! A wide transition carries what differs between two photographs over the seam. Light has to go over so; a dark coat
//! that one photograph alone shows would lie on what the other one shows there, as fog. Both are differences of some
//! levels over some width, and what tells them apart is their outline: where light differs from one place to the next,
//! both photographs show an edge there, or neither does; a thing has an outline that one of them alone shows.

use crate::label::{Label, NOBODY};
use crate::pyramid::{PyramidPlane, color};

/// Difference from what the photographs' light differs by around, up to which there is no thing, square root of linear
/// light; some 15 of 255 gray levels. What is left of smaller ones when a transition spreads them is not seen.
const STANDS_OUT: f32 = 0.06;

/// Change over three samples from which on it is an edge, square root of linear light: what stands out ends there, as
/// things do.
const EDGE: f32 = STANDS_OUT;

/// An edge is one photograph's alone where the other shows less than two fifths of it.
const ALONE: f32 = 0.6;

/// Trust, the fourth power of the share that is covered, from which on a sample shows what lies there.
const COVERED: f32 = 0.5;

/// Places of an outline that are asked at least.
const FEWEST_PLACES: usize = 4;

/// Times that the light around is averaged, each without what stood out from the mean before. The first begins with the
/// median of all.
const ROUNDS: usize = 3;

/// Belief in what stands out from the median of all, where nothing around does not.
const LEAST_BELIEF: f32 = 0.05;

/// Samples beyond a thing that its edge may be spread over, where the seam runs along it: those of the pyramid's
/// kernel.
const SPREAD: usize = 2;

/// Which placement of a photograph a level's samples show, if they show one alone.
pub(super) struct ShownAlone {
    width: usize,
    placements: Vec<Label>,
}

impl ShownAlone {
    /// Nobody, on a level of so many samples.
    pub(super) fn new([width, height]: [usize; 2]) -> Self {
        Self { width, placements: vec![NOBODY; width * height] }
    }

    /// Sets where a placement is shown alone, by its mask.
    pub(super) fn set(&mut self, placement: Label, mask: &PyramidPlane<f32>) {
        for y in mask.rows.clone() {
            let row = &mut self.placements[y * self.width..][mask.columns.clone()];
            for (shown, _) in row.iter_mut().zip(mask.row(y)).filter(|(_, mask)| **mask >= 1.0) {
                *shown = placement;
            }
        }
    }
}

/// A photograph and what is shown where it could be.
pub(super) struct Beside<'a> {
    /// The level cut along the seams.
    pub(super) cut: &'a PyramidPlane<[f32; 4]>,
    pub(super) shown: &'a ShownAlone,
    /// Where the photograph itself is shown.
    pub(super) mask: &'a PyramidPlane<f32>,
    /// Levels up to samples over whose width the light is averaged.
    pub(super) levels: u32,
}

/// Takes things out of a photograph's `differences` from what is shown (times their shares, as samples are): in their
/// place comes what the differences around them have in common.
pub(super) fn take_out(differences: &mut PyramidPlane<[f32; 4]>, beside: &Beside<'_>) {
    let stands_out = |texel: &[f32; 4]| color(*texel).is_some_and(|difference| largest(difference) > STANDS_OUT);
    if !differences.texels.iter().any(stands_out) {
        return;
    }
    let compared = Compared::new(differences, beside);
    let light = compared.light(beside.levels);
    let mut things = compared.things(&light);
    let [asked, taken_out] = compared.counts(&things);
    if taken_out == 0 || 2 * taken_out > asked {
        // Most of what differs: then it is the rest that may be a thing.
        return;
    }
    // As far as they are known: of a neighborhood that they fill, most of what was averaged may have been theirs.
    let light = compared.mean(beside.levels, |at, own| match color(light.texels[at]) {
        Some(light) if !things[at] => belief(own, light),
        _ => 0.0,
    });
    compared.spread(&mut things);
    let samples = differences.texels.iter_mut().zip(&light.texels).zip(&beside.mask.texels);
    for ((texel, light), mask) in samples.zip(things).filter_map(|(sample, is_thing)| is_thing.then_some(sample)) {
        if let Some([r, g, b]) = color(*light) {
            let share = texel[3] * (1.0 - mask);
            *texel = [r * share, g * share, b * share, texel[3]];
        }
    }
}

/// How far a difference is believed to be one of the light around it: fully up to where a thing begins, not at all from
/// twice as much on.
fn belief(own: [f32; 3], light: [f32; 3]) -> f32 {
    (2.0 - largest(minus(own, light)) / STANDS_OUT).clamp(0.0, 1.0)
}

fn largest(difference: [f32; 3]) -> f32 {
    difference.into_iter().fold(0.0, |largest, channel| largest.max(channel.abs()))
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A photograph's samples beside those that are shown.
struct Compared<'a> {
    differences: &'a PyramidPlane<[f32; 4]>,
    beside: &'a Beside<'a>,
    /// For every sample: whom it shows instead of the photograph, which covers it; [`NOBODY`] where that is not so.
    instead: Vec<Label>,
}

impl<'a> Compared<'a> {
    fn new(differences: &'a PyramidPlane<[f32; 4]>, beside: &'a Beside<'a>) -> Self {
        let ShownAlone { width, placements } = beside.shown;
        let mut instead = Vec::with_capacity(differences.texels.len());
        for y in differences.rows.clone() {
            let shown = &placements[y * width..][differences.columns.clone()];
            let samples = differences.row(y).iter().zip(beside.mask.row(y)).zip(shown);
            instead.extend(
                samples.map(|((texel, mask), &shown)| if texel[3] >= COVERED && *mask <= 0.0 { shown } else { NOBODY }),
            );
        }
        Self { differences, beside, instead }
    }

    fn width(&self) -> usize {
        self.differences.columns.len()
    }

    /// The difference at a sample where another photograph is shown instead.
    fn difference(&self, at: usize) -> Option<[f32; 3]> {
        color(self.differences.texels[at]).filter(|_| self.instead[at] != NOBODY)
    }

    /// What differences have in common around every sample.
    fn light(&self, levels: u32) -> PyramidPlane<[f32; 4]> {
        let middle = self.middle();
        let mut light = self.mean(levels, |_, own| belief(own, middle).max(LEAST_BELIEF));
        for _ in 1..ROUNDS {
            light = self.mean(levels, |at, own| color(light.texels[at]).map_or(0.0, |light| belief(own, light)));
        }
        light
    }

    /// The median of all differences, channel by channel.
    fn middle(&self) -> [f32; 3] {
        let all: Vec<[f32; 3]> = (0..self.instead.len()).filter_map(|at| self.difference(at)).collect();
        std::array::from_fn(|channel| {
            let mut values: Vec<f32> = all.iter().map(|difference| difference[channel]).collect();
            let half = values.len() / 2;
            if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(half, f32::total_cmp).1 }
        })
    }

    /// The mean of the differences around every sample, as wide as samples so many levels above; they are weighted by
    /// place and difference.
    fn mean(&self, levels: u32, weight: impl Fn(usize, [f32; 3]) -> f32) -> PyramidPlane<[f32; 4]> {
        let mut plane = self.differences.clone();
        for (at, texel) in plane.texels.iter_mut().enumerate() {
            let weight = self.difference(at).map_or(0.0, |difference| weight(at, difference));
            *texel = texel.map(|value| value * weight);
        }
        averaged(plane, levels)
    }

    /// Which samples belong to a thing.
    fn things(&self, light: &PyramidPlane<[f32; 4]>) -> Vec<bool> {
        let stands_out: Vec<bool> = (0..self.instead.len())
            .map(|at| match (self.difference(at), color(light.texels[at])) {
                (Some(own), Some(light)) => largest(minus(own, light)) > STANDS_OUT,
                _ => false,
            })
            .collect();
        let mut is_seen = vec![false; stands_out.len()];
        let mut things = vec![false; stands_out.len()];
        let mut part = Vec::new();
        for start in 0..stands_out.len() {
            if !stands_out[start] || is_seen[start] {
                continue;
            }
            part.clear();
            part.push(start);
            is_seen[start] = true;
            let mut outline = Outline::default();
            let mut next = 0;
            while let Some(&at) = part.get(next) {
                next += 1;
                for step in STEPS {
                    let Some(beyond) = self.same_beside(at, step) else { continue };
                    if !stands_out[beyond] {
                        outline.add(self.edge(at, beyond, step, &stands_out));
                    } else if !std::mem::replace(&mut is_seen[beyond], true) {
                        part.push(beyond);
                    }
                }
            }
            if outline.is_of_a_thing() {
                part.iter().for_each(|&at| things[at] = true);
            }
        }
        things
    }

    /// How many samples can be compared, and how many of them belong to things.
    fn counts(&self, things: &[bool]) -> [usize; 2] {
        [self.instead.iter().filter(|&&instead| instead != NOBODY).count(), things.iter().filter(|&&is| is).count()]
    }

    /// The sample one step from another, if it shows the same photograph instead.
    fn same_beside(&self, at: usize, [across, down]: [isize; 2]) -> Option<usize> {
        let (x, y) = ((at % self.width()).checked_add_signed(across)?, (at / self.width()).checked_add_signed(down)?);
        let beside = y * self.width() + x;
        (x < self.width() && y < self.differences.rows.len() && self.instead[beside] == self.instead[at])
            .then_some(beside)
    }

    /// What the photograph, and what is shown, change by over the outline between two samples, from one sample within
    /// to one outside.
    fn edge(&self, within: usize, outside: usize, step: [isize; 2], stands_out: &[bool]) -> [[f32; 3]; 2] {
        let back = step.map(|length| -length);
        let inner = self.same_beside(within, back).filter(|&at| stands_out[at]).unwrap_or(within);
        let outer = self.same_beside(outside, step).filter(|&at| !stands_out[at]).unwrap_or(outside);
        let shown = |at: usize| {
            let (x, y) = (at % self.width(), at / self.width());
            let columns = &self.differences.columns;
            color(self.beside.cut.row(self.differences.rows.start + y)[columns.start + x]).unwrap_or_default()
        };
        let difference = |at: usize| self.difference(at).unwrap_or_default();
        let of_shown = minus(shown(inner), shown(outer));
        let apart = minus(difference(inner), difference(outer));
        [of_shown, [of_shown[0] + apart[0], of_shown[1] + apart[1], of_shown[2] + apart[2]]]
    }

    /// Adds to things what lies so near to them that their edges are spread over it, where a seam runs along them.
    fn spread(&self, things: &mut [bool]) {
        let (width, height) = (self.width(), self.differences.rows.len());
        for _ in 0..SPREAD {
            let before = things.to_vec();
            for at in (0..before.len()).filter(|&at| before[at]) {
                for [across, down] in STEPS {
                    let x = (at % width).checked_add_signed(across).filter(|&x| x < width);
                    let y = (at / width).checked_add_signed(down).filter(|&y| y < height);
                    if let (Some(x), Some(y)) = (x, y)
                        && self.instead[y * width + x] == NOBODY
                    {
                        things[y * width + x] = true;
                    }
                }
            }
        }
    }
}

const STEPS: [[isize; 2]; 4] = [[-1, 0], [1, 0], [0, -1], [0, 1]];

/// The places at which something that stands out ends.
#[derive(Default)]
struct Outline {
    places: usize,
    /// Where one photograph alone shows an edge.
    alone: usize,
}

impl Outline {
    fn add(&mut self, [a, b]: [[f32; 3]; 2]) {
        let edge = largest(a).max(largest(b));
        self.places += 1;
        self.alone += usize::from(edge > EDGE && largest(minus(a, b)) > ALONE * edge);
    }

    fn is_of_a_thing(&self) -> bool {
        self.places >= FEWEST_PLACES && 2 * self.alone > self.places
    }
}

/// Means over the surroundings, as wide as samples so many levels above.
fn averaged(plane: PyramidPlane<[f32; 4]>, levels: u32) -> PyramidPlane<[f32; 4]> {
    let mut finer = Vec::new();
    let mut averaged = plane;
    for _ in 0..levels {
        let reduced = averaged.reduced();
        finer.push((averaged.columns, averaged.rows));
        averaged = reduced;
    }
    while let Some((columns, rows)) = finer.pop() {
        averaged = averaged.expanded(&columns, &rows);
    }
    averaged
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 48;
    const HEIGHT: usize = 32;
    /// The photograph itself is shown left of it.
    const SEAM: usize = 16;

    /// Differences of a photograph of gray levels `own` from one of levels `other` that is shown right of the seam,
    /// with things taken out.
    fn taken_out(own: impl Fn(usize, usize) -> f32, other: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        let plane = |level: &dyn Fn(usize, usize) -> f32| {
            let mut plane = PyramidPlane::<[f32; 4]>::new(0..WIDTH, 0..HEIGHT);
            for (at, texel) in plane.texels.iter_mut().enumerate() {
                let level = level(at % WIDTH, at / WIDTH);
                *texel = [level, level, level, 1.0];
            }
            plane
        };
        let cut = plane(&|x, y| if x < SEAM { own(x, y) } else { other(x, y) });
        let mut differences = plane(&|x, y| if x < SEAM { 0.0 } else { own(x, y) - other(x, y) });
        let mask = |left: bool| {
            let mut mask = PyramidPlane::<f32>::new(0..WIDTH, 0..HEIGHT);
            for (at, mask) in mask.texels.iter_mut().enumerate() {
                *mask = f32::from(u8::from((at % WIDTH < SEAM) == left));
            }
            mask
        };
        let mut shown = ShownAlone::new([WIDTH, HEIGHT]);
        shown.set(0, &mask(true));
        shown.set(1, &mask(false));
        let mask = mask(true);
        take_out(&mut differences, &Beside { cut: &cut, shown: &shown, mask: &mask, levels: 3 });
        differences.texels.iter().map(|texel| texel[0]).collect()
    }

    fn is_coat(x: usize, y: usize) -> bool {
        (SEAM..SEAM + 8).contains(&x) && (10..24).contains(&y)
    }

    /// A pavement of 0.5 and 0.45, and a dark coat beside the seam that the one or the other shows.
    #[test]
    fn a_thing_that_one_photograph_shows_is_taken_for_the_light_around_it() {
        let pavement = |_: usize, _: usize| 0.5;
        let coat = |x: usize, y: usize| if is_coat(x, y) { 0.1 } else { 0.45 };
        for (own, other, light) in [
            (&pavement as &dyn Fn(usize, usize) -> f32, &coat as &dyn Fn(usize, usize) -> f32, 0.05),
            (&coat, &pavement, -0.05),
        ] {
            let left = taken_out(own, other);
            for (at, difference) in left.into_iter().enumerate() {
                let expected = if at % WIDTH < SEAM { 0.0 } else { light };
                assert!((difference - expected).abs() < 0.01, "{difference} at {at}, {light}");
            }
        }
    }

    /// A roof under a sky: the sky differs by 0.2, the roof does not.
    #[test]
    fn light_that_differs_by_what_it_falls_on_stays() {
        let of_sky = |sky: f32| move |_: usize, y: usize| if y < 20 { sky } else { 0.3 };
        let left = taken_out(of_sky(0.9), of_sky(0.7));
        for (at, difference) in left.into_iter().enumerate() {
            let differs = at % WIDTH >= SEAM && at / WIDTH < 20;
            assert!((difference - if differs { 0.2 } else { 0.0 }).abs() < 1e-6, "{difference} at {at}");
        }
    }

    /// A glow without an outline.
    #[test]
    fn light_without_an_edge_stays() {
        let glow = |x: usize, y: usize| {
            let (x, y) = (x as f32 - 32.0, y as f32 - 16.0);
            0.4 + 0.3 * (-(x * x + y * y) / 200.0).exp()
        };
        let left = taken_out(glow, |_, _| 0.4);
        for (at, difference) in left.into_iter().enumerate() {
            let expected = if at % WIDTH < SEAM { 0.0 } else { glow(at % WIDTH, at / WIDTH) - 0.4 };
            assert!((difference - expected).abs() < 1e-6, "{difference} at {at}");
        }
    }
}
