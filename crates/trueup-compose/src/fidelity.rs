//! How true the panorama is to the photographs it was made of: steps across seams, and ghosts.
//!
//! Both measures ask, wherever two photographs lie on each other, how far the panorama's gradient is from that of the
//! photograph it resembles most there. A panorama that shows one photograph at a time has a distance of 0 but at its seams;
//! a mean of photographs that do not fit shows the contours of both, each at half its strength, and is far from either.

use std::collections::BTreeMap;

use trueup_core::raster::{LUMA, Raster, RowSource};
use trueup_core::{Error, Result};

use crate::distance::border_distances;
use crate::render::Layer;

/// How true a panorama is to its photographs; grey levels from 0 to 255 of encoded luma.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fidelity {
    /// Places along the lines where the photograph shown changes.
    pub line_px: usize,
    /// Mean absolute step across those lines that no photograph shows.
    pub step: f64,
    /// Places along the line where the two ends of a full turn meet.
    pub wrap_px: usize,
    /// Mean absolute step across it that no photograph shows.
    pub wrap_step: f64,
    /// The same across columns within a full turn, 32 pixels apart: what `wrap_step` is to be compared with.
    pub column_step: f64,
    /// Pixels that two photographs cover.
    pub overlap_px: usize,
    /// Mean distance of the panorama's gradient from that of the nearest photograph: ghosts and blur.
    pub ghost: f64,
    /// Share of the overlaps where that distance is above [`GHOST_LEVEL`].
    pub ghost_share: f64,
}

/// Gradient distance from which on a ghost is seen, grey levels a pixel.
pub const GHOST_LEVEL: f64 = 8.0;

/// Half width, in pixels, of the means whose difference is the step across a line: a step is seen over several pixels.
const STEP_REACH: usize = 8;

/// Side, in pixels, of the squares within which the steps along a line are averaged.
const STRETCH_PX: usize = 32;

/// Measures `panorama` against `layers`, its photographs on the same canvas; `shown` is the position of the photograph
/// that each canvas pixel shows, or shows most, row by row.
///
/// The step at a place on a line between two photographs is the mean of the eight pixels on one side minus that of the
/// eight on the other, where both photographs cover all sixteen. It is averaged over the places of a line within a square
/// of 32 pixels: what the eye takes for a seam has one sign along it, while contours that are a little out of place change
/// theirs. The panorama's is then compared with that of both photographs, and the nearer one counts.
///
/// With `around` the canvas is a cylinder, whose first column lies beside its last. The step between these two is measured
/// all along them, whoever is shown there. Most of such a line lies within one photograph, which a seam never does; the same is
/// therefore measured across other columns, one in 32, for comparison.
///
/// # Errors
/// [`Error::Input`] if the sizes do not fit.
pub fn measure(panorama: &dyn RowSource, layers: &[Layer], shown: &[u16], around: bool) -> Result<Fidelity> {
    let (width, height) = (panorama.width(), panorama.height());
    if shown.len() != width * height || !layers.iter().all(|layer| fits(layer, [width, height], around)) {
        return Err(Error::input(
            "fidelity",
            "panorama and photographs are not of one canvas",
            "Measure them together.",
        ));
    }
    let gray = luma(panorama)?;
    let mut sums = Sums::default();
    let measured = Measured { gray: &gray, layers, shown, turn: if around { width } else { 0 } };
    measured.lines(&mut sums);
    measured.gradients(&mut sums);
    let total = |stretches: &BTreeMap<Stretch, [f64; 4]>| {
        stretches.values().fold((0, 0.0), |(places, step), [own, a, b, count]| {
            (places + *count as usize, step + (own - a).abs().min((own - b).abs()))
        })
    };
    let (line_px, step) = total(&sums.stretches);
    let (wrap_px, wrap_step) = total(&sums.wrap);
    let (column_px, column_step) = total(&sums.columns);
    let mean = |sum: f64, count: usize| if count > 0 { sum / count as f64 } else { 0.0 };
    Ok(Fidelity {
        line_px,
        step: mean(step, line_px),
        wrap_px,
        wrap_step: mean(wrap_step, wrap_px),
        column_step: mean(column_step, column_px),
        overlap_px: sums.overlap_px,
        ghost: mean(sums.ghost, sums.overlap_px),
        ghost_share: mean(sums.ghosts as f64, sums.overlap_px),
    })
}

