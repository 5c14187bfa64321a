//! Speed of feature detection on a synthetic texture, on one thread and on all.

use divan::Bencher;
use divan::counter::ItemsCount;
use rand::RngExt;
use trueup_core::StageContext;
use trueup_core::raster::Raster;
use trueup_vision::features::{FeatureOptions, detect};

fn main() {
    divan::main();
}

/// A size in pixels.
#[derive(Debug, Clone, Copy)]
struct Size {
    width: usize,
    height: usize,
}

/// The pipeline's working size and one megapixel.
const SIZES: [Size; 2] = [Size { width: 800, height: 600 }, Size { width: 1224, height: 817 }];

/// Of so few points a picture counts as sparse: it is searched again, doubled.
const SPARSE: usize = 999;

/// Noise at many scales, each half as fine and as strong again: the spectrum of photographs, roughly.
fn texture(Size { width, height }: Size) -> Raster<f32> {
    const SCALES: u32 = 7;
    let mut generator = StageContext::default().generator("features bench", 0);
    let mut samples = vec![128.0_f32; width * height];
    for scale in 0..SCALES {
        let cell = 1 << scale;
        let (columns, rows) = (width / cell + 2, height / cell + 2);
        let amplitude = 6.0 * 1.5_f32.powi(scale as i32);
        let lattice: Vec<f32> = (0..columns * rows).map(|_| generator.random_range(-amplitude..amplitude)).collect();
        for y in 0..height {
            for x in 0..width {
                let (left, top) = (x / cell, y / cell);
                let (u, v) = ((x % cell) as f32 / cell as f32, (y % cell) as f32 / cell as f32);
                let at = |row: usize, column: usize| lattice[row * columns + column];
                let upper = at(top, left) * (1.0 - u) + at(top, left + 1) * u;
                let lower = at(top + 1, left) * (1.0 - u) + at(top + 1, left + 1) * u;
                samples[y * width + x] += upper * (1.0 - v) + lower * v;
            }
        }
    }
    Raster::from_data(width, height, 1, samples).unwrap_or_default()
}

fn run(bencher: Bencher, size: Size, max_points: usize, threads: usize) {
    let picture = texture(size);
    let options = FeatureOptions { max_points, ..FeatureOptions::default() };
    // Zero threads means as many as there are processors.
    let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { return };
    bencher
        .counter(ItemsCount::new(size.width * size.height))
        .bench_local(|| pool.install(|| detect(&picture, &options, &StageContext::default())));
}

#[divan::bench(args = SIZES)]
fn one_thread(bencher: Bencher, size: Size) {
    run(bencher, size, FeatureOptions::default().max_points, 1);
}

#[divan::bench(args = SIZES)]
fn all_threads(bencher: Bencher, size: Size) {
    run(bencher, size, FeatureOptions::default().max_points, 0);
}

/// At the original size and doubled.
#[divan::bench(args = SIZES)]
fn one_thread_sparse(bencher: Bencher, size: Size) {
    run(bencher, size, SPARSE, 1);
}

/// At the original size and doubled.
#[divan::bench(args = SIZES)]
fn all_threads_sparse(bencher: Bencher, size: Size) {
    run(bencher, size, SPARSE, 0);
}
