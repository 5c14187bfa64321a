//! Views of known pose out of a panorama of 360 x 180 degrees.
//!
//! [`Panorama360`] holds the panorama, a [`CutSpec`] says which views to take, [`cut_set`] writes them with their
//! truth. [`measure_level`] finds where the scene's vertical points in the panorama, which defines the world;
//! [`make_spec`] makes specs of the usual kinds.
//!
//! # Conventions
//! * The panorama is equirectangular. Its frame has x right, y down, z forward; z points to the middle of the picture,
//!   so that the column `x` (continuous, corner 0) shows longitude `2 pi (x / width - 1/2)`, growing towards x, and the
//!   row `y` shows latitude `pi (y / height - 1/2)`, growing downwards.
//! * The angles of a view turn a camera in the *panorama's* frame ([`camera_from_world`](crate::camera_from_world)): to
//!   the right by its yaw, then up by its pitch, then clockwise by its roll.
//! * The *world* is the panorama's frame turned by the shortest way that takes the scene's vertical to y. Rotations and
//!   vertical angles in the truth refer to the world.

mod kinds;
mod level;
mod panorama;
mod set;
mod spec;
#[cfg(test)]
mod tests;
mod view;

pub use kinds::{SpecKind, SpecOptions, make_spec};
pub use level::{LevelOptions, measure_level};
pub(crate) use panorama::to_rgb8;
pub use panorama::{Panorama360, find_panoramas};
pub use set::cut_set;
pub use spec::{CutSpec, ViewSpec, world_from_panorama};