/// The position of the photograph whose border is farthest, for every canvas pixel: what a feathered panorama shows most.
/// `u16::MAX` where nothing is.
///
/// # Errors
/// [`Error::Input`] if a layer lies outside the canvas of `size` pixels (width, height), a cylinder if `around`, or there
/// are too many.
pub fn deepest(layers: &[Layer], [width, height]: [usize; 2], around: bool) -> Result<Vec<u16>> {
    let all_fit = layers.iter().all(|layer| fits(layer, [width, height], around));
    if layers.len() >= usize::from(u16::MAX) || !all_fit {
        return Err(Error::input(
            "fidelity",
            "a photograph lies outside the canvas",
            "Measure a panorama's own layers.",
        ));
    }
    let mut shown = vec![u16::MAX; width * height];
    let mut best = vec![0; width * height];
    for (position, layer) in layers.iter().enumerate() {
        let depths = border_distances(layer.covered.data(), layer.covered.width());
        for (row, depths) in depths.chunks_exact(layer.covered.width().max(1)).enumerate() {
            let first = (layer.top + row) * width;
            for (x, &depth) in (layer.left..).zip(depths) {
                let at = first + x % width;
                if depth > best[at] {
                    best[at] = depth;
                    shown[at] = position as u16;
                }
            }
        }
    }
    Ok(shown)
}

fn luma(panorama: &dyn RowSource) -> Result<Raster<f32>> {
    let mut gray = Raster::new(panorama.width(), panorama.height(), 1);
    let mut row = vec![0; 4 * panorama.width()];
    for y in 0..panorama.height() {
        panorama.rgba8_row(y, &mut row)?;
        for (gray, pixel) in gray.row_mut(y).iter_mut().zip(row.chunks_exact(4)) {
            *gray = LUMA.iter().zip(pixel).map(|(share, &level)| share * f32::from(level)).sum();
        }
    }
    Ok(gray)
}

/// Where a stretch of a line lies, whether it runs down, and between whom.
type Stretch = (usize, usize, bool, u16, u16);

#[derive(Default)]
struct Sums {
    /// Steps of the panorama and of both photographs, and their number.
    stretches: BTreeMap<Stretch, [f64; 4]>,
    /// The same where the ends of a full turn meet.
    wrap: BTreeMap<Stretch, [f64; 4]>,
    /// The same across some of a full turn's other columns.
    columns: BTreeMap<Stretch, [f64; 4]>,
    overlap_px: usize,
    ghost: f64,
    ghosts: usize,
}

struct Measured<'a> {
    gray: &'a Raster<f32>,
    layers: &'a [Layer],
    shown: &'a [u16],
    /// Columns of a turn on a cylinder, its width; 0 on a plane.
    turn: usize,
}

/// Whether a layer lies on a canvas of this size, or `around` a cylinder of it.
fn fits(layer: &Layer, [width, height]: [usize; 2], around: bool) -> bool {
    let in_one_turn = layer.left <= width && layer.gray.width() <= width;
    (layer.left + layer.gray.width() <= width || around && in_one_turn) && layer.top + layer.gray.height() <= height
}

/// The level of a photograph at a canvas pixel, if it covers it, on a cylinder of `turn` columns or with 0 on a plane.
fn level(layer: &Layer, x: usize, y: usize, turn: usize) -> Option<f64> {
    let x = if x < layer.left { x + turn } else { x };
    let (column, row) = (x.checked_sub(layer.left)?, y.checked_sub(layer.top)?);
    let inside = column < layer.gray.width() && row < layer.gray.height();
    (inside && layer.covered.pixel(column, row)[0]).then(|| f64::from(layer.gray.pixel(column, row)[0]))
}

