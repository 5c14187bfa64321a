//! Scale-invariant features (SIFT).

/// Length of a SIFT descriptor: 4 x 4 spatial bins of 8 orientations.
pub const DESCRIPTOR_LENGTH: usize = 128;

/// A SIFT descriptor, quantised to bytes.
pub type Descriptor = [u8; DESCRIPTOR_LENGTH];

/// A place that looks distinctive at one scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeaturePoint {
    /// Position (x, y) in the picture's pixels.
    pub position: [f64; 2],
    /// Standard deviation of the Gaussian at which it was found, in the picture's pixels.
    pub scale_px: f64,
    /// Absolute difference-of-Gaussians response, in grey levels of 0 to 255.
    pub response: f64,
}

/// The features of one picture.
///
/// A point may have several descriptors, one for each dominant orientation; the distance of two points is the smallest
/// over their descriptors.
#[derive(Debug, Clone, Default)]
pub struct Features {
    /// The points, strongest response first.
    pub points: Vec<FeaturePoint>,
    /// The descriptors; those of one point are neighbours, in the order of the points.
    pub descriptors: Vec<Descriptor>,
    /// For every descriptor, the index of its point.
    pub descriptor_points: Vec<u32>,
}
