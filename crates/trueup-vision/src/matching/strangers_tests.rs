use trueup_core::matches::{PairVerdict, PointMatches};

use super::*;

/// Files of which nothing is known.
fn found(frames: &[WorkingFrame], pairs: &[PairMatches]) -> Vec<Stranger> {
    find_strangers(&StrangersInput { frames, pairs, by_camera: &[], taken: &[], marked: &[], copies: true })
}

/// Joined by what moves a point of `a` by (`right`, `down`) into `b` and makes it `scale` times as large.
fn pair(a: usize, b: usize, scale: f64, right: f64, down: f64) -> PairMatches {
    PairMatches {
        a,
        b,
        putative: 100,
        in_overlap: 100,
        agreeing: 97,
        needed: 30,
        verdict: PairVerdict::Joined,
        b_from_a: Some([[scale, 0.0, right], [0.0, scale, down], [0.0, 0.0, 1.0]]),
        inliers: PointMatches::default(),
        elsewhere: PointMatches::default(),
    }
}

/// Frames of pictures of these sizes in full pixels, measured at half of them.
fn frames(sizes: &[[f64; 2]]) -> Vec<WorkingFrame> {
    let frame =
        |[width, height]: &[f64; 2]| WorkingFrame { width: width / 2.0, height: height / 2.0, working_from_full: 0.5 };
    sizes.iter().map(frame).collect()
}

/// Three photographs of a row, and as number 3 a picture of `size` full pixels that begins `left` working pixels left
/// of the first one.
fn row_and(size: [f64; 2], left: f64) -> Vec<Stranger> {
    let frames = frames(&[[600.0, 400.0], [600.0, 400.0], [600.0, 400.0], size]);
    let pairs = [
        pair(0, 1, 1.0, -150.0, 0.0),
        pair(1, 2, 1.0, -150.0, 0.0),
        pair(0, 3, 1.0, left, 5.0),
        pair(1, 3, 1.0, left + 150.0, 5.0),
        pair(2, 3, 1.0, left + 300.0, 5.0),
    ];
    found(&frames, &pairs)
}

#[test]
fn a_panorama_of_the_others_is_found() {
    let expected = Stranger { photograph: 3, kind: StrangerKind::Panorama { of: vec![0, 1, 2] } };
    assert_eq!(row_and([1240.0, 420.0], 10.0), [expected]);
}

/// Its rows above and below are cut off: 300 of the photographs' 400.
#[test]
fn a_cropped_panorama_of_the_others_is_found() {
    let frames = frames(&[[600.0, 400.0], [600.0, 400.0], [600.0, 400.0], [1180.0, 300.0]]);
    let pairs = [
        pair(0, 1, 1.0, -150.0, 0.0),
        pair(1, 2, 1.0, -150.0, 0.0),
        pair(0, 3, 1.0, -5.0, -25.0),
        pair(1, 3, 1.0, 145.0, -25.0),
        pair(2, 3, 1.0, 295.0, -25.0),
    ];
    let expected = Stranger { photograph: 3, kind: StrangerKind::Panorama { of: vec![0, 1, 2] } };
    assert_eq!(found(&frames, &pairs), [expected]);
}

/// Larger than its neighbors, which show most of it, each.
#[test]
fn a_photograph_of_another_size_in_a_dense_row_is_one() {
    let frames = frames(&[[600.0, 400.0], [600.0, 400.0], [660.0, 390.0]]);
    let pairs = [pair(0, 1, 1.0, -120.0, 0.0), pair(0, 2, 1.0, -45.0, 0.0), pair(1, 2, 1.0, 75.0, 0.0)];
    assert_eq!(found(&frames, &pairs), []);
}

/// 1,215 x 810 is a camera's format: a camera with a wider lens may have seen all of them, and what lies above and
/// below. Two thirds of each neighbor's view is the middle one's, and each was cropped otherwise.
#[test]
fn photographs_that_were_cropped_by_hand_are_ones() {
    let frames = frames(&[[560.0, 330.0], [600.0, 350.0], [530.0, 340.0]]);
    let row = |b_from_a: [f64; 2]| [pair(0, 1, 1.0, b_from_a[0], 0.0), pair(1, 2, 1.0, b_from_a[1], 0.0)];
    assert_eq!(found(&frames, &row([-90.0, -110.0])), []);
}

