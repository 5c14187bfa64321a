//! Dual-feature alignment: matched lines and matched points beside the match points, and straight lines kept as
//! straight as the base has them.
//!
//! # Source
//! After dual-feature warping (Li, Yuan, Sun, Liu, "Dual-feature warping-based motion model estimation", 2015),
//! reconstructed.
//!
//! # Departures
//! A sample of a line is drawn to the matched line's own image at its foot, not to the chord between that line's ends,
//! and straightness is the chord's deviation relative to the base's: where the base is a similarity both are the
//! published terms, where it is a sphere unrolled, a straight line of the scene is rightly curved. Robust weights that
//! narrow, and weights by what neighboring matches have in common (`evidence`).

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use trueup_core::lines::{LineSegment, PairLines};
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;

use super::cell_pair::CellPairs;
use super::current_grids::{CurrentGrids, PhotographPixel, PixelPair};
use super::metric::Metric;
use super::normal_equations::NormalEquations;
use super::straight_line::{DeviationTerm, StraightLine};
use crate::evidence::{self, FULL_PX, OverlapGap};

trueup_core::options! {
    /// How matched lines align the grids (`stitch.align = lines`).
    pub struct LineAlignmentOptions("line_alignment") {
        /// Weight of a squared distance of a line's sample from the matched line. Raise it where edges still show
        /// double, lower it where wrong line matches pull.
        weight: f64 = 80.0, between(0.0, 10000.0), "per working px squared";
        /// Weight of a squared deviation from straight of a sample of any long line, while lines or pixels align
        /// overlaps. Raise it where straight edges are bent by aligning.
        straightness: f64 = 5.0, between(0.0, 10000.0), "per working px squared";
    }
}

/// Distance of the samples of a matched line, working px: two or more in every cell of the usual grid.
const SPACING_PX: f64 = 20.0;
/// Most matched points of a pair; published: 300.
const MAX_POINTS: usize = 1000;
/// Distance beyond which a match says no more of what it has in common with its neighbors, panorama units.
const BELIEVED_PX: f64 = 3.0;

/// What line alignment is given.
#[derive(Debug, Clone, Copy)]
pub struct LineAlignmentInput<'a> {
    /// Matched segments of overlapping photographs.
    pub matched: &'a [PairLines],
    /// Matched points of overlapping photographs.
    pub points: &'a [PairMatches],
    /// How.
    pub options: &'a LineAlignmentOptions,
}

/// Straight lines that are kept straight.
#[derive(Debug, Clone, Copy)]
pub struct StraightInput<'a> {
    /// Segments of every photograph.
    pub lines: &'a [Vec<LineSegment>],
    /// How.
    pub options: &'a LineAlignmentOptions,
}

impl StraightInput<'_> {
    /// Adds the equations of straight lines around the current grids.
    pub(super) fn add(&self, equations: &mut NormalEquations, grids: &CurrentGrids) {
        /// Lines from this length on are kept straight, working px.
        const STRAIGHT_LENGTH_PX: f64 = 50.0;
        for (photograph, lines) in self.lines.iter().enumerate() {
            for line in lines.iter().filter(|line| line.length() >= STRAIGHT_LENGTH_PX) {
                let line = StraightLine::along(photograph, line, grids.solved);
                line.add(DeviationTerm::Across, self.options.straightness, equations, grids);
            }
        }
    }
}

/// How much of the distance at which matched points land in `grids` is common to neighbors: the mean over the points of
/// the shares that they would have of their weights, and 0 where noise alone may have it. Shares are never negative, so
/// that noise comes to some: to the more, the worse matches are found.
///
/// Cameras that moved leave most of what they show a little apart; what moved itself lies far from where it was, and
/// leaves all else where it is. The farthest of every overlap are therefore not asked ([`evidence::still`]).
pub(super) fn misaligned_share(points: &[PairMatches], grids: &CurrentGrids) -> f64 {
    /// Points of a pair that are asked; more hardly change the mean.
    const ASKED: usize = 400;
    let gaps = |pair: &PairMatches| -> Vec<OverlapGap> {
        let step = matched(pair).count().div_ceil(ASKED).max(1);
        matched(pair).step_by(step).map(|(_, ends)| point_gap(pair, ends, grids)).collect()
    };
    let gaps: Vec<Vec<OverlapGap>> = points.par_iter().map(gaps).collect();
    let shortened: Vec<Vec<OverlapGap>> = gaps.iter().map(|gaps| gaps.iter().map(believed).collect()).collect();
    if !evidence::is_beyond_noise(&shortened) {
        return 0.0;
    }
    let share = |common: f64| evidence::share(common, FULL_PX);
    let shares = |(gaps, shortened): (&Vec<OverlapGap>, &Vec<OverlapGap>)| -> (usize, f64) {
        let asked: Vec<OverlapGap> = evidence::still(gaps).map(|k| shortened[k]).collect();
        (asked.len(), evidence::common_squares(&asked).into_iter().map(share).sum())
    };
    let shares: Vec<(usize, f64)> = gaps.par_iter().zip(&shortened).map(shares).collect();
    let counted: usize = shares.iter().map(|&(asked, _)| asked).sum();
    shares.into_iter().map(|(_, share)| share).sum::<f64>() / counted.max(1) as f64
}

