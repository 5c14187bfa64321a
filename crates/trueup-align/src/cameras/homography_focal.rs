//! The focal lengths of rotating cameras by the homography between their photographs.

use nalgebra::Vector2;
use trueup_core::geometry::Homography;
use trueup_core::source::WorkingFrame;

/// The focal lengths of the two cameras behind a homography, in its pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FocalLengths {
    pub source: f64,
    pub target: f64,
}

/// A quotient that is the square of a focal length.
#[derive(Debug, Clone, Copy)]
struct Quotient {
    numerator: f64,
    denominator: f64,
}

impl Quotient {
    fn over(numerator: f64, denominator: f64) -> Self {
        Self { numerator, denominator }
    }

    /// The square root, where it is real.
    fn root(self) -> Option<f64> {
        let quotient = self.numerator / self.denominator;
        (quotient.is_finite() && quotient > 0.0).then(|| quotient.sqrt())
    }
}

/// Focal lengths of the rotating cameras behind a homography from the first of two photographs to the second, if both
/// are real.
///
/// Of the two values that the rows (source) and the columns (target) of the homography give, the one with the larger
/// denominator is taken.
///
/// # Source
/// Szeliski and Shum, "Creating full view panoramic image mosaics" (1997), section 5.
pub(super) fn focal_from_homography(
    target_from_source: &Homography,
    frames: [&WorkingFrame; 2],
) -> Option<FocalLengths> {
    let [source, target] = frames.map(|frame| Vector2::new(frame.width / 2.0, frame.height / 2.0));
    let centered = target_from_source.0.prepend_translation(&source).append_translation(&-target);
    let h = |row: usize, column: usize| centered[(row, column)];
    let source = better_root(
        Quotient::over(-h(0, 2) * h(1, 2), h(0, 0) * h(1, 0) + h(0, 1) * h(1, 1)),
        Quotient::over(
            h(1, 2).powi(2) - h(0, 2).powi(2),
            h(0, 0).powi(2) + h(0, 1).powi(2) - h(1, 0).powi(2) - h(1, 1).powi(2),
        ),
    )?;
    let target = better_root(
        Quotient::over(-(h(0, 0) * h(0, 1) + h(1, 0) * h(1, 1)), h(2, 0) * h(2, 1)),
        Quotient::over(
            h(0, 0).powi(2) + h(1, 0).powi(2) - h(0, 1).powi(2) - h(1, 1).powi(2),
            h(2, 1).powi(2) - h(2, 0).powi(2),
        ),
    )?;
    Some(FocalLengths { source, target })
}

/// The square root of whichever quotient is positive; of two, that with the larger denominator.
fn better_root(first: Quotient, second: Quotient) -> Option<f64> {
    match (first.root(), second.root()) {
        (Some(one), Some(other)) => Some(if first.denominator.abs() >= second.denominator.abs() { one } else { other }),
        (one, other) => one.or(other),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    /// Photographs whose pixels are counted from their middles.
    const CENTERED: [&WorkingFrame; 2] = [&WorkingFrame { width: 0.0, height: 0.0, working_from_full: 1.0 }; 2];

    /// Focal lengths 800 and 1000 were put into the homography by hand: K_j R K_i^-1.
    #[test]
    fn focal_lengths_are_recovered_exactly() {
        let degrees = f64::to_radians;
        let rotation =
            rotation_about_x(degrees(6.0)) * rotation_about_y(degrees(22.0)) * rotation_about_z(degrees(4.0));
        let intrinsic = |focal: f64| Matrix3::from_diagonal(&nalgebra::Vector3::new(focal, focal, 1.0));
        let inverse = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0 / 800.0, 1.0 / 800.0, 1.0));
        for scale in [1.0, -0.37] {
            let homography = Homography(intrinsic(1000.0) * rotation * inverse * scale);
            let FocalLengths { source, target } = focal_from_homography(&homography, CENTERED).expect("regular");
            assert!((source - 800.0).abs() < 1e-9 * 800.0, "{source}");
            assert!((target - 1000.0).abs() < 1e-9 * 1000.0, "{target}");
        }
    }

    #[test]
    fn a_translation_tells_no_focal_length() {
        let shift = Homography(Matrix3::new(1.0, 0.0, 120.0, 0.0, 1.0, 7.0, 0.0, 0.0, 1.0));
        assert!(focal_from_homography(&shift, CENTERED).is_none());
    }
}
