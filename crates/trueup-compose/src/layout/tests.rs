use std::borrow::Cow;

use trueup_core::mesh::GridMesh;

use super::*;

fn placed(scale: f64, shift: [f64; 2]) -> Placed {
    let mut mesh = GridMesh::regular(400.0, 300.0, 40.0);
    for vertex in &mut mesh.target {
        *vertex = [vertex[0] * scale + shift[0], vertex[1] * scale + shift[1]];
    }
    Placed { photograph: 0, mesh }
}

#[test]
fn the_reference_keeps_its_pixel_scale() {
    let context = StageContext::default();
    let photographs = vec![placed(0.25, [-7.0, 3.0]), placed(0.5, [43.0, 3.0])];
    let layout = run(photographs.clone(), 0, &CanvasOptions::default(), &context).expect("two grids");
    // In units of 0.25: the first spans 400 px, the second starts 200 px in and is twice as large.
    assert_eq!((layout.width, layout.height), (1000, 600));
    assert!((layout.canvas_from_target - 4.0).abs() < 1e-12);
    let half = CanvasOptions { scale: 0.5, ..CanvasOptions::default() };
    let layout = run(photographs, 1, &half, &context).expect("two grids");
    assert_eq!((layout.width, layout.height), (250, 150));
    assert!(context.findings().is_empty());
}

#[test]
fn a_canvas_above_the_limit_is_reduced_and_reported() {
    let context = StageContext::default();
    let options = CanvasOptions { max_pixels: 1000.0, ..CanvasOptions::default() };
    let layout = run(vec![placed(1.0, [0.0, 0.0])], 0, &options, &context).expect("one grid");
    assert!(layout.width * layout.height <= 1000);
    assert!(layout.width * layout.height > 900, "{} x {}", layout.width, layout.height);
    assert_eq!(context.findings()[0].code, "canvas-reduced");
}

#[test]
fn a_cylinder_is_its_period_in_whole_pixels_around_the_middle() {
    let context = StageContext::default();
    // From -10 to 490, with a period of 380.3: 59.85 beyond each end. 384 is the nearest multiple of 8.
    let photographs = vec![placed(1.0, [-10.0, 3.0]), placed(1.0, [90.0, 3.0])];
    let options = CanvasOptions::default();
    let layout = run_around(photographs.clone(), 0, Some(380.3), &options, &context).expect("two grids");
    assert_eq!((layout.width, layout.height, layout.period), (384, 303, Some(384)));
    let share = 384.0 / 380.3;
    assert!((layout.canvas_from_target - share).abs() < 1e-12);
    let (low, _) = layout.placed[0].mesh.bounds();
    let (_, high) = layout.placed[1].mesh.bounds();
    assert!((low.x + 59.85 * share).abs() < 1e-9 && (high.x - 384.0 - 59.85 * share).abs() < 1e-9);
    assert!(run_around(photographs.clone(), 0, Some(f64::NAN), &options, &context).is_err());
    // Each lies across one end, and so is placed there again; 100 px further out, both are seen once more.
    let (wide, originals) = layout.unrolled(0);
    assert_eq!((originals.as_slice(), wide.width, wide.period), ([0, 0, 1, 1].as_slice(), 384, None));
    let (wide, originals) = layout.unrolled(100);
    assert_eq!((originals.as_slice(), wide.width), ([0, 0, 0, 1, 1, 1].as_slice(), 584));
    assert!((wide.placed[1].mesh.target[0][0] - wide.placed[0].mesh.target[0][0] - 384.0).abs() < 1e-9);
    let first = layout.placed[0].in_first_turn(layout.period);
    assert!((first.mesh.bounds().0.x - (384.0 - 59.85 * share)).abs() < 1e-9);
    let second = layout.placed[1].in_first_turn(layout.period);
    assert_eq!(second, Cow::Borrowed(&layout.placed[1]));
    assert_eq!(columns_around(350..420, Some(380)), (350..420, 0));
    assert_eq!(columns_around(390..420, Some(380)), (10..40, 0));
    assert_eq!(columns_around(390..800, Some(380)), (0..380, 10));
    assert_eq!(columns_around(390..800, None), (390..800, 0));
    let flat = run(photographs, 0, &options, &context).expect("two grids");
    assert_eq!(flat.unrolled(100), (Cow::Borrowed(&flat), vec![0, 1]));
}

/// Whatever the scale: the width is a whole number of times a power of two that it holds 32 times, no more than a 64th
/// from what was asked for; the height is that of the scale which was used.
#[test]
fn a_turn_is_a_whole_number_of_the_samples_of_a_blend() {
    let context = StageContext::default();
    for scale in [0.01, 0.1, 0.33, 1.0, 1.37, 2.9, 7.7, 16.0] {
        let options = CanvasOptions { scale, ..CanvasOptions::default() };
        let around = |placed| run_around(placed, 0, Some(4380.3), &options, &context).expect("two grids");
        let layout = around(vec![placed(1.0, [-10.0, 3.0]), placed(1.0, [4000.0, 90.2])]);
        let wanted = 4380.3 * scale;
        // 32 times 8 pixels; below, units of 8 change the scale by more.
        let most = if wanted < 256.0 { 4.0 / wanted } else { 1.0 / 64.0 };
        assert!((layout.width as f64 / wanted - 1.0).abs() <= most, "{} {wanted}", layout.width);
        let unit = 1 << layout.width.trailing_zeros();
        assert!(unit >= 8 && unit * 64 > layout.width, "{}", layout.width);
        assert_eq!(layout.height as f64, (387.2 * layout.width as f64 / 4380.3 - 1e-6).ceil(), "at {scale}");
        assert!((layout.canvas_from_target * 4380.3 - layout.width as f64).abs() < 1e-9);
    }
}

