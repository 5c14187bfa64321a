//! Segments behind lenses that bend: found again in pictures without their bend.
//!
//! A straight edge is a curve behind such a lens. What a detector of straight segments finds of it is cut short, and
//! points aside where the curve shows more clearly on one side. Once the lens is known, the working picture is drawn as
//! a pinhole would have seen it, and the segments of that one stand for the photograph's; their ends lie where the
//! photograph has them.

use std::borrow::Cow;

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_core::camera::Camera;
use trueup_core::interpolation::cubic_convolution_taps;
use trueup_core::lens::Lens;
use trueup_core::lines::LineSegment;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_vision::lines::{self, LineOptions};

use super::component::Component;
use crate::pipeline::measure::THUMBNAIL_PIXELS;
use crate::pipeline::outside::lines_outside;

/// Largest tangent of the angle from the axis that is drawn, along each side: 56 degrees. What lies farther out is
/// drawn so large that its edges are soft.
const FARTHEST: f64 = 1.5;
/// Pixels between two places of which the lens is asked where it shows them; straight between them. Where a lens moves
/// the corners of a photograph of 1000 pixels by 20 %, that is off by less than a hundredth of a pixel.
const NODE_STEP: usize = 4;
/// Points along each side of a photograph by which its extent is found.
const BORDER_POINTS: usize = 33;

/// The segments of all photographs, in working pixels; those measured where no lens bends anything.
///
/// # Errors
/// Those of decoding; [`trueup_core::Error::Cancelled`].
pub(super) fn lines<'a>(
    component: &'a Component,
    cameras: &[Camera],
    photographs: &FilePhotographs,
    context: &StageContext,
) -> Result<Cow<'a, [Vec<LineSegment>]>> {
    if cameras.iter().all(|camera| camera.lens.is_pinhole()) {
        return Ok(component.lines.as_slice().into());
    }
    let found: Result<Vec<Vec<LineSegment>>> = (0..cameras.len())
        .into_par_iter()
        .map(|k| {
            context.check_cancelled()?;
            if cameras[k].lens.is_pinhole() {
                return Ok(component.lines[k].clone());
            }
            let (member, frame) = (component.members[k], &component.frames[k]);
            let gray = photographs.working(member, frame, THUMBNAIL_PIXELS)?.gray;
            let found = of_photograph(&gray, &cameras[k], context)?;
            // What was too short to be kept of the photograph is too short now.
            let shortest = component.lines[k].iter().map(LineSegment::length).fold(f64::INFINITY, f64::min);
            let long = found.into_iter().filter(|line| line.length() >= shortest).collect();
            Ok(match photographs.not_looked_at(member) {
                Some(ignored) => lines_outside(long, &ignored, frame),
                None => long,
            })
        })
        .collect();
    Ok(found?.into())
}

/// The segments that a pinhole in the camera's place would show, in the photograph's pixels.
fn of_photograph(gray: &Raster<f32>, camera: &Camera, context: &StageContext) -> Result<Vec<LineSegment>> {
    let pinhole = pinhole_view(camera, gray.width() as f64, gray.height() as f64);
    let [width, height] = pinhole.principal_point.map(|middle| 2.0 * middle);
    // The casts are of whole numbers of at most a few thousand.
    let straight = drawn(gray, camera, &pinhole, [width as usize, height as usize]);
    let found = lines::detect_keeping_frame(&straight, &LineOptions::default(), context)?;
    let back = |end: [f64; 2]| camera.project(pinhole.bearing(end.into())).map(<[f64; 2]>::from);
    let in_photograph =
        |line: &LineSegment| Some(LineSegment { start: back(line.start)?, end: back(line.end)?, ..*line });
    Ok(found.iter().filter_map(in_photograph).collect())
}

/// What a pinhole in the camera's place would show, `size` pixels across and down; not a number where that is beyond
/// the photograph.
fn drawn(gray: &Raster<f32>, camera: &Camera, pinhole: &Camera, [width, height]: [usize; 2]) -> Raster<f32> {
    let nodes = |length: usize| length.div_ceil(NODE_STEP) + 1;
    let places: Vec<Vec<Vector2<f64>>> = (0..nodes(height))
        .into_par_iter()
        .map(|row| {
            let place = |column: usize| {
                let pixel = Vector2::new((column * NODE_STEP) as f64 + 0.5, (row * NODE_STEP) as f64 + 0.5);
                camera.project(pinhole.bearing(pixel)).unwrap_or(Vector2::repeat(f64::NAN))
            };
            (0..nodes(width)).map(place).collect()
        })
        .collect();
    let mut straight = Raster::new(width, height, 1);
    straight.data_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        let down = (y % NODE_STEP) as f64 / NODE_STEP as f64;
        let between: Vec<Vector2<f64>> = places[y / NODE_STEP]
            .iter()
            .zip(&places[y / NODE_STEP + 1])
            .map(|(one, next)| one.lerp(next, down))
            .collect();
        for (x, value) in row.iter_mut().enumerate() {
            let across = (x % NODE_STEP) as f64 / NODE_STEP as f64;
            *value = sample(gray, between[x / NODE_STEP].lerp(&between[x / NODE_STEP + 1], across));
        }
    });
    straight
}

