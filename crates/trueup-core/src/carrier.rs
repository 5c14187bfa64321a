//! The parts of a photograph that show what carries the camera: a bonnet, the legs of a drone, a window's frame.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::mask::Mask;

/// A rectangle of a picture as it is shown: left, top, right and bottom, in its pixels.
pub type Rectangle = [f64; 4];

/// Where a photograph shows what the camera is fixed to, and not the scene: rectangles side by side, in pixels of the
/// photograph.
///
/// Nothing there is looked at, and it is not shown where another photograph can be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Rectangle>", into = "Vec<Rectangle>")]
pub struct CarrierParts {
    rectangles: Vec<Rectangle>,
}

impl CarrierParts {
    /// These rectangles; `None` without one, and if a side is not finite or lies beyond the opposite one.
    pub fn new(rectangles: Vec<Rectangle>) -> Option<Self> {
        let is_one = |&[left, top, right, bottom]: &Rectangle| {
            [left, top, right, bottom].iter().all(|side| side.is_finite()) && left <= right && top <= bottom
        };
        (!rectangles.is_empty() && rectangles.iter().all(is_one)).then_some(Self { rectangles })
    }

    /// The rectangles, as they were given.
    pub fn rectangles(&self) -> &[Rectangle] {
        &self.rectangles
    }

    /// The same in a picture that is so many times as large.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        Self { rectangles: self.rectangles.iter().map(|rectangle| rectangle.map(|side| side * scale)).collect() }
    }

    /// The pixels of a picture of `size` whose centers lie in them.
    pub fn mask(&self, [width, height]: [usize; 2]) -> Mask {
        Mask::from_rows(width, height, |y| {
            let middle = y as f64 + 0.5;
            let crossed = move |&&[_, top, _, bottom]: &&Rectangle| (top..bottom).contains(&middle);
            self.rectangles.iter().filter(crossed).map(|&[left, _, right, _]| columns(left, right))
        })
    }
}

/// The columns whose centers lie between two places.
fn columns(left: f64, right: f64) -> Range<usize> {
    // The casts saturate.
    let first = |place: f64| (place - 0.5).ceil().max(0.0) as usize;
    first(left)..first(right)
}

impl TryFrom<Vec<Rectangle>> for CarrierParts {
    type Error = &'static str;

    fn try_from(rectangles: Vec<Rectangle>) -> Result<Self, Self::Error> {
        Self::new(rectangles)
            .ok_or("the carrier's parts are rectangles of finite left, top, right and bottom, in order")
    }
}

impl From<CarrierParts> for Vec<Rectangle> {
    fn from(parts: CarrierParts) -> Self {
        parts.rectangles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_mark_the_pixels_whose_centers_they_hold() {
        let parts = CarrierParts::new(vec![[0.0, 2.0, 3.5, 4.0], [5.0, 3.0, 99.0, 4.0]]).expect("two rectangles");
        let expected = Mask::from_fn(8, 5, |x, y| (x < 3 && (2..4).contains(&y)) || (x >= 5 && y == 3));
        assert_eq!(parts.mask([8, 5]), expected);
        // 3 + 3 + 3 of 40.
        assert_eq!(parts.mask([8, 5]).share(), 9.0 / 40.0);
        assert_eq!(parts.scaled(2.0).rectangles()[0], [0.0, 4.0, 7.0, 8.0]);
    }

    #[test]
    fn what_is_no_rectangle_is_refused() {
        for bad in ["[]", "[[3,0,2,1]]", "[[0,4,2,1]]", "[[0,0,1]]"] {
            assert!(serde_json::from_str::<CarrierParts>(bad).is_err(), "{bad}");
        }
        assert!(CarrierParts::new(vec![[0.0, 0.0, f64::NAN, 1.0]]).is_none());
        let read: CarrierParts = serde_json::from_str("[[0,1,2,3]]").expect("a rectangle");
        assert_eq!(serde_json::to_string(&read).expect("json"), "[[0.0,1.0,2.0,3.0]]");
    }
}
