//! Angles, rotations and homographies.

mod angle;
mod homography;
mod rotation;

pub use angle::{circular_mean, wrap_angle, wrap_length};
pub use homography::{Homography, Normalization};
pub use rotation::{
    cross_matrix, exp_rotation, is_rotation, log_rotation, matrix_from_rows, nearest_rotation, orthonormal_complement,
    random_rotation, roll_from_down, rotation_about_x, rotation_about_y, rotation_about_z, rows_of, tangent_basis,
};
