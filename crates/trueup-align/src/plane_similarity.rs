//! The similarity that turns least among those of the planes that matches lie on.

use nalgebra::{Matrix3, Vector2};
use rand::Rng;
use rand::seq::index::sample;
use trueup_core::geometry::{Homography, Normalization};

/// Points and where they are matched with, as many.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MatchedPoints<'a> {
    /// In one photograph, working pixels.
    pub points: &'a [Vector2<f64>],
    /// In another photograph or in the panorama.
    pub places: &'a [Vector2<f64>],
}

/// The similarity of least rotation among those of the planes that the matches lie on, `[a -b x; b a y; 0 0 1]`; `None`
/// if the points or the places coincide.
///
/// Planes are found one after the other, the largest first, as long as 50 matches lie on one; one of fewer has to do if
/// there is no such.
///
/// # Source
/// Lin et al., "Adaptive as-natural-as-possible image stitching" (2015), section 3.2.
pub(crate) fn similarity_of_least_turn(data: MatchedPoints<'_>, generator: &mut impl Rng) -> Option<Matrix3<f64>> {
    /// Matches that make a plane, as published.
    const PLANE_MATCHES: usize = 50;
    let normalized = Normalized::of(data)?;
    let mut left: Vec<usize> = (0..data.points.len()).collect();
    let mut candidates: Vec<Matrix3<f64>> = Vec::new();
    loop {
        let plane = largest_plane(&normalized, &left, generator);
        let large = plane.len() >= PLANE_MATCHES;
        // Without any large plane the largest one has to do.
        if large || (candidates.is_empty() && plane.len() >= 4) {
            candidates.extend(fitted_similarity(data, &plane));
        }
        if !large {
            break;
        }
        left.retain(|index| plane.binary_search(index).is_err());
    }
    if candidates.is_empty() {
        candidates.extend(fitted_similarity(data, &(0..data.points.len()).collect::<Vec<_>>()));
    }
    let turn = |similarity: &Matrix3<f64>| similarity[(1, 0)].atan2(similarity[(0, 0)]).abs();
    candidates.into_iter().reduce(|best, next| if turn(&next) < turn(&best) { next } else { best })
}

/// Matches whose points and places are centered, and 1.4 from their center on average.
struct Normalized {
    points: Vec<Vector2<f64>>,
    places: Vec<Vector2<f64>>,
}

impl Normalized {
    /// `None` if all points or all places coincide.
    fn of(data: MatchedPoints<'_>) -> Option<Self> {
        let applied = |points: &[Vector2<f64>]| -> Option<Vec<Vector2<f64>>> {
            let normalization = Normalization::of(points)?;
            Some(points.iter().map(|&point| normalization.apply(point)).collect())
        };
        Some(Self { points: applied(data.points)?, places: applied(data.places)? })
    }
}

/// The largest set of the matches `left` that one homography explains, ascending; by RANSAC.
fn largest_plane(data: &Normalized, left: &[usize], generator: &mut impl Rng) -> Vec<usize> {
    /// Largest distance of a match from a plane's homography, in units in which matches are 1.4 from their center on
    /// average; as published.
    const TOLERANCE: f64 = 0.01;
    /// Most samples of four matches: one of them is all on a plane of 1 in 4 matches with 86 %, of 1 in 3 with 99.8 %.
    const MOST_SAMPLES: f64 = 500.0;
    const SAMPLE_SIZE: usize = 4;
    /// How sure it must be that no larger plane was missed for the search to end early.
    const CONFIDENCE: f64 = 0.999;
    let mut best = Vec::new();
    if left.len() < SAMPLE_SIZE {
        return best;
    }
    let mut needed = MOST_SAMPLES;
    let mut taken = 0.0;
    while taken < needed {
        taken += 1.0;
        let chosen = sample(generator, left.len(), SAMPLE_SIZE);
        let of = |points: &[Vector2<f64>]| -> [Vector2<f64>; SAMPLE_SIZE] {
            std::array::from_fn(|k| points[left[chosen.index(k)]])
        };
        let Some(plane) = Homography::from_four_points(&of(&data.points), &of(&data.places)) else {
            continue;
        };
        let agrees = |&index: &usize| (plane.apply(data.points[index]) - data.places[index]).norm() <= TOLERANCE;
        let agreeing: Vec<usize> = left.iter().copied().filter(agrees).collect();
        if agreeing.len() > best.len() {
            best = agreeing;
            let all_on_it = (best.len() as f64 / left.len() as f64).powi(SAMPLE_SIZE as i32);
            // Never negative nor NaN: a share of 1 gives ln(0) = -infinity, and 0 samples more.
            needed = ((1.0 - CONFIDENCE).ln() / (1.0 - all_on_it).ln()).clamp(0.0, MOST_SAMPLES);
        }
    }
    best
}

