//! Photographs composed without a limit on memory.

use nalgebra::Vector2;
use trueup_core::Error;
use trueup_core::color::{LightRange, TransferCurve};
use trueup_core::raster::{Photograph, Raster, RowSource};

use super::panorama::PanoramaPixels;
use super::test_rendering::{bits, compose, linear, render, rows};
use super::*;
use crate::layout::{self, CanvasOptions};
use crate::light::{Correction, Corrections};
use crate::test_photographs::{Memory, canvas, gradient, moved, noise};

#[test]
fn an_undeformed_grid_returns_the_photograph() {
    let raster = noise(83, 61, 3);
    for interpolation in [Interpolation::Bilinear, Interpolation::Bicubic] {
        for blend in [Blend::MultiBand, Blend::Feather, Blend::Average, Blend::None] {
            let options = RenderOptions { interpolation, blend, ..RenderOptions::default() };
            let placed = vec![moved(0, 83.0, 61.0, |p| p.into())];
            let context = StageContext::default();
            let layout = layout::run(placed, 0, &CanvasOptions::default(), &context).expect("one grid");
            assert_eq!((layout.width, layout.height), (83, 61));
            let bytes = rows(&render(&layout, vec![Photograph::Eight(raster.clone())], &options));
            for (got, expected) in bytes.chunks_exact(4).zip(raster.data().chunks_exact(3)) {
                assert_eq!((&got[..3], got[3]), (expected, 255));
            }
        }
    }
}

#[test]
fn gray_masked_and_deep_photographs_come_back_too() {
    let gray = noise(40, 30, 1);
    let masked = Raster::from_data(40, 30, 4, gray.data().iter().flat_map(|&v| [v, 0, 9, v | 1]).collect());
    let deep = Raster::from_data(40, 30, 3, gray.data().iter().flat_map(|&v| [u16::from(v) * 257; 3]).collect());
    let layout = canvas(40, 30, vec![moved(0, 40.0, 30.0, |p| p.into())]);
    let options = RenderOptions::default();
    let from_gray = rows(&render(&layout, vec![Photograph::Eight(gray.clone())], &options));
    let from_deep = rows(&render(&layout, vec![Photograph::Sixteen(deep.expect("deep"))], &options));
    assert_eq!(from_gray, from_deep);
    for (got, &level) in from_gray.chunks_exact(4).zip(gray.data()) {
        assert_eq!(got, [level, level, level, 255]);
    }
    let from_masked = rows(&render(&layout, vec![Photograph::Eight(masked.expect("masked"))], &options));
    for (got, &level) in from_masked.chunks_exact(4).zip(gray.data()) {
        assert_eq!(got, [level, 0, 9, level | 1]);
    }
}

#[test]
fn a_shift_by_half_a_pixel_moves_a_gradient_by_half_a_step() {
    let photograph = gradient(64, 48, |x, y| 20.0 + 2.0 * x + y);
    let layout = canvas(65, 49, vec![moved(0, 64.0, 48.0, |p| [p.x + 0.5, p.y + 0.5])]);
    let bytes = rows(&render(&layout, vec![photograph], &RenderOptions::default()));
    for y in 3..46 {
        for x in 3..61 {
            let expected = 20.0 + 2.0 * x as f64 + y as f64;
            let got = f64::from(bytes[(y * 65 + x) * 4]);
            assert!((got - expected).abs() <= 1.0, "({x}, {y}): {got} for {expected}");
        }
    }
    // The border runs through the centers of the first column: half covered, and no darker for it.
    let edge = &bytes[(20 * 65) * 4..][..4];
    assert_eq!(edge[3], 128);
    assert!(edge[0] >= 41, "{edge:?}");
}

#[test]
fn the_border_is_anti_aliased_where_it_runs_askew() {
    let photograph = gradient(60, 60, |_, _| 180.0);
    let turn = nalgebra::Rotation2::new(0.3);
    let center = Vector2::new(50.0, 50.0);
    let layout = canvas(100, 100, vec![moved(0, 60.0, 60.0, |p| (turn * (p - Vector2::repeat(30.0)) + center).into())]);
    let bytes = rows(&render(&layout, vec![photograph], &RenderOptions::default()));
    let covered: f64 = bytes.chunks_exact(4).map(|pixel| f64::from(pixel[3]) / 255.0).sum();
    assert!((covered - 3600.0).abs() < 4.0, "{covered}");
    let partial = bytes.chunks_exact(4).filter(|pixel| pixel[3] > 0 && pixel[3] < 255).count();
    assert!(partial > 200, "{partial}");
    for pixel in bytes.chunks_exact(4).filter(|pixel| pixel[3] > 0) {
        assert_eq!(&pixel[..3], [180; 3]);
    }
}

