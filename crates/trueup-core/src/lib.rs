//! The types that flow between trueup's stages, and the geometry they share.
//!
//! # Conventions, written once
//!
//! * **Pixels.** x points right, y points down. The picture's top left corner is (0, 0) and the center of its first
//!   pixel is (0.5, 0.5). Lengths in pixels end in `_px`.
//! * **Working pixels.** Measurement happens on a reduced copy of each photograph. One real number per photograph,
//!   `working_from_full`, scales full-resolution coordinates to working coordinates; both axes share it exactly, and
//!   both have their corner at (0, 0). See [`source::WorkingFrame`].
//! * **Camera frame.** x right, y down, z forward. `camera_from_world` (the paper's R_i) maps world to camera.
//! * **World frame.** y points down; a levelled world has y along gravity.
//! * **Transforms** are named `target_from_source`, so that chains read correct or visibly wrong.
//! * **Angles** are radians; degrees appear only at the edges, in names ending in `_deg`. A positive picture rotation
//!   is clockwise on the screen.
//! * **Determinism.** The same input, options and seed give the same bytes for any number of threads.
#![forbid(unsafe_code)]

pub mod called;
pub mod camera;
pub mod carrier;
pub mod color;
pub mod context;
pub mod diagnostics;
pub mod error;
pub mod geometry;
pub mod inset;
pub mod interpolation;
mod invalid_option;
pub mod lens;
pub mod lines;
pub mod mask;
pub mod matches;
pub mod memory;
pub mod mesh;
pub mod options;
pub mod outline;
pub mod raster;
pub mod scratch;
pub mod side;
pub mod source;
pub mod spherical;
pub mod statistics;
pub mod stretches;
pub mod told_lens;
pub mod truth;

pub use context::StageContext;
pub use error::{Error, Result};
