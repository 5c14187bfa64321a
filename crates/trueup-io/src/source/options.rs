//! Which files are accepted as photographs.

trueup_core::choice! {
    /// When the EXIF orientation tag is applied.
    pub enum OrientationTrust {
        /// Unless the stored size shows that the pixels were turned already.
        Auto = "auto",
        /// Whenever the tag is present.
        Always = "always",
        /// Pixels are taken as they are stored.
        Never = "never",
    }
}

trueup_core::choice! {
    /// Which of the frames of a video that lie in a folder as files are used.
    pub enum FrameUse {
        /// Those that a panorama needs, of thirty or more that are numbered in order and show nearly the same.
        Needed = "needed",
        /// All of them.
        All = "all",
    }
}

trueup_core::options! {
    /// Which files are accepted as photographs.
    pub struct SourceOptions("source") {
        /// Largest photograph that is accepted; larger ones are rejected by their header, before memory is taken. Raise
        /// it if a photograph is truly so large; lower it to protect a server.
        max_megapixels: f64 = 300.0, between(0.001, 10_000.0), "megapixels";
        /// When the EXIF orientation tag is applied. Choose always or never if photographs lie on their side.
        trust_orientation: OrientationTrust = OrientationTrust::Auto, Allowed::Any, "", basic;
        /// Which frames of a video are used that lie in a folder as files. Choose all if photographs are passed over
        /// that are none.
        frames: FrameUse = FrameUse::Needed, Allowed::Any, "", basic;
    }
}
