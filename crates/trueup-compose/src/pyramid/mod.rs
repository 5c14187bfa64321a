//! Levels of pyramids whose photographs do not cover every sample.
//!
//! Sample i of level l sits on pixel 2^l i of the canvas, whatever part of the canvas a plane holds: two planes that
//! both hold what a sample is made of give it the same bits.
//!
//! # Source
//! Burt, Adelson, "A multiresolution spline with application to image mosaics", ACM TOG 2(4), 1983; kernel 1 4 6 4 1.
//!
//! # Departures
//! But for the finest and the widest, bands are weighted by masks of the next coarser level: what differs between two
//! photographs goes over within the width of its own contours instead of half of it, and shows less of a step.
//!
//! Samples carry the share that is covered, colors are multiplied by it, and sums are divided by the sum of the shares
//! (normalized convolution: Knutsson, Westin, CVPR 1993), so that what lies beside a photograph never bleeds into it.

mod plane;
mod sums;
mod tiling;

pub(crate) use plane::{Expansion, LEAST_SHARE, NEXT_TO_NOTHING, PyramidPlane, Texel, color, level_shares};
pub(crate) use sums::{LEAST_WEIGHT, add_base, add_detail, collapse};
pub(crate) use tiling::{first_level, mask_margin, tile_margin, tile_side};
