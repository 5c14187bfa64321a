use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use proptest::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::mask::Mask;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::{Photograph, Raster};

use super::*;
use crate::label::Label;
use crate::layout::{CanvasLayout, Placed};
use crate::light::{Corrections, PhotographLight};
use crate::memory_plan::{MemoryNeeds, photograph_bytes};
use crate::render::test_rendering::{compose, roots};
use crate::render::{Blend, Interpolation, RenderOptions, Resources};
use crate::seam::{self, SeamInput, SeamOptions};
use crate::small_views::{self, SmallViewsInput};
use crate::test_photographs::Memory;
use crate::warped::WarpedPhotograph;

const WIDTH: usize = 150;
const HEIGHT: usize = 110;

/// A scene with contours and texture, 8-bit levels.
fn scene(x: usize, y: usize) -> [u8; 3] {
    let texture = (x * 7 + y * 13) % 23;
    let block = if (x / 17 + y / 13).is_multiple_of(2) { 60 } else { 150 };
    [(block + texture) as u8, (block / 2 + 40 + y / 4) as u8, (200 - block + x / 8) as u8]
}

/// A photograph of the scene at column `left`, its levels changed by `look`.
fn photograph(left: usize, look: impl Fn(u8) -> u8) -> Photograph {
    let data = (0..WIDTH * HEIGHT).flat_map(|at| scene(left + at % WIDTH, at / WIDTH).map(&look)).collect();
    Photograph::Eight(Raster::from_data(WIDTH, HEIGHT, 3, data).expect("as many samples"))
}

fn layout(lefts: &[usize]) -> CanvasLayout {
    let placed = lefts
        .iter()
        .enumerate()
        .map(|(photograph, &left)| {
            let mut mesh = GridMesh::regular(WIDTH as f64, HEIGHT as f64, 40.0);
            for vertex in &mut mesh.target {
                vertex[0] += left as f64;
            }
            Placed { photograph, mesh }
        })
        .collect();
    let width = WIDTH + lefts.iter().copied().max().unwrap_or(0);
    CanvasLayout { width, height: HEIGHT, canvas_from_target: 1.0, origin: [0.0; 2], placed, period: None }
}

fn composed(layout: &CanvasLayout, photographs: Vec<Photograph>, options: &RenderOptions) -> Vec<RootPixel> {
    let corrections = Corrections::plain(photographs.len());
    let panorama = compose(layout, &corrections, &Memory(photographs), options, &StageContext::default());
    roots(&panorama.expect("renders"))
}

fn root_of(level: u8) -> u16 {
    (crate::transfer_curve::Linearize::of(&TransferCurve::SRGB).linear(f32::from(level)).sqrt() * 65535.0 + 0.5) as u16
}

#[test]
fn blending_photographs_that_agree_changes_nothing() {
    let lefts = [0, 70, 130, 200];
    let layout = layout(&lefts);
    // Photographs taken from different places agree but for what their own samples lost; the same one agrees with
    // itself.
    let half_a_level = 65535 / 255 / 2;
    for (blend, tolerance) in [(Blend::MultiBand, half_a_level), (Blend::None, 1)] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let pixels = composed(&layout, lefts.map(|left| photograph(left, |level| level)).to_vec(), &options);
        for (at, pixel) in pixels.iter().enumerate() {
            let expected = scene(at % layout.width, at / layout.width).map(root_of);
            for (got, expected) in pixel.iter().zip(expected) {
                assert!(got.abs_diff(expected) <= tolerance, "{at}: {got} {expected}");
            }
            assert_eq!(pixel[3], 65535, "{at}");
        }
    }
    let layout = self::layout(&[0, 0, 0]);
    let pixels = composed(&layout, vec![photograph(9, |level| level); 3], &RenderOptions::default());
    for (at, pixel) in pixels.iter().enumerate() {
        let expected = scene(9 + at % WIDTH, at / WIDTH).map(root_of);
        assert!(pixel.iter().zip(expected).all(|(got, expected)| got.abs_diff(expected) <= 1), "{at}");
    }
}

