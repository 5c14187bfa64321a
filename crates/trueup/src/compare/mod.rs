//! Several methods on the same photographs, side by side: one run, one folder. Documented in docs/compare.md.

mod drawing;
mod entry;
mod figures;
mod job;
mod making;
mod overlaps;
mod place;
mod ranking;
mod record;
mod tally;

pub use drawing::{Drawing, PhotographGrid, Polyline};
pub use entry::Entry;
pub use figures::{Better, Figure};
pub use job::{CompareJob, Page};
pub use ranking::{MAX_RANKED, RankedPanorama, Ranking};
pub use record::{
    COMPARISON_FORMAT, COMPARISON_VERSION, Compared, ComparedPhotograph, Comparison, PanoramaRecord, Refusal,
};
pub use tally::{
    MethodScore, RANKING_FORMAT, RANKING_VERSION, RankingAnswer, RankingResults, Tally, read_rankings, tally,
};

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

trueup_core::options! {
    /// How methods are compared side by side.
    pub struct CompareOptions("compare") {
        /// Size of the panoramas relative to the reference photograph's own pixels, in place of `canvas.scale`; 0 chooses
        /// one size for all by `compare.page_pixels`.
        scale: f64 = 0.0, between(0.0, 16.0), "";
        /// The photographs are reduced so that they have about this many pixels together. Their overlaps make the
        /// panorama smaller than that.
        page_pixels: f64 = 6e6, between(1e4, 1e9), "px";
        /// Largest panorama: a method that stretches the borders without end is reduced to it, and says so.
        max_pixels: f64 = 24e6, between(1e4, 1e12), "px";
        /// The panoramas' format.
        format: PanoramaFormat = PanoramaFormat::Jpeg, Allowed::Any, "";
        /// Line segments to draw over each photograph, the longest first.
        drawn_lines: usize = 150, between(0.0, 10000.0), "";
        /// Grid lines to draw over each photograph in either direction, its borders among them.
        drawn_grid_lines: usize = 13, between(2.0, 1000.0), "";
    }
}
