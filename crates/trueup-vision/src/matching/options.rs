//! How pairs are matched and judged.

trueup_core::options! {
    /// How photographs are matched in pairs and which pairs are joined.
    pub struct MatchingOptions("matching") {
        /// Largest ratio of the distances to the nearest and the second-nearest point. Lower it where repeated windows
        /// or tiles are taken for one another; raise it where pairs that overlap have too few matches.
        max_distance_ratio: f64 = 0.8, between(0.1, 1.0), "";
        /// How far a match may lie from where the pair's homography predicts it. Raise it for photographs taken from
        /// different places, or by lenses that bend lines, if pairs that overlap are left out; lower it where wrong
        /// pairs are joined.
        inlier_px: f64 = 5.0, between(0.5, 50.0), "working px";
        /// Fewest agreeing matches of a joined pair. Lower it for small overlaps with little texture, which helps as
        /// far as these have few matches: more than 8 and three tenths of those in the overlap must agree in any case.
        /// Of a photograph that is left over, two fifths of it suffice where all that its matches lay over another one
        /// looks alike.
        /// Raise it where pairs are joined that do not overlap.
        min_inliers: usize = 15, between(4.0, 10000.0), "matches", basic;
    }
}

/// The share of `min_inliers` that suffices where all that the matches lay over each other looks alike: six of 15, two
/// more than fix a homography.
const SHARE_IF_ALIKE: f64 = 0.4;

impl MatchingOptions {
    /// Fewest agreeing matches of a pair that is joined because all that they lay over each other looks alike.
    pub fn fewest_if_alike(&self) -> usize {
        (SHARE_IF_ALIKE * self.min_inliers as f64).ceil() as usize
    }
}
