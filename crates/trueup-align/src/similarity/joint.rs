//! Joint refinement: the segments of all pictures vote once for one frame.
//!
//! A picture's own triad rests on a few dozen segments; a panorama has thousands. Once the dominant frame is known to
//! a degree or two, every segment that fits one of its directions refines it, through the cameras, all at once.
//!
//! The residual is measured where the segment was: the distance in pixels of its ends from the line that joins its
//! midpoint to the vanishing point. With moment c = P x Q (ends P, Q), midpoint m and direction v in the camera frame,
//! it is v . c / (2 |f v_xy - m v_z|), exactly.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use trueup_core::geometry::{exp_rotation, nearest_rotation};

use super::SimilarityOptions;
use crate::vanishing::{InterpretationPlanes, orthonormal_complement};

/// Iterations at each scale of the loss.
const ITERATIONS_PER_SCALE: usize = 4;
/// Factor between successive scales.
const SHRINK: f64 = 0.7;
/// Damping in px^2 per rad^2 and segment: keeps an axis without segments where it is.
const DAMPING: f64 = 1e-6;

/// The usable segments of all pictures with their cameras.
#[derive(Debug)]
pub(super) struct LineVote {
    pictures: Vec<PictureLines>,
}

#[derive(Debug)]
struct PictureLines {
    rotation: Matrix3<f64>,
    focal_px: f64,
    planes: InterpretationPlanes,
}

/// The support of one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Support {
    /// Sum over segments of weight times (1 - (angle / tolerance)^2), negative terms left out.
    pub score: f64,
    /// Number of segments within the tolerance.
    pub lines: usize,
    /// Number of pictures with at least three of them.
    pub pictures: usize,
}

impl LineVote {
    /// `rotations` and `planes` per picture; `focals` in the pixels of the planes.
    pub fn new(rotations: &[Matrix3<f64>], focals: &[f64], planes: Vec<InterpretationPlanes>) -> Self {
        let pictures = rotations
            .iter()
            .zip(focals)
            .zip(planes)
            .map(|((&rotation, &focal_px), planes)| PictureLines { rotation, focal_px, planes })
            .collect();
        Self { pictures }
    }

    /// The usable segments of picture `index`.
    pub fn planes(&self, index: usize) -> &InterpretationPlanes {
        &self.pictures[index].planes
    }

    /// Normals in the common frame and weights of about `most` segments, the longest of every picture.
    pub fn longest(&self, most: usize) -> Vec<(Vector3<f64>, f64)> {
        let of_each = most.div_ceil(self.pictures.len().max(1));
        let of_picture = |picture: &PictureLines| -> Vec<(Vector3<f64>, f64)> {
            let normals = picture.planes.normals.iter().take(of_each);
            normals
                .zip(&picture.planes.weights)
                .map(|(normal, &weight)| (picture.rotation.tr_mul(normal), weight))
                .collect()
        };
        self.pictures.iter().flat_map(of_picture).collect()
    }

    /// The sum of the segments' weights.
    pub fn total_weight(&self) -> f64 {
        self.pictures.iter().map(|picture| picture.planes.total_weight).sum()
    }

    /// Refines a frame (columns are directions in the common frame) over SO(3); `axis_weights` multiply the weights of
    /// the segments of each axis.
    pub fn refine_frame(
        &self,
        start: &Matrix3<f64>,
        axis_weights: &[f64; 3],
        options: &SimilarityOptions,
    ) -> Matrix3<f64> {
        let mut frame = *start;
        for scale in scales(options) {
            for _ in 0..ITERATIONS_PER_SCALE {
                let (mut matrix, mut gradient) = (Matrix3::identity() * DAMPING, Vector3::zeros());
                self.for_each_supporter(&frame, 3, scale, options, |axis, moment, residual, weight, reach| {
                    let jacobian = Vector3::ith(axis, 1.0).cross(&frame.tr_mul(&moment)) / reach;
                    let weight = weight * axis_weights[axis];
                    matrix += jacobian * jacobian.transpose() * weight;
                    gradient += jacobian * (weight * residual);
                });
                let Some(inverse) = matrix.try_inverse() else { return frame };
                let step: Vector3<f64> = -(inverse * gradient);
                frame = nearest_rotation(&(frame * exp_rotation(&step)));
            }
        }
        frame
    }

