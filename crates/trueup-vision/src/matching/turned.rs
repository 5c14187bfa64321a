//! Matches verified on rays: two photographs by one lens that only turned, where no homography holds.
//!
//! The focal length, in sides of the photographs, which may differ in size, and two radial terms are unknown. Lenses
//! are tried one after the other, from pinholes to fisheyes; under each, two matches give the turn. The best are
//! refined on all matches that agree.
//!
//! # Source
//! Brown, Hartley and Nistér, "Minimal solutions for panoramic stitching" (2007): two matches suffice for a turn, and
//! their angle tells whether the lens is right; the cost is MSAC's (Torr and Zisserman, MLESAC, section 4).
//!
//! # Departures
//! The lens is taken from a list in place of the roots of a polynomial in three matches: the matches of a pair hardly
//! tell two neighbors of the list apart, every match judges every lens, and fisheyes need no equation of their own.
//! What the user told of the lenses is not tried otherwise, and kept: of a lens that is told wholly the turn alone is
//! unknown, but for a little of the focal length.

use nalgebra::{Matrix2, Matrix3, Matrix6, SMatrix, Vector2, Vector3, Vector6};
use rand::{Rng, RngExt};
use trueup_core::camera::{Camera, INTRINSICS};
use trueup_core::geometry::{exp_rotation, nearest_rotation};
use trueup_core::lens::Lens;
use trueup_core::source::WorkingFrame;
use trueup_core::told_lens::{TOLD_FOCAL_SD, ToldLens, tried_cameras};

use super::matched_points::MatchedPoints;

/// Turns drawn under each lens at least; a third of right matches gives a right turn with a probability of 99.9 %.
const SAMPLES: usize = 60;
/// Turns drawn under a lens at most; a tenth of right matches gives a right turn with a probability of 99.8 %.
const MOST_SAMPLES: usize = 600;
/// Turns drawn under all lenses, as far as the two bounds allow: where lenses are told, fewer are tried, and each with
/// more turns.
const SAMPLES_IN_ALL: usize = 2400;
/// Lenses that are refined, the best of those tried.
const REFINED: usize = 3;
/// Errors count up to this many times the threshold while a listed lens is judged: it is never quite right.
const ROUGH: f64 = 3.0;
/// Steps of a refinement.
const STEPS: usize = 15;
/// Smallest angle between the two rays of a sample, radians.
const LEAST_ANGLE: f64 = 0.05;
/// By how much the multiple of the threshold within which matches take part in a refinement shrinks in a step, until it
/// is 1.
const SHRINKING: f64 = 0.25;
/// Largest change of the focal length's logarithm in a step.
const LARGEST_FOCAL_STEP: f64 = 0.2;
/// Largest change of a radial term in a step.
const LARGEST_RADIAL_STEP: f64 = 0.1;
/// Keeps the normal matrix positive where no match takes part.
const RIDGE: f64 = 1e-9;
/// Pull of the radial terms towards the listed ones, as a standard deviation.
const RADIAL_SD: f64 = 0.2;
/// Smallest spread of the agreeing matches across the line they lie along best, in diagonals, one standard deviation:
/// what lies on one line agrees with many lenses and many turns.
const LEAST_SPREAD: f64 = 0.02;
/// Share of the wanted matches that has to agree roughly with a listed lens for it to be refined. Photographs that have
/// nothing in common stay far below.
const WORTH_REFINING: f64 = 0.5;
/// Matches that a lens is judged by at most.
const JUDGING: usize = 400;

/// Two photographs of one lens that turned between them.
#[derive(Debug, Clone, Copy)]
pub(super) struct TurnedLens {
    /// The lens on photograph a, unturned.
    pub(super) a: Camera,
    /// The lens on photograph b, whose world is the frame of a.
    pub(super) b: Camera,
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

    /// Refined on the matches within shrinking multiples of `inlier_px`: the turn, and of the focal length and of k1,
    /// k2 what is `free`.
    fn refined(mut self, points: &MatchedPoints, free: &FreeIntrinsics, inlier_px: f64) -> Self {
        let start = self;
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
                let by_lens_of_a = arriving.by_bearing * b_from_a * by_pixel * leaving.by_intrinsics;
                let mut jacobian = nalgebra::Matrix2x6::<f64>::zeros();
                jacobian.fixed_columns_mut::<3>(0).copy_from(&by_turn);
                let by_free = free.of(0, &by_lens_of_a) - free.of(1, &arriving.by_intrinsics);
                jacobian.fixed_columns_mut::<3>(3).copy_from(&by_free);
                normal += jacobian.transpose() * jacobian;
                gradient += jacobian.transpose() * residual;
            }
            for (column, (change, sd)) in free.changes(&self, &start).into_iter().enumerate() {
                let weight = (inlier_px / sd).powi(2);
                normal[(3 + column, 3 + column)] += weight;
                gradient[3 + column] += weight * change;
            }
            let Some(change) = normal.cholesky().map(|factor| -factor.solve(&gradient)) else { break };
            let turn: Vector3<f64> = change.fixed_rows::<3>(0).into_owned();
            free.change(&mut self, &change.fixed_rows::<3>(3).into_owned());
            self.b.set_rotation(&nearest_rotation(&(exp_rotation(&turn) * b_from_a)));
        }
        self
    }
}

