//! Speed of the exhaustive search and of the verification of a pair, on generated descriptors.

use divan::Bencher;
use rand::{Rng, RngExt};
use rayon::ThreadPool;
use trueup_core::StageContext;
use trueup_core::source::WorkingFrame;
use trueup_core::told_lens::ToldLens;
use trueup_vision::features::{DESCRIPTOR_LENGTH, Descriptor, FeaturePoint, Features};
use trueup_vision::matching::{Demand, MatchingInput, MatchingOptions, Nearest, SearchKernel, putative_matches, run};

/// Features of a photograph at the detector's cap.
const FEATURES: usize = 8000;

fn main() {
    divan::main();
}

fn pool(threads: usize) -> ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool")
}

fn descriptors(subject: u64, count: usize) -> Vec<Descriptor> {
    let mut generator = StageContext::default().generator("bench", subject);
    let mut descriptors = vec![[0; DESCRIPTOR_LENGTH]; count];
    descriptors.iter_mut().for_each(|descriptor| generator.fill_bytes(descriptor));
    descriptors
}

/// Photographs of which `matched` features look alike, the first `inliers` of them shifted by 200 pixels.
fn photographs(count: usize, matched: usize, inliers: usize) -> [Features; 2] {
    let mut generator = StageContext::default().generator("bench", 0);
    let mut b = descriptors(2, count);
    let a = descriptors(1, count);
    b[..matched].copy_from_slice(&a[..matched]);
    let mut place = || [generator.random_range(200.0..800.0), generator.random_range(0.0..600.0)];
    let places_a: Vec<[f64; 2]> = (0..count).map(|_| place()).collect();
    let mut places_b: Vec<[f64; 2]> = (0..count).map(|_| place()).collect();
    for (b, a) in places_b.iter_mut().zip(&places_a).take(inliers) {
        *b = [a[0] - 200.0, a[1]];
    }
    [(a, places_a), (b, places_b)].map(|(descriptors, places)| Features {
        points: places.iter().map(|&position| FeaturePoint { position, scale_px: 2.0, response: 10.0 }).collect(),
        descriptor_points: (0..count as u32).collect(),
        descriptors,
        ..Features::default()
    })
}

/// Both directions' nearest neighbors of 8000 x 8000 descriptors.
#[divan::bench(args = [1, 2])]
fn search_8000_by_8000(bencher: Bencher, threads: usize) {
    let (a, b) = (descriptors(1, FEATURES), descriptors(2, FEATURES));
    let pool = pool(threads);
    bencher.bench_local(|| pool.install(|| Nearest::search(&a, &b)));
}

/// The same on one thread with every instruction set.
#[divan::bench(args = SearchKernel::available(), sample_count = 10)]
fn search_by_kernel(bencher: Bencher, kernel: SearchKernel) {
    let (a, b) = (descriptors(1, FEATURES), descriptors(2, FEATURES));
    let pool = pool(1);
    bencher.bench_local(|| pool.install(|| Nearest::search_with(kernel, &a, &b)));
}

/// The same up to the putative matches, 3000 of them.
#[divan::bench(args = [1, 2])]
fn putative_8000_by_8000(bencher: Bencher, threads: usize) {
    let [a, b] = photographs(FEATURES, 3000, 1500);
    let (pool, options) = (pool(threads), MatchingOptions::default());
    bencher.bench_local(|| pool.install(|| putative_matches(&a, &b, &options)));
}

/// A whole pair of 600 matches, half of them outliers.
#[divan::bench]
fn verify_half_outliers(bencher: Bencher) {
    let features = photographs(600, 600, 300);
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let options = MatchingOptions::default();
    let context = StageContext::default();
    let told = [ToldLens::default(); 2];
    let (frames, demand) = (&[frame; 2], Demand::Test);
    let input = MatchingInput { features: &features, frames, told: &told, pairs: &[(0, 1)], demand };
    let pool = pool(1);
    bencher.bench_local(|| pool.install(|| run(&input, &options, &context)));
}