#[test]
fn a_difference_in_brightness_fades_over_the_seam() {
    let lefts = [0, 60];
    let layout = layout(&lefts);
    let flat = |level: u8| photograph(0, move |_| level);
    let options = RenderOptions::default();
    let pixels = composed(&layout, vec![flat(100), flat(120)], &options);
    let row: Vec<u16> = (0..layout.width).map(|x| pixels[55 * layout.width + x][0]).collect();
    let (low, high) = (root_of(100), root_of(120));
    assert!(row.iter().all(|level| (low - 2..=high + 2).contains(level)));
    let steepest = row.windows(2).map(|pair| pair[0].abs_diff(pair[1])).max().unwrap_or(0);
    assert!(steepest < (high - low) / 8, "{steepest} of {}", high - low);
    let cut = composed(&layout, vec![flat(100), flat(120)], &RenderOptions { blend: Blend::None, ..options });
    assert!((0..layout.width).all(|x| [low, high].contains(&cut[55 * layout.width + x][0])));
}

/// A photograph that ends at a contour knows of one side only. Where it agrees with another that knows both, the
/// panorama is that other one, on both sides.
#[test]
fn a_sky_beside_the_border_of_a_dark_photograph_stays_bright() {
    const ROOF: usize = 50;
    let of = |top: usize| {
        let level = |at: usize| if top + at / WIDTH < ROOF { 240 } else { 30 };
        let data = (0..WIDTH * HEIGHT).flat_map(|at| [level(at); 3]).collect();
        Photograph::Eight(Raster::from_data(WIDTH, HEIGHT, 3, data).expect("as many samples"))
    };
    let mut layout = layout(&[0, 70]);
    layout.placed[1].mesh.target.iter_mut().for_each(|vertex| vertex[1] += ROOF as f64);
    layout.height += ROOF;
    // Wide transitions, whose samples are as large as what lies above the roof.
    let options = RenderOptions { transition: 0.5, ..RenderOptions::default() };
    let pixels = composed(&layout, vec![of(0), of(ROOF)], &options);
    let covered = || pixels.iter().enumerate().filter(|(_, pixel)| pixel[3] == 65535);
    // Two photographs of which less than half overlaps.
    assert!(covered().count() > 3 * WIDTH * HEIGHT / 2, "{}", covered().count());
    for (at, pixel) in covered() {
        let (x, y) = (at % layout.width, at / layout.width);
        // Within two samples of the first level that is blended as a whole, both photographs' own contours count.
        if y.abs_diff(ROOF) > 16 {
            let expected = root_of(if y < ROOF { 240 } else { 30 });
            // A 25th of white; means of one side made it a quarter.
            assert!(pixel[0].abs_diff(expected) <= 65535 / 25, "{} {expected} at ({x}, {y})", pixel[0]);
        }
    }
}

/// A dark coat on a pavement, in one of two photographs: wherever the seam runs, neither lies on the other as fog.
#[test]
fn a_thing_that_one_photograph_alone_shows_does_not_lie_over_the_seam() {
    const COAT: [Range<usize>; 2] = [84..112, 60..HEIGHT];
    let of = |is_there: bool| {
        let level = |at: usize| {
            let coat = is_there && COAT[0].contains(&(at % WIDTH)) && COAT[1].contains(&(at / WIDTH));
            if coat { 40 } else { 150 }
        };
        let data = (0..WIDTH * HEIGHT).flat_map(|at| [level(at); 3]).collect();
        Photograph::Eight(Raster::from_data(WIDTH, HEIGHT, 3, data).expect("as many samples"))
    };
    let layout = layout(&[0, 30]);
    let options = RenderOptions { transition: 0.5, ..RenderOptions::default() };
    let pixels = composed(&layout, vec![of(true), of(false)], &options);
    let is_near = |range: &Range<usize>, at: usize| range.start.abs_diff(at).min(range.end.abs_diff(at)) <= 16;
    let mut asked = 0;
    for (at, pixel) in pixels.iter().enumerate() {
        let (x, y) = (at % layout.width, at / layout.width);
        // Within two samples of the first level that is blended as a whole, contours count; the second photograph
        // begins at column 30.
        if is_near(&COAT[0], x) || is_near(&COAT[1], y) || x.abs_diff(30) <= 16 {
            continue;
        }
        asked += 1;
        let off = [40, 150].map(|level| pixel[0].abs_diff(root_of(level))).into_iter().min().unwrap_or(u16::MAX);
        // Three of 255 levels.
        assert!(off <= 65535 / 85, "{off} at ({x}, {y})");
    }
    assert!(asked > 5000, "{asked}");
}

