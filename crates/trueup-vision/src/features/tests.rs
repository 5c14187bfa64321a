use proptest::prelude::*;
use rand::RngExt;
use trueup_core::context::{CancelToken, Silent};

use super::scale_space::{ASSUMED_BLUR_PX, BASE_SIGMA};
use super::*;

const SIZES: [SearchSize; 2] = [SearchSize::Original, SearchSize::Doubled];

/// A round Gaussian bump.
#[derive(Clone, Copy)]
struct Blob {
    center: [f64; 2],
    sigma: f64,
    amplitude: f64,
}

/// The sum of blobs on mid gray, sampled at the pixel centers.
fn render(width: usize, height: usize, blobs: &[Blob]) -> Raster<f32> {
    let mut picture = vec![128.0; width * height];
    for blob in blobs {
        let reach = 5.0 * blob.sigma;
        let range = |center: f64, size: usize| {
            (center - reach).clamp(0.0, size as f64) as usize..(center + reach).clamp(0.0, size as f64) as usize
        };
        for y in range(blob.center[1], height) {
            for x in range(blob.center[0], width) {
                let (dx, dy) = (x as f64 + 0.5 - blob.center[0], y as f64 + 0.5 - blob.center[1]);
                picture[y * width + x] += blob.amplitude * (-0.5 * (dx * dx + dy * dy) / blob.sigma.powi(2)).exp();
            }
        }
    }
    let samples = picture.iter().map(|&value: &f64| value as f32).collect();
    Raster::from_data(width, height, 1, samples).expect("as many samples as pixels")
}

/// A texture of blobs of many sizes.
fn texture_blobs(count: usize, size: f64) -> Vec<Blob> {
    let mut generator = StageContext::default().generator("features test", 0);
    (0..count)
        .map(|_| Blob {
            center: [generator.random_range(0.0..size), generator.random_range(0.0..size)],
            sigma: 1.3 * generator.random_range(0.0_f64..2.5).exp2(),
            amplitude: generator.random_range(-60.0..60.0),
        })
        .collect()
}

fn find(picture: &Raster<f32>, options: &FeatureOptions) -> Features {
    detect(picture, options, &StageContext::default()).expect("a valid picture and valid options")
}

