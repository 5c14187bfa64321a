//! How natural, upright and well aligned a panorama is, in numbers: the paper's, and others.
//!
//! * Against the truth: [`global_direction_inconsistency`] (GDIC), [`Uprightness`], [`true_alignment`].
//! * From the grids alone: [`local_distortion`] (LD), [`folded_cells`].
//! * From grids, lines and matches, without truth: [`vertical_lines`], [`Straightness`], [`reprojection`].
//! * From the pixels of two pictures where both lie on the panorama: [`Overlap::measure`].

mod alignment;
mod direction;
mod distortion;
mod options;
mod outline;
mod overlap;
mod reprojection;
mod similarity_index;
mod straightness;
mod upright;
mod vertical_lines;

pub use alignment::true_alignment;
pub use direction::{
    best_rotation, global_direction_inconsistency, mean_relative_turn, rectangle_rotation, relative_turns,
    vertical_angle,
};
pub use distortion::{LocalDistortion, Outside, local_distortion};
pub use options::MeasureOptions;
pub use outline::folded_cells;
pub use overlap::{Overlap, OverlapMeasures, mean_over_overlaps};
pub use reprojection::{MatchedPair, Reprojection, reprojection};
pub use straightness::Straightness;
pub use upright::{Uprightness, center_rotation};
pub use vertical_lines::{LinedPicture, VerticalLines, vertical_lines, vertical_segments};