#[test]
fn no_border_of_the_panorama_is_darker_than_its_photographs() {
    let mut layout = layout(&[0, 80]);
    layout.placed[1].mesh.target.iter_mut().for_each(|vertex| {
        *vertex = [vertex[0] + 0.1 * vertex[1] + 3.3, 0.9 * vertex[1] + 0.07 * vertex[0]];
    });
    layout.width += 20;
    let options = RenderOptions::default();
    let pixels = composed(&layout, vec![photograph(0, |_| 140), photograph(0, |_| 150)], &options);
    let covered = pixels.iter().filter(|pixel| pixel[3] > 0);
    let (low, high) = (root_of(140) - 8, root_of(150) + 8);
    assert!(covered.clone().all(|pixel| pixel[..3].iter().all(|level| (low..=high).contains(level))));
    assert!(covered.count() > WIDTH * HEIGHT);
}

/// Everything that tiles need, of photographs that differ in brightness.
fn with_work<T>(
    lefts: &[usize],
    first_level: u32,
    test: impl FnOnce(&mut BlendWork<'_>, &[Option<WarpedPhotograph<'_>>]) -> T,
) -> T {
    let layout = layout(lefts);
    let photographs: Vec<Photograph> = (0..lefts.len())
        .map(|index| photograph(lefts[index], |level| (usize::from(level) * (10 + index) / 12) as u8))
        .collect();
    let corrections = vec![Correction::default(); lefts.len()];
    let context = StageContext::default();
    let memory = Memory(photographs.clone());
    let levels = WholeLevels { first_level, above: 2 };
    let unrolled = Unrolled::new(&layout, first_level, Some(levels.above)).expect("few");
    let bytes = photograph_bytes(&layout, &memory);
    let (needed, in_parts) = needed_bytes(&unrolled, Some(levels), &bytes);
    let needs = MemoryNeeds::new(&layout, bytes, needed, Some(in_parts));
    let plan = MemoryPlan::new(&needs, &Resources::unlimited().allowed()).expect("no limit");
    let input = SmallViewsInput {
        unrolled: &unrolled,
        corrections: &corrections,
        local: None,
        photographs: &memory,
        view_levels: None,
        first_level: Some(first_level),
        border: None,
        plan: &plan,
    };
    let small = small_views::run(&input, &context).expect("small");
    let input = SeamInput { views: &small.views, size: small.size, around: false };
    let seams = seam::run(&input, &SeamOptions::default(), &context).expect("seams");
    let shown = ShownWhere { unrolled: &unrolled, seams: &seams };
    let canvas = [layout.width, layout.height];
    let levels = Some(BlendedLevels::new(small.coarse_levels, shown, levels, 2).expect("in memory"));
    let ignored = vec![None; unrolled.placed().len()];
    let resampling = Resampling::of(Interpolation::Bicubic);
    let mut work = BlendWork { resampling, shown, first_level, levels, ignored };
    let light = PhotographLight { curve: &TransferCurve::SRGB, correction: &Correction::default(), local: None };
    let warped: Vec<Option<WarpedPhotograph<'_>>> = photographs
        .into_iter()
        .zip(&layout.placed)
        .map(|(photograph, placed)| {
            Some(WarpedPhotograph::new(Cow::Owned(photograph), &placed.mesh, canvas, light, &resampling))
        })
        .collect();
    test(&mut work, &warped)
}

