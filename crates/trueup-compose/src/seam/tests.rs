use std::ops::Range;

use proptest::prelude::*;

use super::*;

const WHOLE: u8 = PARTLY | WHOLLY;

/// A view of the box, gray, by level.
fn view(columns: Range<usize>, rows: Range<usize>, level: impl Fn(usize, usize) -> u8) -> View {
    let pixels = rows
        .clone()
        .flat_map(|y| columns.clone().map(move |x| (x, y)))
        .map(|(x, y)| {
            let level = level(x, y);
            [level, level, level, WHOLE]
        })
        .collect();
    View { columns, rows, pixels }
}

fn find(views: Vec<View>, size: [usize; 2], options: &SeamOptions) -> Seams {
    run(views, size, false, options, &StageContext::default()).expect("views on a canvas")
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
            let options = SeamOptions { coarse_pixels, ..SeamOptions::default() };
            let seams = find(vec![first.clone(), second.clone()], [160, 100], &options);
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

#[test]
fn clipped_parts_are_shown_by_who_is_not_clipped() {
    let first = view(0..100, 0..60, |_, y| if y < 20 { 255 } else { 100 });
    let second = view(20..120, 0..60, |_, y| if y < 20 { 235 } else { 100 });
    let mut clipped = first;
    for pixel in clipped.pixels.iter_mut().filter(|pixel| pixel[0] == 255) {
        pixel[3] |= CLIPPED;
    }
    let options = SeamOptions { clipped_cost: 8.0, ..SeamOptions::default() };
    let seams = find(vec![clipped, second], [120, 60], &options);
    assert!((30..100).all(|x| seams.labels()[5 * 120 + x] == 1));
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
        let seams = find(vec![first.clone(), second.clone()], [120, 40], &SeamOptions::default());
        for at in (0..4000).filter(|&at| inside(at)) {
            assert_eq!(seams.labels()[at / 100 * 120 + at % 100], label);
        }
    }
}

#[test]
fn finer_canvases_ask_the_same_labels() {
    let seams =
        find(vec![view(0..50, 0..20, texture), view(30..80, 0..20, texture)], [80, 20], &SeamOptions::default());
    let mut row = Vec::new();
    seams.row(40, &(0..320), [320, 80], &mut row);
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
    assert!(run(vec![view(0..9, 0..9, texture)], [8, 9], false, &options, &context).is_err());
    assert!(
        run(vec![View { pixels: vec![], ..view(0..9, 0..9, texture) }], [9, 9], false, &options, &context).is_err()
    );
    assert!(run(vec![], [0, 9], false, &options, &context).is_err());
    let empty = run(vec![], [3, 2], false, &options, &context).expect("an empty canvas");
    assert!(empty.labels().iter().all(|&label| label == NOBODY));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]

    #[test]
    fn every_covered_pixel_shows_someone_who_covers_it(
        boxes in prop::collection::vec((0..50_usize, 0..30_usize, 8..40_usize, 8..30_usize), 1..6),
        coarse_pixels in prop::sample::select(vec![1_000.0, 1e6]),
    ) {
        let views: Vec<View> = boxes
            .iter()
            .enumerate()
            .map(|(index, &(x, y, w, h))| view(x..(x + w).min(64), y..(y + h).min(48), |x, y| (x * 3 + y * 5 + index * 40) as u8))
            .collect();
        let options = SeamOptions { coarse_pixels, ..SeamOptions::default() };
        let seams = find(views.clone(), [64, 48], &options);
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
