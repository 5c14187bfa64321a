//! How natural, upright and well aligned a panorama is, in numbers: the paper's, and others.
//!
//! * Against the truth: [`mean_relative_turn`] (GDIC), [`Uprightness`], [`true_alignment`].
//! * From the grids alone: [`local_distortion`] (LD), [`folded_cells`].
//! * From grids, lines and matches, without truth: [`Straightness`], [`reprojection`]; [`drawn_lean`], for the
//!   verticals that [`crate::similarity::estimated_rolls`] finds in place of the true ones.
//! * From the pixels of two photographs where both lie on the panorama: [`OverlapPixels::measure`].

mod alignment;
mod direction;
mod distortion;
mod drawn_vertical;
mod options;
mod outline;
mod overlap;
mod overlap_pixels;
mod reprojection;
mod similarity_index;
mod straightness;
mod upright;
mod vertical_lines;

pub use alignment::true_alignment;
pub use direction::{best_rotation, mean_relative_turn, rectangle_rotation, relative_turns};
pub use distortion::{LocalDistortion, Outside, local_distortion};
pub use drawn_vertical::drawn_lean;
pub use options::PixelMeasureOptions;
pub use outline::{folded_cells, may_overlap, without_torn_cells};
pub use overlap::{OverlapMeasures, mean_over_overlaps};
pub use overlap_pixels::OverlapPixels;
pub use reprojection::{MatchedPair, Reprojection, match_distances, panorama_distances, reprojection};
pub use straightness::{BENT_SHARE, LINE_STEP_PX, LONG_LINE_DIAGONAL, Straightness};
pub use upright::{Uprightness, expected_magnitude};
pub use vertical_lines::{VerticalLinesInput, carrying_segments, directions_of_segments, vertical_segments};
