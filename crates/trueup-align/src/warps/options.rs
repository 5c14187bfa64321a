//! Options of the warp models.

trueup_core::choice! {
    /// Where the homographies between pictures come from.
    pub enum HomographySource {
        /// From the cameras: they agree all the way round, and know of no parallax.
        Cameras = "cameras",
        /// From the matches of each pair, chained along the strongest overlaps.
        Pairs = "pairs",
    }
}

trueup_core::options! {
    /// How the methods that are warp models place the pictures.
    pub struct WarpOptions("warps") {
        /// Where the homographies of the method homography come from.
        homographies: HomographySource = HomographySource::Cameras, Allowed::Any, "";
        /// Depth, relative to the distance, below which a viewing direction counts as beside or behind the panorama's
        /// plane; 0.02 is 88.9 degrees off its axis.
        min_depth: f64 = 0.02, between(1e-6, 0.9), "";
        /// Farthest that a picture may reach from the reference's centre.
        max_reach: f64 = 20.0, between(1.0, 1e6), "reference diagonals";
        /// Largest area of a picture in the panorama.
        max_area_ratio: f64 = 25.0, between(1.0, 1e6), "reference areas";
        /// Largest share of a picture's grid that may be folded.
        max_folded_share: f64 = 0.02, between(0.0, 1.0), "";
    }
}