/// What is believed of how far apart a match lies: distances beyond the believed one count as that.
fn believed(one: &OverlapGap) -> OverlapGap {
    OverlapGap { gap: one.gap * shortening(one.gap.norm()), ..*one }
}

/// How far apart a matched point of `pair` lies.
fn point_gap(pair: &PairMatches, [p, q]: [Vector2<f64>; 2], grids: &CurrentGrids) -> OverlapGap {
    let gap = grids.gap(PhotographPixel { photograph: pair.a, at: p }, PhotographPixel { photograph: pair.b, at: q });
    OverlapGap { place: p, gap, known: Matrix2::identity() }
}

/// Shares of their weights that the matches of all lists have.
pub(super) struct MatchShares {
    points: Vec<Vec<f64>>,
    lines: Vec<Vec<f64>>,
}

/// A match by its list and its index there.
#[derive(Debug, Clone, Copy)]
enum Match {
    Point(usize, usize),
    Line(usize, usize),
}

impl LineAlignmentInput<'_> {
    /// The shares of their weights that all matches have: how much of the distances in the current `grids` is common to
    /// neighbors.
    pub(super) fn shares(&self, grids: &CurrentGrids) -> MatchShares {
        let mut pairs: Vec<(usize, usize)> = self.points.iter().map(|pair| (pair.a, pair.b)).collect();
        pairs.extend(self.matched.iter().map(|pair| (pair.a, pair.b)));
        pairs.sort_unstable();
        pairs.dedup();
        let found: Vec<Vec<(Match, f64)>> = pairs
            .par_iter()
            .map(|&(a, b)| {
                let (which, evidence): (Vec<Match>, Vec<OverlapGap>) = self.evidence(a, b, grids).into_iter().unzip();
                let common = evidence::common_squares(&evidence);
                let shares = common.into_iter().map(|common| evidence::share(common, FULL_PX));
                which.into_iter().zip(shares).collect()
            })
            .collect();
        let mut shares = MatchShares {
            points: self.points.iter().map(|pair| vec![0.0; matched(pair).count()]).collect(),
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
    pub(super) fn whole_shares(&self) -> MatchShares {
        MatchShares {
            points: self.points.iter().map(|pair| vec![1.0; matched(pair).count()]).collect(),
            lines: self.matched.iter().map(|pair| vec![1.0; pair.lines.len()]).collect(),
        }
    }

    /// What the matched points and lines of a pair say; distances beyond the believed one count as that. Lines whose
    /// middles do not meet say nothing.
    fn evidence(&self, a: usize, b: usize, grids: &CurrentGrids) -> Vec<(Match, OverlapGap)> {
        let points = self.points.iter().enumerate().filter(|(_, points)| (points.a, points.b) == (a, b));
        let points = points.flat_map(|(list, points)| {
            chosen(points).map(move |(k, ends)| (Match::Point(list, k), believed(&point_gap(points, ends, grids))))
        });
        let lines = self.matched.iter().enumerate().filter(|(_, lines)| (lines.a, lines.b) == (a, b));
        let lines = lines.flat_map(|(list, lines)| lines.lines.iter().enumerate().map(move |line| (list, line)));
        let lines = lines.filter_map(|(list, (k, [in_a, in_b]))| {
            let middle = Vector2::from(in_a.start).lerp(&Vector2::from(in_a.end), 0.5);
            let (foot, normal) = meeting_place(grids.fine[a].warp(middle), in_b, &grids.fine[b])?;
            let (one, other) =
                (PhotographPixel { photograph: a, at: middle }, PhotographPixel { photograph: b, at: foot });
            let gap = grids.gap(one, other).dot(&normal);
            let gap = normal * (gap * shortening(gap.abs()));
            Some((Match::Line(list, k), OverlapGap { place: middle, gap, known: normal * normal.transpose() }))
        });
        points.chain(lines).collect()
    }

    /// The equations of matched lines and matched points around the current grids, with the `shares` of their weights;
    /// matches `robust_px` apart have half of that.
    pub(super) fn cells(&self, grids: &CurrentGrids, shares: &MatchShares, robust_px: f64) -> Vec<CellPairs> {
        /// Weight of the squared distance of matched points, per working px squared; published: 1, without outlines
        /// that are held and match points that know nothing of parallax.
        const POINT_WEIGHT: f64 = 16.0;
        /// That of those elsewhere in depth, which are few. With it for all points the mesh follows their noise: what
        /// was not matched meets worse in the median, and pixels agree less (45 pairs and small sets).
        const ELSEWHERE_WEIGHT: f64 = 64.0;
        let of_lines = |(pair, shares): (&PairLines, &Vec<f64>)| {
            let mut cells = CellPairs::between([pair.a, pair.b]);
            for (&[line_a, line_b], share) in pair.lines.iter().zip(shares) {
                let lines = MatchedLines { a: pair.a, line_a, b: pair.b, line_b };
                lines.add(share * self.options.weight, robust_px, &mut cells, grids);
            }
            cells
        };
        let of_points = |(pair, shares): (&PairMatches, &Vec<f64>)| {
            let mut cells = CellPairs::between([pair.a, pair.b]);
            for (k, [p, q]) in chosen(pair) {
                let one = PhotographPixel { photograph: pair.a, at: p };
                let pixels = PixelPair::new(one, PhotographPixel { photograph: pair.b, at: q }, grids);
                let believed = if k < pair.inliers.len() { POINT_WEIGHT } else { ELSEWHERE_WEIGHT };
                let weight = shares[k] * believed * robust(pixels.gap.norm(), robust_px);
                pixels.add(Metric::isotropic(weight), &mut cells);
            }
            cells
        };
        let lines = self.matched.par_iter().zip(&shares.lines).map(of_lines);
        let points = self.points.par_iter().zip(&shares.points).map(of_points);
        lines.chain(points).collect()
    }
}

/// Segments of two photographs that show the same edge.
struct MatchedLines {
    a: usize,
    line_a: LineSegment,
    b: usize,
    line_b: LineSegment,
}

impl MatchedLines {
    /// Draws samples of the first line across the second's image.
    fn add(&self, weight: f64, robust_px: f64, equations: &mut CellPairs, grids: &CurrentGrids) {
        let [start, end] = [self.line_a.start, self.line_a.end].map(Vector2::from);
        let steps = (self.line_a.length() / SPACING_PX).floor().max(1.0) as usize;
        for k in 0..=steps {
            let p = start.lerp(&end, k as f64 / steps as f64);
            let place = grids.fine[self.a].warp(p);
            let Some((foot, normal)) = meeting_place(place, &self.line_b, &grids.fine[self.b]) else { continue };
            let one = PhotographPixel { photograph: self.a, at: p };
            let pixels = PixelPair::new(one, PhotographPixel { photograph: self.b, at: foot }, grids);
            let robust = robust(normal.dot(&pixels.gap).abs(), robust_px);
            pixels.add(Metric::along(normal, weight * robust), equations);
        }
    }
}

/// The matched points of a pair that count, as indices with places in both photographs: at most [`MAX_POINTS`] of those
/// on planes, and as many elsewhere.
fn chosen(pair: &PairMatches) -> impl Iterator<Item = (usize, [Vector2<f64>; 2])> + use<'_> {
    let planes = pair.inliers.len();
    let counts = move |k: usize| match k.checked_sub(planes) {
        None => k.is_multiple_of(planes.div_ceil(MAX_POINTS).max(1)),
        Some(k) => k.is_multiple_of(pair.elsewhere.len().div_ceil(MAX_POINTS).max(1)),
    };
    matched(pair).filter(move |&(k, _)| counts(k))
}

/// All matched points of a pair, as indices with places in both photographs: those on planes, then those elsewhere.
fn matched(pair: &PairMatches) -> impl Iterator<Item = (usize, [Vector2<f64>; 2])> + use<'_> {
    let all = pair.inliers.iter().chain(&pair.elsewhere);
    all.enumerate().map(|(k, one)| (k, [one.in_a, one.in_b].map(Vector2::from)))
}

/// Factor that shortens a distance to the believed one.
fn shortening(distance: f64) -> f64 {
    if distance <= BELIEVED_PX { 1.0 } else { BELIEVED_PX / distance }
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
