//! Speed of line detection on a drawn street of facades: `cargo bench -p trueup-vision --bench lines`.

use trueup_core::StageContext;
use trueup_core::raster::Raster;
use trueup_vision::lines::{LineOptions, detect};

fn main() {
    divan::main();
}

/// A size in pixels.
#[derive(Debug, Clone, Copy)]
struct Size {
    width: usize,
    height: usize,
}

const SIZES: [Size; 3] =
    [Size { width: 800, height: 600 }, Size { width: 1168, height: 879 }, Size { width: 1488, height: 1120 }];

/// Facades of bricks and windows on a receding wall: about as many segments a megapixel as a photograph of a town.
fn facades(Size { width, height }: Size) -> Raster<f32> {
    let mut state = 1_u32;
    let samples = (0..width * height).map(|index| {
        let (x, y) = ((index % width) as f32, (index / width) as f32);
        // A wall that recedes to the right: u along it, v up it, in wall units of about a pixel.
        let depth = 1.0 + x / width as f32;
        let (u, v) = (x * depth + 0.02 * y, (y - 0.5 * height as f32) * depth);
        let window = (u.rem_euclid(90.0) - 45.0).abs() < 24.0 && (v.rem_euclid(120.0) - 60.0).abs() < 36.0;
        let bar = (u.rem_euclid(90.0) - 45.0).abs() < 2.0 || (v.rem_euclid(40.0) - 20.0).abs() < 2.0;
        let joint = v.rem_euclid(17.0) < 2.0 || (u + 15.0 * (v / 17.0).floor()).rem_euclid(43.0) < 2.0;
        let level = match (window, bar, joint) {
            (true, true, _) => 215.0,
            (true, false, _) => 50.0,
            (false, _, true) => 160.0,
            (false, _, false) => 120.0,
        };
        // A linear congruential generator: noise of standard deviation 2.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        level + (state >> 16) as f32 / 65_536.0 * 7.0
    });
    Raster::from_data(width, height, 1, samples.collect()).expect("sizes agree")
}

#[divan::bench(args = SIZES)]
fn detect_lines(bencher: divan::Bencher, size: Size) {
    let picture = facades(size);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    let run = || detect(&picture, &LineOptions::default(), &StageContext::default());
    bencher
        .counter(divan::counter::ItemsCount::new(size.width * size.height))
        .bench_local(|| pool.install(run).map(|found| found.len()));
}
