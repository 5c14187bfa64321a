//! What the measures of a panorama take for granted.

trueup_core::options! {
    /// How a finished panorama is measured.
    pub struct MeasureOptions("measures") {
        /// A picture with fewer vertical lines says nothing certain of its direction.
        min_vertical_lines: usize = 6, between(2.0, 1e4), "segments";
        /// Nor does one whose vertical lines disagree so much that the standard error of their mean direction is larger.
        max_standard_error_deg: f64 = 0.5, between(0.01, 45.0), "degrees";
        /// How far from where the cameras expect it a picture's vertical may lie: the scale at which the search begins.
        vertical_search_deg: f64 = 8.0, between(0.5, 45.0), "degrees";
        /// How surely the vertical is expected there, where a picture's own lines leave it open.
        vertical_prior_deg: f64 = 10.0, between(0.5, 90.0), "degrees";
        /// Shortest line whose straightness is judged, as a fraction of the picture's diagonal.
        long_line_diagonal: f64 = 0.1, between(0.01, 1.0), "diagonals";
        /// Distance of the points of a line that are carried to the panorama.
        line_step_px: f64 = 3.0, between(0.5, 100.0), "working px";
        /// A line that strays from straight by more than this share of its length is bent.
        bent_share: f64 = 0.003, between(1e-5, 1.0), "";
        /// Size of the canvas that pixels are compared on; panoramas that are smaller are not enlarged.
        canvas_pixels: f64 = 1.5e6, between(1e4, 1e9), "px";
    }
}
