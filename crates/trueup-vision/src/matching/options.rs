//! How pairs are matched and judged.

trueup_core::options! {
    /// How pictures are matched in pairs and which pairs are joined.
    pub struct MatchingOptions("matching") {
        /// Strongest features of each picture that are compared with all such of the other. Those beyond are matched near
        /// the places that these predict (`guided`). More finds smaller overlaps; the time grows with the square.
        compared_features: usize = 4000, between(16.0, 1000000.0), "features";
        /// Largest ratio of the distances to the nearest and the second-nearest point. Lower is stricter.
        max_distance_ratio: f64 = 0.8, between(0.1, 1.0), "";
        /// How far from the nearest point the second-nearest must lie in the picture; nearer ones are the same place.
        second_separation_px: f64 = 3.0, between(0.0, 100.0), "px";
        /// Whether the nearest point must also be nearest in the other direction.
        mutual: bool = true, Allowed::Any, "";
        /// Matches are dropped whose squared distance exceeds the pair's mean by more than so many standard deviations.
        distance_deviations: f64 = 4.25, between(0.0, 100.0), "standard deviations";
        /// How far a match may lie from where the global homography predicts it.
        inlier_px: f64 = 5.0, between(0.5, 50.0), "px";
        /// Probability of having drawn a sample of inliers; eight times as many as that takes are drawn, because not every
        /// sample of inliers leads to the best homography.
        confidence: f64 = 0.995, between(0.5, 0.999999), "";
        /// Largest number of samples drawn for the global homography. More finds pairs of which fewer matches agree.
        max_samples: usize = 6000, between(1.0, 1000000.0), "samples";
        /// Constant of the Brown-Lowe test: a pair is joined if more than alpha + beta n_f of its n_f matches in the
        /// predicted overlap agree.
        brown_lowe_alpha: f64 = 8.0, between(0.0, 1000.0), "matches";
        /// Factor of the Brown-Lowe test.
        brown_lowe_beta: f64 = 0.3, between(0.0, 1.0), "";
        /// Fewest agreeing matches of a joined pair.
        min_inliers: usize = 15, between(4.0, 10000.0), "matches";
        /// Fewest agreeing matches of a pair that the user's graph joins.
        min_inliers_by_graph: usize = 8, between(4.0, 10000.0), "matches";
        /// Largest factor by which a homography may enlarge or reduce areas in the overlap it predicts.
        max_area_ratio: f64 = 20.0, between(1.0, 10000.0), "";
        /// How far a match may lie from where a further plane's homography predicts it.
        plane_inlier_px: f64 = 3.0, between(0.5, 50.0), "px";
        /// Fewest matches of a further plane.
        min_plane_inliers: usize = 40, between(8.0, 10000.0), "matches";
        /// Number of samples drawn for every further plane at most.
        max_plane_samples: usize = 3308, between(1.0, 1000000.0), "samples";
        /// How far a further plane's matches may lie from where the global homography predicts them, as a fraction of
        /// the picture's diagonal.
        max_plane_displacement: f64 = 0.25, between(0.0, 1.0), "diagonals";
        /// Whether a joined pair is matched again near the places its homographies predict, for more and better
        /// spread matches.
        guided: bool = true, Allowed::Any, "";
        /// Largest distance ratio of a match found near its predicted place.
        guided_distance_ratio: f64 = 0.9, between(0.1, 1.0), "";
        /// How far around the predicted place a match and its rivals are sought.
        guided_radius_px: f64 = 12.0, between(1.0, 100.0), "px";
    }
}
