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
//! terms, where it is a sphere unrolled, a straight line of the scene is rightly curved. Robust weights that narrow, and
//! weights by what neighboring matches have in common (`evidence`).

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use trueup_core::lines::{LineSegment, PairLines};
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;

use super::evidence::{self, Evidence};
use super::normal_equations::{Metric, NormalEquations, Share};
use super::structure::{Rod, RodTerm};

trueup_core::options! {
    /// How matched lines align the grids (`stitch.align = lines`).
    pub struct LineAlignmentOptions("line_alignment") {
        /// Weight of a squared distance of a line's sample from the matched line.
        weight: f64 = 80.0, between(0.0, 10000.0), "per working px squared";
        /// Distance of the samples.
        spacing_px: f64 = 20.0, between(1.0, 1000.0), "working px";
        /// Weight of a squared deviation from straight of a sample of any long line.
        straightness: f64 = 5.0, between(0.0, 10000.0), "per working px squared";
        /// Lines from this length on are kept straight.
        straight_length_px: f64 = 50.0, between(1.0, 100000.0), "working px";
        /// Weight of the squared distance of matched points.
        point_weight: f64 = 16.0, between(0.0, 10000.0), "per working px squared";
        /// Most matched points of a pair.
        max_points: usize = 1000, between(0.0, 1000000.0), "";
        /// Distance at which a match has half its weight in the first round.
        robust_px: f64 = 3.0, between(0.01, 1000.0), "panorama units";
        /// Factor on that distance from round to round: where depth differs within a cell, the surface that most matches
        /// are on wins.
        narrowing: f64 = 0.7, between(0.01, 1.0), "";
        /// Misalignment, common to neighboring matches of a pair, from which on they weigh fully; with less their weight
        /// falls with its square.
        full_px: f64 = 0.7, between(0.001, 1000.0), "panorama units, per axis";
        /// Times the mesh is solved with lines and weights found on the solution before.
        rounds: usize = 4, between(1.0, 100.0), "";
    }
}

/// What line alignment is given.
#[derive(Debug, Clone, Copy)]
pub struct LineAlignmentInput<'a> {
    /// Matched segments of overlapping pictures.
    pub matched: &'a [PairLines],
    /// Matched points of overlapping pictures.
    pub points: &'a [PairMatches],
    /// How.
    pub options: &'a LineAlignmentOptions,
}

/// Straight lines that are kept straight.
#[derive(Debug, Clone, Copy)]
pub struct StraightInput<'a> {
    /// Segments of every picture.
    pub lines: &'a [Vec<LineSegment>],
    /// How.
    pub options: &'a LineAlignmentOptions,
}

impl StraightInput<'_> {
    /// Adds the equations of straight lines around the present grids.
    pub(super) fn add(&self, equations: &mut NormalEquations, present: &Present) {
        for (picture, lines) in self.lines.iter().enumerate() {
            for line in lines.iter().filter(|line| line.length() >= self.options.straight_length_px) {
                let rod = Rod::along(picture, line, self.options.spacing_px, present.solved);
                rod.add(RodTerm::Across, self.options.straightness, equations, present);
            }
        }
    }
}

/// Shares of their weights that the matches of all lists have.
pub(super) struct Shares {
    points: Vec<Vec<f64>>,
    lines: Vec<Vec<f64>>,
}

/// A match by its list and its index there.
#[derive(Debug, Clone, Copy)]
enum Match {
    Point(usize, usize),
    Line(usize, usize),
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
    /// The shares of their weights that all matches have: how much of the distances in the `present` grids is common to
    /// neighbors.
    pub(super) fn shares(&self, present: &Present) -> Shares {
        let mut pairs: Vec<(usize, usize)> = self.points.iter().map(|pair| (pair.a, pair.b)).collect();
        pairs.extend(self.matched.iter().map(|pair| (pair.a, pair.b)));
        pairs.sort_unstable();
        pairs.dedup();
        let found: Vec<Vec<(Match, f64)>> = pairs
            .par_iter()
            .map(|&pair| {
                let (which, evidence): (Vec<Match>, Vec<Evidence>) = self.evidence(pair, present).into_iter().unzip();
                let common = evidence::common_squares(&evidence);
                let shares = common.into_iter().map(|common| evidence::share(common, self.options.full_px));
                which.into_iter().zip(shares).collect()
            })
            .collect();
        let mut shares = Shares {
            points: self.points.iter().map(|pair| vec![0.0; pair.inliers.len()]).collect(),
            lines: self.matched.iter().map(|pair| vec![0.0; pair.lines.len()]).collect(),
        };
        for (which, share) in found.into_iter().flatten() {
            match which {
                Match::Point(list, k) => shares.points[list][k] = share,
                Match::Line(list, k) => shares.lines[list][k] = share,
            }
        }
        shares
    }

    /// All matches with all of their weights.
    #[cfg(test)]
    pub(super) fn whole_shares(&self) -> Shares {
        Shares {
            points: self.points.iter().map(|pair| vec![1.0; pair.inliers.len()]).collect(),
            lines: self.matched.iter().map(|pair| vec![1.0; pair.lines.len()]).collect(),
        }
    }

