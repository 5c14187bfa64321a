use proptest::prelude::*;
use rand::Rng;
use trueup_core::context::{CancelToken, Silent};

use super::*;

const DARK: f64 = 60.0;
const BRIGHT: f64 = 200.0;

/// The share of a unit pixel on the positive side of a line at signed distance `distance` of its center, the line's
/// unit normal being (a, b): the distribution of the sum of two uniform variables of widths |a| and |b|.
fn coverage(distance: f64, a: f64, b: f64) -> f64 {
    let (a, b) = (a.abs(), b.abs());
    if a.min(b) < 1e-9 {
        return (distance / a.max(b) + 0.5).clamp(0.0, 1.0);
    }
    let ramp = |x: f64| 0.5 * x.max(0.0).powi(2);
    let (sum, difference) = (0.5 * (a + b), 0.5 * (a - b));
    (ramp(distance + sum) - ramp(distance + difference) - ramp(distance - difference) + ramp(distance - sum)) / (a * b)
}

/// A photograph dark on one side and bright on the side of the normal of the line through `point`.
fn half_plane(size: usize, point: [f64; 2], normal_angle: f64) -> Raster<f32> {
    let (b, a) = normal_angle.sin_cos();
    let samples = (0..size * size).map(|index| {
        let (x, y) = ((index % size) as f64 + 0.5, (index / size) as f64 + 0.5);
        let distance = (x - point[0]) * a + (y - point[1]) * b;
        (DARK + (BRIGHT - DARK) * coverage(distance, a, b)) as f32
    });
    Raster::from_data(size, size, 1, samples.collect()).expect("sizes agree")
}

/// Independent normal noise of standard deviation `sigma` around 128.
fn noise(width: usize, height: usize, sigma: f64) -> Raster<f32> {
    let mut generator = StageContext::default().generator("noise", 1);
    let mut uniform = || f64::from(generator.next_u32()) / f64::from(u32::MAX);
    // The sum of 12 uniform variables has variance 1 and mean 6.
    let samples = (0..width * height).map(|_| (128.0 + sigma * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0)) as f32);
    Raster::from_data(width, height, 1, samples.collect()).expect("sizes agree")
}

/// Overlapping tilted steps: a photograph with many segments.
fn steps(size: usize) -> Raster<f32> {
    let mut picture = noise(size, size, 2.0);
    for index in 0..12 {
        let along = size as f64 * (0.1 + 0.07 * f64::from(index));
        let plane = half_plane(size, [along, 0.5 * size as f64], 0.5 * f64::from(index));
        let samples = picture.data_mut().iter_mut().zip(plane.data());
        samples.for_each(|(sample, plane)| *sample += 0.2 * (plane - DARK as f32));
    }
    picture
}

fn found(picture: &Raster<f32>) -> Vec<LineSegment> {
    found_from(picture, 0.0)
}

fn found_from(picture: &Raster<f32>, min_length_px: f64) -> Vec<LineSegment> {
    detect(picture, &LineOptions { min_length_px }, &StageContext::default()).expect("valid input")
}

/// Those of some significance, not refined.
fn rough(picture: &Raster<f32>, min_significance: f64) -> Vec<LineSegment> {
    let segments = segments_of_field(&GradientField::new(picture), min_significance, &StageContext::default());
    tidy::longest_first(segments.expect("not cancelled"), 0.0, MAX_SEGMENTS)
}

/// Signed distance of the segment's middle from the true line, and its turn from it in degrees.
fn errors(segment: &LineSegment, point: [f64; 2], normal_angle: f64) -> (f64, f64) {
    let (b, a) = normal_angle.sin_cos();
    let distance = |end: [f64; 2]| (end[0] - point[0]) * a + (end[1] - point[1]) * b;
    let (start, end) = (distance(segment.start), distance(segment.end));
    (0.5 * (start + end), ((end - start) / segment.length()).asin().to_degrees())
}

#[test]
fn a_step_between_columns_is_found_at_their_border() {
    let picture = half_plane(100, [40.0, 50.0], 0.0);
    for segments in [rough(&picture, MIN_SIGNIFICANCE), found(&picture)] {
        assert_eq!(segments.len(), 1);
        let segment = segments[0];
        assert!((segment.start[0] - 40.0).abs() < 1e-2 && (segment.end[0] - 40.0).abs() < 1e-2, "{segment:?}");
        // Brighter towards larger x: up the screen, over nearly the whole height.
        assert!(segment.start[1] > 97.0 && segment.end[1] < 3.0, "{segment:?}");
        assert!(segment.significance > 50.0);
        assert!((1.0..4.0).contains(&segment.width_px), "{segment:?}");
    }
}

