//! How natural a deformed panorama is, in the paper's numbers.

mod direction;
mod distortion;

pub use direction::{best_rotation, global_direction_inconsistency, rectangle_rotation, vertical_angle};
pub use distortion::{LocalDistortion, local_distortion};
