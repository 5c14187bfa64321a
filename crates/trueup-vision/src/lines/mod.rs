//! Straight line segments: our own LSD (Line Segment Detector) with a sub-pixel refinement of their directions.
//!
//! The steps, a file each: `gradient` reduces the photograph and finds level-line directions, `region` grows connected
//! pixels of one direction, `rectangle` fits and improves rectangles, `significance` counts false alarms, `refine` fits
//! the segment again to sub-pixel edge points of the photograph itself, `tidy` drops frame artifacts, sorts and, for
//! those who ask, merges. `curves` follows the edges under the segments beyond their ends, bent as a lens may have made
//! them.
//!
//! # Source
//! R. Grompone von Gioi, J. Jakubowicz, J.-M. Morel, G. Randall, "LSD: A Fast Line Segment Detector with a False
//! Detection Control", TPAMI 32(4), 2010, and "LSD: a Line Segment Detector", Image Processing On Line 2, 2012.
//!
//! # Departures
//! * Directions are unit vectors and never angles: a pixel is aligned within `tau` if `|a x b| <= tan(tau) a . b`.
//!   The decisions are those of the papers; no arc tangent is taken but for the few regions that need a narrower
//!   tolerance.
//! * The rectangle keeps both of its sides apart from its axis, and the segment stays on the axis through the center
//!   of mass when one side is cut away; the papers move the axis to the middle of what remains.
//! * Tolerances of regrown regions never exceed the first one.
//! * The border of the photograph is mirrored at the edge of its outermost pixels.

use rayon::prelude::*;
use trueup_core::lines::{EdgeCurve, LineSegment};
use trueup_core::options::StageOptions;
use trueup_core::raster::Raster;
use trueup_core::{Error, Result, StageContext};

mod curves;
mod gradient;
mod rectangle;
mod refine;
mod region;
mod significance;
mod tidy;

#[cfg(test)]
mod tests;

use gradient::{GradientField, PICTURE_FROM_FIELD};
use rectangle::{LineSupportRectangle, improve};
use region::RegionGrower;
use significance::FalseAlarms;
pub use tidy::merged;

trueup_core::options! {
    /// How line segments are found.
    pub struct LineOptions("lines") {
        /// Segments shorter than this are dropped. Raise it where foliage, gravel or fabric gives so many short
        /// segments that the vertical or the horizon is not found.
        min_length_px: f64 = 0.0, between(0.0, 1e6), "working px";
    }
}

/// Smallest -log10 of the number of false alarms a segment may have: one false segment a photograph (IPOL, section
/// 2.7).
const MIN_SIGNIFICANCE: f64 = 0.0;

/// Segments shorter than this are not refined, in pixels: too few edge points.
const MIN_REFINED_LENGTH_PX: f64 = 12.0;

/// At most this many segments are returned, the longest.
const MAX_SEGMENTS: usize = 100_000;

/// Most pixels of a photograph: positions in the gradient field are 32-bit.
const MAX_PIXELS: usize = 1 << 31;

/// Seeds between two looks at the cancel token.
const SEEDS_PER_CHECK: usize = 8192;

/// The straight line segments of a photograph with one channel of gray levels 0 to 255, longest first.
///
/// Positions are in the picture's pixels, its corner at (0, 0): a step edge between columns c - 1 and c lies at x = c.
/// Segments are directed so that the brighter side is on their right on the screen (travelling up, brighter towards
/// larger x). Both sides of a bar give a segment each, of opposite directions. Segments along the photograph's frame,
/// artifacts of scans and of earlier warps, are left out.
///
/// Pixels that are not finite take no part. A picture too small for a gradient has no segments.
///
/// # Errors
/// [`Error::Options`] for options out of range; [`Error::Input`] if the picture has not exactly one channel;
/// [`Error::Limits`] above 2^31 pixels; [`Error::Cancelled`].
///
/// # Source
/// Algorithm 1 of the IPOL article; the steps after the rectangles are ours: those that fit segments again to sub-pixel
/// edge points of the unreduced picture make the directions of sharp edges about twice as accurate.
pub fn detect(picture: &Raster<f32>, options: &LineOptions, context: &StageContext) -> Result<Vec<LineSegment>> {
    let mut segments = refined_segments(picture, options, context)?;
    tidy::drop_frame(&mut segments, picture.width() as f64, picture.height() as f64);
    Ok(tidy::longest_first(segments, options.min_length_px, MAX_SEGMENTS))
}

