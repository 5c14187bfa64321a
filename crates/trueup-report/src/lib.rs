//! Why a panorama looks as it does, to be looked at.
//!
//! * [`drawings`]: what lies over a panorama or a photograph, as SVG: outlines, seams, lines by vanishing point,
//!   alignment error, overlaps. Made from a [`trueup::Project`] alone, but for the seams, so that other fronts can lay
//!   them over any picture of the panorama ([`drawings::Layer`] has them by name).
//! * [`charts`]: bars, lines and points on plain axes, as SVG.
//! * [`ReportJob`]: the page of a panorama with all of these, one file that needs no network.
//!
//! Figures are the project's; nothing is measured here.
#![forbid(unsafe_code)]

pub mod charts;
pub mod drawings;

mod job;
mod page;
mod pictures;
mod text;

pub use job::ReportJob;
pub use text::escape;