/// A crop of one of a row shows less than its neighbors.
#[test]
fn a_photograph_that_was_cropped_is_one() {
    let frames = frames(&[[600.0, 400.0], [460.0, 390.0], [600.0, 400.0]]);
    let pairs = [pair(0, 1, 1.0, -100.0, -5.0), pair(1, 2, 1.0, 30.0, 5.0), pair(0, 2, 1.0, -70.0, 0.0)];
    assert_eq!(found(&frames, &pairs), []);
}

#[test]
fn what_a_camera_can_have_taken_is_a_photograph() {
    assert_eq!(row_and([1215.0, 810.0], 10.0), []);
}

/// Two rows of two, which together show 900 x 600 in full pixels, and as number 4 a picture of that size in which their
/// lengths are `scale` times theirs, that begins `left` working pixels left of them.
fn block_and(scale: f64, left: f64) -> Vec<Stranger> {
    let corners = [[0.0, 0.0], [150.0, 0.0], [0.0, 100.0], [150.0, 100.0]];
    let mut frames = frames(&[[600.0, 400.0]; 4]);
    frames.push(WorkingFrame { width: 450.0 * scale, height: 300.0 * scale, working_from_full: 0.5 });
    let mut pairs = Vec::new();
    for (b, at_b) in corners.iter().enumerate() {
        pairs.extend((0..b).map(|a| pair(a, b, 1.0, corners[a][0] - at_b[0], corners[a][1] - at_b[1])));
        pairs.push(pair(b, 4, scale, scale * (at_b[0] + left), scale * at_b[1]));
    }
    found(&frames, &pairs)
}

#[test]
fn a_panorama_of_a_cameras_format_shows_nothing_but_its_photographs() {
    let expected = [Stranger { photograph: 4, kind: StrangerKind::Panorama { of: vec![0, 1, 2, 3] } }];
    assert_eq!(block_and(1.0, 0.0), expected);
    assert_eq!(block_and(0.5, 0.0), expected);
    // It shows more detail than they do, or a tenth of it lies beside them.
    assert_eq!(block_and(1.4, 0.0), []);
    assert_eq!(block_and(1.0, 45.0), []);
}

/// It shows a thing near that four photographs of the other side of the room show far, and matches these by that alone;
/// and a part of what a fifth one shows, which it matches everywhere.
#[test]
fn a_photograph_of_what_others_show_far_is_one() {
    let mut frames = frames(&[[600.0, 400.0]; 4]);
    frames.extend([WorkingFrame { width: 450.0, height: 300.0, working_from_full: 0.5 }; 2]);
    let corners = [[0.0, 0.0], [150.0, 0.0], [0.0, 100.0], [150.0, 100.0]];
    let matched = |pair: PairMatches, count: usize| {
        let at = |k: usize| [10.0 + (k % 20) as f64, 20.0 + (k / 20) as f64];
        PairMatches { inliers: (0..count).map(|k| PointMatch { in_a: at(k), in_b: at(k) }).collect(), ..pair }
    };
    let strangers = |count: usize| {
        let mut pairs = vec![matched(pair(4, 5, 1.0, -150.0, 0.0), 600)];
        for (b, at_b) in corners.iter().enumerate() {
            pairs.extend((0..b).map(|a| pair(a, b, 1.0, corners[a][0] - at_b[0], corners[a][1] - at_b[1])));
            pairs.push(matched(pair(b, 4, 1.0, at_b[0], at_b[1]), count));
        }
        found(&frames, &pairs)
    };
    assert_eq!(strangers(50), []);
    assert_eq!(strangers(300), [Stranger { photograph: 4, kind: StrangerKind::Panorama { of: vec![0, 1, 2, 3] } }]);
}

/// Without it, the left and the right half would not overlap.
#[test]
fn what_holds_the_others_together_is_a_photograph() {
    let frames = frames(&[[600.0, 800.0], [600.0, 800.0], [1200.0, 800.0]]);
    assert_eq!(found(&frames, &[pair(0, 2, 1.0, 0.0, 0.0), pair(1, 2, 1.0, 300.0, 0.0)]), []);
}

/// It shows the three, and as much beside them: 600 of 2,600 columns are theirs.
#[test]
fn what_shows_much_beside_the_others_is_a_photograph() {
    assert_eq!(row_and([2600.0, 420.0], 300.0), []);
}

