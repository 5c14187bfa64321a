//! Matches verified on rays: two photographs by one lens that only turned, where no homography holds.
//!
//! The focal length, in sides of the photographs, which may differ in size, and two radial terms are unknown. Lenses are tried one after the other, from pinholes to fisheyes; under
//! each, two matches give the turn. The best are refined on all matches that agree.
//!
//! # Source
//! Brown, Hartley and Nistér, "Minimal solutions for panoramic stitching" (2007): two matches suffice for a turn, and their
//! angle tells whether the lens is right; the cost is MSAC's (Torr and Zisserman, MLESAC, section 4).
//!
//! # Departures
//! The lens is taken from a list in place of the roots of a polynomial in three matches: the matches of a pair hardly tell
//! two neighbors of the list apart, every match judges every lens, and fisheyes need no equation of their own.

use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3, Vector6};
use rand::{Rng, RngExt};
use trueup_core::camera::Camera;
use trueup_core::geometry::{exp_rotation, nearest_rotation};
use trueup_core::lens::{Lens, TriedLens, tried_lenses};
use trueup_core::source::WorkingFrame;

use super::matched_points::MatchedPoints;

/// Turns drawn under each lens; a third of right matches gives a right turn with a probability of 99.9 %.
const SAMPLES: usize = 60;
/// Lenses that are refined, the best of those tried.
const REFINED: usize = 3;
/// Errors count up to this many times the threshold while a listed lens is judged: it is never quite right.
const ROUGH: f64 = 3.0;
/// Steps of a refinement.
const STEPS: usize = 15;
/// Smallest angle between the two rays of a sample, radians.
const LEAST_ANGLE: f64 = 0.05;
/// By how much the multiple of the threshold within which matches take part in a refinement shrinks in a step, until it is 1.
const SHRINKING: f64 = 0.25;
/// Largest change of the focal length's logarithm in a step.
const LARGEST_FOCAL_STEP: f64 = 0.2;
/// Largest change of a radial term in a step.
const LARGEST_RADIAL_STEP: f64 = 0.1;
/// Keeps the normal matrix positive where no match takes part.
const RIDGE: f64 = 1e-9;
/// Pull of the radial terms towards the listed ones, as a standard deviation.
const RADIAL_SD: f64 = 0.2;
/// Smallest spread of the agreeing matches across the line they lie along best, in diagonals, one standard deviation: what
/// lies on one line agrees with many lenses and many turns.
const LEAST_SPREAD: f64 = 0.02;
/// Share of the wanted matches that has to agree roughly with a listed lens for it to be refined. Photographs that have nothing
/// in common stay far below.
const WORTH_REFINING: f64 = 0.5;
/// Matches that a lens is judged by at most.
const JUDGING: usize = 400;

/// Two photographs of one lens that turned between them.
#[derive(Debug, Clone, Copy)]
pub(super) struct TurnedLens {
    /// The lens on photograph a, unturned.
    a: Camera,
    /// The lens on photograph b, whose world is the frame of a.
    b: Camera,
}

/// A turned lens and the matches that agree with it.
#[derive(Debug, Clone)]
pub(super) struct TurnConsensus {
    pub(super) turned: TurnedLens,
    /// Indices of the agreeing matches, ascending.
    pub(super) inliers: Vec<usize>,
}

impl TurnedLens {
    /// Where a point of a is in b's pixels.
    pub(super) fn in_b(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        self.a.transfer(&self.b, point)
    }

    /// Where a point of b is in a's pixels.
    pub(super) fn in_a(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        self.b.transfer(&self.a, point)
    }

    fn squared_error(&self, a: Vector2<f64>, b: Vector2<f64>) -> f64 {
        self.in_b(a).map_or(f64::INFINITY, |place| (b - place).norm_squared())
    }

    fn cost(&self, points: &MatchedPoints, limit_px: f64) -> f64 {
        let pairs = points.in_a.iter().zip(&points.in_b);
        pairs.map(|(&a, &b)| (self.squared_error(a, b) / (limit_px * limit_px)).min(1.0)).sum()
    }

