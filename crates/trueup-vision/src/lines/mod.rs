//! Straight line segments: our own LSD (Line Segment Detector) with a sub-pixel refinement of their directions.
//!
//! The steps, a file each: `gradient` reduces the picture and finds level-line directions, `region` grows connected
//! pixels of one direction, `rectangle` fits and improves rectangles, `significance` counts false alarms,
//! `refine` fits the segment again to sub-pixel edge points of the picture itself, `tidy` drops frame artifacts,
//! merges and sorts.
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
//! * The border of the picture is mirrored at the edge of its outermost pixels.

use rayon::prelude::*;
use trueup_core::lines::LineSegment;
use trueup_core::options::StageOptions;
use trueup_core::raster::Raster;
use trueup_core::{Error, Result, StageContext};

mod gradient;
mod rectangle;
mod refine;
mod region;
mod significance;
mod tidy;

#[cfg(test)]
mod tests;

use gradient::GradientField;
use rectangle::{Rectangle, improve};
use region::RegionGrower;
use significance::FalseAlarms;
pub use tidy::merged;

trueup_core::options! {
    /// How line segments are found. The defaults up to `magnitude_bins` are those of the papers.
    pub struct LineOptions("lines") {
        /// Reduction of the picture before its gradient is taken, which removes aliasing and the staircase of pixels.
        /// 1 takes the picture as it is.
        scale: f64 = 0.8, between(0.1, 1.0), "";
        /// Standard deviation of the Gaussian that goes with the reduction, in pixels of the reduced picture.
        sigma_scale: f64 = 0.6, between(0.1, 4.0), "reduced px";
        /// Bound on the error of a gray level by quantization. Pixels whose gradient could turn by more than
        /// `angle_tolerance_deg` under this error take no part.
        quantization: f64 = 2.0, between(0.0, 64.0), "gray levels of 0 to 255";
        /// How far the level line of a pixel may turn from the direction of its region.
        angle_tolerance_deg: f64 = 22.5, between(1.0, 60.0), "deg";
        /// Smallest -log10 of the number of false alarms a segment may have; 0 admits one false segment a picture.
        min_significance: f64 = 0.0, between(-10.0, 1000.0), "";
        /// Smallest share of a rectangle's area that its region must fill; sparser regions bend and are cut.
        min_density: f64 = 0.7, between(0.0, 1.0), "";
        /// Number of classes of gradient magnitude by which seeds are ordered.
        magnitude_bins: usize = 1024, between(1.0, 65536.0), "";
        /// Segments shorter than this are dropped.
        min_length_px: f64 = 0.0, between(0.0, 1e6), "px";
        /// Whether segments are fitted again to sub-pixel edge points of the unreduced picture, which makes
        /// the directions of sharp edges about twice as accurate.
        refine: bool = true, Allowed::Any, "";
        /// Segments shorter than this are not refined: too few edge points.
        refine_min_length_px: f64 = 12.0, between(4.0, 1e6), "px";
        /// Segments along the picture's frame are artifacts of scans and of earlier warps: dropped if more than
        /// `border_share` of their length lies within this distance of one border. 0 keeps them all.
        border_distance_px: f64 = 5.0, between(0.0, 1000.0), "px";
        /// See `border_distance_px`.
        border_share: f64 = 0.8, between(0.0, 1.0), "";
        /// Whether neighbors on one line are joined.
        merge: bool = false, Allowed::Any, "";
        /// Largest angle between segments that are joined.
        merge_angle_deg: f64 = 2.0, between(0.0, 45.0), "deg";
        /// Largest distance of the other's ends from the longer segment's line.
        merge_distance_px: f64 = 2.0, between(0.0, 100.0), "px";
        /// Largest gap along the line.
        merge_gap_px: f64 = 20.0, between(0.0, 1e5), "px";
        /// At most this many segments are returned, the longest.
        max_segments: usize = 100_000, between(1.0, 1e9), "";
    }
}

