//! How far exposures of one stack are apart.

/// Exposures of a stack are at least this far apart, in stops: cameras bracket by a third of a stop and more, by less than a whole one hardly
/// anybody does, and two photographs of one exposure, as well as what an automatic exposure changes between two, are no stack.
pub const LEAST_STOPS: f64 = 0.5;

/// Farthest that two exposures of one stack lie apart, as a part of the longer side: 3 degrees of 60. Neighbors of a row are farther apart.
pub(super) const MOST_SHIFT: f64 = 0.05;
