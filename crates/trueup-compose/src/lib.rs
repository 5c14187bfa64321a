//! Geometry and pixels to the panorama: canvas, exposure, warp and blend.
//!
//! The stages, one module each:
//!
//! * [`layout`]: deformed grids in any common unit to one canvas in pixels;
//! * [`exposure`]: reduced photographs to gain, color cast and vignetting of each;
//! * [`render`]: full-resolution photographs, layout and corrections to a [`render::Panorama`], along the seams that
//!   [`seam`] finds;
//! * [`gaps`]: what no photograph covers, and what of that is small enough to be filled;
//! * [`fidelity`]: how true a panorama is to its photographs.
//!
//! Every photograph is resampled exactly once, from its own samples straight to the canvas.

pub mod crop;
pub mod exposure;
pub mod fidelity;
pub mod gaps;
pub mod layout;
pub mod render;
pub mod seam;

mod blend;
mod deformed_grid;
mod distance;
mod sampling;
#[allow(unsafe_code)] // Vector instructions chosen at run time; every other module is safe code.
mod simd;
mod transfer_curve;
mod unwanted;
mod weights;
