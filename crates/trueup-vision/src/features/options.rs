//! How features are found.

trueup_core::options! {
    /// How features are found.
    pub struct FeatureOptions("features") {
        /// Most points kept of a photograph, strongest response first, each of which is compared with all of another
        /// photograph. Raise it for photographs full of fine texture that overlap little, for a time of matching that
        /// grows with its square; lower it to save time and memory where there are many photographs that overlap well.
        max_points: usize = 4000, between(1.0, 1_000_000.0), "points";
        /// Smallest difference-of-Gaussians response of a point. The default of 0 keeps the weak points that fog and
        /// low contrast leave; raise it where noise gives most of the points and hides those of the scene.
        peak_threshold: f64 = 0.0, between(0.0, 255.0), "gray levels of 0 to 255";
    }
}
