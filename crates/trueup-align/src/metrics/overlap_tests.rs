use super::*;

const WIDTH: usize = 20;
const HEIGHT: usize = 16;

fn gray(value: impl Fn(usize, usize) -> f32) -> Raster<f32> {
    let data = (0..WIDTH * HEIGHT).map(|index| value(index % WIDTH, index / WIDTH)).collect();
    Raster::from_data(WIDTH, HEIGHT, 1, data).expect("the right size")
}

fn pattern(x: usize, y: usize) -> f32 {
    ((x * 37 + y * 91 + x * y * 5) % 200 + 20) as f32
}

fn covered(value: impl Fn(usize, usize) -> bool) -> Raster<bool> {
    let data = (0..WIDTH * HEIGHT).map(|index| value(index % WIDTH, index / WIDTH)).collect();
    Raster::from_data(WIDTH, HEIGHT, 1, data).expect("the right size")
}

fn near(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-5 * expected.abs().max(1e-3), "{value} is not {expected}");
}

/// All figures computed apart, with NumPy, window by window.
#[test]
fn a_known_pair_has_its_known_figures() {
    let a = gray(pattern);
    let b = gray(|x, y| 0.8 * pattern(x, y) + ((x * 13 + y * 29) % 97) as f32);
    let covered = covered(|x, _| x >= 2);
    let found = OverlapPixels { a: &a, b: &b, covered: &covered }.measure().expect("an overlap");
    assert_eq!(found.pixels, 224);
    near(found.ncc_mse, 0.023957805);
    near(found.ncc_rmse, 0.023957805_f64.sqrt());
    near(found.intensity_mse, 1475.28643);
    near(found.psnr_db.expect("they differ"), 17.692505);
    near(found.ssim.expect("windows fit"), 0.84106519);
}

/// A brighter copy: uncorrelated in nothing, and equal after evening out.
#[test]
fn brightness_counts_in_the_intensities_alone() {
    let (a, b) = (gray(pattern), gray(|x, y| 0.5 * pattern(x, y)));
    let found = OverlapPixels { a: &a, b: &b, covered: &covered(|_, _| true) }.measure().expect("an overlap");
    assert!(found.ncc_mse < 1e-12);
    assert!(found.intensity_mse > 1000.0);
    assert!((found.ssim.expect("windows fit") - 1.0).abs() < 1e-9);
    assert!(found.psnr_db.is_none_or(|psnr_db| psnr_db > 200.0));
}

#[test]
fn flat_windows_are_passed_over_and_half_flat_ones_uncorrelated() {
    let (flat, busy) = (gray(|_, _| 90.0), gray(pattern));
    let all = covered(|_, _| true);
    assert_eq!(OverlapPixels { a: &flat, b: &flat, covered: &all }.measure(), None);
    let half = OverlapPixels { a: &flat, b: &busy, covered: &all }.measure().expect("texture in one");
    near(half.ncc_mse, 1.0);
}

#[test]
fn no_overlap_or_sizes_that_differ_have_no_figures() {
    let a = gray(pattern);
    assert_eq!(OverlapPixels { a: &a, b: &a, covered: &covered(|_, _| false) }.measure(), None);
    let small = Raster::new(3, 3, 1);
    assert_eq!(OverlapPixels { a: &a, b: &small, covered: &covered(|_, _| true) }.measure(), None);
}

#[test]
fn erosion_takes_a_rim_off_and_fills_no_hole() {
    let holed = covered(|x, y| (x, y) != (10, 8));
    let inside = eroded(&holed, 2);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let near_border = x < 2 || y < 2 || x >= WIDTH - 2 || y >= HEIGHT - 2;
            let near_hole = x.abs_diff(10) <= 2 && y.abs_diff(8) <= 2;
            assert_eq!(inside.pixel(x, y)[0], !near_border && !near_hole, "{x} {y}");
        }
    }
}

#[test]
fn larger_overlaps_count_more() {
    let one = OverlapMeasures {
        pixels: 100,
        ncc_rmse: 0.2,
        ncc_mse: 0.04,
        intensity_mse: 10.0,
        psnr_db: Some(30.0),
        ssim: None,
    };
    let other = OverlapMeasures { pixels: 300, ncc_rmse: 0.6, ncc_mse: 0.36, ssim: Some(0.5), psnr_db: None, ..one };
    let mean = mean_over_overlaps(&[one, other]).expect("two overlaps");
    assert_eq!(mean.pixels, 400);
    near(mean.ncc_rmse, 0.5);
    near(mean.ncc_mse, 0.28);
    assert_eq!((mean.psnr_db, mean.ssim), (Some(30.0), Some(0.5)));
    assert_eq!(mean_over_overlaps(&[]), None);
}