/// A pinhole of the same focal length that looks the same way, its picture large enough for what is drawn.
fn pinhole_view(camera: &Camera, width: f64, height: f64) -> Camera {
    let border = (0..BORDER_POINTS).flat_map(|step| {
        let share = step as f64 / (BORDER_POINTS - 1) as f64;
        let (x, y) = (share * width, share * height);
        [[x, 0.0], [x, height], [0.0, y], [width, y]].map(|pixel| camera.bearing(pixel.into()))
    });
    let reach = |component: f64, depth: f64| {
        if component.abs() < FARTHEST * depth { component.abs() / depth } else { FARTHEST }
    };
    let [across, along] = border
        .fold([0.0_f64; 2], |[across, along], ray| [across.max(reach(ray.x, ray.z)), along.max(reach(ray.y, ray.z))]);
    let size = [across, along].map(|reach| 2.0 * (reach * camera.focal_px).ceil().max(1.0));
    Camera { lens: Lens::PINHOLE, principal_point: size.map(|side| side / 2.0), ..*camera }
}

/// The gray value at a place, by cubic convolution; not a number outside.
fn sample(gray: &Raster<f32>, place: Vector2<f64>) -> f32 {
    let frame = WorkingFrame { width: gray.width() as f64, height: gray.height() as f64, working_from_full: 1.0 };
    if !frame.contains(place.x, place.y) {
        return f32::NAN;
    }
    let (x, y) = (place.x - 0.5, place.y - 0.5);
    // At least -1/2: one higher, the whole part is the next lower number. The casts are of numbers within the picture,
    // and beyond it by two at most.
    let below = |position: f64| (position + 1.0) as i64 - 1;
    let (column, line) = (below(x), below(y));
    let (taps_x, taps_y) =
        (cubic_convolution_taps((x - column as f64) as f32), cubic_convolution_taps((y - line as f64) as f32));
    let weighed = |row: usize, samples: [f32; 4]| {
        let across: f32 = taps_x.iter().zip(samples).map(|(tap, sample)| tap * sample).sum();
        taps_y[row] * across
    };
    let all_inside = |first: i64, size: usize| usize::try_from(first - 1).ok().filter(|first| first + 4 <= size);
    if let (Some(left), Some(top)) = (all_inside(column, gray.width()), all_inside(line, gray.height())) {
        let rows = gray.data()[top * gray.width() + left..].chunks(gray.width()).take(4);
        return rows
            .enumerate()
            .map(|(row, samples)| weighed(row, [samples[0], samples[1], samples[2], samples[3]]))
            .sum();
    }
    let clamped = |first: i64, tap: usize, size: usize| (first + tap as i64 - 1).clamp(0, size as i64 - 1) as usize;
    let at = |row: usize, tap: usize| gray.row(clamped(line, row, gray.height()))[clamped(column, tap, gray.width())];
    (0..4).map(|row| weighed(row, [0, 1, 2, 3].map(|tap| at(row, tap)))).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::lens::{LensProjection, LensTerms};

    use super::*;

    /// A bright half plane behind a barrel lens: its edge is a curve in the photograph, and one straight segment again,
    /// whose ends and middle span the plane of the edge to a tenth of a pixel.
    #[test]
    fn a_bent_edge_is_one_straight_segment() {
        let lens = Lens::new(LensTerms {
            projection: LensProjection::Rectilinear,
            radial: [-0.2, 0.03, 0.0, 0.0],
            tangential: [0.0; 2],
        });
        let camera = Camera { lens, ..Camera::new(250.0, 400.0, 300.0, &Matrix3::identity()) };
        // The edge x = 0.45 + 0.1 y at depth 1; its normal is (1, -0.1, -0.45).
        let normal = nalgebra::Vector3::new(1.0, -0.1, -0.45).normalize();
        let mut gray = Raster::new(400, 300, 1);
        for y in 0..300 {
            for x in 0..400 {
                let ray = camera.bearing(Vector2::new(x as f64 + 0.5, y as f64 + 0.5)).normalize();
                let distance_px = normal.dot(&ray) * 250.0;
                gray.pixel_mut(x, y)[0] = (100.0 + 80.0 * (distance_px / 0.8).tanh()) as f32;
            }
        }
        let found = of_photograph(&gray, &camera, &StageContext::default()).expect("not cancelled");
        let longest = found.first().expect("an edge");
        assert!(longest.length() > 230.0, "{longest:?}");
        for end in [longest.start, longest.end] {
            let off_px = normal.dot(&camera.bearing(end.into()).normalize()) * 250.0;
            assert!(off_px.abs() < 0.1, "{off_px}");
        }
        // In the photograph the edge strays from its chord.
        let middle = Vector2::from(longest.start).lerp(&longest.end.into(), 0.5);
        let bend_px = normal.dot(&camera.bearing(middle).normalize()) * 250.0;
        assert!(bend_px.abs() > 2.0, "{bend_px}");
    }
}
