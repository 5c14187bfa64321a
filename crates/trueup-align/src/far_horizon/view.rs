//! Colors around directions, from the small copies of photographs.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::lines::EdgeCurve;
use trueup_core::raster::{Raster, luma_256ths};

use super::ShownPhotograph;

/// Nearest to an edge that colors are taken, radians (0.6 degrees): haze and the eye's height leave that to sea and sky
/// alike.
const NEAREST: f64 = 0.0105;
/// The same in pixels of the small copy, whose pixels mix both sides.
const NEAREST_PX: f64 = 2.0;
/// Distances from an edge at which colors are taken, by the nearest.
const DISTANCES: [f64; SAMPLES] = [1.0, 1.6, 2.4, 3.6];
/// So many colors on each side.
pub(super) const SAMPLES: usize = 4;

/// Heights above an edge at which it is looked whether sky goes on, radians (2.3 to 11 degrees).
const FAR_UP: [f64; 5] = [0.04, 0.07, 0.1, 0.14, 0.2];

/// A photograph in its place.
#[derive(Debug, Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) curves: &'a [EdgeCurve],
    camera: &'a Camera,
    world_from_camera: Matrix3<f64>,
    size: [f64; 2],
    thumbnail: &'a Raster<u8>,
    thumbnail_from_working: f64,
    nearest: f64,
}

/// Red, green and blue, 0 to 255.
pub(super) type Color = Vector3<f64>;

/// Colors on both sides of a direction, from the nearest outward.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sides {
    pub(super) above: [Color; SAMPLES],
    pub(super) below: [Color; SAMPLES],
}

impl<'a> View<'a> {
    pub(super) fn new(shown: &ShownPhotograph<'a>, camera: &'a Camera) -> Self {
        let thumbnail_from_working = shown.thumbnail_frame.working_from_full / shown.frame.working_from_full;
        Self {
            curves: shown.curves,
            camera,
            world_from_camera: camera.rotation().transpose(),
            size: [shown.frame.width, shown.frame.height],
            thumbnail: shown.thumbnail,
            thumbnail_from_working,
            nearest: NEAREST.max(NEAREST_PX / (camera.focal_px * thumbnail_from_working)),
        }
    }

    /// Where a working pixel looks, unit length in the common frame.
    pub(super) fn direction(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        (self.world_from_camera * self.camera.bearing(Vector2::new(x, y))).normalize()
    }

    /// Whether what lies next to `direction` is brighter above than below, so that a look at more of it is worth its
    /// time.
    pub(super) fn is_brighter_above(&self, direction: &Vector3<f64>, down: &Vector3<f64>) -> bool {
        let Some(downward) = downward(direction, down) else { return false };
        let beside = [-self.nearest, self.nearest].map(|angle| self.color_beside(direction, &downward, angle));
        let [Some(above), Some(below)] = beside else { return false };
        // The colors are those of pixels: whole numbers of eight bits.
        let [above, below] = [above, below].map(|color| luma_256ths(color.map(|one| one as u8).into()));
        above > below
    }

    /// The colors on both sides of `direction`, toward `-down` and `down`; `None` where the photograph does not show
    /// them all.
    pub(super) fn sides(&self, direction: &Vector3<f64>, down: &Vector3<f64>) -> Option<Sides> {
        let downward = downward(direction, down)?;
        let mut sides = Sides { above: [Color::zeros(); SAMPLES], below: [Color::zeros(); SAMPLES] };
        for (k, distance) in DISTANCES.iter().enumerate() {
            let angle = distance * self.nearest;
            sides.above[k] = self.color_beside(direction, &downward, -angle)?;
            sides.below[k] = self.color_beside(direction, &downward, angle)?;
        }
        Some(sides)
    }

    /// The largest difference between neighbors among colors of which the first is the outermost above, and the others
    /// lie farther up, as far as the photograph shows them.
    pub(super) fn largest_step_up(&self, direction: &Vector3<f64>, down: &Vector3<f64>, sides: &Sides) -> f64 {
        let Some(downward) = downward(direction, down) else { return 0.0 };
        let (mut last, mut largest) = (sides.above[SAMPLES - 1], 0.0_f64);
        // Pixels of a small copy with a short focal length are so wide that the outermost color is from beyond the
        // first of these.
        let outermost = DISTANCES[SAMPLES - 1] * self.nearest;
        for height in FAR_UP.into_iter().filter(|height| *height > outermost) {
            let Some(color) = self.color_beside(direction, &downward, -height) else { break };
            largest = largest.max(difference(&color, &last));
            last = color;
        }
        largest
    }

    /// The color `angle` radians from `direction` toward `downward`, which is orthogonal to it.
    fn color_beside(&self, direction: &Vector3<f64>, downward: &Vector3<f64>, angle: f64) -> Option<Color> {
        let (sine, cosine) = angle.sin_cos();
        self.color(&(direction * cosine + downward * sine))
    }

    fn color(&self, direction: &Vector3<f64>) -> Option<Color> {
        let working = self.camera.project(self.world_from_camera.tr_mul(direction))?;
        let is_inside = (0..2).all(|axis| (0.0..=self.size[axis]).contains(&working[axis]));
        // Only a lens may carry back into the picture what lies far beside it.
        if !is_inside || !(self.camera.lens.is_pinhole() || self.camera.shows(*direction, self.size)) {
            return None;
        }
        let pixel = working * self.thumbnail_from_working;
        let (width, height) = (self.thumbnail.width(), self.thumbnail.height());
        // The casts saturate, and the last pixel reaches a fraction beyond.
        let (x, y) = ((pixel.x as usize).min(width.checked_sub(1)?), (pixel.y as usize).min(height.checked_sub(1)?));
        let samples = self.thumbnail.pixel(x, y);
        let channel = |index: usize| samples.get(index).or(samples.first()).copied().map(f64::from);
        Some(Color::new(channel(0)?, channel(1)?, channel(2)?))
    }
}

impl Sides {
    /// How far the colors next to the edge differ.
    pub(super) fn jump(&self) -> f64 {
        difference(&self.above[0], &self.below[0])
    }

    /// The largest difference between neighbors among the colors above.
    pub(super) fn step_above(&self) -> f64 {
        largest_step(&self.above)
    }

    /// The same below.
    pub(super) fn step_below(&self) -> f64 {
        largest_step(&self.below)
    }

    /// Whether all colors on both sides differ by no more than `most` from `sky`.
    pub(super) fn are_all_like(&self, sky: &Color, most: f64) -> bool {
        self.above.iter().chain(&self.below).all(|color| difference(color, sky) <= most)
    }
}

/// Where `down` is seen from `direction`: the unit vector orthogonal to this.
fn downward(direction: &Vector3<f64>, down: &Vector3<f64>) -> Option<Vector3<f64>> {
    (down - direction * down.dot(direction)).try_normalize(f64::EPSILON)
}

fn difference(one: &Color, other: &Color) -> f64 {
    (one - other).amax()
}

fn largest_step(colors: &[Color; SAMPLES]) -> f64 {
    colors.windows(2).map(|pair| difference(&pair[0], &pair[1])).fold(0.0, f64::max)
}
