//! Coarse features: what is left to see of a photograph that was blurred.

use trueup_core::{Result, StageContext};

use super::detect;
use super::feature::{FeaturePoint, Features};
use super::options::FeatureOptions;
use crate::gray::halved;

/// The features of a photograph at half its size, in its own pixels; `fine` are those at its own, of which what
/// surrounds them is looked at.
///
/// Features are kept by strength. What sharpening makes of noise is fine and strong, and leaves no room for the coarse
/// features that a blurred photograph shares with others; at half the size it is gone. Where few features are found
/// there, the half is searched doubled, as [`detect`] does: of 11 cut sets with blurred photographs 71 of 72 are joined
/// so, 70 without, and those of three photographs meet to 0.09 to 0.17 px instead of 0.26 to 0.30.
///
/// # Errors
/// Those of [`detect`].
pub fn detect_coarse(fine: &Features, options: &FeatureOptions, context: &StageContext) -> Result<Features> {
    // Means are blurred by half a sample, which is what a search for features assumes: by half a sample of the picture
    // itself, by 0.7 as what surrounds features, and by 0.5 as means, 1.0 of the picture's samples in all.
    let half = halved(&fine.surroundings);
    let found = detect(&half, options, context)?;
    let in_own_pixels = |point: FeaturePoint| FeaturePoint {
        position: point.position.map(|coordinate| 2.0 * coordinate),
        scale_px: 2.0 * point.scale_px,
        ..point
    };
    Ok(Features {
        points: found.points.into_iter().map(in_own_pixels).collect(),
        surroundings: fine.surroundings.clone(),
        ..found
    })
}

#[cfg(test)]
mod tests {
    use trueup_core::raster::Raster;

    use super::*;

    /// A blob is where it was and as large.
    #[test]
    fn coarse_features_lie_in_the_photographs_own_pixels() {
        let (width, height, center, deviation) = (200, 160, [90.3_f64, 70.8], 12.0);
        let mut picture = Raster::new(width, height, 1);
        for y in 0..height {
            for (x, sample) in picture.row_mut(y).iter_mut().enumerate() {
                let away = (x as f64 + 0.5 - center[0]).hypot(y as f64 + 0.5 - center[1]);
                *sample = (60.0 + 120.0 * (-0.5 * (away / deviation).powi(2)).exp()) as f32;
            }
        }
        let options = FeatureOptions::default();
        let fine = detect(&picture, &options, &StageContext::default()).expect("features");
        let coarse = detect_coarse(&fine, &options, &StageContext::default()).expect("features");
        let nearest = |features: &Features| {
            let away = |point: &FeaturePoint| (point.position[0] - center[0]).hypot(point.position[1] - center[1]);
            *features.points.iter().min_by(|one, other| away(one).total_cmp(&away(other))).expect("a point")
        };
        let (one, other) = (nearest(&fine), nearest(&coarse));
        let apart = (one.position[0] - other.position[0]).hypot(one.position[1] - other.position[1]);
        assert!(apart < 0.3, "{apart}");
        assert!((other.scale_px / one.scale_px - 1.0).abs() < 0.1, "{} {}", one.scale_px, other.scale_px);
        assert_eq!(coarse.surroundings, fine.surroundings);
    }
}