/// What is found at one size, whether or not it is little.
fn find_at(size: SearchSize, picture: &Raster<f32>) -> Features {
    let (options, context) = (FeatureOptions::default(), StageContext::default());
    detect_at(size, picture, &options, InstructionSet::detect(), &context).expect("a valid picture")
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn blobs_are_found_where_they_are() {
    for size in SIZES {
        for (sigma, offset) in [(2.6, 0.0), (2.6, 0.31), (3.1, 0.5), (4.0, 0.77), (6.3, 0.12), (9.0, 0.6), (13.0, 0.9)]
        {
            // Pixel (100, 90) has its center at (100.5, 90.5).
            let center = [100.5 + offset, 90.5 - 0.7 * offset];
            let picture = render(200, 180, &[Blob { center, sigma, amplitude: 90.0 }]);
            let strongest = find_at(size, &picture).points[0];
            let error = distance(strongest.position, center);
            assert!(error < 0.05, "sigma {sigma}, offset {offset}, {size:?}: {error} px");
            // The difference of Gaussians between s and 2^(1/3) s is greatest where their geometric mean is the
            // blob's own blur (derivative of its response at the blob's center, with the blur assumed present).
            let expected = (sigma.powi(2) + ASSUMED_BLUR_PX.powi(2)).sqrt() * (-1.0_f64 / 6.0).exp2();
            let ratio = strongest.scale_px / expected;
            assert!((0.93..1.07).contains(&ratio), "sigma {sigma}: found {}, expected {expected}", strongest.scale_px);
        }
    }
}

/// How many points of a texture were looked for in its copy, found, and matched.
struct Repeated {
    tested: usize,
    /// Found in the copy at the right place and scale.
    found: usize,
    /// Their best match in the copy is the right one.
    matched: usize,
}

/// Counts the strongest points of one texture that are found again in its turned and scaled copy.
fn repeated(angle: f64, scale: f64, size: SearchSize) -> Repeated {
    const SIDE: f64 = 260.0;
    let blobs = texture_blobs(700, SIDE);
    let (sin, cos) = angle.sin_cos();
    let target_from_source = |[x, y]: [f64; 2]| {
        let (dx, dy) = (x - 0.5 * SIDE, y - 0.5 * SIDE);
        [scale * (cos * dx - sin * dy) + 0.5 * SIDE, scale * (sin * dx + cos * dy) + 0.5 * SIDE]
    };
    let moved: Vec<Blob> = blobs
        .iter()
        .map(|blob| Blob { center: target_from_source(blob.center), sigma: scale * blob.sigma, ..*blob })
        .collect();
    let source = find_at(size, &render(SIDE as usize, SIDE as usize, &blobs));
    let target = find_at(size, &render(SIDE as usize, SIDE as usize, &moved));
    // Below the first level that is searched, a point of the source has no counterpart in the reduced target.
    let smallest = BASE_SIGMA * (1.0_f64 / 3.0).exp2() / if size == SearchSize::Doubled { 2.0 } else { 1.0 };
    let mut counts = Repeated { tested: 0, found: 0, matched: 0 };
    for (descriptor, &index) in source.descriptors.iter().zip(&source.descriptor_points) {
        let point = source.points[index as usize];
        let expected = target_from_source(point.position);
        let from_center = distance(point.position, [0.5 * SIDE; 2]);
        if index >= 150 || from_center * scale.max(1.0) > 80.0 || point.scale_px * scale < smallest {
            continue;
        }
        counts.tested += 1;
        let agrees = |other: &FeaturePoint| {
            distance(other.position, expected) < 0.25 * point.scale_px.max(1.0) * scale
                && (other.scale_px / (point.scale_px * scale)).log2().abs() < 0.2
        };
        counts.found += usize::from(target.points.iter().any(agrees));
        let difference = |other: &Descriptor| -> i32 {
            descriptor.iter().zip(other).map(|(&a, &b)| (i32::from(a) - i32::from(b)).pow(2)).sum()
        };
        let nearest = (0..target.descriptors.len()).min_by_key(|&other| difference(&target.descriptors[other]));
        let nearest = nearest.map(|other| target.points[target.descriptor_points[other] as usize]);
        counts.matched += usize::from(nearest.is_some_and(|nearest| agrees(&nearest)));
    }
    counts
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn points_and_descriptors_follow_turns_and_scales(
        angle in 0.0..std::f64::consts::TAU,
        scale in 0.75..1.5_f64,
        size in proptest::sample::select(&SIZES),
    ) {
        let Repeated { tested, found, matched } = repeated(angle, scale, size);
        prop_assert!(tested >= 20, "only {tested} points to test");
        prop_assert!(found * 10 >= tested * 8, "{found} of {tested} found again");
        prop_assert!(matched * 10 >= tested * 8, "{matched} of {tested} matched");
    }
}

fn assert_same(a: &Features, b: &Features) {
    assert!(a.points == b.points, "points differ: {} and {}", a.points.len(), b.points.len());
    assert!(a.descriptors == b.descriptors, "descriptors differ");
    assert_eq!(a.descriptor_points, b.descriptor_points);
}

#[test]
fn result_depends_neither_on_threads_nor_on_instructions() {
    // Odd sizes, so that the last vectors of rows are partial.
    let picture = render(261, 187, &texture_blobs(600, 260.0));
    let sets = InstructionSet::available();
    if sets.len() == 1 {
        eprintln!("only the portable instructions are compared with themselves: this processor has no others");
    }
    for size in SIZES {
        let on_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small pool");
            pool.install(|| find_at(size, &picture))
        };
        let reference = on_threads(1);
        assert!(reference.points.len() > 100 && reference.descriptors.len() > 100);
        assert_same(&reference, &on_threads(2));
        for &instructions in &sets {
            let (options, context) = (FeatureOptions::default(), StageContext::default());
            let other = detect_at(size, &picture, &options, instructions, &context);
            assert_same(&reference, &other.expect("valid input"));
        }
    }
}

