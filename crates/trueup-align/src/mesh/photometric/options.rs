//! What a user decides of photometric alignment.

trueup_core::options! {
    /// How pixels align the grids (`stitch.align = photometric`).
    pub struct PhotometricOptions("photometric") {
        /// Weight of a squared difference of gray levels, for samples 4 px apart. Raise it where overlaps still show
        /// double and have texture; lower it where noise or moving things bend the photographs.
        weight: f64 = 0.01, between(0.0, 1000.0), "per gray level squared";
    }
}
