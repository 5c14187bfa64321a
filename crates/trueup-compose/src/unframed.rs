//! Photographs without the hairlines that some programs leave around them: a white or black row or column of their own
//! at the border, which would run through the panorama wherever the photograph ends.

use trueup_core::Result;
use trueup_core::color::TransferCurve;
use trueup_core::mask::Masks;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::side::Side;
use trueup_core::source::PhotographSource;
use trueup_core::statistics::median;

/// Widest frame that is a hairline, as a share of the photograph's shorter side. What is wider was meant.
const WIDEST: f64 = 0.005;
/// Rows at a border that are looked at in any case: a small copy of a photograph may have its frame doubled by scaling.
const FEWEST_ROWS: usize = 3;
/// Largest distance of a frame's samples from black or white, as a share of white: compression moves them so far.
const PLAIN: f32 = 0.05;
/// Least difference of the picture from the frame beside it, as a share of white, at [`MOST_PLACES`] of it: a black sky
/// or a blown one goes on behind its border.
const STEP: f32 = 0.1;
/// Share of a border at which its samples must be a frame's, and the picture beside them must not.
const MOST_PLACES: f64 = 0.95;

/// The same photographs, the rows and columns of a frame painted over with those beside them.
pub(crate) struct Unframed<'a>(pub(crate) &'a dyn PhotographSource);

impl PhotographSource for Unframed<'_> {
    fn photograph(&self, index: usize) -> Result<Photograph> {
        Ok(match self.0.photograph(index)? {
            Photograph::Eight(raster) => Photograph::Eight(unframed(raster, f32::from(u8::MAX))),
            Photograph::Sixteen(raster) => Photograph::Sixteen(unframed(raster, f32::from(u16::MAX))),
        })
    }

    fn masks(&self, index: usize) -> Masks {
        self.0.masks(index)
    }

    fn bytes(&self, index: usize) -> Option<usize> {
        self.0.bytes(index)
    }

    fn transfer_curve(&self) -> TransferCurve {
        self.0.transfer_curve()
    }
}

/// Pixel number `along` of the line that is `depth` lines away from a side of a photograph, as its column and row.
fn place(side: Side, depth: usize, along: usize, [width, height]: [usize; 2]) -> [usize; 2] {
    match side {
        Side::Left => [depth, along],
        Side::Top => [along, depth],
        Side::Right => [width - 1 - depth, along],
        Side::Bottom => [along, height - 1 - depth],
    }
}

/// Pixels along a side, and lines from it to the other side.
fn lengths(side: Side, [width, height]: [usize; 2]) -> [usize; 2] {
    match side {
        Side::Left | Side::Right => [height, width],
        Side::Top | Side::Bottom => [width, height],
    }
}

/// The photograph with the lines of each border's frame painted over.
fn unframed<T: Copy + Default + Into<f32>>(mut raster: Raster<T>, white: f32) -> Raster<T> {
    let size = [raster.width(), raster.height()];
    // A border's frame ends where the others' begin: these go first.
    for side in [Side::Left, Side::Right, Side::Top, Side::Bottom] {
        let lines = frame_lines(&raster, side, white);
        let [along, _] = lengths(side, size);
        for (depth, at) in (0..lines).flat_map(|depth| (0..along).map(move |at| (depth, at))) {
            let [from_x, from_y] = place(side, lines, at, size);
            let [x, y] = place(side, depth, at, size);
            for channel in 0..raster.channels() {
                let sample = raster.pixel(from_x, from_y)[channel];
                raster.pixel_mut(x, y)[channel] = sample;
            }
        }
    }
    raster
}

/// Lines at a border that are a frame's, and the one beside them, into which compression and scaling carry it; 0 if
/// there is no frame.
fn frame_lines<T: Copy + Default + Into<f32>>(raster: &Raster<T>, side: Side, white: f32) -> usize {
    let size = [raster.width(), raster.height()];
    let [along, across] = lengths(side, size);
    let widest = ((WIDEST * size[0].min(size[1]) as f64) as usize).max(FEWEST_ROWS);
    let margin = widest + 2;
    if along <= 2 * margin || across <= 2 * margin {
        return 0;
    }
    // In the corners lie the frames of the other borders.
    let places = || margin..along - margin;
    let colors = raster.channels().min(3);
    let most = (MOST_PLACES * places().len() as f64).ceil() as usize;
    // How far a place of a line is from the frame's color, as a share of white.
    let off =
        |depth: usize, at: usize, frame: f32| distance(raster, place(side, depth, at, size), colors, frame, white);
    let is_frame = |depth: usize, frame: f32| places().filter(|&at| off(depth, at, frame) <= PLAIN).count() >= most;
    let differs = |depth: usize, frame: f32| places().filter(|&at| off(depth, at, frame) >= STEP).count() >= most;
    // A frame may have lines of both kinds.
    let kinds: Vec<f32> =
        (0..=widest).map_while(|depth| [0.0, white].into_iter().find(|&frame| is_frame(depth, frame))).collect();
    match kinds.last() {
        Some(&last) if kinds.len() <= widest && differs(kinds.len() + 1, last) => kinds.len() + 1,
        None if [0.0, white].into_iter().any(|frame| is_veiled(raster, side, margin, frame, white)) => 2,
        _ => 0,
    }
}

