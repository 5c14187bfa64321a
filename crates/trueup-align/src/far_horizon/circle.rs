//! A circle of directions through edges: the plane of the horizon and how far below level it lies.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::geometry::{orthonormal_complement, tangent_basis, wrap_angle};
use trueup_core::statistics::greatest_deviation;

use super::edges::SkyEdge;

/// Curves that circles are laid through, the longest.
const MOST_CURVES: usize = 30;
/// Fewest degrees of azimuth that edges take of a circle that is fitted: half of what a horizon must have.
const FEWEST_STEPS: usize = 20;
/// Circles that are looked at closely.
const MOST_CIRCLES: usize = 6;
/// Farthest that a circle's vertical may lie from the expected one, radians (25 degrees).
const MAX_TILT: f64 = 0.44;
/// Verticals nearer than this are one, radians (half a degree).
const SAME: f64 = 0.0087;
/// Farthest that an edge may lie from a circle that is tried, radians (0.4 degrees): the horizon dips by as much from a
/// cliff of 150 m.
const NEAR_TRIED: f64 = 0.007;
/// The same of the circle that is fitted (0.3 degrees): low shores.
const NEAR: f64 = 0.0052;
/// Scale of the fit's residuals beyond which edges lose influence, radians (0.1 degrees).
const SCALE: f64 = 0.0017;
/// Rounds of the reweighted fit.
const ROUNDS: usize = 10;
/// Dip that is expected, radians (0.08 degrees): from 6 m over the sea, sqrt(2 h / R).
const EXPECTED_DIP: f64 = 0.0014;
/// Its standard deviation, radians (0.12 degrees): eyes are 2 to 100 m above sea or plain, and plains end in low rises.
const DIP_DEVIATION: f64 = 0.0021;
/// Azimuth over which shores and what cameras err by are alike, radians (10 degrees).
const CELL: f64 = 0.1745;
/// Standard deviation of a cell that is expected, radians (0.08 degrees), before the cells show their own.
const CELL_DEVIATION: f64 = 0.0014;
/// How many cells that expectation counts for.
const EXPECTED_CELLS: f64 = 4.0;
/// Neighboring cells that err alike: shores and ridges rise and fall over tens of degrees.
const ALIKE_CELLS: f64 = 4.0;
/// What a whole side of the horizon errs by alike, radians about every axis (0.1 degrees): land beyond the water,
/// plains that slope.
const COMMON_DEVIATION: f64 = 0.0017;
/// Two angles and a dip are fitted.
const FITTED: f64 = 3.0;
/// Steps of azimuth in which edges are counted: a degree.
pub(super) const STEPS: usize = 360;

/// A horizon: all directions d with d . down = sin(dip).
#[derive(Debug, Clone)]
pub(super) struct HorizonCircle {
    pub(super) down: Vector3<f64>,
    pub(super) dip: f64,
    /// Mean residuals of the cells of azimuth: direction, and how far below the circle its edges lie, radians.
    cells: Vec<(Vector3<f64>, f64)>,
}

/// The circles that most of the edges lie on, those with most azimuth first.
pub(super) fn through(edges: &[SkyEdge], expected: &Vector3<f64>) -> Vec<HorizonCircle> {
    let curves = longest_curves(edges);
    // Among verticals so near to one another it hardly matters about which of them azimuth is counted.
    let steps: Vec<Vec<usize>> = edges.iter().map(|edge| steps_of(edge, expected)).collect();
    let pairs: Vec<[&[SkyEdge]; 2]> =
        curves.iter().enumerate().flat_map(|(k, one)| curves[..=k].iter().map(|other| [*one, *other])).collect();
    let near = sines(0.0, NEAR_TRIED);
    let covered_by = |pair: &[&[SkyEdge]; 2]| {
        let down = plane_through(pair, expected).filter(|down| down.angle(expected) <= MAX_TILT)?;
        let mut covered = [false; STEPS];
        for (_, steps) in edges.iter().zip(&steps).filter(|(edge, _)| is_near(edge, &down, &near)) {
            steps.iter().for_each(|&step| covered[step] = true);
        }
        let covered = covered.iter().filter(|&&step| step).count();
        (covered >= FEWEST_STEPS).then_some((covered, down))
    };
    let mut tried: Vec<(usize, Vector3<f64>)> = pairs.par_iter().filter_map(covered_by).collect();
    tried.sort_by_key(|one| std::cmp::Reverse(one.0));
    let mut circles: Vec<HorizonCircle> = Vec::new();
    for (_, down) in tried {
        if circles.len() == MOST_CIRCLES {
            break;
        }
        if circles.iter().any(|circle| circle.down.angle(&down) < SAME) {
            continue;
        }
        let fitted = HorizonCircle::fitted(edges, down);
        circles.extend(fitted.filter(|new| circles.iter().all(|circle| circle.down.angle(&new.down) >= SAME)));
    }
    circles
}

