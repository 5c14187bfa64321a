use std::ops::Range;

use proptest::prelude::*;

use super::*;
use crate::small_views::{CLIPPED, IGNORED, KEPT, PARTLY, WHOLLY};

const WHOLE: u8 = PARTLY | WHOLLY;

/// A view of the box, gray, by level.
fn view(columns: Range<usize>, rows: Range<usize>, level: impl Fn(usize, usize) -> u8) -> SmallView {
    let pixels = rows
        .clone()
        .flat_map(|y| columns.clone().map(move |x| (x, y)))
        .map(|(x, y)| {
            let level = level(x, y);
            [level, level, level, WHOLE]
        })
        .collect();
    SmallView { columns, rows, pixels }
}

fn find(views: &[SmallView], size: [usize; 2], options: &SeamOptions) -> Seams {
    let input = SeamInput { views, size, around: false };
    run(&input, options, &StageContext::default()).expect("views on a canvas")
}

/// The seams as they are found from a canvas of so many pixels on.
fn find_from(coarse_pixels: f64, views: &[SmallView], size: [usize; 2], around: bool) -> Seams {
    let input = SeamInput { views, size, around };
    coarse_to_fine(&input, coarse_pixels, &SeamOptions::default(), &StageContext::default()).expect("views on a canvas")
}

fn texture(x: usize, y: usize) -> u8 {
    (100 + (x * 7 + y * 13) % 11) as u8
}

#[test]
fn a_thing_that_moved_is_shown_whole_or_not_at_all() {
    // The overlap is 40..120; the thing stands at its middle in the first view only, then reaches out of the second.
    for (left, right) in [(70, 95), (100, 135), (30, 60)] {
        let inside = move |x: usize, y: usize| (left..right).contains(&x) && (30..62).contains(&y);
        let first = view(0..120, 0..100, |x, y| if inside(x, y) { 220 } else { texture(x, y) });
        let second = view(40..160, 0..100, texture);
        for coarse_pixels in [1e6, 4_000.0] {
            let seams = find_from(coarse_pixels, &[first.clone(), second.clone()], [160, 100], false);
            let labels: Vec<Label> = (0..16_000)
                .filter(|at| inside(at % 160, at / 160) && at % 160 >= 40 && at % 160 < 120)
                .map(|at| seams.labels()[at])
                .collect();
            let shown = labels.iter().filter(|&&label| label == 0).count();
            assert!(shown == 0 || shown == labels.len(), "{left}: {shown} of {} at {coarse_pixels}", labels.len());
            // What only one view covers is that view's.
            assert!((0..100).all(|y| seams.labels()[y * 160 + 10] == 0 && seams.labels()[y * 160 + 150] == 1));
        }
    }
}

/// In the middle of the overlap one photograph brightens by 2 levels a column beside the other; they agree along one
/// column, but no transition hides that slope. Elsewhere they differ by 12 levels of alternating sign, which mean
/// nothing at a distance.
#[test]
fn seams_keep_away_from_slopes_of_shading() {
    let slope = 70..90;
    let level = |x: usize, y: usize| match (slope.contains(&x), (x + y) % 2) {
        (true, _) => (2 * x - 40) as u8,
        (false, 0) => 108,
        (false, _) => 132,
    };
    let rows_within = |shading_weight: f64| {
        let options = SeamOptions { shading_weight, sharpness_weight: 0.0, ..SeamOptions::default() };
        let views = [view(0..120, 0..60, |_, _| 120), view(40..160, 0..60, level)];
        let seams = find(&views, [160, 60], &options);
        (0..60).filter(|y| slope.contains(&(0..160).find(|x| seams.labels()[y * 160 + x] == 1).unwrap_or(0))).count()
    };
    assert_eq!(rows_within(0.0), 60);
    assert_eq!(rows_within(3.0), 0);
}

#[test]
fn clipped_parts_are_shown_by_who_is_not_clipped() {
    let first = view(0..100, 0..60, |_, y| if y < 40 { 255 } else { 100 });
    let second = view(20..120, 0..60, |_, y| if y < 40 { 235 } else { 100 });
    let mut clipped = first;
    for pixel in clipped.pixels.iter_mut().filter(|pixel| pixel[0] == 255) {
        pixel[3] |= CLIPPED;
    }
    let options = SeamOptions { depth_weight: 0.4, ..SeamOptions::default() };
    let seams = find(&[clipped, second], [120, 60], &options);
    assert!((30..100).all(|x| seams.labels()[5 * 120 + x] == 1));
}

