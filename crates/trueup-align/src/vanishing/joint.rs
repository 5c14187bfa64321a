//! Joint refinement: the segments of all photographs vote once for one frame.
//!
//! A photograph's own triad rests on a few dozen segments; a panorama has thousands. Once the dominant frame is known
//! to a degree or two, every segment that fits one of its directions refines it, through the cameras, all at once.
//!
//! The residual is measured where the segment was: the distance in pixels of its ends from the line that joins its
//! midpoint to the vanishing point. With moment c = P x Q (ends P, Q), midpoint m and direction v in the camera frame,
//! it is v . c / (2 |f v_xy - m v_z|), exactly; behind a lens that bends, what [`InterpretationPlanes::reach`] has in
//! place of the divisor.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::{exp_rotation, nearest_rotation, orthonormal_complement};

use super::interpretation::InterpretationPlanes;
use super::supporters::{BUILT_DEVIATION_DEG, EXPECTED_SCATTER_PX, Supporter, weigh_as_things};

/// Scale of the robust loss at which the refinement starts, working pixels.
const START_SCALE_PX: f64 = 4.0;
/// Scale of the robust loss at which the refinement ends, working pixels.
const END_SCALE_PX: f64 = 0.5;
/// Largest angle between a segment and a direction for the segment to vote, degrees.
pub(crate) const TOLERANCE_DEG: f64 = 3.0;
/// Most iterations at each scale of the loss.
const ITERATIONS_PER_SCALE: usize = 4;
/// Step in radians below which the frame has settled at a scale: a thousandth of what verticals are known to.
const SETTLED: f64 = 1e-6;
/// Factor between successive scales.
const SHRINK: f64 = 0.7;
/// Damping in rad^-2: keeps an axis without segments where it is.
const DAMPING: f64 = 1e-6;
/// Rounds of iterations at the last scale that a refinement by some of the segments takes from the full one's result.
const REPEATS: usize = 3;

/// Factors on the weights of the segments of a frame's axes (columns).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AxisWeights {
    /// The axis of what stands upright.
    vertical: usize,
    /// The factor of its segments.
    upright: f64,
    /// That of the others'.
    level: f64,
}

impl AxisWeights {
    /// `upright` on the segments along the axis `vertical`, `level` on the others.
    pub(crate) fn new(vertical: usize, upright: f64, level: f64) -> Self {
        Self { vertical, upright, level }
    }

    /// All segments as they are; upright ones are along the axis `vertical`.
    pub(crate) fn alike(vertical: usize) -> Self {
        Self::new(vertical, 1.0, 1.0)
    }

    /// The same for upright segments, none for level ones.
    pub(crate) fn upright_alone(self) -> Self {
        Self { level: 0.0, ..self }
    }

    /// The factor of an axis.
    pub(crate) fn of(&self, axis: usize) -> f64 {
        if axis == self.vertical { self.upright } else { self.level }
    }

    /// What the segments along an axis tell of the frame's turns, from the normal matrix in rad^-2 and the gradient in
    /// rad^-1 that they have.
    ///
    /// Level lines of a facade or a street are parallel to each other, and all of them may be out of level or of the
    /// right angle to others; what they err by together, no number of them tells.
    fn told(&self, axis: usize, matrix: &Matrix3<f64>, gradient: &Vector3<f64>) -> (Matrix3<f64>, Vector3<f64>) {
        let together = if axis == self.vertical { 0.0 } else { BUILT_DEVIATION_DEG.to_radians().powi(2) };
        // (matrix^-1 + together)^-1, also of a matrix that tells nothing of a turn about the axis.
        let shared = (Matrix3::identity() + matrix * together).try_inverse().unwrap_or_default() * self.of(axis);
        (matrix * shared, shared * gradient)
    }
}

/// A segment: its photograph and its place among the usable ones there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SegmentPlace {
    pub photograph: usize,
    pub line: usize,
}

/// A segment as seen in the common frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sight {
    /// Unit normal of its interpretation plane.
    pub normal: Vector3<f64>,
    /// Unit direction of its middle.
    pub toward: Vector3<f64>,
    /// Length in working pixels.
    pub length_px: f64,
}

/// A refinement of a frame over its turns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Refinement<'a> {
    pub start: &'a Matrix3<f64>,
    /// Axes that segments may support: the first so many columns.
    pub axes_used: usize,
    pub axis_weights: AxisWeights,
}

/// The axis that a segment fits best, as in [`Supporter`].
#[derive(Debug, Clone, Copy)]
struct NearestAxis {
    axis: usize,
    residual_px: f64,
    reach: f64,
}

/// The usable segments of all photographs with their cameras.
#[derive(Debug)]
pub(crate) struct LineVote {
    photographs: Vec<PhotographLines>,
}

