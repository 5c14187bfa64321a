//! Even parts of a picture beside a photograph that lies askew in it, or whose sides are bent: what turning it level,
//! taking its lens's bend out, or scanning a print leaves. [`border`](crate::border) knows those that are strips along
//! the sides.

use serde::{Deserialize, Serialize};
use trueup_core::outline::Outline;
use trueup_core::raster::Raster;
use trueup_core::side::Side;
use trueup_core::statistics::median_of;

use crate::border::{EVEN, STEP};

mod common;
mod edge;
mod straight;
#[cfg(test)]
mod tests;

pub use common::CommonPadding;
pub use straight::StraightSided;

/// Rays from the picture's border to its middle along which padding is looked for, spread evenly over the border.
const RAYS: usize = 512;
/// Rays of each side that decide of it.
const FEW_RAYS: usize = 8;
/// Gray levels.
const LEVELS: usize = 256;
/// Gray levels of a bin among which the commonest level of the border is looked for.
const BIN_LEVELS: usize = 4;
/// Least share of the picture's outermost pixels that padding makes up.
const LEAST_OF_BORDER: f64 = 0.1;
/// Largest depth, as a share of the way to the middle. What is even beyond is no padding alone.
const DEEPEST: f64 = 0.45;
/// Working pixels within which padding gives way to the photograph: sharp edges are spread over them by scaling.
const TRANSITION: usize = 3;
/// Least depth of padding, in working pixels: what is thinner is a hairline, which compositing paints over.
const LEAST_DEPTH: u16 = 2;
/// Most that places along a straight side err, in working pixels.
const STRAIGHT_PX: f64 = 1.5;
/// Share of the places where padding ends that have to lie along the sides, or along a smooth curve.
const MOST: f64 = 0.85;
/// Most that the depths of two pictures differ along a common outline, in working pixels.
const SAME_PX: u16 = 2;
/// Working pixels that the outline is drawn inside of where padding ends, for what compression and scaling spread
/// there.
const MARGIN_PX: f64 = 2.0;
/// Least and largest share of the picture that the photograph takes up.
const OF_PICTURE: std::ops::Range<f64> = 0.5..0.997;

/// How far a picture is even along rays from its border to its middle, in its own pixels; nothing is kept of one whose
/// border is not.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Padding {
    /// None, or one for each ray, clockwise from the corner at the left and top.
    rays: Vec<EvenRay>,
}

/// One ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
struct EvenRay {
    /// Pixels from the border that are even.
    depth: u16,
    /// Whether it gives way to something clearly different at once.
    is_sharp: bool,
}

impl EvenRay {
    /// Whether padding ends there.
    fn tells(&self) -> bool {
        self.is_sharp && self.depth >= LEAST_DEPTH
    }
}

impl Padding {
    /// The places where padding ends.
    fn told(&self, size: [usize; 2]) -> impl Iterator<Item = [f64; 2]> {
        let of = move |(number, ray): (usize, &EvenRay)| {
            ray.tells().then(|| Ray::new(number, size).at(f64::from(ray.depth)))
        };
        self.rays.iter().enumerate().filter_map(of)
    }

    fn depth(&self, number: usize) -> u16 {
        self.rays.get(number).map_or(0, |ray| ray.depth)
    }
}

/// Looks for padding in a picture of gray values from 0 to 255.
pub fn padding(gray: &Raster<f32>) -> Padding {
    let [width, height] = [gray.width(), gray.height()];
    let Some(level) = border_level(gray) else { return Padding::default() };
    let at = |[x, y]: [f64; 2]| {
        // The casts saturate.
        gray.data()[(y as usize).min(height - 1) * width + (x as usize).min(width - 1)]
    };
    let rays: Vec<EvenRay> = (0..RAYS)
        .map(|number| {
            let ray = Ray::new(number, [width, height]);
            let away = |depth: usize| (at(ray.at(depth as f64 + 0.5)) - level).abs();
            let most = (DEEPEST * ray.length) as usize;
            // Dust is one pixel wide.
            let depth = (0..most).find(|&depth| away(depth) > EVEN && away(depth + 1) > EVEN).unwrap_or(most);
            let is_sharp = depth < most && (depth..=depth + TRANSITION).any(|depth| away(depth) >= STEP);
            EvenRay { depth: u16::try_from(depth).unwrap_or(u16::MAX), is_sharp }
        })
        .collect();
    match rays.iter().any(EvenRay::tells) {
        true => Padding { rays },
        false => Padding::default(),
    }
}

/// The level that the picture's outermost pixels have most, if enough of them have it.
fn border_level(gray: &Raster<f32>) -> Option<f32> {
    let [last_column, last_row] = [gray.width().checked_sub(1)?, gray.height().checked_sub(1)?];
    let rows = [0, last_row].map(|y| gray.row(y));
    let columns = [0, last_column].map(|x| (0..=last_row).map(move |y| gray.row(y)[x]));
    let outermost: Vec<f32> = rows.into_iter().flatten().copied().chain(columns.into_iter().flatten()).collect();
    let mut counts = [0_usize; LEVELS / BIN_LEVELS];
    // The cast saturates.
    let bin = |level: f32| (level as usize / BIN_LEVELS).min(counts.len() - 1);
    let bins: Vec<usize> = outermost.iter().map(|&level| bin(level)).collect();
    bins.iter().for_each(|&bin| counts[bin] += 1);
    let fullest = (0..counts.len()).max_by_key(|&bin| (counts[bin], bin))?;
    let level = median_of(outermost.iter().zip(&bins).filter(|(_, bin)| **bin == fullest).map(|(&level, _)| level))?;
    let even = outermost.iter().filter(|&&other| (other - level).abs() <= EVEN).count();
    (even as f64 >= LEAST_OF_BORDER * outermost.len() as f64).then_some(level)
}

/// A way from a picture's border to its middle.
struct Ray {
    start: [f64; 2],
    /// Of length 1.
    direction: [f64; 2],
    /// Pixels to the middle.
    length: f64,
    /// Where it starts.
    side: Side,
}

impl Ray {
    fn new(number: usize, size: [usize; 2]) -> Self {
        let [width, height] = size.map(|length| length as f64);
        let along = (number as f64 + 0.5) / RAYS as f64 * 2.0 * (width + height);
        let (start, side) = match along {
            along if along < width => ([along, 0.0], Side::Top),
            along if along < width + height => ([width, along - width], Side::Right),
            along if along < 2.0 * width + height => ([2.0 * width + height - along, height], Side::Bottom),
            along => ([0.0, 2.0 * (width + height) - along], Side::Left),
        };
        let way = [0.5 * width - start[0], 0.5 * height - start[1]];
        let length = way[0].hypot(way[1]);
        Self { start, direction: way.map(|part| part / length.max(f64::MIN_POSITIVE)), length, side }
    }

    fn at(&self, depth: f64) -> [f64; 2] {
        std::array::from_fn(|axis| self.start[axis] + depth * self.direction[axis])
    }
}

/// The polygon, if it is what a photograph may take up of its picture.
fn believable(corners: Vec<[f64; 2]>, size: [usize; 2]) -> Option<Outline> {
    Outline::new(corners).filter(|outline| OF_PICTURE.contains(&outline.share_of(size)))
}
