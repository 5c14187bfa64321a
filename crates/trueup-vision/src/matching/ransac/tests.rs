use trueup_core::StageContext;

use super::*;

#[test]
fn the_number_of_samples_is_that_of_the_textbook() {
    // ln(1 - 0.995) / ln(1 - p) with p = 0.225^4 and 0.2^4, as in the reference implementation; 0.5^4 by hand.
    assert_eq!(samples_needed(0.225), 2065);
    assert_eq!(samples_needed(0.5), 83);
    assert_eq!(samples_needed(1.0), 1);
    assert_eq!(samples_needed(0.0), usize::MAX);
}

#[test]
fn four_matches_determine_the_map_unless_it_turns_them_over() {
    let h = Homography(Matrix3::new(1.05, 0.08, 200.0, -0.06, 1.02, 30.0, -4e-4, 6e-5, 1.0));
    let in_a = [(0.0, 0.0), (640.0, 10.0), (600.0, 480.0), (20.0, 400.0)].map(|(x, y)| Vector2::new(x, y));
    let points = MatchedPoints { in_a: in_a.to_vec(), in_b: in_a.map(|p| h.apply(p)).to_vec() };
    let found = through_sample(&points, &[0, 1, 2, 3]).expect("general position");
    assert!((found.0 / found.0[(2, 2)] - h.0).amax() < 1e-9);
    let swapped =
        MatchedPoints { in_b: vec![points.in_b[1], points.in_b[0], points.in_b[2], points.in_b[3]], ..points };
    assert!(through_sample(&swapped, &[0, 1, 2, 3]).is_none());
}

fn example() -> Homography {
    Homography(Matrix3::new(0.98, -0.05, -260.0, 0.06, 1.01, -20.0, 1.5e-4, 2e-5, 1.0))
}

/// `counts[k]` matches of `planes[k]` with noise, then `outliers` of none, shuffled.
fn scene(planes: &[Homography], counts: &[usize], outliers: usize, noise_px: f64) -> MatchedPoints {
    let mut generator = StageContext::default().generator("ransac test", 0);
    let mut pairs: Vec<(Vector2<f64>, Vector2<f64>)> = Vec::new();
    let mut place = || Vector2::new(generator.random_range(0.0..800.0), generator.random_range(0.0..600.0));
    for (plane, &count) in planes.iter().zip(counts) {
        let inside = |b: &Vector2<f64>| (0.0..800.0).contains(&b.x) && (0.0..600.0).contains(&b.y);
        let seen = std::iter::repeat_with(&mut place).map(|a| (a, plane.apply(a))).filter(|(_, b)| inside(b));
        pairs.extend(seen.take(count));
    }
    let random: Vec<_> = (0..outliers).map(|_| (place(), place())).collect();
    for (_, b) in &mut pairs {
        *b += Vector2::from_fn(|_, _| generator.random_range(-noise_px..=noise_px));
    }
    pairs.extend(random);
    for last in (1..pairs.len()).rev() {
        pairs.swap(last, generator.random_range(0..=last));
    }
    let (in_a, in_b) = pairs.into_iter().unzip();
    MatchedPoints { in_a, in_b }
}

/// What is found with each of fifty seeds.
fn found_by_fifty_draws(points: &MatchedPoints) -> Vec<Consensus> {
    let search = HomographySearch { inlier_px: 5.0, max_samples: 6000, useful_inliers: 15, start: None };
    let with_seed = |seed| StageContext::default().generator("ransac", seed);
    (0..50).map(|seed| find_homography(points, &search, |_| true, &mut with_seed(seed)).expect("a map")).collect()
}

/// Largest distance between where two maps take the matches of the first.
fn largest_difference(points: &MatchedPoints, one: &Consensus, map: &Homography) -> f64 {
    let distance = |&k: &usize| (one.b_from_a.apply(points.in_a[k]) - map.apply(points.in_a[k])).norm();
    one.inliers.iter().map(distance).fold(0.0, f64::max)
}

#[test]
fn every_draw_gives_the_true_map_where_seven_of_ten_matches_are_wrong() {
    let points = scene(&[example()], &[60], 140, 2.0);
    let found = found_by_fifty_draws(&points);
    for one in &found {
        assert!(largest_difference(&points, one, &example()) < 1.5);
        assert!(largest_difference(&points, one, &found[0].b_from_a) < 0.1);
    }
}

/// A wall and one in front of it, which parallax shifts by up to 16 pixels: maps between the two agree with parts of
/// both, and many samples without outliers lead to one of these.
#[test]
fn every_draw_gives_the_same_of_two_planes_that_are_nearly_one() {
    let nearer = Homography(Matrix3::new(0.98, -0.05, -268.0, 0.07, 1.02, -34.0, 1.5e-4, 2e-5, 1.0));
    let points = scene(&[example(), nearer], &[90, 60], 50, 1.5);
    let found = found_by_fifty_draws(&points);
    for one in &found {
        assert!(largest_difference(&points, one, &found[0].b_from_a) < 0.5);
    }
}
