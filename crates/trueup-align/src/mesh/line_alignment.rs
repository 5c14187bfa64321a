//! Dual-feature alignment: matched lines and matched points beside the match points, and straight lines kept as straight as
//! the base has them.
//!
//! # Source
//! After dual-feature warping (Li, Yuan, Sun, Liu, "Dual-feature warping-based motion model estimation", 2015),
//! reconstructed.
//!
//! # Departures
//! A sample of a line is drawn to the matched line's own image at its foot, not to the chord between that line's ends, and
//! straightness is the chord's deviation relative to the base's: where the base is a similarity both are the published
//! terms, where it is a sphere unrolled, a straight line of the scene is rightly curved. Robust weights for lines.

use nalgebra::Vector2;
use trueup_core::lines::{LineSegment, PairLines};
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;

use super::normal_equations::{Metric, NormalEquations, Share};
use super::structure::{Rod, RodTerm};

trueup_core::options! {
    /// How matched lines align the grids (`stitch.align = lines`).
    pub struct LineAlignmentOptions("line_alignment") {
        /// Weight of a squared distance of a line's sample from the matched line.
        weight: f64 = 20.0, between(0.0, 10000.0), "per working px squared";
        /// Distance of the samples.
        spacing_px: f64 = 20.0, between(1.0, 1000.0), "working px";
        /// Weight of a squared deviation from straight of a sample of any long line.
        straightness: f64 = 5.0, between(0.0, 10000.0), "per working px squared";
        /// Lines from this length on are kept straight.
        straight_length_px: f64 = 50.0, between(1.0, 100000.0), "working px";
        /// Weight of the squared distance of matched points.
        point_weight: f64 = 4.0, between(0.0, 10000.0), "per working px squared";
        /// Most matched points of a pair.
        max_points: usize = 1000, between(0.0, 1000000.0), "";
        /// Distances beyond this count linearly instead of squared.
        robust_px: f64 = 3.0, between(0.01, 1000.0), "panorama units";
        /// Times the mesh is solved with lines and weights found on the solution before.
        rounds: usize = 3, between(1.0, 100.0), "";
    }
}

/// What line alignment is given.
#[derive(Debug, Clone, Copy)]
pub struct LineAlignmentInput<'a> {
    /// Matched segments of overlapping pictures.
    pub matched: &'a [PairLines],
    /// Matched points of overlapping pictures.
    pub points: &'a [PairMatches],
    /// All segments of every picture.
    pub lines: &'a [Vec<LineSegment>],
    /// How.
    pub options: &'a LineAlignmentOptions,
}

/// Grids around which equations are made.
pub(super) struct Present<'a> {
    /// Those whose vertices are unknown.
    pub solved: &'a [GridMesh],
    /// The same subdivided along the bases.
    pub fine: &'a [GridMesh],
    /// The bases' places of the grids' vertices.
    pub places: &'a [Vec<Vector2<f64>>],
}

impl LineAlignmentInput<'_> {
    /// Adds the equations of matched lines, straight lines and matched points around the present grids.
    pub(super) fn add(&self, equations: &mut NormalEquations, present: &Present) {
        for pair in self.matched {
            for [in_a, in_b] in &pair.lines {
                self.add_matched((pair.a, in_a), (pair.b, in_b), equations, present);
            }
        }
        for (picture, lines) in self.lines.iter().enumerate() {
            for line in lines.iter().filter(|line| line.length() >= self.options.straight_length_px) {
                let rod = Rod::along(picture, line, self.options.spacing_px, present.solved);
                rod.add(RodTerm::Across, self.options.straightness, equations, present);
            }
        }
        for pair in self.points {
            let step = pair.inliers.len().div_ceil(self.options.max_points.max(1)).max(1);
            let most = self.options.max_points;
            for one in pair.inliers.iter().step_by(step).take(most) {
                let (p, q) = (Vector2::from(one.in_a), Vector2::from(one.in_b));
                let meeting = Meeting::new((pair.a, p), (pair.b, q), present);
                let weight = self.options.point_weight * self.huber(meeting.gap.norm());
                meeting.add(Metric::isotropic(weight), equations);
            }
        }
    }

    fn huber(&self, distance: f64) -> f64 {
        if distance <= self.options.robust_px { 1.0 } else { self.options.robust_px / distance }
    }

    /// Draws samples of one line across the other's image.
    fn add_matched(
        &self,
        (a, line_a): (usize, &LineSegment),
        (b, line_b): (usize, &LineSegment),
        equations: &mut NormalEquations,
        present: &Present,
    ) {
        let [start, end] = [line_b.start, line_b.end].map(Vector2::from);
        let mesh_b = &present.fine[b];
        let steps = (line_a.length() / self.options.spacing_px).floor().max(1.0) as usize;
        for k in 0..=steps {
            let p = Vector2::from(line_a.start).lerp(&Vector2::from(line_a.end), k as f64 / steps as f64);
            let place = present.fine[a].warp(p);
            let Some(foot) = foot(place, [start, end], mesh_b) else { continue };
            let along = mesh_b.derivative(foot) * (end - start);
            let Some(along) = along.try_normalize(f64::EPSILON) else { continue };
            let normal = Vector2::new(-along.y, along.x);
            let meeting = Meeting::new((a, p), (b, foot), present);
            let weight = self.options.weight * self.huber(normal.dot(&meeting.gap).abs());
            meeting.add(Metric::along(normal, weight), equations);
        }
    }
}

/// The pixel of a segment whose image is nearest to `place`; `None` beyond its ends.
fn foot(place: Vector2<f64>, [start, end]: [Vector2<f64>; 2], mesh: &GridMesh) -> Option<Vector2<f64>> {
    /// Newton steps from the chord's foot: images of segments are nearly straight.
    const STEPS: usize = 2;
    let (first, last) = (mesh.warp(start), mesh.warp(end));
    let chord = last - first;
    let mut share = (place - first).dot(&chord) / chord.norm_squared();
    for _ in 0..STEPS {
        let here = start.lerp(&end, share.clamp(0.0, 1.0));
        let along = mesh.derivative(here) * (end - start);
        share = share.clamp(0.0, 1.0) + (place - mesh.warp(here)).dot(&along) / along.norm_squared();
    }
    (0.0..=1.0).contains(&share).then(|| start.lerp(&end, share))
}

/// A pixel of one picture and one of another that should meet.
struct Meeting {
    members: [Share; 8],
    /// Their distance in the panorama now.
    gap: Vector2<f64>,
    /// What the bilinear sum over the members should come to: minus the difference of the bases' sags.
    value: Vector2<f64>,
}

impl Meeting {
    fn new((a, p): (usize, Vector2<f64>), (b, q): (usize, Vector2<f64>), present: &Present) -> Self {
        let (corners_a, shares_a) = present.solved[a].bilinear(p);
        let (corners_b, shares_b) = present.solved[b].bilinear(q);
        let members = std::array::from_fn(|k| match k {
            0..4 => Share { picture: a, vertex: corners_a[k], share: shares_a[k] },
            _ => Share { picture: b, vertex: corners_b[k - 4], share: -shares_b[k - 4] },
        });
        let gap = present.fine[a].warp(p) - present.fine[b].warp(q);
        let value = present.solved[a].warp(p) - present.solved[b].warp(q) - gap;
        Self { members, gap, value }
    }

    fn add(&self, metric: Metric, equations: &mut NormalEquations) {
        equations.add_sum(&self.members, metric, self.value);
    }
}