/// The least-squares similarity of some matches; `None` if they coincide.
fn fitted_similarity(data: MatchedPoints<'_>, chosen: &[usize]) -> Option<Matrix3<f64>> {
    let mean =
        |points: &[Vector2<f64>]| chosen.iter().map(|&index| points[index]).sum::<Vector2<f64>>() / chosen.len() as f64;
    let (from, to) = (mean(data.points), mean(data.places));
    let (mut turn, mut spread) = (Vector2::zeros(), 0.0);
    for &index in chosen {
        let (p, q) = (data.points[index] - from, data.places[index] - to);
        turn += Vector2::new(p.dot(&q), p.perp(&q));
        spread += p.norm_squared();
    }
    let (a, b) = (turn.x / spread, turn.y / spread);
    let shift = to - Vector2::new(a * from.x - b * from.y, b * from.x + a * from.y);
    let similarity = Matrix3::new(a, -b, shift.x, b, a, shift.y, 0.0, 0.0, 1.0);
    similarity.iter().all(|entry| entry.is_finite()).then_some(similarity)
}

#[cfg(test)]
mod tests {
    use trueup_core::StageContext;

    use super::*;

    /// 150 points on a plane turned by `turn_deg` and 120 on one turned by `other_deg` and displaced.
    fn two_planes(turn_deg: f64, other_deg: f64) -> (Vec<Vector2<f64>>, Vec<Vector2<f64>>) {
        let point = |k: usize| Vector2::new((k as f64 * 0.618).fract() * 800.0, (k as f64 * 0.755).fract() * 600.0);
        let turned = |point: Vector2<f64>, degrees: f64, scale: f64| {
            let (sine, cosine) = f64::to_radians(degrees).sin_cos();
            scale * Vector2::new(cosine * point.x - sine * point.y, sine * point.x + cosine * point.y)
        };
        (0..270)
            .map(|k| {
                let near = k >= 150;
                let place = if near { turned(point(k), other_deg, 1.2) } else { turned(point(k), turn_deg, 1.0) };
                (point(k), place + if near { Vector2::new(-500.0, 90.0) } else { Vector2::new(-300.0, 0.0) })
            })
            .unzip()
    }

    fn found(points: &[Vector2<f64>], places: &[Vector2<f64>]) -> Option<Matrix3<f64>> {
        let mut generator = StageContext::default().generator("test", 1);
        similarity_of_least_turn(MatchedPoints { points, places }, &mut generator)
    }

    /// The smaller plane wins if it turns less, whichever way; scale and shift are its own.
    #[test]
    fn the_plane_that_turns_least_decides() {
        for (turn_deg, other_deg, least_deg, scale) in [(8.0, -3.0, -3.0, 1.2), (2.0, 9.0, 2.0, 1.0)] {
            let (points, places) = two_planes(turn_deg, other_deg);
            let similarity = found(&points, &places).expect("two planes");
            let turn = similarity[(1, 0)].atan2(similarity[(0, 0)]).to_degrees();
            assert!((turn - least_deg).abs() < 1e-6, "{turn} for {least_deg}");
            assert!((similarity[(0, 0)].hypot(similarity[(1, 0)]) - scale).abs() < 1e-9);
        }
    }

    #[test]
    fn few_matches_have_one_and_coinciding_ones_none() {
        let (points, places) = two_planes(5.0, 5.0);
        let turn = |similarity: Matrix3<f64>| similarity[(1, 0)].atan2(similarity[(0, 0)]).to_degrees();
        assert!((found(&points[..20], &places[..20]).map(turn).expect("twenty matches") - 5.0).abs() < 1e-6);
        assert!(found(&[Vector2::zeros(); 9], &[Vector2::zeros(); 9]).is_none());
    }
}
