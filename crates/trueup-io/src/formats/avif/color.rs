//! From luma and color differences to red, green and blue.
//!
//! # Source
//! ITU-T H.273, section 8.3 (matrix coefficients, equations 38 to 58 for the conversions, 20 to 31 for the ranges).

use rayon::prelude::*;

use crate::formats::alpha::Share;

/// How many pixels share a color difference, across and down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sampling {
    pub(super) x: usize,
    pub(super) y: usize,
}

/// Where the shared color differences lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChromaPlace {
    /// In the middle of the pixels that share them.
    Middle,
    /// Beside the left of them.
    Left,
    /// On the first of them.
    First,
}

/// How three samples become a color.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Matrix {
    /// They are green, blue and red.
    Identity,
    /// By the shares of red and blue in luma.
    Luma { red: f32, blue: f32 },
    /// By differences of green, and of orange.
    YCgCo,
}

impl Matrix {
    /// By its code point (ITU-T H.273, table 4); `None` if it is none that photographs are in. Where it is unspecified,
    /// that of JPEG is meant, as other readers of AVIF take it.
    pub(super) fn of_code_point(code: u16) -> Option<Self> {
        Some(match code {
            0 => Self::Identity,
            1 => Self::Luma { red: 0.2126, blue: 0.0722 },
            2 | 5 | 6 => Self::Luma { red: 0.299, blue: 0.114 },
            4 => Self::Luma { red: 0.30, blue: 0.11 },
            7 => Self::Luma { red: 0.212, blue: 0.087 },
            8 => Self::YCgCo,
            9 => Self::Luma { red: 0.2627, blue: 0.0593 },
            _ => return None,
        })
    }

    /// The color of luma of 0 to 1 and differences of -0.5 to 0.5; those of green, blue and red are of 0 to 1.
    fn color(self, [y, u, v]: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Identity => [v, y, u],
            Self::Luma { red, blue } => {
                let green = 1.0 - red - blue;
                let (from_u, from_v) = (2.0 * (1.0 - blue), 2.0 * (1.0 - red));
                [y + from_v * v, y - blue * from_u / green * u - red * from_v / green * v, y + from_u * u]
            }
            Self::YCgCo => {
                let rest = y - u;
                [rest + v, y + u, rest - v]
            }
        }
    }
}

/// What the numbers of samples mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    pub(super) bits: usize,
    /// Whether black and white are the first and the last number.
    pub(super) is_full: bool,
}

impl Range {
    fn luma(self) -> Scale {
        let step = self.step();
        match self.is_full {
            true => Scale { zero: 0.0, one: self.most() },
            false => Scale { zero: 16.0 * step, one: 219.0 * step },
        }
    }

    fn difference(self) -> Scale {
        let step = self.step();
        let one = if self.is_full { self.most() } else { 224.0 * step };
        Scale { zero: 128.0 * step, one }
    }

    /// Numbers for one of 8 bits.
    fn step(self) -> f32 {
        (1_u32 << (self.bits - 8)) as f32
    }

    fn most(self) -> f32 {
        ((1_u32 << self.bits) - 1) as f32
    }
}

#[derive(Debug, Clone, Copy)]
struct Scale {
    zero: f32,
    one: f32,
}

impl Scale {
    fn value(self, sample: f32) -> f32 {
        (sample - self.zero) / self.one
    }
}

/// The samples of a picture, each plane by itself.
#[derive(Debug)]
pub(super) struct Planes {
    pub(super) width: usize,
    pub(super) height: usize,
    /// `None` of gray.
    pub(super) sampling: Option<Sampling>,
    /// Luma and two color differences; of gray luma alone.
    pub(super) samples: Vec<Vec<u16>>,
}

impl Planes {
    /// Columns and rows of a plane.
    pub(super) fn size(&self, plane: usize) -> [usize; 2] {
        match self.sampling.filter(|_| plane > 0) {
            Some(Sampling { x, y }) => [self.width.div_ceil(x), self.height.div_ceil(y)],
            None => [self.width, self.height],
        }
    }
}

/// What planes are to be read by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    pub(super) matrix: Matrix,
    pub(super) range: Range,
    pub(super) place: ChromaPlace,
}

/// The pixels of a picture, with the opacity that is in another: gray, or red, green and blue, and alpha behind them.
pub(super) fn pixels<S: Share + Default + Send + Sync>(
    planes: &Planes,
    reading: Reading,
    alpha: Option<(&Planes, Range)>,
) -> Vec<S> {
    let colors = if planes.sampling.is_some() { 3 } else { 1 };
    let channels = colors + usize::from(alpha.is_some());
    let mut pixels = vec![S::default(); planes.width * planes.height * channels];
    let luma = reading.range.luma();
    pixels.par_chunks_mut((planes.width * channels).max(1)).enumerate().for_each(|(y, row)| {
        let levels = row_of(&planes.samples[0], planes.width, y);
        let differences = [1, 2].map(|plane| differences(planes, plane, y, reading));
        let opacity = alpha.map(|(planes, range)| (row_of(&planes.samples[0], planes.width, y), range.luma()));
        for (x, pixel) in row.chunks_exact_mut(channels).enumerate() {
            let level = luma.value(f32::from(levels[x]));
            if colors == 1 {
                pixel[0] = share(level);
            } else {
                let color = reading.matrix.color([level, differences[0][x], differences[1][x]]);
                for (target, value) in pixel.iter_mut().zip(color) {
                    *target = share(value);
                }
            }
            if let Some((row, scale)) = opacity {
                pixel[channels - 1] = share(scale.value(f32::from(row[x])));
            }
        }
    });
    pixels
}

