//! Matches found where a verified homography predicts them.

use nalgebra::Vector2;
use trueup_core::geometry::Homography;
use trueup_core::matches::PointMatch;

use super::overlap::PredictedOverlap;
use super::putative::{PutativeMatch, SECOND_SEPARATION_PX};
use super::search::squared_distance;
use super::turned::TurnedLens;
use crate::features::{Descriptor, Features};

/// How far around the predicted place a match and its rivals are sought, in working pixels.
const RADIUS_PX: f64 = 12.0;

/// Largest ratio of the distances to the nearest and the second-nearest point there: the place tells already, so that it
/// may be larger than without a prediction.
const MAX_DISTANCE_RATIO: f64 = 0.9;

/// The part of the inliers, ordered by distance, that a guided match may not exceed.
const DISTANCE_QUANTILE: f64 = 0.9;

/// Where points of a are in b.
#[derive(Debug, Clone)]
pub(super) enum PointMap {
    /// On a plane, or of pinholes that turned.
    Plane(Homography),
    /// Of another lens that turned.
    Turn(Box<TurnedLens>),
}

impl PointMap {
    fn apply(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        match self {
            Self::Plane(b_from_a) => Some(b_from_a.apply(point)),
            Self::Turn(turned) => turned.in_b(point),
        }
    }
}

/// The map that one plane's matches follow.
#[derive(Debug, Clone)]
pub(super) struct PlaneMap {
    /// Where the surroundings of its matches go.
    pub(super) b_from_a: PointMap,
    /// How far a match may lie from there.
    pub(super) inlier_px: f64,
}

/// A joined pair and what is known of it.
pub(super) struct GuidedInput<'a> {
    /// All features of the first photograph.
    pub(super) a: &'a Features,
    /// All features of the second.
    pub(super) b: &'a Features,
    /// The matches found so far.
    pub(super) known: &'a [PutativeMatch],
    /// For every one of them, the index of the plane whose map it follows.
    pub(super) plane_of_known: &'a [usize],
    /// The planes' maps.
    pub(super) planes: &'a [PlaneMap],
    /// The overlap that the global map predicts.
    pub(super) overlap: &'a PredictedOverlap<'a>,
}

/// More matches of a joined pair: points of a that have none yet are sought in b near the place that the map of their
/// nearest match predicts.
///
/// A match is kept if it is within its map's tolerance; nearest of the points of b in [`RADIUS_PX`] by
/// [`MAX_DISTANCE_RATIO`]; no farther than most of the matches already known; and the nearest of those that want the same
/// point of b.
pub(super) fn guided_matches(input: &GuidedInput<'_>) -> Vec<PutativeMatch> {
    let mut distances: Vec<u32> = input.known.iter().map(|known| known.squared_distance).collect();
    distances.sort_unstable();
    let rank = (distances.len() as f64 * DISTANCE_QUANTILE) as usize;
    let Some(&farthest) = distances.get(rank.min(distances.len().saturating_sub(1))) else { return Vec::new() };
    let (mut taken_a, mut taken_b) = (vec![false; input.a.points.len()], vec![false; input.b.points.len()]);
    for known in input.known {
        taken_a[known.point_a] = true;
        taken_b[known.point_b] = true;
    }
    let grid = PointGrid::new(input.b, RADIUS_PX);
    let mut found: Vec<PutativeMatch> = Vec::new();
    for (point_a, point) in input.a.points.iter().enumerate().filter(|&(point_a, _)| !taken_a[point_a]) {
        if input.overlap.point_in_b(point.position.into()).is_none() {
            continue;
        }
        let plane = &input.planes[nearest_plane(point.position, input.known, input.plane_of_known)];
        let Some(predicted) = plane.b_from_a.apply(point.position.into()) else { continue };
        let candidate = nearest_in_reach(input, point_a, predicted, &grid);
        let Some(candidate) = candidate.filter(|candidate| candidate.squared_distance <= farthest) else { continue };
        let error = (Vector2::from(candidate.at.in_b) - predicted).norm();
        if error <= plane.inlier_px && !taken_b[candidate.point_b] {
            found.push(candidate);
        }
    }
    one_per_point_of_b(found)
}

/// The plane of the match nearest in a.
fn nearest_plane(position: [f64; 2], known: &[PutativeMatch], plane_of_known: &[usize]) -> usize {
    let first = plane_of_known.first().copied().unwrap_or(0);
    if plane_of_known.iter().all(|&plane| plane == first) {
        return first;
    }
    let square = |known: &PutativeMatch| (Vector2::from(known.at.in_a) - Vector2::from(position)).norm_squared();
    let nearest = known.iter().zip(plane_of_known).min_by(|(j, _), (k, _)| square(j).total_cmp(&square(k)));
    nearest.map_or(first, |(_, &plane)| plane)
}

