//! What two photographs show alike by all that their pictures tell, whatever a panorama makes of it.
//!
//! The matches that align a panorama are those that agree with homographies, and what is measured by them alone says
//! nothing of things elsewhere in depth. Here counts every match of which its neighbors say the same and that the
//! geometry of two cameras explains. What of it no plane of a pair explains draws the pair's overlap together where it
//! lies.

use nalgebra::{Vector2, Vector3};
use rand::Rng;
use trueup_core::camera::Camera;
use trueup_core::geometry::Homography;
use trueup_core::matches::PointMatch;
use trueup_core::options::StageOptions;
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};

use super::compared::{ComparedPair, MAX_SAMPLES};
use super::epipolar::epipolar_matches;
use super::matched_points::MatchedPoints;
use super::options::MatchingOptions;
use super::ransac::{HomographySearch, find_homography};
use super::refined::Refiner;
use crate::features::Features;

/// Distance from the epipolar geometry up to which a match agrees with it, working pixels: four times what places of
/// features err by.
const EPIPOLAR_PX: f64 = 2.0;
/// Nearest other matches that are asked whether they moved alike.
const NEIGHBORS: usize = 8;
/// How many of them must have: near things before far ones leave every place with some of its own depth.
const ALIKE: usize = 2;
/// Neighbors moved alike if they differ by no more than this, working pixels ...
const ALIKE_PX: f64 = 2.0;
/// ... and this part of their distance: slanted surfaces, and what one homography leaves of a lens.
const ALIKE_SLOPE: f64 = 0.2;
/// Farthest from where the homography of most matches has it that a match may lie, in diagonals: repeated things lie
/// elsewhere alike, too.
const FARTHEST_DIAGONAL: f64 = 0.25;

/// A photograph whose matches are sought.
#[derive(Debug, Clone, Copy)]
pub struct SeenFeatures<'a> {
    /// Its features, in working pixels.
    pub features: &'a Features,
    /// The frame these are measured in.
    pub frame: &'a WorkingFrame,
    /// Its camera in working pixels. Focal length and rotation may be wrong, for they take no part; the lens tells what
    /// is straight.
    pub camera: &'a Camera,
}

/// The matches of two photographs that are consistent: of which two of the eight neighbors moved alike, within a
/// quarter of the diagonal of where most moved, and that one epipolar geometry explains. None if no homography is
/// agreed on by `min_inliers`, or fewer than that are consistent.
///
/// The same for any number of threads; another order of the two photographs draws other samples.
///
/// # Errors
/// [`Error::Options`](trueup_core::Error::Options), [`Error::Cancelled`](trueup_core::Error::Cancelled).
///
/// # Source
/// That true matches are told by what moves alike around them: Bian and others, GMS: grid-based motion statistics,
/// 2017; here by nearest neighbors.
pub fn consistent_matches(
    a: &SeenFeatures<'_>,
    b: &SeenFeatures<'_>,
    options: &MatchingOptions,
    context: &StageContext<'_>,
) -> Result<Vec<PointMatch>> {
    options.check()?;
    context.check_cancelled()?;
    let compared = ComparedPair::new([(a.features, a.frame), (b.features, b.frame)], options);
    let points = &compared.points;
    let mut generator = context.generator("consistent matches", compared.seed());
    let search = HomographySearch {
        inlier_px: options.inlier_px,
        max_samples: MAX_SAMPLES,
        useful_inliers: options.min_inliers,
        start: None,
    };
    let Ok(most) = find_homography(points, &search, |_| true, &mut generator) else { return Ok(Vec::new()) };
    if most.inliers.len() < options.min_inliers {
        return Ok(Vec::new());
    }
    context.check_cancelled()?;
    let supported = supported(points, &most.b_from_a, FARTHEST_DIAGONAL * b.frame.diagonal());
    let points = points.select(&supported);
    let agreeing = of_one_geometry(&points, [a.camera, b.camera], &mut generator);
    if agreeing.len() < options.min_inliers {
        return Ok(Vec::new());
    }
    let found = |k: usize| PointMatch { in_a: points.in_a[k].into(), in_b: points.in_b[k].into() };
    let refiner = Refiner { a: &a.features.surroundings, b: &b.features.surroundings };
    let matches = agreeing.into_iter().map(found).collect();
    Ok(refiner.refined(matches, |point| Some(most.b_from_a.apply(point))))
}

/// How matches moved beside a homography, and whether their neighbors moved alike.
struct Surroundings<'a> {
    points: &'a MatchedPoints,
    moved: Vec<Vector2<f64>>,
    /// Those that moved no farther than asked, ascending.
    near: Vec<usize>,
}

impl<'a> Surroundings<'a> {
    /// Of the matches that moved beside `b_from_a` by no more than `farthest_px`.
    fn new(points: &'a MatchedPoints, b_from_a: &Homography, farthest_px: f64) -> Self {
        let moved: Vec<Vector2<f64>> =
            points.in_a.iter().zip(&points.in_b).map(|(&a, b)| b - b_from_a.apply(a)).collect();
        // A comparison with NaN is false.
        let near = (0..moved.len()).filter(|&k| moved[k].norm() <= farthest_px).collect();
        Self { points, moved, near }
    }

