use nalgebra::{Matrix3, Rotation3, Vector3};
use trueup_core::raster::Raster;

use super::*;

const WIDTH: usize = 200;
const HEIGHT: usize = 150;

/// Light, white being 1, with detail of several sizes that repeats nowhere, at a place in focal lengths from the middle
/// of a scene.
fn light(x: f64, y: f64) -> f64 {
    let sum: f64 =
        [(0.02, 0.5), (0.06, 1.0), (0.2, 1.5)].iter().map(|(size, much)| much * noise(x / size, y / size)).sum();
    0.3 * sum.exp()
}

/// Smooth between random numbers of -1 to 1 at whole places.
fn noise(x: f64, y: f64) -> f64 {
    let at = |x: f64, y: f64| {
        let mixed = (x as i64 as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ (y as i64 as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((mixed ^ (mixed >> 32)) % 2001) as f64 / 1000.0 - 1.0
    };
    let smooth = |fraction: f64| fraction * fraction * (3.0 - 2.0 * fraction);
    let (left, top) = (x.floor(), y.floor());
    let (u, v) = (smooth(x - left), smooth(y - top));
    let row = |y: f64| at(left, y) * (1.0 - u) + at(left + 1.0, y) * u;
    row(top) * (1.0 - v) + row(top + 1.0) * v
}

/// What a camera of focal length 200 px, turned by these angles, records of it at this exposure: by a power of 1/2.2,
/// clipped.
fn taken([width, height]: [usize; 2], focal: f64, turn: [f64; 3], exposure: f64) -> Raster<f32> {
    let camera_from_world = Rotation3::from_scaled_axis(Vector3::from(turn));
    let mut picture = Raster::new(width, height, 1);
    for y in 0..height {
        for x in 0..width {
            let ray = Vector3::new(
                (x as f64 + 0.5 - width as f64 / 2.0) / focal,
                (y as f64 + 0.5 - height as f64 / 2.0) / focal,
                1.0,
            );
            let seen = camera_from_world.inverse() * ray;
            let level = 255.0 * (exposure * light(seen.x / seen.z, seen.y / seen.z)).powf(1.0 / 2.2);
            picture.pixel_mut(x, y)[0] = level.clamp(0.0, 255.0).round() as f32;
        }
    }
    picture
}

fn thumbnail(turn: [f64; 3], exposure: f64) -> Raster<u8> {
    let gray = taken([WIDTH, HEIGHT], 200.0, turn, exposure);
    let data = gray.data().iter().flat_map(|&level| [level as u8; 3]).collect();
    Raster::from_data(WIDTH, HEIGHT, 3, data).expect("three channels")
}

fn found(shots: &[([f64; 3], f64)]) -> Vec<FoundStack> {
    let thumbnails: Vec<Raster<u8>> = shots.iter().map(|&(turn, exposure)| thumbnail(turn, exposure)).collect();
    let candidates: Vec<StackCandidate> =
        thumbnails.iter().map(|one| StackCandidate { thumbnail: Some(one), camera: 0, recorded_stops: None }).collect();
    find(&candidates)
}

/// Turned by a hand between exposures, and by half the view between directions.
const DIRECTIONS: [f64; 3] = [0.0, 0.45, 0.9];
const HAND: [[f64; 3]; 3] = [[0.0; 3], [0.004, -0.006, 0.005], [-0.005, 0.008, -0.004]];

#[test]
fn brackets_of_a_row_are_stacks_and_neighbors_are_not() {
    for exposures in [[1.0, 0.2, 5.0], [0.2, 1.0, 5.0], [0.2, 5.0, 1.0]] {
        let turned = |direction: f64| HAND.map(|[x, y, z]| [x, y + direction, z]);
        let shots: Vec<([f64; 3], f64)> =
            DIRECTIONS.into_iter().flat_map(|direction| turned(direction).into_iter().zip(exposures)).collect();
        let stacks = found(&shots);
        let numbers: Vec<Vec<usize>> = stacks
            .iter()
            .map(|stack| {
                let mut all: Vec<usize> = stack.others.iter().map(|one| one.photograph).collect();
                all.push(stack.reference);
                all.sort_unstable();
                all
            })
            .collect();
        assert_eq!(numbers, [[0, 1, 2], [3, 4, 5], [6, 7, 8]], "{exposures:?}");
        for member in stacks.iter().flat_map(|stack| stack.others.iter().map(|one| (stack.reference, one))) {
            let (reference, FoundMember { photograph, stops, .. }) = member;
            // Clipped places are brighter than is seen, and the curve of sRGB is not quite a power.
            let expected = (shots[*photograph].1 / shots[reference].1).log2();
            assert!((0.5..1.2).contains(&(stops / expected)), "{stops} {expected}");
        }
    }
}

#[test]
fn equal_exposures_other_views_and_other_cameras_are_no_stack() {
    let hand = HAND[1];
    assert!(found(&[([0.0; 3], 1.0), (hand, 1.0)]).is_empty(), "one exposure");
    assert!(found(&[([0.0; 3], 1.0), (hand, 1.2)]).is_empty(), "less than half a stop");
    assert!(found(&[([0.0; 3], 1.0), ([0.0, 0.15, 0.0], 4.0)]).is_empty(), "a neighbor in a row");
    let thumbnails = [thumbnail([0.0; 3], 1.0), thumbnail(hand, 4.0)];
    let of = |cameras: [usize; 2]| {
        let candidate =
            |k: usize| StackCandidate { thumbnail: Some(&thumbnails[k]), camera: cameras[k], recorded_stops: None };
        find(&[candidate(0), candidate(1)]).len()
    };
    assert_eq!((of([0, 0]), of([0, 1])), (1, 0));
}

/// A view that comes back after another one was a link to what is no run any more, which the search followed without
/// end.
#[test]
fn a_view_that_comes_back_after_another_is_no_stack_and_the_next_one_is() {
    let [near, far] = [[0.0; 3], [0.0, 0.9, 0.0]];
    assert!(found(&[(near, 1.0), (far, 1.0), (HAND[1], 4.0)]).is_empty());
    let stacks = found(&[(near, 1.0), (far, 1.0), (HAND[1], 4.0), (HAND[2], 0.25)]);
    let numbers: Vec<(usize, usize)> =
        stacks.iter().map(|stack| (stack.reference, stack.others[0].photograph)).collect();
    assert!(matches!(numbers[..], [(2, 3) | (3, 2)]), "{numbers:?}");
}

/// A turn that was photographed dark, then light, then between, with the same rests each time, there or there and back;
/// and the same from other places each time, at one exposure, and with a view in two that does not come again.
#[test]
fn exposures_of_one_pass_after_the_other_are_stacks() {
    let exposures = [0.2, 5.0, 1.0];
    let view = |pass: usize, view: usize| {
        let [x, y, z] = HAND[pass];
        [x, y + DIRECTIONS[view], z]
    };
    let shots = |and_back: bool, off: f64, exposures: [f64; 3]| -> Vec<([f64; 3], f64)> {
        let of_pass = |pass: usize| {
            let views: Vec<usize> = if and_back && pass == 1 { vec![2, 1, 0] } else { vec![0, 1, 2] };
            views.into_iter().map(move |one| {
                let [x, y, z] = view(pass, one);
                ([x, y + off * pass as f64, z], exposures[pass])
            })
        };
        (0..3).flat_map(of_pass).collect()
    };
    let same = numbers(&found(&shots(false, 0.0, exposures)));
    assert_eq!(same, [[0, 3, 6], [1, 4, 7], [2, 5, 8]].map(|stack| (stack.to_vec(), Vec::new())));
    let back = numbers(&found(&shots(true, 0.0, exposures)));
    assert_eq!(back, [[0, 5, 6], [1, 4, 7], [2, 3, 8]].map(|stack| (stack.to_vec(), Vec::new())));
    assert!(found(&shots(false, 0.15, exposures)).is_empty(), "neighbors in a row");
    assert!(found(&shots(false, 0.0, [1.0; 3])).is_empty(), "one exposure");
    let four = numbers(&found(&[0.25, 1.0, 4.0, 0.5].map(|one| DIRECTIONS.map(|yaw| ([0.0, yaw, 0.0], one))).concat()));
    assert_eq!(four, [0, 1, 2].map(|first| (vec![first, first + 3, first + 6, first + 9], Vec::new())));
    let mut half = vec![(view(0, 0), 1.0), (view(0, 1), 1.0), (view(1, 0), 4.0), (view(1, 2), 4.0)];
    assert!(found(&half).is_empty(), "one view of two");
    half[3] = (view(1, 1), 4.0);
    assert_eq!(found(&half).len(), 2);
}

/// The numbers of each stack's photographs, in their order, and of what it can spare.
fn numbers(stacks: &[FoundStack]) -> Vec<(Vec<usize>, Vec<usize>)> {
    let sorted = |stack: &FoundStack| {
        let mut all: Vec<usize> = stack.others.iter().map(|one| one.photograph).chain([stack.reference]).collect();
        all.sort_unstable();
        (all, stack.spare.iter().map(|one| one.photograph).collect())
    };
    stacks.iter().map(sorted).collect()
}

/// Two directions at exposures that are so many stops from the middle, with what is recorded of them if it
/// `is_recorded`.
fn bracketed(stops: &[f64], is_recorded: bool) -> Vec<FoundStack> {
    let shot = |k: usize| {
        let [x, y, z] = HAND[k % HAND.len()];
        let direction = DIRECTIONS[k / stops.len()];
        thumbnail([x, y + direction, z], stops[k % stops.len()].exp2())
    };
    let thumbnails: Vec<Raster<u8>> = (0..2 * stops.len()).map(shot).collect();
    let candidate = |(k, one)| StackCandidate {
        thumbnail: Some(one),
        camera: 0,
        recorded_stops: is_recorded.then(|| 7.0 + stops[k % stops.len()]),
    };
    find(&thumbnails.iter().enumerate().map(candidate).collect::<Vec<_>>())
}

/// Every exposure nearer than half a stop to the one before it was the first of another stack, so that brackets of half
/// and third stops were none.
#[test]
fn brackets_of_small_steps_are_stacks() {
    let steps =
        |count: usize, step: f64| -> Vec<f64> { (0..count).map(|k| (k as f64 - (count / 2) as f64) * step).collect() };
    let third = 1.0 / 3.0;
    let brackets = [
        steps(5, 0.5),
        steps(5, third),
        // In the order of cameras.
        vec![0.0, -third, third],
        vec![0.0, -third, third, -2.0 * third, 2.0 * third],
        steps(12, 0.5),
        steps(9, 0.15),
    ];
    for stops in brackets {
        for is_recorded in [false, true] {
            let count = stops.len();
            let expected = [0, count].map(|first| ((first..first + count).collect(), Vec::new()));
            assert_eq!(numbers(&bracketed(&stops, is_recorded)), expected, "{stops:?} {is_recorded}");
        }
    }
    // What makes a stack of two that are this near is the record alone.
    assert_eq!(numbers(&bracketed(&[0.0, third], true)), [0, 2].map(|first| (vec![first, first + 1], Vec::new())));
    assert!(bracketed(&[0.0, third], false).is_empty());
}

/// Thirty exposures of a view were four photographs of it.
#[test]
fn of_more_exposures_than_are_needed_the_closest_ones_are_spare() {
    let stops: Vec<f64> = (0..20).map(|k| (f64::from(k) - 10.0) / 4.0).collect();
    let stacks = bracketed(&stops, false);
    assert_eq!(stacks.len(), 2, "{stacks:?}");
    for (first, (fused, spare)) in [0, 20].into_iter().zip(numbers(&stacks)) {
        assert_eq!((fused.len(), spare.len()), (MOST_MEMBERS, 20 - MOST_MEMBERS));
        assert!(fused.contains(&first) && fused.contains(&(first + 19)), "the ends of the range: {fused:?}");
        assert!(fused.windows(2).all(|pair| pair[1] - pair[0] <= 2), "no wide gap: {fused:?}");
    }
}

/// A photograph and copies of it that were made a little brighter and darker, as with a camera's record so without, and
/// one of them twice.
#[test]
fn copies_with_other_tones_are_no_stack() {
    let copies = |exposures: &[f64], recorded: Option<f64>| {
        let thumbnails: Vec<Raster<u8>> = exposures.iter().map(|&one| thumbnail([0.0; 3], one)).collect();
        let candidate = |one| StackCandidate { thumbnail: Some(one), camera: 0, recorded_stops: recorded };
        find(&thumbnails.iter().map(candidate).collect::<Vec<_>>()).len()
    };
    assert_eq!(copies(&[1.0, 1.25], None), 0);
    assert_eq!(copies(&[1.0, 1.2, 0.9], None), 0);
    assert_eq!(copies(&[1.0, 1.25, 1.25], None), 0);
    assert_eq!(copies(&[1.0, 1.5, 0.5, 2.0], Some(7.0)), 0);
}

/// An edited copy has the record of its original, and is no third exposure beside a bracket.
#[test]
fn a_copy_of_an_exposure_is_none_of_the_stack() {
    let thumbnails = [1.0, 4.0, 2.0].map(|exposure| thumbnail([0.0; 3], exposure));
    let recorded = [7.0, 9.0, 7.0];
    let candidate =
        |k: usize| StackCandidate { thumbnail: Some(&thumbnails[k]), camera: 0, recorded_stops: Some(recorded[k]) };
    assert_eq!(numbers(&find(&[0, 1, 2].map(candidate))), [(vec![0, 1], Vec::new())]);
}

/// Recorded exposures of 2 stops apart agree with pictures that are; one exposure, and one of the other sign, do not.
#[test]
fn what_cameras_recorded_has_a_voice() {
    let thumbnails = [thumbnail([0.0; 3], 1.0), thumbnail(HAND[1], 4.0)];
    let of = |recorded: Option<f64>| {
        let stops = [recorded.map(|_| 3.0), recorded.map(|stops| 3.0 + stops)];
        let candidate =
            |k: usize| StackCandidate { thumbnail: Some(&thumbnails[k]), camera: 0, recorded_stops: stops[k] };
        find(&[candidate(0), candidate(1)]).len()
    };
    assert_eq!([None, Some(2.0), Some(0.0), Some(-2.0), Some(9.0)].map(of), [1, 1, 0, 0, 0]);
}

/// Somebody takes the same bracket twice: two stacks of one view, not one with every exposure twice.
#[test]
fn where_an_exposure_comes_again_another_stack_begins() {
    let shots = [1.0, 0.2, 5.0, 1.0, 0.2, 5.0].map(|exposure| ([0.0; 3], exposure));
    let stacks = found(&shots);
    assert_eq!(stacks.iter().map(|stack| stack.others.len()).collect::<Vec<_>>(), [2, 2]);
}

/// How far from its true place in the member a place of the reference is aligned, seen in the reference: by the
/// homography of the turn, K R K^-1.
fn off_px(
    aligned: &AlignedMember,
    [width, height]: [usize; 2],
    focal: f64,
    turn: &Rotation3<f64>,
    place: [f64; 2],
) -> f64 {
    let camera = Matrix3::new(focal, 0.0, width as f64 / 2.0, 0.0, focal, height as f64 / 2.0, 0.0, 0.0, 1.0);
    let truth = trueup_core::geometry::Homography(camera * turn.matrix() * camera.try_inverse().expect("a camera"));
    let back = aligned.reference_from_member.apply(truth.apply(place.into()));
    (back - nalgebra::Vector2::from(place)).norm()
}

/// With the focal length unknown to the alignment.
#[test]
fn a_member_is_aligned_to_a_small_part_of_a_pixel() {
    let (size, focal) = ([400, 300], 380.0);
    let turn = [0.006, -0.011, 0.009];
    for (reference, member) in [(1.0, 0.2), (1.0, 4.0), (0.3, 1.5)] {
        let pictures = [taken(size, focal, [0.0; 3], reference), taken(size, focal, turn, member)];
        let pair = MemberPair {
            reference: &pictures[0],
            member: &pictures[1],
            stops: f64::log2(member / reference),
            shift: [0.0; 2],
            focal_px: None,
        };
        let aligned = align(&pair).expect("aligned");
        let turn = Rotation3::from_scaled_axis(Vector3::from(turn));
        for place in [[10.0, 10.0], [390.0, 20.0], [200.0, 150.0], [20.0, 280.0], [380.0, 290.0]] {
            let off = off_px(&aligned, size, focal, &turn, place);
            assert!(off < 0.1, "{off} px at {place:?} of {reference} and {member}");
        }
    }
}

#[test]
fn what_shows_something_else_is_not_aligned() {
    let size = [400, 300];
    let pictures = [taken(size, 380.0, [0.0; 3], 1.0), taken(size, 380.0, [0.0, 1.2, 0.0], 4.0)];
    let pair = MemberPair {
        reference: &pictures[0],
        member: &pictures[1],
        stops: 2.0,
        shift: [0.0; 2],
        focal_px: Some(380.0),
    };
    assert!(matches!(align(&pair), Err(Unaligned::OtherDetails(_) | Unaligned::TooFar(_))));
    let small = taken([20, 20], 20.0, [0.0; 3], 1.0);
    assert_eq!(align(&MemberPair { member: &small, ..pair }), Err(Unaligned::NoPicture));
}

/// All of the member but a tenth is white: from small pictures, which tell next to nothing, the search came away by 30
/// % of a side.
#[test]
fn a_member_that_is_nearly_white_is_not_led_astray() {
    let (size, focal) = ([400, 300], 380.0);
    let turns = [[0.0, 1.5, 0.0], [0.006, 1.489, 0.009]];
    let [reference, mut member] =
        [(turns[0], 1.0), (turns[1], 2.0)].map(|(turn, exposure)| taken(size, focal, turn, exposure));
    for y in 0..size[1] {
        let row = member.row_mut(y);
        row[..200].fill(255.0);
        row[240..].fill(255.0);
    }
    let pair = MemberPair { reference: &reference, member: &member, stops: 1.0, shift: [0.0; 2], focal_px: None };
    let aligned = align(&pair).expect("aligned");
    let [reference, member] = turns.map(|turn| Rotation3::from_scaled_axis(Vector3::from(turn)));
    let turn = member * reference.inverse();
    for place in [[200.0, 20.0], [220.0, 150.0], [240.0, 280.0]] {
        let off = off_px(&aligned, size, focal, &turn, place);
        assert!(off < 0.5, "{off} px at {place:?}");
    }
}
