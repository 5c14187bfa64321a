//! Rows of panoramas and of single layers, at every depth.

use trueup_core::color::TransferCurve;
use trueup_core::raster::{Photograph, Raster, RowSource};

use super::test_rendering::{compose, render};
use super::*;
use crate::layout::{self, CanvasOptions};
use crate::light::{Correction, Corrections, Response};
use crate::test_photographs::{Memory, canvas, gradient, moved, noise};

/// A gradient of gray moved by (30, 20): its layer is that box, with the levels it has.
#[test]
fn a_layer_is_one_photograph_where_it_lies() {
    let photographs = Memory(vec![gradient(100, 80, |x, _| x), gradient(60, 40, |x, y| 50.0 + x + 2.0 * y)]);
    let placed = vec![moved(0, 100.0, 80.0, |p| p.into()), moved(1, 60.0, 40.0, |p| [p.x + 30.0, p.y + 20.0])];
    let context = StageContext::default();
    let layout = layout::run(placed, 0, &CanvasOptions::default(), &context).expect("two grids");
    let corrections = Corrections::plain(2);
    let input = RenderInput { layout: &layout, corrections: &corrections, photographs: &photographs };
    let found = layer(&input, 1, &RenderOptions::default()).expect("a layer");
    // The extrapolated rim may reach a pixel beyond the photograph; it is not covered.
    for y in 0..layout.height {
        for x in 0..layout.width {
            let inside = (30..90).contains(&x) && (20..60).contains(&y);
            let in_box = x >= found.left
                && y >= found.top
                && x < found.left + found.gray.width()
                && y < found.top + found.gray.height();
            assert!(in_box || !inside, "{x} {y}");
            if in_box {
                let (column, row) = (x - found.left, y - found.top);
                assert_eq!(found.covered.pixel(column, row)[0], inside, "{x} {y}");
                let expected = 50.0 + (x as f32 - 29.5) + 2.0 * (y as f32 - 19.5);
                assert!(!inside || (found.gray.pixel(column, row)[0] - expected).abs() <= 1.0, "{x} {y}");
            }
        }
    }
    let rows = layer_rows(&input, 1, &RenderOptions::default()).expect("a layer").expect("on the canvas");
    assert_eq!([rows.left, rows.top], [found.left, found.top]);
    assert_eq!([rows.width(), rows.height()], [found.gray.width(), found.gray.height()]);
    assert_eq!(layer_size(&layout, 1), [rows.width(), rows.height()]);
    let (mut eight, mut sixteen) = (vec![0; 4 * rows.width()], vec![0; 4 * rows.width()]);
    for y in 0..rows.height() {
        rows.rgba8_row(y, &mut eight).expect("a row");
        rows.rgba16_row(y, &mut sixteen).expect("a row");
        for x in 0..rows.width() {
            let covered = found.covered.pixel(x, y)[0];
            assert_eq!(eight[4 * x + 3] == 255, covered, "{x} {y}");
            assert!(!covered || (f32::from(eight[4 * x]) - found.gray.pixel(x, y)[0]).abs() < 0.01);
            assert!(!covered || (f32::from(sixteen[4 * x]) / 257.0 - f32::from(eight[4 * x])).abs() <= 0.505);
        }
    }
    assert!(layer(&input, 2, &RenderOptions::default()).is_err());
}

/// The rows of one panorama at every depth say the same, from sums and from roots.
#[test]
fn rows_of_every_depth_agree() {
    let layout = canvas(90, 50, vec![moved(0, 80.0, 40.0, |p| [p.x + 4.3, p.y + 5.6])]);
    for blend in [Blend::Feather, Blend::MultiBand] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let panorama = render(&layout, vec![Photograph::Eight(noise(80, 40, 3))], &options);
        let mut compared = 0;
        let (mut eight, mut sixteen, mut linear) = (vec![0; 360], vec![0; 360], vec![0.0; 360]);
        for y in 0..50 {
            panorama.rgba8_row(y, &mut eight).expect("rows in memory");
            panorama.rgba16_row(y, &mut sixteen).expect("rows in memory");
            panorama.linear_row(y, &mut linear).expect("rows in memory");
            for x in 0..90 {
                let at = 4 * x..4 * x + 4;
                let linear = &linear[at.clone()];
                // A part of a pixel too small for 8 bits of alpha is left out there.
                if eight[at.end - 1] == 0 {
                    continue;
                }
                compared += 1;
                for ((&eight, &sixteen), channel) in eight[at.clone()].iter().zip(&sixteen[at]).zip(0..) {
                    assert!((f32::from(sixteen) / 257.0 - f32::from(eight)).abs() <= 0.505, "{eight} {sixteen}");
                    let light = f64::from(linear[channel]).min(1.0);
                    let encoded = match channel {
                        3 => light,
                        _ if light <= 0.0031308 => 12.92 * light,
                        _ => 1.055 * light.powf(1.0 / 2.4) - 0.055,
                    };
                    assert!((encoded * 65535.0 - f64::from(sixteen)).abs() < 0.6, "{encoded} {sixteen}");
                }
            }
        }
        // The photograph has 80 x 40 pixels.
        assert!(compared >= 80 * 40, "{blend:?}: {compared}");
    }
}

/// What is shown as it was taken keeps its samples, whatever the response; floating point stays the profile's light.
#[test]
fn a_response_leaves_the_look_of_a_photograph() {
    let response = Response { coefficients: [0.1, -0.6, 0.5, 0.2] };
    let ramp = |levels: usize, level: &dyn Fn(usize) -> u16| -> Vec<u16> {
        (0..levels).flat_map(|at| [level(at), level(levels - 1 - at), level(at)]).collect()
    };
    let eight: Vec<u8> = ramp(256, &|at| at as u16).iter().map(|&level| level as u8).collect();
    let sixteen = ramp(256, &|at| at as u16 * 257);
    let eight = Photograph::Eight(Raster::from_data(256, 1, 3, eight).expect("as many samples"));
    let sixteen = Photograph::Sixteen(Raster::from_data(256, 1, 3, sixteen).expect("as many samples"));
    let layout = canvas(256, 1, vec![moved(0, 256.0, 1.0, |p| [p.x, p.y])]);
    let corrections = Corrections { response, photographs: vec![Correction::default()] };
    for blend in [Blend::MultiBand, Blend::None, Blend::Feather, Blend::Average] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        for photograph in [eight.clone(), sixteen.clone()] {
            let context = StageContext::default();
            let panorama =
                compose(&layout, &corrections, &Memory(vec![photograph]), &options, &context).expect("renders");
            let (mut levels, mut fine, mut light) = (vec![0; 1024], vec![0; 1024], vec![0.0; 1024]);
            panorama.rgba8_row(0, &mut levels).expect("a row");
            panorama.rgba16_row(0, &mut fine).expect("a row");
            panorama.linear_row(0, &mut light).expect("a row");
            for x in 0..256 {
                let expected = TransferCurve::SRGB.linear(x as f64 / 255.0);
                assert_eq!(usize::from(levels[4 * x]), x, "{blend:?}");
                // Square roots in 16 bits are this fine, and coarser in the darkest hundredth.
                assert!(fine[4 * x].abs_diff(x as u16 * 257) <= 2, "{blend:?} {x}: {}", fine[4 * x]);
                assert!((f64::from(light[4 * x]) - expected).abs() < 1e-4, "{blend:?} {x}: {}", light[4 * x]);
                assert_eq!(panorama.linear_pixel(x, 0).expect("in memory"), light[4 * x..4 * x + 4], "{blend:?}");
            }
        }
    }
}
