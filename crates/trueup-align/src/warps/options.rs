//! Options of the warp models.

use super::{Kernel, Projection};

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
        /// Where those of the methods sphp, sphp-free and quasi-homography come from.
        pair_homographies: HomographySource = HomographySource::Pairs, Allowed::Any, "";
        /// The surface that the method autostitch projects onto.
        projection: Projection = Projection::Spherical, Allowed::Any, "";
        /// How the weight of a match falls with its distance from a vertex in the method apap.
        apap_kernel: Kernel = Kernel::Code, Allowed::Any, "";
        /// Distance over which that weight falls to 1/e; 72.25 is the published 8.5 squared.
        apap_decay_px: f64 = 72.25, between(1.0, 10000.0), "working px";
        /// Smallest such weight; 1 makes all weights equal, which is one homography.
        apap_weight_floor: f64 = 0.0015, between(0.0, 1.0), "";
        /// The same distance in the method aanap; 156.25 is the published 12.5 squared.
        aanap_decay_px: f64 = 156.25, between(1.0, 10000.0), "working px";
        /// Degrees of freedom of Student's t by which anchors are weighed in the linearized homography of aanap.
        aanap_freedom: f64 = 5.0, between(0.1, 1000.0), "";
        /// Largest distance of a match from a plane's homography in aanap's search for the similarity, in units in which
        /// matches are 1.4 from their center on average.
        aanap_plane_tolerance: f64 = 0.01, between(1e-5, 1.0), "";
        /// Matches that make a plane in that search.
        aanap_plane_matches: usize = 50, between(4.0, 1e6), "matches";
        /// Whether aanap moves the pictures that are placed already along with the one that joins them.
        adapt_reference: bool = true, Allowed::Any, "";
        /// Depth, relative to the distance, below which a viewing direction counts as beside or behind the panorama's
        /// plane; 0.02 is 88.9 degrees off its axis.
        min_depth: f64 = 0.02, between(1e-6, 0.9), "";
        /// Farthest that a picture may reach from the reference's center.
        max_reach: f64 = 20.0, between(1.0, 1e6), "reference diagonals";
        /// Largest area of a picture in the panorama.
        max_area_ratio: f64 = 25.0, between(1.0, 1e6), "reference areas";
        /// Largest share of a picture's grid that may be folded.
        max_folded_share: f64 = 0.02, between(0.0, 1.0), "";
    }
}
