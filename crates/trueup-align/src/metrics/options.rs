//! What a user decides of how a panorama is measured.

trueup_core::options! {
    /// How a finished panorama is measured.
    pub struct PixelMeasureOptions("measures") {
        /// Size of the canvas that pixels are compared on; panoramas that are smaller are not enlarged. Raise it to
        /// compare finer detail: time and memory grow with it, and figures of different sizes do not compare.
        canvas_pixels: f64 = 1.5e6, between(1e4, 1e9), "px";
    }
}