#[derive(Debug)]
struct PhotographLines {
    rotation: Matrix3<f64>,
    planes: InterpretationPlanes,
}

/// The support of one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Support {
    /// Sum over segments of weight times (1 - (angle / tolerance)^2), negative terms left out.
    pub score: f64,
    /// Number of segments within the tolerance.
    pub lines: usize,
    /// Number of photographs with at least three of them.
    pub photographs: usize,
}

impl LineVote {
    /// `rotations` and `planes` per photograph.
    pub(crate) fn new(rotations: &[Matrix3<f64>], planes: Vec<InterpretationPlanes>) -> Self {
        let photographs = rotations.iter().zip(planes).map(|(&rotation, planes)| PhotographLines { rotation, planes });
        Self { photographs: photographs.collect() }
    }

    /// The usable segments of photograph `index`.
    pub(crate) fn planes(&self, index: usize) -> &InterpretationPlanes {
        &self.photographs[index].planes
    }

    /// Normals in the common frame and weights of about `most` segments, the longest of every photograph.
    pub(crate) fn longest(&self, most: usize) -> Vec<(Vector3<f64>, f64)> {
        let of_line = |(PhotographLines { rotation, planes }, line): (&PhotographLines, usize)| {
            (rotation.tr_mul(&planes.normals[line]), planes.weights[line])
        };
        self.longest_of_each(most).map(of_line).collect()
    }

    /// The same segments as seen in the common frame.
    pub(crate) fn sights(&self, most: usize) -> Vec<Sight> {
        let of_line = |(PhotographLines { rotation, planes }, line): (&PhotographLines, usize)| Sight {
            normal: rotation.tr_mul(&planes.normals[line]),
            toward: rotation.tr_mul(&planes.toward(line)),
            length_px: planes.lengths[line],
        };
        self.longest_of_each(most).map(of_line).collect()
    }

    /// About `most` segments, shared out evenly among the photographs, whose longest come first.
    fn longest_of_each(&self, most: usize) -> impl Iterator<Item = (&PhotographLines, usize)> {
        let of_each = most.div_ceil(self.photographs.len().max(1));
        let of_photograph = move |photograph| (0..of_each).map(move |line| (photograph, line));
        self.photographs.iter().flat_map(of_photograph).filter(|(photograph, line)| *line < photograph.planes.len())
    }

    /// The sum of the segments' weights.
    pub(crate) fn total_weight(&self) -> f64 {
        self.photographs.iter().map(|photograph| photograph.planes.total_weight).sum()
    }

    /// Number of photographs that show a direction: by three segments or more that may vote for it.
    pub(crate) fn photographs_along(&self, direction: &Vector3<f64>) -> usize {
        self.support(direction, TOLERANCE_DEG.to_radians()).photographs
    }

    /// Refines a frame (columns are directions in the common frame) over SO(3); `axis_weights` multiply the weights of
    /// the segments of each axis.
    pub(crate) fn refine_frame(&self, start: &Matrix3<f64>, axis_weights: AxisWeights) -> Matrix3<f64> {
        self.refine(Refinement { start, axes_used: 3, axis_weights }, scales(), |_| true)
    }

    /// How well segments fit a frame: the sum of their weights, each times 1 / (1 + (r / s)^2) of its residual r, with
    /// s the last scale of the loss, whose complement that is; nothing of those that support no axis.
    pub(crate) fn fit(&self, frame: &Matrix3<f64>) -> f64 {
        self.photographs.iter().flat_map(|photograph| photograph.fits(frame)).sum()
    }

    /// The same of each segment, by photograph, where each photograph's own segments turn the frame for it.
    pub(crate) fn fits_of_own(&self, frame: &Matrix3<f64>) -> Vec<Vec<f64>> {
        let refinement = Refinement { start: frame, axes_used: 3, axis_weights: AxisWeights::alike(0) };
        let of_photograph = |(index, photograph): (usize, &PhotographLines)| {
            let own = self.refine(refinement, scales(), |one| one.photograph == index);
            photograph.fits(&own).collect()
        };
        self.photographs.iter().enumerate().map(of_photograph).collect()
    }

    fn mean_weight(&self) -> f64 {
        let segments: usize = self.photographs.iter().map(|photograph| photograph.planes.len()).sum();
        self.total_weight() / segments.max(1) as f64
    }

    /// Refines a frame that all segments have refined, by those `asked` alone: at the last scale of the loss.
    pub(crate) fn refine_again(
        &self,
        refinement: Refinement<'_>,
        asked: impl Fn(SegmentPlace) -> bool,
    ) -> Matrix3<f64> {
        self.refine(refinement, std::iter::repeat_n(END_SCALE_PX, REPEATS), asked)
    }