fn blended(
    work: &BlendWork<'_>,
    photographs: &[Option<WarpedPhotograph<'_>>],
    columns: Range<usize>,
    rows: Range<usize>,
) -> Vec<RootPixel> {
    let shown: Vec<(Label, &WarpedPhotograph<'_>)> = photographs
        .iter()
        .enumerate()
        .filter_map(|(label, photograph)| Some((label as Label, photograph.as_ref()?)))
        .collect();
    let mut pixels = vec![[0; 4]; columns.len() * rows.len()];
    let mut out: Vec<&mut [RootPixel]> = pixels.chunks_exact_mut(columns.len()).collect();
    let tile = BlendTile { columns: columns.clone(), rows, shown: Vec::new() };
    tile.blended(&mut out, work, &shown, &mut SamplingMemory::default());
    pixels
}

#[test]
fn tiles_of_any_size_give_the_same_bits_as_the_whole() {
    for first_level in [3, 4] {
        with_work(&[0, 60, 130], first_level, |work, photographs| assert_that_tiles_give_the_whole(work, photographs));
    }
}

fn assert_that_tiles_give_the_whole(work: &BlendWork<'_>, photographs: &[Option<WarpedPhotograph<'_>>]) {
    let [width, height] = work.shown.unrolled.canvas();
    let whole = blended(work, photographs, 0..width, 0..height);
    // There is something to be compared: all of it is covered, and no two of its rows are alike.
    assert!(whole.len() == width * height && whole.iter().all(|pixel| pixel[3] == u16::MAX));
    assert!(whole.chunks_exact(width).collect::<Vec<_>>().windows(2).all(|rows| rows[0] != rows[1]));
    for side in [2, 5, 8, 16].map(|samples| samples << work.first_level) {
        for top in (0..height).step_by(side) {
            for left in (0..width).step_by(side) {
                let (columns, rows) = (left..(left + side).min(width), top..(top + side).min(height));
                let tile = blended(work, photographs, columns.clone(), rows.clone());
                for (y, row) in rows.zip(tile.chunks_exact(columns.len())) {
                    assert_eq!(row, &whole[y * width..][columns.clone()], "tile of {side} at ({left}, {top})");
                }
            }
        }
    }
}

/// All of one photograph is ignored, and where the other is shown, that one ends three columns ahead of the canvas: the
/// seams, found in small views, know no better. Who else is there is seen in these columns.
#[test]
fn what_is_ignored_fills_what_nobody_else_covers() {
    with_work(&[0, 60], 3, |work, photographs| {
        let [width, height] = work.shown.unrolled.canvas();
        let moved = |number: usize, left: usize| {
            let photograph = photographs[number].as_ref().expect("a photograph").photograph().0.clone();
            let light =
                PhotographLight { curve: &TransferCurve::SRGB, correction: &Correction::default(), local: None };
            let mesh = &layout(&[left]).placed[0].mesh;
            Some(WarpedPhotograph::new(Cow::Owned(photograph), mesh, [width, height], light, &work.resampling))
        };
        let photographs = [moved(0, 60), moved(1, 57)];
        let opacity = |work: &BlendWork<'_>| -> Vec<u16> {
            let pixels = blended(work, &photographs, 0..width, 0..height);
            pixels[50 * width..][170..width].iter().map(|pixel| pixel[3]).collect()
        };
        assert_eq!(opacity(work), [u16::MAX; 40]);
        work.ignored[0] = Some(Arc::new(Mask::from_fn(WIDTH, HEIGHT, |_, _| true)));
        assert_eq!(opacity(work), [u16::MAX; 40]);
    });
}

#[test]
fn the_level_that_is_blended_as_a_whole_follows_from_the_canvas() {
    assert_eq!(first_level([1, 1]), 3);
    // 2000 x 2000 samples of 8 pixels, and one more.
    assert_eq!(first_level([16_000, 16_000]), 3);
    assert_eq!(first_level([16_001, 16_000]), 4);
    assert_eq!(first_level([40_000, 25_000]), 4);
    // 3125 x 1563 samples of 128 pixels are too many.
    assert_eq!(first_level([400_000, 200_000]), 8);
}

#[test]
fn a_tile_of_one_photograph_is_what_blending_would_give() {
    with_work(&[0, 60, 130], 3, |work, photographs| {
        let mut compared = 0;
        for left in (0..work.shown.unrolled.canvas()[0] - 24).step_by(8) {
            let tile = BlendTile::new(work, left..left + 24, 40..64);
            if tile.shown.len() == 1 {
                let fast = tile.finish(work, photographs, &mut SamplingMemory::default());
                let full = blended(work, photographs, tile.columns.clone(), tile.rows.clone());
                for (fast, full) in fast.iter().flatten().zip(full.iter().flatten()) {
                    assert!(fast.abs_diff(*full) <= 1, "{fast} {full} at {left}");
                }
                compared += 1;
            }
        }
        assert!(compared >= 5, "{compared}");
    });
}