#[test]
fn an_inner_border_leaves_no_trace_on_equal_photographs() {
    let options = RenderOptions::default();
    let photograph = gradient(60, 60, |_, _| 137.0);
    let layout = canvas(
        90,
        60,
        vec![moved(0, 60.0, 60.0, |p| p.into()), moved(1, 60.0, 60.0, |p| [p.x + 29.7, p.y * 0.9 + 2.3])],
    );
    let bytes = rows(&render(&layout, vec![photograph.clone(), photograph], &options));
    for pixel in bytes.chunks_exact(4).filter(|pixel| pixel[3] > 0) {
        assert_eq!(&pixel[..3], [137; 3]);
    }
    assert!(bytes.chunks_exact(4).take(60).all(|pixel| pixel[3] == 255));
}

#[test]
fn gains_act_on_linear_light() {
    let layout = canvas(30, 30, vec![moved(0, 30.0, 30.0, |p| p.into())]);
    let photographs = Memory(vec![gradient(30, 30, |_, _| 100.0)]);
    let options = RenderOptions { look: Look::Linear, ..RenderOptions::default() };
    let context = StageContext::default();
    let panorama =
        compose(&layout, &vec![Correction::uniform(2.0)].into(), &photographs, &options, &context).expect("renders");
    // sRGB 100 is 0.127438 in linear light; twice that, levelled off by 0.1 %, is level 137.6.
    assert!((linear(&panorama, 15, 15)[0] - 0.254_876 / 1.000_987).abs() < 2e-5);
    assert_eq!(&rows(&panorama)[..4], [138, 138, 138, 255]);
    assert!(matches!(
        compose(&layout, &Corrections::plain(0), &photographs, &options, &context),
        Err(Error::Input { .. })
    ));
    let bad = vec![Correction::uniform(f64::NAN)].into();
    assert!(matches!(compose(&layout, &bad, &photographs, &options, &context), Err(Error::Input { .. })));
}

#[test]
fn a_reduced_panorama_shows_means_not_single_samples() {
    // A one-pixel checkerboard must turn into even gray at any scale clearly below 1.
    let board = gradient(256, 256, |x, y| if (x as usize + y as usize).is_multiple_of(2) { 40.0 } else { 160.0 });
    for scale in [0.55, 0.3, 0.11] {
        let layout = canvas(30, 30, vec![moved(0, 256.0, 256.0, |p| (p * scale).into())]);
        let bytes = rows(&render(&layout, vec![board.clone()], &RenderOptions::default()));
        for y in 4..24 {
            for x in 4..24 {
                let level = bytes[(y * 30 + x) * 4];
                assert!(level.abs_diff(100) <= 12, "{level} at scale {scale}");
            }
        }
    }
}

#[test]
fn folds_are_counted_and_every_pixel_is_hit_once() {
    let mut folded = moved(0, 60.0, 60.0, |p| p.into());
    // Pull an inner vertex across its right neighbor.
    folded.mesh.target[5] = [55.0, 20.0];
    let layout = canvas(60, 60, vec![folded]);
    let context = StageContext::default();
    let options = RenderOptions { blend: Blend::Average, ..RenderOptions::default() };
    let photographs = Memory(vec![gradient(60, 60, |_, _| 90.0)]);
    let panorama = compose(&layout, &Corrections::plain(1), &photographs, &options, &context).expect("renders");
    let PanoramaPixels::Sums(sums) = &panorama.pixels else { panic!("a mean") };
    assert!((0..60).all(|y| sums.row(y).expect("in memory").iter().all(|sum| sum[3] <= 1.0)));
    let diagnostics = context.findings();
    assert_eq!(diagnostics[0].code, "grid-folded");
    assert!(diagnostics[0].message.starts_with("2 of 18"), "{}", diagnostics[0].message);
}

#[test]
fn photographs_outside_or_far_too_small_are_harmless() {
    let photograph = gradient(30, 30, |_, _| 90.0);
    let layout = canvas(
        20,
        20,
        vec![
            moved(0, 30.0, 30.0, |p| [p.x + 500.0, p.y - 900.0]),
            moved(0, 30.0, 30.0, |p| (p * 1e-7 + Vector2::repeat(7.5)).into()),
            moved(0, 30.0, 30.0, |_| [3.0, 3.0]),
            moved(0, 30.0, 30.0, |p| (p * 1e15).into()),
        ],
    );
    for blend in [Blend::Feather, Blend::MultiBand, Blend::None] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let panorama = render(&layout, vec![photograph.clone()], &options);
        assert!((0..400).all(|at| linear(&panorama, at % 20, at / 20).iter().all(|value| value.is_finite())));
    }
}