/// The edges under `segments` of this picture, longest first, followed as far as they go on smoothly: straight lines of
/// the scene, as a lens may have bent them, and whatever else is long and smooth.
///
/// # Source
/// Edge points are those of the refinement of segments. That straight lines tell what a lens bends: D. C. Brown,
/// "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971. How they are followed is ours.
pub fn edge_curves(picture: &Raster<f32>, segments: &[LineSegment]) -> Vec<EdgeCurve> {
    curves::follow(picture, segments)
}

/// As [`detect`], but with the segments along the border: for a picture that was cut out of a larger one, whose border
/// is no frame.
///
/// # Errors
/// As [`detect`].
pub fn detect_keeping_frame(
    picture: &Raster<f32>,
    options: &LineOptions,
    context: &StageContext,
) -> Result<Vec<LineSegment>> {
    let segments = refined_segments(picture, options, context)?;
    Ok(tidy::longest_first(segments, options.min_length_px, MAX_SEGMENTS))
}

/// All segments, in the order of the seeds.
fn refined_segments(picture: &Raster<f32>, options: &LineOptions, context: &StageContext) -> Result<Vec<LineSegment>> {
    check(picture, options)?;
    context.check_cancelled()?;
    let field = GradientField::new(picture);
    context.check_cancelled()?;
    let mut segments = segments_of_field(&field, MIN_SIGNIFICANCE, context)?;
    let profiles = refine::EdgeProfiles::new(picture);
    segments
        .par_iter_mut()
        .filter(|segment| segment.length() >= MIN_REFINED_LENGTH_PX)
        .for_each(|segment| profiles.refine(segment));
    context.check_cancelled()?;
    Ok(segments)
}

fn check(picture: &Raster<f32>, options: &LineOptions) -> Result<()> {
    options.check()?;
    // An empty raster has no meaningful number of channels.
    if picture.channels() != 1 && !picture.data().is_empty() {
        return Err(Error::input(
            "picture for line detection",
            format!("{} channels", picture.channels()),
            "Give one channel of gray levels 0 to 255.",
        ));
    }
    if picture.data().len() > MAX_PIXELS {
        return Err(Error::Limits {
            subject: "line detection".to_owned(),
            needed: format!("{} pixels", picture.data().len()),
            allowed: format!("{MAX_PIXELS} pixels"),
            hint: "Reduce the picture first.".to_owned(),
        });
    }
    Ok(())
}

/// Regions, rectangles and their significance, in the order of the seeds.
fn segments_of_field(field: &GradientField, min_significance: f64, context: &StageContext) -> Result<Vec<LineSegment>> {
    let mut grower = RegionGrower::new(field);
    let false_alarms = FalseAlarms::new(field.width(), field.height(), grower.aligned_probability());
    let min_region = false_alarms.smallest_region(min_significance);
    let mut segments = Vec::new();
    for (count, &seed) in field.seeds().iter().enumerate() {
        if count % SEEDS_PER_CHECK == 0 {
            context.check_cancelled()?;
        }
        let Some(rectangle) = grower.rectangle_from(seed, min_region) else { continue };
        let (rectangle, significance) = improve(rectangle, field, &false_alarms, min_significance);
        if significance >= min_significance {
            segments.push(in_image(&rectangle, significance));
        }
    }
    Ok(segments)
}

/// The segment of a rectangle, from the field's nodes to the picture's pixels.
fn in_image(rectangle: &LineSupportRectangle, significance: f64) -> LineSegment {
    // Node (x, y) of the field is the corner shared by four reduced pixels, (x + 1, y + 1) in corner coordinates; the
    // padding of the field has added this one already.
    let [start, end] = rectangle.axis().map(|point| point.map(|coordinate| coordinate * PICTURE_FROM_FIELD));
    LineSegment { start, end, width_px: rectangle.width() * PICTURE_FROM_FIELD, significance }
}