/// Photographs around a cylinder of `AROUND` columns, the first at column `by`; the last lies across the ends for
/// `by` = 0.
fn ring(by: usize) -> CanvasLayout {
    let mut layout = layout(&RING.map(|left| left + by));
    // As layouts have it: the middle of each photograph within the canvas.
    for placed in &mut layout.placed {
        let middle = placed.mesh.bounds().0.x + WIDTH as f64 / 2.0;
        let turns = (middle / AROUND as f64).floor();
        placed.mesh.target.iter_mut().for_each(|vertex| vertex[0] -= turns * AROUND as f64);
    }
    CanvasLayout { width: AROUND, period: Some(AROUND), ..layout }
}

const AROUND: usize = 384;
const RING: [usize; 4] = [0, 100, 190, 290];

/// Photographs of a scene that repeats, each darker than the one before.
fn ring_photographs() -> Vec<Photograph> {
    let of = |(index, left): (usize, usize)| {
        let level = |level: u8| (usize::from(level) * (20 - index) / 20) as u8;
        let pixel = |at: usize| scene((left + at % WIDTH) % AROUND, at / WIDTH).map(level);
        let data = (0..WIDTH * HEIGHT).flat_map(pixel).collect();
        Photograph::Eight(Raster::from_data(WIDTH, HEIGHT, 3, data).expect("as many samples"))
    };
    RING.into_iter().enumerate().map(of).collect()
}

fn composed_in_any_way(layout: &CanvasLayout, blend: Blend) -> Vec<[f32; 4]> {
    composed_around(layout, &RenderOptions { blend, ..RenderOptions::default() })
}

fn composed_around(layout: &CanvasLayout, options: &RenderOptions) -> Vec<[f32; 4]> {
    let corrections = Corrections::plain(RING.len());
    let context = StageContext::default();
    let panorama = compose(layout, &corrections, &Memory(ring_photographs()), options, &context).expect("renders");
    // Square roots of light, as the eye sees steps.
    let root = |at: usize| panorama.linear_pixel(at % AROUND, at / AROUND).expect("in memory").map(f32::sqrt);
    (0..AROUND * HEIGHT).map(root).collect()
}

/// Whether there is anything to be seen: most pixels differ from those beside them.
fn varies(pixels: &[[f32; 4]]) -> bool {
    pixels.windows(2).filter(|pair| pair[0] != pair[1]).count() > pixels.len() / 2
}

/// Wherever a cylinder is cut open, the panorama is the same: to rounding if the samples of all levels fall on the same
/// places, and else as far as a pyramid's samples between two pixels differ.
#[test]
fn a_cylinder_may_be_cut_open_anywhere() {
    for blend in [Blend::MultiBand, Blend::None, Blend::Feather, Blend::Average] {
        let still = composed_in_any_way(&ring(0), blend);
        assert!(still.iter().all(|pixel| pixel[3] == 1.0) && varies(&still), "{blend:?}");
        for (by, tolerance) in [(64, 1e-4), (320, 1e-4), (150, 0.012)] {
            // The search for seams sees pixels of twice the size on canvases of half, a quarter and an eighth.
            let tolerance = if by == 150 && blend != Blend::MultiBand { 1e-4 } else { tolerance };
            let moved = composed_in_any_way(&ring(by), blend);
            for (at, still) in still.iter().enumerate() {
                let place = at / AROUND * AROUND + (at + by) % AROUND;
                for (moved, still) in moved[place].iter().zip(still) {
                    assert!((moved - still).abs() <= tolerance, "{blend:?} by {by} at {at}: {moved} {still}");
                }
            }
        }
    }
}

