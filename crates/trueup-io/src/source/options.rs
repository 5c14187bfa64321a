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

trueup_core::options! {
    /// Which files are accepted as photographs.
    pub struct SourceOptions("source") {
        /// Largest photograph that is accepted; larger ones are rejected by their header, before memory is taken. Raise it if
        /// a photograph is truly so large; lower it to protect a server.
        max_megapixels: f64 = 300.0, between(0.001, 10_000.0), "megapixels";
        /// When the EXIF orientation tag is applied. Choose always or never if photographs lie on their side.
        trust_orientation: OrientationTrust = OrientationTrust::Auto, Allowed::Any, "", basic;
    }
}
