//! A homography that many of the matches agree on.
//!
//! # Source
//! Fischler and Bolles, Random sample consensus; the cost is MSAC's (Torr and Zisserman, MLESAC, section 4), samples of
//! the most distinctive matches come first as in PROSAC (Chum and Matas, 2005), and promising ones are optimized
//! locally (Chum, Matas and Kittler, Locally optimized RANSAC).
//!
//! # Departures
//! Photographs with parallax have several maps that many matches agree on nearly equally, and a sample without outliers
//! may lead to any of them. That the draw does not decide between them, more is drawn than the textbook asks for
//! (`PATIENCE`), and samples are optimized that are nearly as good as the best sample (`PROMISING`): measured against
//! an optimized map, hardly a sample would be good enough to lead anywhere else.

use nalgebra::{Matrix3, Vector2};
use rand::{Rng, RngExt};
use trueup_core::geometry::Homography;

use super::local::LocalOptimizer;
use super::matched_points::{MatchedPoints, squared_error};

/// Matches in a sample.
const SAMPLE: usize = 4;
/// Twice the smallest area of a triangle of sample points, in square pixels; below, the three count as collinear.
const MIN_TRIANGLE_PX2: f64 = 20.0;
/// Probability of having drawn a sample of inliers (Fischler and Bolles); [`PATIENCE`] times as many as that takes are
/// drawn.
const CONFIDENCE: f64 = 0.995;
/// How many times the samples that would give one without outliers are drawn: such a sample may still be too noisy, too
/// narrow, or of another plane.
const PATIENCE: usize = 8;
/// A sample's map is optimized if it explains at least this share of what the best sample's map explains.
const PROMISING: f64 = 0.8;
/// Matches measured between two looks at whether a hypothesis can still win.
const BATCH: usize = 16;

/// How a homography is sought.
#[derive(Debug, Clone, Copy)]
pub(super) struct HomographySearch {
    /// How far a match may lie from where the homography predicts it, in pixels of b.
    pub(super) inlier_px: f64,
    /// Largest number of samples.
    pub(super) max_samples: usize,
    /// Inliers below which the answer is of no use; drawing ends where so many would have been found.
    pub(super) useful_inliers: usize,
    /// A map that may be about right, tried before all samples.
    pub(super) start: Option<Homography>,
}

/// A homography and the matches that agree with it.
#[derive(Debug, Clone)]
pub(super) struct Consensus {
    /// The map; its denominator is positive at the agreeing matches.
    pub(super) b_from_a: Homography,
    /// Indices of the agreeing matches, ascending.
    pub(super) inliers: Vec<usize>,
}

/// Why no homography was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoConsensus {
    /// No sample gave one that could be right.
    NoSample,
    /// The useful ones were not plausible.
    Implausible,
}

/// The plausible homography of least truncated squared forward transfer error.
///
/// The error of a match counts at most `inlier_px`; hypotheses that cannot win any more are dropped early.
///
/// # Errors
/// [`NoConsensus`] if there are fewer than four matches or no sample gives a plausible map.
pub(super) fn find_homography(
    points: &MatchedPoints,
    search: &HomographySearch,
    is_plausible: impl Fn(&Homography) -> bool,
    generator: &mut impl Rng,
) -> Result<Consensus, NoConsensus> {
    let count = points.in_a.len();
    let local = LocalOptimizer::new(points, search.inlier_px).filter(|_| count >= SAMPLE);
    let local = local.ok_or(NoConsensus::NoSample)?;
    let enough = |inliers: usize| PATIENCE.saturating_mul(samples_needed(inliers as f64 / count as f64));
    let mut failure = NoConsensus::NoSample;
    let mut needed = search.max_samples.min(enough(search.useful_inliers));
    let (mut best, mut best_cost) = (None, count as f64);
    // Optimizes a hypothesis; if it leads to the best so far, its inliers tell how many samples are needed.
    let mut optimize = |hypothesis: &Homography, needed: &mut usize| {
        let (optimized, cost) = local.optimize(hypothesis, best_cost, &is_plausible);
        if cost < best_cost {
            (best, best_cost) = (Some(optimized), cost);
            *needed = (*needed).min(enough(points.agreeing(&optimized, search.inlier_px).len()));
        }
    };
    if let Some(start) = search.start.filter(&is_plausible) {
        optimize(&start, &mut needed);
    }
    let mut pool = ProgressivePool::new(count, needed);
    // How many matches the best sample's map explains, each by 1 - error^2 / inlier_px^2.
    let mut explained: f64 = 0.0;
    let mut drawn = 0;
    while drawn < needed {
        drawn += 1;
        let sample = pool.draw(generator);
        let Some(hypothesis) = through_sample(points, &sample) else { continue };
        let bound = count as f64 - PROMISING * explained;
        let Some(cost) = truncated_cost(points, &hypothesis, search.inlier_px, bound) else { continue };
        if is_plausible(&hypothesis) {
            explained = explained.max(count as f64 - cost);
            optimize(&hypothesis, &mut needed);
        } else if points.agreeing(&hypothesis, search.inlier_px).len() >= search.useful_inliers {
            failure = NoConsensus::Implausible;
        }
    }
    let b_from_a = best.ok_or(failure)?;
    Ok(Consensus { b_from_a, inliers: points.agreeing(&b_from_a, search.inlier_px) })
}

