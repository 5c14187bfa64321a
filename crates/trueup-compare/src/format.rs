//! In which format panoramas are compared.

trueup_core::choice! {
    /// In which format panoramas are compared: those that browsers show.
    pub enum PanoramaFormat {
        /// JPEG: small, over a background.
        Jpeg = "jpg",
        /// PNG: lossless, with transparency.
        Png = "png",
        /// WebP: lossless, with transparency.
        WebP = "webp",
    }
}