impl Measured<'_> {
    fn lines(&self, sums: &mut Sums) {
        let (width, height) = (self.gray.width(), self.gray.height());
        for y in 0..height {
            for x in 0..width {
                let here = self.shown[y * width + x];
                let below = self.shown.get((y + 1) * width + x).copied().filter(|&below| below != here);
                if let Some(below) = below {
                    let row = |at: usize| (y + 1 + at).checked_sub(STEP_REACH);
                    self.line([here, below], |_| Some(x), row, &mut sums.stretches);
                }
                if x + 1 < width || self.turn > 0 {
                    let right = self.shown[y * width + (x + 1) % width];
                    let column = |at: usize| match self.turn {
                        0 => (x + 1 + at).checked_sub(STEP_REACH),
                        turn => (x + 1 + at + turn).checked_sub(STEP_REACH).map(|column| column % turn),
                    };
                    if x + 1 == width {
                        self.line([here, right], column, |_| Some(y), &mut sums.wrap);
                    }
                    if self.turn > 0 && x + 1 < width && (x + 1).is_multiple_of(STRETCH_PX) {
                        self.line([here, right], column, |_| Some(y), &mut sums.columns);
                    }
                    if right != here {
                        self.line([here, right], column, |_| Some(y), &mut sums.stretches);
                    }
                }
            }
        }
    }

    /// One place on a line; `column` and `row` give the sixteen pixels across it.
    fn line(
        &self,
        [first, second]: [u16; 2],
        column: impl Fn(usize) -> Option<usize>,
        row: impl Fn(usize) -> Option<usize>,
        stretches: &mut BTreeMap<Stretch, [f64; 4]>,
    ) {
        let layer = |label: u16| self.layers.get(usize::from(label));
        let (Some(a), Some(b)) = (layer(first), layer(second)) else { return };
        let step_of = |value: &dyn Fn(usize, usize) -> Option<f64>| -> Option<f64> {
            let mut step = 0.0;
            for at in 0..2 * STEP_REACH {
                let one = value(column(at)?, row(at)?)?;
                step += if at < STEP_REACH { -one } else { one };
            }
            Some(step / STEP_REACH as f64)
        };
        let of_panorama = |x: usize, y: usize| {
            let inside = x < self.gray.width() && y < self.gray.height();
            inside.then(|| f64::from(self.gray.pixel(x, y)[0]))
        };
        let steps = (
            step_of(&|x, y| level(a, x, y, self.turn)),
            step_of(&|x, y| level(b, x, y, self.turn)),
            step_of(&of_panorama),
        );
        if let (Some(step_a), Some(step_b), Some(own)) = steps {
            let place = |at: Option<usize>| at.unwrap_or(0) / STRETCH_PX;
            let down = column(0) != column(1);
            let sum = stretches.entry((place(row(0)), place(column(0)), down, first, second)).or_default();
            for (sum, value) in sum.iter_mut().zip([own, step_a, step_b, 1.0]) {
                *sum += value;
            }
        }
    }

    fn gradients(&self, sums: &mut Sums) {
        let (width, height) = (self.gray.width(), self.gray.height());
        let difference = |value: &dyn Fn(usize, usize) -> Option<f64>, x: usize, y: usize| {
            let middle = value(x, y)?;
            Some([value(x + 1, y)? - middle, value(x, y + 1)? - middle])
        };
        for y in 0..height.saturating_sub(1) {
            for x in 0..width.saturating_sub(1) {
                let own = difference(&|x, y| Some(f64::from(self.gray.pixel(x, y)[0])), x, y);
                let Some(own) = own else { continue };
                let (mut nearest, mut covering) = (f64::INFINITY, 0);
                for layer in self.layers {
                    if let Some(other) = difference(&|x, y| level(layer, x, y, self.turn), x, y) {
                        nearest = nearest.min((own[0] - other[0]).hypot(own[1] - other[1]));
                        covering += 1;
                    }
                }
                if covering >= 2 {
                    sums.overlap_px += 1;
                    sums.ghost += nearest;
                    sums.ghosts += usize::from(nearest > GHOST_LEVEL);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Picture(Raster<f32>);

    impl RowSource for Picture {
        fn width(&self) -> usize {
            self.0.width()
        }
        fn height(&self) -> usize {
            self.0.height()
        }
        fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
            for (pixel, &gray) in row.chunks_exact_mut(4).zip(self.0.row(y)) {
                pixel.copy_from_slice(&[gray as u8, gray as u8, gray as u8, 255]);
            }
            Ok(())
        }
        fn rgba16_row(&self, _: usize, _: &mut [u16]) -> Result<()> {
            unreachable!("measured at 8 bits")
        }
        fn linear_row(&self, _: usize, _: &mut [f32]) -> Result<()> {
            unreachable!("measured at 8 bits")
        }
    }

    fn layer(level: impl Fn(usize, usize) -> f32) -> Layer {
        let mut gray = Raster::new(60, 30, 1);
        for y in 0..30 {
            for x in 0..60 {
                gray.pixel_mut(x, y)[0] = level(x, y);
            }
        }
        let covered = Raster::from_data(60, 30, 1, vec![true; 1800]).expect("as many");
        Layer { left: 0, top: 0, gray, covered }
    }

    fn halves() -> Vec<u16> {
        (0..1800).map(|at| u16::from(at % 60 >= 30)).collect()
    }

    #[test]
    fn a_hard_cut_shows_the_whole_step_and_no_ghost() {
        let layers = [layer(|x, _| 50.0 + x as f32), layer(|x, _| 70.0 + x as f32)];
        let cut = Picture(layer(|x, _| x as f32 + if x < 30 { 50.0 } else { 70.0 }).gray);
        let found = measure(&cut, &layers, &halves(), false).expect("one canvas");
        assert_eq!(found.line_px, 30);
        assert!((found.step - 20.0).abs() < 1e-5, "{found:?}");
        // One column of 59 has a gradient that is off by 20.
        assert!((found.ghost - 20.0 / 59.0).abs() < 1e-5, "{found:?}");
        let one = Picture(layers[0].gray.clone());
        let found = measure(&one, &layers, &halves(), false).expect("one canvas");
        assert!(found.step < 1e-5 && found.ghost < 1e-5, "{found:?}");
    }

    /// A ramp that goes on across the ends of a cylinder: whoever shows it, there is no step, and one that is there is found.
    #[test]
    fn the_ends_of_a_full_turn_are_a_line_too() {
        let whole = layer(|x, _| 50.0 + x as f32);
        // Two of them, of half the width, the second from column 45 over the end to column 15.
        let half = |left: usize, first: usize| {
            let mut gray = Raster::new(30, 30, 1);
            for y in 0..30 {
                for x in 0..30 {
                    gray.pixel_mut(x, y)[0] = 50.0 + (first + x) as f32;
                }
            }
            Layer { left, top: 0, gray, covered: Raster::from_data(30, 30, 1, vec![true; 900]).expect("as many") }
        };
        let layers = [half(15, 15), half(45, 45)];
        let shown: Vec<u16> = (0..1800).map(|at| u16::from(!(15..45).contains(&(at % 60)))).collect();
        assert_eq!(deepest(&layers, [60, 30], true).expect("on the cylinder"), shown);
        assert!(deepest(&layers, [60, 30], false).is_err());
        let true_levels = |x: usize| if x < 15 { 110.0 + x as f32 } else { 50.0 + x as f32 };
        let good = Picture(layer(|x, _| true_levels(x)).gray);
        let found = measure(&good, &layers, &shown, true).expect("one cylinder");
        assert_eq!(found.wrap_px, 30);
        assert!(found.wrap_step < 1e-5 && found.column_step < 1e-5, "{found:?}");
        let bad = Picture(layer(|x, _| true_levels(x) + if x < 15 { 12.0 } else { 0.0 }).gray);
        let found = measure(&bad, &layers, &shown, true).expect("one cylinder");
        assert!((found.wrap_step - 12.0).abs() < 1e-5, "{found:?}");
        // The same step at column 32, the only one of 60 columns that is compared.
        let inner = Picture(layer(|x, _| true_levels(x) + if (20..32).contains(&x) { 12.0 } else { 0.0 }).gray);
        let found = measure(&inner, &layers, &shown, true).expect("one cylinder");
        assert!((found.column_step - 12.0).abs() < 1e-5 && found.wrap_step < 1e-5, "{found:?}");
        let flat = measure(&good, &[whole], &vec![0; 1800], false).expect("one canvas");
        assert_eq!((flat.wrap_px, flat.wrap_step, flat.column_step), (0, 0.0, 0.0));
    }

    #[test]
    fn a_mean_of_two_that_do_not_fit_is_a_ghost() {
        let bar = |at: usize| layer(move |x, _| if (at..at + 4).contains(&x) { 200.0 } else { 40.0 });
        let layers = [bar(20), bar(26)];
        let mean =
            Picture(layer(|x, _| if (20..24).contains(&x) || (26..30).contains(&x) { 120.0 } else { 40.0 }).gray);
        let found = measure(&mean, &layers, &vec![0; 1800], false).expect("one canvas");
        // Four edges of 80, each 80 away from the nearer photograph (one shows 160 there, the other nothing).
        assert!((found.ghost - 4.0 * 80.0 / 59.0).abs() < 1e-4, "{found:?}");
        assert!((found.ghost_share - 4.0 / 59.0).abs() < 1e-9);
        assert!(measure(&mean, &layers, &[], false).is_err());
    }
}
