//! Weights that fall with distance.

trueup_core::choice! {
    /// How the weight of a match falls with its distance from a vertex.
    pub enum DistanceKernel {
        /// exp(-distance / decay), as in the authors' program.
        Code = "code",
        /// exp(-(distance / decay)^2), as in the paper.
        Paper = "paper",
    }
}

impl DistanceKernel {
    /// The weight at a distance, both lengths in the same unit.
    pub(super) fn weight(self, distance: f64, decay: f64) -> f64 {
        match self {
            Self::Code => (-distance / decay).exp(),
            Self::Paper => (-(distance / decay).powi(2)).exp(),
        }
    }
}