#[test]
fn tilted_steps_are_found_within_a_fiftieth_of_a_pixel_once_refined() {
    for degrees in [0.0, 2.0, 7.0, 22.5, 30.0, 45.0, 62.0, 90.0, 100.0, 135.0, 171.0, 180.0, 250.0, 300.0_f64] {
        for offset in [0.0, 0.2, 0.5, 0.77] {
            let point = [80.0 + offset, 80.0 - 0.3 * offset];
            let picture = half_plane(160, point, degrees.to_radians());
            for (segments, max_distance_px, max_turn_deg) in
                [(rough(&picture, MIN_SIGNIFICANCE), 0.08, 0.05), (found(&picture), 0.02, 0.02)]
            {
                assert_eq!(segments.len(), 1, "{degrees} deg");
                let (distance, turn) = errors(&segments[0], point, degrees.to_radians());
                assert!(distance.abs() < max_distance_px, "{degrees} deg, offset {offset}: {distance} px");
                assert!(turn.abs() < max_turn_deg, "{degrees} deg, offset {offset}: {turn} deg");
                assert!(segments[0].length() > 155.0);
                // The normal points to the bright side, on the right of the segment's way on the screen.
                let [dx, dy] = [0, 1].map(|axis| segments[0].end[axis] - segments[0].start[axis]);
                let (sine, cosine) = degrees.to_radians().sin_cos();
                assert!(dx * sine - dy * cosine > 0.0, "{degrees} deg");
            }
        }
    }
}

#[test]
fn both_sides_of_a_bar_are_segments_of_opposite_directions() {
    let mut picture = Raster::new(90, 60, 1);
    for y in 10..50 {
        picture.row_mut(y)[30..42].fill(180.0);
    }
    let segments = found_from(&picture, 20.0);
    assert_eq!(segments.len(), 2);
    let mut sides: Vec<(f64, f64)> =
        segments.iter().map(|segment| (segment.start[0], segment.end[1] - segment.start[1])).collect();
    sides.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!((sides[0].0 - 30.0).abs() < 0.02 && sides[0].1 < -35.0, "{sides:?}");
    assert!((sides[1].0 - 42.0).abs() < 0.02 && sides[1].1 > 35.0, "{sides:?}");
}

#[test]
fn refinement_makes_noisy_directions_better() {
    let (mut before, mut after) = (0.0, 0.0);
    for index in 0..12 {
        let (point, angle) = ([75.3, 75.0], 0.13 + 0.5 * f64::from(index));
        let mut picture = half_plane(150, point, angle);
        let disturbance = noise(150, 150, 4.0);
        picture.data_mut().iter_mut().zip(disturbance.data()).for_each(|(sample, noise)| *sample += noise - 128.0);
        before += errors(&rough(&picture, MIN_SIGNIFICANCE)[0], point, angle).1.powi(2);
        after += errors(&found(&picture)[0], point, angle).1.powi(2);
    }
    assert!(after < 0.7 * before, "{after} deg^2 against {before} deg^2");
    assert!((after / 12.0).sqrt() < 0.03, "{after} deg^2");
}

#[test]
fn noise_has_hardly_any_segments() {
    // One false alarm a photograph is what a significance of 0 stands for.
    let picture = noise(300, 200, 30.0);
    let segments = found(&picture);
    assert!(segments.len() <= 3, "{} segments", segments.len());
    assert!(rough(&picture, 3.0).is_empty());
    // There are gradients enough to be taken for lines.
    assert!(GradientField::new(&picture).seeds().len() > 10_000);
}

#[test]
fn pictures_without_content_have_no_segments() {
    for (width, height) in [(0, 0), (1, 1), (1, 500), (500, 1), (2, 2), (3, 8), (8, 8), (200, 100)] {
        let black = Raster::new(width, height, 1);
        assert!(found(&black).is_empty(), "{width} x {height}");
        let samples = (0..width * height).map(|index| ((index * 7919) % 256) as f32).collect();
        let busy = Raster::from_data(width, height, 1, samples).expect("sizes agree");
        assert!(found(&busy).iter().all(|segment| segment.start.iter().chain(&segment.end).all(|end| end.is_finite())));
    }
}

#[test]
fn pixels_that_are_not_numbers_take_no_part() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        assert!(found(&Raster::from_data(40, 40, 1, vec![bad; 1600]).expect("sizes")).is_empty());
        let mut picture = half_plane(100, [40.0, 50.0], 0.0);
        picture.pixel_mut(80, 50)[0] = bad;
        let segments = found(&picture);
        assert!(segments.iter().all(|segment| segment.start.iter().chain(&segment.end).all(|end| end.is_finite())));
        assert!(segments.iter().any(|segment| segment.length() > 95.0));
    }
}

#[test]
fn wrong_input_is_refused() {
    let context = StageContext::default();
    let color = Raster::new(20, 20, 3);
    assert!(matches!(detect(&color, &LineOptions::default(), &context), Err(Error::Input { .. })));
    let options = LineOptions { min_length_px: f64::NAN };
    let Err(Error::Options(invalid)) = detect(&Raster::new(20, 20, 1), &options, &context) else {
        panic!("options out of range are refused");
    };
    assert_eq!(invalid.len(), 1);
    let token = CancelToken::default();
    token.cancel();
    let cancelled = StageContext::new(&Silent, &token);
    assert!(matches!(detect(&Raster::new(20, 20, 1), &LineOptions::default(), &cancelled), Err(Error::Cancelled)));
}