/// The parts of the longest curves, longest first; those of a curve follow one another in `edges`.
fn longest_curves(edges: &[SkyEdge]) -> Vec<&[SkyEdge]> {
    let curves = edges.chunk_by(|one, next| (one.photograph, one.curve) == (next.photograph, next.curve));
    let with_length = |curve| (length_of(curve), curve);
    let mut curves: Vec<(f64, &[SkyEdge])> = curves.map(with_length).collect();
    curves.sort_by(|one, other| other.0.total_cmp(&one.0));
    curves.into_iter().map(|(_, curve)| curve).take(MOST_CURVES).collect()
}

/// Length of a curve's parts, radians.
fn length_of(curve: &[SkyEdge]) -> f64 {
    curve.iter().map(SkyEdge::length).sum()
}

/// The normal of the plane nearest to edges, on the side of `expected`.
fn plane_through(curves: &[&[SkyEdge]; 2], expected: &Vector3<f64>) -> Option<Vector3<f64>> {
    let moment: Matrix3<f64> = curves
        .iter()
        .flat_map(|curve| curve.iter())
        .flat_map(|edge| edge.ends.iter().map(move |end| end * end.transpose() * edge.length()))
        .sum();
    let eigen = moment.symmetric_eigen();
    let normal: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let normal = normal.try_normalize(f64::EPSILON)?;
    Some(if normal.dot(expected) > 0.0 { normal } else { -normal })
}

/// Sines of how far below level directions lie that are within `near` of a circle.
fn sines(dip: f64, near: f64) -> RangeInclusive<f64> {
    (dip - near).sin()..=(dip + near).sin()
}

/// Whether both ends of an edge lie so far below the level of `down`.
fn is_near(edge: &SkyEdge, down: &Vector3<f64>, sines: &RangeInclusive<f64>) -> bool {
    edge.ends.iter().all(|end| sines.contains(&end.dot(down)))
}

/// The edges that lie within `near` of a circle.
fn on_circle<'a>(
    edges: &'a [SkyEdge],
    down: &'a Vector3<f64>,
    dip: f64,
    near: f64,
) -> impl Iterator<Item = &'a SkyEdge> {
    let near = sines(dip, near);
    edges.iter().filter(move |edge| is_near(edge, down, &near))
}

/// Which degrees of azimuth about `down` edges near a circle take.
fn steps_covered(edges: &[SkyEdge], down: &Vector3<f64>, dip: f64, near: f64) -> [bool; STEPS] {
    let mut covered = [false; STEPS];
    for edge in on_circle(edges, down, dip, near) {
        cover(edge, down, &mut covered);
    }
    covered
}

/// Marks the degrees of azimuth that an edge takes.
pub(super) fn cover(edge: &SkyEdge, down: &Vector3<f64>, covered: &mut [bool; STEPS]) {
    steps_of(edge, down).into_iter().for_each(|step| covered[step] = true);
}

/// The degrees of azimuth about `down` that an edge takes.
fn steps_of(edge: &SkyEdge, down: &Vector3<f64>) -> Vec<usize> {
    let [start, end] = edge.ends.map(|end| azimuth(&end, down));
    let turn = wrap_angle(end - start);
    let pieces = (turn.abs() / TAU * STEPS as f64).ceil().max(1.0) as usize;
    (0..=pieces).map(|piece| step_of(start + turn * piece as f64 / pieces as f64)).collect()
}

/// Azimuth of a direction about `down`, radians from a direction that depends on `down` alone.
fn azimuth(direction: &Vector3<f64>, down: &Vector3<f64>) -> f64 {
    let (first, second) = orthonormal_complement(down);
    direction.dot(&second).atan2(direction.dot(&first))
}

