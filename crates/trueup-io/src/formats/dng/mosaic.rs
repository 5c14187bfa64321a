//! From one color a pixel to three.
//!
//! # Source
//! Green after Hamilton and Adams 1997, "Adaptive color plan interpolation in single sensor color electronic camera":
//! along the direction in which colors change less, corrected by the other color's curvature. Red and blue by the mean
//! of their differences from green around.

use rayon::prelude::*;

/// Red, green or blue.
pub(super) type Color = usize;
const GREEN: Color = 1;

/// The colors of a mosaic of two by two pixels, row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pattern(pub(super) [Color; 4]);

impl Pattern {
    /// Whether it is Bayer's: greens on a diagonal, red and blue on the other.
    pub(super) fn is_bayer(self) -> bool {
        let [a, b, c, d] = self.0;
        let is = |green: [Color; 2], other: [Color; 2]| green == [GREEN; 2] && matches!(other, [0, 2] | [2, 0]);
        is([a, d], [b, c]) || is([b, c], [a, d])
    }

    pub(super) fn color(self, x: usize, y: usize) -> Color {
        self.0[y % 2 * 2 + x % 2]
    }
}

/// Shortest side that a mosaic must have: a pixel has neighbors of its own color.
pub(super) const MIN_SIDE: usize = 4;

/// Samples of a sensor, one a pixel.
#[derive(Debug)]
pub(super) struct Mosaic {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pattern: Pattern,
    pub(super) samples: Vec<f32>,
}

impl Mosaic {
    fn at(&self, x: isize, y: isize) -> f32 {
        self.samples[mirrored(y, self.height) * self.width + mirrored(x, self.width)]
    }

    /// Green at every pixel.
    pub(super) fn greens(&self) -> Vec<f32> {
        let mut greens = vec![0.0; self.samples.len()];
        greens.par_chunks_mut(self.width.max(1)).enumerate().for_each(|(y, row)| {
            for (x, green) in row.iter_mut().enumerate() {
                *green = self.green(x, y);
            }
        });
        greens
    }

    fn green(&self, x: usize, y: usize) -> f32 {
        let own = self.samples[y * self.width + x];
        if self.pattern.color(x, y) == GREEN {
            return own;
        }
        let (x, y) = (x as isize, y as isize);
        let along = |dx: isize, dy: isize| {
            let (before, behind) = (self.at(x - dx, y - dy), self.at(x + dx, y + dy));
            let curvature = 2.0 * own - self.at(x - 2 * dx, y - 2 * dy) - self.at(x + 2 * dx, y + 2 * dy);
            ((before - behind).abs() + curvature.abs(), (before + behind) / 2.0 + curvature / 4.0)
        };
        let ((change_x, by_x), (change_y, by_y)) = (along(1, 0), along(0, 1));
        if change_x < change_y {
            by_x
        } else if change_y < change_x {
            by_y
        } else {
            (by_x + by_y) / 2.0
        }
    }

    /// Red, green and blue of a pixel, with the greens of all.
    pub(super) fn pixel(&self, greens: &[f32], x: usize, y: usize) -> [f32; 3] {
        let green = greens[y * self.width + x];
        let difference = |dx: isize, dy: isize| {
            let place = mirrored(y as isize + dy, self.height) * self.width + mirrored(x as isize + dx, self.width);
            self.samples[place] - greens[place]
        };
        let own = self.pattern.color(x, y);
        let mut pixel = [green; 3];
        for color in [0, 2] {
            pixel[color] += if color == own {
                difference(0, 0)
            } else if own != GREEN {
                (difference(-1, -1) + difference(1, -1) + difference(-1, 1) + difference(1, 1)) / 4.0
            } else if self.pattern.color(x + 1, y) == color {
                (difference(-1, 0) + difference(1, 0)) / 2.0
            } else {
                (difference(0, -1) + difference(0, 1)) / 2.0
            };
        }
        pixel
    }
}

/// A place beside the border as one inside of it of the same color.
fn mirrored(place: isize, count: usize) -> usize {
    let last = count as isize - 1;
    let inside = if place < 0 { -place } else { place };
    (if inside > last { 2 * last - inside } else { inside }).clamp(0, last) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 12;

    fn mosaic(pattern: Pattern, color: impl Fn(usize, usize) -> [f32; 3]) -> Mosaic {
        let places = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        let samples = places.map(|(x, y)| color(x, y)[pattern.color(x, y)]).collect();
        Mosaic { width: SIDE, height: SIDE, pattern, samples }
    }

    /// Largest error, without what is so near to the border that it is mirrored.
    fn error(pattern: Pattern, border: usize, color: impl Fn(usize, usize) -> [f32; 3]) -> f32 {
        let mosaic = mosaic(pattern, &color);
        let greens = mosaic.greens();
        let places = (border..SIDE - border).flat_map(|y| (border..SIDE - border).map(move |x| (x, y)));
        let of_pixel = |(x, y)| mosaic.pixel(&greens, x, y).into_iter().zip(color(x, y)).map(|(a, b)| (a - b).abs());
        places.flat_map(of_pixel).fold(0.0, f32::max)
    }

    const PATTERNS: [Pattern; 4] =
        [Pattern([0, 1, 1, 2]), Pattern([2, 1, 1, 0]), Pattern([1, 0, 2, 1]), Pattern([1, 2, 0, 1])];

    #[test]
    fn plain_colors_and_slopes_are_what_they_were() {
        for pattern in PATTERNS {
            assert!(pattern.is_bayer());
            assert!(error(pattern, 0, |_, _| [0.7, 0.4, 0.2]) < 1e-6);
            let slope =
                |x: usize, y: usize| [0.1 + 0.05 * x as f32, 0.2 + 0.03 * y as f32, 0.9 - 0.02 * (x + y) as f32];
            assert!(error(pattern, 3, slope) < 1e-6);
        }
        assert!(
            ![[0, 1, 2, 1], [0, 1, 1, 0], [1, 1, 0, 2], [0, 1, 1, 3]]
                .into_iter()
                .any(|colors| Pattern(colors).is_bayer())
        );
    }

    /// Gray that steps from dark to light: interpolated along the edge, it has no colors there.
    #[test]
    fn edges_have_no_fringes() {
        for pattern in PATTERNS {
            assert!(error(pattern, 3, |x, _| [if x < 6 { 0.1 } else { 0.8 }; 3]) < 1e-6);
            assert!(error(pattern, 3, |_, y| [if y < 5 { 0.8 } else { 0.1 }; 3]) < 1e-6);
        }
    }

    #[test]
    fn places_beside_the_border_keep_their_color() {
        assert_eq!([-2, -1, 0, 11, 12, 13].map(|place| mirrored(place, SIDE)), [2, 1, 0, 11, 10, 9]);
    }
}
