//! Even borders around photographs: the paper around a scanned print, the bars above and below a film, a frame drawn by
//! a program. What lies in them is no part of the scene, but has the sharpest edges of all.

use serde::{Deserialize, Serialize};
use trueup_core::inset::Inset;
use trueup_core::raster::Raster;
use trueup_core::statistics::median_of;

/// Most that samples of an even border differ from its own level, in gray levels: compression moves them so far.
pub(crate) const EVEN: f32 = 10.0;
/// Share of a line's samples that must be even. Dust is the rest, and how compression rings beside edges.
const MOST_OF_A_LINE: f64 = 0.9;
/// Least difference of the photograph from the border beside it, in gray levels.
pub(crate) const STEP: f32 = 20.0;
/// Share of a border along which the photograph must differ from it. A night lies behind black bars in part; where a
/// blown sky ends at a skyline, next to nothing of its last line does.
const DIFFERS: f64 = 0.5;
/// Lines between the last one of a border and the photograph as it is: sharp edges are spread over them by scaling.
const TRANSITION: usize = 2;
/// Least width, as a share of the shorter side: what is narrower is a hairline, which compositing paints over.
const NARROWEST: f64 = 0.008;
/// Largest width, as a share of the side across.
const WIDEST: f64 = 0.4;
/// Most that two opposite borders' levels differ.
const SAME_LEVEL: f32 = 2.0 * EVEN;

/// What is even at the sides of a picture, in pixels of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct EvenBorder {
    /// The border around the photograph, with the line at its end that holds some of both; none where there is none.
    pub border: Inset,
    /// Lines of one level at each side, whether they are a border's or a blown sky's.
    pub even: Inset,
}

/// Looks for a border around the photograph in a picture of gray values from 0 to 255.
///
/// A border has one level and ends along a straight line parallel to the side, behind which most of the picture differs
/// from it. It counts only together with one of the same level at the opposite side: a blown sky above a level sea has
/// that line, too.
pub fn even_border(gray: &Raster<f32>) -> EvenBorder {
    let [columns, rows] = [Line::Column, Line::Row].map(|line| {
        let sides = [false, true].map(|from_end| Side { gray, line, from_end }.even_lines().unwrap_or_default());
        let [one, other] = sides;
        let is_border = one.ends && other.ends && (one.level - other.level).abs() <= SAME_LEVEL;
        // The line after the last even one holds some of both.
        let widths = sides.map(|side| if is_border { side.even + 1 } else { 0 });
        (widths, sides.map(|side| side.even))
    });
    let inset = |[left, right]: [usize; 2], [top, bottom]: [usize; 2]| Inset { left, top, right, bottom };
    EvenBorder { border: inset(columns.0, rows.0), even: inset(columns.1, rows.1) }
}

/// What a border's lines are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    Row,
    Column,
}

/// One side of a picture.
struct Side<'a> {
    gray: &'a Raster<f32>,
    line: Line,
    /// Whether lines count from the right or from below.
    from_end: bool,
}

/// What is even at one side.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct EvenLines {
    even: usize,
    level: f32,
    /// Whether they end as a border does.
    ends: bool,
}