#[test]
fn photographs_of_another_size_are_refused() {
    let layout = canvas(30, 30, vec![moved(0, 30.0, 30.0, |p| p.into())]);
    let options = RenderOptions::default();
    for photograph in [noise(30, 29, 3), noise(30, 30, 2)] {
        let photographs = Memory(vec![Photograph::Eight(photograph)]);
        let result = compose(&layout, &Corrections::plain(1), &photographs, &options, &StageContext::default());
        assert!(matches!(result, Err(Error::Input { .. })));
    }
}

#[test]
fn an_empty_layout_is_transparent() {
    let layout = canvas(70, 30, vec![]);
    let panorama = render(&layout, vec![], &RenderOptions::default());
    assert!(matches!(panorama.pixels, PanoramaPixels::Sums(_)), "nothing to seek seams between");
    assert!(rows(&panorama).iter().all(|&byte| byte == 0));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let photographs: Vec<Photograph> = (0..5).map(|_| Photograph::Eight(noise(90, 70, 3))).collect();
    let placed =
        (0..5).map(|i| moved(i, 90.0, 70.0, |p| [p.x + 13.3 * i as f64, p.y * 1.1 + 0.002 * p.x * p.y])).collect();
    let layout = canvas(160, 110, placed);
    let of_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        let of = |blend| render(&layout, photographs.clone(), &RenderOptions { blend, ..RenderOptions::default() });
        pool.install(|| [Blend::MultiBand, Blend::Feather, Blend::None].map(|blend| bits(&of(blend))))
    };
    let single = of_threads(1);
    for threads in [2, 3] {
        assert!(single == of_threads(threads));
    }
}

/// Photographs whose samples keep what is brighter than white.
struct Lights(Memory, TransferCurve);

impl PhotographSource for Lights {
    fn photograph(&self, index: usize) -> Result<Photograph> {
        self.0.photograph(index)
    }

    fn transfer_curve(&self) -> TransferCurve {
        self.1.clone()
    }
}

/// Light of 0.01 to 160 times white over two photographs, of which the second was taken with a third of the light: it
/// comes out as it is, from canvases of any kind, and a picture of it is neither white nor black.
#[test]
fn light_above_white_comes_through() {
    let curve = TransferCurve::light(LightRange { white: 1.0, peak: 200.0 }).expect("a range");
    let light = |x: f64| 0.01 * 2_f64.powf(x * 14.0 / 140.0);
    let photograph = |left: f64, factor: f64| {
        let mut raster = Raster::new(90, 60, 3);
        for y in 0..60 {
            for x in 0..90 {
                let level = curve.encoded(factor * light(left + x as f64 + 0.5) / 200.0);
                raster.pixel_mut(x, y).fill((level * 65535.0).round() as u16);
            }
        }
        Photograph::Sixteen(raster)
    };
    let layout = canvas(140, 60, vec![moved(0, 90.0, 60.0, |p| p.into()), moved(1, 90.0, 60.0, |p| [p.x + 50.0, p.y])]);
    let photographs = Lights(Memory(vec![photograph(0.0, 1.0), photograph(50.0, 1.0 / 3.0)]), curve.clone());
    let corrections: Corrections = vec![Correction::uniform(1.0), Correction::uniform(3.0)].into();
    for blend in [Blend::MultiBand, Blend::Feather, Blend::None] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let input = RenderInput { layout: &layout, corrections: &corrections, photographs: &photographs };
        let context = StageContext::default();
        let rendered = run(&input, &Resources::unlimited(), &options, &SeamOptions::default(), None, &context);
        let panorama = rendered.expect("renders").panorama;
        let levels = rows(&panorama);
        // Near a photograph's border the coarse levels that are blended are one-sided, of so steep a gradient.
        let most = if blend == Blend::MultiBand { 0.08 } else { 0.01 };
        for x in 1..139 {
            let found = f64::from(linear(&panorama, x, 30)[1]);
            assert!((found / light(x as f64 + 0.5) - 1.0).abs() < most, "{blend:?} at {x}: {found}");
            assert!((1..255).contains(&levels[(30 * 140 + x) * 4]), "{blend:?} at {x}");
        }
        assert!((1..139).all(|x| levels[(30 * 140 + x) * 4] <= levels[(30 * 140 + x + 1) * 4]), "{blend:?}");
        // A photograph alone is the same.
        let alone = layer_rows(&input, 1, &options).expect("a layer").expect("on the canvas");
        let mut row = vec![0.0; alone.width() * 4];
        alone.linear_row(30, &mut row).expect("a row");
        let expected = light(alone.left as f64 + 40.5);
        assert!((f64::from(row[4 * 40]) / expected - 1.0).abs() < 0.01, "{blend:?}: {}", row[4 * 40]);
    }
}
