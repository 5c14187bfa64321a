//! The interpretation planes of a photograph's segments.

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::camera::Camera;
use trueup_core::lines::LineSegment;
use trueup_core::source::WorkingFrame;

/// Shortest segment used, working pixels ...
const MIN_LENGTH_PX: f64 = 20.0;
/// ... and as a fraction of the photograph's diagonal; the larger of both holds.
const MIN_LENGTH_DIAGONAL: f64 = 0.025;
/// Most segments used of a photograph, unless fewer are asked for; the longest are kept.
const MAX_SEGMENTS: usize = 400;
/// A segment this close to the photograph's border, and parallel to it, is an artifact of the frame. Working pixels.
const BORDER_MARGIN_PX: f64 = 5.0;
/// Length in working pixels at which a segment's weight, which is its length, stops growing.
pub(crate) const FULL_WEIGHT_LENGTH_PX: f64 = 120.0;

/// Usable segments of one photograph, longest first, as planes through the camera's center.
#[derive(Debug, Clone)]
pub(crate) struct InterpretationPlanes {
    /// Unit normals in the camera frame.
    pub normals: Vec<Vector3<f64>>,
    /// P x Q of the segment's ends P, Q = (x, y, f), x and y from the principal point: the normal's direction, of
    /// magnitude area. Behind a lens that bends, the normal times the length.
    pub moments: Vec<Vector3<f64>>,
    /// Midpoints from the principal point, in working pixels.
    pub midpoints: Vec<Vector2<f64>>,
    /// Unit rays of the midpoints, in the segments' planes; `None` for a pinhole, whose midpoints tell them.
    middle_rays: Option<Vec<Vector3<f64>>>,
    /// Lengths in working pixels.
    pub lengths: Vec<f64>,
    /// Weights: the length, capped.
    pub weights: Vec<f64>,
    /// Index of each among the segments given.
    pub indices: Vec<usize>,
    /// Sum of `weights`.
    pub total_weight: f64,
    /// Focal length of the camera whose frame this is, working pixels.
    pub focal_px: f64,
}

impl InterpretationPlanes {
    /// Keeps the segments that are finite, long enough and no artifact of the photograph's border, the longest first.
    /// `camera` is that of the frame.
    ///
    /// Empty if the focal length or the frame is not a positive number.
    pub(crate) fn new(lines: &[LineSegment], camera: &Camera, frame: &WorkingFrame) -> Self {
        Self::longest(lines, camera, frame, MAX_SEGMENTS)
    }

    /// [`Self::new`] of at most so many segments.
    fn longest(lines: &[LineSegment], camera: &Camera, frame: &WorkingFrame, most: usize) -> Self {
        let focal_px = camera.focal_px;
        let usable = focal_px.is_finite() && focal_px > 0.0 && frame.diagonal().is_finite();
        let min_length = MIN_LENGTH_PX.max(MIN_LENGTH_DIAGONAL * frame.diagonal());
        let mut kept: Vec<(usize, f64)> = lines
            .iter()
            .enumerate()
            .map(|(index, line)| (index, line.length()))
            // A comparison with NaN is false: segments that are not finite are dropped here too.
            .filter(|&(index, length)| {
                usable && length >= min_length && length.is_finite() && !on_border(&lines[index], frame)
            })
            .collect();
        // Ties are broken by the position in the input, so that the order is the same everywhere.
        kept.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        kept.truncate(most);
        let mut planes = Self::with_capacity(kept.len(), camera);
        for (index, _) in kept {
            planes.push(index, &lines[index], camera);
        }
        planes
    }

    /// Those of every photograph: [`Self::new`] of its lines, its camera and its frame.
    pub(crate) fn of_all(lines: &[Vec<LineSegment>], cameras: &[Camera], frames: &[WorkingFrame]) -> Vec<Self> {
        Self::longest_of_all(lines, cameras, frames, MAX_SEGMENTS)
    }