    /// Number of photographs.
    pub(crate) fn photographs(&self) -> usize {
        self.photographs.len()
    }

    /// `value` of the direction of every segment's middle in the common frame, by photograph.
    pub(crate) fn by_midpoint<T>(&self, value: impl Fn(Vector3<f64>) -> T) -> Vec<Vec<T>> {
        let of_photograph = |photograph: &PhotographLines| {
            let toward = |line: usize| photograph.rotation.tr_mul(&photograph.planes.toward(line));
            (0..photograph.planes.len()).map(|line| value(toward(line))).collect()
        };
        self.photographs.iter().map(of_photograph).collect()
    }

    /// The segments that support one of the first `axes_used` axes of `frame`.
    pub(crate) fn supporters(&self, frame: &Matrix3<f64>, axes_used: usize) -> Vec<SegmentPlace> {
        let mut found = Vec::new();
        for (index, photograph) in self.photographs.iter().enumerate() {
            let axes = photograph.rotation * frame;
            let supports = |line: usize| {
                let nearest = photograph.nearest_axis(&axes, axes_used, line);
                nearest.is_some_and(|nearest| photograph.is_within_tolerance(nearest.residual_px, line))
            };
            let lines = (0..photograph.planes.len()).filter(|&line| supports(line));
            found.extend(lines.map(|line| SegmentPlace { photograph: index, line }));
        }
        found
    }

    /// Refines a frame over given scales of the loss, by the segments `asked`.
    fn refine(
        &self,
        refinement: Refinement<'_>,
        scales: impl Iterator<Item = f64>,
        asked: impl Fn(SegmentPlace) -> bool,
    ) -> Matrix3<f64> {
        let Refinement { start, axes_used, axis_weights } = refinement;
        let unit = 1.0 / (self.mean_weight() * EXPECTED_SCATTER_PX.powi(2));
        let mut frame = *start;
        for scale in scales {
            for _ in 0..ITERATIONS_PER_SCALE {
                let mut axes = [(Matrix3::zeros(), Vector3::zeros()); 3];
                for one in self.weighed_supporters(&frame, axes_used, scale, &asked) {
                    let jacobian = Vector3::ith(one.axis, 1.0).cross(&frame.tr_mul(&one.moment)) / one.reach;
                    let weight = one.weight * unit;
                    let (matrix, gradient) = &mut axes[one.axis];
                    *matrix += jacobian * jacobian.transpose() * weight;
                    *gradient += jacobian * (weight * one.residual_px);
                }
                let (mut matrix, mut gradient) = (Matrix3::identity() * DAMPING, Vector3::zeros());
                for (axis, (of_axis, toward)) in axes.iter().enumerate() {
                    let (of_axis, toward) = axis_weights.told(axis, of_axis, toward);
                    matrix += of_axis;
                    gradient += toward;
                }
                let Some(inverse) = matrix.try_inverse() else { return frame };
                let step: Vector3<f64> = -(inverse * gradient);
                frame = nearest_rotation(&(frame * exp_rotation(&step)));
                if step.norm() < SETTLED {
                    break;
                }
            }
        }
        frame
    }

    /// The frame whose first column alone is refined: the direction that segments near it point to.
    pub(crate) fn refine_first_axis(&self, start: &Matrix3<f64>) -> Matrix3<f64> {
        self.refine(
            Refinement { start, axes_used: 1, axis_weights: AxisWeights::alike(0).upright_alone() },
            scales(),
            |_| true,
        )
    }

