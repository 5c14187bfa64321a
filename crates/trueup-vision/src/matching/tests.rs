use nalgebra::{Matrix3, Vector2};
use proptest::prelude::*;
use rand::{Rng, RngExt};
use trueup_core::Error;
use trueup_core::diagnostics::Subject;
use trueup_core::geometry::Homography;
use trueup_core::matches::{PairVerdict, PointMatch};
use trueup_core::raster::Raster;

use super::*;
use crate::features::{DESCRIPTOR_LENGTH, Descriptor, FeaturePoint};

const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 600.0;

/// Two photographs under construction.
#[derive(Default)]
struct PhotographPair {
    a: Features,
    b: Features,
}

impl PhotographPair {
    /// A point seen in both photographs.
    fn add(&mut self, in_a: Vector2<f64>, in_b: Vector2<f64>, generator: &mut impl Rng) {
        let descriptor = random_descriptor(generator);
        push(&mut self.a, in_a, &[descriptor]);
        push(&mut self.b, in_b, &[descriptor.map(|element| element.saturating_add(1))]);
    }

    /// Points of one plane that both photographs see, with noise of up to `noise_px`.
    fn add_plane(&mut self, b_from_a: &Homography, count: usize, noise_px: f64, generator: &mut impl Rng) {
        let mut left = count;
        while left > 0 {
            let in_a = random_place(generator);
            let noise = Vector2::from_fn(|_, _| generator.random_range(-noise_px..=noise_px));
            let in_b = b_from_a.apply(in_a) + noise;
            if frame().contains(in_b.x, in_b.y) {
                self.add(in_a, in_b, generator);
                left -= 1;
            }
        }
    }

    /// Points that look alike but are not the same.
    fn add_outliers(&mut self, count: usize, generator: &mut impl Rng) {
        for _ in 0..count {
            let (in_a, in_b) = (random_place(generator), random_place(generator));
            self.add(in_a, in_b, generator);
        }
    }

    fn matched(&self, demand: Demand, options: &MatchingOptions) -> PairMatches {
        let frame = frame();
        let a = PhotographFeatures { index: 0, features: &self.a, frame: &frame, told: ToldLens::default() };
        let b = PhotographFeatures { index: 1, features: &self.b, frame: &frame, told: ToldLens::default() };
        let input = PairInput { a, b, demand };
        match_pair(&input, options, &StageContext::default()).expect("valid scene")
    }

    fn putative(&self, options: &MatchingOptions) -> Vec<(usize, usize)> {
        let putative = putative_matches(&self.a, &self.b, options);
        putative.iter().map(|found| (found.point_a, found.point_b)).collect()
    }
}

fn frame() -> WorkingFrame {
    WorkingFrame { width: WIDTH, height: HEIGHT, working_from_full: 1.0 }
}

fn generator(subject: u64) -> impl Rng {
    StageContext::default().generator("test", subject)
}

fn random_descriptor(generator: &mut impl Rng) -> Descriptor {
    let mut descriptor = [0; DESCRIPTOR_LENGTH];
    generator.fill_bytes(&mut descriptor);
    descriptor
}

fn random_place(generator: &mut impl Rng) -> Vector2<f64> {
    Vector2::new(generator.random_range(0.0..WIDTH), generator.random_range(0.0..HEIGHT))
}

fn push(features: &mut Features, position: Vector2<f64>, descriptors: &[Descriptor]) {
    let owner = features.points.len() as u32;
    features.points.push(FeaturePoint { position: position.into(), scale_px: 2.0, response: 10.0 });
    features.descriptors.extend_from_slice(descriptors);
    features.descriptor_points.extend(descriptors.iter().map(|_| owner));
}

