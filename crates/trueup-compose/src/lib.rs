//! Geometry and pixels to the panorama: canvas, exposure, small views, seams, blend.
//!
//! The stages, one module each, in their order:
//!
//! * [`layout`]: deformed grids in any common unit to one canvas in pixels;
//! * [`fusion`]: several exposures of one view to one photograph, ahead of all others;
//! * [`exposure`]: reduced photographs to gain, color cast and vignetting of each;
//! * [`small_views`]: every photograph read once and made small;
//! * [`seam`]: small views to the seams along which the photographs agree;
//! * [`render`]: the order of these and, along the seams, full-resolution photographs to a [`render::Panorama`];
//! * [`gaps`]: what no photograph covers, and what of that is filled;
//! * [`crop`]: what of the finished panorama is kept;
//! * [`fidelity`]: how true a panorama is to its photographs.
//!
//! A photograph's samples are resampled once, straight to the canvas; one that is drawn smaller is reduced before.

pub mod crop;
pub mod exposure;
pub mod fidelity;
pub mod fusion;
pub mod gaps;
pub mod layout;
pub mod render;
pub mod seam;
pub mod small_views;

mod blend;
mod bulk;
mod coverage;
mod deformed_grid;
mod distance;
mod flood;
mod handed_over;
mod ignored;
mod kernel;
mod label;
mod light;
mod linear_table;
mod look;
mod max_flow;
mod memory_plan;
mod pyramid;
mod render_options;
mod sampling;
#[allow(unsafe_code)] // Vector instructions chosen at run time; every other module is safe code.
mod simd;
mod store;
#[cfg(test)]
mod test_photographs;
mod transfer_curve;
mod unframed;
mod warped;
mod weights;
mod window;