/// Whether the outermost line is the one beside it under a veil of black or white, as scaling leaves it of a frame that
/// was less than a pixel wide.
fn is_veiled<T: Copy + Default + Into<f32>>(
    raster: &Raster<T>,
    side: Side,
    margin: usize,
    frame: f32,
    white: f32,
) -> bool {
    /// Least share of the veil.
    const LEAST_VEIL: f32 = 0.2;
    /// Share of the places at which the veil must be the same.
    const MOST_ALIKE: f64 = 0.8;
    let size = [raster.width(), raster.height()];
    let [along, _] = lengths(side, size);
    let level = |depth: usize, at: usize| {
        let [x, y] = place(side, depth, at, size);
        let samples = &raster.pixel(x, y)[..raster.channels().min(3)];
        samples.iter().map(|&sample| sample.into()).sum::<f32>() / (samples.len() as f32 * white)
    };
    let frame = frame / white;
    // Where the picture is as bright as the frame, nothing shows.
    let seen: Vec<[f32; 2]> = (margin..along - margin)
        .map(|at| [level(0, at), level(1, at)])
        .filter(|[_, inner]| (frame - inner).abs() >= 2.0 * STEP)
        .collect();
    let mut veils: Vec<f32> = seen.iter().map(|[outer, inner]| (outer - inner) / (frame - inner)).collect();
    if 2 * veils.len() < along - 2 * margin {
        return false;
    }
    let Some(veil) = median(&mut veils) else { return false };
    let is_alike = |[outer, inner]: &&[f32; 2]| (inner + veil * (frame - inner) - outer).abs() <= 2.0 * PLAIN;
    let alike = seen.iter().filter(is_alike).count();
    veil >= LEAST_VEIL && alike as f64 >= MOST_ALIKE * seen.len() as f64
}

/// The largest difference of a pixel's channels from a gray level, as a share of white.
fn distance<T: Copy + Default + Into<f32>>(
    raster: &Raster<T>,
    [x, y]: [usize; 2],
    colors: usize,
    level: f32,
    white: f32,
) -> f32 {
    let samples = &raster.pixel(x, y)[..colors];
    samples.iter().map(|&sample| (sample.into() - level).abs()).fold(0.0, f32::max) / white
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 90 x 70 pixels, darker to the right, and `frame` lines of a level around it.
    fn framed(frame: usize, level: u8, picture: impl Fn(usize, usize) -> u8) -> Raster<u8> {
        let (width, height) = (90 + 2 * frame, 70 + 2 * frame);
        let inside = |at: usize, length: usize| at.checked_sub(frame).filter(|&at| at < length);
        let sample = |at: usize| match (inside(at % width, 90), inside(at / width, 70)) {
            (Some(x), Some(y)) => picture(x, y),
            _ => level,
        };
        let samples = (0..width * height).flat_map(|at| [sample(at); 3]).collect();
        Raster::from_data(width, height, 3, samples).expect("as many samples")
    }

    #[test]
    fn hairlines_take_up_the_picture_beside_them() {
        let picture = |x: usize, y: usize| 60 + x as u8 + y as u8 / 2;
        for (level, frame) in [(255, 1), (0, 1), (250, 2), (4, 3)] {
            let cleaned = unframed(framed(frame, level, picture), 255.0);
            for (x, y) in [(0_usize, 0_usize), (0, 30), (40, 0), (91, 35), (45, 71), (91, 71)] {
                let [expected_x, expected_y] =
                    [(x, 88), (y, 68)].map(|(at, last)| at.saturating_sub(frame).clamp(1, last));
                assert_eq!(cleaned.pixel(x, y)[0], picture(expected_x, expected_y), "{level}: ({x}, {y})");
            }
            assert_eq!(cleaned.pixel(frame + 20, frame + 20)[0], picture(20, 20));
        }
    }

    /// As in photographs scaled by programs that count what lies beyond the border as white, or that were framed twice.
    #[test]
    fn a_veil_over_the_outermost_line_and_a_double_frame_are_hairlines() {
        let picture = |x: usize, y: usize| 60 + x as u8 + (y % 7) as u8;
        let plain = framed(0, 0, picture);
        let mut veiled = plain.clone();
        let mut twice = plain.clone();
        for y in 0..70 {
            let sample = plain.pixel(0, y)[0];
            veiled.pixel_mut(0, y).fill(sample + ((255 - sample) as f32 * 0.4) as u8);
            twice.pixel_mut(89, y).fill(2);
            twice.pixel_mut(88, y).fill(250);
        }
        let (veiled, twice) = (unframed(veiled, 255.0), unframed(twice, 255.0));
        for y in 10..60 {
            assert_eq!(veiled.pixel(0, y)[0], picture(2, y));
            assert_eq!((twice.pixel(89, y)[0], twice.pixel(88, y)[0]), (picture(86, y), picture(86, y)));
        }
    }

    #[test]
    fn what_is_no_hairline_stays() {
        let dark = framed(0, 0, |_, _| 3);
        assert_eq!(unframed(dark.clone(), 255.0), dark, "a black night");
        let blown = framed(0, 0, |_, y| if y < 20 { 255 } else { 90 });
        assert_eq!(unframed(blown.clone(), 255.0), blown, "a blown sky");
        let wide = framed(12, 255, |x, _| 60 + x as u8);
        assert_eq!(unframed(wide.clone(), 255.0), wide, "a frame that was meant");
        // Uneven beside all of its borders: where the picture is even, a gray line could be a veil over it.
        let gray = framed(1, 128, |x, y| 20 + ((x * 7 + y * 13) % 97) as u8);
        assert!(unframed(gray.clone(), 255.0) == gray, "a gray border");
        let tiny = Raster::from_data(2, 2, 1, vec![255_u8; 4]).expect("four samples");
        assert_eq!(unframed(tiny.clone(), 255.0), tiny);
    }
}