/// A picture of waves along two directions.
fn waves(scene_from_picture: &dyn Fn(Vector2<f64>) -> Vector2<f64>) -> Raster<u8> {
    let value = |place: Vector2<f64>| {
        let sum = (0.5 * place.x + 0.1 * place.y).sin() + (0.6 * place.y - 0.2 * place.x).sin();
        (110.0 + 40.0 * sum).round() as u8
    };
    let (width, height) = (WIDTH as usize, HEIGHT as usize);
    let place = |k: usize| Vector2::new((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
    let values = (0..width * height).map(|k| value(scene_from_picture(place(k)))).collect();
    Raster::from_data(width, height, 1, values).expect("as many")
}

/// A turn to the right by a third of the width, with some roll.
fn example_map() -> Homography {
    Homography(Matrix3::new(0.98, -0.05, -260.0, 0.06, 1.01, -20.0, 1.5e-4, 2e-5, 1.0))
}

/// Largest distance between where two maps take the points of a grid that the first takes into b.
fn largest_difference(truth: &Homography, rows: &[[f64; 3]; 3]) -> f64 {
    let found = Homography::from_rows(rows);
    let grid = (0..=8).flat_map(|x| (0..=6).map(move |y| Vector2::new(f64::from(x) * 100.0, f64::from(y) * 100.0)));
    let pairs = grid.map(|point| (truth.apply(point), found.apply(point)));
    let inside = pairs.filter(|(expected, _)| frame().contains(expected.x, expected.y));
    inside.map(|(expected, found)| (expected - found).norm()).fold(0.0, f64::max)
}

/// A descriptor of which only the first element is `level`: distances between them are differences of levels.
fn level(level: u8) -> Descriptor {
    let mut descriptor = [0; DESCRIPTOR_LENGTH];
    descriptor[0] = level;
    descriptor
}

fn levels(places: &[(f64, &[u8])]) -> Features {
    let mut features = Features::default();
    for (x, of_point) in places {
        let descriptors: Vec<Descriptor> = of_point.iter().map(|&value| level(value)).collect();
        push(&mut features, Vector2::new(*x, 0.0), &descriptors);
    }
    features
}

#[test]
fn the_second_neighbor_decides_by_its_distance() {
    let options = MatchingOptions::default();
    let a = levels(&[(0.0, &[100])]);
    // 16 / 20 = 0.8 passes, 17 / 20 does not.
    for (nearest, expected) in [(116, vec![(0, 0)]), (117, vec![])] {
        let scene = PhotographPair { a: a.clone(), b: levels(&[(0.0, &[nearest]), (50.0, &[80])]) };
        assert_eq!(scene.putative(&options), expected);
    }
}

#[test]
fn a_second_neighbor_at_the_same_place_does_not_count() {
    let options = MatchingOptions::default();
    let a = levels(&[(0.0, &[100])]);
    let near = PhotographPair { a: a.clone(), b: levels(&[(0.0, &[101]), (2.9, &[102]), (50.0, &[150])]) };
    assert_eq!(near.putative(&options), [(0, 0)]);
    let far = PhotographPair { a, b: levels(&[(0.0, &[101]), (3.1, &[101]), (50.0, &[150])]) };
    assert_eq!(far.putative(&options), []);
}

#[test]
fn points_are_as_far_as_their_nearest_descriptors() {
    let options = MatchingOptions::default();
    // The second point's second descriptor is nearest; its other one is no rival.
    let scene = PhotographPair { a: levels(&[(0.0, &[10, 200])]), b: levels(&[(0.0, &[150]), (50.0, &[90, 198])]) };
    let found = putative_matches(&scene.a, &scene.b, &options);
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].point_b, found[0].squared_distance), (1, 4));
    assert!((found[0].ratio - 2.0 / 50.0).abs() < 1e-12);
}

#[test]
fn matches_are_mutual() {
    let scene =
        PhotographPair { a: levels(&[(0.0, &[100]), (60.0, &[110])]), b: levels(&[(0.0, &[108]), (50.0, &[250])]) };
    assert_eq!(scene.putative(&MatchingOptions::default()), [(1, 0)]);
    // Alone, the other point of a finds the same point of b.
    let alone = PhotographPair { a: levels(&[(0.0, &[100])]), b: scene.b };
    assert_eq!(alone.putative(&MatchingOptions::default()), [(0, 0)]);
}