fn step_of(azimuth: f64) -> usize {
    ((azimuth / TAU).rem_euclid(1.0) * STEPS as f64) as usize % STEPS
}

impl HorizonCircle {
    /// The circle nearest to the edges about the level of `down`; `None` where they leave it open.
    fn fitted(edges: &[SkyEdge], down: Vector3<f64>) -> Option<Self> {
        let (mut down, mut dip) = (down, 0.0);
        for round in 0..ROUNDS {
            let near = if round < ROUNDS / 2 { NEAR_TRIED } else { NEAR };
            let basis = tangent_basis(&down);
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for edge in on_circle(edges, &down, dip, near) {
                let middle = edge.middle();
                let off = middle.dot(&down).asin() - dip;
                let weight = edge.length() / CELL / (1.0 + (off / SCALE).powi(2)).powi(2);
                let row = derivative(&middle, &basis);
                normal += row * row.transpose() * weight;
                right += row * (weight * off);
            }
            normal[(2, 2)] += (CELL_DEVIATION / DIP_DEVIATION).powi(2);
            right[2] -= (CELL_DEVIATION / DIP_DEVIATION).powi(2) * (EXPECTED_DIP - dip);
            let step = normal.cholesky()?.solve(&right);
            down = (down - basis * step.xy()).try_normalize(f64::EPSILON)?;
            dip -= step.z;
        }
        let cells = cells(edges, &down, dip);
        (down.iter().all(|part| part.is_finite()) && !cells.is_empty()).then_some(Self { down, dip, cells })
    }

    /// Standard deviation of a cell, radians.
    fn scatter(&self) -> f64 {
        let squares: f64 = self.cells.iter().map(|(_, off)| off * off).sum();
        let free = (self.cells.len() as f64 - FITTED).max(0.0);
        ((squares + EXPECTED_CELLS * CELL_DEVIATION.powi(2)) / (free + EXPECTED_CELLS)).sqrt()
    }

    /// What the circle tells of the vertical, whatever its dip, rad^-2.
    pub(super) fn information(&self) -> Matrix3<f64> {
        let basis = tangent_basis(&self.down);
        let variance = ALIKE_CELLS * self.scatter().powi(2);
        let mut normal: Matrix3<f64> = Matrix3::zeros();
        for (direction, _) in &self.cells {
            let row = derivative(direction, &basis);
            normal += row * row.transpose() / variance;
        }
        normal[(2, 2)] += DIP_DEVIATION.powi(-2);
        // The dip is eliminated.
        let beside = Vector2::new(normal[(0, 2)], normal[(1, 2)]);
        let of_turns = normal.fixed_view::<2, 2>(0, 0) - beside * beside.transpose() / normal[(2, 2)];
        // (covariance + common)^-1, of a circle that leaves an axis open, too.
        let with_common = (Matrix2::identity() + of_turns * COMMON_DEVIATION.powi(2)).try_inverse().unwrap_or_default();
        basis * (with_common * of_turns) * basis.transpose()
    }

    /// Standard deviation in radians of the vertical, about the axis that the circle tells least of.
    pub(super) fn deviation(&self) -> f64 {
        let basis = tangent_basis(&self.down);
        greatest_deviation(&basis.tr_mul(&(self.information() * basis)))
    }

    /// The directions of the circle, one for each degree of azimuth.
    pub(super) fn directions(&self) -> impl Iterator<Item = Vector3<f64>> {
        let (first, second) = orthonormal_complement(&self.down);
        let (sine, cosine) = self.dip.sin_cos();
        let down = self.down;
        (0..STEPS).map(move |step| {
            let azimuth = (step as f64 + 0.5) / STEPS as f64 * TAU;
            (first * azimuth.cos() + second * azimuth.sin()) * cosine + down * sine
        })
    }

    /// The edges that lie on it.
    pub(super) fn edges<'a>(&'a self, edges: &'a [SkyEdge]) -> impl Iterator<Item = &'a SkyEdge> {
        on_circle(edges, &self.down, self.dip, NEAR)
    }
}

/// How the angle of a direction below the circle changes with turns of down along `basis`, and with the dip.
fn derivative(direction: &Vector3<f64>, basis: &Matrix3x2<f64>) -> Vector3<f64> {
    let turns = basis.tr_mul(direction);
    Vector3::new(turns.x, turns.y, -1.0)
}