    /// Whether enough neighbors of match `k` moved alike.
    fn is_supported(&self, k: usize) -> bool {
        let Self { points, moved, near } = self;
        let place = points.in_a[k];
        let mut others: Vec<(f64, usize)> =
            near.iter().filter(|&&j| j != k).map(|&j| ((points.in_a[j] - place).norm_squared(), j)).collect();
        if others.len() > NEIGHBORS {
            others.select_nth_unstable_by(NEIGHBORS, |one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
            others.truncate(NEIGHBORS);
        }
        let alike =
            |&&(square, j): &&(f64, usize)| (moved[j] - moved[k]).norm() <= ALIKE_PX + ALIKE_SLOPE * square.sqrt();
        others.iter().filter(alike).count() >= ALIKE
    }
}

/// The matches, ascending, of which enough neighbors moved alike beside `b_from_a`, and not farther than `farthest_px`.
fn supported(points: &MatchedPoints, b_from_a: &Homography, farthest_px: f64) -> Vec<usize> {
    let surroundings = Surroundings::new(points, b_from_a, farthest_px);
    surroundings.near.iter().copied().filter(|&k| surroundings.is_supported(k)).collect()
}

/// The matches, ascending, that no plane of their pair explains (`is_known` says which one does) and that are
/// consistent: of which two of the eight neighbors moved alike, and that have one epipolar geometry with those on
/// planes.
///
/// `cameras` need be no better than pinholes of any focal length where lenses bend little: a linear map of the
/// bearings, and a bend within what a match may err by.
pub(super) fn matches_elsewhere(
    points: &MatchedPoints,
    is_known: &[bool],
    b_from_a: &Homography,
    cameras: &[Camera; 2],
    frame_b: &WorkingFrame,
    generator: &mut impl Rng,
) -> Vec<usize> {
    let surroundings = Surroundings::new(points, b_from_a, FARTHEST_DIAGONAL * frame_b.diagonal());
    let candidates: Vec<usize> =
        surroundings.near.iter().copied().filter(|&k| !is_known[k] && surroundings.is_supported(k)).collect();
    if candidates.is_empty() {
        return candidates;
    }
    let mut all: Vec<usize> = (0..is_known.len()).filter(|&k| is_known[k]).chain(candidates).collect();
    all.sort_unstable();
    let points = points.select(&all);
    let [a, b] = cameras;
    let agreeing = of_one_geometry(&points, [a, b], generator);
    agreeing.into_iter().map(|k| all[k]).filter(|&k| !is_known[k]).collect()
}

/// The matches that one epipolar geometry of two cameras explains.
fn of_one_geometry(points: &MatchedPoints, cameras: [&Camera; 2], generator: &mut impl Rng) -> Vec<usize> {
    let bearings = |places: &[Vector2<f64>], camera: &Camera| -> Vec<Vector3<f64>> {
        places.iter().map(|&place| camera.bearing(place).normalize()).collect()
    };
    let [a, b] = cameras;
    let within = EPIPOLAR_PX / (a.focal_px * b.focal_px).sqrt();
    epipolar_matches(&bearings(&points.in_a, a), &bearings(&points.in_b, b), within, generator)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    /// A lattice of 20 px that moved by 5 px to the right; every 17th match is elsewhere by itself, the last 9 are a
    /// thing of its own depth.
    fn lattice() -> (MatchedPoints, Vec<usize>) {
        let places: Vec<Vector2<f64>> =
            (0..300).map(|k| Vector2::new(f64::from(k % 20), f64::from(k / 20)) * 20.0).collect();
        let moved = |(k, place): (usize, &Vector2<f64>)| match k {
            291.. => place + Vector2::new(24.0, 0.0),
            k if k % 17 == 8 => place + Vector2::new(60.0 + k as f64 * 7.0 % 90.0, k as f64 * 13.0 % 80.0 - 40.0),
            _ => place + Vector2::new(5.0, 0.0),
        };
        let in_b = places.iter().enumerate().map(moved).collect();
        let wrong = (0..291).filter(|k| k % 17 == 8).collect();
        (MatchedPoints { in_a: places, in_b }, wrong)
    }

    #[test]
    fn what_moves_alike_is_kept_at_every_depth_and_what_moves_alone_is_not() {
        let (points, wrong) = lattice();
        let moved = Homography::from_rows(&[[1.0, 0.0, 5.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let kept = supported(&points, &moved, 120.0);
        assert!((0..300).all(|k| kept.contains(&k) != wrong.contains(&k)), "{kept:?}");
        let frame = WorkingFrame::new(400, 300, 480_000.0);
        let generator = || StageContext::default().generator("test", 7);
        let on_plane: Vec<bool> = (0..300).map(|k| k < 291 && !wrong.contains(&k)).collect();
        let cameras = [Camera::new(400.0, 400.0, 300.0, &Matrix3::identity()); 2];
        let elsewhere =
            |is_known: &[bool]| matches_elsewhere(&points, is_known, &moved, &cameras, &frame, &mut generator());
        let found = elsewhere(&on_plane);
        assert_eq!(found, (291..300).collect::<Vec<_>>());
        assert!(elsewhere(&[true; 300]).is_empty());
        // The thing of its own depth is 19 px from where most are.
        assert!(supported(&points, &moved, 15.0).iter().all(|&k| k < 291));
    }
}