#[test]
fn neighbors_in_a_row_are_photographs() {
    let frames = frames(&[[610.0, 350.0]; 4]);
    let pairs = [pair(0, 1, 1.0, -20.0, 0.0), pair(1, 2, 1.0, -20.0, 0.0), pair(0, 2, 1.0, -10.0, 0.0)];
    assert_eq!(found(&frames, &pairs), []);
}

#[test]
fn a_smaller_picture_of_the_same_view_is_a_copy() {
    let frames = frames(&[[150.0, 100.0], [600.0, 400.0], [600.0, 400.0], [300.0, 200.0]]);
    // The photographs 1 and 2 differ in their exposure alone: both stay.
    let pairs = [
        pair(0, 1, 4.0, 0.0, 0.0),
        pair(0, 2, 4.0, 0.0, 0.0),
        pair(0, 3, 2.0, 0.0, 0.0),
        pair(1, 2, 1.0, 0.0, 0.0),
        pair(1, 3, 0.5, 0.0, 0.0),
    ];
    let copy = |photograph, of| Stranger { photograph, kind: StrangerKind::ReducedCopy { of } };
    assert_eq!(found(&frames, &pairs), [copy(0, 1), copy(3, 1)]);
}

/// A part of the view, enlarged: it may be of a longer lens.
#[test]
fn a_part_of_a_view_is_a_photograph() {
    let frames = frames(&[[300.0, 200.0], [600.0, 400.0]]);
    assert_eq!(found(&frames, &[pair(0, 1, 1.0, 60.0, 40.0)]), []);
}

/// The same view, with matches `off` working pixels from the same place.
fn same_place(a: usize, b: usize, off: f64) -> PairMatches {
    let matched = |k: usize| {
        let at = [10.0 + 3.0 * k as f64, 20.0 + 2.0 * k as f64];
        PointMatch { in_a: at, in_b: [at[0] + off, at[1]] }
    };
    PairMatches { inliers: (0..60).map(matched).collect(), ..pair(a, b, 1.0, off, 0.0) }
}

/// A row of three photographs, and as number 3 a picture of the second one's view.
fn row_with_copy(off: f64, by_camera: &[bool], taken: &[Option<String>], copies: bool) -> Vec<Stranger> {
    marked_row_with_copy(off, by_camera, taken, &[], copies)
}

fn marked_row_with_copy(
    off: f64,
    by_camera: &[bool],
    taken: &[Option<String>],
    marked: &[bool],
    copies: bool,
) -> Vec<Stranger> {
    let mut frames = frames(&[[600.0, 400.0]; 4]);
    frames[3] = WorkingFrame { working_from_full: 0.5 / 1.03, ..frames[1] };
    let mut pairs = vec![pair(0, 1, 1.0, -150.0, 0.0), pair(1, 2, 1.0, -150.0, 0.0), same_place(1, 3, off)];
    pairs.push(pair(0, 3, 1.0, -150.0, 0.0));
    find_strangers(&StrangersInput { frames: &frames, pairs: &pairs, by_camera, taken, marked, copies })
}

#[test]
fn of_copies_the_one_with_metadata_is_kept_or_the_larger() {
    let copy = |photograph, of| [Stranger { photograph, kind: StrangerKind::EditedCopy { of } }];
    assert_eq!(row_with_copy(0.1, &[true, true, true, false], &[], true), copy(3, 1));
    assert_eq!(row_with_copy(0.1, &[], &[], true), copy(1, 3));
    // Another photograph of the same view, and what is not to be looked for.
    assert_eq!(row_with_copy(0.8, &[], &[], true), []);
    assert_eq!(row_with_copy(0.1, &[], &[], false), []);
    let taken = ["1", "2", "3", "4"].map(|second| Some(format!("2024:05:04 10:00:0{second}")));
    assert_eq!(row_with_copy(0.1, &[], &taken, true), []);
}

/// An exposure of a bracket with a mask stands for itself, and so does what the others are fused to.
#[test]
fn what_a_photographer_marked_is_no_copy() {
    for marked in [1, 3] {
        let marked: Vec<bool> = (0..4).map(|photograph| photograph == marked).collect();
        assert_eq!(marked_row_with_copy(0.1, &[], &[], &marked, true), []);
    }
    let of_another = [true, false, false, false];
    assert_eq!(marked_row_with_copy(0.1, &[], &[], &of_another, true).len(), 1);
}

#[test]
fn two_copies_alone_are_both_kept() {
    assert_eq!(found(&frames(&[[600.0, 400.0]; 2]), &[same_place(0, 1, 0.0)]), []);
}
