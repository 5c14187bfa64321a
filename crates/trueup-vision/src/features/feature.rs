//! What a photograph's features are: distinctive places and the descriptions of their surroundings.

use serde::{Deserialize, Serialize};
use trueup_core::raster::Raster;
use trueup_core::{Error, Result};

/// Length of a SIFT descriptor: 4 x 4 spatial bins of 8 orientations.
pub const DESCRIPTOR_LENGTH: usize = 128;

/// A SIFT descriptor, quantized to bytes.
pub type Descriptor = [u8; DESCRIPTOR_LENGTH];

/// A place that looks distinctive at one scale.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FeaturePoint {
    /// Position (x, y) in the photograph's pixels.
    pub position: [f64; 2],
    /// Standard deviation of the Gaussian at which it was found, in the photograph's pixels.
    pub scale_px: f64,
    /// Absolute difference-of-Gaussians response, in gray levels of 0 to 255.
    pub response: f64,
}

/// The features of one photograph.
///
/// A point may have several descriptors, one for each dominant orientation; the distance of two points is the smallest
/// over their descriptors.
#[derive(Debug, Clone, Default)]
pub struct Features {
    /// The points, strongest response first.
    pub points: Vec<FeaturePoint>,
    /// The descriptors; those of one point are neighbors, in the order of the points.
    pub descriptors: Vec<Descriptor>,
    /// For every descriptor, the index of its point.
    pub descriptor_points: Vec<u32>,
    /// The picture they were found in, gray and a little smoothed, by which matches are placed more exactly than points
    /// are found; empty where it is not known.
    pub surroundings: Raster<u8>,
}

impl Features {
    /// Those whose points satisfy `wanted`, in their order, with all that surrounds them.
    #[must_use]
    pub fn filtered(&self, wanted: impl Fn(&FeaturePoint) -> bool) -> Self {
        let mut kept = Self { surroundings: self.surroundings.clone(), ..Self::default() };
        let mut number = vec![None; self.points.len()];
        for (point, number) in self.points.iter().zip(&mut number) {
            if wanted(point) {
                *number = Some(kept.points.len() as u32);
                kept.points.push(*point);
            }
        }
        for (descriptor, &point) in self.descriptors.iter().zip(&self.descriptor_points) {
            if let Some(&Some(number)) = number.get(point as usize) {
                kept.descriptors.push(*descriptor);
                kept.descriptor_points.push(number);
            }
        }
        kept
    }

    /// Checks that descriptors and points fit together and their surroundings are gray, so that no index is out of
    /// range later. `photograph` is the index by which an error names their photograph.
    ///
    /// # Errors
    /// [`Error::Input`] if they do not, if positions are not finite, or if what surrounds them is not gray.
    pub(crate) fn check(&self, photograph: usize) -> Result<()> {
        let (owners, surroundings) = (&self.descriptor_points, &self.surroundings);
        let consistent = owners.len() == self.descriptors.len()
            && owners.is_sorted()
            && owners.last().is_none_or(|&last| (last as usize) < self.points.len())
            && self.points.iter().all(|point| point.position.iter().all(|x| x.is_finite()))
            && (surroundings.channels() == 1 || surroundings.data().is_empty() && surroundings.width() == 0);
        if consistent {
            return Ok(());
        }
        Err(Error::input(
            format!("features of photograph {photograph}"),
            "descriptors and points do not fit together, positions are not finite, or the picture around them is not gray",
            "Detect the features anew.",
        ))
    }
}