#[test]
fn features_are_consistent_and_capped() {
    let picture = render(260, 260, &texture_blobs(600, 260.0));
    let all = find(&picture, &FeatureOptions::default());
    assert!(all.descriptors.len() >= all.points.len() && all.points.len() > 100);
    assert!(all.points.is_sorted_by(|a, b| a.response >= b.response));
    assert!(all.descriptor_points.is_sorted());
    assert_eq!(all.descriptors.len(), all.descriptor_points.len());
    let few = find(&picture, &FeatureOptions { max_points: 10, ..FeatureOptions::default() });
    assert_eq!(few.points, all.points[..10]);
    let threshold = all.points[20].response;
    let strong = find(&picture, &FeatureOptions { peak_threshold: threshold, ..FeatureOptions::default() });
    assert_eq!(strong.points, all.points[..21]);
}

#[test]
fn descriptors_have_the_length_of_their_norm() {
    let picture = render(260, 260, &texture_blobs(600, 260.0));
    let features = find(&picture, &FeatureOptions::default());
    assert!(features.descriptors.len() > 100, "{} descriptors", features.descriptors.len());
    for descriptor in &features.descriptors {
        let squares: f64 = descriptor.iter().map(|&component| f64::from(component).powi(2)).sum();
        // 512, less what the byte's range and rounding take away.
        assert!((380.0..520.0).contains(&squares.sqrt()), "{}", squares.sqrt());
    }
}

#[test]
fn pictures_without_texture_have_no_features() {
    for (width, height) in [(0, 0), (1, 1), (8, 8), (9, 300), (64, 64), (100, 40)] {
        for value in [0.0, 37.0, 255.0, f32::NAN, f32::INFINITY, f32::MAX] {
            let picture = Raster::from_data(width, height, 1, vec![value; width * height]).expect("enough samples");
            assert!(find(&picture, &FeatureOptions::default()).points.is_empty(), "{width} x {height} of {value}");
            for size in SIZES {
                assert!(find_at(size, &picture).points.is_empty(), "{width} x {height} of {value}, {size:?}");
            }
        }
    }
}

#[test]
fn a_bad_pixel_harms_only_its_surroundings() {
    let mut picture = render(260, 260, &texture_blobs(600, 260.0));
    picture.pixel_mut(130, 130)[0] = f32::NAN;
    picture.pixel_mut(20, 20)[0] = f32::INFINITY;
    let features = find_at(SearchSize::Doubled, &picture);
    assert!(features.points.len() > 50);
    assert!(
        features.points.iter().all(|point| {
            point.position.iter().all(|coordinate| coordinate.is_finite()) && point.response.is_finite()
        })
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn any_small_picture_is_survived(
        (width, height, data) in (1_usize..40, 1_usize..40).prop_flat_map(|(width, height)| {
            (Just(width), Just(height), proptest::collection::vec(any::<f32>(), width * height))
        }),
        size in proptest::sample::select(&SIZES),
    ) {
        let picture = Raster::from_data(width, height, 1, data).expect("enough samples");
        let features = find_at(size, &picture);
        for point in &features.points {
            prop_assert!((0.0..=width as f64).contains(&point.position[0]));
            prop_assert!((0.0..=height as f64).contains(&point.position[1]));
        }
    }
}

#[test]
fn unusable_input_is_refused() {
    let context = StageContext::default();
    let options = FeatureOptions::default();
    assert!(matches!(detect(&Raster::new(20, 20, 3), &options, &context), Err(Error::Input { .. })));
    let bad = FeatureOptions { max_points: 0, peak_threshold: f64::NAN };
    match detect(&Raster::new(20, 20, 1), &bad, &context) {
        Err(Error::Options(invalid)) => assert_eq!(invalid.len(), 2),
        other => panic!("expected bad options, got {other:?}"),
    }
    let token = CancelToken::default();
    token.cancel();
    let cancelled = StageContext::new(&Silent, &token);
    assert!(matches!(detect(&Raster::new(20, 20, 1), &options, &cancelled), Err(Error::Cancelled)));
}

#[test]
fn a_picture_with_few_points_is_searched_doubled() {
    let few = render(200, 200, &texture_blobs(40, 200.0));
    assert!(find_at(SearchSize::Original, &few).points.len() < SPARSE_POINTS);
    assert_same(&find(&few, &FeatureOptions::default()), &find_at(SearchSize::Doubled, &few));
    assert!(!find_at(SearchSize::Doubled, &few).points.is_empty());
}