/// Mean residuals of the cells of azimuth that edges take at least half of.
fn cells(edges: &[SkyEdge], down: &Vector3<f64>, dip: f64) -> Vec<(Vector3<f64>, f64)> {
    let count = (TAU / CELL).round() as usize;
    let steps = STEPS / count;
    let covered = steps_covered(edges, down, dip, NEAR);
    let mut sums = vec![(Vector3::zeros(), 0.0, 0.0); count];
    for edge in on_circle(edges, down, dip, NEAR) {
        let middle = edge.middle();
        let sum = &mut sums[step_of(azimuth(&middle, down)) / steps % count];
        let length = edge.length();
        sum.0 += middle * length;
        sum.1 += length * (middle.dot(down).asin() - dip);
        sum.2 += length;
    }
    let half_covered =
        |cell: usize| 2 * covered[cell * steps..(cell + 1) * steps].iter().filter(|&&step| step).count() >= steps;
    let cells = sums.into_iter().enumerate().filter(|(cell, sum)| sum.2 > 0.0 && half_covered(*cell));
    cells.map(|(_, (direction, off, length))| (direction.normalize(), off / length)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Edges of a degree each, `dip` below level, over azimuths `from` to `to` in degrees about y.
    fn horizon(dip: f64, from: usize, to: usize) -> Vec<SkyEdge> {
        let direction = |degree: usize| {
            let azimuth = (degree as f64).to_radians();
            Vector3::new(azimuth.sin() * dip.cos(), dip.sin(), azimuth.cos() * dip.cos())
        };
        let edge = |degree: usize| SkyEdge {
            photograph: degree / 40,
            curve: 0,
            ends: [direction(degree), direction(degree + 1)],
            jump: 50.0,
            sky: Vector3::repeat(200.0),
        };
        (from..to).map(edge).collect()
    }

    /// All round the dip is told from the vertical. Of 36 cells each axis sees the squares of 36 cosines, 18; none is
    /// off, so that their variance is what four expected ones leave of 33 + 4; four neighbors err alike.
    #[test]
    fn all_round_the_dip_is_known_apart_from_the_vertical() {
        let edges = horizon(0.004, 0, 360);
        let circle = HorizonCircle::fitted(&edges, Vector3::y()).expect("a circle");
        assert!(circle.down.angle(&Vector3::y()) < 1e-6, "{}", circle.down);
        assert!((circle.dip - 0.004).abs() < 1e-4, "{}", circle.dip);
        let of_cells = 4.0 * CELL_DEVIATION.powi(2) * 4.0 / 37.0 / 18.0;
        let expected = (of_cells + COMMON_DEVIATION.powi(2)).sqrt();
        assert!((circle.deviation() - expected).abs() < 0.02 * expected, "{} and {expected}", circle.deviation());
    }

    /// Over 60 degrees a dip looks like a pitch: the vertical is off by what the dip is beyond the expected one, which
    /// its deviation knows.
    #[test]
    fn over_a_narrow_view_a_dip_is_a_pitch() {
        let edges = horizon(0.004, 0, 60);
        let circle = HorizonCircle::fitted(&edges, Vector3::y()).expect("a circle");
        let off = circle.down.angle(&Vector3::y());
        assert!(off > 0.001 && off < 2.0 * circle.deviation(), "{off}");
        assert!(circle.deviation() > DIP_DEVIATION);
    }

    #[test]
    fn circles_are_ordered_by_the_azimuth_that_edges_take() {
        let tilt = trueup_core::geometry::rotation_about_x(0.1);
        let mut edges = horizon(0.0, 0, 100);
        edges.extend(horizon(0.0, 200, 250).into_iter().map(|edge| SkyEdge {
            photograph: edge.photograph + 10,
            ends: edge.ends.map(|end| tilt * end),
            ..edge
        }));
        let circles = through(&edges, &Vector3::y());
        assert!(circles[0].down.angle(&Vector3::y()) < 0.002, "{}", circles[0].down);
        assert!(circles.iter().any(|circle| circle.down.angle(&(tilt * Vector3::y())) < 0.002));
        assert!(through(&[], &Vector3::y()).is_empty());
    }
}