    /// Normal matrix and gradient, in px^2 per rad^2 and px^2 per rad, of the squared residuals of photograph `index`
    /// under a small turn in the common frame, for the camera `rotation` in place of the photograph's own. Segments
    /// weigh 1 on average, times the robust loss of `scale` pixels and their axis' weight.
    pub(crate) fn turn_equations(
        &self,
        index: usize,
        rotation: &Matrix3<f64>,
        frame: &Matrix3<f64>,
        axis_weights: AxisWeights,
        scale: f64,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let (mut matrix, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
        let photograph = &self.photographs[index];
        let mean = self.mean_weight();
        photograph.for_each_supporter(
            rotation,
            frame,
            3,
            scale,
            |_| true,
            |one| {
                let jacobian = frame.column(one.axis).cross(&one.moment) / one.reach;
                let weight = one.weight * axis_weights.of(one.axis) / mean;
                matrix += jacobian * jacobian.transpose() * weight;
                gradient += jacobian * (weight * one.residual_px);
            },
        );
        (matrix, gradient)
    }

    /// The direction of the common frame that segments near `start` point to.
    pub(crate) fn refine_direction(&self, start: &Vector3<f64>) -> Vector3<f64> {
        let (first, second) = orthonormal_complement(start);
        self.refine_first_axis(&Matrix3::from_columns(&[*start, first, second])).column(0).into_owned()
    }

    /// Every segment `asked` that supports one of the first `axes_used` axes of `frame`, weighed as the thing that it
    /// is a piece of.
    fn weighed_supporters(
        &self,
        frame: &Matrix3<f64>,
        axes_used: usize,
        scale: f64,
        asked: impl Fn(SegmentPlace) -> bool,
    ) -> Vec<Supporter> {
        let mut supporters = Vec::new();
        for (index, photograph) in self.photographs.iter().enumerate() {
            let asked = |line| asked(SegmentPlace { photograph: index, line });
            let keep = |one| supporters.push(one);
            photograph.for_each_supporter(&photograph.rotation, frame, axes_used, scale, asked, keep);
        }
        weigh_as_things(&mut supporters, frame, scale / END_SCALE_PX);
        supporters
    }

    /// How strongly the segments support `direction`.
    pub(crate) fn support(&self, direction: &Vector3<f64>, tolerance: f64) -> Support {
        let mut total = Support { score: 0.0, lines: 0, photographs: 0 };
        for photograph in &self.photographs {
            let (score, lines) = photograph.support(&(photograph.rotation * direction), tolerance);
            total.score += score;
            total.lines += lines;
            total.photographs += usize::from(lines >= 3);
        }
        total
    }
}

impl PhotographLines {
    /// The axis (of the first `axes_used`) with the smallest residual, not weighed by the loss.
    fn nearest_axis(&self, axes: &Matrix3<f64>, axes_used: usize, line: usize) -> Option<NearestAxis> {
        let mut best: Option<NearestAxis> = None;
        for axis in 0..axes_used {
            let direction: Vector3<f64> = axes.column(axis).into_owned();
            let reach = self.reach(&direction, line);
            let residual_px = direction.dot(&self.planes.moments[line]) / reach;
            if residual_px.is_finite() && best.is_none_or(|best| residual_px.abs() < best.residual_px.abs()) {
                best = Some(NearestAxis { axis, residual_px, reach });
            }
        }
        best
    }

    /// What [`LineVote::fit`] adds up of one photograph.
    fn fits(&self, frame: &Matrix3<f64>) -> impl Iterator<Item = f64> {
        let axes = self.rotation * frame;
        (0..self.planes.len()).map(move |line| {
            let nearest = self.nearest_axis(&axes, 3, line);
            let supports = nearest.filter(|nearest| self.is_within_tolerance(nearest.residual_px, line));
            let share = |one: NearestAxis| 1.0 / (1.0 + (one.residual_px / END_SCALE_PX).powi(2));
            supports.map_or(0.0, |one| self.planes.weights[line] * share(one))
        })
    }

    /// Calls `visit` for every segment `asked` that supports one of the first `axes_used` axes of `frame`, for a camera
    /// of this rotation.
    fn for_each_supporter(
        &self,
        rotation: &Matrix3<f64>,
        frame: &Matrix3<f64>,
        axes_used: usize,
        scale: f64,
        asked: impl Fn(usize) -> bool,
        mut visit: impl FnMut(Supporter),
    ) {
        let axes = rotation * frame;
        for line in (0..self.planes.len()).filter(|&line| asked(line)) {
            let Some(nearest) = self.nearest_axis(&axes, axes_used, line) else { continue };
            let NearestAxis { axis, residual_px, reach } = nearest;
            if !self.is_within_tolerance(residual_px, line) {
                continue;
            }
            // Geman-McClure.
            let robust = 1.0 / (1.0 + (residual_px / scale).powi(2)).powi(2);
            let moment = rotation.tr_mul(&self.planes.moments[line]);
            let weight = self.planes.weights[line] * robust;
            let half_length = 0.5 * self.planes.lengths[line];
            visit(Supporter { axis, moment, residual_px, half_length, weight, reach });
        }
    }

    /// Whether a segment that is so far from an axis at its ends may vote for it.
    fn is_within_tolerance(&self, residual_px: f64, line: usize) -> bool {
        residual_px.abs() * 2.0 <= TOLERANCE_DEG.to_radians().sin() * self.planes.lengths[line]
    }

    fn reach(&self, direction: &Vector3<f64>, line: usize) -> f64 {
        self.planes.reach(line, direction)
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
pub(crate) fn scales() -> impl Iterator<Item = f64> {
    let last = END_SCALE_PX;
    let steps = (START_SCALE_PX / last).max(1.0).ln() / -SHRINK.ln();
    let steps = steps.ceil() as i32;
    (0..=steps).rev().map(move |step| last / SHRINK.powi(step))
}
