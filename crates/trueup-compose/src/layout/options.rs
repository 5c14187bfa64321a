//! What the user decides about the canvas.

trueup_core::choice! {
    /// What of the canvas is kept.
    pub enum Crop {
        /// The rectangle without ragged borders that loses least of what matters: sky, lawn and blurred borders before
        /// towers, people and lines. Small empty corners beside a smooth sky or floor are filled, so that less must go.
        Auto = "auto",
        /// The largest rectangle without holes, whatever it cuts through.
        Rectangle = "rectangle",
        /// All that any photograph covers; what none covers is transparent or background.
        None = "none",
    }
}

trueup_core::options! {
    /// How large the panorama becomes.
    pub struct CanvasOptions("canvas") {
        /// Size of the panorama relative to the reference photograph's own pixels: 1 keeps every detail the reference
        /// has. Lower it for a quick preview (0.25) or a smaller file; raise it only if the reference was taken with a
        /// shorter lens than the others.
        scale: f64 = 1.0, between(1e-4, 16.0), "", basic;
        /// Largest number of canvas pixels. Lower it where whatever shows the panorama has a limit: a larger canvas is
        /// reduced evenly to fit, and a diagnostic says so. What memory and disk hold is checked besides.
        max_pixels: f64 = 1e12, between(1.0, 1e12), "px";
        /// Canvas pixels for each pixel of the photographs (as large as the scale makes them) above which a canvas of
        /// more than 400 million pixels is reduced evenly: a shape that runs away is not worth its time. Raise it if
        /// `canvas-reduced` is reported for a panorama whose stretched borders you want.
        max_growth: f64 = 8.0, between(1.0, 1e6), "";
        /// What of the canvas is kept. Choose `none` for all that the photographs show, with ragged borders.
        crop: Crop = Crop::Auto, Allowed::Any, "", basic;
        /// Share of the covered pixels that `crop = auto` must be able to keep. Otherwise it takes the largest
        /// rectangle without holes, and where that keeps less as well, all, ragged borders too. Lower it if ragged
        /// borders are kept that you would rather lose.
        min_kept: f64 = 0.6, between(0.0, 1.0), "";
        /// Gaps between and beside the photographs of up to twice this width, as a share of a photograph's side, are
        /// filled as what lies beside them goes on. 0 fills nothing; raise it to 0.1 where ragged borders lie in a sky,
        /// a lawn or a wall, in which small fillings are not noticed.
        fill: f64 = 0.0, between(0.0, 1.0), "", basic;
    }
}
