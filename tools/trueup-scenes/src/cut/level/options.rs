//! How the vertical is measured.

trueup_core::options! {
    /// How a panorama's vertical is measured, and when the measurement is believed.
    pub struct LevelOptions("level") {
        /// Views around the horizon; even, so that both halves have the same number. Neighbors belong to different
        /// halves.
        views_around: usize = 12, between(4.0, 72.0), "views";
        /// Rows of views, the middle one level.
        rows: usize = 3, between(1.0, 9.0), "rows";
        /// Elevation from row to row.
        row_step_deg: f64 = 35.0, between(1.0, 80.0), "degrees";
        /// Width and height of a view.
        view_deg: f64 = 75.0, between(20.0, 120.0), "degrees";
        /// Largest width and height of a view; finer panoramas are averaged down to it.
        max_view_px: usize = 1200, between(100.0, 16384.0), "px";
        /// Shortest line used.
        min_length_deg: f64 = 1.5, between(0.1, 60.0), "degrees";
        /// Length at which a line's weight stops growing.
        weight_cap_deg: f64 = 15.0, between(0.1, 180.0), "degrees";
        /// How far from the panorama's own down the vertical is looked for.
        search_deg: f64 = 15.0, between(0.5, 45.0), "degrees";
        /// Step of that search.
        search_step_deg: f64 = 0.5, between(0.05, 5.0), "degrees";
        /// Largest angle between the vertical and a line's plane for the line to count as vertical.
        tolerance_deg: f64 = 3.0, between(0.05, 15.0), "degrees";
        /// Scale of the robust (Geman-McClure) loss of the refinement. Stitched panoramas bend their verticals by half
        /// a degree; with a smaller scale the loss settles on the lines of a few places and the halves agree less.
        refine_scale_deg: f64 = 1.0, between(0.01, 10.0), "degrees";
        /// Fewer vertical lines in either half are no measurement.
        min_lines: usize = 20, between(3.0, 1e6), "lines";
        /// Largest angle between the verticals of the two halves. They look at different parts of the scene, so that
        /// the vertical of all views errs by about half of it.
        max_halves_deg: f64 = 0.5, between(0.001, 90.0), "degrees";
        /// Largest standard error.
        max_standard_error_deg: f64 = 0.25, between(0.001, 90.0), "degrees";
    }
}
