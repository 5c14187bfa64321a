//! Several methods on the same photographs, side by side: one run, one folder. Documented in docs/compare.md.

#![forbid(unsafe_code)]

mod compared;
mod drawing;
mod entry;
mod figures;
mod format;
mod job;
mod making;
mod overlaps;
mod place;
mod preference;
mod ranking;
mod record;
mod tally;

pub use compared::{Compared, PanoramaRecord, Refusal};
pub use drawing::{Drawing, PhotographGrid, Polyline};
pub use entry::ComparisonEntry;
pub use figures::{Better, ComparisonFigure};
pub use format::PanoramaFormat;
pub use job::{CompareJob, ComparisonPage};
pub use preference::{Preference, ShareInterval};
pub use ranking::{MAX_RANKED, RankedPanorama, Ranking};
pub use record::{COMPARISON_FORMAT, COMPARISON_VERSION, ComparedPhotograph, Comparison};
pub use tally::{
    MethodScore, RANKING_FORMAT, RANKING_VERSION, RankingAnswer, RankingResults, Tally, read_rankings, tally,
};