#[test]
fn of_duplicates_the_nearest_stays() {
    let a = levels(&[(0.0, &[50]), (0.4, &[150]), (30.0, &[240])]);
    let b = levels(&[(10.0, &[52]), (10.3, &[151]), (90.0, &[240])]);
    assert_eq!(PhotographPair { a, b }.putative(&MatchingOptions::default()), [(1, 1), (2, 2)]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_homography_is_found_among_sixty_percent_outliers(seed in 0_u64..1000) {
        let mut generator = generator(seed);
        let mut scene = PhotographPair::default();
        scene.add_plane(&example_map(), 80, 0.5, &mut generator);
        scene.add_outliers(120, &mut generator);
        // Noise may push matches at the border out of the predicted overlap.
        let pair = scene.matched(Demand::Test, &MatchingOptions::default());
        prop_assert_eq!(pair.verdict, PairVerdict::Joined);
        prop_assert!((76..=86).contains(&pair.agreeing));
        let rows = pair.b_from_a.expect("joined");
        // Matches are off by 0.5 px. Of all thousand draws the worst is off by 1.002, the next by 0.75.
        prop_assert!(largest_difference(&example_map(), &rows) < 1.25);
    }
}

#[test]
fn both_planes_of_a_scene_are_found() {
    let mut generator = generator(1);
    let shift = |x: f64| Homography(Matrix3::new(1.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
    let mut scene = PhotographPair::default();
    scene.add_plane(&shift(-200.0), 120, 0.3, &mut generator);
    scene.add_plane(&shift(-230.0), 70, 0.3, &mut generator);
    let pair = scene.matched(Demand::Test, &MatchingOptions::default());
    assert_eq!(pair.verdict, PairVerdict::Joined);
    assert!((120..130).contains(&pair.agreeing));
    assert!(pair.inliers.len() >= 188, "{}", pair.inliers.len());
}

#[test]
fn few_matches_are_no_plane_of_their_own() {
    let mut generator = generator(1);
    let shift = |x: f64| Homography(Matrix3::new(1.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
    let mut scene = PhotographPair::default();
    scene.add_plane(&shift(-200.0), 120, 0.3, &mut generator);
    scene.add_plane(&shift(-230.0), 35, 0.3, &mut generator);
    let pair = scene.matched(Demand::Test, &MatchingOptions::default());
    assert!((120..130).contains(&pair.agreeing));
    assert_eq!(pair.inliers.len(), pair.agreeing);
}

#[test]
fn a_plane_far_from_the_global_homography_is_left_out() {
    let mut generator = generator(1);
    let shift = |x: f64| Homography(Matrix3::new(1.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
    let mut scene = PhotographPair::default();
    scene.add_plane(&shift(-100.0), 120, 0.3, &mut generator);
    scene.add_plane(&shift(-400.0), 70, 0.3, &mut generator);
    assert_eq!(scene.matched(Demand::Test, &MatchingOptions::default()).inliers.len(), 120);
}

#[test]
fn unrelated_photographs_are_not_joined() {
    let mut generator = generator(2);
    let mut scene = PhotographPair::default();
    for _ in 0..300 {
        push(&mut scene.a, random_place(&mut generator), &[random_descriptor(&mut generator)]);
        push(&mut scene.b, random_place(&mut generator), &[random_descriptor(&mut generator)]);
    }
    let pair = scene.matched(Demand::Test, &MatchingOptions::default());
    assert_eq!((pair.verdict, pair.b_from_a), (PairVerdict::TooFewMatches, None));
    for seed in 0..20 {
        let mut scene = PhotographPair::default();
        scene.add_outliers(60, &mut StageContext::default().generator("outliers", seed));
        for demand in [Demand::Test, Demand::Graph] {
            let pair = scene.matched(demand, &MatchingOptions::default());
            assert!(!pair.verdict.is_joined() && pair.inliers.is_empty() && pair.agreeing < 8, "{pair:?}");
        }
    }
}

#[test]
fn nothing_matches_nothing() {
    let mut scene = PhotographPair::default();
    assert_eq!(scene.matched(Demand::Test, &MatchingOptions::default()).verdict, PairVerdict::TooFewMatches);
    let mut generator = generator(3);
    scene.add_plane(&example_map(), 3, 0.0, &mut generator);
    let pair = scene.matched(Demand::Graph, &MatchingOptions::default());
    assert_eq!((pair.putative, pair.verdict, pair.confidence()), (3, PairVerdict::TooFewMatches, 0.0));
}

#[test]
fn collinear_matches_have_no_homography() {
    let mut generator = generator(4);
    let mut scene = PhotographPair::default();
    for k in 0..40 {
        let place = Vector2::new(f64::from(k) * 12.0, 300.0);
        scene.add(place, place, &mut generator);
    }
    let pair = scene.matched(Demand::Test, &MatchingOptions::default());
    assert_eq!((pair.verdict, pair.b_from_a), (PairVerdict::TooFewInliers, None));
}

#[test]
fn a_homography_that_explodes_the_photograph_is_not_believed() {
    let mut generator = generator(4);
    let mut scene = PhotographPair::default();
    let explosion = Homography(Matrix3::new(6.0, 0.0, -2000.0, 0.0, 6.0, -1500.0, 0.0, 0.0, 1.0));
    scene.add_plane(&explosion, 60, 0.3, &mut generator);
    let pair = scene.matched(Demand::Graph, &MatchingOptions::default());
    assert_eq!((pair.verdict, pair.b_from_a), (PairVerdict::ImplausibleHomography, None));
}

#[test]
fn the_users_graph_joins_pairs_with_fewer_inliers() {
    let mut generator = generator(5);
    let mut scene = PhotographPair::default();
    scene.add_plane(&example_map(), 10, 0.3, &mut generator);
    let alone = scene.matched(Demand::Test, &MatchingOptions::default());
    assert_eq!((alone.verdict, alone.agreeing, alone.needed), (PairVerdict::TooFewInliers, 10, 15));
    let forced = scene.matched(Demand::Graph, &MatchingOptions::default());
    assert_eq!((forced.verdict, forced.needed, forced.inliers.len()), (PairVerdict::JoinedByGraph, 8, 10));
}

#[test]
fn results_do_not_depend_on_threads_and_follow_the_order_of_pairs() {
    let mut generator = generator(7);
    let mut scene = PhotographPair::default();
    scene.add_plane(&example_map(), 100, 1.0, &mut generator);
    scene.add_outliers(80, &mut generator);
    let features = [scene.a.clone(), scene.b, scene.a];
    let (frames, pairs) = ([frame(); 3], [(1, 2), (0, 2), (1, 0)]);
    let run_on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let context = StageContext::default();
        let options = MatchingOptions::default();
        let input = MatchingInput {
            features: &features,
            frames: &frames,
            told: &[ToldLens::default(); 3],
            pairs: &pairs,
            demand: Demand::Test,
        };
        let matched = pool.install(|| run(&input, &options, &context));
        let matched = matched.expect("valid photographs");
        report_near_duplicates(&matched, &context);
        (matched, context.findings())
    };
    let (matched, diagnostics) = run_on(1);
    assert_eq!((matched.clone(), diagnostics.clone()), run_on(2));
    assert_eq!(matched.iter().map(|pair| (pair.a, pair.b)).collect::<Vec<_>>(), [(1, 2), (0, 2), (0, 1)]);
    assert!(matched.iter().all(|pair| pair.verdict.is_joined()));
    assert_eq!(diagnostics.len(), 1);
    assert_eq!((diagnostics[0].code.as_str(), &diagnostics[0].subject), ("near-duplicate", &Subject::Pair(0, 2)));
}

/// A near thing of so many points, 14 px from where the plane has it.
#[test]
fn a_few_matches_elsewhere_in_depth_are_not_believed() {
    let elsewhere = |count: usize| {
        let mut generator = generator(17);
        let mut photographs = PhotographPair::default();
        photographs.add_plane(&example_map(), 200, 0.3, &mut generator);
        for k in 0..count {
            let in_a = Vector2::new(500.0 + 17.0 * (k % 4) as f64, 250.0 + 19.0 * (k / 4) as f64);
            photographs.add(in_a, example_map().apply(in_a) + Vector2::new(14.0, 0.0), &mut generator);
        }
        let matched = photographs.matched(Demand::Test, &MatchingOptions::default());
        assert!(matched.inliers.len() >= 200);
        matched.elsewhere.len()
    };
    assert_eq!([elsewhere(0), elsewhere(7), elsewhere(12)], [0, 0, 12]);
}

/// A near thing of 12 points, 14 px from where the plane has it: once photograph b shows it there, once it shows the
/// plane, and what looks like the thing is not.
#[test]
fn matches_elsewhere_in_depth_are_believed_if_what_surrounds_them_is_found_again() {
    let truth = example_map();
    let back = Homography(truth.0.try_inverse().expect("regular"));
    let aside = Vector2::new(14.0, 0.0);
    let is_near = |place: &Vector2<f64>| (480.0..580.0).contains(&place.x) && (230.0..310.0).contains(&place.y);
    let elsewhere = |is_there: bool| {
        let mut generator = generator(17);
        let mut photographs = PhotographPair::default();
        photographs.add_plane(&truth, 200, 0.3, &mut generator);
        for k in 0..12 {
            let in_a = Vector2::new(500.0 + 17.0 * f64::from(k % 4), 250.0 + 19.0 * f64::from(k / 4));
            photographs.add(in_a, truth.apply(in_a) + aside, &mut generator);
        }
        let in_scene = |place: Vector2<f64>| {
            Some(back.apply(place - aside)).filter(|near| is_there && is_near(near)).unwrap_or(back.apply(place))
        };
        photographs.a.surroundings = waves(&|place| place);
        photographs.b.surroundings = waves(&in_scene);
        let matched = photographs.matched(Demand::Test, &MatchingOptions::default());
        assert!(matched.inliers.len() >= 200);
        matched.elsewhere.len()
    };
    assert_eq!([elsewhere(true), elsewhere(false)], [12, 0]);
}

/// Forty points of a plane, sixty before it on something round, and sixty that only look alike: too few agree with the
/// plane alone.
#[test]
fn what_lies_before_a_plane_joins_a_pair_with_it() {
    let round = |in_a: Vector2<f64>| 20.0 + 60.0 * ((in_a.x - 520.0) / 250.0).powi(2) + 40.0 * (in_a.y / 300.0).sin();
    let matched = |is_round: bool| {
        let mut generator = generator(18);
        let mut photographs = PhotographPair::default();
        photographs.add_plane(&example_map(), 40, 0.3, &mut generator);
        for _ in 0..60 {
            let in_a = Vector2::new(generator.random_range(320.0..760.0), generator.random_range(60.0..560.0));
            let nearer = Vector2::new(if is_round { round(in_a) } else { generator.random_range(20.0..120.0) }, 0.0);
            let aside = if is_round { 0.0 } else { generator.random_range(-80.0..80.0) };
            photographs.add(in_a, example_map().apply(in_a) + nearer + Vector2::new(0.0, aside), &mut generator);
        }
        photographs.add_outliers(60, &mut generator);
        photographs.matched(Demand::Test, &MatchingOptions::default())
    };
    let joined = matched(true);
    assert_eq!(joined.verdict, PairVerdict::Joined, "{} of {}", joined.agreeing, joined.needed);
    assert!((85..105).contains(&joined.agreeing) && joined.elsewhere.len() >= 45, "{}", joined.agreeing);
    assert!((38..46).contains(&joined.inliers.len()) && joined.inliers.len() < joined.needed, "{}", joined.needed);
    let refused = matched(false);
    assert_eq!(refused.verdict, PairVerdict::TooFewInliers, "{} of {}", refused.agreeing, refused.needed);
    assert!(refused.inliers.is_empty() && refused.elsewhere.is_empty());
}

/// Waves that the map carries from one photograph into the other; features are off by up to 0.6 px along each axis.
#[test]
fn matches_are_placed_by_what_surrounds_them() {
    let truth = example_map();
    let back = Homography(truth.0.try_inverse().expect("regular"));
    let mut photographs = PhotographPair::default();
    photographs.add_plane(&truth, 200, 0.6, &mut generator(31));
    photographs.a.surroundings = waves(&|place| place);
    photographs.b.surroundings = waves(&|place| back.apply(place));
    let matched = photographs.matched(Demand::Test, &MatchingOptions::default());
    let error = |one: &PointMatch| (Vector2::from(one.in_b) - truth.apply(one.in_a.into())).norm();
    let exact = matched.inliers.iter().filter(|one| error(one) < 0.05).count();
    assert!(
        matched.inliers.len() > 150 && exact * 10 > matched.inliers.len() * 9,
        "{exact} of {}",
        matched.inliers.len()
    );
}

#[test]
fn contradictory_input_is_an_error() {
    let (frame, context) = (frame(), StageContext::default());
    let match_with = |features: &Features, index: usize| {
        let a = PhotographFeatures { index: 0, features, frame: &frame, told: ToldLens::default() };
        let pair = PairInput::new(a, PhotographFeatures { index, ..a }, Demand::Test);
        match_pair(&pair, &MatchingOptions::default(), &context)
    };
    let good = levels(&[(0.0, &[1])]);
    assert!(matches!(match_with(&good, 0), Err(Error::Input { .. })));
    let ownerless = Features { descriptor_points: vec![1], ..good.clone() };
    assert!(matches!(match_with(&ownerless, 1), Err(Error::Input { .. })));
    let nowhere = levels(&[(f64::NAN, &[1])]);
    assert!(matches!(match_with(&nowhere, 1), Err(Error::Input { .. })));
    let colored = Features { surroundings: Raster::new(9, 9, 3), ..levels(&[(0.0, &[1])]) };
    assert!(matches!(match_with(&colored, 1), Err(Error::Input { .. })));
    let input = MatchingInput {
        features: &[good],
        frames: &[frame],
        told: &[ToldLens::default()],
        pairs: &[(0, 1)],
        demand: Demand::Test,
    };
    let missing = run(&input, &MatchingOptions::default(), &context);
    assert!(matches!(missing, Err(Error::Input { .. })));
}

/// Two photographs of which `count` matches agree with one map, each of which shows 825 features more. The one shows
/// waves, the other the same ones where `scene_from_b` leads.
fn matched_among_others(
    b_from_a: &Homography,
    count: usize,
    seed: u64,
    scene_from_b: &dyn Fn(Vector2<f64>) -> Vector2<f64>,
    demand: Demand,
) -> PairMatches {
    let mut generator = generator(seed);
    let mut photographs = PhotographPair::default();
    photographs.add_plane(b_from_a, count, 0.3, &mut generator);
    for features in [&mut photographs.a, &mut photographs.b] {
        for k in 0..825 {
            let place = Vector2::new(f64::from(k % 33), f64::from(k / 33)) * 24.0;
            push(features, place + Vector2::new(15.0, 14.0), &[random_descriptor(&mut generator)]);
        }
    }
    photographs.a.surroundings = waves(&|place| place);
    photographs.b.surroundings = waves(scene_from_b);
    let pair = photographs.matched(demand, &MatchingOptions::default());
    assert_eq!(pair.inliers.is_empty(), !pair.verdict.is_joined());
    pair
}

/// 40 matches agree with one map, as those of equal things do; each photograph shows 800 features more, which are told
/// by what surrounds them.
#[test]
fn photographs_of_equal_things_among_others_are_not_joined() {
    let back = Homography(example_map().0.try_inverse().expect("regular"));
    let verdict = |scene_from_b: &dyn Fn(Vector2<f64>) -> Vector2<f64>, demand: Demand| {
        let pair = matched_among_others(&example_map(), 40, 20, scene_from_b, demand);
        (pair.verdict, pair.agreeing >= pair.needed)
    };
    let elsewhere = |place: Vector2<f64>| Vector2::new(1.4 * place.y, 1.3 * place.x);
    assert_eq!(verdict(&|place| back.apply(place), Demand::Test), (PairVerdict::Joined, true));
    assert_eq!(verdict(&elsewhere, Demand::Test), (PairVerdict::LooksDifferent, true));
    // Who names the pair in a graph knows better.
    assert_eq!(verdict(&elsewhere, Demand::Graph), (PairVerdict::Joined, true));
}

/// Overlapping by 70 px of 800, two photographs have 13 matches, where 15 are needed.
#[test]
fn few_matches_suffice_where_all_that_they_lay_over_each_other_looks_alike() {
    let b_from_a = Homography(Matrix3::new(1.0, 0.0, 70.0 - WIDTH, 0.0, 1.0, 3.0, 0.0, 0.0, 1.0));
    let back = Homography(b_from_a.0.try_inverse().expect("regular"));
    let verdict = |scene_from_b: &dyn Fn(Vector2<f64>) -> Vector2<f64>, demand: Demand| {
        let pair = matched_among_others(&b_from_a, 13, 21, scene_from_b, demand);
        (pair.verdict, pair.agreeing)
    };
    let elsewhere = |place: Vector2<f64>| Vector2::new(1.4 * place.y, 1.3 * place.x);
    let there = |place: Vector2<f64>| back.apply(place);
    assert_eq!(verdict(&there, Demand::Test), (PairVerdict::TooFewInliers, 13));
    assert_eq!(verdict(&there, Demand::FewIfAlike), (PairVerdict::JoinedByLooks, 13));
    assert_eq!(verdict(&elsewhere, Demand::FewIfAlike), (PairVerdict::TooFewInliers, 13));
}
