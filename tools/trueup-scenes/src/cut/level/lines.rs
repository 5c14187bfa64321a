//! The planes of a panorama's roughly upright lines.

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::lines::LineSegment;
use trueup_core::raster::Photograph;
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};
use trueup_io::decode::reduce_photograph;
use trueup_vision::lines::{LineOptions, detect_keeping_frame};

use crate::cut::panorama::Panorama360;
use crate::cut::view::{PinholeView, to_bytes};
use crate::rig::{camera_from_world, focal_px};

use super::options::LevelOptions;

/// The name of the work in progress reports.
const STAGE: &str = "measuring the level";

/// A line that may be vertical.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UprightLine {
    /// Unit normal of the plane of line and center, in the panorama's frame.
    pub normal: Vector3<f64>,
    /// Weight: the line's length, capped.
    pub weight: f64,
    /// The column of views it was found in: columns alternate between the halves, and lines of a column share the
    /// errors of the panorama's stitching.
    pub column: usize,
}

/// Lines whose planes come within reach of the panorama's own down, view after view.
///
/// Views overlap, so that no line is cut where two views meet, but every place counts once, in the view it is closest
/// to the middle of: the halves look at different parts of the scene.
pub(super) fn upright_lines(
    panorama: &Panorama360,
    options: &LevelOptions,
    context: &StageContext,
) -> Result<Vec<UprightLine>> {
    let views = views(panorama, options);
    context.progress().begin(STAGE, views.len() as u64);
    let found: Vec<Result<Vec<UprightLine>>> = (0..views.len())
        .into_par_iter()
        .map(|index| {
            let lines = lines_of_view(panorama, &views, index, options, context);
            context.progress().advance(STAGE, 1);
            lines
        })
        .collect();
    context.progress().finish(STAGE);
    Ok(found.into_iter().collect::<Result<Vec<_>>>()?.concat())
}

/// Views all around, row after row, at the panorama's resolution where the options allow it.
fn views(panorama: &Panorama360, options: &LevelOptions) -> Vec<PinholeView> {
    const FULL_TURN_DEG: f64 = 360.0;
    let panorama_side = 2.0 * panorama.pixels_per_radian() * (options.view_deg.to_radians() / 2.0).tan();
    let side = (panorama_side.round() as usize).clamp(1, options.max_view_px);
    let focal_px = focal_px(side, options.view_deg);
    let middle = (options.rows as f64 - 1.0) / 2.0;
    let angles = (0..options.rows * options.views_around).map(|index| {
        let (row, column) = (index / options.views_around, index % options.views_around);
        (
            FULL_TURN_DEG * column as f64 / options.views_around as f64,
            (options.row_step_deg * (row as f64 - middle)).clamp(-90.0, 90.0),
        )
    });
    angles.map(|(yaw, pitch)| PinholeView::new(side, side, focal_px, &camera_from_world(yaw, pitch, 0.0))).collect()
}

fn lines_of_view(
    panorama: &Panorama360,
    views: &[PinholeView],
    index: usize,
    options: &LevelOptions,
    context: &StageContext,
) -> Result<Vec<UprightLine>> {
    let view = &views[index];
    let picture = Photograph::Eight(view.take(panorama, 1, |_| to_bytes, context)?);
    let frame = WorkingFrame::new(view.width, view.height, f64::INFINITY);
    // The smallest thumbnail: it is not used.
    let gray = reduce_photograph(&picture, panorama.name(), &frame, 1.0)?.gray;
    // The view's border is no frame of a photograph.
    let segments = detect_keeping_frame(&gray, &LineOptions::default(), context)?;
    let lines = segments.iter().filter_map(|segment| {
        let (normal, length) = plane_of(segment, views, index)?;
        let steepest = normal.y.abs().min(1.0).asin();
        let used = length >= options.min_length_deg.to_radians()
            && steepest <= (options.search_deg + options.tolerance_deg).to_radians();
        let weight = length.min(options.weight_cap_deg.to_radians());
        used.then_some(UprightLine { normal, weight, column: index % options.views_around })
    });
    Ok(lines.collect())
}

/// The unit normal of a segment's plane in the panorama's frame and the segment's length in radians; `None` where
/// another view sees its middle closer to its own.
fn plane_of(segment: &LineSegment, views: &[PinholeView], index: usize) -> Option<(Vector3<f64>, f64)> {
    let camera = &views[index].camera;
    let (start, end) =
        (camera.world_direction(Vector2::from(segment.start)), camera.world_direction(Vector2::from(segment.end)));
    let middle = start + end;
    let closeness = |view: &PinholeView| (view.camera.rotation() * middle).z;
    let here = closeness(&views[index]);
    // Of views at the same distance the first keeps the line.
    let elsewhere = |(other, view): (usize, &PinholeView)| {
        let there = closeness(view);
        there > here || (there == here && other < index)
    };
    if views.iter().enumerate().any(elsewhere) {
        return None;
    }
    let cross = start.cross(&end);
    Some((cross.try_normalize(0.0)?, cross.norm().atan2(start.dot(&end))))
}
