//! Steps: how far a panorama's change of brightness across a line is from that of the photographs it may show.

use std::collections::BTreeMap;

use super::measured::{MeasuredPanorama, index, level};

/// Half width, in pixels, of the means whose difference is the step across a line: a step is seen over several pixels.
const STEP_REACH: usize = 8;

/// Side, in pixels, of the squares within which the steps along a line are averaged.
const STRETCH_PX: usize = 32;

/// Steps added up.
#[derive(Default)]
pub(super) struct Steps {
    pub(super) places: usize,
    sum: f64,
}

impl Steps {
    pub(super) fn mean(&self) -> f64 {
        self.sum / self.places.max(1) as f64
    }
}

/// Steps across the lines where the photograph shown changes, where a full turn's ends meet, and across some of its
/// columns.
pub(super) struct LineSteps {
    pub(super) seams: Steps,
    pub(super) wrap: Steps,
    pub(super) columns: Steps,
}

/// Where a stretch of a line lies, whether it runs down, and between whom; `None` stands for all who cover it.
type Stretch = (usize, usize, bool, Option<[u16; 2]>);

/// For each stretch and each photograph that may be shown there, sums of the panorama's steps and its own, and their
/// number.
#[derive(Default)]
struct Stretches(BTreeMap<Stretch, BTreeMap<u16, [f64; 3]>>);

impl Stretches {
    /// Of the photographs that cover all places of a stretch, the nearest counts.
    fn total(&self) -> Steps {
        let mut total = Steps::default();
        for photographs in self.0.values() {
            let places = photographs.values().map(|[_, _, places]| *places).fold(0.0, f64::max);
            let whole = photographs.values().filter(|[_, _, count]| *count >= places);
            total.places += places as usize;
            total.sum += whole.map(|[own, step, _]| (own - step).abs()).fold(f64::INFINITY, f64::min);
        }
        total
    }
}

/// A place on a line: between the pixel and its right neighbor if the line runs `down`, else the one below.
#[derive(Clone, Copy)]
struct Place {
    x: usize,
    y: usize,
    down: bool,
}

impl MeasuredPanorama<'_> {
    pub(super) fn steps(&self) -> LineSteps {
        let (width, height) = (self.gray.width(), self.gray.height());
        let [mut seams, mut wrap, mut columns] = [Stretches::default(), Stretches::default(), Stretches::default()];
        for y in 0..height {
            for x in 0..width {
                let here = self.shown[y * width + x];
                if let Some(&below) = self.shown.get((y + 1) * width + x).filter(|&&below| below != here) {
                    self.add(&mut seams, Place { x, y, down: false }, Some([here, below]));
                }
                if x + 1 < width || self.turn > 0 {
                    let (place, pair) = (Place { x, y, down: true }, [here, self.shown[y * width + (x + 1) % width]]);
                    if x + 1 == width {
                        self.add(&mut wrap, place, Some(pair));
                    }
                    if self.turn > 0 && x + 1 < width && (x + 1).is_multiple_of(STRETCH_PX) {
                        self.add(&mut columns, place, Some(pair));
                    }
                    if pair[0] != pair[1] {
                        self.add(&mut seams, place, Some(pair));
                    }
                }
            }
        }
        LineSteps { seams: seams.total(), wrap: wrap.total(), columns: columns.total() }
    }

    /// Steps across all lines, one in [`STEP_REACH`], along which the shares of the two photographs that lie deepest
    /// are even.
    pub(super) fn overlap_steps(&self) -> Steps {
        let mut stretches = Stretches::default();
        for y in 0..self.gray.height() {
            for x in 0..self.gray.width() {
                let (down, across) = ((x + 1).is_multiple_of(STEP_REACH), (y + 1).is_multiple_of(STEP_REACH));
                let Some(runs_down) = (down || across).then(|| self.goes_over_across(x, y)).flatten() else { continue };
                if if runs_down { down } else { across } {
                    self.add(&mut stretches, Place { x, y, down: runs_down }, None);
                }
            }
        }
        stretches.total()
    }

    /// Whether feathering goes over between photographs rather from column to column than from row to row; `None` where
    /// fewer than two lie.
    fn goes_over_across(&self, x: usize, y: usize) -> Option<bool> {
        let depth = |label: usize, x: usize, y: usize| {
            index(&self.layers[label], x, y, self.turn).map_or(0, |at| self.depths[label][at])
        };
        let mut deepest = [(0, 0); 2];
        for label in 0..self.layers.len() {
            let found = (depth(label, x, y), label);
            if found.0 > deepest[0].0 {
                deepest = [found, deepest[0]];
            } else if found.0 > deepest[1].0 {
                deepest[1] = found;
            }
        }
        let [(_, first), (second_depth, second)] = deepest;
        if second_depth == 0 {
            return None;
        }
        let share = |x: usize, y: usize| {
            let (a, b) = (f64::from(depth(first, x, y)), f64::from(depth(second, x, y)));
            if a + b > 0.0 { a / (a + b) } else { 0.5 }
        };
        let right = if self.turn > 0 { (x + 1) % self.turn } else { x + 1 };
        let here = share(x, y);
        Some((share(right, y) - here).abs() >= (share(x, y + 1) - here).abs())
    }

    /// The sixteen pixels across a line, where the canvas has them.
    fn pixels(&self, place: Place) -> Option<[[usize; 2]; 2 * STEP_REACH]> {
        let mut pixels = [[place.x, place.y]; 2 * STEP_REACH];
        let (axis, length) = if place.down { (0, self.gray.width()) } else { (1, self.gray.height()) };
        let turn = if place.down { self.turn } else { 0 };
        for (at, pixel) in pixels.iter_mut().enumerate() {
            let along = (pixel[axis] + turn + 1 + at).checked_sub(STEP_REACH)?;
            pixel[axis] = if turn > 0 { along % turn } else { along };
            if pixel[axis] >= length {
                return None;
            }
        }
        Some(pixels)
    }

    /// Adds the steps at a place on a line between two photographs, both of which must cover its pixels, or without a
    /// `pair` between all that do, two at least.
    fn add(&self, stretches: &mut Stretches, place: Place, pair: Option<[u16; 2]>) {
        let Some(pixels) = self.pixels(place) else { return };
        let step_of = |value: &dyn Fn(usize, usize) -> Option<f64>| -> Option<f64> {
            let mut step = 0.0;
            for (at, &[x, y]) in pixels.iter().enumerate() {
                let one = value(x, y)?;
                step += if at < STEP_REACH { -one } else { one };
            }
            Some(step / STEP_REACH as f64)
        };
        let of_photograph = |label: u16| {
            let layer = self.layers.get(usize::from(label))?;
            Some((label, step_of(&|x, y| level(layer, x, y, self.turn))?))
        };
        let mut found: Vec<(u16, f64)> = match pair {
            Some(pair) => pair.into_iter().filter_map(of_photograph).collect(),
            None => (0..self.layers.len()).filter_map(|label| of_photograph(label as u16)).collect(),
        };
        let enough = found.len() >= 2;
        // Both sides of the ends of a turn may show the same.
        found.dedup();
        let own = step_of(&|x, y| Some(f64::from(self.gray.pixel(x, y)[0])));
        if let (Some(own), true) = (own, enough) {
            let [first, second] = [pixels[0][1] / STRETCH_PX, pixels[0][0] / STRETCH_PX];
            let photographs = stretches.0.entry((first, second, place.down, pair)).or_default();
            for (label, step) in found {
                let sums = photographs.entry(label).or_default();
                for (sum, value) in sums.iter_mut().zip([own, step, 1.0]) {
                    *sum += value;
                }
            }
        }
    }
}