    /// Refined on the matches within shrinking multiples of `inlier_px`: the turn, the focal length and k1, k2.
    fn refined(mut self, points: &MatchedPoints, inlier_px: f64) -> Self {
        const FOCAL: usize = 0;
        const RADIAL: usize = 3;
        let start = self.a.lens.terms();
        for step in 0..STEPS {
            let reach_px = inlier_px * (ROUGH - step as f64 * SHRINKING).max(1.0);
            let (mut normal, mut gradient) = (Matrix6::<f64>::identity() * RIDGE, Vector6::<f64>::zeros());
            let b_from_a = self.b.rotation();
            for (&a, &b) in points.in_a.iter().zip(&points.in_b) {
                let bearing = self.a.bearing(a);
                let arrived = b_from_a * bearing;
                let Some(arriving) = self.b.projection_derivatives(arrived) else { continue };
                let residual = b - arriving.pixel;
                if residual.norm() > reach_px {
                    continue;
                }
                let Some(leaving) = self.a.projection_derivatives(bearing) else { continue };
                let Some(by_pixel) = leaving.bearing_by_pixel() else { continue };
                let by_turn = arriving.by_bearing * trueup_core::geometry::cross_matrix(&arrived);
                let by_intrinsics =
                    arriving.by_bearing * b_from_a * by_pixel * leaving.by_intrinsics - arriving.by_intrinsics;
                let mut jacobian = nalgebra::Matrix2x6::<f64>::zeros();
                jacobian.fixed_columns_mut::<3>(0).copy_from(&by_turn);
                jacobian.column_mut(3).copy_from(&by_intrinsics.column(FOCAL));
                jacobian.column_mut(4).copy_from(&by_intrinsics.column(RADIAL));
                jacobian.column_mut(5).copy_from(&by_intrinsics.column(RADIAL + 1));
                normal += jacobian.transpose() * jacobian;
                gradient += jacobian.transpose() * residual;
            }
            let mut terms = self.a.lens.terms();
            for (column, term) in [(4, 0), (5, 1)] {
                normal[(column, column)] += (inlier_px / RADIAL_SD).powi(2);
                gradient[column] += (inlier_px / RADIAL_SD).powi(2) * (terms.radial[term] - start.radial[term]);
            }
            let Some(change) = normal.cholesky().map(|factor| -factor.solve(&gradient)) else { break };
            let turn: Vector3<f64> = change.fixed_rows::<3>(0).into_owned();
            let longer = change[3].clamp(-LARGEST_FOCAL_STEP, LARGEST_FOCAL_STEP).exp();
            terms.radial[0] += change[4].clamp(-LARGEST_RADIAL_STEP, LARGEST_RADIAL_STEP);
            terms.radial[1] += change[5].clamp(-LARGEST_RADIAL_STEP, LARGEST_RADIAL_STEP);
            let lens = Lens::new(terms);
            (self.a.focal_px, self.b.focal_px) = (self.a.focal_px * longer, self.b.focal_px * longer);
            (self.a.lens, self.b.lens) = (lens, lens);
            self.b.set_rotation(&nearest_rotation(&(exp_rotation(&turn) * b_from_a)));
        }
        self
    }
}

/// The turned lens that most matches agree with; `None` if none is found that `wanted` matches agree with.
pub(super) fn find_turned_lens(
    points: &MatchedPoints,
    frames: [&WorkingFrame; 2],
    inlier_px: f64,
    wanted: usize,
    generator: &mut impl Rng,
) -> Option<TurnConsensus> {
    if points.in_a.len() < 2 {
        return None;
    }
    let judging = points.select(&(0..points.in_a.len().min(JUDGING)).collect::<Vec<_>>());
    let mut tried: Vec<RoughTurn> = listed_lenses(frames)
        .into_iter()
        .filter_map(|cameras| RoughSearch::new(&judging, cameras, ROUGH * inlier_px).best(generator))
        .collect();
    tried.sort_by(|one, other| one.cost.total_cmp(&other.cost));
    tried.truncate(REFINED);
    // As many of those that judge as of all.
    let enough = WORTH_REFINING * wanted as f64 * judging.in_a.len() as f64 / points.in_a.len() as f64;
    let worth_it = tried.into_iter().filter(|rough| rough.agreeing as f64 >= enough);
    let refined = worth_it.map(|rough| rough.turned.refined(points, inlier_px));
    let costs = refined.map(|turned| (turned.cost(points, inlier_px), turned));
    let (_, turned) = costs.min_by(|one, other| one.0.total_cmp(&other.0))?;
    let agrees = |&k: &usize| turned.squared_error(points.in_a[k], points.in_b[k]) <= inlier_px * inlier_px;
    let inliers: Vec<usize> = (0..points.in_a.len()).filter(agrees).collect();
    if inliers.len() < wanted {
        return None;
    }
    let agreeing = points.select(&inliers);
    let is_spread =
        |places: &[Vector2<f64>], frame: &WorkingFrame| spread_across(places) >= LEAST_SPREAD * frame.diagonal();
    let [a, b] = frames;
    (is_spread(&agreeing.in_a, a) && is_spread(&agreeing.in_b, b)).then_some(TurnConsensus { turned, inliers })
}

/// Standard deviation of places across the line that they lie along best.
fn spread_across(places: &[Vector2<f64>]) -> f64 {
    let count = places.len().max(1) as f64;
    let center = places.iter().sum::<Vector2<f64>>() / count;
    let moment: Matrix2<f64> = places.iter().map(|place| (place - center) * (place - center).transpose()).sum();
    (moment.symmetric_eigenvalues().min().max(0.0) / count).sqrt()
}

