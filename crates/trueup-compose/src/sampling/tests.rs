use trueup_core::raster::{Photograph, Raster};

use super::*;
use crate::kernel::Bicubic;

fn positions(points: &[(f64, f64)]) -> Positions {
    let mut positions = Positions::default();
    for &(x, y) in points {
        let (x, y) = (x - 0.5, y - 0.5);
        positions.column.push(x.floor() as i32);
        positions.row.push(y.floor() as i32);
        positions.fraction_x.push((x - x.floor()) as f32);
        positions.fraction_y.push((y - y.floor()) as f32);
    }
    positions
}

fn sample<K: InterpolationKernel>(photograph: &Photograph, stretch: [f64; 2], points: &[(f64, f64)]) -> Vec<[f32; 4]> {
    let mut out = vec![[0.0; 4]; points.len()];
    interpolate::<K>(photograph, &positions(points), stretch, &mut out, &mut Vec::new());
    out
}

fn noise(width: usize, height: usize, channels: usize) -> Raster<u8> {
    let data = (0..width * height * channels).map(|i| ((i * 2_654_435_761) >> 13) as u8).collect();
    Raster::from_data(width, height, channels, data).expect("as many samples")
}

fn scattered_points() -> Vec<(f64, f64)> {
    (0..2000).map(|i| (f64::from(i) * 0.013 - 1.0, f64::from((i * 37) % 1900) * 0.01 - 1.0)).collect()
}

/// Keys' kernel for a = -1/2, equation 4 of his paper, in double precision.
fn keys(distance: f64) -> f64 {
    const A: f64 = -0.5;
    match distance.abs() {
        s if s < 1.0 => (A + 2.0) * s.powi(3) - (A + 3.0) * s.powi(2) + 1.0,
        s if s < 2.0 => A * s.powi(3) - 5.0 * A * s.powi(2) + 8.0 * A * s - 4.0 * A,
        _ => 0.0,
    }
}

/// Whatever instructions the processor has: the sum over the samples around a place, by the kernel's definition.
#[test]
fn interpolation_is_the_kernels_sum() {
    let raster = noise(23, 17, 3);
    let points = scattered_points();
    let found = sample::<Bicubic>(&Photograph::Eight(raster.clone()), [1.0, 1.0], &points);
    assert_eq!(found.len(), points.len());
    for (&(x, y), found) in points.iter().zip(&found) {
        let mut sums = [0.0; 3];
        let first = [x, y].map(|coordinate| (coordinate - 0.5).floor() as i64 - 1);
        for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (first[1] + row, first[0] + column))) {
            let weight = keys(x - 0.5 - column as f64) * keys(y - 0.5 - row as f64);
            let pixel = raster.pixel(column.clamp(0, 22) as usize, row.clamp(0, 16) as usize);
            sums.iter_mut().zip(pixel).for_each(|(sum, &level)| *sum += weight * f64::from(level));
        }
        for (found, expected) in found.iter().zip(sums) {
            // Columns in 64ths of a level, over weights whose sizes add up to at most 1.25; weights in 16384ths,
            // rounded.
            assert!((f64::from(*found) - expected).abs() < 0.05, "{found} for {expected} at ({x}, {y})");
        }
        assert_eq!(found[3], 255.0);
    }
}

/// Whether the processor has what the vector form is made of.
fn has_vector_form() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    false
}

#[test]
fn vector_and_portable_forms_agree_bit_for_bit() {
    if !has_vector_form() {
        eprintln!("skipped: this processor has no AVX2, so that the portable form alone is there");
        return;
    }
    let raster = noise(23, 17, 3);
    let points = scattered_points();
    let positions = positions(&points);
    let fast = sample::<Bicubic>(&Photograph::Eight(raster.clone()), [1.0, 1.0], &points);
    for (index, fast) in fast.iter().enumerate() {
        let slow = cubic_at_border(&raster, &positions, index);
        assert_eq!(fast.map(f32::to_bits), slow.map(f32::to_bits), "at {:?}", points[index]);
    }
}