impl Side<'_> {
    /// `None` in a picture without pixels.
    fn even_lines(&self) -> Option<EvenLines> {
        let (width, height) = (self.gray.width(), self.gray.height());
        let across = if self.line == Line::Row { height } else { width };
        let level = median_of(self.samples(0)?)?;
        let most = (WIDEST * across as f64) as usize;
        let is_even = |&depth: &usize| self.share(depth, |sample| (sample - level).abs() <= EVEN) >= MOST_OF_A_LINE;
        let even = (0..=most).take_while(is_even).count();
        let differs = self.share(even + TRANSITION, |sample| (sample - level).abs() >= STEP) >= DIFFERS;
        let ends = even as f64 >= NARROWEST * width.min(height) as f64 && even <= most && differs;
        Some(EvenLines { even, level, ends })
    }

    /// The share of a line's samples for which something holds.
    fn share(&self, depth: usize, holds: impl Fn(f32) -> bool) -> f64 {
        let Some(samples) = self.samples(depth) else { return 0.0 };
        let (mut count, mut all) = (0_usize, 0_usize);
        for sample in samples {
            count += usize::from(holds(sample));
            all += 1;
        }
        count as f64 / all.max(1) as f64
    }

    /// The samples of the line that is `depth` lines from the side; `None` beyond the other side.
    fn samples(&self, depth: usize) -> Option<impl Iterator<Item = f32>> {
        let (width, height) = (self.gray.width(), self.gray.height());
        let (across, stride, step, count) = match self.line {
            Line::Row => (height, width, 1, width),
            Line::Column => (width, 1, width, height),
        };
        let from_side = across.checked_sub(1)?.checked_sub(depth)?;
        let start = stride * if self.from_end { from_side } else { depth };
        let data = self.gray.data().get(start..)?;
        Some(data.iter().step_by(step).take(count).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(gray: &Raster<f32>) -> Inset {
        even_border(gray).border
    }

    /// 200 x 150 pixels of a scene that is nowhere even, with `level` inside an inset.
    fn bordered(inset: Inset, level: f32) -> Raster<f32> {
        let scene = |x: usize, y: usize| 60.0 + ((x * 7 + y * 13) % 97) as f32;
        let Inset { left, top, right, bottom } = inset;
        let inside = |x: usize, y: usize| (left..200 - right).contains(&x) && (top..150 - bottom).contains(&y);
        let noise = |x: usize, y: usize| ((x * 31 + y * 17) % 5) as f32;
        picture(|x, y| if inside(x, y) { scene(x, y) } else { level + noise(x, y) })
    }

    fn picture(at: impl Fn(usize, usize) -> f32) -> Raster<f32> {
        let samples = (0..200 * 150).map(|index| at(index % 200, index / 200)).collect();
        Raster::from_data(200, 150, 1, samples).expect("as many samples")
    }

    #[test]
    fn bars_and_frames_are_found_with_the_line_that_holds_some_of_both() {
        for level in [0.0, 250.0] {
            let bars = Inset { top: 12, bottom: 15, ..Inset::default() };
            assert_eq!(even(&bordered(bars, level)), Inset { top: 13, bottom: 16, ..bars });
            let frame = Inset { left: 4, top: 6, right: 5, bottom: 20 };
            assert_eq!(even(&bordered(frame, level)), Inset { left: 5, top: 7, right: 6, bottom: 21 });
        }
        let sides = Inset { left: 60, right: 60, ..Inset::default() };
        assert_eq!(even(&bordered(sides, 0.0)), Inset { left: 61, right: 61, ..sides });
    }

    #[test]
    fn what_belongs_to_the_scene_is_no_border() {
        let none = Inset::default();
        assert_eq!(even(&bordered(none, 0.0)), none, "no border");
        assert_eq!(even(&bordered(Inset { top: 20, ..none }, 250.0)), none, "a blown sky above a level sea");
        assert_eq!(even(&bordered(Inset { top: 1, bottom: 1, ..none }, 0.0)), none, "hairlines");
        assert_eq!(even(&picture(|_, _| 3.0)), none, "a black night");
        // A lit street in a night: dark above and below, but not along straight lines.
        let street = |x: usize, y: usize| if (40 + x / 10..100 - x / 12).contains(&y) { 150.0 } else { 2.0 };
        assert_eq!(even(&picture(street)), none, "a night");
        let skyline =
            |x: usize, y: usize| if y >= 50 || ((x / 20).is_multiple_of(5) && y >= 30) { 90.0 } else { 255.0 };
        assert_eq!(even(&picture(skyline)), none, "towers before a blown sky");
        let circle = |x: usize, y: usize| {
            let (x, y) = (x as f32 - 100.0, y as f32 - 75.0);
            if x.hypot(y) < 70.0 { 120.0 + (x * 0.3) } else { 0.0 }
        };
        assert_eq!(even(&picture(circle)), none, "a fisheye's circle");
        let sky = even_border(&picture(skyline)).even.top;
        assert_eq!(sky, 30, "lines that a border of other photographs may lie in");
        assert_eq!(even(&Raster::new(0, 0, 1)), none);
        assert_eq!(even(&Raster::new(1, 1, 1)), none);
    }
}