/// The lenses that are tried, each on both photographs: through one lens, a larger copy has a focal length of as many more pixels.
fn listed_lenses(frames: [&WorkingFrame; 2]) -> Vec<[Camera; 2]> {
    let on = |TriedLens { lens, relative_focal }| {
        frames.map(|frame| {
            let focal_px = relative_focal * frame.width.max(frame.height);
            Camera { lens, ..Camera::new(focal_px, frame.width, frame.height, &Matrix3::identity()) }
        })
    };
    tried_lenses().into_iter().map(on).collect()
}

/// The turn of least cost under one lens.
struct RoughTurn {
    cost: f64,
    turned: TurnedLens,
    /// Matches within the limit.
    agreeing: usize,
}

/// The search for a turn under one lens.
struct RoughSearch {
    /// Unturned.
    cameras: [Camera; 2],
    rays_a: Vec<Vector3<f64>>,
    rays_b: Vec<Vector3<f64>>,
    /// Squared pixels per squared radian at the places in b, over the squared limit.
    scales: Vec<f64>,
    /// Largest difference of two angles, radians, that the limit allows.
    angle_limit: f64,
}

impl RoughSearch {
    fn new(points: &MatchedPoints, cameras: [Camera; 2], limit_px: f64) -> Self {
        let [a, b] = &cameras;
        let rays = |camera: &Camera, places: &[Vector2<f64>]| -> Vec<Vector3<f64>> {
            places.iter().map(|&place| camera.bearing(place).normalize()).collect()
        };
        let (rays_a, rays_b) = (rays(a, &points.in_a), rays(b, &points.in_b));
        let scale = |ray: &Vector3<f64>| {
            let derivatives = b.projection_derivatives(*ray);
            let square =
                derivatives.map_or(0.0, |one| (one.by_bearing * one.by_bearing.transpose()).determinant().sqrt());
            square / (limit_px * limit_px)
        };
        let scales = rays_b.iter().map(scale).collect();
        let angle_limit = 2.0 * limit_px / a.focal_px.min(b.focal_px);
        Self { cameras, rays_a, rays_b, scales, angle_limit }
    }

    /// The turn of least cost.
    fn best(&self, generator: &mut impl Rng) -> Option<RoughTurn> {
        let mut best: Option<(f64, Matrix3<f64>)> = None;
        for drawn in 0..SAMPLES {
            // The most distinctive matches come first.
            let pool = if drawn % 2 == 0 { self.rays_a.len() } else { self.rays_a.len().div_ceil(4).max(2) };
            let (i, j) = (generator.random_range(0..pool), generator.random_range(0..pool));
            let Some(turn) = self.turn(i, j) else { continue };
            let bound = best.map_or(f64::INFINITY, |(cost, _)| cost);
            let cost = self.cost(&turn, bound);
            if cost < bound {
                best = Some((cost, turn));
            }
        }
        let (cost, turn) = best?;
        let [a, mut b] = self.cameras;
        b.set_rotation(&turn);
        let agreeing = (0..self.rays_a.len()).filter(|&k| self.error(&turn, k) < 1.0).count();
        Some(RoughTurn { cost, turned: TurnedLens { a, b }, agreeing })
    }

    /// The turn that takes two rays of a onto those of b; `None` if their angles say that it is none.
    fn turn(&self, i: usize, j: usize) -> Option<Matrix3<f64>> {
        let frame = |first: &Vector3<f64>, second: &Vector3<f64>| {
            let middle = (first + second).try_normalize(f64::EPSILON)?;
            let across = (second - first).try_normalize(f64::EPSILON)?;
            Some(Matrix3::from_columns(&[middle, across, middle.cross(&across)]))
        };
        let (of_a, of_b) = (self.rays_a[i].angle(&self.rays_a[j]), self.rays_b[i].angle(&self.rays_b[j]));
        if of_a.min(of_b) < LEAST_ANGLE || (of_a - of_b).abs() > self.angle_limit {
            return None;
        }
        Some(frame(&self.rays_b[i], &self.rays_b[j])? * frame(&self.rays_a[i], &self.rays_a[j])?.transpose())
    }

    /// Squared error of a match, over the squared limit.
    fn error(&self, turn: &Matrix3<f64>, k: usize) -> f64 {
        (turn * self.rays_a[k] - self.rays_b[k]).norm_squared() * self.scales[k]
    }

    fn cost(&self, turn: &Matrix3<f64>, bound: f64) -> f64 {
        let mut cost = 0.0;
        for k in 0..self.rays_a.len() {
            cost += self.error(turn, k).min(1.0);
            if cost >= bound {
                break;
            }
        }
        cost
    }
}

#[cfg(test)]
#[path = "turned_tests.rs"]
mod tests;