fn share<S: Share>(value: f32) -> S {
    S::of_share(f64::from(value).clamp(0.0, 1.0))
}

fn row_of(samples: &[u16], width: usize, y: usize) -> &[u16] {
    &samples[y * width..(y + 1) * width]
}

/// The color differences of row `y`, a value for every pixel; none of gray.
fn differences(planes: &Planes, plane: usize, y: usize, reading: Reading) -> Vec<f32> {
    let Some(Sampling { x: across, y: down }) = planes.sampling else { return Vec::new() };
    let [columns, rows] = planes.size(plane);
    // What is no difference but a color has a color's range.
    let scale = match reading.matrix {
        Matrix::Identity => reading.range.luma(),
        _ => reading.range.difference(),
    };
    let (lower, upper, part) = between(y, down, rows, reading.place == ChromaPlace::First);
    let [lower, upper] = [lower, upper].map(|row| row_of(&planes.samples[plane], columns, row));
    let at = |column: usize| {
        let [lower, upper] = [lower, upper].map(|row| f32::from(row[column]));
        lower + (upper - lower) * part
    };
    let is_on_first = reading.place != ChromaPlace::Middle;
    (0..planes.width)
        .map(|x| {
            let (left, right, part) = between(x, across, columns, is_on_first);
            scale.value(at(left) + (at(right) - at(left)) * part)
        })
        .collect()
}

/// The two of `count` samples, each for so many pixels, that lie beside a pixel, and how far it is from the first to
/// the second.
fn between(pixel: usize, shared_by: usize, count: usize, is_on_first: bool) -> (usize, usize, f32) {
    if shared_by == 1 {
        return (pixel, pixel, 0.0);
    }
    let shared_by = shared_by as f32;
    let offset = if is_on_first { 0.0 } else { (shared_by - 1.0) / 2.0 };
    let place = ((pixel as f32 - offset) / shared_by).clamp(0.0, (count - 1) as f32);
    let first = place.floor();
    (first as usize, (first as usize + 1).min(count - 1), place - first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planes(sampling: Option<Sampling>, width: usize, samples: &[&[u16]]) -> Planes {
        let height = samples[0].len() / width;
        Planes { width, height, sampling, samples: samples.iter().map(|plane| plane.to_vec()).collect() }
    }

    const EVERY: Option<Sampling> = Some(Sampling { x: 1, y: 1 });

    /// Primary colors of Rec. ITU-R BT.709 and BT.601 by 8 bits of the limited range, as their tables of color bars
    /// have them.
    #[test]
    fn color_bars_are_the_primaries() {
        let bars = |code, samples: [&[u16]; 3]| -> Vec<u8> {
            let matrix = Matrix::of_code_point(code).expect("a matrix");
            let range = Range { bits: 8, is_full: false };
            pixels(&planes(EVERY, 3, &samples), Reading { matrix, range, place: ChromaPlace::Middle }, None)
        };
        let primaries = [255, 0, 0, 0, 255, 0, 0, 0, 255];
        let close = |found: Vec<u8>| found.iter().zip(primaries).all(|(&found, wanted)| found.abs_diff(wanted) <= 2);
        assert!(close(bars(1, [&[63, 173, 32], &[102, 42, 240], &[240, 26, 118]])));
        assert!(close(bars(6, [&[81, 145, 41], &[90, 54, 240], &[240, 34, 110]])));
    }

    #[test]
    fn numbers_have_their_meaning_at_every_depth() {
        for bits in [8, 10, 12] {
            let step = 1 << (bits - 8);
            let full = ((1_u32 << bits) - 1) as u16;
            for (is_full, black, white) in [(true, 0, full), (false, 16 * step, 235 * step)] {
                let gray = planes(None, 2, &[&[black, white]]);
                let reading =
                    Reading { matrix: Matrix::Identity, range: Range { bits, is_full }, place: ChromaPlace::Middle };
                assert_eq!(pixels::<u16>(&gray, reading, None), [0, u16::MAX]);
                assert_eq!(pixels::<u8>(&gray, reading, Some((&gray, reading.range))), [0, 0, 255, 255]);
            }
        }
    }

    #[test]
    fn green_and_its_differences_make_colors() {
        let reading = |code| Reading {
            matrix: Matrix::of_code_point(code).expect("a matrix"),
            range: Range { bits: 8, is_full: true },
            place: ChromaPlace::Middle,
        };
        let one = planes(EVERY, 1, &[&[10], &[20], &[30]]);
        assert_eq!(pixels::<u8>(&one, reading(0), None), [30, 10, 20]);
        // Y = 100, Cg = 10, Co = 20: green 110, the rest 90, red 110, blue 70.
        let one = planes(EVERY, 1, &[&[100], &[138], &[148]]);
        assert_eq!(pixels::<u8>(&one, reading(8), None), [110, 110, 70]);
        assert_eq!(Matrix::of_code_point(14), None);
    }

    #[test]
    fn shared_differences_are_interpolated_where_they_lie() {
        // Four pixels and two differences: in the middle, they are at 0.5 and 2.5.
        let parts = |is_on_first| [0, 1, 2, 3].map(|pixel| between(pixel, 2, 2, is_on_first));
        assert_eq!(parts(false), [(0, 1, 0.0), (0, 1, 0.25), (0, 1, 0.75), (1, 1, 0.0)]);
        assert_eq!(parts(true), [(0, 1, 0.0), (0, 1, 0.5), (1, 1, 0.0), (1, 1, 0.0)]);
        assert_eq!(between(4, 1, 9, false), (4, 4, 0.0));
    }
}