    /// Refines one direction of the common frame alone, over the sphere.
    pub fn refine_direction(&self, start: &Vector3<f64>, options: &SimilarityOptions) -> Vector3<f64> {
        let mut direction = *start;
        for scale in scales(options) {
            for _ in 0..ITERATIONS_PER_SCALE {
                let (first, second) = orthonormal_complement(&direction);
                let frame = Matrix3::from_columns(&[direction, first, second]);
                let (mut matrix, mut gradient) = (Matrix2::identity() * DAMPING, Vector2::zeros());
                self.for_each_supporter(&frame, 1, scale, options, |_, moment, residual, weight, reach| {
                    let jacobian = Vector2::new(first.dot(&moment), second.dot(&moment)) / reach;
                    matrix += jacobian * jacobian.transpose() * weight;
                    gradient += jacobian * (weight * residual);
                });
                let Some(inverse) = matrix.try_inverse() else { return direction };
                let step: Vector2<f64> = -(inverse * gradient);
                direction = (direction + first * step.x + second * step.y).normalize();
            }
        }
        direction
    }

    /// Calls `visit(axis, moment in the common frame, residual, weight, reach)` for every segment that supports one of
    /// the first `axes_used` axes of `frame`; residual = axis . moment / reach in pixels.
    fn for_each_supporter(
        &self,
        frame: &Matrix3<f64>,
        axes_used: usize,
        scale: f64,
        options: &SimilarityOptions,
        mut visit: impl FnMut(usize, Vector3<f64>, f64, f64, f64),
    ) {
        let widest = options.joint_tolerance_deg.to_radians().sin();
        for picture in &self.pictures {
            let axes = picture.rotation * frame;
            for line in 0..picture.planes.len() {
                let Some((axis, residual, reach)) = picture.nearest_axis(&axes, axes_used, line) else { continue };
                if residual.abs() * 2.0 > widest * picture.planes.lengths[line] {
                    continue;
                }
                // Geman-McClure.
                let robust = 1.0 / (1.0 + (residual / scale).powi(2)).powi(2);
                let moment = picture.rotation.tr_mul(&picture.planes.moments[line]);
                visit(axis, moment, residual, picture.planes.weights[line] * robust, reach);
            }
        }
    }

    /// How strongly the segments support `direction`.
    pub fn support(&self, direction: &Vector3<f64>, tolerance: f64) -> Support {
        let mut total = Support { score: 0.0, lines: 0, pictures: 0 };
        for picture in &self.pictures {
            let (score, lines) = picture.support(&(picture.rotation * direction), tolerance);
            total.score += score;
            total.lines += lines;
            total.pictures += usize::from(lines >= 3);
        }
        total
    }
}

impl PictureLines {
    /// The axis (of the first `axes_used`) with the smallest residual in pixels, that residual, and the reach 2 |f v_xy - m v_z|.
    fn nearest_axis(&self, axes: &Matrix3<f64>, axes_used: usize, line: usize) -> Option<(usize, f64, f64)> {
        let mut best: Option<(usize, f64, f64)> = None;
        for axis in 0..axes_used {
            let direction: Vector3<f64> = axes.column(axis).into_owned();
            let reach = self.reach(&direction, line);
            let residual = direction.dot(&self.planes.moments[line]) / reach;
            if residual.is_finite() && best.is_none_or(|best| residual.abs() < best.1.abs()) {
                best = Some((axis, residual, reach));
            }
        }
        best
    }

    fn reach(&self, direction: &Vector3<f64>, line: usize) -> f64 {
        2.0 * (direction.xy() * self.focal_px - self.planes.midpoints[line] * direction.z).norm()
    }

    fn support(&self, direction: &Vector3<f64>, tolerance: f64) -> (f64, usize) {
        let limit = tolerance.sin();
        let (mut score, mut count) = (0.0, 0);
        for line in 0..self.planes.len() {
            let residual = direction.dot(&self.planes.moments[line]) / self.reach(direction, line);
            let sine = 2.0 * residual.abs() / self.planes.lengths[line];
            if sine < limit {
                score += self.planes.weights[line] * (1.0 - (sine / limit).powi(2));
                count += 1;
            }
        }
        (score, count)
    }
}

/// The scales of the loss in pixels, from coarse to fine.
fn scales(options: &SimilarityOptions) -> impl Iterator<Item = f64> {
    let last = options.joint_scale_px;
    let steps = (options.joint_start_scale_px / last).max(1.0).ln() / -SHRINK.ln();
    let steps = steps.ceil() as i32;
    (0..=steps).rev().map(move |step| last / SHRINK.powi(step))
}