/// Samples after which one is all inliers with the probability [`CONFIDENCE`].
fn samples_needed(inlier_ratio: f64) -> usize {
    if inlier_ratio >= 1.0 {
        return 1;
    }
    let needed = (1.0 - CONFIDENCE).ln() / (1.0 - inlier_ratio.powi(SAMPLE as i32)).ln();
    if needed.is_finite() { needed.ceil().max(1.0) as usize } else { usize::MAX }
}

/// Draws samples alternately from all matches and from a pool of the most distinctive that grows to all of them.
///
/// # Departures
/// PROSAC draws from the pool only; the samples from all matches guard against distinctive matches that agree on
/// something else.
struct ProgressivePool {
    count: usize,
    samples: usize,
    drawn: usize,
}

impl ProgressivePool {
    /// Matches in the first pool.
    const FIRST: usize = 12;

    fn new(count: usize, samples: usize) -> Self {
        Self { count, samples, drawn: 0 }
    }

    fn draw(&mut self, generator: &mut impl Rng) -> [usize; SAMPLE] {
        self.drawn += 1;
        let mut size = self.count;
        if self.drawn.is_multiple_of(2) {
            // The number of samples from the best n matches grows as n^4 (PROSAC, equation 3).
            let progress = (self.drawn as f64 / self.samples as f64).powf(1.0 / SAMPLE as f64);
            size = ((progress * self.count as f64) as usize).clamp(Self::FIRST.min(self.count), self.count);
        }
        different_indices(size, generator)
    }
}

/// `N` different indices below `count`, which is at least as large.
pub(super) fn different_indices<const N: usize>(count: usize, generator: &mut impl Rng) -> [usize; N] {
    let mut indices = [usize::MAX; N];
    for k in 0..N {
        indices[k] = loop {
            let index = generator.random_range(0..count);
            if !indices[..k].contains(&index) {
                break index;
            }
        };
    }
    indices
}

/// The homography through four matches; `None` if three points are collinear or the map would turn a triangle over.
///
/// # Source
/// The projective basis of four points: Hartley and Zisserman, Multiple View Geometry, section 2.3; that all four
/// triangles keep their orientation is the condition that no point crosses the horizon.
fn through_sample(points: &MatchedPoints, sample: &[usize; SAMPLE]) -> Option<Homography> {
    let (a, b) = (sample.map(|k| points.in_a[k]), sample.map(|k| points.in_b[k]));
    let (areas_a, areas_b) = (triangle_areas(&a), triangle_areas(&b));
    let kept = |(&a, &b): (&f64, &f64)| a * b > 0.0 && a.abs() >= MIN_TRIANGLE_PX2 && b.abs() >= MIN_TRIANGLE_PX2;
    if !areas_a.iter().zip(&areas_b).all(kept) {
        return None;
    }
    let basis_a_inverse = basis(&a, &areas_a).try_inverse()?;
    let matrix = basis(&b, &areas_b) * basis_a_inverse;
    let homography = Homography(matrix / matrix.amax());
    let sign = homography.denominator(a[0]).signum();
    let signed = Homography(homography.0 * sign);
    signed.0.iter().all(|entry| entry.is_finite()).then_some(signed)
}

/// Twice the signed areas of the triangles (1 2 3), (4 2 3), (1 4 3), (1 2 4).
fn triangle_areas(p: &[Vector2<f64>; SAMPLE]) -> [f64; SAMPLE] {
    let area = |i: usize, j: usize, k: usize| (p[j] - p[i]).perp(&(p[k] - p[i]));
    [area(0, 1, 2), area(3, 1, 2), area(0, 3, 2), area(0, 1, 3)]
}

/// The matrix that maps the unit vectors to the first three points and (1, 1, 1) to the fourth.
fn basis(p: &[Vector2<f64>; SAMPLE], areas: &[f64; SAMPLE]) -> Matrix3<f64> {
    Matrix3::from_columns(&std::array::from_fn::<_, 3, _>(|k| p[k].push(1.0) * (areas[k + 1] / areas[0])))
}

/// Sum over the matches of min(1, error^2 / inlier_px^2); `None` once it reaches `bound`.
fn truncated_cost(points: &MatchedPoints, hypothesis: &Homography, inlier_px: f64, bound: f64) -> Option<f64> {
    let scale = inlier_px.powi(2).recip();
    let mut cost = 0.0;
    for (a, b) in points.in_a.chunks(BATCH).zip(points.in_b.chunks(BATCH)) {
        let errors = a.iter().zip(b).map(|(&a, &b)| (squared_error(&hypothesis.0, a, b) * scale).min(1.0));
        cost += errors.sum::<f64>();
        if cost >= bound {
            return None;
        }
    }
    Some(cost)
}

#[cfg(test)]
mod tests;
