//! The outline of a photograph that lies askew in its picture, or whose sides are bent there.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::mask::Mask;
use crate::raster::{Photograph, Raster};
use crate::stretches::complement;

/// A polygon, in pixels of a picture as it is shown, inside of which the photograph lies. What is beside it is no part
/// of the photograph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct Outline {
    /// In order around the photograph, three at least.
    corners: Vec<[f64; 2]>,
}

/// Fewest corners of a polygon.
const FEWEST_CORNERS: usize = 3;

impl Outline {
    /// The polygon of these corners (x, y), in order around it; `None` of fewer than three, and if one is not finite.
    pub fn new(corners: Vec<[f64; 2]>) -> Option<Self> {
        let is_polygon = corners.len() >= FEWEST_CORNERS && corners.iter().flatten().all(|place| place.is_finite());
        is_polygon.then_some(Self { corners })
    }

    /// Its corners (x, y), in order around it.
    pub fn corners(&self) -> &[[f64; 2]] {
        &self.corners
    }

    /// The same in a picture that is so many times as large.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        Self { corners: self.corners.iter().map(|corner| corner.map(|length| length * scale)).collect() }
    }

    /// The share of a picture of `size` pixels that lies inside.
    pub fn share_of(&self, [width, height]: [usize; 2]) -> f64 {
        let inside: usize = (0..height).map(|y| self.stretches(y, width).iter().map(Range::len).sum::<usize>()).sum();
        inside as f64 / (width * height).max(1) as f64
    }

    /// The pixels of row `y` whose centers lie inside, of `width`: ascending stretches of columns.
    fn stretches(&self, y: usize, width: usize) -> Vec<Range<usize>> {
        let middle = y as f64 + 0.5;
        let ends = self.corners.iter().zip(self.corners.iter().cycle().skip(1));
        // Of an edge, the upper end counts and the lower one does not, so that corners are not counted twice.
        let crossing = |([x, y], [next_x, next_y]): (&[f64; 2], &[f64; 2])| {
            ((*y <= middle) != (*next_y <= middle)).then(|| x + (middle - y) / (next_y - y) * (next_x - x))
        };
        let mut crossings: Vec<f64> = ends.filter_map(crossing).collect();
        crossings.sort_unstable_by(f64::total_cmp);
        // The casts saturate.
        let column = |x: f64| ((x - 0.5).ceil().max(0.0) as usize).min(width);
        crossings.as_chunks::<2>().0.iter().map(|&[left, right]| column(left)..column(right)).collect()
    }

    /// What of a picture of `size` pixels lies beside the photograph.
    pub fn beside(&self, [width, height]: [usize; 2]) -> Mask {
        Mask::from_rows(width, height, |y| complement(0..width, self.stretches(y, width).into_iter()))
    }

    /// The photograph in `picture`, with an alpha channel: what lies beside it is transparent.
    pub fn cut(&self, picture: &Photograph) -> Photograph {
        match picture {
            Photograph::Eight(raster) => Photograph::Eight(self.cut_raster(raster, u8::MAX)),
            Photograph::Sixteen(raster) => Photograph::Sixteen(self.cut_raster(raster, u16::MAX)),
        }
    }

    /// The photograph in a picture of one (gray), three or four channels, whose samples go up to `opaque`.
    fn cut_raster<T: Copy + Default>(&self, picture: &Raster<T>, opaque: T) -> Raster<T> {
        let (width, channels) = (picture.width(), picture.channels());
        let mut cut = Raster::new(width, picture.height(), 4);
        for y in 0..picture.height() {
            let (row, from) = (cut.row_mut(y).as_chunks_mut::<4>().0, picture.row(y));
            for x in self.stretches(y, width).into_iter().flatten() {
                row[x] = match from[x * channels..(x + 1) * channels] {
                    [red, green, blue] => [red, green, blue, opaque],
                    [red, green, blue, alpha] => [red, green, blue, alpha],
                    [gray, ..] => [gray, gray, gray, opaque],
                    [] => continue,
                };
            }
        }
        cut
    }
}

impl TryFrom<Vec<[f64; 2]>> for Outline {
    type Error = &'static str;

    fn try_from(corners: Vec<[f64; 2]>) -> Result<Self, Self::Error> {
        Self::new(corners).ok_or("an outline has three corners at least, all of them finite")
    }
}

impl From<Outline> for Vec<[f64; 2]> {
    fn from(outline: Outline) -> Self {
        outline.corners
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square on its corner around (4, 4), whose corners are 3 from there.
    fn diamond() -> Outline {
        Outline::new(vec![[4.0, 1.0], [7.0, 4.0], [4.0, 7.0], [1.0, 4.0]]).expect("four corners")
    }

    /// A pixel is inside whose center is; of two centers on the outline of a row the left one is. By hand: 1, 3, 5, 5,
    /// 3 and 1 of rows 1 to 6.
    #[test]
    fn what_is_beside_a_diamond() {
        let rows: Vec<_> = (0..8).map(|y| diamond().stretches(y, 8)).collect();
        assert_eq!(rows[0], []);
        assert_eq!((rows[1][0].clone(), rows[3][0].clone()), (3..4, 1..6));
        let beside = diamond().beside([8, 8]);
        let inside = (0..64).filter(|&at| !beside.is_marked(at % 8, at / 8)).count();
        assert_eq!((inside, diamond().share_of([8, 8])), (18, 18.0 / 64.0));
        assert!(!beside.is_marked(3, 3) && beside.is_marked(1, 1) && beside.is_marked(7, 7));
        // The diamond's area is 18.
        assert!((diamond().scaled(16.0).share_of([128, 128]) - 18.0 / 64.0).abs() < 0.01);
    }

    #[test]
    fn what_is_beside_is_transparent() {
        let colored = Raster::from_data(8, 8, 3, vec![9_u16; 192]).expect("as many samples");
        let Photograph::Sixteen(cut) = diamond().cut(&Photograph::Sixteen(colored)) else { panic!("another depth") };
        assert_eq!((cut.pixel(4, 4), cut.pixel(0, 0)), ([9, 9, 9, u16::MAX].as_slice(), [0; 4].as_slice()));
        let gray = Raster::from_data(8, 8, 1, vec![7_u8; 64]).expect("as many samples");
        let Photograph::Eight(cut) = diamond().cut(&Photograph::Eight(gray)) else { panic!("another depth") };
        assert_eq!((cut.pixel(4, 4), cut.pixel(0, 0)), ([7, 7, 7, u8::MAX].as_slice(), [0; 4].as_slice()));
        let half = Raster::from_data(8, 8, 4, vec![5_u8; 256]).expect("as many samples");
        let Photograph::Eight(cut) = diamond().cut(&Photograph::Eight(half)) else { panic!("another depth") };
        assert_eq!((cut.pixel(4, 4), cut.pixel(0, 0)), ([5; 4].as_slice(), [0; 4].as_slice()));
    }

    #[test]
    fn what_is_no_polygon_is_refused() {
        assert!(Outline::new(vec![[0.0, 0.0], [1.0, 0.0]]).is_none());
        assert!(Outline::new(vec![[0.0, 0.0], [1.0, f64::NAN], [1.0, 1.0]]).is_none());
        let whole = diamond();
        let read = serde_json::from_value(serde_json::to_value(&whole).expect("numbers"));
        assert_eq!(read.ok(), Some(whole));
        assert!(serde_json::from_str::<Outline>("[[0, 0], [1, 0]]").is_err());
    }
}
