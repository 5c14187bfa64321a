//! Relative scales of the photographs from the extent of their matches.

use geo::{ConvexHull, Coord, Euclidean, Length, LineString, MultiPoint, Point};
use nalgebra::{DMatrix, DVector};
use trueup_core::matches::PairMatches;

use super::printed::PrintedEquations;

/// Perimeter below which a hull says nothing of the scale, working pixels.
const MIN_PERIMETER_PX: f64 = 20.0;
/// Weight of an edge without a usable hull, which is taken to keep the scale.
const WEAK_WEIGHT: f64 = 0.1;
/// Scales outside are not believed.
const BELIEVABLE: std::ops::RangeInclusive<f64> = 0.2..=5.0;

/// One scale per photograph, of mean 1: what makes matched regions the same size.
///
/// Falls back to the inverse focal lengths (of mean 1) when the hulls yield a scale outside 0.2 to 5.
///
/// # Source
/// The paper's eq. 10 and 11: eta_ij = perimeter of the hull in i over that in j.
///
/// # Departures
/// The printed constraint eta_ij s_j = s_i scales the wrong way round: a photograph in which the matches span more must
/// shrink, s_j = eta_ij s_i. Rows are divided by sqrt(eta_ij), so that the order of a pair does not matter.
/// [`PrintedEquations::scale`] has the constraint as it is printed, divided by nothing.
pub(super) fn scales(edges: &[PairMatches], focals: &[f64], printed: PrintedEquations) -> Vec<f64> {
    let count = focals.len();
    hull_scales(edges, count, if printed.scale { printed_row } else { corrected_row })
        .filter(|scales| scales.iter().all(|scale| BELIEVABLE.contains(scale)))
        .unwrap_or_else(|| focal_scales(focals))
}

/// s_i proportional to 1 / f_i, of mean 1.
///
/// # Source
/// The scales of the global similarity prior, s_i = f_r / f_i.
///
/// # Departures
/// Divided by their mean, as all priors' scales are: the reference does not matter, and the mesh has the working
/// photographs' size.
pub(super) fn focal_scales(focals: &[f64]) -> Vec<f64> {
    let inverse: f64 = focals.iter().map(|focal| 1.0 / focal).sum();
    let mean = inverse / focals.len() as f64;
    focals.iter().map(|focal| if mean > 0.0 && mean.is_finite() { 1.0 / focal / mean } else { 1.0 }).collect()
}

/// One row (a s_i - b s_j) of the least squares.
struct ScaleRow {
    a: f64,
    b: f64,
}

/// eta_ij s_i = s_j, divided by sqrt(eta_ij).
fn corrected_row(eta: f64) -> ScaleRow {
    ScaleRow { a: eta.sqrt(), b: 1.0 / eta.sqrt() }
}

/// s_i = eta_ij s_j, eq. 11 as printed.
fn printed_row(eta: f64) -> ScaleRow {
    ScaleRow { a: 1.0, b: eta }
}

/// Minimizes sum w (a s_i - b s_j)^2 subject to sum s_i = N, a and b of `row` by the pair's eta.
fn hull_scales(edges: &[PairMatches], count: usize, row: fn(f64) -> ScaleRow) -> Option<Vec<f64>> {
    let mut system = DMatrix::<f64>::zeros(count + 1, count + 1);
    for edge in edges {
        let (eta, weight) = perimeter_ratio(edge).map_or((1.0, WEAK_WEIGHT), |eta| (eta, 1.0));
        let (i, j) = (edge.a, edge.b);
        let ScaleRow { a, b } = row(eta);
        system[(i, i)] += 2.0 * weight * a * a;
        system[(j, j)] += 2.0 * weight * b * b;
        system[(i, j)] -= 2.0 * weight * a * b;
        system[(j, i)] -= 2.0 * weight * a * b;
    }
    for index in 0..count {
        system[(index, count)] = 1.0;
        system[(count, index)] = 1.0;
    }
    let mut right = DVector::<f64>::zeros(count + 1);
    right[count] = count as f64;
    let solution = system.lu().solve(&right)?;
    Some(solution.iter().take(count).copied().collect())
}

/// Perimeter of the hull of the matches in photograph a over that in photograph b; `None` if either is too small.
fn perimeter_ratio(edge: &PairMatches) -> Option<f64> {
    let in_a = hull_perimeter(edge.inliers.iter().map(|point| point.in_a))?;
    let in_b = hull_perimeter(edge.inliers.iter().map(|point| point.in_b))?;
    Some(in_a / in_b)
}

fn hull_perimeter(points: impl Iterator<Item = [f64; 2]>) -> Option<f64> {
    let finite = points.filter(|point| point.iter().all(|value| value.is_finite()));
    let points: Vec<Point<f64>> = finite.map(|[x, y]| Point(Coord { x, y })).collect();
    if points.len() < 3 {
        return None;
    }
    let hull = MultiPoint(points).convex_hull();
    let outline: &LineString<f64> = hull.exterior();
    let perimeter = Euclidean.length(outline);
    (perimeter >= MIN_PERIMETER_PX).then_some(perimeter)
}