/// A sky that the first photograph has white, 20 levels above the second one's, whose border lies at column 20: the
/// deepest of its pixels are 30 from it, so that transitions want 6. Where the step counts, the second photograph is
/// shown only from there on.
#[test]
fn steps_between_photographs_are_left_room() {
    let mut clipped = view(0..100, 0..60, |_, _| 255);
    clipped.pixels.iter_mut().for_each(|pixel| pixel[3] |= CLIPPED);
    let gray = |level: u8| view(20..120, 0..60, move |_, _| level);
    let first_shown = |shading_weight: f64, level: u8| {
        let options = SeamOptions { depth_weight: 0.4, shading_weight, ..SeamOptions::default() };
        let seams = find(&[clipped.clone(), gray(level)], [120, 60], &options);
        (0..120).find(|x| seams.labels()[30 * 120 + x] == 1).expect("shown")
    };
    assert!(first_shown(0.0, 235) < 23, "{}", first_shown(0.0, 235));
    assert!(first_shown(3.0, 235) >= 25, "{}", first_shown(3.0, 235));
    // A step that any transition hides is none.
    assert_eq!(first_shown(3.0, 248), first_shown(0.0, 248));
}

#[test]
fn what_is_in_focus_is_shown() {
    // Columns of 80 and 120 levels. The first photograph, deeper by far where both show them, has them blurred in a
    // disc.
    let inside = |x: usize, y: usize| x.abs_diff(70).pow(2) + y.abs_diff(40).pow(2) < 20 * 20;
    let stripes = |x: usize| if x.is_multiple_of(2) { 80 } else { 120 };
    let first = view(0..160, 0..80, |x, y| if inside(x, y) { 100 } else { stripes(x) });
    let second = view(30..110, 0..80, |x, _| stripes(x));
    let shown = |sharpness_weight: f64| {
        let options = SeamOptions { sharpness_weight, ..SeamOptions::default() };
        let seams = find(&[first.clone(), second.clone()], [160, 80], &options);
        let disc = (0..160 * 80).filter(|at| inside(at % 160, at / 160));
        disc.filter(|&at| seams.labels()[at] == 1).count()
    };
    assert_eq!(shown(0.0), 0);
    let all = (0..160 * 80).filter(|at| inside(at % 160, at / 160)).count();
    assert!(shown(SeamOptions::default().sharpness_weight) > all * 9 / 10);
}

#[test]
fn wishes_of_the_user_are_obeyed() {
    let mut first = view(0..100, 0..40, texture);
    let second = view(20..120, 0..40, texture);
    let inside = |at: usize| (40..70).contains(&(at % 100)) && (10..30).contains(&(at / 100));
    for (flag, label) in [(IGNORED, 1), (KEPT, 0)] {
        for at in 0..4000 {
            first.pixels[at][3] = if inside(at) { WHOLE | flag } else { WHOLE };
        }
        let seams = find(&[first.clone(), second.clone()], [120, 40], &SeamOptions::default());
        for at in (0..4000).filter(|&at| inside(at)) {
            assert_eq!(seams.labels()[at / 100 * 120 + at % 100], label);
        }
    }
}

#[test]
fn finer_canvases_ask_the_same_labels() {
    let seams = find(&[view(0..50, 0..20, texture), view(30..80, 0..20, texture)], [80, 20], &SeamOptions::default());
    let mut row = Vec::new();
    seams.row(40, &(0..320), [320, 80], &mut row);
    assert_eq!(row.len(), 320);
    for (x, label) in row.iter().enumerate() {
        // A seam may move by less than a pixel of the small canvas.
        let near = [x.saturating_sub(4), x, (x + 4).min(319)].map(|x| seams.labels()[10 * 80 + x / 4]);
        assert!(near.contains(label), "{x}");
    }
    assert_eq!(seams.shown_in(&(0..40), &(0..80), [320, 80]), [0]);
    assert_eq!(seams.shown_in(&(0..320), &(0..80), [320, 80]), [0, 1]);
}

#[test]
fn views_outside_the_canvas_are_refused() {
    let context = StageContext::default();
    let options = SeamOptions::default();
    let find = |views: &[SmallView], size| run(&SeamInput { views, size, around: false }, &options, &context);
    assert!(find(&[view(0..9, 0..9, texture)], [8, 9]).is_err());
    assert!(find(&[SmallView { pixels: vec![], ..view(0..9, 0..9, texture) }], [9, 9]).is_err());
    assert!(find(&[], [0, 9]).is_err());
    let empty = find(&[], [3, 2]).expect("an empty canvas");
    assert!(empty.labels().iter().all(|&label| label == NOBODY));
}