    /// What the matched points and lines of a pair say; distances beyond the robust one count as that. Lines whose middles
    /// do not meet say nothing.
    fn evidence(&self, pair: (usize, usize), present: &Present) -> Vec<(Match, Evidence)> {
        let (a, b) = pair;
        let points = self.points.iter().enumerate().filter(|(_, points)| (points.a, points.b) == pair);
        let points = points.flat_map(|(list, points)| self.chosen(points).map(move |chosen| (list, chosen)));
        let points = points.map(|(list, (k, [p, q]))| {
            let gap = present.gap((a, p), (b, q));
            let evidence = Evidence { place: p, gap: gap * self.shortening(gap.norm()), known: Matrix2::identity() };
            (Match::Point(list, k), evidence)
        });
        let lines = self.matched.iter().enumerate().filter(|(_, lines)| (lines.a, lines.b) == pair);
        let lines = lines.flat_map(|(list, lines)| lines.lines.iter().enumerate().map(move |line| (list, line)));
        let lines = lines.filter_map(|(list, (k, [in_a, in_b]))| {
            let middle = Vector2::from(in_a.start).lerp(&Vector2::from(in_a.end), 0.5);
            let (foot, normal) = meeting_place(present.fine[a].warp(middle), in_b, &present.fine[b])?;
            let gap = present.gap((a, middle), (b, foot)).dot(&normal);
            let gap = normal * (gap * self.shortening(gap.abs()));
            Some((Match::Line(list, k), Evidence { place: middle, gap, known: normal * normal.transpose() }))
        });
        points.chain(lines).collect()
    }

    /// The matched points of a pair that count, as indices with places in both pictures.
    fn chosen<'b>(&self, pair: &'b PairMatches) -> impl Iterator<Item = (usize, [Vector2<f64>; 2])> + use<'b> {
        let most = self.options.max_points;
        let step = pair.inliers.len().div_ceil(most.max(1)).max(1);
        let counted = pair.inliers.iter().enumerate().step_by(step).take(most);
        counted.map(|(k, one)| (k, [one.in_a, one.in_b].map(Vector2::from)))
    }

    /// Adds the equations of matched lines and matched points around the present grids, with the `shares` of their weights;
    /// matches `robust_px` apart have half of that.
    pub(super) fn add(&self, equations: &mut NormalEquations, present: &Present, shares: &Shares, robust_px: f64) {
        for (pair, share) in self.matched.iter().zip(&shares.lines) {
            for ([in_a, in_b], share) in pair.lines.iter().zip(share) {
                self.add_matched(
                    (pair.a, in_a),
                    (pair.b, in_b),
                    (share * self.options.weight, robust_px),
                    equations,
                    present,
                );
            }
        }
        for (pair, share) in self.points.iter().zip(&shares.points) {
            for (k, [p, q]) in self.chosen(pair) {
                let meeting = Meeting::new((pair.a, p), (pair.b, q), present);
                let weight = share[k] * self.options.point_weight * robust(meeting.gap.norm(), robust_px);
                meeting.add(Metric::isotropic(weight), equations);
            }
        }
    }

    /// Factor that shortens a distance to the robust one.
    fn shortening(&self, distance: f64) -> f64 {
        if distance <= self.options.robust_px { 1.0 } else { self.options.robust_px / distance }
    }

    /// Draws samples of one line across the other's image.
    fn add_matched(
        &self,
        (a, line_a): (usize, &LineSegment),
        (b, line_b): (usize, &LineSegment),
        (weight, robust_px): (f64, f64),
        equations: &mut NormalEquations,
        present: &Present,
    ) {
        let steps = (line_a.length() / self.options.spacing_px).floor().max(1.0) as usize;
        for k in 0..=steps {
            let p = Vector2::from(line_a.start).lerp(&Vector2::from(line_a.end), k as f64 / steps as f64);
            let Some((foot, normal)) = meeting_place(present.fine[a].warp(p), line_b, &present.fine[b]) else {
                continue;
            };
            let meeting = Meeting::new((a, p), (b, foot), present);
            let robust = robust(normal.dot(&meeting.gap).abs(), robust_px);
            meeting.add(Metric::along(normal, weight * robust), equations);
        }
    }
}

impl Present<'_> {
    /// Distance in the panorama of a pixel of one picture from one of another.
    fn gap(&self, (a, p): (usize, Vector2<f64>), (b, q): (usize, Vector2<f64>)) -> Vector2<f64> {
        self.fine[a].warp(p) - self.fine[b].warp(q)
    }
}

/// The pixel of a line whose image is nearest to `place`, and the direction across the image there.
fn meeting_place(place: Vector2<f64>, line: &LineSegment, mesh: &GridMesh) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let [start, end] = [line.start, line.end].map(Vector2::from);
    let foot = foot(place, [start, end], mesh)?;
    let along = (mesh.derivative(foot) * (end - start)).try_normalize(f64::EPSILON)?;
    Some((foot, Vector2::new(-along.y, along.x)))
}

/// Cauchy's weight of a distance.
fn robust(distance: f64, width_px: f64) -> f64 {
    1.0 / (1.0 + (distance / width_px).powi(2))
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
        let gap = present.gap((a, p), (b, q));
        let value = present.solved[a].warp(p) - present.solved[b].warp(q) - gap;
        Self { members, gap, value }
    }

    fn add(&self, metric: Metric, equations: &mut NormalEquations) {
        equations.add_sum(&self.members, metric, self.value);
    }
}
