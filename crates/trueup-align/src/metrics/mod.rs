//! How natural, upright and well aligned a panorama is, in numbers: the paper's, and others.
//!
//! Against the truth: [`global_direction_inconsistency`] (GDIC), [`Uprightness`], [`true_alignment`]. From the grids alone:
//! [`local_distortion`] (LD), [`folded_cells`].

mod alignment;
mod direction;
mod distortion;
mod outline;
mod upright;

pub use alignment::true_alignment;
pub use direction::{
    best_rotation, global_direction_inconsistency, mean_relative_turn, rectangle_rotation, relative_turns,
    vertical_angle,
};
pub use distortion::{LocalDistortion, Outside, local_distortion};
pub use outline::folded_cells;
pub use upright::{Uprightness, centre_rotation};
