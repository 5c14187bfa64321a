//! Putative matches: what looks alike, before geometry is asked.

use trueup_core::matches::PointMatch;

use super::options::MatchingOptions;
use super::search::{Nearest, Neighbor};
use crate::features::Features;

/// Matches whose end points are nearer than this in both photographs are one match.
const DUPLICATE_PX: f64 = 0.5;

/// How far from the nearest point the second-nearest must lie in the photograph, in working pixels; nearer ones are the
/// same place.
const SECOND_SEPARATION_PX: f64 = 3.0;

/// Matches are dropped whose squared distance exceeds the pair's mean by more than so many standard deviations (as in
/// the implementation of natural image stitching with the global similarity prior).
const DISTANCE_DEVIATIONS: f64 = 4.25;

/// Two points that look alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PutativeMatch {
    /// Index of the point in photograph a.
    pub point_a: usize,
    /// Index of the point in photograph b.
    pub point_b: usize,
    /// Squared distance of their nearest descriptors.
    pub squared_distance: u32,
    /// Ratio of the distances to the nearest and to the second-nearest point, 0 where there is no second.
    pub ratio: f64,
    /// Where the points are.
    pub at: PointMatch,
}

/// The putative matches of two photographs, in the order of the points of a.
///
/// A point's distance to another is the smallest over their descriptors. A match is kept if its point of b is nearest
/// to that of a, and the reverse; if the nearest point of b that lies farther than `SECOND_SEPARATION_PX` from it is
/// farther away by the factor 1 / `max_distance_ratio`; and if its distance does not stand out of the pair's. Of
/// duplicates, which share both places, the nearest is kept.
///
/// # Source
/// The ratio test: Lowe, Distinctive image features from scale-invariant keypoints, section 7.1. The cut of distances
/// is that of the implementation of natural image stitching with the global similarity prior.
///
/// # Departures
/// That implementation neither asks for mutual matches nor for separated seconds.
pub fn putative_matches(a: &Features, b: &Features, options: &MatchingOptions) -> Vec<PutativeMatch> {
    let Some(nearest) = Nearest::search(&a.descriptors, &b.descriptors) else { return Vec::new() };
    let descriptors_a = PointDescriptors::of(a);
    let descriptors_b = PointDescriptors::of(b);
    let candidates = (0..a.points.len()).filter_map(|point_a| {
        let to_b = |row: usize| NearPoint::of(nearest.nearest_column(row), b);
        let to_a = |column: usize| NearPoint::of(nearest.nearest_row(column), a);
        let found = descriptors_a.range(point_a).map(to_b).min()?;
        let back = descriptors_b.range(found.point).map(to_a).min();
        if back != Some(NearPoint { squared_distance: found.squared_distance, point: point_a }) {
            return None;
        }
        let ratio = distance_ratio(&nearest, descriptors_a.range(point_a), b, found, options.max_distance_ratio)?;
        let at = PointMatch { in_a: a.points[point_a].position, in_b: b.points[found.point].position };
        Some(PutativeMatch { point_a, point_b: found.point, squared_distance: found.squared_distance, ratio, at })
    });
    cut_outstanding(without_duplicates(candidates.collect()), DISTANCE_DEVIATIONS)
}

/// A point and how far its nearest descriptor is; ordered by distance, then index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct NearPoint {
    squared_distance: u32,
    point: usize,
}

impl NearPoint {
    /// The point that a descriptor belongs to.
    fn of(neighbor: Neighbor, features: &Features) -> Self {
        let point = features.descriptor_points[neighbor.descriptor] as usize;
        Self { squared_distance: neighbor.squared_distance, point }
    }
}

/// The ratio of the distances to the nearest point of b and to the second; `None` if it is too large. `rows` are the
/// descriptors of the point of a.
fn distance_ratio(
    nearest: &Nearest<'_>,
    rows: std::ops::Range<usize>,
    b: &Features,
    first: NearPoint,
    max_distance_ratio: f64,
) -> Option<f64> {
    let max_squared_ratio = max_distance_ratio.powi(2);
    let enough = (f64::from(first.squared_distance) / max_squared_ratio).floor() as u32;
    let place = b.points[first.point].position;
    let same_place = |column: usize| {
        let point = b.descriptor_points[column] as usize;
        let [x, y] = b.points[point].position;
        point == first.point || (x - place[0]).hypot(y - place[1]) <= SECOND_SEPARATION_PX
    };
    let second = rows.filter_map(|row| nearest.nearest_allowed(row, enough, same_place)).min();
    let Some(second) = second else { return Some(0.0) };
    let accepted = f64::from(first.squared_distance) <= max_squared_ratio * f64::from(second);
    // Two equal points at distance zero are no better than each other.
    (accepted && second > 0).then(|| (f64::from(first.squared_distance) / f64::from(second)).sqrt())
}

/// Which descriptors belong to each point.
struct PointDescriptors(Vec<usize>);

impl PointDescriptors {
    fn of(features: &Features) -> Self {
        let starts = (0..=features.points.len())
            .map(|point| features.descriptor_points.partition_point(|&owner| (owner as usize) < point));
        Self(starts.collect())
    }

    fn range(&self, point: usize) -> std::ops::Range<usize> {
        self.0[point]..self.0[point + 1]
    }
}

/// Keeps the nearest of the matches that share both places, in the given order.
fn without_duplicates(matches: Vec<PutativeMatch>) -> Vec<PutativeMatch> {
    let mut order: Vec<usize> = (0..matches.len()).collect();
    let x = |k: usize| matches[k].at.in_a[0];
    order.sort_by(|&j, &k| x(j).total_cmp(&x(k)).then(j.cmp(&k)));
    let mut dropped = vec![false; matches.len()];
    for (rank, &j) in order.iter().enumerate() {
        for &k in order[rank + 1..].iter().take_while(|&&k| x(k) - x(j) <= DUPLICATE_PX) {
            if same_places(&matches[j].at, &matches[k].at) {
                let farther = (matches[j].squared_distance, j).max((matches[k].squared_distance, k)).1;
                dropped[farther] = true;
            }
        }
    }
    matches.into_iter().zip(dropped).filter(|(_, dropped)| !dropped).map(|(kept, _)| kept).collect()
}

fn same_places(a: &PointMatch, b: &PointMatch) -> bool {
    let near = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]) <= DUPLICATE_PX;
    near(a.in_a, b.in_a) && near(a.in_b, b.in_b)
}

/// Drops matches whose squared distance exceeds the mean by more than `deviations` standard deviations.
fn cut_outstanding(mut matches: Vec<PutativeMatch>, deviations: f64) -> Vec<PutativeMatch> {
    let count = matches.len() as f64;
    let mean = matches.iter().map(|kept| f64::from(kept.squared_distance)).sum::<f64>() / count;
    let variance = matches.iter().map(|kept| (f64::from(kept.squared_distance) - mean).powi(2)).sum::<f64>() / count;
    let largest = mean + deviations * variance.sqrt();
    matches.retain(|kept| f64::from(kept.squared_distance) <= largest);
    matches
}