/// The point of b that looks most alike near the predicted place, unless another place there looks nearly as alike.
fn nearest_in_reach(
    input: &GuidedInput<'_>,
    point_a: usize,
    predicted: Vector2<f64>,
    grid: &PointGrid,
) -> Option<PutativeMatch> {
    let (a, b) = (input.a, input.b);
    let candidates: Vec<(u32, usize)> =
        grid.near(b, predicted, RADIUS_PX).map(|point_b| (point_distance(a, point_a, b, point_b), point_b)).collect();
    let &(squared_distance, point_b) = candidates.iter().min()?;
    let place = b.points[point_b].position;
    let elsewhere = |&&(_, point): &&(u32, usize)| {
        let [x, y] = b.points[point].position;
        (x - place[0]).hypot(y - place[1]) > SECOND_SEPARATION_PX
    };
    let second = candidates.iter().filter(elsewhere).map(|&(distance, _)| distance).min();
    let ratio = second.map_or(0.0, |second| (f64::from(squared_distance) / f64::from(second.max(1))).sqrt());
    let at = PointMatch { in_a: a.points[point_a].position, in_b: place };
    (ratio <= MAX_DISTANCE_RATIO).then_some(PutativeMatch { point_a, point_b, squared_distance, ratio, at })
}

/// The smallest squared distance over the points' descriptors.
fn point_distance(a: &Features, point_a: usize, b: &Features, point_b: usize) -> u32 {
    let (of_a, of_b) = (descriptors(a, point_a), descriptors(b, point_b));
    of_a.iter().flat_map(|x| of_b.iter().map(move |y| squared_distance(x, y))).min().unwrap_or(u32::MAX)
}

fn descriptors(features: &Features, point: usize) -> &[Descriptor] {
    let start = features.descriptor_points.partition_point(|&owner| (owner as usize) < point);
    let end = features.descriptor_points.partition_point(|&owner| (owner as usize) <= point);
    &features.descriptors[start..end]
}

/// Of the matches that share a point of b, the nearest; the order of the points of a stays.
fn one_per_point_of_b(mut found: Vec<PutativeMatch>) -> Vec<PutativeMatch> {
    found.sort_by_key(|candidate| (candidate.point_b, candidate.squared_distance, candidate.point_a));
    found.dedup_by_key(|candidate| candidate.point_b);
    found.sort_by_key(|candidate| candidate.point_a);
    found
}

/// The points of a photograph by square cells.
struct PointGrid {
    cell_px: f64,
    origin: Vector2<f64>,
    columns: usize,
    rows: usize,
    /// Where each cell's points start in `points`.
    starts: Vec<usize>,
    points: Vec<usize>,
}

impl PointGrid {
    /// Cells on a side at most, whatever the positions.
    const MAX_CELLS: f64 = 1024.0;

    fn new(features: &Features, cell_px: f64) -> Self {
        let positions = || features.points.iter().map(|point| Vector2::from(point.position));
        let low = positions().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let high = positions().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let cell_px = cell_px.max((high - low).amax() / Self::MAX_CELLS);
        let cells = |length: f64| (length / cell_px) as usize + 1;
        let mut grid = Self {
            cell_px,
            origin: low,
            columns: cells(high.x - low.x),
            rows: cells(high.y - low.y),
            starts: Vec::new(),
            points: Vec::new(),
        };
        let mut by_cell: Vec<(usize, usize)> = positions().map(|position| grid.cell(position)).zip(0..).collect();
        by_cell.sort_unstable();
        grid.starts = (0..=grid.columns * grid.rows).map(|c| by_cell.partition_point(|&(cell, _)| cell < c)).collect();
        grid.points = by_cell.into_iter().map(|(_, point)| point).collect();
        grid
    }

    fn cell(&self, position: Vector2<f64>) -> usize {
        let index = (position - self.origin) / self.cell_px;
        (index.y as usize).min(self.rows - 1) * self.columns + (index.x as usize).min(self.columns - 1)
    }

    /// The points within `radius_px`, at most a cell's size, of a place.
    fn near<'a>(
        &'a self,
        features: &'a Features,
        place: Vector2<f64>,
        radius_px: f64,
    ) -> impl Iterator<Item = usize> + 'a {
        let index = (place - self.origin) / self.cell_px;
        let range = |center: f64, count: usize| {
            let low = (center - 1.0).floor().max(0.0) as usize;
            let high = (center + 2.0).floor().clamp(0.0, count as f64) as usize;
            low.min(high)..high
        };
        let columns = range(index.x, self.columns);
        range(index.y, self.rows)
            .flat_map(move |row| {
                let first = row * self.columns + columns.start;
                let last = row * self.columns + columns.end;
                &self.points[self.starts[first]..self.starts[last]]
            })
            .copied()
            .filter(move |&point| (Vector2::from(features.points[point].position) - place).norm() <= radius_px)
    }
}
