//! What a user can choose about vanishing directions.

trueup_core::choice! {
    /// What of the cameras the search for vanishing directions knows.
    pub enum Intrinsics {
        /// The focal length that was adjusted to the matches.
        Adjusted = "adjusted",
        /// Nothing: two vanishing points tell the focal length, as published.
        Unknown = "unknown",
    }
}

trueup_core::options! {
    /// How vanishing directions are found in one photograph.
    pub struct VanishingOptions("vanishing") {
        /// Pairs of segments drawn as hypotheses of a first direction: 106 find a triad with probability 0.9999 if half
        /// of the segments belong to it. Raise it where clutter hides the directions; time grows with it.
        draws: usize = 106, between(1.0, 1e5), "";
        /// Largest angle between a direction and a segment's interpretation plane for the segment to support it. Raise
        /// it for lenses whose distortion bends lines; lower it where several directions lie close together.
        tolerance_deg: f64 = 3.0, between(0.1, 30.0), "degrees";
        /// Fewer segments yield no triad. Raise it where photographs with little structure mislead the others.
        min_lines: usize = 10, between(3.0, 1e5), "segments";
        /// Lower quality (fraction of the segments' weight that supports the triad) yields no triad. Raise it where
        /// organic scenes yield directions that are none; lower it where architecture is seen between much clutter.
        min_quality: f64 = 0.25, between(0.0, 1.0), "";
        /// What the search knows of the camera. `unknown` to compare with the published method, or where the cameras
        /// are far from what the photographs show.
        intrinsics: Intrinsics = Intrinsics::Adjusted, Allowed::Any, "";
    }
}