    /// [`Self::of_all`] with at most so many segments of each photograph.
    pub(crate) fn longest_of_all(
        lines: &[Vec<LineSegment>],
        cameras: &[Camera],
        frames: &[WorkingFrame],
        most: usize,
    ) -> Vec<Self> {
        let of_one = |index: usize| Self::longest(&lines[index], &cameras[index], &frames[index], most);
        (0..cameras.len()).into_par_iter().map(of_one).collect()
    }

    fn with_capacity(count: usize, camera: &Camera) -> Self {
        Self {
            normals: Vec::with_capacity(count),
            moments: Vec::with_capacity(count),
            midpoints: Vec::with_capacity(count),
            middle_rays: (!camera.lens.is_pinhole()).then(Vec::new),
            lengths: Vec::with_capacity(count),
            weights: Vec::with_capacity(count),
            indices: Vec::with_capacity(count),
            total_weight: 0.0,
            focal_px: camera.focal_px,
        }
    }

    fn push(&mut self, index: usize, line: &LineSegment, camera: &Camera) {
        let center = Vector2::from(camera.principal_point);
        let (start, end) = (Vector2::from(line.start) - center, Vector2::from(line.end) - center);
        let length = line.length();
        let mut moment = match self.middle_rays {
            None => start.push(camera.focal_px).cross(&end.push(camera.focal_px)),
            Some(_) => camera.bearing(line.start.into()).cross(&camera.bearing(line.end.into())),
        };
        let norm = moment.norm();
        if !(norm > 0.0 && norm.is_finite()) {
            return;
        }
        self.normals.push(moment / norm);
        if let Some(rays) = &mut self.middle_rays {
            // The middle of a bent line is beside its chord, and only what it is along the plane counts.
            let ray = camera.bearing(Vector2::from(line.start).lerp(&line.end.into(), 0.5));
            rays.push((ray - moment * (ray.dot(&moment) / (norm * norm))).normalize());
            moment *= length / norm;
        }
        let weight = length.min(FULL_WEIGHT_LENGTH_PX);
        self.moments.push(moment);
        self.midpoints.push((start + end) / 2.0);
        self.lengths.push(length);
        self.weights.push(weight);
        self.indices.push(index);
        self.total_weight += weight;
    }

    /// What `direction . moment` of a segment is to be divided by for the distance in pixels of the segment's ends from
    /// the line that joins its midpoint to the direction's vanishing point: `2 |f v_xy - m v_z|` for a pinhole. Behind
    /// another lens the pixels are those of a picture that looks along the segment's middle, where the two are the
    /// same.
    pub(crate) fn reach(&self, line: usize, direction: &Vector3<f64>) -> f64 {
        match &self.middle_rays {
            None => 2.0 * (direction.xy() * self.focal_px - self.midpoints[line] * direction.z).norm(),
            Some(rays) => 2.0 * rays[line].cross(direction).norm(),
        }
    }

    /// Unit direction of a segment's middle in the camera frame.
    pub(crate) fn toward(&self, line: usize) -> Vector3<f64> {
        match &self.middle_rays {
            None => self.midpoints[line].push(self.focal_px).normalize(),
            Some(rays) => rays[line],
        }
    }

    /// A segment's middle as a pinhole of the same focal length sees it, pixels from the principal point; not finite
    /// where none does.
    pub(crate) fn straight_middle(&self, line: usize) -> Vector2<f64> {
        match &self.middle_rays {
            None => self.midpoints[line],
            Some(rays) if rays[line].z > 0.0 => rays[line].xy() / rays[line].z * self.focal_px,
            Some(_) => Vector2::repeat(f64::NAN),
        }
    }

    /// Number of usable segments.
    pub(crate) fn len(&self) -> usize {
        self.normals.len()
    }
}

/// Whether both ends lie within the margin of one and the same side of the photograph.
fn on_border(line: &LineSegment, frame: &WorkingFrame) -> bool {
    let ends = [line.start, line.end];
    [(0, frame.width), (1, frame.height)].into_iter().any(|(axis, extent)| {
        ends.iter().all(|end| end[axis] < BORDER_MARGIN_PX)
            || ends.iter().all(|end| end[axis] > extent - BORDER_MARGIN_PX)
    })
}