#[test]
fn all_depths_and_layouts_agree_on_a_gray_photograph() {
    let gray = noise(16, 12, 1);
    let rgb: Vec<u8> = gray.data().iter().flat_map(|&level| [level; 3]).collect();
    let rgba: Vec<u8> = gray.data().iter().flat_map(|&level| [level, level, level, 255]).collect();
    let deep: Vec<u16> = rgb.iter().map(|&level| u16::from(level) * 257).collect();
    let photographs = [
        Photograph::Eight(gray),
        Photograph::Eight(Raster::from_data(16, 12, 3, rgb).expect("rgb")),
        Photograph::Eight(Raster::from_data(16, 12, 4, rgba).expect("rgba")),
        Photograph::Sixteen(Raster::from_data(16, 12, 3, deep).expect("deep")),
    ];
    let points = [(0.5, 0.5), (3.3, 4.9), (15.99, 11.99), (8.0, 6.0), (-3.0, 40.0)];
    for stretch in [[1.0, 1.0], [2.3, 1.4]] {
        let expected = sample::<Bicubic>(&photographs[0], stretch, &points);
        for photograph in &photographs[1..] {
            for (got, expected) in sample::<Bicubic>(photograph, stretch, &points).iter().zip(&expected) {
                for (got, expected) in got.iter().zip(expected) {
                    // Masked photographs are averaged without negative lobes, so only the plain form must agree there.
                    let tolerance = if photograph.channels() == 4 && stretch != [1.0, 1.0] { 60.0 } else { 0.05 };
                    assert!((got - expected).abs() < tolerance, "{got} {expected}");
                }
            }
        }
    }
}

#[test]
fn parabolas_are_interpolated_exactly() {
    let level = |x: f64, y: f64| 20.0 + x * x / 4.0 + y * y / 8.0 - x * y / 16.0;
    let data = (0..20 * 16).map(|i| (level(f64::from(i % 20), f64::from(i / 20)) * 257.0).round() as u16).collect();
    let photograph = Photograph::Sixteen(Raster::from_data(20, 16, 1, data).expect("20 x 16"));
    for (x, y) in [(4.3, 5.7), (10.5, 8.25), (15.9, 12.1)] {
        let got = sample::<Bicubic>(&photograph, [1.0, 1.0], &[(x, y)])[0][0];
        assert!((f64::from(got) - level(x - 0.5, y - 0.5)).abs() < 0.01);
    }
}

#[test]
fn a_widened_kernel_removes_what_the_canvas_cannot_hold() {
    // Columns alternate between 0 and 200: at a third of the scale only their mean may remain.
    let data = (0..64 * 8).map(|i| if i % 2 == 0 { 0_u8 } else { 200 }).collect();
    let photograph = Photograph::Eight(Raster::from_data(64, 8, 1, data).expect("64 x 8"));
    let points: Vec<(f64, f64)> = (4..18).map(|i| (3.0 * f64::from(i) + 0.4, 4.0)).collect();
    for sampled in sample::<Bicubic>(&photograph, [3.0, 1.0], &points) {
        assert!((sampled[0] - 100.0).abs() < 4.0, "{}", sampled[0]);
    }
}

#[test]
fn colors_under_transparency_do_not_show() {
    let data = (0..8 * 8).flat_map(|i| if i % 8 < 4 { [180_u8, 90, 30, 255] } else { [0, 255, 0, 0] }).collect();
    let photograph = Photograph::Eight(Raster::from_data(8, 8, 4, data).expect("8 x 8"));
    for stretch in [[1.0, 1.0], [1.7, 1.7]] {
        for sampled in sample::<Bicubic>(&photograph, stretch, &[(3.9, 4.0), (4.2, 3.0)]) {
            assert!((sampled[0] - 180.0).abs() < 1e-3 && (sampled[1] - 90.0).abs() < 1e-3);
            assert!(sampled[3] > 0.0 && sampled[3] < 255.0);
        }
    }
    assert_eq!(sample::<Bicubic>(&photograph, [1.0, 1.0], &[(7.5, 4.0)])[0], [0.0; 4]);
}

#[test]
fn a_single_pixel_is_a_photograph() {
    let photograph = Photograph::Eight(Raster::from_data(1, 1, 3, vec![7, 8, 9]).expect("one pixel"));
    for sampled in sample::<Bicubic>(&photograph, [1.0, 1.0], &[(0.5, 0.5), (-4.0, 9.0)]) {
        assert_eq!(sampled, [7.0, 8.0, 9.0, 255.0]);
    }
}

/// Narrow kernels are read in eights: what comes of it is what comes of one sample after the other, up to the border.
#[test]
fn narrow_means_are_those_of_single_samples() {
    let raster = noise(23, 17, 3);
    let points = scattered_points();
    for stretch in [[1.0, 1.3], [1.7, 1.1], [1.99, 1.99], [2.0, 1.2], [3.1, 1.0]] {
        let found = sample::<Bicubic>(&Photograph::Eight(raster.clone()), stretch, &points);
        let (wx, wy, columns) = ([0.0; MAX_TAPS], [0.0; MAX_TAPS], [0.0; 3 * MAX_TAPS]);
        let mut workspace = Workspace { wx, wy, columns };
        let positions = positions(&points);
        for (index, found) in found.iter().enumerate() {
            let one = average_one::<Bicubic, u8, 3>(&raster, &positions, index, stretch, &mut workspace);
            assert_eq!(found.map(f32::to_bits), one.map(f32::to_bits), "{stretch:?} at {:?}", points[index]);
        }
    }
}