/// The ends of a turn are places like any other at all levels, up to samples of a third of the turn: moved by whole
/// ones of them, the panorama is moved and nothing else.
#[test]
fn all_levels_of_a_turn_repeat() {
    let period = ring(0).period.expect("a turn");
    for (transition, levels) in [(0.1, 0), (0.25, 2), (0.5, 3), (1.0, 4)] {
        let options = RenderOptions { transition, ..RenderOptions::default() };
        assert_eq!(WholeLevels::of(&ring(0), transition), WholeLevels { first_level: 3, above: levels });
        let coarsest = 8 << levels;
        assert!(period.is_multiple_of(coarsest));
        let still = composed_around(&ring(0), &options);
        assert!(still.iter().all(|pixel| pixel[3] == 1.0) && varies(&still), "{transition}");
        for by in [128, 256] {
            let moved = composed_around(&ring(by), &options);
            for (at, still) in still.iter().enumerate() {
                let place = at / AROUND * AROUND + (at + by) % AROUND;
                for (moved, still) in moved[place].iter().zip(still) {
                    assert!((moved - still).abs() <= 1e-4, "{transition} by {by} at {at}: {moved} {still}");
                }
            }
        }
    }
    // Of 376 columns a turn has a whole number of samples of 8; none that are wider are blended.
    let odd = CanvasLayout { width: 376, period: Some(376), ..ring(0) };
    assert_eq!(WholeLevels::of(&odd, 1.0).above, 0);
}

#[test]
fn the_ends_of_a_cylinder_meet_as_smoothly_as_any_two_columns() {
    let pixels = composed_in_any_way(&ring(0), Blend::MultiBand);
    // What the panorama changes of the scene, by columns: smooth, whatever the scene.
    let column = |x: usize| -> f32 {
        let change = |y: usize| {
            let expected = f32::from(root_of(scene(x, y)[0])) / 65535.0;
            pixels[y * AROUND + x][0] / expected
        };
        (0..HEIGHT).map(change).sum::<f32>() / HEIGHT as f32
    };
    let columns: Vec<f32> = (0..AROUND).map(column).collect();
    let step = |x: usize| columns[(x + 1) % AROUND] - columns[x % AROUND];
    let bend = |x: usize| (step(x + 1) - 0.5 * (step(x) + step(x + 2))).abs();
    let elsewhere = (0..AROUND - 3).map(bend).fold(0.0, f32::max);
    // The photographs beside the ends differ by 15 of 100 in light.
    let ends = (AROUND - 3..AROUND).map(bend).fold(0.0, f32::max);
    assert!(ends <= elsewhere && ends < 3e-4, "{ends} {elsewhere}");
    assert!(pixels.iter().all(|pixel| pixel[3] == 1.0));
}

#[test]
fn threads_change_no_bit_of_a_cylinder() {
    let of_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| [Blend::MultiBand, Blend::Feather].map(|blend| composed_in_any_way(&ring(0), blend)))
    };
    let single = of_threads(1);
    assert!(single.iter().all(|pixels| pixels.iter().all(|pixel| pixel[3] == 1.0) && varies(pixels)));
    assert_eq!(single, of_threads(3));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn blended_levels_stay_between_the_photographs(
        lefts in prop::collection::vec(0..260_usize, 1..5),
        levels in prop::collection::vec(20..235_u8, 5),
    ) {
        let layout = layout(&lefts);
        let photographs: Vec<Photograph> = (0..lefts.len()).map(|index| { let level = levels[index]; photograph(0, move |_| level) }).collect();
        let corrections = Corrections::plain(lefts.len());
        let context = StageContext::default();
        let options = RenderOptions::default();
        let panorama = compose(&layout, &corrections, &Memory(photographs), &options, &context);
        let panorama = panorama.expect("renders");
        let used = &levels[..lefts.len()];
        let linear = |level: u8| crate::transfer_curve::Linearize::of(&TransferCurve::SRGB).linear(f32::from(level));
        let low = used.iter().map(|&level| linear(level)).fold(f32::INFINITY, f32::min) - 1e-4;
        let high = used.iter().map(|&level| linear(level)).fold(0.0, f32::max) + 1e-4;
        for y in 0..layout.height {
            for x in 0..layout.width {
                let covered = lefts.iter().any(|&left| (left..left + WIDTH).contains(&x));
                let [r, _, _, alpha] = panorama.linear_pixel(x, y).expect("in memory");
                prop_assert_eq!(alpha > 0.0, covered);
                prop_assert!(!covered || (low..=high).contains(&r), "{} at ({}, {})", r, x, y);
            }
        }
    }
}