/// Most pixels of a picture: positions in the gradient field are 32-bit.
const MAX_PIXELS: usize = 1 << 31;

/// Seeds between two looks at the cancel token.
const SEEDS_PER_CHECK: usize = 8192;

/// The straight line segments of a picture with one channel of gray levels 0 to 255, longest first.
///
/// Positions are in the picture's pixels, its corner at (0, 0): a step edge between columns c - 1 and c lies at x = c.
/// Segments are directed so that the brighter side is on their right on the screen (travelling up, brighter towards
/// larger x). Both sides of a bar give a segment each, of opposite directions.
///
/// Pixels that are not finite take no part. A picture too small for a gradient has no segments.
///
/// # Errors
/// [`Error::Options`] for options out of range; [`Error::Input`] if the picture has not exactly one channel;
/// [`Error::Limits`] above 2^31 pixels; [`Error::Cancelled`].
///
/// # Source
/// Algorithm 1 of the IPOL article; the steps after the rectangles are ours (see [`LineOptions`]).
pub fn detect(image: &Raster<f32>, options: &LineOptions, context: &StageContext) -> Result<Vec<LineSegment>> {
    check(image, options)?;
    context.check_cancelled()?;
    let field = GradientField::new(image, options);
    context.check_cancelled()?;
    let mut segments = segments_of_field(&field, options, context)?;
    if options.refine {
        let profiles = refine::EdgeProfiles::new(image);
        segments
            .par_iter_mut()
            .filter(|segment| segment.length() >= options.refine_min_length_px)
            .for_each(|segment| profiles.refine(segment));
    }
    context.check_cancelled()?;
    Ok(tidy::tidy(segments, image.width() as f64, image.height() as f64, options))
}

fn check(image: &Raster<f32>, options: &LineOptions) -> Result<()> {
    options.check()?;
    // An empty raster has no meaningful number of channels.
    if image.channels() != 1 && !image.data().is_empty() {
        return Err(Error::input(
            "picture for line detection",
            format!("{} channels", image.channels()),
            "Give one channel of gray levels 0 to 255.",
        ));
    }
    if image.data().len() > MAX_PIXELS {
        return Err(Error::Limits {
            subject: "line detection".to_owned(),
            needed: format!("{} pixels", image.data().len()),
            allowed: format!("{MAX_PIXELS} pixels"),
            hint: "Reduce the picture first.".to_owned(),
        });
    }
    Ok(())
}

/// Regions, rectangles and their significance, in the order of the seeds.
fn segments_of_field(field: &GradientField, options: &LineOptions, context: &StageContext) -> Result<Vec<LineSegment>> {
    let false_alarms = FalseAlarms::new(field.width(), field.height());
    let mut grower = RegionGrower::new(field, options);
    let min_region = false_alarms.smallest_region(grower.aligned_probability(), options.min_significance);
    let mut segments = Vec::new();
    for (count, &seed) in field.seeds(options.magnitude_bins).iter().enumerate() {
        if count % SEEDS_PER_CHECK == 0 {
            context.check_cancelled()?;
        }
        let Some(rectangle) = grower.rectangle_from(seed, min_region) else { continue };
        let (rectangle, significance) = improve(rectangle, field, &false_alarms, options.min_significance);
        if significance >= options.min_significance {
            segments.push(to_picture(&rectangle, significance, field.picture_from_field()));
        }
    }
    Ok(segments)
}

/// The segment of a rectangle, from the field's nodes to the picture's pixels.
fn to_picture(rectangle: &Rectangle, significance: f64, picture_from_field: f64) -> LineSegment {
    // Node (x, y) of the field is the corner shared by four reduced pixels, (x + 1, y + 1) in corner coordinates; the
    // padding of the field has added this one already.
    let [start, end] = rectangle.axis().map(|point| point.map(|coordinate| coordinate * picture_from_field));
    LineSegment { start, end, width_px: rectangle.width() * picture_from_field, significance }
}
