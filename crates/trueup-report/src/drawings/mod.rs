//! Drawings to be laid over a panorama or a photograph: SVG documents whose `viewBox` is the panorama's canvas, or the
//! photograph, in pixels. Scaled to the size of the picture below, everything lies in its place.
//!
//! All are functions of a [`trueup::Project`] whose grids are those of the canvas: as a stitch recorded it, or as
//! [`trueup::Alignment::project`] has it for a canvas of another size. What is written in them is escaped.

mod alignment;
mod layer;
mod lines;
mod matches;
mod outlines;
mod palette;
mod seams;
mod svg;

pub use alignment::{alignment_error, alignment_legend};
pub use layer::{Layer, LegendEntry, seams_size};
pub use lines::{LineDirection, lines_of_panorama, lines_of_photograph};
pub use matches::overlaps;
pub use outlines::outlines;
pub use palette::photograph_color;
pub use seams::seams;