#[test]
fn a_framed_turn_is_shown_whole_within_the_pixels_allowed() {
    let context = StageContext::default();
    let photographs = || vec![placed(1.0, [-10.0, 3.0]), placed(1.0, [4000.0, 90.2])];
    let window = Some([Vector2::new(-100.0, 10.0), Vector2::new(900.0, 200.0)]);
    let frame = Frame { canvas_from_target: 1.0, window, period: Some(4380.3), whole_from: None };
    let layout = framed(photographs(), &frame, &CanvasOptions::default(), &context).expect("two grids");
    assert_eq!((layout.width, layout.height, layout.period), (4352, 189, Some(4352)));
    for max_pixels in [1.0, 5.0, 100.0, 3000.0, 700_000.0] {
        let options = CanvasOptions { max_pixels, ..CanvasOptions::default() };
        let layout = framed(photographs(), &frame, &options, &context).expect("two grids");
        assert!((layout.width * layout.height) as f64 <= max_pixels, "{} x {}", layout.width, layout.height);
        assert_eq!(layout.period, Some(layout.width));
    }
}

/// Grids that reach over 303 units of a window of 606: half of it.
#[test]
fn a_window_that_is_all_but_shown_is_shown_whole() {
    let shown = |bottom: f64, whole_from: Option<f64>| {
        let photographs = vec![placed(1.0, [-10.0, 13.0]), placed(1.0, [3000.0, 10.0])];
        let window = Some([Vector2::new(-100.0, 10.0), Vector2::new(900.0, bottom)]);
        let frame = Frame { canvas_from_target: 1.0, window, period: Some(4096.0), whole_from };
        let options = CanvasOptions::default();
        let layout = framed(photographs, &frame, &options, &StageContext::default()).expect("two grids");
        (layout.width, layout.height, layout.origin[1])
    };
    assert_eq!(shown(616.0, None), (4096, 303, 10.0));
    assert_eq!(shown(616.0, Some(0.51)), (4096, 303, 10.0));
    assert_eq!(shown(616.0, Some(0.5)), (4096, 606, 10.0));
    assert_eq!(shown(606.0, Some(0.5)), (4096, 596, 10.0));
}

#[test]
fn a_canvas_that_runs_away_is_reduced() {
    let context = StageContext::default();
    let options = CanvasOptions::default();
    // Two photographs of 0.12 million pixels, 100,000 of their widths apart.
    let far = vec![placed(1.0, [0.0, 0.0]), placed(1.0, [4e7, 0.0])];
    let layout = run(far, 0, &options, &context).expect("two grids");
    assert!(layout.width * layout.height <= 400_000_000);
    assert_eq!(context.findings()[0].code, "canvas-reduced");
    // One of them enlarged to 1.2 billion pixels is what was asked for.
    let context = StageContext::default();
    let large = CanvasOptions { scale: 16.0, ..options };
    let mut photograph = placed(1.0, [0.0, 0.0]);
    (photograph.mesh.width, photograph.mesh.height) = (4000.0, 3000.0);
    photograph.mesh.target.iter_mut().flatten().for_each(|coordinate| *coordinate *= 10.0);
    let layout = run(vec![photograph], 0, &large, &context).expect("one grid");
    assert_eq!((layout.width, layout.height), (64_000, 48_000));
    assert!(context.findings().is_empty());
}

#[test]
fn a_very_long_strip_is_reduced_too() {
    let mut strip = placed(1.0, [0.0, 0.0]);
    for vertex in &mut strip.mesh.target {
        vertex[0] *= 1e9;
        vertex[1] *= 1e-9;
    }
    let options = CanvasOptions { max_pixels: 1e5, ..CanvasOptions::default() };
    let layout = run(vec![strip], 0, &options, &StageContext::default()).expect("one grid");
    assert!(layout.width <= 100_000 && layout.height == 1);
}

#[test]
fn unusable_grids_are_named() {
    let context = StageContext::default();
    let options = CanvasOptions::default();
    let mut infinite = placed(1.0, [0.0, 0.0]);
    infinite.mesh.target[5][1] = f64::INFINITY;
    assert!(matches!(run(vec![infinite], 0, &options, &context), Err(Error::Unsolvable { .. })));
    let mut short = placed(1.0, [0.0, 0.0]);
    short.mesh.target.pop();
    assert!(matches!(run(vec![short], 0, &options, &context), Err(Error::Input { .. })));
    assert!(matches!(run(vec![], 0, &options, &context), Err(Error::Input { .. })));
    let point = placed(0.0, [0.0, 0.0]);
    assert!(matches!(run(vec![point], 0, &options, &context), Err(Error::Unsolvable { .. })));
    let bad = CanvasOptions { scale: 0.0, ..options };
    assert!(matches!(run(vec![], 0, &bad, &context), Err(Error::Options(_))));
}