/// Views of a scene that repeats after `around` columns, on that cylinder; each begins at a column and has a width. All
/// columns are moved to the right by `by`.
fn ring(around: usize, boxes: &[(usize, usize)], by: usize) -> Vec<SmallView> {
    let level = move |x: usize, y: usize, index: usize| {
        let thing = index == 0 && (4..14).contains(&x) && (10..24).contains(&y);
        if thing { 230 } else { 60 + (x * 7 + y * 13 + index * 3) % 41 }
    };
    let of = |(index, &(start, length)): (usize, &(usize, usize))| {
        let start = (start + by) % around;
        let there = move |x: usize| (x + around - by % around) % around;
        view(start..start + length, 0..40, move |x, y| level(there(x), y, index) as u8)
    };
    boxes.iter().enumerate().map(of).collect()
}

/// Wherever the cylinder is cut open, the seams are the same.
#[test]
fn the_seams_of_a_cylinder_have_no_end() {
    let boxes = [(100, 50), (20, 60), (60, 60), (8, 20)];
    // On the coarse canvas alone at any column; over two halvings at multiples of four.
    for (coarse_pixels, steps) in [(1e6, vec![1, 7, 20, 64, 119]), (1_000.0, vec![4, 20, 64, 116])] {
        let find = |by| find_from(coarse_pixels, &ring(120, &boxes, by), [120, 40], true);
        let still = find(0);
        assert!(still.labels().iter().all(|&label| label != NOBODY));
        for by in steps {
            let moved = find(by);
            for at in 0..120 * 40 {
                let (x, y) = (at % 120, at / 120);
                assert_eq!(moved.labels()[y * 120 + (x + by) % 120], still.labels()[at], "({x}, {y}) by {by}");
            }
            // Between pixels, too: at four times the size, half a pixel from the ends.
            let (mut here, mut there) = (Vec::new(), Vec::new());
            for y in 0..160 {
                still.row_around(y, &(0..480), 0.0, [480.0, 160.0], &mut here);
                moved.row_around(y, &(4 * by..480 + 4 * by), 0.0, [480.0, 160.0], &mut there);
                assert_eq!(here, there, "{y} by {by}");
            }
            let shown = |seams: &Seams, from: usize| seams.shown_in(&(from..from + 60), &(0..160), [480, 160]);
            assert_eq!(shown(&moved, 4 * by), shown(&still, 0));
        }
        // The thing at the cut is shown whole or not at all.
        let shown = (4..14).filter(|&x| still.labels()[17 * 120 + x] == 0).count();
        assert!(shown == 0 || shown == 10, "{shown}");
    }
}

/// A view that goes all the way round gives way where another one is wanted, across the ends, and is shown elsewhere.
#[test]
fn a_view_may_go_all_the_way_round() {
    let mut views = vec![view(0..64, 0..40, texture), view(50..90, 0..20, |x, y| texture(x % 64, y))];
    for (at, pixel) in views[1].pixels.iter_mut().enumerate() {
        // From column 54 to column 21, of which the last 22 lie in the next turn.
        let inside = (4..36).contains(&(at % 40)) && (4..16).contains(&(at / 40));
        pixel[3] |= if inside { KEPT } else { 0 };
    }
    let seams = find_from(COARSE_PIXELS, &views, [64, 40], true);
    assert!((0..64).all(|x| seams.labels()[35 * 64 + x] == 0));
    let kept = |x: usize| !(22..54).contains(&x);
    // The first column of a view that goes all round is the one that it cannot take back.
    assert!((0..64).filter(|&x| kept(x)).all(|x| seams.labels()[8 * 64 + x] == 1));
    assert!((30..46).all(|x| seams.labels()[8 * 64 + x] == 0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]

    #[test]
    fn every_covered_pixel_shows_someone_who_covers_it(
        boxes in prop::collection::vec((0..50_usize, 0..30_usize, 8..40_usize, 8..30_usize), 1..6),
        coarse_pixels in prop::sample::select(vec![1_000.0, 1e6]),
    ) {
        let views: Vec<SmallView> = boxes
            .iter()
            .enumerate()
            .map(|(index, &(x, y, w, h))| view(x..(x + w).min(64), y..(y + h).min(48), |x, y| (x * 3 + y * 5 + index * 40) as u8))
            .collect();
        let seams = find_from(coarse_pixels, &views, [64, 48], false);
        for y in 0..48 {
            for x in 0..64 {
                let covering = views.iter().filter(|view| view.flags(x, y, 0) != 0).count();
                let label = seams.labels()[y * 64 + x];
                if covering > 0 {
                    prop_assert!(views[usize::from(label)].flags(x, y, 0) != 0, "({}, {}): {}", x, y, label);
                }
            }
        }
    }
}