/// What a refinement may change of the lenses on two photographs, of both alike: the focal length's logarithm, k1 and
/// k2.
#[derive(Debug, Clone, Copy)]
struct FreeIntrinsics {
    /// Whose focal length.
    focal: [bool; 2],
    /// Standard deviation of its logarithm from where it starts; infinite where nothing is told.
    focal_sd: f64,
    /// Whose radial terms.
    radial: [bool; 2],
}

impl FreeIntrinsics {
    /// What is not told; where both focal lengths are, they may change a little, in common.
    fn beside(told: [&ToldLens; 2]) -> Self {
        let focal = told.map(|told| told.focal_px.is_none());
        let are_told = focal == [false; 2];
        Self {
            focal: if are_told { [true; 2] } else { focal },
            focal_sd: if are_told { TOLD_FOCAL_SD } else { f64::INFINITY },
            radial: told.map(|told| told.lens.is_none()),
        }
    }

    /// Derivatives by what is free, of those by all intrinsics of the first photograph (0) or the second (1).
    fn of(&self, photograph: usize, by_intrinsics: &SMatrix<f64, 2, INTRINSICS>) -> SMatrix<f64, 2, 3> {
        const FOCAL: usize = 0;
        const RADIAL: usize = 3;
        let column = |is_free: bool, intrinsic: usize| match is_free {
            true => by_intrinsics.column(intrinsic).into_owned(),
            false => Vector2::zeros(),
        };
        let (focal, radial) = (self.focal[photograph], self.radial[photograph]);
        SMatrix::from_columns(&[column(focal, FOCAL), column(radial, RADIAL), column(radial, RADIAL + 1)])
    }

    /// How far each has come from `start`, and the standard deviation of that.
    fn changes(&self, now: &TurnedLens, start: &TurnedLens) -> [(f64, f64); 3] {
        let of_both = |turned: &TurnedLens| [turned.a, turned.b];
        let (now, start) = (of_both(now), of_both(start));
        let zoomed = usize::from(!self.focal[0]);
        let bent = usize::from(!self.radial[0]);
        let radial = |term: usize| now[bent].lens.terms().radial[term] - start[bent].lens.terms().radial[term];
        let longer = (now[zoomed].focal_px / start[zoomed].focal_px).ln();
        [(longer, self.focal_sd), (radial(0), RADIAL_SD), (radial(1), RADIAL_SD)]
    }

    /// Takes a step, if it is too large a shorter one.
    fn change(&self, turned: &mut TurnedLens, step: &Vector3<f64>) {
        let longer = step[0].clamp(-LARGEST_FOCAL_STEP, LARGEST_FOCAL_STEP).exp();
        for (photograph, camera) in [&mut turned.a, &mut turned.b].into_iter().enumerate() {
            if self.focal[photograph] {
                camera.focal_px *= longer;
            }
            if self.radial[photograph] {
                let mut terms = camera.lens.terms();
                terms.radial[0] += step[1].clamp(-LARGEST_RADIAL_STEP, LARGEST_RADIAL_STEP);
                terms.radial[1] += step[2].clamp(-LARGEST_RADIAL_STEP, LARGEST_RADIAL_STEP);
                camera.lens = Lens::new(terms);
            }
        }
    }
}

/// The turned lens that most matches agree with, as far as it is not `told`; `None` if none is found that `wanted`
/// matches agree with.
pub(super) fn find_turned_lens(
    points: &MatchedPoints,
    frames: [&WorkingFrame; 2],
    told: [&ToldLens; 2],
    inlier_px: f64,
    wanted: usize,
    generator: &mut impl Rng,
) -> Option<TurnConsensus> {
    if points.in_a.len() < 2 {
        return None;
    }
    let judging = points.select(&(0..points.in_a.len().min(JUDGING)).collect::<Vec<_>>());
    let listed = tried_cameras(told, frames);
    let samples = (SAMPLES_IN_ALL / listed.len().max(1)).clamp(SAMPLES, MOST_SAMPLES);
    let mut tried: Vec<RoughTurn> = listed
        .into_iter()
        .filter_map(|cameras| RoughSearch::new(&judging, cameras, ROUGH * inlier_px).best(samples, generator))
        .collect();
    tried.sort_by(|one, other| one.cost.total_cmp(&other.cost));
    tried.truncate(REFINED);
    // As many of those that judge as of all.
    let enough = WORTH_REFINING * wanted as f64 * judging.in_a.len() as f64 / points.in_a.len() as f64;
    let worth_it = tried.into_iter().filter(|rough| rough.agreeing as f64 >= enough);
    let free = FreeIntrinsics::beside(told);
    let refined = worth_it.map(|rough| rough.turned.refined(points, &free, inlier_px));
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

    /// The turn of least cost of so many `samples`.
    fn best(&self, samples: usize, generator: &mut impl Rng) -> Option<RoughTurn> {
        let mut best: Option<(f64, Matrix3<f64>)> = None;
        for drawn in 0..samples {
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
