//! What the user decides about seams.

trueup_core::options! {
    /// Where one photograph ends and the next begins.
    pub struct SeamOptions("seam") {
        /// Cost of showing a photograph at its border instead of in its middle, per pixel of the canvas. Raise it to
        /// move seams towards the middle of overlaps, where photographs blur towards their borders; lower it if seams
        /// run through things that they could go round.
        depth_weight: f64 = 2.5, between(0.0, 100.0), "level";
        /// Cost of showing a photograph that lacks all detail where another one shows the same in focus, per pixel of
        /// the canvas; what lacks a part costs as much less. Raise it if things are shown out of focus that another
        /// photograph has sharp; 0 does not look.
        sharpness_weight: f64 = 5.0, between(0.0, 100.0), "level";
        /// Further cost of a seam through a thing that moved. Raise it if people or cars are cut in half.
        moving_cost: f64 = 60.0, between(0.0, 1000.0), "level";
        /// Weight of the difference of shading beside that of colors: of how the brightness changes over a few pixels,
        /// averaged along a line, and of steps of the mean brightness where a wide transition has no room. Higher keeps
        /// seams from where only a step could join the photographs: raise it if steps are seen in skies and on walls,
        /// lower it if seams go through contours to avoid these.
        shading_weight: f64 = 3.0, between(0.0, 100.0), "";
    }
}
