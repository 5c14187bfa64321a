//! Which part of the sphere a panorama shows.

use serde::{Deserialize, Serialize};

/// A projection that viewers of spherical panoramas know how to undo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SphericalProjection {
    /// Columns are longitudes, rows are latitudes, both in even steps.
    Equirectangular,
    /// Columns are longitudes in even steps, rows are tangents of latitudes.
    Cylindrical,
}

/// Where a panorama lies on the whole sphere of its projection: the whole picture's size, and the part that is there.
///
/// The whole turn is `full_width` pixels wide. An equirectangular sphere is half as high, from the zenith (row 0) to
/// the nadir. A cylinder has no end: `full_height` is then any height that holds the part and has the horizon in its
/// middle. Column `full_width / 2` looks to [`Self::middle_yaw`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SphericalFrame {
    /// How directions become pixels.
    pub projection: SphericalProjection,
    /// Width of the whole turn in pixels.
    pub full_width: usize,
    /// Height of the whole projection in pixels.
    pub full_height: usize,
    /// Columns of the whole left of the panorama's first column. `left` + the panorama's width is at most `full_width`.
    pub left: usize,
    /// Rows of the whole above the panorama's first row. `top` + the panorama's height is at most `full_height`.
    pub top: usize,
    /// Direction of the middle column of the whole in the levelled world, in which the cameras' rotations are recorded:
    /// radians to the right of its z axis.
    #[serde(default)]
    pub middle_yaw: f64,
}

impl SphericalFrame {
    /// Whether a panorama of `width` x `height` pixels lies inside the whole.
    pub fn holds(&self, width: usize, height: usize) -> bool {
        let fits =
            |start: usize, length: usize, whole: usize| start.checked_add(length).is_some_and(|end| end <= whole);
        width > 0
            && height > 0
            && fits(self.left, width, self.full_width)
            && fits(self.top, height, self.full_height)
            && self.middle_yaw.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_lies_inside_the_whole() {
        let frame = SphericalFrame {
            projection: SphericalProjection::Equirectangular,
            full_width: 4000,
            full_height: 2000,
            left: 1000,
            top: 500,
            middle_yaw: 0.0,
        };
        assert!(frame.holds(3000, 1500));
        assert!(!frame.holds(3001, 1500) && !frame.holds(3000, 1501) && !frame.holds(0, 10));
        assert!(!SphericalFrame { left: usize::MAX, ..frame }.holds(2, 2));
        assert!(!SphericalFrame { middle_yaw: f64::NAN, ..frame }.holds(2, 2));
    }
}
