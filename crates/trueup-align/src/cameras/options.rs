//! What a user can choose about cameras.

trueup_core::choice! {
    /// Which photographs share a focal length.
    pub enum FocalSharing {
        /// One focal length per camera and size, unless the photographs themselves say that it varies.
        Auto = "auto",
        /// One focal length per camera and size.
        Shared = "shared",
        /// A focal length for every photograph.
        PerPicture = "per-picture",
    }
}

trueup_core::options! {
    /// How cameras are found.
    pub struct CameraOptions("cameras") {
        /// Which photographs share a focal length. `shared` where the lens was not touched and short rows still bend;
        /// `per-photograph` where it was zoomed between photographs and `auto` does not notice.
        focal_sharing: FocalSharing = FocalSharing::Auto, Allowed::Any, "";
        /// Standard deviation of a focal length from metadata, relative. Lower it where the metadata are calibrated;
        /// raise it where a lens reports a focal length that is far from the true one.
        known_focal_sd: f64 = 0.1, between(0.001, 10.0), "";
        /// Root mean square residual above which a pair is set aside, if the photographs stay connected without it.
        /// Raise it to keep overlaps with parallax; lower it where a wrong pair bends the panorama.
        max_pair_rms_px: f64 = 10.0, between(0.5, 1000.0), "working px";
    }
}