#[test]
fn any_number_of_threads_gives_the_same_segments() {
    let picture = steps(256);
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| found(&picture))
    };
    let alone = with_threads(1);
    assert!(alone.len() > 10, "{} segments", alone.len());
    assert_eq!(alone, with_threads(2));
    assert_eq!(alone, with_threads(5));
}

#[test]
fn segments_come_longest_first_and_no_more_than_asked_for() {
    let picture = steps(256);
    let all = found(&picture);
    assert!(all.windows(2).all(|pair| pair[0].length() >= pair[1].length()));
    let shuffled = all.iter().rev().copied().collect();
    assert_eq!(tidy::longest_first(shuffled, 0.0, 5), all[..5]);
    let long = found_from(&picture, 50.0);
    assert!(!long.is_empty() && long.iter().all(|segment| segment.length() >= 50.0));
}

#[test]
fn segments_along_the_frame_are_dropped() {
    let framed = half_plane(100, [3.0, 50.0], 0.0);
    assert!(found(&framed).is_empty());
    let kept = detect_keeping_frame(&framed, &LineOptions::default(), &StageContext::default());
    assert_eq!(kept.expect("valid input").len(), 1);
    // Far enough, or only partly near.
    assert_eq!(found(&half_plane(100, [8.0, 50.0], 0.0)).len(), 1);
    assert_eq!(found(&half_plane(100, [3.0, 3.0], 0.8)).len(), 0);
    assert_eq!(found(&half_plane(100, [4.0, 50.0], 0.1)).len(), 1);
}

#[test]
fn an_interrupted_edge_is_merged_if_asked_to() {
    let point = [60.4, 60.0];
    let mut picture = half_plane(120, point, 0.3);
    for y in 54..66 {
        picture.row_mut(y).fill(130.0);
    }
    let near_edge = |segments: &[LineSegment]| -> Vec<LineSegment> {
        let near = |segment: &&LineSegment| segment.length() >= 30.0 && errors(segment, point, 0.3).1.abs() < 5.0;
        segments.iter().filter(near).copied().collect()
    };
    let segments = detect_keeping_frame(&picture, &LineOptions::default(), &StageContext::default());
    let segments = segments.expect("valid input");
    let apart = near_edge(&segments);
    assert_eq!(apart.len(), 2, "{apart:?}");
    let merged = near_edge(&merged(&segments));
    assert_eq!(merged.len(), 1, "{merged:?}");
    assert!(merged[0].length() > 110.0);
    let (distance, turn) = errors(&merged[0], point, 0.3);
    assert!(distance.abs() < 0.1 && turn.abs() < 0.1, "{distance} px, {turn} deg");
}

/// The photograph turned by a quarter: what was at (x, y) is at (height - y, x).
fn quarter_turn(picture: &Raster<f32>) -> Raster<f32> {
    let mut turned = Raster::new(picture.height(), picture.width(), 1);
    for y in 0..picture.height() {
        for x in 0..picture.width() {
            turned.pixel_mut(picture.height() - 1 - y, x)[0] = picture.pixel(x, y)[0];
        }
    }
    turned
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Where the edge goes, the segment goes: any direction, any sub-pixel position. One in some thousand is off by a
    /// little more than 0.03 degrees, a twentieth of a pixel over its length.
    #[test]
    fn segments_follow_the_edge(angle in 0.0..std::f64::consts::TAU, x in 45.0..55.0, y in 45.0..55.0) {
        let segments = found(&half_plane(100, [x, y], angle));
        prop_assert_eq!(segments.len(), 1);
        let (distance, turn) = errors(&segments[0], [x, y], angle);
        prop_assert!(distance.abs() < 0.05 && turn.abs() < 0.05, "{} px, {} deg", distance, turn);
    }

    /// A photograph turned by a quarter has its segments turned, up to the order in which equal pixels are visited.
    #[test]
    fn a_quarter_turn_turns_the_segments(angle in 0.0..std::f64::consts::TAU, x in 30.0..50.0) {
        let picture = half_plane(80, [x, 40.0], angle);
        let original = found(&picture);
        let turned = found(&quarter_turn(&picture));
        prop_assert_eq!(original.len(), turned.len());
        for (original, turned) in original.iter().zip(&turned) {
            for (end, other) in [(original.start, turned.start), (original.end, turned.end)] {
                prop_assert!((80.0 - end[1] - other[0]).abs() < 0.3, "{:?} {:?}", end, other);
                prop_assert!((end[0] - other[1]).abs() < 0.3, "{:?} {:?}", end, other);
            }
        }
    }

    /// Nothing in a photograph makes the detector fail.
    #[test]
    fn any_small_picture_is_survived(width in 1_usize..24, height in 1_usize..24, seed in any::<u64>()) {
        let mut generator = StageContext::default().generator("any", seed);
        let samples = (0..width * height).map(|_| f32::from_bits(generator.next_u32())).collect();
        let picture = Raster::from_data(width, height, 1, samples).expect("sizes agree");
        for segment in found(&picture).into_iter().chain(merged(&rough(&picture, -10.0))) {
            prop_assert!(segment.start.iter().chain(&segment.end).all(|coordinate| coordinate.is_finite()));
        }
    }
}
